/* SPDX-License-Identifier: BSD-3-Clause */
/* The learned response at run time: forces are the gradient of the energy, in the domain, where it
 * goes over into the direct model, and beyond; a model carries it through a file, and what could
 * mislead a tick does not get in. */
#include "shcd/learned.h"
#include "support/bodies.h"
#include "support/network.h"

#include <zlib.h>

#define DEGREE 3
#define CHUNK_HEADER 24
#define HEAD 256 /* of the payload: counts, scalars, record */
#define CHUNK_SIZE (CHUNK_HEADER + HEAD + 8 * NETWORK_NUMBERS + 4)

static shcd_learned_output evaluate(const shcd_learned *l, shcd_vec3 p, double depth) {
    shcd_learned_output out;
    assert_int_equal(shcd_learned_evaluate(l, p, depth, &out), SHCD_OK);
    return out;
}

/* Points in the domain, in its border and far outside; depths to three times the largest. */
static shcd_vec3 random_point(check_random *random) {
    return shcd_scale(check_uniform(random, 0.03, 0.12), bodies_random_direction(random));
}

/* ---- the gradient ---- */

/* A central difference errs by a third of its change when the step is halved, to leading order, and
 * by the rounding of two energies: this bound leaves three times as much. */
static double difference_bound(double coarse, double fine, double energy, double step) {
    return fabs(coarse - fine) + 1e-15 * fabs(energy) / step + 1e-12;
}

static void test_force_is_the_slope_of_the_energy(void **state) {
    double numbers[NETWORK_NUMBERS];
    const shcd_learned l = network_by_hand(numbers);
    check_random random = {77};
    const double h = 1e-6;
    (void)state;
    for (size_t i = 0; i < check_scaled(2000); i++) {
        const shcd_vec3 p = random_point(&random);
        const double d = check_uniform(&random, 3e-6, 0.03);
        if (fabs(d - l.depth_max_m) < 3.0 * h) {
            continue; /* the second derivative jumps there */
        }
        const shcd_learned_output out = evaluate(&l, p, d);
        const double fine =
            (evaluate(&l, p, d + h).energy_j - evaluate(&l, p, d - h).energy_j) / (2.0 * h);
        const double coarse =
            (evaluate(&l, p, d + 2 * h).energy_j - evaluate(&l, p, d - 2 * h).energy_j) / (4.0 * h);
        assert_near(out.force_n, fine, difference_bound(coarse, fine, out.energy_j, h));
        const double slope =
            (evaluate(&l, p, d + h).force_n - evaluate(&l, p, d - h).force_n) / (2.0 * h);
        assert_near(out.stiffness_n_per_m, slope, 1e-6 * fabs(slope) + 1e-6);
    }
}

