/* SPDX-License-Identifier: BSD-3-Clause */
/* The stiffening membrane: against the closed form of the linear one, against the energy of
 * displacements in all three directions, and against its own derivatives. */
#include "membrane.h"

#include "support/bodies.h"

#include "shcd/fit.h"

#include <gsl/gsl_sf_expint.h>

static shcd_model *ellipsoid(int degree, double a, double b, double c) {
    double *coefficients = calloc(3 * SHCD_COUNT(degree), sizeof *coefficients);
    assert_non_null(coefficients);
    bodies_ellipsoid_coefficients(a, b, c, coefficients);
    shcd_model *model = bodies_create(degree, coefficients);
    free(coefficients);
    return model;
}

static shcd_modes *modes_of(const shcd_model *model, size_t n) {
    shcd_modes_options options = SHCD_MODES_OPTIONS_INIT;
    shcd_modes *modes = NULL;
    options.n_modes = (int32_t)n;
    assert_int_equal(shcd_fit_modes(model, &options, &modes, NULL), SHCD_OK);
    return modes;
}

/* Liver: E = 5 kPa, nu = 0.45. */
static shcdi_membrane_material liver(double stiffening) {
    shcdi_membrane_material m = {5000.0, 0.45, 0.005, 0.02, 0.0, 0.0, stiffening};
    shcdi_membrane_match(&m);
    return m;
}

static shcdi_membrane *membrane_of(const shcd_model *model, const shcd_modes *modes, size_t n,
                                   double stiffening, size_t n_latitudes) {
    const shcdi_membrane_material material = liver(stiffening);
    shcdi_membrane *membrane = NULL;
    shcd_error error = {SHCD_OK, ""};
    if (shcdi_membrane_create(model, modes, n, &material, n_latitudes, &membrane, &error) !=
        SHCD_OK) {
        fail_msg("%s", error.message);
    }
    return membrane;
}

static shcdi_indentation press(shcdi_membrane *membrane, shcd_vec3 w, double depth, double *q) {
    shcdi_indentation out;
    assert_int_equal(shcdi_membrane_touch(membrane, w), SHCD_OK);
    assert_int_equal(shcdi_membrane_press(membrane, depth, 0.0, q, &out), SHCD_OK);
    return out;
}

/* ---- the linear membrane ---- */

static void test_match_gives_the_half_space(void **state) {
    const shcdi_membrane_material m = liver(0.0);
    (void)state;
    /* h = a e^x E1(x)/(pi (1 - nu)) */
    const double x = 0.125 * 0.125;
    assert_near(m.thickness_m, 0.005 * exp(x) * gsl_sf_expint_E1(x) / (BODIES_PI * 0.55), 1e-15);
    assert_near(m.foundation_n_per_m3 * 0.02 * 0.02 / m.thickness_m, 5000.0 / 2.9, 1e-9);
    /* the plane's compliance e^x E1(x)/(4 pi G h) is that of a punch, 1/(2 E* a) */
    assert_near(exp(x) * gsl_sf_expint_E1(x) / (4.0 * BODIES_PI * 5000.0 / 2.9 * m.thickness_m),
                (1.0 - 0.45 * 0.45) / (2.0 * 5000.0 * 0.005), 1e-15);
}

