/* SPDX-License-Identifier: BSD-3-Clause */
/* Places of the training are spread greedily over the surface, by distance in space, so that none
 * of it is far from one; places of the test are random, uniform over the area, and so are their
 * depths.
 *
 * Dents: q_k = F phi_k(w0) sum_p g_kp T_p(t) is linear in g, one small least-squares problem for
 * each mode. `moment` holds its sums for the most terms there may be: (F phi)^2 T_p T_r, then
 * q F phi T_p; a network with fewer terms uses the leading part. */
#include "train_data.h"

#include "fail.h"
#include "shcd/query.h"
#include "shcd/vec.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define TRAIN_DEPTHS 5
#define TEST_DEPTHS 2
#define TEST_SHARE 3  /* training places for each place of the test */
#define CANDIDATES 12 /* for each training place */
#define TABLE_PLACES_MIN 8
#define TABLE_TEST 5   /* one place in so many */
#define FAR_SHARE 0.05 /* of the diagonal that a table's point may be off the surface */
#define TERMS SHCD_LEARNED_TERMS_MAX
#define MOMENT (TERMS * (TERMS + 1))

static const double pi = 3.14159265358979324;

void shcdi_train_data_release(shcdi_train_data *data) {
    free(data->train.place);
    free(data->train.row);
    free(data->test.place);
    free(data->test.row);
    free(data->moment);
    free(data->test_phi);
    free(data->test_q);
    *data = (shcdi_train_data){0};
}

