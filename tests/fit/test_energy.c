/* SPDX-License-Identifier: BSD-3-Clause */
/* The energy of a map, its gradient, and the preconditioner: against differences and closed forms.
 */
#include "fit_support.h"

#include "energy.h"
#include "laplacian.h"

static const double unit_axes[3] = {1.0, 1.0, 1.0};

typedef struct fixture {
    soup shape;
    shcd_vec3 *positions;
    shcdi_energy energy;
} fixture;

static fixture fixture_make(size_t n_rings, const double *half_axes) {
    fixture f = {.shape = soup_ellipsoid(n_rings, half_axes)};
    f.positions = malloc(f.shape.n_vertices * sizeof *f.positions);
    assert_non_null(f.positions);
    for (size_t i = 0; i < f.shape.n_vertices; ++i) {
        const double *v = f.shape.vertices + 3 * i;
        f.positions[i] = shcd_vec3_make(v[0], v[1], v[2]);
    }
    assert_int_equal(shcdi_energy_init(&f.energy, f.positions, f.shape.n_vertices,
                                       f.shape.triangles, f.shape.n_triangles),
                     SHCD_OK);
    return f;
}

static void fixture_free(fixture *f) {
    shcdi_energy_release(&f->energy);
    free(f->positions);
    soup_free(&f->shape);
}

static shcd_vec3 *random_map(const fixture *f, double spread, uint64_t seed) {
    check_random random = {seed};
    shcd_vec3 *u = malloc(f->shape.n_vertices * sizeof *u);
    assert_non_null(u);
    for (size_t i = 0; i < f->shape.n_vertices; ++i) {
        const shcd_vec3 noise =
            shcd_vec3_make(check_normal(&random), check_normal(&random), check_normal(&random));
        u[i] = shcd_unit(shcd_mul_add(shcd_unit(f->positions[i]), spread, noise));
    }
    return u;
}

/* Central differences along random directions, step h: truncation grows with h^2, rounding with
 * eps/h. Extrapolated from h and h/2 the truncation is h^4, and 1e-7 of the gradient's size is far
 * above both at h = 1e-4 while any wrong term is of the gradient's own size. */
static void check_gradient(const fixture *f, shcd_vec3 *u, double eps, uint64_t seed) {
    check_random random = {seed};
    const size_t n = f->shape.n_vertices;
    shcd_vec3 *gradient = malloc(n * sizeof *gradient);
    assert_non_null(gradient);
    (void)shcdi_energy_value(&f->energy, u, eps, gradient);
    for (int k = 0; k < 60; ++k) {
        const size_t i = (size_t)check_uniform(&random, 0.0, (double)n);
        const shcd_vec3 way = shcd_unit(
            shcd_vec3_make(check_normal(&random), check_normal(&random), check_normal(&random)));
        const shcd_vec3 kept = u[i];
        double slope[2];
        for (int pass = 0; pass < 2; ++pass) {
            const double h = pass == 0 ? 1e-4 : 0.5e-4;
            u[i] = shcd_mul_add(kept, h, way);
            const double above = shcdi_energy_value(&f->energy, u, eps, NULL);
            u[i] = shcd_mul_add(kept, -h, way);
            const double below = shcdi_energy_value(&f->energy, u, eps, NULL);
            slope[pass] = (above - below) / (2.0 * h);
        }
        u[i] = kept;
        assert_near(shcd_dot(gradient[i], way), (4.0 * slope[1] - slope[0]) / 3.0,
                    1e-7 * (1.0 + shcd_norm(gradient[i])));
    }
    free(gradient);
}

static void test_energy_gradient_unfolded_matches_differences(void **state) {
    (void)state;
    const double axes[3] = {1.0, 0.7, 0.5};
    fixture f = fixture_make(6, axes);
    shcd_vec3 *u = random_map(&f, 0.02, 1);
    f.energy.area_weight = 5.0;
    check_gradient(&f, u, 0.0, 2);
    free(u);
    fixture_free(&f);
}

static void test_energy_gradient_folded_matches_differences(void **state) {
    (void)state;
    const double axes[3] = {1.0, 0.7, 0.5};
    fixture f = fixture_make(6, axes);
    shcd_vec3 *u = random_map(&f, 0.4, 3);
    double ratio;
    assert_true(shcdi_energy_count_folds(&f.energy, u, &ratio) > 10);
    check_gradient(&f, u, 0.5, 4);
    free(u);
    fixture_free(&f);
}

/* A sphere's mesh on itself: q is the ratio of areas, hence 1 up to the flatness of the triangles,
 * and D/A, (q + 1/q)/2 are 1: E = 1 + lambda, off by the square of the edge length. */
static void test_energy_identity_of_sphere_is_one_plus_lambda(void **state) {
    (void)state;
    fixture f = fixture_make(40, unit_axes);
    shcd_vec3 *u = random_map(&f, 0.0, 0);
    const double edge = 3.14159265358979324 / 41.0;
    f.energy.area_weight = 3.0;
    assert_near(shcdi_energy_value(&f.energy, u, 0.0, NULL), 4.0, 4.0 * edge * edge);
    free(u);
    fixture_free(&f);
}

