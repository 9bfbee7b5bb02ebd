/* SPDX-License-Identifier: BSD-3-Clause */
/* Modes against closed forms, against a quadrature that shares nothing with the fit's, and against
 * finite elements. */
#include "modes.h"

#include "support/bodies.h"
#include "support/membrane_fe.h"

#include "shcd/fit.h"

#include <gsl/gsl_sf_ellint.h>

/* What shcd_fit_modes() promises of eigenvalues, relative to lambda + 1/area. */
#define AGREEMENT 1e-8

static shcd_modes *modes_of(const shcd_model *model, int n_modes, const shcd_anchor *anchors,
                            size_t n_anchors) {
    shcd_modes_options options = SHCD_MODES_OPTIONS_INIT;
    shcd_modes *modes = NULL;
    shcd_error error = {SHCD_OK, ""};
    options.n_modes = n_modes;
    options.anchors = anchors;
    options.n_anchors = n_anchors;
    if (shcd_fit_modes(model, &options, &modes, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    return modes;
}

/* The same surface in a space of more harmonics. */
static shcd_model *ellipsoid_of_degree(int degree, double a, double b, double c) {
    double *coefficients = calloc(3 * SHCD_COUNT(degree), sizeof *coefficients);
    assert_non_null(coefficients);
    bodies_ellipsoid_coefficients(a, b, c, coefficients);
    shcd_model *model = bodies_create(degree, coefficients);
    free(coefficients);
    return model;
}

/* ---- closed forms ---- */

static void test_modes_of_a_sphere_are_the_harmonics(void **state) {
    const int degree = 15;
    const double radius_m = 0.05;
    (void)state;
    shcd_model *model = ellipsoid_of_degree(degree, radius_m, radius_m, radius_m);
    shcd_modes *modes = modes_of(model, (int)SHCD_COUNT(degree), NULL, 0);
    double worst = 0.0;
    size_t k = 0;
    for (int l = 0; l <= degree; l++) {
        const double expected = (double)l * (l + 1) / (radius_m * radius_m);
        for (int m = -l; m <= l; m++, k++) { /* just 2l + 1 of them */
            assert_near(modes->eigenvalue_per_m2[k], expected, 1e-10 * expected);
            worst = fmax(worst, l > 0 ? fabs(modes->eigenvalue_per_m2[k] / expected - 1.0) : 0.0);
            for (int other = 0; other <= degree; other++) { /* only harmonics of its own degree */
                for (int n = -other; other != l && n <= other; n++) {
                    const size_t at = k * SHCD_COUNT(degree) + SHCD_INDEX(other, n);
                    assert_near(modes->coefficient_per_m[at], 0.0, 1e-9 / radius_m);
                }
            }
        }
    }
    assert_int_equal(k, modes->n_modes);
    print_message("sphere: eigenvalues within %.2g\n", worst);
    assert_at_most(modes->eigenvalue_error, AGREEMENT);
    shcd_modes_free(modes);
    shcd_model_free(model);
}

/* a > b > c; the surface by Legendre's integrals, e.g. DLMF 19.33.2. */
static double ellipsoid_area(double a, double b, double c) {
    const double phi = acos(c / a), s = sin(phi);
    const double k = a / b * sqrt((b - c) * (b + c) / ((a - c) * (a + c)));
    const double e = gsl_sf_ellint_E(phi, k, GSL_PREC_DOUBLE);
    const double f = gsl_sf_ellint_F(phi, k, GSL_PREC_DOUBLE);
    return 2.0 * BODIES_PI * (c * c + a * b / s * (e * s * s + f * (1.0 - s * s)));
}

/* The volume's integrand is a polynomial: rounding. The area converges with the eigenvalues. */
static void test_modes_area_and_volume_of_ellipsoids(void **state) {
    static const double axes[4][3] = {
        {0.06, 0.05, 0.04}, {0.05, 0.03, 0.01}, {1.0, 0.1, 0.05}, {1.0, 0.9, 0.05}};
    (void)state;
    for (size_t i = 0; i < 4; i++) {
        const double a = axes[i][0], b = axes[i][1], c = axes[i][2];
        shcd_model *model = ellipsoid_of_degree(3, a, b, c);
        shcd_modes *modes = modes_of(model, 9, NULL, 0);
        const double volume = 4.0 / 3.0 * BODIES_PI * a * b * c, area = ellipsoid_area(a, b, c);
        print_message("ellipsoid %g %g %g: area %.2g, volume %.2g\n", a, b, c,
                      modes->area_m2 / area - 1.0, modes->volume_m3 / volume - 1.0);
        assert_near(modes->volume_m3, volume, 1e-12 * volume);
        assert_near(modes->area_m2, area, AGREEMENT * area);
        shcd_modes_free(modes);
        shcd_model_free(model);
    }
}

static void test_modes_lowest_is_constant(void **state) {
    (void)state;
    check_random random = {0x40de5u};
    shcd_model *model = bodies_create_random(&random, 5, 0.05);
    shcd_modes *modes = modes_of(model, 1, NULL, 0);
    assert_true(modes->n_modes == 1 && modes->eigenvalue_per_m2[0] == 0.0);
    assert_near(modes->coefficient_per_m[0], sqrt(4.0 * BODIES_PI / modes->area_m2),
                4e-16 * modes->coefficient_per_m[0]);
    for (size_t i = 1; i < SHCD_COUNT(5); i++) {
        assert_true(modes->coefficient_per_m[i] == 0.0);
    }
    shcd_modes_free(modes);
    shcd_model_free(model);
}

/* ---- another quadrature: Gauss x Gauss on the six faces of a cube, w = (1, u, v)/|..| ---- */

typedef struct cube {
    const shcd_model *model;
    const shcd_modes *modes;
    const shcd_anchor *anchor; /* NULL: none */
    double *values;            /* n_modes values, then 3 n_modes surface gradients */
    double *mass, *stiffness;  /* n_modes x n_modes */
    double *harmonics;         /* values and gradients */
} cube;

/* The gradient on the surface of a function with tangential gradient h on the sphere: with J the
 * derivatives of S in the tangent frame, J (J^T J)^-1 h. */
static shcd_vec3 surface_gradient(shcd_vec3 s1, shcd_vec3 s2, double h1, double h2) {
    const double a = shcd_dot(s1, s1), b = shcd_dot(s1, s2), c = shcd_dot(s2, s2);
    const double det = a * c - b * b;
    return shcd_add(shcd_scale((c * h1 - b * h2) / det, s1),
                    shcd_scale((a * h2 - b * h1) / det, s2));
}

static void add_node(cube *q, shcd_vec3 w, double share) {
    const size_t n = q->modes->n_modes, count = SHCD_COUNT(shcd_model_degree(q->model));
    const shcd_vec3 t1 = shcd_unit(shcd_cross(w, fabs(w.x) < 0.6 ? shcd_vec3_make(1.0, 0.0, 0.0)
                                                                 : shcd_vec3_make(0.0, 1.0, 0.0)));
    const shcd_vec3 t2 = shcd_cross(w, t1);
    double jacobian[9], alpha = 0.0;
    shcd_vec3 point, s1, s2;
    assert_int_equal(shcd_model_surface(q->model, -1, w, &point, NULL, jacobian), SHCD_OK);
    const double *j = jacobian;
    s1 = shcd_vec3_make(j[0] * t1.x + j[1] * t1.y + j[2] * t1.z,
                        j[3] * t1.x + j[4] * t1.y + j[5] * t1.z,
                        j[6] * t1.x + j[7] * t1.y + j[8] * t1.z);
    s2 = shcd_vec3_make(j[0] * t2.x + j[1] * t2.y + j[2] * t2.z,
                        j[3] * t2.x + j[4] * t2.y + j[5] * t2.z,
                        j[6] * t2.x + j[7] * t2.y + j[8] * t2.z);
    const double dA = share * shcd_norm(shcd_cross(s1, s2));
    if (q->anchor != NULL) {
        const double r = shcd_norm(shcd_sub(point, q->anchor->point_m)) / q->anchor->radius_m;
        alpha = r < 1.0 ? q->anchor->alpha_per_m2 * pow(1.0 - r * r, 4.0) : 0.0;
    }
    double *y = q->harmonics, *g = y + count;
    assert_int_equal(shcd_harmonics(shcd_model_degree(q->model), w, y, g, NULL), SHCD_OK);
    for (size_t k = 0; k < n; k++) {
        const double *v = q->modes->coefficient_per_m + k * count;
        shcd_vec3 gradient = {0.0, 0.0, 0.0};
        q->values[k] = 0.0;
        for (size_t i = 0; i < count; i++) {
            q->values[k] += v[i] * y[i];
            gradient =
                shcd_mul_add(gradient, v[i], shcd_vec3_make(g[3 * i], g[3 * i + 1], g[3 * i + 2]));
        }
        const shcd_vec3 on_surface =
            surface_gradient(s1, s2, shcd_dot(gradient, t1), shcd_dot(gradient, t2));
        memcpy(q->values + n + 3 * k, &on_surface, sizeof on_surface);
    }
    for (size_t a = 0; a < n; a++) {
        for (size_t b = 0; b <= a; b++) {
            const double *ga = q->values + n + 3 * a, *gb = q->values + n + 3 * b;
            const double product = q->values[a] * q->values[b];
            q->mass[a * n + b] += dA * product;
            q->stiffness[a * n + b] +=
                dA * (ga[0] * gb[0] + ga[1] * gb[1] + ga[2] * gb[2] + alpha * product);
        }
    }
}

static void integrate_cube(cube *q, int n) {
    double *node = calloc(2 * (size_t)n, sizeof *node), *weight = node + n;
    assert_non_null(node);
    bodies_gauss_legendre(n, node, weight);
    for (int face = 0; face < 6; face++) {
        for (int i = 0; i < n; i++) {
            for (int k = 0; k < n; k++) {
                const double u = node[i], v = node[k], one = face < 3 ? 1.0 : -1.0;
                const double square = 1.0 + u * u + v * v;
                const shcd_vec3 p = face % 3 == 0   ? shcd_vec3_make(one, u, v)
                                    : face % 3 == 1 ? shcd_vec3_make(u, one, v)
                                                    : shcd_vec3_make(u, v, one);
                add_node(q, shcd_unit(p), weight[i] * weight[k] / (square * sqrt(square)));
            }
        }
    }
    free(node);
}

/* M-orthonormal, and K diagonal with the eigenvalues: together they are the eigenproblem in the
 * space of the modes. Both within the agreement that the fit promises; the cube's grid of that size
 * is finer than what the fit needs for these bodies. */
static void check_modes(const shcd_model *model, const shcd_anchor *anchor, int nodes,
                        const char *name) {
    const int degree = shcd_model_degree(model);
    shcd_modes *modes = modes_of(model, (int)SHCD_COUNT(degree), anchor, anchor != NULL);
    const size_t n = modes->n_modes;
    double *memory = calloc(4 * n + 2 * n * n + 4 * SHCD_COUNT(degree), sizeof *memory);
    assert_non_null(memory);
    cube q = {model,
              modes,
              anchor,
              memory,
              memory + 4 * n,
              memory + 4 * n + n * n,
              memory + 4 * n + 2 * n * n};
    double worst_mass = 0.0, worst_stiffness = 0.0;
    integrate_cube(&q, nodes);
    for (size_t a = 0; a < n; a++) {
        for (size_t b = 0; b <= a; b++) {
            const double lambda = a == b ? modes->eigenvalue_per_m2[a] : 0.0;
            const double scale = sqrt((modes->eigenvalue_per_m2[a] + 1.0 / modes->area_m2) *
                                      (modes->eigenvalue_per_m2[b] + 1.0 / modes->area_m2));
            worst_mass = fmax(worst_mass, fabs(q.mass[a * n + b] - (a == b)));
            worst_stiffness = fmax(worst_stiffness, fabs(q.stiffness[a * n + b] - lambda) / scale);
        }
    }
    print_message("%s: orthonormal within %.2g, stiffness within %.2g\n", name, worst_mass,
                  worst_stiffness);
    assert_at_most(worst_mass, AGREEMENT);
    assert_at_most(worst_stiffness, AGREEMENT);
    free(memory);
    shcd_modes_free(modes);
}

static void test_modes_hold_in_another_quadrature(void **state) {
    (void)state;
    check_random random = {0x40de6u};
    shcd_model *bent = bodies_create_bent(0.05, 0.03, 0.06, 0.04);
    shcd_model *rough = bodies_create_random(&random, 6, 0.05);
    const shcd_anchor anchor = {{0.0, 0.0, 1.0}, 1.2, 3.0};
    check_modes(bent, NULL, 48, "bent");
    check_modes(rough, NULL, 64, "random");
    check_modes(rough, &anchor, 96, "random, anchored");
    shcd_model_free(rough);
    shcd_model_free(bent);
}

/* ---- finite elements ---- */

#define N_FE 16

/* Levels 4 and 5 give an extrapolated eigenvalue, levels 3 and 4 another one, whose error is larger
 * (4 to 16 times): their difference bounds the error of the first. It may vanish for one eigenvalue
 * by chance, so that the largest relative one serves for all. The modes' own space adds an error
 * that a larger space shows; Rayleigh-Ritz values only fall. */
static void test_modes_of_an_ellipsoid_are_those_of_finite_elements(void **state) {
    const double a = 0.05, b = 0.04, c = 0.03;
    double lambda[3][N_FE], extrapolated[N_FE], spread = 0.0, worst = 0.0;
    (void)state;
    shcd_model *model = ellipsoid_of_degree(12, a, b, c), *more = ellipsoid_of_degree(15, a, b, c);
    shcd_modes *modes = modes_of(model, N_FE, NULL, 0), *better = modes_of(more, N_FE, NULL, 0);
    for (int i = 0; i < 3; i++) {
        membrane_fe *fe = membrane_fe_create(model, 3 + i);
        membrane_fe_eigenvalues(fe, N_FE, lambda[i]);
        membrane_fe_free(fe);
    }
    for (int k = 1; k < N_FE; k++) {
        const double rough = (4.0 * lambda[1][k] - lambda[0][k]) / 3.0;
        extrapolated[k] = (4.0 * lambda[2][k] - lambda[1][k]) / 3.0;
        spread = fmax(spread, fabs(1.0 - rough / extrapolated[k]));
    }
    assert_at_most(spread, 1e-3); /* the finite elements are good enough to tell something */
    for (int k = 1; k < N_FE; k++) {
        const double own = modes->eigenvalue_per_m2[k], space = own - better->eigenvalue_per_m2[k];
        worst = fmax(worst, fabs(own / extrapolated[k] - 1.0));
        assert_at_most(-space, 2.0 * AGREEMENT * own);
        assert_near(own, extrapolated[k], spread * own + fabs(space));
    }
    print_message("largest difference of two extrapolations %.2g\n", spread);
    print_message("ellipsoid: within %.2g of extrapolated finite elements\n", worst);
    shcd_modes_free(modes);
    shcd_modes_free(better);
    shcd_model_free(model);
    shcd_model_free(more);
}

/* ---- anchors ---- */

/* Where alpha is the same everywhere, every eigenvalue rises by it: the radius is so large that
 * 1 - (d/r)^2 is 1. */
static void test_modes_anchor_everywhere_is_a_shift(void **state) {
    const shcd_anchor anchor = {{0.0, 0.0, 0.0}, 1e9, 300.0};
    (void)state;
    shcd_model *model = ellipsoid_of_degree(6, 0.06, 0.05, 0.04);
    shcd_modes *free_modes = modes_of(model, 0, NULL, 0), *held = modes_of(model, 0, &anchor, 1);
    assert_int_equal(free_modes->n_modes, SHCD_COUNT(6));
    assert_true(held->is_anchored == 1 && free_modes->is_anchored == 0);
    for (size_t k = 0; k < held->n_modes; k++) {
        const double expected = free_modes->eigenvalue_per_m2[k] + anchor.alpha_per_m2;
        assert_near(held->eigenvalue_per_m2[k], expected, 2.0 * AGREEMENT * expected);
    }
    shcd_modes_free(held);
    shcd_modes_free(free_modes);
    shcd_model_free(model);
}

/* Courant: more alpha raises every eigenvalue; two anchors act as both do. */
static void test_modes_anchors_raise_every_eigenvalue(void **state) {
    const shcd_anchor anchors[2] = {{{0.0, 0.0, 0.04}, 0.04, 0.0}, {{0.06, 0.0, 0.0}, 0.04, 900.0}};
    (void)state;
    shcd_model *model = ellipsoid_of_degree(10, 0.06, 0.05, 0.04);
    shcd_modes *modes[3];
    for (size_t i = 0; i < 3; i++) {
        modes[i] = modes_of(model, 0, anchors, i);
    }
    assert_int_equal(modes[0]->n_modes, 64);
    for (size_t i = 1; i < 3; i++) {
        assert_true(modes[i]->eigenvalue_per_m2[0] > modes[i - 1]->eigenvalue_per_m2[0] + 1.0);
        for (size_t k = 0; k < 64; k++) {
            assert_true(modes[i]->eigenvalue_per_m2[k] > modes[i - 1]->eigenvalue_per_m2[k]);
        }
    }
    for (size_t i = 0; i < 3; i++) {
        shcd_modes_free(modes[i]);
    }
    shcd_model_free(model);
}

/* ---- the interface ---- */

static void test_modes_are_the_same_bits_every_time(void **state) {
    (void)state;
    check_random random = {0x40de7u};
    shcd_model *model = bodies_create_random(&random, 7, 0.05);
    shcd_modes *a = modes_of(model, 0, NULL, 0), *b = modes_of(model, 0, NULL, 0);
    const size_t count = SHCD_COUNT(7);
    assert_int_equal(a->n_modes, 64);
    assert_memory_equal(a->eigenvalue_per_m2, b->eigenvalue_per_m2, 64 * sizeof(double));
    assert_memory_equal(a->coefficient_per_m, b->coefficient_per_m, 64 * count * sizeof(double));
    for (size_t k = 0; k < 64; k++) {
        double largest = 0.0;
        for (size_t i = 0; i < count; i++) {
            const double v = a->coefficient_per_m[k * count + i];
            largest = fabs(v) > fabs(largest) ? v : largest;
        }
        assert_true(largest > 0.0);
    }
    shcd_modes_free(a);
    shcd_modes_free(b);
    shcd_model_free(model);
}

static void refused(const shcd_model *model, const shcd_modes_options *options,
                    shcd_status expected, const char *text) {
    shcd_modes *const untouched = (shcd_modes *)(uintptr_t)16;
    shcd_modes *modes = untouched;
    shcd_error error = {SHCD_OK, ""};
    const shcd_status status = shcd_fit_modes(model, options, &modes, &error);
    if (status != expected || strstr(error.message, text) == NULL || modes != untouched) {
        fail_msg("status %d, '%s', not '%s'", (int)status, error.message, text);
    }
    assert_int_equal(error.status, expected);
}

static int stop_at_stage(const char *stage, double fraction, void *user) {
    (void)fraction;
    return strcmp(stage, user) == 0;
}

static void test_modes_refusals_have_reasons(void **state) {
    static const char *const stages[] = {"modes: matrices", "modes: eigenvalues", "modes: vectors"};
    shcd_modes_options options = SHCD_MODES_OPTIONS_INIT;
    shcd_anchor anchor = {{0.0, 0.0, 0.0}, 1.0, 0.0};
    (void)state;
    shcd_model *model = ellipsoid_of_degree(3, 0.06, 0.05, 0.04);
    refused(NULL, NULL, SHCD_ERR_ARGUMENT, "null argument");
    assert_int_equal(shcd_fit_modes(model, NULL, NULL, NULL), SHCD_ERR_ARGUMENT);
    options.n_modes = 17;
    refused(model, &options, SHCD_ERR_ARGUMENT, "17 modes, not 1 .. 16");
    options.n_modes = -1;
    refused(model, &options, SHCD_ERR_ARGUMENT, "-1 modes");
    options.n_modes = 0;
    options.n_anchors = 1;
    refused(model, &options, SHCD_ERR_ARGUMENT, "1 anchors, not 0 .. 64, or none given");
    options.anchors = &anchor;
    options.n_anchors = SHCD_ANCHORS_MAX + 1;
    refused(model, &options, SHCD_ERR_ARGUMENT, "65 anchors");
    options.n_anchors = 1;
    anchor.radius_m = 0.0;
    refused(model, &options, SHCD_ERR_ARGUMENT, "anchor 0: radius 0 m");
    anchor.radius_m = 0.01;
    anchor.alpha_per_m2 = -1.0;
    refused(model, &options, SHCD_ERR_ARGUMENT, "alpha -1");
    anchor.alpha_per_m2 = (double)NAN;
    refused(model, &options, SHCD_ERR_NOT_FINITE, "anchor 0 is not finite");
    anchor.alpha_per_m2 = 0.0;
    refused(model, &options, SHCD_ERR_ARGUMENT, "reaches no point of the surface");
    options.n_anchors = 0;
    for (size_t i = 0; i < 3; i++) {
        char stage[32];
        options.progress = stop_at_stage;
        options.progress_user = strcpy(stage, stages[i]);
        refused(model, &options, SHCD_ERR_CANCELLED, "stopped by the caller");
    }
    options.struct_size = 0;
    refused(model, &options, SHCD_ERR_ARGUMENT, "struct_size");
    shcd_modes_free(NULL);
    shcd_model_free(model);
}

/* A disc of a fiftieth of a percent: its rim needs more nodes than the cap allows. */
static void test_modes_that_do_not_settle_are_refused_with_the_agreement(void **state) {
    (void)state;
    shcd_model *model = bodies_create_ellipsoid(1.0, 1.0, 0.0005);
    refused(model, NULL, SHCD_ERR_CONVERGENCE,
            "with 4096 x 8192 nodes eigenvalues still change by");
    shcd_model_free(model);
}

static void test_modes_without_a_tangent_plane_are_refused(void **state) {
    const double point[12] = {1.0, 2.0, 3.0};
    shcd_modes_options settings;
    shcd_anchor anchors[SHCD_ANCHORS_MAX];
    shcd_modes *modes = NULL;
    shcd_error error = {SHCD_OK, ""};
    (void)state;
    assert_int_equal(shcdi_modes_settings(NULL, 1, &settings, anchors, NULL), SHCD_OK);
    assert_int_equal(shcdi_modes_compute(1, point, &settings, &modes, &error), SHCD_ERR_GEOMETRY);
    assert_non_null(strstr(error.message, "tangent plane"));
    assert_null(modes);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_modes_of_a_sphere_are_the_harmonics),
        cmocka_unit_test(test_modes_area_and_volume_of_ellipsoids),
        cmocka_unit_test(test_modes_lowest_is_constant),
        cmocka_unit_test(test_modes_hold_in_another_quadrature),
        cmocka_unit_test(test_modes_of_an_ellipsoid_are_those_of_finite_elements),
        cmocka_unit_test(test_modes_anchor_everywhere_is_a_shift),
        cmocka_unit_test(test_modes_anchors_raise_every_eigenvalue),
        cmocka_unit_test(test_modes_are_the_same_bits_every_time),
        cmocka_unit_test(test_modes_refusals_have_reasons),
        cmocka_unit_test(test_modes_that_do_not_settle_are_refused_with_the_agreement),
        cmocka_unit_test(test_modes_without_a_tangent_plane_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