/* On a sphere the sum over a degree's harmonics is (2l+1)/(4 pi R^2) wherever the contact is. */
static void test_press_linear_on_a_sphere_is_the_closed_form(void **state) {
    const int degree = 15;
    const double radius = 0.05, sigma2 = 0.0025 * 0.0025;
    const size_t n = SHCD_COUNT(degree);
    const shcdi_membrane_material m = liver(0.0);
    const double tension = 5000.0 / 2.9 * m.thickness_m;
    double compliance = 0.0, *q = malloc(n * sizeof *q);
    check_random random = {5};
    (void)state;
    for (int l = 0; l <= degree; l++) {
        const double lambda = l * (l + 1.0) / (radius * radius);
        compliance += (2 * l + 1) / (4.0 * BODIES_PI * radius * radius) * exp(-sigma2 * lambda) /
                      (tension * lambda + m.foundation_n_per_m3);
    }
    const double x = sigma2 / (0.02 * 0.02), cut = sigma2 * (double)n / (radius * radius);
    const double residual = exp(x) * gsl_sf_expint_E1(cut + x) / (4.0 * BODIES_PI * tension);
    compliance += residual;
    shcd_model *model = ellipsoid(degree, radius, radius, radius);
    shcd_modes *modes = modes_of(model, n);
    shcdi_membrane *membrane = membrane_of(model, modes, n, 0.0, 0);
    assert_near(shcdi_membrane_residual(membrane), residual, 1e-12 * residual);
    for (int i = 0; i < 5; i++) {
        const double depth = check_uniform(&random, 0.001, 0.02);
        const shcdi_indentation got = press(membrane, bodies_random_direction(&random), depth, q);
        /* eigenvalues agree to 1e-8, the area to that, too */
        assert_near(got.force_n, depth / compliance, 3e-8 * depth / compliance);
        assert_near(got.energy_j, 0.5 * depth * depth / compliance,
                    3e-8 * depth * depth / compliance);
        assert_near(shcd_norm(got.torque_n), 0.0, 1e-7 * got.force_n * radius);
    }
    shcdi_membrane_free(membrane);
    shcd_modes_free(modes);
    shcd_model_free(model);
    free(q);
}

/* ---- the stiffening one: a body without symmetry, few modes ---- */

#define DEGREE 6
#define N ((size_t)(DEGREE + 1) * (DEGREE + 1))

typedef struct fixture {
    shcd_model *model;
    shcd_modes *modes;
    double q[N];
} fixture;

static fixture begin(void) {
    fixture f;
    f.model = ellipsoid(DEGREE, 0.03, 0.024, 0.018);
    f.modes = modes_of(f.model, N);
    return f;
}

static void end(fixture *f) {
    shcd_modes_free(f->modes);
    shcd_model_free(f->model);
}

static void test_press_from_any_start_ends_in_one_minimum(void **state) {
    fixture f = begin();
    shcdi_membrane *membrane = membrane_of(f.model, f.modes, N, 3.0, 0);
    const shcd_vec3 w = {0.6, -0.64, 0.48};
    check_random random = {6};
    (void)state;
    const shcdi_indentation first = press(membrane, w, 0.008, f.q);
    for (int i = 0; i < 5; i++) {
        double other[N];
        shcdi_indentation second;
        for (size_t k = 0; k < N; k++) {
            other[k] = f.q[k] * check_uniform(&random, -1.0, 3.0);
        }
        assert_int_equal(shcdi_membrane_press(membrane, 0.008, 0.008, other, &second), SHCD_OK);
        /* Newton ends within 1e-10 of the minimiser in the energy's norm */
        assert_near(second.energy_j, first.energy_j, 1e-13 * first.energy_j);
        assert_near(second.force_n, first.force_n, 1e-9 * first.force_n);
        for (size_t k = 0; k < N; k++) {
            assert_near(sqrt(shcdi_membrane_mode_stiffness(membrane, k)) * other[k],
                        sqrt(shcdi_membrane_mode_stiffness(membrane, k)) * f.q[k],
                        1e-9 * sqrt(2.0 * first.energy_j));
        }
    }
    shcdi_membrane_free(membrane);
    end(&f);
}

/* A central difference with step h errs by a third of what it changes by when h is doubled. */
static void test_force_is_the_slope_of_the_energy(void **state) {
    fixture f = begin();
    shcdi_membrane *membrane = membrane_of(f.model, f.modes, N, 2.0, 0);
    const shcd_vec3 w = {0.36, 0.48, 0.8};
    (void)state;
    for (int i = 1; i <= 4; i++) {
        const double depth = 0.003 * i, h = 1e-3 * depth;
        double difference[2];
        for (int k = 0; k < 2; k++) {
            const double step = h * (k + 1);
            difference[k] = (press(membrane, w, depth + step, f.q).energy_j -
                             press(membrane, w, depth - step, f.q).energy_j) /
                            (2.0 * step);
        }
        const shcdi_indentation at = press(membrane, w, depth, f.q);
        assert_near(at.force_n, difference[0],
                    fabs(difference[1] - difference[0]) + 1e-13 * at.energy_j / h);
    }
    shcdi_membrane_free(membrane);
    end(&f);
}

