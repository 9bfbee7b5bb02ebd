/* SPDX-License-Identifier: BSD-3-Clause */
/* The finite-element oracle against closed forms on a sphere of radius R: eigenvalues l(l+1)/R^2,
 * and the static deflection under the heat kernel's patch
 *   g(w) = sum_l b_l (2l+1)/(4 pi R^2) P_l(w0 . w),  b_l = exp(-sigma^2 l(l+1)/(2 R^2)),
 *   int g d dA = sum_l b_l^2 (2l+1)/(4 pi R^2) / (tension l(l+1)/R^2 + kappa).
 * Linear elements err by c h^2 + O(h^4): from levels n-1 and n, (4 x_n - x_n-1)/3 removes the first
 * term, and what is left is of the order of its square; a tenth of the difference of the two is
 * allowed, where a wrong matrix would miss by several of it. */
#include "support/bodies.h"
#include "support/membrane_fe.h"

#define RADIUS_M 0.05
#define N_EIGENVALUES 9

static double sphere_eigenvalue(int l) {
    return (double)l * (l + 1) / (RADIUS_M * RADIUS_M);
}

static void assert_extrapolates(const char *what, double coarse, double fine, double exact) {
    const double difference = fabs(fine - coarse), extrapolated = (4.0 * fine - coarse) / 3.0;
    print_message("%s: %.9g, %.9g, extrapolated %.9g, exact %.9g (%.2g)\n", what, coarse, fine,
                  extrapolated, exact, fabs(extrapolated / exact - 1.0));
    assert_near(extrapolated, exact, 0.1 * difference);
    assert_at_most(difference, 0.02 * exact); /* else a tenth of it would say little */
}

static void test_fe_eigenvalues_of_a_sphere(void **state) {
    (void)state;
    shcd_model *model = bodies_create_ellipsoid(RADIUS_M, RADIUS_M, RADIUS_M);
    double lambda[2][N_EIGENVALUES];
    for (int i = 0; i < 2; i++) {
        membrane_fe *fe = membrane_fe_create(model, 3 + i);
        membrane_fe_eigenvalues(fe, N_EIGENVALUES, lambda[i]);
        membrane_fe_free(fe);
    }
    assert_near(lambda[1][0], 0.0, 1e-8 / (RADIUS_M * RADIUS_M));
    for (int k = 1; k < N_EIGENVALUES; k++) {
        assert_extrapolates("eigenvalue", lambda[0][k], lambda[1][k],
                            sphere_eigenvalue(k < 4 ? 1 : 2));
    }
    shcd_model_free(model);
}

/* b_l P_l sums until b_l is nothing: sigma l / R = 8. */
static double heat_kernel(double cosine, double sigma_m, int power_of_b, double tension,
                          double kappa) {
    const int last = (int)(8.0 * RADIUS_M / sigma_m);
    double sum = 0.0, before = 0.0, p = 1.0;
    for (int l = 0; l <= last; l++) {
        const double b = exp(-0.5 * sigma_m * sigma_m * sphere_eigenvalue(l));
        const double share = (2.0 * l + 1.0) / (4.0 * BODIES_PI * RADIUS_M * RADIUS_M);
        sum += (power_of_b == 2 ? b * b : b) * share * p / (tension * sphere_eigenvalue(l) + kappa);
        const double next = ((2.0 * l + 1.0) * cosine * p - l * before) / (l + 1.0);
        before = p;
        p = next;
    }
    return sum;
}

/* A liver-like membrane, the two smallest patches of use. */
static void test_fe_compliance_of_a_sphere(void **state) {
    static const double sigmas[2] = {0.0025, 0.004};
    const double tension = 20.0, kappa = tension / (0.02 * 0.02);
    (void)state;
    shcd_model *model = bodies_create_ellipsoid(RADIUS_M, RADIUS_M, RADIUS_M);
    const shcd_vec3 w0 = shcd_unit(shcd_vec3_make(0.3, -0.5, 0.8));
    for (int s = 0; s < 2; s++) {
        double compliance[2], at_rim = 0.0;
        for (int i = 0; i < 2; i++) {
            membrane_fe *fe = membrane_fe_create(model, 5 + i);
            const size_t n = membrane_fe_count(fe);
            const shcd_vec3 *w = membrane_fe_directions(fe);
            double *patch = calloc(2 * n, sizeof *patch);
            assert_non_null(patch);
            for (size_t v = 0; v < n; v++) {
                patch[v] = heat_kernel(shcd_dot(w[v], w0), sigmas[s], 1, 0.0, 1.0);
            }
            /* the patch has integral 1: mesh and patch together err by h^2 */
            assert_near(membrane_fe_integral(fe, patch, NULL), 1.0, 1e-3);
            compliance[i] = membrane_fe_compliance(fe, tension, kappa, patch, patch + n);
            at_rim = 0.0;
            for (size_t v = 0; v < n; v++) {
                const double d = heat_kernel(shcd_dot(w[v], w0), sigmas[s], 1, tension, kappa);
                at_rim = fmax(at_rim, fabs(patch[n + v] - d));
            }
            free(patch);
            membrane_fe_free(fe);
        }
        assert_extrapolates("compliance [m/N]", compliance[0], compliance[1],
                            heat_kernel(1.0, sigmas[s], 2, tension, kappa));
        assert_at_most(at_rim, 0.01 * compliance[1]); /* the deflection itself, level 6 */
    }
    shcd_model_free(model);
}

/* The area of a mesh approaches that of its sphere from below, by h^2. */
static void test_fe_integral_of_one_is_the_area(void **state) {
    (void)state;
    shcd_model *model = bodies_create_ellipsoid(RADIUS_M, RADIUS_M, RADIUS_M);
    double area[2];
    for (int i = 0; i < 2; i++) {
        membrane_fe *fe = membrane_fe_create(model, 3 + i);
        area[i] = membrane_fe_integral(fe, NULL, NULL);
        membrane_fe_free(fe);
    }
    assert_extrapolates("area", area[0], area[1], 4.0 * BODIES_PI * RADIUS_M * RADIUS_M);
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fe_eigenvalues_of_a_sphere),
        cmocka_unit_test(test_fe_compliance_of_a_sphere),
        cmocka_unit_test(test_fe_integral_of_one_is_the_area),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