/* splitmix64: the same numbers on every platform. */
static uint64_t next_bits(uint64_t *state) {
    uint64_t z = (*state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

static double next_uniform(uint64_t *state) {
    return (double)(next_bits(state) >> 11) * 0x1p-53;
}

static shcd_status out_of_memory(shcd_error *error) {
    return shcdi_fit_fail(error, SHCD_ERR_MEMORY, "train: out of memory");
}

static shcd_status allocate_set(shcdi_train_set *set, size_t n_places, size_t n_rows,
                                double depth_max_m) {
    *set = (shcdi_train_set){.depth_max_m = depth_max_m};
    set->place = calloc(n_places, sizeof *set->place);
    set->row = calloc(n_rows, sizeof *set->row);
    return set->place != NULL && set->row != NULL ? SHCD_OK : SHCD_ERR_MEMORY;
}

/* ---- places ---- */

static shcd_status place_at(const shcd_model *model, shcd_vec3 w, shcdi_train_place *place,
                            double *area_m2) {
    shcdi_train_frame frame;
    const shcd_status status = shcdi_train_frame_at(model, w, &frame);
    if (status == SHCD_OK) {
        *place = (shcdi_train_place){.point_m = frame.point_m,
                                     .tangent = {frame.tangent[0], frame.tangent[1]}};
        *area_m2 = frame.area_m2;
    }
    return status;
}

/* Fibonacci's spiral over the sphere of parameters. */
shcd_status shcdi_train_scatter(const shcd_model *model, size_t n, shcd_vec3 *parameter,
                                shcdi_train_place *place) {
    const double turn = pi * (3.0 - sqrt(5.0));
    shcd_status status = SHCD_OK;
    for (size_t i = 0; i < n && status == SHCD_OK; i++) {
        const double z = 1.0 - (2.0 * (double)i + 1.0) / (double)n, s = sqrt(1.0 - z * z);
        double area_m2;
        parameter[i] = shcd_vec3_make(s * cos(turn * (double)i), s * sin(turn * (double)i), z);
        status = place_at(model, parameter[i], &place[i], &area_m2);
    }
    return status;
}

/* n parameters spread by distance in space. */
static shcd_status spread(const shcd_model *model, size_t n, uint64_t seed, shcd_vec3 *parameter) {
    const size_t n_candidates = CANDIDATES * n;
    shcd_vec3 *w = malloc(n_candidates * sizeof *w);
    size_t *chosen = malloc(n * sizeof *chosen);
    double *distance = malloc(n_candidates * sizeof *distance);
    shcdi_train_set set = {.place = calloc(n_candidates, sizeof *set.place),
                           .n_places = n_candidates};
    shcd_status status = w != NULL && chosen != NULL && distance != NULL && set.place != NULL
                             ? shcdi_train_scatter(model, n_candidates, w, set.place)
                             : SHCD_ERR_MEMORY;
    if (status == SHCD_OK) {
        shcdi_train_greedy(&set, (size_t)(next_bits(&seed) % n_candidates), n, chosen, distance);
        for (size_t i = 0; i < n; i++) {
            parameter[i] = w[chosen[i]];
        }
    }
    free(w);
    free(chosen);
    free(distance);
    free(set.place);
    return status;
}

/* A parameter whose point is uniform over the surface: accepted in proportion to the area. */
static shcd_status random_parameter(const shcd_model *model, double area_max_m2, uint64_t *state,
                                    shcd_vec3 *w) {
    for (int i = 0; i < 100000; i++) {
        shcdi_train_place place;
        double area_m2;
        const double z = 2.0 * next_uniform(state) - 1.0, s = sqrt(1.0 - z * z);
        const double phi = 2.0 * pi * next_uniform(state);
        *w = shcd_vec3_make(s * cos(phi), s * sin(phi), z);
        const shcd_status status = place_at(model, *w, &place, &area_m2);
        if (status != SHCD_OK || next_uniform(state) * area_max_m2 < area_m2) {
            return status;
        }
    }
    return SHCD_ERR_CONVERGENCE;
}

static shcd_status largest_area(const shcd_model *model, double *area_max_m2) {
    shcd_status status = SHCD_OK;
    *area_max_m2 = 0.0;
    for (size_t i = 0; i < 2000 && status == SHCD_OK; i++) {
        const double z = 1.0 - (2.0 * (double)i + 1.0) / 2000.0, s = sqrt(1.0 - z * z);
        shcdi_train_place place;
        double area_m2 = 0.0;
        status =
            place_at(model, shcd_vec3_make(s * cos(2.4 * (double)i), s * sin(2.4 * (double)i), z),
                     &place, &area_m2);
        *area_max_m2 = fmax(*area_max_m2, area_m2);
    }
    return status;
}

/* ---- pressing ---- */

static void chebyshev(double depth_m, double depth_max_m, double *t) {
    const double x = 2.0 * depth_m / depth_max_m - 1.0;
    t[0] = 1.0;
    t[1] = x;
    for (size_t p = 2; p < TERMS; p++) {
        t[p] = 2.0 * x * t[p - 1] - t[p - 2];
    }
}

static void add_dent(shcdi_train_data *data, const shcdi_train_row *row, const double *phi,
                     const double *q) {
    double t[TERMS];
    chebyshev(row->depth_m, data->train.depth_max_m, t);
    for (size_t k = 0; k < data->n_modes; k++) {
        double *sum = data->moment + MOMENT * k;
        const double scale = row->force_n * phi[k];
        for (size_t p = 0; p < TERMS; p++) {
            for (size_t r = 0; r < TERMS; r++) {
                sum[p * TERMS + r] += scale * scale * t[p] * t[r];
            }
            sum[TERMS * TERMS + p] += q[k] * scale * t[p];
        }
    }
}

/* Solves A g = b by Cholesky with A's leading n x n; A is overwritten. */
static shcd_status solve_small(double *a, double *b, size_t n) {
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j <= i; j++) {
            double sum = a[i * TERMS + j];
            for (size_t r = 0; r < j; r++) {
                sum -= a[i * TERMS + r] * a[j * TERMS + r];
            }
            if (i == j && !(sum > 0.0)) {
                return SHCD_ERR_CONVERGENCE;
            }
            a[i * TERMS + j] = i == j ? sqrt(sum) : sum / a[j * TERMS + j];
        }
        for (size_t r = 0; r < i; r++) {
            b[i] -= a[i * TERMS + r] * b[r];
        }
        b[i] /= a[i * TERMS + i];
    }
    for (size_t i = n; i-- > 0;) {
        for (size_t r = i + 1; r < n; r++) {
            b[i] -= a[r * TERMS + i] * b[r];
        }
        b[i] /= a[i * TERMS + i];
    }
    return SHCD_OK;
}