static void test_torque_is_the_gradient_over_the_parameter(void **state) {
    fixture f = begin();
    shcdi_membrane *membrane = membrane_of(f.model, f.modes, N, 2.0, 0);
    const shcd_vec3 w = {0.36, 0.48, 0.8}, along[2] = {{0.8, -0.6, 0.0}, {0.48, 0.64, -0.6}};
    (void)state;
    for (int e = 0; e < 2; e++) {
        double difference[2];
        for (int k = 0; k < 2; k++) {
            const double angle = 1e-3 * (k + 1);
            double energy[2];
            for (int s = 0; s < 2; s++) {
                const shcd_vec3 at = shcd_mul_add(shcd_scale(cos(angle), w),
                                                  (s == 0 ? -1.0 : 1.0) * sin(angle), along[e]);
                energy[s] = press(membrane, at, 0.006, f.q).energy_j;
            }
            difference[k] = (energy[1] - energy[0]) / (2.0 * angle);
        }
        const shcdi_indentation at = press(membrane, w, 0.006, f.q);
        assert_near(shcd_dot(at.torque_n, along[e]), difference[0],
                    fabs(difference[1] - difference[0]) + 1e-13 * at.energy_j / 1e-3);
        assert_true(fabs(difference[0]) > 10.0 * fabs(difference[1] - difference[0]));
    }
    shcdi_membrane_free(membrane);
    end(&f);
}

static void test_press_stiffens_with_depth_and_beta(void **state) {
    fixture f = begin();
    const double betas[] = {0.0, 0.5, 2.0, 8.0};
    const shcd_vec3 w = {0.0, 0.6, -0.8};
    double before[5] = {0.0};
    (void)state;
    for (size_t b = 0; b < 4; b++) {
        shcdi_membrane *membrane = membrane_of(f.model, f.modes, N, betas[b], 0);
        double k_before = 0.0;
        for (int i = 0; i < 5; i++) {
            const double depth = 0.002 * (i + 1);
            const double k = press(membrane, w, depth, f.q).force_n / depth;
            /* linear: the same at each depth, to the accuracy of the solution */
            assert_true(b == 0 ? fabs(k - before[0]) <= 1e-12 * k || i == 0
                               : k > 1.0001 * k_before);
            assert_true(b == 0 || k > before[i]);
            k_before = before[i] = k;
        }
        shcdi_membrane_free(membrane);
    }
    end(&f);
}

static void test_press_doubled_quadrature_agrees(void **state) {
    fixture f = begin();
    shcdi_membrane *coarse = membrane_of(f.model, f.modes, N, 4.0, 3 * (DEGREE + 1));
    shcdi_membrane *fine = membrane_of(f.model, f.modes, N, 4.0, 6 * (DEGREE + 1));
    const shcd_vec3 w = {0.48, 0.6, 0.64};
    (void)state;
    const shcdi_indentation a = press(coarse, w, 0.01, f.q), b = press(fine, w, 0.01, f.q);
    assert_near(a.energy_j, b.energy_j, 1e-4 * b.energy_j);
    shcdi_membrane_free(coarse);
    shcdi_membrane_free(fine);
    end(&f);
}

/* What is left out does not stiffen: fewer modes, less of it, and by how much. */
static void test_press_more_modes_stiffen_more(void **state) {
    const int degree = 15;
    shcd_model *model = ellipsoid(degree, 0.05, 0.05, 0.05);
    shcd_modes *modes = modes_of(model, SHCD_COUNT(degree));
    const size_t counts[3] = {16, 64, 256};
    double *q = malloc(SHCD_COUNT(degree) * sizeof *q), k[3];
    (void)state;
    for (int i = 0; i < 3; i++) {
        shcdi_membrane *linear = membrane_of(model, modes, counts[i], 0.0, 0);
        shcdi_membrane *membrane = membrane_of(model, modes, counts[i], 1.0, 0);
        const shcd_vec3 w = {0.0, 0.6, 0.8};
        k[i] = press(membrane, w, 0.01, q).force_n / press(linear, w, 0.01, q).force_n;
        shcdi_membrane_free(linear);
        shcdi_membrane_free(membrane);
    }
    print_message("stiffening at 10 mm, beta 1, 16, 64, 256 modes: %.4f %.4f %.4f\n", k[0], k[1],
                  k[2]);
    assert_true(k[0] > 1.0 && k[1] > k[0] && k[2] > k[1]);
    shcd_modes_free(modes);
    shcd_model_free(model);
    free(q);
}

