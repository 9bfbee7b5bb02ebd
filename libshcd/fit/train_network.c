/* SPDX-License-Identifier: BSD-3-Clause */
/* The unknowns are a_ip, i = 0 the constant and i > 0 the centres, p the terms in the depth:
 *   U = D^2/2 k, k = sum_i psi_i(x) sum_p a_ip T_p(t), t = 2 D/M - 1, M the largest depth.
 * Every sample gives up to four linear equations, all in newtons:
 *   energy U/D    = (D/2) sum a_ip psi_i T_p
 *   force  dU/dD  = sum a_ip psi_i (D T_p + D^2/M T_p')
 *   slope  dU/dx  = (D^2/2) sum a_ip (dpsi_i/dx) T_p, along two tangents of the surface.
 * An equation is a Kronecker product of a vector over the centres, which depends on the place only,
 * and one over the terms; so the normal matrix is a sum over places of (v v^T) x B, B the sum of
 * b b^T over the samples of the place. A speed adds one unknown, F += c D speed.
 *
 * Ridge: penalty times the mean diagonal on a_ip, i > 0; constants and c are free. Support of the
 * kernels, number of terms and penalty come from cross-validation: the places are dealt out to
 * FOLDS heaps, each is predicted from the others, and the rms of the force is compared. There are
 * no more terms than distinct depths. */
#include "train_network.h"

#include "shcd/vec.h"

#include <gsl/gsl_errno.h>
#include <gsl/gsl_linalg.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define FOLDS 3

/* Candidates. Supports are in units of the fill distance: neighbours are about one apart, so that
 * the narrowest covers about 30 centres on a surface. */
static const double supports[] = {4.0, 8.0, 16.0};
static const double ridges[] = {1e-10, 1e-8, 1e-6, 1e-4, 1e-2};
#define N_SUPPORTS (sizeof supports / sizeof supports[0])
#define N_RIDGES (sizeof ridges / sizeof ridges[0])

typedef struct problem {
    const shcdi_train_set *set;
    const shcdi_progress *progress;
    const double *centre;         /* 3 each */
    size_t n_centres, n_terms, n; /* n: unknowns */
    int has_speed;
    int use_force;  /* 0: energies only */
    double damping; /* c, once it is found */
    double support;
    double *basis; /* psi_i and its derivatives along the two tangents: 3 (n_centres + 1) */
    double *matrix[FOLDS + 1], *rhs[FOLDS + 1]; /* of each heap, and their sum */
    double *work, *solution;
} problem;

/* ---- centres ---- */

void shcdi_train_greedy(const shcdi_train_set *set, size_t start, size_t n, size_t *chosen,
                        double *distance) {
    size_t next = start;
    for (size_t i = 0; i < set->n_places; i++) {
        distance[i] = (double)INFINITY;
    }
    for (size_t j = 0; j < n; j++) {
        const shcd_vec3 c = set->place[next].point_m;
        chosen[j] = next;
        size_t farthest = 0;
        for (size_t i = 0; i < set->n_places; i++) {
            distance[i] = fmin(distance[i], shcd_norm(shcd_sub(set->place[i].point_m, c)));
            farthest = distance[i] > distance[farthest] ? i : farthest;
        }
        next = farthest;
    }
}

/* ---- equations ---- */

static void fill_basis(const problem *q, const shcdi_train_place *place) {
    const size_t stride = q->n_centres + 1;
    q->basis[0] = 1.0;
    q->basis[stride] = q->basis[2 * stride] = 0.0;
    for (size_t j = 0; j < q->n_centres; j++) {
        const double *c = q->centre + 3 * j;
        const shcd_vec3 d = shcd_sub(place->point_m, shcd_vec3_make(c[0], c[1], c[2]));
        const double r = shcd_norm(d) / q->support, t = fmax(0.0, 1.0 - r), t5 = t * t * t * t * t;
        const double slope = -56.0 / 3.0 * t5 * (5.0 * r + 1.0) / (q->support * q->support);
        q->basis[1 + j] = t5 * t * (35.0 * r * r + 18.0 * r + 3.0) / 3.0;
        q->basis[stride + 1 + j] = slope * shcd_dot(d, place->tangent[0]);
        q->basis[2 * stride + 1 + j] = slope * shcd_dot(d, place->tangent[1]);
    }
}