shcd_status shcdi_train_dents(const shcdi_train_data *data, size_t n_terms, double *gain) {
    shcd_status status = SHCD_OK;
    for (size_t k = 0; k < data->n_modes && status == SHCD_OK; k++) {
        double sum[MOMENT];
        memcpy(sum, data->moment + MOMENT * k, sizeof sum);
        status = solve_small(sum, sum + TERMS * TERMS, n_terms);
        memcpy(gain + k * n_terms, sum + TERMS * TERMS, n_terms * sizeof *gain);
    }
    return status;
}

static shcd_status allocate_pressed(shcdi_train_data *data, size_t n_points, size_t n_test,
                                    double depth_max_m) {
    shcd_status status = allocate_set(&data->train, n_points, TRAIN_DEPTHS * n_points, depth_max_m);
    if (status == SHCD_OK) {
        status = allocate_set(&data->test, n_test, TEST_DEPTHS * n_test, depth_max_m);
    }
    data->moment = calloc(MOMENT * data->n_modes, sizeof *data->moment);
    data->test_phi = malloc(n_test * data->n_modes * sizeof *data->test_phi);
    data->test_q = malloc(TEST_DEPTHS * n_test * data->n_modes * sizeof *data->test_q);
    return data->moment != NULL && data->test_phi != NULL && data->test_q != NULL ? status
                                                                                  : SHCD_ERR_MEMORY;
}

/* One more place of a set, pressed to n depths. */
static shcd_status press_place(shcdi_train_set *set, shcdi_train_source *source, shcd_vec3 w,
                               const double *depth_m, size_t n, double *q, double *phi) {
    shcdi_train_place *place = &set->place[set->n_places];
    double area_m2;
    shcd_status status = place_at(source->model, w, place, &area_m2);
    if (status == SHCD_OK) {
        place->first = set->n_rows;
        place->n = n;
        status = shcdi_train_press(source, w, depth_m, n, set->row + set->n_rows, q, phi);
    }
    set->n_places++;
    set->n_rows += n;
    return status;
}

static shcd_status press_training(shcdi_train_data *data, shcdi_train_source *source,
                                  const shcd_vec3 *w, size_t n_points,
                                  const shcdi_progress *progress, shcd_error *error) {
    double depth[TRAIN_DEPTHS];
    double *q = malloc((TRAIN_DEPTHS + 1) * data->n_modes * sizeof *q);
    if (q == NULL) {
        return out_of_memory(error);
    }
    double *phi = q + TRAIN_DEPTHS * data->n_modes;
    for (size_t i = 0; i < TRAIN_DEPTHS; i++) { /* denser to both ends, as polynomials want it */
        depth[i] = data->train.depth_max_m * 0.5 * (1.0 - cos(pi * (double)(i + 1) / TRAIN_DEPTHS));
    }
    shcd_status status = SHCD_OK;
    for (size_t j = 0; j < n_points && status == SHCD_OK; j++) {
        status = shcdi_progress_report(progress, "pressing", (double)j / (double)n_points);
        if (status != SHCD_OK) {
            (void)shcdi_fit_fail(error, status, "train: %s", shcd_status_string(status));
            break;
        }
        status = press_place(&data->train, source, w[j], depth, TRAIN_DEPTHS, q, phi);
        if (status != SHCD_OK) {
            (void)shcdi_fit_fail(error, status, "train: place %zu: %s", j,
                                 shcd_status_string(status));
            break;
        }
        for (size_t i = 0; i < TRAIN_DEPTHS; i++) {
            add_dent(data, &data->train.row[data->train.n_rows - TRAIN_DEPTHS + i], phi,
                     q + i * data->n_modes);
        }
    }
    free(q);
    return status;
}