/* ---- an oracle with three components ---- */

#define ORACLE_THETA 60
#define ORACLE_PHI 120

/* Values at the nodes of an independent quadrature: of each mode's gradient on the surface. */
typedef struct oracle {
    double *gx, *gy, *area; /* modes at each node; area of each node */
} oracle;

static oracle oracle_of(const fixture *f) {
    const size_t n_nodes = ORACLE_THETA * ORACLE_PHI, n = N;
    oracle o = {calloc(n_nodes * n, sizeof(double)), calloc(n_nodes * n, sizeof(double)),
                calloc(n_nodes, sizeof(double))};
    double node[ORACLE_THETA], weight[ORACLE_THETA];
    bodies_gauss_legendre(ORACLE_THETA, node, weight);
    for (size_t i = 0; i < n_nodes; i++) {
        const double z = node[i / ORACLE_PHI], s = sqrt(1.0 - z * z);
        const double phi = 2.0 * BODIES_PI * (double)(i % ORACLE_PHI) / ORACLE_PHI;
        const shcd_vec3 w = {s * cos(phi), s * sin(phi), z};
        double y[N], dy[3 * N], j[9];
        shcd_vec3 u, v, normal;
        assert_int_equal(shcd_harmonics(DEGREE, w, y, dy, NULL), SHCD_OK);
        assert_int_equal(shcd_model_surface(f->model, -1, w, NULL, &normal, j), SHCD_OK);
        u = shcd_unit(shcd_cross(w, shcd_vec3_make(0.3, 0.5, 0.8)));
        v = shcd_cross(w, u);
        const shcd_vec3 rows[3] = {{j[0], j[1], j[2]}, {j[3], j[4], j[5]}, {j[6], j[7], j[8]}};
        const shcd_vec3 su = {shcd_dot(rows[0], u), shcd_dot(rows[1], u), shcd_dot(rows[2], u)};
        const shcd_vec3 sv = {shcd_dot(rows[0], v), shcd_dot(rows[1], v), shcd_dot(rows[2], v)};
        const shcd_vec3 cross = shcd_cross(su, sv);
        o.area[i] = weight[i / ORACLE_PHI] * 2.0 * BODIES_PI / ORACLE_PHI * shcd_norm(cross);
        /* dual vectors of su, sv: grad_S f = f_u su* + f_v sv*; any orthonormal frame will do */
        const shcd_vec3 nn = shcd_unit(cross), e1 = shcd_unit(su), e2 = shcd_cross(nn, e1);
        const double a = shcd_dot(su, e1), b = shcd_dot(sv, e1), c = shcd_dot(sv, e2);
        for (size_t k = 0; k < n; k++) {
            double fu = 0.0, fv = 0.0;
            for (size_t h = 0; h < N; h++) {
                const double coefficient = f->modes->coefficient_per_m[k * N + h];
                const shcd_vec3 g = {dy[3 * h], dy[3 * h + 1], dy[3 * h + 2]};
                fu += coefficient * shcd_dot(g, u);
                fv += coefficient * shcd_dot(g, v);
            }
            o.gx[i * n + k] = fu / a;
            o.gy[i * n + k] = (fv - b * fu / a) / c;
        }
    }
    return o;
}

/* int h G/(2 beta) (exp(beta |grad d|^2) - 1) + kappa |d|^2/2 dA of d = sum_k d_k phi_k, three
 * components for each mode; the modes are orthonormal. */
static double oracle_energy(const oracle *o, const shcdi_membrane_material *m,
                            const double (*d)[3]) {
    double energy = 0.0, square = 0.0;
    for (size_t k = 0; k < N; k++) {
        square += d[k][0] * d[k][0] + d[k][1] * d[k][1] + d[k][2] * d[k][2];
    }
    for (size_t i = 0; i < ORACLE_THETA * ORACLE_PHI; i++) {
        double s = 0.0;
        for (int c = 0; c < 3; c++) {
            double x = 0.0, y = 0.0;
            for (size_t k = 0; k < N; k++) {
                x += d[k][c] * o->gx[i * N + k];
                y += d[k][c] * o->gy[i * N + k];
            }
            s += x * x + y * y;
        }
        energy += o->area[i] * (exp(m->stiffening * s) - 1.0);
    }
    const double tension = m->young_pa / (2.0 * (1.0 + m->poisson)) * m->thickness_m;
    return tension / (2.0 * m->stiffening) * energy + 0.5 * m->foundation_n_per_m3 * square;
}