/* The parts over the terms of the three kinds of equations. */
typedef struct depth_part {
    double energy[SHCD_LEARNED_TERMS_MAX], force[SHCD_LEARNED_TERMS_MAX];
    double slope[SHCD_LEARNED_TERMS_MAX];
} depth_part;

static depth_part part_of(const problem *q, double depth) {
    const double m = q->set->depth_max_m, t = 2.0 * depth / m - 1.0;
    depth_part part;
    double t0 = 1.0, t1 = t, d0 = 0.0, d1 = 1.0;
    for (size_t p = 0; p < q->n_terms; p++) {
        part.energy[p] = 0.5 * depth * t0;
        part.force[p] = depth * t0 + depth * depth / m * d0;
        part.slope[p] = 0.5 * depth * depth * t0;
        const double t2 = 2.0 * t * t1 - t0, d2 = 2.0 * t1 + 2.0 * t * d1 - d0;
        t0 = t1;
        t1 = t2;
        d0 = d1;
        d1 = d2;
    }
    return part;
}

/* Sums over the samples of a place: B = sum b b^T and sum b value, for one kind of equation. */
typedef struct moment {
    double b[SHCD_LEARNED_TERMS_MAX][SHCD_LEARNED_TERMS_MAX], value[SHCD_LEARNED_TERMS_MAX];
} moment;

static void add_moment(moment *m, size_t n_terms, const double *b, double value) {
    for (size_t p = 0; p < n_terms; p++) {
        for (size_t r = 0; r < n_terms; r++) {
            m->b[p][r] += b[p] * b[r];
        }
        m->value[p] += b[p] * value;
    }
}

/* matrix += (v v^T) x B, its lower triangle in blocks, and the right-hand side. */
static void add_product(const problem *q, const double *v, const moment *m, double *matrix,
                        double *rhs) {
    const size_t n_terms = q->n_terms, n = q->n;
    for (size_t i = 0; i <= q->n_centres; i++) {
        if (v[i] == 0.0) {
            continue;
        }
        for (size_t p = 0; p < n_terms; p++) {
            double *row = matrix + (i * n_terms + p) * n;
            for (size_t j = 0; j <= i; j++) {
                const double w = v[i] * v[j];
                for (size_t r = 0; r < n_terms; r++) {
                    row[j * n_terms + r] += w * m->b[p][r];
                }
            }
            rhs[i * n_terms + p] += v[i] * m->value[p];
        }
    }
}

/* The last unknown: F += c D speed. */
static void add_speed(const problem *q, const double *force, const shcdi_train_row *row,
                      double *matrix, double *rhs) {
    const size_t last = q->n - 1;
    const double b = row->depth_m * row->speed_m_per_s;
    for (size_t i = 0; i <= q->n_centres; i++) {
        for (size_t p = 0; p < q->n_terms; p++) {
            matrix[last * q->n + i * q->n_terms + p] += b * q->basis[i] * force[p];
        }
    }
    matrix[last * q->n + last] += b * b;
    rhs[last] += b * row->force_n;
}

static void add_place(const problem *q, const shcdi_train_place *place, double *matrix,
                      double *rhs) {
    moment value = {{{0.0}}, {0.0}}, slope[2] = {{{{0.0}}, {0.0}}, {{{0.0}}, {0.0}}};
    int has_slope = 0;
    fill_basis(q, place);
    for (size_t i = place->first; i < place->first + place->n; i++) {
        const shcdi_train_row *row = q->set->row + i;
        const depth_part part = part_of(q, row->depth_m);
        if (row->energy_j - row->energy_j == 0.0) {
            add_moment(&value, q->n_terms, part.energy, row->energy_j / row->depth_m);
        }
        if (q->use_force) {
            add_moment(&value, q->n_terms, part.force, row->force_n);
            if (q->has_speed) {
                add_speed(q, part.force, row, matrix, rhs);
            }
        }
        if (row->slope_n[0] - row->slope_n[0] == 0.0) {
            has_slope = 1;
            add_moment(&slope[0], q->n_terms, part.slope, row->slope_n[0]);
            add_moment(&slope[1], q->n_terms, part.slope, row->slope_n[1]);
        }
    }
    add_product(q, q->basis, &value, matrix, rhs);
    for (size_t e = 0; has_slope && e < 2; e++) {
        add_product(q, q->basis + (e + 1) * (q->n_centres + 1), &slope[e], matrix, rhs);
    }
}

