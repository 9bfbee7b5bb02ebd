/* SPDX-License-Identifier: BSD-3-Clause */
/* L-BFGS on a product of unit spheres, in the ambient space: gradients and directions are projected
 * onto the tangent planes, a step is retracted by normalising, and the pairs (s, y) are kept as
 * they are, without transport: steps are short, and a pair that has lost its curvature is skipped.
 *
 * The initial inverse Hessian of the two-loop recursion is a factorised Laplacian, scaled by the
 * last pair. While folds remain one fixed cotangent Laplacian serves best (one that follows the
 * energy stiffens exactly the folded places, and they never open); in the unfolded set the energy's
 * own stiffness serves best, since it spans many orders of magnitude there. */
#include "optimise.h"

#include <float.h>
#include <stdlib.h>

#define N_PAIRS_MAX 10
#define LONGEST_MOVE_RAD 0.5
#define LINE_SEARCH_HALVINGS 50
#define SUFFICIENT_DECREASE 1e-4
#define CHECK_UNFOLDED_EVERY 5

typedef struct pair {
    shcd_vec3 *step, *change; /* s and y */
    double inverse_product;   /* 1 / (s . y) */
    double alpha;
} pair;

struct shcdi_optimiser {
    const shcdi_energy *energy;
    shcdi_laplacian *laplacian;
    size_t n;
    shcd_vec3 *memory;
    shcd_vec3 *gradient, *trial, *trial_gradient, *direction, *work;
    double *weights;
    pair pairs[N_PAIRS_MAX]; /* oldest first */
    size_t n_pairs;
    double value;
};

shcd_status shcdi_optimiser_create(const shcdi_energy *energy, shcdi_laplacian *laplacian,
                                   shcdi_optimiser **optimiser) {
    const size_t n = energy->n_vertices;
    shcdi_optimiser *o = calloc(1, sizeof *o);
    if (o == NULL) {
        return SHCD_ERR_MEMORY;
    }
    o->energy = energy;
    o->laplacian = laplacian;
    o->n = n;
    o->memory = malloc((5 + 2 * N_PAIRS_MAX) * n * sizeof *o->memory);
    o->weights = malloc(3 * energy->n_triangles * sizeof *o->weights);
    if (o->memory == NULL || o->weights == NULL) {
        shcdi_optimiser_free(o);
        return SHCD_ERR_MEMORY;
    }
    o->gradient = o->memory;
    o->trial = o->memory + n;
    o->trial_gradient = o->memory + 2 * n;
    o->direction = o->memory + 3 * n;
    o->work = o->memory + 4 * n;
    for (size_t k = 0; k < N_PAIRS_MAX; ++k) {
        o->pairs[k].step = o->memory + (5 + 2 * k) * n;
        o->pairs[k].change = o->memory + (6 + 2 * k) * n;
    }
    *optimiser = o;
    return SHCD_OK;
}

void shcdi_optimiser_free(shcdi_optimiser *optimiser) {
    if (optimiser != NULL) {
        free(optimiser->memory);
        free(optimiser->weights);
        free(optimiser);
    }
}

static double inner_product(size_t n, const shcd_vec3 *a, const shcd_vec3 *b) {
    double sum = 0.0;
    for (size_t i = 0; i < n; ++i) {
        sum += shcd_dot(a[i], b[i]);
    }
    return sum;
}

static void add_scaled(size_t n, shcd_vec3 *a, double factor, const shcd_vec3 *b) {
    for (size_t i = 0; i < n; ++i) {
        a[i] = shcd_mul_add(a[i], factor, b[i]);
    }
}

static void project_to_tangent(size_t n, const shcd_vec3 *u, shcd_vec3 *v) {
    for (size_t i = 0; i < n; ++i) {
        v[i] = shcd_mul_add(v[i], -shcd_dot(v[i], u[i]), u[i]);
    }
}

static double evaluate(const shcdi_optimiser *o, const shcd_vec3 *u, double eps,
                       shcd_vec3 *gradient) {
    const double value = shcdi_energy_value(o->energy, u, eps, gradient);
    project_to_tangent(o->n, u, gradient);
    return value;
}

/* direction = -P H gradient by the two-loop recursion; returns its slope */
static shcd_status find_direction(shcdi_optimiser *o, const shcd_vec3 *u, double *slope) {
    const size_t n = o->n;
    for (size_t i = 0; i < n; ++i) {
        o->work[i] = o->gradient[i];
    }
    for (size_t k = o->n_pairs; k-- > 0;) {
        pair *p = &o->pairs[k];
        p->alpha = p->inverse_product * inner_product(n, p->step, o->work);
        add_scaled(n, o->work, -p->alpha, p->change);
    }
    shcd_status status = shcdi_laplacian_solve(o->laplacian, o->work, o->direction);
    if (status == SHCD_OK && o->n_pairs > 0) {
        const pair *last = &o->pairs[o->n_pairs - 1];
        status = shcdi_laplacian_solve(o->laplacian, last->change, o->work);
        const double gamma =
            1.0 / (last->inverse_product * inner_product(n, last->change, o->work));
        for (size_t i = 0; i < n; ++i) {
            o->direction[i] = shcd_scale(gamma, o->direction[i]);
        }
    }
    for (size_t k = 0; k < o->n_pairs; ++k) {
        const pair *p = &o->pairs[k];
        const double beta = p->inverse_product * inner_product(n, p->change, o->direction);
        add_scaled(n, o->direction, p->alpha - beta, p->step);
    }
    project_to_tangent(n, u, o->direction);
    for (size_t i = 0; i < n; ++i) {
        o->direction[i] = shcd_scale(-1.0, o->direction[i]);
    }
    *slope = inner_product(n, o->gradient, o->direction);
    return status;
}