static shcd_status press_test(shcdi_train_data *data, shcdi_train_source *source, size_t n_test,
                              uint64_t seed, const shcdi_progress *progress, shcd_error *error) {
    double area_max_m2;
    uint64_t state = seed ^ 0x5c0ffee123456789u; /* other numbers than those of the training */
    shcd_status status = largest_area(source->model, &area_max_m2);
    for (size_t j = 0; j < n_test && status == SHCD_OK; j++) {
        shcd_vec3 w;
        double depth[TEST_DEPTHS];
        status = shcdi_progress_report(progress, "testing", (double)j / (double)n_test);
        if (status == SHCD_OK) {
            /* samples of the density miss its peak by a little */
            status = random_parameter(source->model, 1.1 * area_max_m2, &state, &w);
        }
        /* one depth in each half of the range, from 5 % on */
        for (size_t i = 0; i < TEST_DEPTHS; i++) {
            depth[i] = data->test.depth_max_m *
                       fmax(0.05, ((double)i + next_uniform(&state)) / TEST_DEPTHS);
        }
        if (status == SHCD_OK) {
            status = press_place(&data->test, source, w, depth, TEST_DEPTHS,
                                 data->test_q + TEST_DEPTHS * j * data->n_modes,
                                 data->test_phi + j * data->n_modes);
        }
    }
    return status == SHCD_OK
               ? SHCD_OK
               : shcdi_fit_fail(error, status, "train: %s", shcd_status_string(status));
}

shcd_status shcdi_train_data_press(shcdi_train_data *data, shcdi_train_source *source,
                                   double depth_max_m, size_t n_points, uint64_t seed,
                                   const shcdi_progress *progress, shcd_error *error) {
    const size_t n_test = n_points / TEST_SHARE > 0 ? n_points / TEST_SHARE : 1;
    *data = (shcdi_train_data){.n_modes = source->modes->n_modes};
    shcd_vec3 *w = malloc(n_points * sizeof *w);
    shcd_status status =
        w != NULL ? allocate_pressed(data, n_points, n_test, depth_max_m) : SHCD_ERR_MEMORY;
    status = status == SHCD_OK ? spread(source->model, n_points, seed, w) : status;
    if (status != SHCD_OK) {
        (void)shcdi_fit_fail(error, status, "train: %s", shcd_status_string(status));
    } else {
        status = press_training(data, source, w, n_points, progress, error);
    }
    free(w);
    return status == SHCD_OK ? press_test(data, source, n_test, seed, progress, error) : status;
}

/* ---- a table ---- */

/* Onto the rest surface; refused if that is far. */
static shcd_status project_point(const shcd_model *model, double diagonal_m, size_t i,
                                 shcd_vec3 point, shcd_vec3 *on_surface, shcd_error *error) {
    shcd_proximity found;
    const shcd_status status = shcd_closest(model, point, NULL, &found);
    if (status != SHCD_OK) {
        return shcdi_fit_fail(error, status, "train: sample %zu: %s", i,
                              shcd_status_string(status));
    }
    if (!(fabs(found.distance_m) <= FAR_SHARE * diagonal_m)) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT,
                              "train: sample %zu is %.3g m from the surface, more than 5 %% of the "
                              "body's diagonal of %.3g m",
                              i, fabs(found.distance_m), diagonal_m);
    }
    *on_surface = found.point_m;
    return SHCD_OK;
}

static shcd_status check_sample(const shcd_train_options *options, size_t i, shcd_error *error) {
    const shcd_train_sample *s = &options->samples[i];
    if (!shcd_vec3_is_finite(s->point_m) || !isfinite(s->depth_m) || !isfinite(s->force_n) ||
        (options->has_energy && !isfinite(s->energy_j)) ||
        (options->has_speed && !isfinite(s->speed_m_per_s))) {
        return shcdi_fit_fail(error, SHCD_ERR_NOT_FINITE, "train: sample %zu is not finite", i);
    }
    if (!(s->depth_m > 0.0)) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT,
                              "train: sample %zu: a depth of %.3g m is not positive", i,
                              s->depth_m);
    }
    return SHCD_OK;
}

/* The place of a sample among those that are known, or a new one. Quadratic in the places, which
 * are thousands at most where rows are ten thousands. */
static size_t find_place(const shcd_vec3 *point, const size_t *first_of, size_t n_places,
                         shcd_vec3 p) {
    for (size_t i = n_places; i-- > 0;) {
        const shcd_vec3 q = point[first_of[i]];
        if (p.x == q.x && p.y == q.y && p.z == q.z) {
            return i;
        }
    }
    return n_places;
}