static double along(shcd_vec3 v, int axis) {
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

static void test_slope_is_the_gradient_in_space(void **state) {
    double numbers[NETWORK_NUMBERS];
    const shcd_learned l = network_by_hand(numbers);
    check_random random = {78};
    const double h = 1e-6;
    size_t n_blended = 0;
    (void)state;
    for (size_t i = 0; i < check_scaled(2000); i++) {
        const shcd_vec3 p = random_point(&random);
        const double d = check_uniform(&random, 1e-4, 0.03);
        const shcd_learned_output out = evaluate(&l, p, d);
        n_blended += out.direct_share > 0.0 && out.direct_share < 1.0;
        for (int axis = 0; axis < 3; axis++) {
            const shcd_vec3 e = {axis == 0, axis == 1, axis == 2};
            double difference[2];
            for (int k = 0; k < 2; k++) {
                const double step = h * (k + 1);
                difference[k] = (evaluate(&l, shcd_mul_add(p, step, e), d).energy_j -
                                 evaluate(&l, shcd_mul_add(p, -step, e), d).energy_j) /
                                (2.0 * step);
            }
            /* across the border of the blend the second derivative jumps by at most
             * |s''| |U - U_direct|, s'' < 30/fill^2: a difference of step h errs by half of it */
            const double kink = 0.5 * h * 30.0 / (l.fill_m * l.fill_m) *
                                fabs(out.energy_j - 0.5 * l.direct_n_per_m * d * d);
            assert_near(along(out.slope_n, axis), difference[0],
                        difference_bound(difference[1], difference[0], out.energy_j, h) + kink);
        }
    }
    assert_true(n_blended > 0);
}

/* Largest jump of force and slope between neighbours on a walk. */
static void largest_jump(const shcd_learned *l, shcd_vec3 from, shcd_vec3 to, double depth_from,
                         double depth_to, int n, double jump[2]) {
    jump[0] = jump[1] = 0.0;
    shcd_learned_output before = evaluate(l, from, depth_from);
    for (int i = 1; i <= n; i++) {
        const double s = (double)i / n;
        const shcd_learned_output now = evaluate(l, shcd_mul_add(from, s, shcd_sub(to, from)),
                                                 depth_from + s * (depth_to - depth_from));
        jump[0] = fmax(jump[0], fabs(now.force_n - before.force_n));
        jump[1] = fmax(jump[1], shcd_norm(shcd_sub(now.slope_n, before.slope_n)));
        before = now;
    }
}

/* Of what is continuous the jumps shrink with the step; a jump would stay. */
static void test_blend_has_no_jump(void **state) {
    double numbers[NETWORK_NUMBERS];
    const shcd_learned l = network_by_hand(numbers);
    check_random random = {79};
    (void)state;
    for (size_t i = 0; i < check_scaled(50); i++) {
        const shcd_vec3 from = random_point(&random), to = random_point(&random);
        double coarse[2], fine[2];
        largest_jump(&l, from, to, 0.002, 0.03, 500, coarse);
        largest_jump(&l, from, to, 0.002, 0.03, 4000, fine);
        assert_at_most(fine[0], 0.25 * coarse[0]); /* an eighth, but for where the steps fall */
        assert_at_most(fine[1], 0.25 * coarse[1]);
    }
}

/* Work over a closed path, by the trapezoid rule with n nodes; and what is turned over meanwhile.
 */
static double work_of_path(const shcd_learned *l, shcd_vec3 centre, shcd_vec3 u, shcd_vec3 v, int n,
                           double *turned_over) {
    double work = 0.0;
    *turned_over = 0.0;
    for (int j = 0; j < n; j++) {
        const double a = 2.0 * BODIES_PI * j / n, c = cos(a), s = sin(a);
        const shcd_vec3 p = shcd_mul_add(shcd_mul_add(centre, c, u), s, v);
        const shcd_vec3 dp = shcd_mul_add(shcd_scale(-s, u), c, v);
        const shcd_learned_output out = evaluate(l, p, 0.009 + 0.008 * cos(3.0 * a));
        const double press = out.force_n * -0.024 * sin(3.0 * a);
        work += (press + shcd_dot(out.slope_n, dp)) * 2.0 * BODIES_PI / n;
        *turned_over += fabs(press) * 2.0 * BODIES_PI / n;
    }
    return work;
}

/* The integral is zero, what is left is the error of the rule: where second derivatives jump it
 * goes with the square of the step, so 16 times as many nodes leave 1/256; a force that is no
 * gradient would leave all of it. */
static void test_closed_paths_yield_nothing(void **state) {
    double numbers[NETWORK_NUMBERS];
    const shcd_learned l = network_by_hand(numbers);
    check_random random = {80};
    double coarse = 0.0, fine = 0.0, all = 0.0;
    (void)state;
    for (size_t i = 0; i < check_scaled(20); i++) {
        const shcd_vec3 centre = random_point(&random);
        const double radius = check_uniform(&random, 0.005, 0.05);
        const shcd_vec3 u = shcd_scale(radius, bodies_random_direction(&random));
        const shcd_vec3 v = shcd_scale(radius, bodies_random_direction(&random));
        double turned_over;
        coarse += fabs(work_of_path(&l, centre, u, v, 1000, &turned_over));
        fine += fabs(work_of_path(&l, centre, u, v, 16000, &turned_over));
        all += turned_over;
    }
    assert_at_most(fine, coarse / 16.0 + 1e-14 * all);
    assert_at_most(fine, 1e-6 * all);
}

/* ---- the domain ---- */

static void test_outside_is_the_direct_model_and_flagged(void **state) {
    double numbers[NETWORK_NUMBERS];
    const shcd_learned l = network_by_hand(numbers);
    const shcd_vec3 centre = {numbers[0], numbers[1], numbers[2]}, far = {0.3, 0.0, 0.0};
    (void)state;
    shcd_learned_output out = evaluate(&l, far, 0.005);
    assert_int_equal(out.flags, SHCD_LEARNED_FAR);
    assert_near(out.direct_share, 1.0, 0.0);
    assert_near(out.force_n, 80.0 * 0.005, 1e-15);
    assert_near(out.energy_j, 0.5 * 80.0 * 0.005 * 0.005, 1e-17);
    assert_near(shcd_norm(out.slope_n), 0.0, 0.0);
    out = evaluate(&l, centre, 0.01);
    assert_int_equal(out.flags, 0);
    assert_near(out.direct_share, 0.0, 0.0);
    const shcd_learned_output deep = evaluate(&l, centre, 0.014);
    assert_int_equal(deep.flags, SHCD_LEARNED_DEEP);
    assert_near(deep.force_n, out.force_n + 80.0 * 0.004, 1e-14);
    for (int i = -1; i <= 0; i++) {
        out = evaluate(&l, centre, 1e-3 * i);
        assert_near(out.energy_j, 0.0, 0.0);
        assert_near(out.force_n, 0.0, 0.0);
        assert_near(shcd_norm(out.slope_n), 0.0, 0.0);
    }
}

/* A constant alone: all of U is a formula. */
static void test_one_constant_is_its_polynomial(void **state) {
    const double centre[3] = {0.0, 0.0, 0.0}, weight[6] = {100.0, 10.0, 4.0, 0.0, 0.0, 0.0};
    shcd_learned l;
    memset(&l, 0, sizeof l);
    l.n_centres = 1;
    l.n_terms = 3;
    l.centre_m = centre;
    l.weight_n_per_m = weight;
    l.support_m = l.fill_m = 1.0;
    l.depth_max_m = 0.01;
    (void)state;
    for (int i = 1; i <= 10; i++) {
        const double d = 1e-3 * i, t = 200.0 * d - 1.0;
        const double k = 100.0 + 10.0 * t + 4.0 * (2.0 * t * t - 1.0);
        const double slope = 200.0 * (10.0 + 16.0 * t);
        const shcd_learned_output out = evaluate(&l, shcd_vec3_make(0.1, 0.2, 0.3), d);
        assert_near(out.energy_j, 0.5 * d * d * k, 1e-16);
        assert_near(out.force_n, d * k + 0.5 * d * d * slope, 1e-13);
        assert_near(out.stiffness_n_per_m, k + 2.0 * d * slope + 0.5 * d * d * 640000.0, 1e-10);
    }
}

static void test_dent_is_force_times_shape(void **state) {
    double numbers[NETWORK_NUMBERS], q[NETWORK_MODES];
    const double phi[NETWORK_MODES] = {4.0, -7.0};
    const shcd_learned l = network_by_hand(numbers);
    (void)state;
    assert_int_equal(shcd_learned_dent(&l, phi, 0.3, 0.0025, q), SHCD_OK);
    for (size_t k = 0; k < NETWORK_MODES; k++) {
        const double *g = l.dent_m3_per_n + k * NETWORK_TERMS, t = -0.5;
        assert_near(q[k], 0.3 * phi[k] * (g[0] + t * g[1] + (2 * t * t - 1.0) * g[2]), 1e-20);
    }
    double beyond[NETWORK_MODES];
    assert_int_equal(shcd_learned_dent(&l, phi, 0.3, 0.01, q), SHCD_OK);
    assert_int_equal(shcd_learned_dent(&l, phi, 0.3, 0.5, beyond), SHCD_OK);
    assert_memory_equal(q, beyond, sizeof q);
    shcd_learned without = l;
    without.n_modes = 0;
    assert_int_equal(shcd_learned_dent(&without, phi, 0.3, 0.01, q), SHCD_ERR_UNSUPPORTED);
    assert_int_equal(shcd_learned_dent(NULL, phi, 0.3, 0.01, q), SHCD_ERR_ARGUMENT);
}

static void test_evaluate_bad_arguments_are_refused(void **state) {
    double numbers[NETWORK_NUMBERS];
    const shcd_learned l = network_by_hand(numbers);
    const shcd_vec3 p = {0.0, 0.0, 0.05}, bad = {0.0, (double)NAN, 0.0};
    shcd_learned_output out;
    (void)state;
    assert_int_equal(shcd_learned_evaluate(NULL, p, 0.1, &out), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_learned_evaluate(&l, p, 0.1, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_learned_evaluate(&l, bad, 0.1, &out), SHCD_ERR_NOT_FINITE);
    assert_int_equal(shcd_learned_evaluate(&l, p, (double)INFINITY, &out), SHCD_ERR_NOT_FINITE);
}

/* ---- in a model and its file ---- */

static shcd_status create(const shcd_learned *learned, shcd_model **model, shcd_error *error) {
    double coefficients[3 * SHCD_COUNT(DEGREE)];
    const double eigenvalues[NETWORK_MODES] = {0.0, 800.0};
    double modes_coefficients[NETWORK_MODES * SHCD_COUNT(DEGREE)] = {20.0};
    const shcd_modes modes = {
        NETWORK_MODES, eigenvalues, modes_coefficients, 0.03, 0.0, 5e-4, 0, 0};
    check_random random = {0xc057u};
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    modes_coefficients[SHCD_COUNT(DEGREE) + 1] = 20.0;
    bodies_random_coefficients(&random, DEGREE, 0.05, coefficients);
    def.degree = DEGREE;
    def.coefficients = coefficients;
    def.modes = &modes;
    def.learned = learned;
    return shcd_model_create(&def, NULL, model, error);
}

static size_t written(const shcd_model *model, unsigned char **bytes) {
    const size_t size = shcd_model_write_size(model);
    *bytes = malloc(size);
    assert_non_null(*bytes);
    assert_int_equal(shcd_model_write(model, *bytes, size), SHCD_OK);
    return size;
}

static void test_learned_goes_through_a_file_unchanged(void **state) {
    double numbers[NETWORK_NUMBERS];
    shcd_learned l = network_by_hand(numbers);
    shcd_model *model = NULL, *copy = NULL;
    unsigned char *bytes = NULL, *again = NULL;
    (void)state;
    l.record.source = SHCD_LEARNED_SAMPLES;
    assert_int_equal(create(&l, &model, NULL), SHCD_OK);
    const size_t size = written(model, &bytes);
    assert_int_equal(shcd_model_read(bytes, size, NULL, &copy, NULL), SHCD_OK);
    const shcd_learned *got = shcd_model_learned(copy);
    assert_non_null(got);
    assert_memory_equal(got->centre_m, numbers, sizeof numbers);
    shcd_learned view = *got;
    view.centre_m = l.centre_m;
    view.weight_n_per_m = l.weight_n_per_m;
    view.dent_m3_per_n = l.dent_m3_per_n;
    assert_memory_equal(&view, &l, sizeof l);
    assert_int_equal(written(copy, &again), size);
    assert_memory_equal(bytes, again, size);
    free(bytes);
    free(again);
    shcd_model_free(copy);
    shcd_model_free(model);
}

static void test_learned_none_is_no_chunk_and_no_memory(void **state) {
    double numbers[NETWORK_NUMBERS];
    const shcd_learned l = network_by_hand(numbers);
    shcd_model *without = NULL, *with = NULL;
    (void)state;
    assert_int_equal(create(NULL, &without, NULL), SHCD_OK);
    assert_int_equal(create(&l, &with, NULL), SHCD_OK);
    assert_null(shcd_model_learned(without));
    assert_null(shcd_model_learned(NULL));
    assert_int_equal(shcd_model_write_size(with) - shcd_model_write_size(without), CHUNK_SIZE);
    assert_int_equal(bodies_info(with).run_time_bytes - bodies_info(without).run_time_bytes,
                     sizeof numbers);
    shcd_model_free(with);
    shcd_model_free(without);
}

static void refused(const shcd_learned *l, shcd_status expected, const char *text) {
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    const shcd_status status = create(l, &model, &error);
    if (status != expected || strstr(error.message, text) == NULL || model != NULL) {
        fail_msg("status %d, '%s', not '%s'", (int)status, error.message, text);
    }
}

static void test_create_misleading_network_is_refused(void **state) {
    double numbers[NETWORK_NUMBERS];
    const shcd_learned good = network_by_hand(numbers);
    shcd_learned l = good;
    (void)state;
    l.n_centres = SHCD_LEARNED_CENTRES_MAX + 1;
    refused(&l, SHCD_ERR_ARGUMENT, "401 centres");
    l = good;
    l.n_terms = 0;
    refused(&l, SHCD_ERR_ARGUMENT, "0 terms");
    l = good;
    l.n_modes = NETWORK_MODES + 1;
    refused(&l, SHCD_ERR_ARGUMENT, "dents of 3 modes, the body has 2");
    l = good;
    l.record.source = 2;
    refused(&l, SHCD_ERR_ARGUMENT, "unknown source 2");
    l = good;
    l.centre_m = NULL;
    refused(&l, SHCD_ERR_ARGUMENT, "no centres");
    l = good;
    l.support_m = 0.0;
    refused(&l, SHCD_ERR_ARGUMENT, "value 0 of the learned response is 0");
    l = good;
    l.depth_max_m = (double)NAN;
    refused(&l, SHCD_ERR_NOT_FINITE, "value 2 of the learned response is not finite");
    l = good;
    l.direct_n_per_m = -1.0;
    refused(&l, SHCD_ERR_ARGUMENT, "value 3 of the learned response is -1");
    l = good;
    l.record.force_rms_n = -1.0;
    refused(&l, SHCD_ERR_ARGUMENT, "record 3");
    numbers[4] = (double)INFINITY;
    refused(&good, SHCD_ERR_NOT_FINITE, "coordinate 4");
    numbers[4] = 0.01;
    numbers[3 * NETWORK_CENTRES] = -50.0; /* an energy below zero */
    refused(&good, SHCD_ERR_ARGUMENT, "the learned response at centre 0, depth 0.00125 m");
    numbers[3 * NETWORK_CENTRES] = 100.0;
    numbers[3 * NETWORK_CENTRES + 2] = -90.0; /* a force that falls below zero */
    refused(&good, SHCD_ERR_ARGUMENT, "the learned response at centre 0");
}

static void put(unsigned char *p, uint64_t bits, size_t n) {
    for (size_t i = 0; i < n; i++) {
        p[i] = (unsigned char)(bits >> (8 * i));
    }
}

/* Changes bytes of the payload, mends the sum, and expects the refusal. */
static void refused_in_file(size_t at, uint64_t bits, size_t n, shcd_status expected,
                            const char *text) {
    double numbers[NETWORK_NUMBERS];
    const shcd_learned l = network_by_hand(numbers);
    shcd_model *model = NULL, *copy = NULL;
    unsigned char *bytes = NULL;
    shcd_error error = {SHCD_OK, ""};
    assert_int_equal(create(&l, &model, NULL), SHCD_OK);
    const size_t size = written(model, &bytes), chunk = size - CHUNK_SIZE;
    assert_memory_equal(bytes + chunk, "LEAR", 4);
    put(bytes + chunk + CHUNK_HEADER + at, bits, n);
    put(bytes + size - 4, crc32(0, bytes + chunk, CHUNK_SIZE - 4), 4);
    const shcd_status status = shcd_model_read(bytes, size, NULL, &copy, &error);
    if (status != expected || strstr(error.message, text) == NULL || copy != NULL) {
        fail_msg("status %d, '%s', not '%s'", (int)status, error.message, text);
    }
    free(bytes);
    shcd_model_free(model);
}

static void test_read_misleading_chunk_is_refused(void **state) {
    const uint64_t nan_bits = 0x7ff8000000000000u, minus_one = 0xbff0000000000000u;
    const uint64_t huge = 0x7fefffffffffffffu;
    (void)state;
    refused_in_file(0, 0, 4, SHCD_ERR_FORMAT, "LEAR");
    refused_in_file(0, NETWORK_CENTRES + 1, 4, SHCD_ERR_FORMAT, "LEAR");
    refused_in_file(0, UINT32_MAX, 4, SHCD_ERR_FORMAT, "LEAR");
    refused_in_file(4, UINT32_MAX, 4, SHCD_ERR_FORMAT, "LEAR");
    refused_in_file(8, UINT32_MAX, 4, SHCD_ERR_FORMAT, "LEAR");
    refused_in_file(12, 7, 4, SHCD_ERR_FORMAT, "LEAR at byte");
    refused_in_file(32, nan_bits, 8, SHCD_ERR_NOT_FINITE, "value 0");
    refused_in_file(40, minus_one, 8, SHCD_ERR_FORMAT, "value 1");
    refused_in_file(48, huge, 8, SHCD_ERR_FORMAT, "value 2");
    refused_in_file(HEAD, huge, 8, SHCD_ERR_FORMAT, "coordinate 0");
    refused_in_file(HEAD + 8 * 3 * NETWORK_CENTRES, huge, 8, SHCD_ERR_FORMAT, "weight 0");
    refused_in_file(HEAD + 8 * 3 * NETWORK_CENTRES, minus_one, 8, SHCD_ERR_FORMAT, "at centre 0");
    refused_in_file(HEAD + 8 * (NETWORK_NUMBERS - 1), nan_bits, 8, SHCD_ERR_NOT_FINITE, "dent 5");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_force_is_the_slope_of_the_energy),
        cmocka_unit_test(test_slope_is_the_gradient_in_space),
        cmocka_unit_test(test_blend_has_no_jump),
        cmocka_unit_test(test_closed_paths_yield_nothing),
        cmocka_unit_test(test_outside_is_the_direct_model_and_flagged),
        cmocka_unit_test(test_one_constant_is_its_polynomial),
        cmocka_unit_test(test_dent_is_force_times_shape),
        cmocka_unit_test(test_evaluate_bad_arguments_are_refused),
        cmocka_unit_test(test_learned_goes_through_a_file_unchanged),
        cmocka_unit_test(test_learned_none_is_no_chunk_and_no_memory),
        cmocka_unit_test(test_create_misleading_network_is_refused),
        cmocka_unit_test(test_read_misleading_chunk_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