/* The normal matrices of the heaps and of all. */
static shcd_status assemble(problem *q, size_t n_heaps) {
    for (size_t k = 0; k <= FOLDS; k++) {
        memset(q->matrix[k], 0, q->n * q->n * sizeof(double));
        memset(q->rhs[k], 0, q->n * sizeof(double));
    }
    for (size_t i = 0; i < q->set->n_places; i++) {
        const size_t heap = n_heaps > 1 ? i % n_heaps : FOLDS;
        const shcd_status status =
            shcdi_progress_report(q->progress, "equations", (double)i / (double)q->set->n_places);
        if (status != SHCD_OK) {
            return status;
        }
        add_place(q, &q->set->place[i], q->matrix[heap], q->rhs[heap]);
    }
    for (size_t k = 0; n_heaps > 1 && k < n_heaps; k++) {
        for (size_t i = 0; i < q->n * q->n; i++) {
            q->matrix[FOLDS][i] += q->matrix[k][i];
        }
        for (size_t i = 0; i < q->n; i++) {
            q->rhs[FOLDS][i] += q->rhs[k][i];
        }
    }
    return SHCD_OK;
}

/* ---- solving ---- */

/* Solves with all places but those of one heap; heap FOLDS: with all. */
static shcd_status solve(problem *q, size_t heap, double ridge) {
    const size_t n = q->n, n_free = q->n_terms, n_ridged = q->n_centres * q->n_terms;
    double trace = 0.0;
    for (size_t i = 0; i < n * n; i++) {
        q->work[i] = q->matrix[FOLDS][i] - (heap < FOLDS ? q->matrix[heap][i] : 0.0);
    }
    for (size_t i = 0; i < n; i++) {
        q->solution[i] = q->rhs[FOLDS][i] - (heap < FOLDS ? q->rhs[heap][i] : 0.0);
    }
    for (size_t i = n_free; i < n_free + n_ridged; i++) {
        trace += q->work[i * n + i];
    }
    for (size_t i = n_free; i < n_free + n_ridged; i++) {
        q->work[i * n + i] += ridge * trace / (double)n_ridged;
    }
    gsl_matrix_view matrix = gsl_matrix_view_array(q->work, n, n);
    gsl_vector_view vector = gsl_vector_view_array(q->solution, n);
    gsl_error_handler_t *handler = gsl_set_error_handler_off();
    const int failed = gsl_linalg_cholesky_decomp1(&matrix.matrix) != GSL_SUCCESS ||
                       gsl_linalg_cholesky_svx(&matrix.matrix, &vector.vector) != GSL_SUCCESS;
    gsl_set_error_handler(handler);
    return failed ? SHCD_ERR_CONVERGENCE : SHCD_OK;
}

/* Sum of the squares of the force's errors over the places of a heap; FOLDS: over all. */
static double force_error2(const problem *q, size_t heap) {
    double sum = 0.0;
    for (size_t i = 0; i < q->set->n_places; i++) {
        const shcdi_train_place *place = &q->set->place[i];
        if (heap < FOLDS && i % FOLDS != heap) {
            continue;
        }
        fill_basis(q, place);
        double term[SHCD_LEARNED_TERMS_MAX] = {0.0};
        for (size_t j = 0; j <= q->n_centres; j++) {
            for (size_t p = 0; p < q->n_terms; p++) {
                term[p] += q->basis[j] * q->solution[j * q->n_terms + p];
            }
        }
        for (size_t s = place->first; s < place->first + place->n; s++) {
            const shcdi_train_row *row = q->set->row + s;
            const depth_part part = part_of(q, row->depth_m);
            double error = -row->force_n;
            for (size_t p = 0; p < q->n_terms; p++) {
                error += part.force[p] * term[p];
            }
            const double c = q->has_speed && q->use_force ? q->solution[q->n - 1] : q->damping;
            error += c * row->depth_m * row->speed_m_per_s;
            sum += error * error;
        }
    }
    return sum;
}

