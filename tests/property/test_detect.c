/* SPDX-License-Identifier: BSD-3-Clause */
/* shcd_detect() against the exact distance: on random bodies, at rest and deformed, for points near
 * and far and every reach, no stage contradicts it, and each stage decides what it should. */
#include "shcd/accuracy.h"
#include "support/bodies.h"

#define N_BODIES 18
#define N_POINTS 600
#define DEGREE_MAX 10

typedef struct subject {
    shcd_model *model;
    shcd_shape *shape; /* NULL: at rest */
    shcd_model_info info;
    void *memory;
} subject;

/* One body in three stays as it is, the others get up to 10 % of the diagonal of displacement. */
static void subject_make(check_random *r, size_t i, subject *s) {
    const int degree = 1 + (int)(i % DEGREE_MAX);
    s->model = bodies_create_random(r, degree, 0.05);
    s->info = bodies_info(s->model);
    s->shape = NULL;
    s->memory = NULL;
    if (i % 3 == 0) {
        return;
    }
    const size_t n = 3 * SHCD_COUNT(degree), size = shcd_shape_size(s->model);
    double *now = malloc(n * sizeof *now);
    s->memory = aligned_alloc(16, (size + 15) / 16 * 16);
    assert_non_null(now);
    assert_non_null(s->memory);
    assert_int_equal(shcd_shape_init(s->model, s->memory, size, &s->shape), SHCD_OK);
    memcpy(now, shcd_model_coefficients(s->model), n * sizeof *now);
    const double amplitude = check_uniform(r, 0.0, 0.1) * s->info.diagonal_m / sqrt((double)n);
    for (size_t k = 0; k < n; k++) {
        now[k] += amplitude * check_normal(r);
    }
    assert_int_equal(shcd_shape_set(s->model, s->shape, now, SHCD_FOLLOW_AUTO), SHCD_OK);
    free(now);
}

static void subject_free(subject *s) {
    shcd_model_free(s->model);
    free(s->memory);
}

static shcd_proximity exact(const subject *s, shcd_vec3 p) {
    shcd_proximity found;
    const shcd_status status = s->shape != NULL
                                   ? shcd_shape_closest(s->model, s->shape, p, NULL, &found)
                                   : shcd_closest(s->model, p, NULL, &found);
    assert_int_equal(status, SHCD_OK);
    return found;
}

/* Half of the points lie near the surface, the others anywhere up to twice the ball's radius. */
static shcd_vec3 random_point(check_random *r, const subject *s) {
    shcd_vec3 x, n;
    const double diagonal = s->info.diagonal_m;
    if (check_uniform(r, 0.0, 1.0) < 0.5) {
        return shcd_mul_add(s->info.centre_m, 2.0 * s->info.radius_m * check_uniform(r, 0.0, 1.0),
                            bodies_random_direction(r));
    }
    const shcd_vec3 w = bodies_random_direction(r);
    assert_int_equal(shcd_model_surface(s->model, -1, w, &x, &n, NULL), SHCD_OK);
    return shcd_mul_add(x, check_uniform(r, -0.05, 0.1) * diagonal, n);
}

/* Every subset of the stages, one after another; a seed for half of the cases: the foot itself. */
static shcd_detect_options random_options(check_random *r, size_t i, const shcd_proximity *truth) {
    shcd_detect_options options = SHCD_DETECT_OPTIONS_INIT;
    options.skipped = (uint32_t)(i % 16);
    if (check_uniform(r, 0.0, 1.0) < 0.5) {
        options.seed = shcd_scale(check_uniform(r, 0.1, 3.0), truth->parameter);
    }
    return options;
}

static void check_detection(const shcd_detection *d, const shcd_proximity *truth, double reach) {
    /* two true intervals of one number overlap, and the answer is on the right side of the truth's
     */
    assert_at_most(d->lower_m, truth->upper_m);
    assert_at_most(truth->lower_m, d->upper_m);
    if (truth->upper_m <= reach) {
        assert_int_equal(d->is_within, 1);
    }
    if (truth->lower_m > reach) {
        assert_int_equal(d->is_within, 0);
    }
    if (d->stage < SHCD_STAGE_SEARCH) { /* what decides early is a proof */
        assert_true(d->is_within ? d->upper_m <= reach : d->lower_m > reach);
        assert_int_equal(d->n_patches + d->n_newton, 0);
        assert_true(d->n_evaluations <= 1 && d->flags == 0);
    }
}