/* Copies the rows of a place into a set. */
static void take_place(shcdi_train_set *set, const shcd_train_options *options,
                       const size_t *place_of, size_t place, shcd_vec3 point) {
    shcdi_train_place *to = &set->place[set->n_places++];
    *to = (shcdi_train_place){.point_m = point, .first = set->n_rows};
    for (size_t i = 0; i < options->n_samples; i++) {
        const shcd_train_sample *s = &options->samples[i];
        if (place_of[i] == place) {
            set->row[set->n_rows++] =
                (shcdi_train_row){s->depth_m,
                                  s->force_n,
                                  options->has_energy ? s->energy_j : (double)NAN,
                                  options->has_speed ? s->speed_m_per_s : 0.0,
                                  {(double)NAN, (double)NAN}};
            to->n++;
        }
    }
}

/* Finds the places and deals them out in a random order. Scratch: point and place_of for each
 * sample, first_of for each place. */
static shcd_status deal(shcdi_train_data *data, const shcd_model *model, double diagonal_m,
                        const shcd_train_options *options, uint64_t seed, size_t *place_of,
                        size_t *first_of, shcd_vec3 *point, shcd_error *error) {
    size_t n_places = 0;
    double depth_max_m = 0.0;
    for (size_t i = 0; i < options->n_samples; i++) {
        shcd_status status = check_sample(options, i, error);
        if (status != SHCD_OK) {
            return status;
        }
        point[i] = options->samples[i].point_m;
        place_of[i] = find_place(point, first_of, n_places, point[i]);
        if (place_of[i] == n_places) {
            first_of[n_places++] = i;
        }
        depth_max_m = fmax(depth_max_m, options->samples[i].depth_m);
    }
    if (n_places < TABLE_PLACES_MIN) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT,
                              "train: samples at %zu different points; at least %d are needed",
                              n_places, TABLE_PLACES_MIN);
    }
    shcd_status status = allocate_set(&data->train, n_places, options->n_samples, depth_max_m);
    if (status == SHCD_OK) {
        status = allocate_set(&data->test, n_places, options->n_samples, depth_max_m);
    }
    if (status != SHCD_OK) {
        return out_of_memory(error);
    }
    for (size_t i = n_places; i > 1; i--) { /* Fisher and Yates; order of first_of = of dealing */
        const size_t j = (size_t)(next_bits(&seed) % i), held = first_of[i - 1];
        first_of[i - 1] = first_of[j];
        first_of[j] = held;
    }
    for (size_t i = 0; i < n_places; i++) {
        shcd_vec3 on_surface = {0.0, 0.0, 0.0};
        const size_t first = first_of[i];
        status = project_point(model, diagonal_m, first, point[first], &on_surface, error);
        if (status != SHCD_OK) {
            return status;
        }
        take_place(i % TABLE_TEST == TABLE_TEST - 1 ? &data->test : &data->train, options, place_of,
                   place_of[first], on_surface);
    }
    return SHCD_OK;
}

shcd_status shcdi_train_data_table(shcdi_train_data *data, const shcd_model *model,
                                   const shcd_train_options *options, uint64_t seed,
                                   shcd_error *error) {
    shcd_model_info info = SHCD_MODEL_INFO_INIT;
    const size_t n = options->n_samples;
    *data = (shcdi_train_data){0};
    size_t *place_of = malloc((n > 0 ? n : 1) * sizeof *place_of);
    size_t *first_of = malloc((n > 0 ? n : 1) * sizeof *first_of);
    shcd_vec3 *point = malloc((n > 0 ? n : 1) * sizeof *point);
    shcd_status status = shcd_model_describe(model, &info);
    if (place_of == NULL || first_of == NULL || point == NULL) {
        status = out_of_memory(error);
    } else if (status == SHCD_OK) {
        status =
            deal(data, model, info.diagonal_m, options, seed, place_of, first_of, point, error);
    }
    free(place_of);
    free(first_of);
    free(point);
    return status;
}