static void set_terms(problem *q, size_t n_terms) {
    q->n_terms = n_terms;
    q->n = (q->n_centres + 1) * n_terms + (q->has_speed && q->use_force ? 1 : 0);
}

typedef struct choice {
    double support, ridge, error2;
    size_t n_terms;
} choice;

/* Tries all ridges with the current support and terms, keeps what beats the best. A simpler choice
 * stands unless another one is better by more than a part in a thousand. */
static shcd_status try_ridges(problem *q, choice *best) {
    shcd_status status = assemble(q, FOLDS);
    for (size_t k = N_RIDGES; k-- > 0 && status == SHCD_OK;) {
        double error2 = 0.0;
        for (size_t heap = 0; heap < FOLDS && error2 < best->error2 && status == SHCD_OK; heap++) {
            status = shcdi_progress_report(q->progress, "cross-validation",
                                           (double)((N_RIDGES - 1 - k) * FOLDS + heap) /
                                               (double)(N_RIDGES * FOLDS));
            if (status == SHCD_OK) {
                error2 +=
                    solve(q, heap, ridges[k]) == SHCD_OK ? force_error2(q, heap) : (double)INFINITY;
            }
        }
        if (error2 < 0.998 * best->error2) {
            *best = (choice){q->support, ridges[k], error2, q->n_terms};
        }
    }
    return status;
}

/* The number of terms with the middle support, then the support. */
static shcd_status choose(problem *q, double unit, size_t n_terms_max, choice *best) {
    shcd_status status = SHCD_OK;
    *best = (choice){0.0, 0.0, (double)INFINITY, 1};
    q->support = supports[N_SUPPORTS / 2] * unit;
    for (size_t n_terms = 1; n_terms <= n_terms_max && status == SHCD_OK; n_terms += 2) {
        set_terms(q, n_terms);
        status = try_ridges(q, best);
    }
    set_terms(q, best->n_terms);
    for (size_t k = 0; k < N_SUPPORTS && status == SHCD_OK; k++) {
        q->support = supports[k] * unit;
        if (k != N_SUPPORTS / 2) {
            status = try_ridges(q, best);
        }
    }
    return status == SHCD_OK && !(best->error2 < (double)INFINITY) ? SHCD_ERR_CONVERGENCE : status;
}

/* ---- the whole ---- */

static shcd_status allocate(problem *q) {
    const size_t n = q->n, each = n * n + n;
    q->basis = malloc(3 * (q->n_centres + 1) * sizeof(double));
    q->matrix[0] = malloc((FOLDS + 2) * each * sizeof(double));
    if (q->basis == NULL || q->matrix[0] == NULL) {
        return SHCD_ERR_MEMORY;
    }
    for (size_t k = 0; k <= FOLDS; k++) {
        q->matrix[k] = q->matrix[0] + k * each;
        q->rhs[k] = q->matrix[k] + n * n;
    }
    q->work = q->matrix[0] + (FOLDS + 1) * each;
    q->solution = q->work + n * n;
    return SHCD_OK;
}

/* Places of the centres; the fill distance is that of all places, but no less than the largest gap
 * between neighbouring centres, since all places may be centres. */
static shcd_status place_centres(const shcdi_train_set *set, size_t n, double *centre,
                                 double *fill) {
    size_t *chosen = malloc(n * sizeof *chosen);
    double *distance = malloc(set->n_places * sizeof *distance), gap = 0.0;
    if (chosen == NULL || distance == NULL) {
        free(chosen);
        free(distance);
        return SHCD_ERR_MEMORY;
    }
    shcdi_train_greedy(set, 0, n, chosen, distance);
    *fill = 0.0;
    for (size_t i = 0; i < set->n_places; i++) {
        *fill = fmax(*fill, distance[i]);
    }
    for (size_t j = 0; j < n; j++) {
        const shcd_vec3 c = set->place[chosen[j]].point_m;
        double nearest = (double)INFINITY;
        for (size_t i = 0; i < n; i++) {
            const double d = shcd_norm(shcd_sub(set->place[chosen[i]].point_m, c));
            nearest = i != j ? fmin(nearest, d) : nearest;
        }
        gap = n > 1 ? fmax(gap, nearest) : set->depth_max_m;
        memcpy(centre + 3 * j, &c, 3 * sizeof(double));
    }
    *fill = fmax(*fill, gap);
    free(chosen);
    free(distance);
    return SHCD_OK;
}

