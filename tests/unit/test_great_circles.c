/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives along great circles from the columns of a ring, against the surface's own first and
 * second derivatives, which come from other recurrences, and against differences of the latter. */
#include "model/great_circles.h"
#include "support/bodies.h"
#include "support/check.h"
#include "support/derivatives.h"

#define N_PHI 40 /* three blocks to a quarter: the last one reaches beyond it */

typedef struct fixture {
    shcd_model *model;
    double *memory;
    shcdi_great_circles circles;
    double size[3]; /* what the orders are measured by */
} fixture;

static void fixture_open(fixture *f, int degree, uint64_t seed) {
    check_random random = {seed};
    f->model = bodies_create_random(&random, degree, 0.1);
    f->memory = calloc(shcdi_great_circles_size(degree, N_PHI), sizeof *f->memory);
    assert_non_null(f->memory);
    shcdi_great_circles_init(&f->circles, degree, f->model->coefficients, N_PHI, f->memory);
    memcpy(f->size, f->model->m, sizeof f->size);
}

static void fixture_close(fixture *f) {
    free(f->memory);
    shcd_model_free(f->model);
}

static shcd_vec3 column(shcdi_circle_values v, int c, size_t lane) {
    return shcd_vec3_make(v[c][lane], v[c + 1][lane], v[c + 2][lane]);
}

/* The three orders at angle alpha from the columns, as the header states. */
static void from_columns(shcdi_circle_values v, size_t lane, double alpha, shcd_vec3 out[3]) {
    const double c1 = cos(alpha), s1 = sin(alpha);
    const shcd_vec3 zero = {0.0, 0.0, 0.0};
    out[0] = shcd_mul_add(zero, c1, column(v, SHCDI_CIRCLE_U, lane));
    out[0] = shcd_mul_add(out[0], s1, column(v, SHCDI_CIRCLE_V, lane));
    out[1] = shcd_mul_add(column(v, SHCDI_CIRCLE_Z, lane), cos(2.0 * alpha),
                          column(v, SHCDI_CIRCLE_X, lane));
    out[1] = shcd_mul_add(out[1], sin(2.0 * alpha), column(v, SHCDI_CIRCLE_Y, lane));
    out[2] = shcd_mul_add(zero, c1, column(v, SHCDI_CIRCLE_P, lane));
    out[2] = shcd_mul_add(out[2], s1, column(v, SHCDI_CIRCLE_Q, lane));
    out[2] = shcd_mul_add(out[2], cos(3.0 * alpha), column(v, SHCDI_CIRCLE_C, lane));
    out[2] = shcd_mul_add(out[2], sin(3.0 * alpha), column(v, SHCDI_CIRCLE_D, lane));
}

static void assert_node(const fixture *f, double theta, double phi, double alpha,
                        const shcd_vec3 got[3]) {
    const int degree = f->model->degree;
    const double step = 1e-2 / degree, c = cos(theta), s = sin(theta);
    const shcd_vec3 w = {s * cos(phi), s * sin(phi), c};
    const shcd_vec3 e_theta = {c * cos(phi), c * sin(phi), -s}, e_phi = {-sin(phi), cos(phi), 0.0};
    const shcd_vec3 v = shcd_mul_add(shcd_scale(cos(alpha), e_theta), sin(alpha), e_phi);
    shcd_vec3 here[2], ahead[2], third = {0.0, 0.0, 0.0};
    static const double weight[3] = {45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0};
    derivatives_along(f->model, w, v, here);
    for (int n = -3; n <= 3; n++) {
        const double t = n * step;
        if (n != 0) {
            derivatives_along(f->model, shcd_unit(shcd_mul_add(shcd_scale(cos(t), w), sin(t), v)),
                              shcd_unit(shcd_mul_add(shcd_scale(cos(t), v), -sin(t), w)), ahead);
            third = shcd_mul_add(third, (n < 0 ? -weight[-n - 1] : weight[n - 1]) / step, ahead[1]);
        }
    }
    /* two evaluations: sums of some hundred products, recurrences of some hundred steps, which the
     * rounding of cos(theta) enters times the square of the degree */
    const double rounding = 1e-14 + 2e-16 * degree * degree;
    assert_near(shcd_norm(shcd_sub(got[0], here[0])), 0.0, rounding * f->size[0]);
    assert_near(shcd_norm(shcd_sub(got[1], here[1])), 0.0, rounding * f->size[1]);
    /* h^6/140 |f^(7)| of f = S'', |f^(7)| <= L^6 M_3 (Bernstein); rounding over h */
    const double third_error = 1e-12 / 140.0 * f->size[2] + 2.0 * rounding * f->size[1] / step;
    assert_near(shcd_norm(shcd_sub(got[2], third)), 0.0, third_error);
}

static void test_great_circles_agree_with_jets_and_their_differences(void **state) {
    static const int degree[] = {1, 2, 3, 4, 15, 30};
    check_random random = {71};
    (void)state;
    for (size_t d = 0; d < sizeof degree / sizeof degree[0]; d++) {
        fixture f;
        fixture_open(&f, degree[d], 700 + d);
        for (int n = 0; n < 12; n++) {
            /* rings hard by the poles, one on the equator, others */
            const double theta = n == 0   ? 1e-3
                                 : n == 1 ? BODIES_PI - 1e-3
                                 : n == 2 ? 0.5 * BODIES_PI
                                          : check_uniform(&random, 0.01, 3.13);
            shcdi_great_circles_ring(&f.circles, theta);
            for (size_t k = 0; k <= N_PHI / 4; k++) {
                shcdi_circle_values image[SHCDI_CIRCLE_IMAGES];
                shcdi_great_circles_block(&f.circles, k / SHCDI_CIRCLE_LANES, image);
                const double phi = 2.0 * BODIES_PI * (double)k / N_PHI;
                const double at[SHCDI_CIRCLE_IMAGES] = {phi, BODIES_PI - phi, BODIES_PI + phi,
                                                        2.0 * BODIES_PI - phi};
                for (int i = 0; i < SHCDI_CIRCLE_IMAGES; i++) {
                    const double alpha = check_uniform(&random, 0.0, 2.0 * BODIES_PI);
                    shcd_vec3 got[3];
                    from_columns(image[i], k % SHCDI_CIRCLE_LANES, alpha, got);
                    assert_node(&f, theta, at[i], alpha, got);
                }
            }
        }
        fixture_close(&f);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_great_circles_agree_with_jets_and_their_differences)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