static void test_detect_agrees_with_the_exact_distance(void **state) {
    const size_t n_bodies = check_scaled(N_BODIES);
    size_t n_at[SHCD_N_STAGES] = {0}, n_within = 0, n_cases = 0;
    (void)state;
    for (size_t b = 0; b < n_bodies; b++) {
        check_random r = {0xde7ec700u + b};
        subject s;
        subject_make(&r, b, &s);
        for (size_t i = 0; i < N_POINTS; i++) {
            shcd_detection d;
            const shcd_vec3 p = random_point(&r, &s);
            const shcd_proximity truth = exact(&s, p);
            /* reaches on both sides of the distance, some of them all but equal to it */
            const double part = pow(10.0, check_uniform(&r, -8.0, 0.0));
            const double away = (i % 2 == 0 ? part : -part) * s.info.diagonal_m;
            const double share = check_uniform(&r, 0.0, 1.0);
            const double reach =
                i % 3 == 0 ? share * fmax(0.0, truth.distance_m) : fabs(truth.distance_m + away);
            const shcd_detect_options options = random_options(&r, i, &truth);
            assert_int_equal(shcd_detect(s.model, s.shape, p, reach, &options, &d), SHCD_OK);
            assert_in_range(d.stage, 0, SHCD_N_STAGES - 1);
            assert_true(d.stage == SHCD_STAGE_SEARCH || (options.skipped >> d.stage & 1u) == 0);
            check_detection(&d, &truth, reach);
            n_at[d.stage]++;
            n_within += (size_t)d.is_within;
            n_cases++;
        }
        subject_free(&s);
    }
    print_message("%zu cases (bodies from seed 0xde7ec700): ball %zu, degree 1 %zu, seed %zu, "
                  "search %zu; within %zu\n",
                  n_cases, n_at[0], n_at[1], n_at[2], n_at[3], n_within);
    for (int k = 0; n_bodies >= N_BODIES && k < SHCD_N_STAGES; k++) {
        assert_true(n_at[k] > n_cases / 100);
    }
    assert_true(n_within > n_cases / 10 && n_within < n_cases - n_cases / 10);
}

/* The offset of degree 1 is 0 then, and the planes converge to the ellipsoid's own distance: half
 * of the distance suffices for the proof at any aspect up to 3. */
static void test_detect_ellipsoid_is_decided_at_degree_one(void **state) {
    check_random r = {0xe111};
    (void)state;
    for (int i = 0; i < 200; i++) {
        shcd_model *model =
            bodies_create_ellipsoid_turned(check_uniform(&r, 0.5, 1.5), check_uniform(&r, 0.5, 1.5),
                                           check_uniform(&r, 0.5, 1.5), &r);
        shcd_detect_options options = SHCD_DETECT_OPTIONS_INIT;
        options.skipped = 1u << SHCD_STAGE_BALL;
        for (int k = 0; k < 5; k++) {
            shcd_proximity truth;
            shcd_detection d;
            shcd_vec3 x, n;
            assert_int_equal(
                shcd_model_surface(model, -1, bodies_random_direction(&r), &x, &n, NULL), SHCD_OK);
            const shcd_vec3 p = shcd_mul_add(x, check_uniform(&r, 0.2, 2.0), n);
            assert_int_equal(shcd_closest(model, p, NULL, &truth), SHCD_OK);
            assert_int_equal(shcd_detect(model, NULL, p, 0.5 * truth.distance_m, &options, &d),
                             SHCD_OK);
            assert_int_equal(d.is_within, 0);
            assert_int_equal(d.stage, SHCD_STAGE_LOW_DEGREE);
            assert_true(d.lower_m <= truth.upper_m);
        }
        shcd_model_free(model);
    }
}

static void test_detect_caps_are_obeyed_and_flagged(void **state) {
    check_random r = {0xca95};
    shcd_model *model = bodies_create_random(&r, 8, 0.05);
    const shcd_model_info info = bodies_info(model);
    shcd_detect_options options = SHCD_DETECT_OPTIONS_INIT;
    shcd_detection d;
    (void)state;
    options.patches_max = 1;
    options.evaluations_max = 1;
    assert_int_equal(shcd_detect(model, NULL, info.centre_m, 0.0, &options, &d), SHCD_OK);
    assert_int_equal(d.stage, SHCD_STAGE_SEARCH);
    assert_true((d.flags & SHCD_PROXIMITY_TRUNCATED) != 0);
    shcd_model_free(model);
}

static void test_detect_bad_arguments_are_refused(void **state) {
    shcd_model *model = bodies_create_ellipsoid(1.0, 0.8, 0.6);
    const shcd_vec3 p = {2.0, 0.0, 0.0}, bad = {(double)NAN, 0.0, 0.0};
    shcd_detect_options options = SHCD_DETECT_OPTIONS_INIT;
    shcd_detection d, untouched;
    (void)state;
    memset(&d, 0x5a, sizeof d);
    untouched = d;
    assert_int_equal(shcd_detect(NULL, NULL, p, 0.1, NULL, &d), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_detect(model, NULL, p, -0.1, NULL, &d), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_detect(model, NULL, p, (double)INFINITY, NULL, &d), SHCD_ERR_NOT_FINITE);
    assert_int_equal(shcd_detect(model, NULL, bad, 0.1, NULL, &d), SHCD_ERR_NOT_FINITE);
    options.seed = bad;
    assert_int_equal(shcd_detect(model, NULL, p, 0.1, &options, &d), SHCD_ERR_NOT_FINITE);
    options.struct_size = 0;
    assert_int_equal(shcd_detect(model, NULL, p, 0.1, &options, &d), SHCD_ERR_ARGUMENT);
    assert_memory_equal(&d, &untouched, sizeof d);
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_detect_agrees_with_the_exact_distance),
        cmocka_unit_test(test_detect_ellipsoid_is_decided_at_degree_one),
        cmocka_unit_test(test_detect_caps_are_obeyed_and_flagged),
        cmocka_unit_test(test_detect_bad_arguments_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
