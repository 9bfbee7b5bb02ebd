/* SPDX-License-Identifier: BSD-3-Clause */
/* Training as a user calls it: the built-in membrane against the static answer of the modes, tables
 * with a known energy, errors, determinism. */
#include "shcd/fit.h"

#include "support/bodies.h"

#include <gsl/gsl_sf_expint.h>

#define DEGREE 8

static shcd_model *body(double a, double b, double c) {
    double coefficients[3 * SHCD_COUNT(DEGREE)] = {0.0};
    bodies_ellipsoid_coefficients(a, b, c, coefficients);
    /* a dent and a bump, so that no two places are alike */
    coefficients[3 * SHCD_INDEX(3, 1)] += 0.04 * a;
    coefficients[3 * SHCD_INDEX(2, -2) + 1] += 0.05 * b;
    coefficients[3 * SHCD_INDEX(4, 0) + 2] += 0.03 * c;
    return bodies_create(DEGREE, coefficients);
}

static shcd_model *train(const shcd_model *model, const shcd_train_options *options) {
    shcd_model *trained = NULL;
    shcd_error error = {SHCD_OK, ""};
    if (shcd_train(model, options, NULL, &trained, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    assert_non_null(shcd_model_learned(trained));
    return trained;
}

static void refused(const shcd_model *model, const shcd_train_options *options,
                    shcd_status expected, const char *text) {
    shcd_model *trained = NULL;
    shcd_error error = {SHCD_OK, ""};
    const shcd_status status = shcd_train(model, options, NULL, &trained, &error);
    if (status != expected || strstr(error.message, text) == NULL || trained != NULL) {
        fail_msg("status %d, '%s', not '%s'", (int)status, error.message, text);
    }
}

/* ---- the built-in membrane ---- */

/* depth/(sum_k (b_k phi_k)^2/(G h lambda_k + kappa) + W_res): the wave's static answer. */
static double static_force(const shcd_model *model, const shcd_learned *l, shcd_vec3 w,
                           double depth) {
    const shcd_modes *modes = shcd_model_modes(model);
    const double sigma2 = 0.25 * l->patch_radius_m * l->patch_radius_m;
    const double tension = l->young_pa / (2.0 * (1.0 + l->poisson_ratio)) * l->thickness_m;
    const double x = sigma2 / (l->support_length_m * l->support_length_m);
    double y[SHCD_COUNT(DEGREE)];
    double compliance =
        exp(x) *
        gsl_sf_expint_E1(sigma2 * 4.0 * BODIES_PI * (double)modes->n_modes / modes->area_m2 + x) /
        (4.0 * BODIES_PI * tension);
    assert_int_equal(shcd_harmonics(DEGREE, w, y, NULL, NULL), SHCD_OK);
    for (size_t k = 0; k < modes->n_modes; k++) {
        double phi = 0.0;
        for (size_t i = 0; i < SHCD_COUNT(DEGREE); i++) {
            phi += modes->coefficient_per_m[k * SHCD_COUNT(DEGREE) + i] * y[i];
        }
        const double lambda = modes->eigenvalue_per_m2[k];
        compliance +=
            phi * phi * exp(-sigma2 * lambda) / (tension * lambda + l->foundation_n_per_m3);
    }
    return depth / compliance;
}

typedef struct watched {
    size_t n;
    double worst;
} watched;

static void watch(const shcd_train_check *check, void *user) {
    watched *w = user;
    w->n++;
    w->worst = fmax(w->worst, fabs(check->force_n - check->network_force_n));
}

/* Of fresh samples of the same kind about one in a hundred is beyond the stored p99; more than four
 * times as many have a chance below 1e-4 (Poisson's law for 3 expected in 300). */
static void test_train_linear_is_the_static_answer_within_its_error(void **state) {
    shcd_model *model = body(0.05, 0.04, 0.03);
    shcd_train_options options = SHCD_TRAIN_OPTIONS_INIT;
    watched seen = {0, 0.0};
    check_random random = {11};
    size_t n_beyond = 0;
    const size_t n = 300;
    (void)state;
    options.n_points = 240;
    options.watch = watch;
    options.watch_user = &seen;
    shcd_model *trained = train(model, &options);
    const shcd_learned *l = shcd_model_learned(trained);
    const shcd_learned_record *r = &l->record;
    assert_non_null(shcd_model_modes(trained)); /* the body had none */
    assert_int_equal(seen.n, r->n_holdout);
    assert_near(seen.worst, r->force_error_max_n, 0.0);
    double worst = 0.0;
    for (size_t i = 0; i < n; i++) {
        const shcd_vec3 w = bodies_random_direction(&random);
        const double depth = check_uniform(&random, 0.0005, l->depth_max_m);
        shcd_vec3 x;
        shcd_learned_output out;
        assert_int_equal(shcd_model_surface(trained, -1, w, &x, NULL, NULL), SHCD_OK);
        assert_int_equal(shcd_learned_evaluate(l, x, depth, &out), SHCD_OK);
        assert_int_equal(out.flags, 0);
        const double error = fabs(out.force_n - static_force(trained, l, w, depth));
        n_beyond += error > r->force_error_p99_n;
        worst = fmax(worst, error);
    }
    print_message("linear: stored max %.3g p99 %.3g rms %.3g N of %.3g; fresh max %.3g N, %zu of "
                  "%zu beyond p99\n",
                  r->force_error_max_n, r->force_error_p99_n, r->force_error_rms_n, r->force_rms_n,
                  worst, n_beyond, n);
    assert_true(n_beyond <= 12);
    assert_at_most(worst, 2.0 * r->force_error_max_n);
    assert_at_most(r->force_error_rms_n, 0.005 * r->force_rms_n);
    shcd_model_free(trained);
    shcd_model_free(model);
}

/* For beta = 0 dents have no error of their own: what is left is that of the force. */
static void test_train_linear_dents_are_those_of_the_modes(void **state) {
    shcd_model *model = body(0.05, 0.04, 0.03);
    shcd_train_options options = SHCD_TRAIN_OPTIONS_INIT;
    (void)state;
    options.n_points = 40;
    shcd_model *trained = train(model, &options);
    const shcd_learned *l = shcd_model_learned(trained);
    const shcd_modes *modes = shcd_model_modes(trained);
    const double tension = l->young_pa / (2.0 * (1.0 + l->poisson_ratio)) * l->thickness_m;
    double phi[64], q[64];
    assert_int_equal(l->n_modes, modes->n_modes);
    assert_true(l->n_modes <= 64);
    for (size_t k = 0; k < l->n_modes; k++) {
        phi[k] = 1.0;
    }
    assert_int_equal(shcd_learned_dent(l, phi, 0.5, 0.004, q), SHCD_OK);
    for (size_t k = 0; k < l->n_modes; k++) {
        const double lambda = modes->eigenvalue_per_m2[k];
        const double b = exp(-0.125 * l->patch_radius_m * l->patch_radius_m * lambda);
        const double expected = 0.5 * b / (tension * lambda + l->foundation_n_per_m3);
        assert_near(q[k], expected, 1e-9 * expected);
    }
    shcd_model_free(trained);
    shcd_model_free(model);
}

static void test_train_stiffening_answers_above_the_linear_one(void **state) {
    shcd_model *model = body(0.05, 0.04, 0.03);
    shcd_train_options options = SHCD_TRAIN_OPTIONS_INIT;
    (void)state;
    options.n_points = 60;
    options.space_degree = 10;
    options.stiffening = 4.0;
    shcd_model *trained = train(model, &options);
    const shcd_learned *l = shcd_model_learned(trained);
    shcd_learned_output shallow, deep;
    const shcd_vec3 x = {l->centre_m[0], l->centre_m[1], l->centre_m[2]};
    assert_true(l->n_terms > 1);
    assert_at_most(l->record.quadrature_error, 1e-4);
    assert_int_equal(shcd_learned_evaluate(l, x, 0.1 * l->depth_max_m, &shallow), SHCD_OK);
    assert_int_equal(shcd_learned_evaluate(l, x, l->depth_max_m, &deep), SHCD_OK);
    print_message(
        "beta 4: %.4g N/m at a tenth, %.4g N/m at all of %.3g m; error rms %.3g of %.3g N, "
        "dents %.3g m\n",
        shallow.force_n / (0.1 * l->depth_max_m), deep.force_n / l->depth_max_m, l->depth_max_m,
        l->record.force_error_rms_n, l->record.force_rms_n, l->record.dent_error_max_m);
    assert_true(deep.force_n > 1.1 * 10.0 * shallow.force_n);
    assert_at_most(l->record.force_error_rms_n, 0.02 * l->record.force_rms_n);
    shcd_model_free(trained);
    shcd_model_free(model);
}

static size_t written(const shcd_model *model, unsigned char **bytes) {
    const size_t size = shcd_model_write_size(model);
    *bytes = malloc(size);
    assert_non_null(*bytes);
    assert_int_equal(shcd_model_write(model, *bytes, size), SHCD_OK);
    return size;
}

static void test_train_twice_gives_the_same_bits(void **state) {
    shcd_model *model = body(0.05, 0.04, 0.03);
    shcd_train_options options = SHCD_TRAIN_OPTIONS_INIT;
    unsigned char *bytes[2];
    size_t size[2];
    (void)state;
    options.n_points = 30;
    options.space_degree = 8;
    options.stiffening = 1.0;
    for (int i = 0; i < 2; i++) {
        shcd_model *trained = train(model, &options);
        size[i] = written(trained, &bytes[i]);
        shcd_model_free(trained);
    }
    assert_int_equal(size[0], size[1]);
    assert_memory_equal(bytes[0], bytes[1], size[0]);
    free(bytes[0]);
    free(bytes[1]);
    shcd_model_free(model);
}

/* ---- tables ---- */

#define N_PLACES 80
#define N_DEPTHS 4
#define N_ROWS (N_PLACES * N_DEPTHS)

/* U = k(x) (depth^2/2 + 10 depth^3), F = dU/d depth + 40 depth speed: smooth, stiffening. */
static void fill_table(const shcd_model *model, shcd_train_sample *row) {
    check_random random = {21};
    for (size_t i = 0; i < N_PLACES; i++) {
        const shcd_vec3 w = bodies_random_direction(&random);
        shcd_vec3 x;
        assert_int_equal(shcd_model_surface(model, -1, w, &x, NULL, NULL), SHCD_OK);
        const double k = 200.0 + 800.0 * x.x + 500.0 * x.z;
        for (size_t j = 0; j < N_DEPTHS; j++, row++) {
            const double d = 0.0025 * (double)(j + 1), v = check_uniform(&random, 0.0, 0.2);
            memset(row, 0, sizeof *row);
            row->point_m = x;
            row->depth_m = d;
            row->energy_j = k * (0.5 * d * d + 10.0 * d * d * d);
            row->force_n = k * (d + 30.0 * d * d);
            row->speed_m_per_s = v;
        }
    }
}

static void test_train_table_is_learned(void **state) {
    shcd_model *model = body(0.05, 0.04, 0.03);
    static shcd_train_sample row[N_ROWS];
    shcd_train_options options = SHCD_TRAIN_OPTIONS_INIT;
    (void)state;
    fill_table(model, row);
    options.samples = row;
    options.n_samples = N_ROWS;
    shcd_model *trained = train(model, &options);
    const shcd_learned *l = shcd_model_learned(trained);
    assert_int_equal(l->record.source, SHCD_LEARNED_SAMPLES);
    assert_int_equal(l->record.n_samples + l->record.n_holdout, N_ROWS);
    assert_int_equal(l->n_modes, 0);
    assert_near(l->record.consistency_rms_n, 0.0, 0.0);
    print_message("table: rms %.3g, max %.3g of %.3g N\n", l->record.force_error_rms_n,
                  l->record.force_error_max_n, l->record.force_rms_n);
    assert_at_most(l->record.force_error_rms_n, 0.01 * l->record.force_rms_n);
    shcd_model_free(trained);
    shcd_model_free(model);
}

static void test_train_table_with_energies_tells_consistency(void **state) {
    shcd_model *model = body(0.05, 0.04, 0.03);
    static shcd_train_sample row[N_ROWS];
    shcd_train_options options = SHCD_TRAIN_OPTIONS_INIT;
    double consistency[2];
    (void)state;
    options.samples = row;
    options.n_samples = N_ROWS;
    options.has_energy = 1;
    for (int i = 0; i < 2; i++) {
        fill_table(model, row);
        for (size_t k = 0; k < N_ROWS; k++) {
            row[k].force_n *= i == 0 ? 1.0 : 1.2; /* more than the slope of the energy */
        }
        shcd_model *trained = train(model, &options);
        const shcd_learned_record *r = &shcd_model_learned(trained)->record;
        consistency[i] = r->consistency_rms_n / r->force_rms_n;
        shcd_model_free(trained);
    }
    print_message("consistency: %.3g and %.3g of the force\n", consistency[0], consistency[1]);
    assert_at_most(consistency[0], 0.01);
    assert_near(consistency[1], 0.2 / 1.2, 0.02);
    shcd_model_free(model);
}

static void test_train_table_with_speeds_finds_the_damping(void **state) {
    shcd_model *model = body(0.05, 0.04, 0.03);
    static shcd_train_sample row[N_ROWS];
    shcd_train_options options = SHCD_TRAIN_OPTIONS_INIT;
    (void)state;
    fill_table(model, row);
    for (size_t k = 0; k < N_ROWS; k++) {
        row[k].force_n += 40.0 * row[k].depth_m * row[k].speed_m_per_s;
    }
    options.samples = row;
    options.n_samples = N_ROWS;
    options.has_speed = 1;
    shcd_model *trained = train(model, &options);
    /* the elastic part is fitted to 1 % of 2 N, the damping's rms is 0.03 N, over 320 rows */
    assert_near(shcd_model_learned(trained)->damping_n_s_per_m2, 40.0, 2.0);
    shcd_model_free(trained);
    shcd_model_free(model);
}

/* ---- refusals ---- */

static int stop(const char *stage, double fraction, void *user) {
    (void)stage;
    (void)fraction;
    return --*(int *)user < 0;
}

static void test_train_bad_options_are_refused(void **state) {
    shcd_model *model = body(0.05, 0.04, 0.03), *trained = NULL;
    const shcd_train_options good = SHCD_TRAIN_OPTIONS_INIT;
    shcd_train_options o = good;
    int calls = 20;
    (void)state;
    assert_int_equal(shcd_train(NULL, &o, NULL, &trained, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_train(model, &o, NULL, NULL, NULL), SHCD_ERR_ARGUMENT);
    o.struct_size = 0;
    refused(model, &o, SHCD_ERR_ARGUMENT, "SHCD_TRAIN_OPTIONS_INIT");
    o = good;
    o.poisson_ratio = 0.5;
    refused(model, &o, SHCD_ERR_ARGUMENT, "Poisson's ratio: 0.5");
    o = good;
    o.young_pa = (double)NAN;
    refused(model, &o, SHCD_ERR_NOT_FINITE, "Young's modulus [Pa] is not finite");
    o = good;
    o.n_points = 3;
    refused(model, &o, SHCD_ERR_ARGUMENT, "number of points: 3");
    o = good;
    o.n_centres = SHCD_LEARNED_CENTRES_MAX + 1;
    refused(model, &o, SHCD_ERR_ARGUMENT, "number of centres: 401");
    o = good;
    o.n_points = 20;
    o.progress = stop;
    o.progress_user = &calls;
    refused(model, &o, SHCD_ERR_CANCELLED, "");
    shcd_model_free(model);
}

static void test_train_bad_tables_are_refused(void **state) {
    shcd_model *model = body(0.05, 0.04, 0.03);
    static shcd_train_sample row[N_ROWS];
    shcd_train_options o = SHCD_TRAIN_OPTIONS_INIT;
    (void)state;
    o.samples = row;
    o.n_samples = N_ROWS;
    fill_table(model, row);
    row[7].depth_m = 0.0;
    refused(model, &o, SHCD_ERR_ARGUMENT, "sample 7: a depth of 0 m");
    fill_table(model, row);
    row[9].force_n = (double)INFINITY;
    refused(model, &o, SHCD_ERR_NOT_FINITE, "sample 9 is not finite");
    fill_table(model, row);
    row[11].point_m.x += 0.5;
    refused(model, &o, SHCD_ERR_ARGUMENT, "sample 11 is 0.");
    fill_table(model, row);
    o.n_samples = 7 * N_DEPTHS;
    refused(model, &o, SHCD_ERR_ARGUMENT, "samples at 7 different points; at least 8");
    o.n_samples = N_ROWS;
    for (size_t k = 0; k < N_ROWS; k++) {
        row[k].force_n = -1.0;
    }
    refused(model, &o, SHCD_ERR_CONVERGENCE, "does not resist");
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_train_linear_is_the_static_answer_within_its_error),
        cmocka_unit_test(test_train_linear_dents_are_those_of_the_modes),
        cmocka_unit_test(test_train_stiffening_answers_above_the_linear_one),
        cmocka_unit_test(test_train_twice_gives_the_same_bits),
        cmocka_unit_test(test_train_table_is_learned),
        cmocka_unit_test(test_train_table_with_energies_tells_consistency),
        cmocka_unit_test(test_train_table_with_speeds_finds_the_damping),
        cmocka_unit_test(test_train_bad_options_are_refused),
        cmocka_unit_test(test_train_bad_tables_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