static void test_energy_fold_without_regularisation_is_infinite(void **state) {
    (void)state;
    fixture f = fixture_make(6, unit_axes);
    shcd_vec3 *u = random_map(&f, 0.4, 3);
    assert_true(isinf(shcdi_energy_value(&f.energy, u, 0.0, NULL)));
    assert_true(isfinite(shcdi_energy_value(&f.energy, u, 1e-8, NULL)));
    free(u);
    fixture_free(&f);
}

static void test_energy_coverage_counts_sheets_with_sign(void **state) {
    (void)state;
    fixture f = fixture_make(12, unit_axes);
    shcd_vec3 *u = random_map(&f, 0.0, 0);
    assert_near(shcdi_energy_coverage(&f.energy, u), 1.0, 1e-12);
    for (size_t i = 0; i < f.shape.n_vertices; ++i) { /* twice around the poles: two sheets */
        const double r = sqrt(u[i].x * u[i].x + u[i].y * u[i].y);
        const double phi = 2.0 * atan2(u[i].y, u[i].x);
        u[i] = shcd_unit(shcd_vec3_make(r * cos(phi), r * sin(phi), u[i].z));
    }
    double ratio;
    assert_near(shcdi_energy_coverage(&f.energy, u), 2.0, 1e-12);
    assert_int_equal(shcdi_energy_count_folds(&f.energy, u, &ratio), 0);
    for (size_t i = 0; i < f.shape.n_vertices; ++i) {
        u[i] = shcd_scale(-1.0, u[i]);
    }
    assert_near(shcdi_energy_coverage(&f.energy, u), -2.0, 1e-12);
    free(u);
    fixture_free(&f);
}

/* x' L x for the factorised matrix, from the definition. */
static void apply(const fixture *f, const double *weights, const double *mass, const shcd_vec3 *x,
                  shcd_vec3 *y) {
    for (size_t i = 0; i < f->shape.n_vertices; ++i) {
        y[i] = shcd_scale(mass[i], x[i]);
    }
    for (size_t corner = 0; corner < 3 * f->shape.n_triangles; ++corner) {
        const uint32_t *t = f->shape.triangles + 3 * (corner / 3);
        const uint32_t i = t[(corner + 1) % 3], j = t[(corner + 2) % 3];
        const shcd_vec3 pull = shcd_scale(weights[corner], shcd_sub(x[i], x[j]));
        y[i] = shcd_add(y[i], pull);
        y[j] = shcd_sub(y[j], pull);
    }
}

static void test_laplacian_solve_inverts_the_definition(void **state) {
    (void)state;
    const double axes[3] = {1.0, 0.7, 0.5};
    fixture f = fixture_make(12, axes);
    const size_t n = f.shape.n_vertices;
    shcd_vec3 *x = random_map(&f, 1.0, 5), *y = random_map(&f, 1.0, 6), *z = random_map(&f, 1.0, 7);
    double *weights = malloc(3 * f.shape.n_triangles * sizeof *weights);
    shcdi_laplacian *laplacian = NULL;
    assert_non_null(weights);
    assert_int_equal(shcdi_laplacian_create(n, f.shape.triangles, f.shape.n_triangles, &laplacian),
                     SHCD_OK);
    for (int pass = 0; pass < 2; ++pass) { /* other weights, same pattern */
        if (pass == 0) {
            shcdi_energy_cotangent_weights(&f.energy, weights);
        } else {
            for (size_t k = 0; k < 3 * f.shape.n_triangles; ++k) {
                weights[k] = 1.0 + 0.5 * sin((double)k);
            }
        }
        assert_int_equal(shcdi_laplacian_factorise(laplacian, weights, f.energy.vertex_area),
                         SHCD_OK);
        apply(&f, weights, f.energy.vertex_area, x, y);
        assert_int_equal(shcdi_laplacian_solve(laplacian, y, z), SHCD_OK);
        for (size_t i = 0; i < n; ++i) {
            /* condition: largest weight sum ~ 10 over smallest mass ~ 1e-4, times 2e-16 */
            assert_near(shcd_norm(shcd_sub(z[i], x[i])), 0.0, 1e-10);
        }
    }
    shcdi_laplacian_free(laplacian);
    free(weights);
    free(x);
    free(y);
    free(z);
    fixture_free(&f);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_energy_gradient_unfolded_matches_differences),
        cmocka_unit_test(test_energy_gradient_folded_matches_differences),
        cmocka_unit_test(test_energy_identity_of_sphere_is_one_plus_lambda),
        cmocka_unit_test(test_energy_fold_without_regularisation_is_infinite),
        cmocka_unit_test(test_energy_coverage_counts_sheets_with_sign),
        cmocka_unit_test(test_laplacian_solve_inverts_the_definition),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