/* d = -u n0 beats every admissible displacement nearby, in all three directions, and its energy is
 * that of the formula. */
static void test_press_is_the_minimum_over_three_components(void **state) {
    fixture f = begin();
    const shcdi_membrane_material material = liver(2.0);
    shcdi_membrane *membrane = membrane_of(f.model, f.modes, N, 2.0, 8 * (DEGREE + 1));
    const oracle o = oracle_of(&f);
    const shcd_vec3 w = {0.36, 0.48, 0.8}, n0 = shcd_unit(shcd_vec3_make(0.2, 0.3, 0.9));
    const double n[3] = {n0.x, n0.y, n0.z}, depth = 0.006;
    double d[N][3], tried[N][3];
    check_random random = {8};
    (void)state;
    const shcdi_indentation at = press(membrane, w, depth, f.q);
    const double in_series = 0.5 * shcdi_membrane_residual(membrane) * at.force_n * at.force_n;
    for (size_t k = 0; k < N; k++) {
        for (int c = 0; c < 3; c++) {
            d[k][c] = -f.q[k] * n[c];
        }
    }
    const double least = oracle_energy(&o, &material, (const double(*)[3])d) + in_series;
    /* both quadratures resolve the energy to 1e-8 and eigenvalues agree to that */
    assert_near(least, at.energy_j, 1e-7 * at.energy_j);
    for (int i = 0; i < 20; i++) {
        double in_depth = 0.0, weight = 0.0, change[N][3], force = at.force_n;
        for (size_t k = 0; k < N; k++) {
            const double c = shcdi_membrane_patch(membrane, k) * shcdi_membrane_phi(membrane)[k];
            for (int x = 0; x < 3; x++) {
                change[k][x] = 0.05 *
                               sqrt(2.0 * at.energy_j / (double)N /
                                    shcdi_membrane_mode_stiffness(membrane, k)) *
                               check_normal(&random);
                in_depth -= c * change[k][x] * n[x];
            }
            weight += c * c;
        }
        for (size_t k = 0; k < N; k++) { /* back onto the constraint */
            const double c = shcdi_membrane_patch(membrane, k) * shcdi_membrane_phi(membrane)[k];
            for (int x = 0; x < 3; x++) {
                tried[k][x] = d[k][x] + change[k][x] + in_depth * c / weight * n[x];
            }
        }
        const double energy = oracle_energy(&o, &material, (const double(*)[3])tried) +
                              0.5 * shcdi_membrane_residual(membrane) * force * force;
        assert_true(energy > least);
    }
    free(o.gx);
    free(o.gy);
    free(o.area);
    shcdi_membrane_free(membrane);
    end(&f);
}

static void test_create_more_modes_than_there_are_is_refused(void **state) {
    fixture f = begin();
    const shcdi_membrane_material material = liver(0.0);
    shcdi_membrane *membrane = NULL;
    shcd_error error;
    (void)state;
    assert_int_equal(
        shcdi_membrane_create(f.model, f.modes, N + 1, &material, 0, &membrane, &error),
        SHCD_ERR_ARGUMENT);
    assert_null(membrane);
    assert_non_null(strstr(error.message, "50 modes are wanted, the body has 49"));
    end(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_match_gives_the_half_space),
        cmocka_unit_test(test_press_linear_on_a_sphere_is_the_closed_form),
        cmocka_unit_test(test_press_from_any_start_ends_in_one_minimum),
        cmocka_unit_test(test_force_is_the_slope_of_the_energy),
        cmocka_unit_test(test_torque_is_the_gradient_over_the_parameter),
        cmocka_unit_test(test_press_stiffens_with_depth_and_beta),
        cmocka_unit_test(test_press_doubled_quadrature_agrees),
        cmocka_unit_test(test_press_more_modes_stiffen_more),
        cmocka_unit_test(test_press_is_the_minimum_over_three_components),
        cmocka_unit_test(test_create_more_modes_than_there_are_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