/* Distinct depths of a set, up to a number. Terms beyond them are not held by anything, which
 * cross-validation cannot see where all places share their depths. */
static size_t count_depths(const shcdi_train_set *set, size_t most) {
    double known[SHCD_LEARNED_TERMS_MAX];
    size_t n = 0;
    for (size_t i = 0; i < set->n_rows && n < most; i++) {
        size_t k = 0;
        while (k < n && fabs(known[k] - set->row[i].depth_m) > 1e-3 * set->depth_max_m) {
            k++;
        }
        if (k == n) {
            known[n++] = set->row[i].depth_m;
        }
    }
    return n;
}

static int has_all_energies(const shcdi_train_set *set) {
    for (size_t i = 0; i < set->n_rows; i++) {
        if (!(set->row[i].energy_j - set->row[i].energy_j == 0.0)) {
            return 0;
        }
    }
    return 1;
}

static shcd_status finish(problem *q, const choice *best, shcd_learned *network, double *weights,
                          int wants_consistency, double *consistency_n) {
    q->support = best->support;
    set_terms(q, best->n_terms);
    shcd_status status = assemble(q, 1);
    status = status == SHCD_OK ? solve(q, FOLDS, best->ridge) : status;
    if (status != SHCD_OK) {
        return status;
    }
    memcpy(weights, q->solution, (q->n_centres + 1) * q->n_terms * sizeof(double));
    q->damping = q->has_speed ? fmax(0.0, q->solution[q->n - 1]) : 0.0;
    network->damping_n_s_per_m2 = q->damping;
    network->n_terms = q->n_terms;
    network->support_m = q->support;
    network->record.ridge = best->ridge;
    *consistency_n = 0.0;
    if (wants_consistency && has_all_energies(q->set)) {
        const size_t n_depths = count_depths(q->set, SHCD_LEARNED_TERMS_MAX);
        const size_t held = n_depths > 2 ? n_depths - 1 : 1;
        q->use_force = 0;
        set_terms(q, best->n_terms < held ? best->n_terms : held);
        status = assemble(q, 1);
        status = status == SHCD_OK ? solve(q, FOLDS, best->ridge) : status;
        *consistency_n = sqrt(force_error2(q, FOLDS) / (double)q->set->n_rows);
    }
    return status;
}

shcd_status shcdi_train_network(const shcdi_train_set *set, const shcdi_train_settings *settings,
                                const shcdi_progress *progress, double *numbers,
                                shcd_learned *network, double *consistency_n) {
    const size_t n_centres =
        settings->n_centres < set->n_places ? settings->n_centres : set->n_places;
    problem q = {.set = set,
                 .progress = progress,
                 .centre = numbers,
                 .n_centres = n_centres,
                 .has_speed = settings->has_speed,
                 .use_force = 1};
    const size_t n_depths = count_depths(set, settings->n_terms);
    double fill = 0.0;
    choice best;
    set_terms(&q, n_depths);
    shcd_status status = place_centres(set, n_centres, numbers, &fill);
    status = status == SHCD_OK ? allocate(&q) : status;
    status = status == SHCD_OK ? choose(&q, fill, n_depths, &best) : status;
    if (status == SHCD_OK) {
        network->n_centres = n_centres;
        network->centre_m = numbers;
        network->weight_n_per_m = numbers + 3 * n_centres;
        network->fill_m = fill;
        network->depth_max_m = set->depth_max_m;
        status = finish(&q, &best, network, numbers + 3 * n_centres, settings->wants_consistency,
                        consistency_n);
    }
    free(q.basis);
    free(q.matrix[0]);
    return status;
}