static double longest(size_t n, const shcd_vec3 *v) {
    double square = 0.0;
    for (size_t i = 0; i < n; ++i) {
        square = fmax(square, shcd_dot(v[i], v[i]));
    }
    return sqrt(square);
}

/* Backtracks until the energy has fallen enough. An infinite energy (a fold, when eps = 0) is no
 * descent, so that the unfolded set is never left. Leaves the result in trial, trial_gradient. */
static int search_line(shcdi_optimiser *o, const shcd_vec3 *u, double eps, double cap_rad,
                       double slope, double *value) {
    const double move = longest(o->n, o->direction);
    double t = move > cap_rad ? cap_rad / move : 1.0;
    for (int k = 0; k < LINE_SEARCH_HALVINGS; ++k, t *= 0.5) {
        for (size_t i = 0; i < o->n; ++i) {
            o->trial[i] = shcd_unit(shcd_mul_add(u[i], t, o->direction[i]));
        }
        *value = evaluate(o, o->trial, eps, o->trial_gradient);
        if (isfinite(*value) && *value <= o->value + SUFFICIENT_DECREASE * t * slope) {
            return 1;
        }
    }
    return 0;
}

/* Keeps the pair of the accepted step and moves u to it. */
static void accept_step(shcdi_optimiser *o, shcd_vec3 *u, double value) {
    if (o->n_pairs == N_PAIRS_MAX) {
        const pair oldest = o->pairs[0];
        for (size_t k = 1; k < N_PAIRS_MAX; ++k) {
            o->pairs[k - 1] = o->pairs[k];
        }
        o->pairs[--o->n_pairs] = oldest;
    }
    pair *p = &o->pairs[o->n_pairs];
    for (size_t i = 0; i < o->n; ++i) {
        p->step[i] = shcd_sub(o->trial[i], u[i]);
        p->change[i] = shcd_sub(o->trial_gradient[i], o->gradient[i]);
        u[i] = o->trial[i];
        o->gradient[i] = o->trial_gradient[i];
    }
    o->value = value;
    const double product = inner_product(o->n, p->step, p->change);
    const double sizes =
        sqrt(inner_product(o->n, p->step, p->step) * inner_product(o->n, p->change, p->change));
    if (product > DBL_EPSILON * sizes) {
        p->inverse_product = 1.0 / product;
        ++o->n_pairs;
    }
}

static shcd_status refactor(shcdi_optimiser *o, const shcd_vec3 *u) {
    o->n_pairs = 0;
    shcdi_energy_stiffness(o->energy, u, o->weights);
    return shcdi_laplacian_factorise(o->laplacian, o->weights, o->energy->vertex_area);
}

static int is_unfolded(const shcdi_optimiser *o, const shcd_vec3 *u) {
    double ratio;
    return shcdi_energy_count_folds(o->energy, u, &ratio) == 0;
}

/* One step: direction, steepest descent if that is none, line search. *moved = 0 at a dead end. */
static shcd_status take_step(shcdi_optimiser *o, const shcdi_descent *descent, shcd_vec3 *u,
                             int *moved) {
    double slope, value;
    shcd_status status = find_direction(o, u, &slope);
    if (status == SHCD_OK && !(slope < 0.0)) {
        o->n_pairs = 0;
        status = find_direction(o, u, &slope);
    }
    if (status != SHCD_OK) {
        return status;
    }
    const double cap = o->n_pairs > 0 ? LONGEST_MOVE_RAD : descent->first_step_rad;
    *moved = slope < 0.0 && search_line(o, u, descent->eps, cap, slope, &value);
    if (*moved) {
        accept_step(o, u, value);
    }
    return SHCD_OK;
}

shcd_status shcdi_optimiser_descend(shcdi_optimiser *o, const shcdi_descent *descent, shcd_vec3 *u,
                                    uint64_t *iterations) {
    o->n_pairs = 0;
    o->value = evaluate(o, u, descent->eps, o->gradient);
    double reference = o->value;
    uint64_t since_reference = 0, since_factor = descent->refactor_every;
    for (uint64_t k = 0; k < descent->iterations_max; ++k) {
        shcd_status status = shcdi_progress_report(descent->progress, descent->stage,
                                                   (double)k / (double)descent->iterations_max);
        const int fresh = descent->refactor_every > 0 && since_factor >= descent->refactor_every;
        if (status == SHCD_OK && fresh) {
            status = refactor(o, u);
            since_factor = 0;
        }
        const int was_plain = o->n_pairs == 0;
        int moved = 0;
        status = status == SHCD_OK ? take_step(o, descent, u, &moved) : status;
        if (status != SHCD_OK) {
            return status;
        }
        ++*iterations;
        ++since_factor;
        if (!moved) {
            if (descent->refactor_every > 0 ? fresh : was_plain) {
                return SHCD_OK; /* not even the plain preconditioned gradient descends */
            }
            o->n_pairs = 0;
            since_factor = descent->refactor_every;
            continue;
        }
        if (++since_reference == descent->window) {
            if (reference - o->value < descent->tolerance * fabs(o->value)) {
                return SHCD_OK;
            }
            reference = o->value;
            since_reference = 0;
        }
        if (descent->stop_unfolded && k % CHECK_UNFOLDED_EVERY == CHECK_UNFOLDED_EVERY - 1 &&
            is_unfolded(o, u)) {
            return SHCD_OK;
        }
    }
    return SHCD_OK;
}
