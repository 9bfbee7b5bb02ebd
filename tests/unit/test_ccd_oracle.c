/* SPDX-License-Identifier: BSD-3-Clause */
/* libccd as an independent oracle: whether a sphere touches an ellipsoid (a body of degree 1), by
 * GJK on support functions, against the sign of distance - radius. GJK decides intersection exactly
 * up to its tolerance, so only pairs whose gap is above 1e-6 of the size are compared; both
 * outcomes must occur. */
#include "shcd/shcd.h"
#include "support/check.h"

#include <ccd/ccd.h>

#define GAP 1e-6

typedef struct ellipsoid {
    double a[3];
} ellipsoid;

typedef struct ball {
    double centre[3], radius;
} ball;

/* farthest point of the ellipsoid in a direction: a_k^2 d_k / |A d| */
static void support_ellipsoid(const void *object, const ccd_vec3_t *d, ccd_vec3_t *out) {
    const ellipsoid *e = object;
    double s[3], n = 0.0;
    for (int k = 0; k < 3; k++) {
        s[k] = e->a[k] * e->a[k] * (double)d->v[k];
        n += s[k] * (double)d->v[k];
    }
    n = sqrt(n);
    ccdVec3Set(out, s[0] / n, s[1] / n, s[2] / n);
}

static void support_ball(const void *object, const ccd_vec3_t *d, ccd_vec3_t *out) {
    const ball *b = object;
    const double n = sqrt((double)ccdVec3Len2(d));
    ccdVec3Set(out, b->centre[0] + b->radius * (double)d->v[0] / n,
               b->centre[1] + b->radius * (double)d->v[1] / n,
               b->centre[2] + b->radius * (double)d->v[2] / n);
}

static shcd_model *make_ellipsoid(const double a[3]) {
    const double k =
        2.0466534158929770; /* sqrt(4 pi / 3): Y_1m = sqrt(3/(4 pi)) times a coordinate */
    double c[12] = {0.0};
    c[3 * SHCD_INDEX(1, 1) + 0] = k * a[0];
    c[3 * SHCD_INDEX(1, -1) + 1] = k * a[1];
    c[3 * SHCD_INDEX(1, 0) + 2] = k * a[2];
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    def.degree = 1;
    def.coefficients = c;
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    if (shcd_model_create(&def, NULL, &model, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    return model;
}

static void test_closest_agrees_with_gjk_on_sphere_and_ellipsoid(void **state) {
    (void)state;
    check_random random = {4711};
    ccd_t ccd;
    CCD_INIT(&ccd);
    ccd.support1 = support_ellipsoid;
    ccd.support2 = support_ball;
    ccd.max_iterations = 1000;
    size_t touching = 0, apart = 0;
    for (int shape = 0; shape < 10; shape++) {
        ellipsoid e;
        for (int k = 0; k < 3; k++) {
            e.a[k] = check_uniform(&random, 0.2, 1.0);
        }
        shcd_model *model = make_ellipsoid(e.a);
        for (size_t i = 0; i < check_scaled(500); i++) {
            ball b = {{0.0, 0.0, 0.0}, check_uniform(&random, 0.01, 0.5)};
            for (int k = 0; k < 3; k++) {
                b.centre[k] = check_uniform(&random, -1.5, 1.5);
            }
            shcd_proximity near;
            const shcd_vec3 p = {b.centre[0], b.centre[1], b.centre[2]};
            assert_int_equal(shcd_closest(model, p, NULL, &near), SHCD_OK);
            const double gap = near.distance_m - b.radius;
            if (fabs(gap) > GAP) {
                assert_int_equal(ccdGJKIntersect(&e, &b, &ccd), gap < 0.0);
                touching += gap < 0.0;
                apart += gap > 0.0;
            }
        }
        shcd_model_free(model);
    }
    print_message("libccd agrees on %zu touching and %zu separate pairs (seed 4711)\n", touching,
                  apart);
    assert_true(touching > 0 && apart > 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_closest_agrees_with_gjk_on_sphere_and_ellipsoid),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
