/* SPDX-License-Identifier: BSD-3-Clause */
/* Samples of what bounds of derivatives along great circles claim to contain. They may never exceed
 * a bound, but for what the sampling itself rounds (1e-12 of the bound: sums of some hundred
 * products) or truncates. */
#ifndef SHCD_TESTS_DERIVATIVES_H
#define SHCD_TESTS_DERIVATIVES_H

#include "model/bounds.h"
#include "model/model.h"
#include "support/bodies.h"
#include "support/check.h"

#define DERIVATIVES_ROUNDING 1e-12
/** The suprema, then the infimum of |S'|. */
#define DERIVATIVES_SAMPLES (SHCDI_SUPREMA + 1)
#define DERIVATIVES_PRODUCT 3
#define DERIVATIVES_LEAST SHCDI_SUPREMA

/* A direction within an angle of a centre; uniform in the angle, so that the middle and the border
 * are both seen. */
static inline shcd_vec3 derivatives_near(check_random *random, shcd_vec3 centre, double angle) {
    const shcd_vec3 v = shcd_unit(shcd_cross(centre, bodies_random_direction(random)));
    const double t = check_uniform(random, 0.0, angle);
    return shcd_unit(shcd_mul_add(shcd_scale(cos(t), centre), sin(t), v));
}

/* k-th derivatives, k = 1, 2, of S along the great circle through w with unit tangent v. */
static inline void derivatives_along(const shcd_model *model, shcd_vec3 w, shcd_vec3 v,
                                     shcd_vec3 out[2]) {
    shcdi_jet j;
    shcdi_surface_jet(&model->series, model->degree, w, &j);
    const double a = shcd_dot(v, j.t1), b = shcd_dot(v, j.t2);
    out[0] = shcd_mul_add(shcd_scale(a, j.s1), b, j.s2);
    out[1] = shcd_mul_add(shcd_scale(a * a, j.s11), 2.0 * a * b, j.s12);
    out[1] = shcd_mul_add(out[1], b * b, j.s22);
}

/* |S'|, |S''|, |S'''|, |S'.S''| along a random great circle through w, and the least |S'| of all of
 * them there; the third order by central differences of the second, *error its truncation
 * h^2/6 |S^(5)| <= h^2/6 L^2 M3 and rounding over h. */
static inline void derivatives_magnitudes(const shcd_model *model, check_random *random,
                                          shcd_vec3 w, double out[DERIVATIVES_SAMPLES],
                                          double *error) {
    const shcd_vec3 v = shcd_unit(shcd_cross(w, bodies_random_direction(random)));
    const double h = 1e-4, degree = model->degree;
    shcd_vec3 here[2], ahead[2], behind[2];
    shcdi_jet j;
    derivatives_along(model, w, v, here);
    derivatives_along(model, shcd_unit(shcd_mul_add(shcd_scale(cos(h), w), sin(h), v)),
                      shcd_unit(shcd_mul_add(shcd_scale(cos(h), v), -sin(h), w)), ahead);
    derivatives_along(model, shcd_unit(shcd_mul_add(shcd_scale(cos(h), w), -sin(h), v)),
                      shcd_unit(shcd_mul_add(shcd_scale(cos(h), v), sin(h), w)), behind);
    out[0] = shcd_norm(here[0]);
    out[1] = shcd_norm(here[1]);
    out[2] = shcd_norm(shcd_sub(ahead[1], behind[1])) / (2.0 * h);
    out[DERIVATIVES_PRODUCT] = fabs(shcd_dot(here[0], here[1]));
    shcdi_surface_jet(&model->series, model->degree, w, &j);
    /* |S'| = |cos t S_1 + sin t S_2|: the least is area over the largest, and no more than |S'| */
    const double mean = 0.5 * (shcd_dot(j.s1, j.s1) + shcd_dot(j.s2, j.s2));
    const double half = 0.5 * (shcd_dot(j.s1, j.s1) - shcd_dot(j.s2, j.s2));
    const double mixed = shcd_dot(j.s1, j.s2);
    out[DERIVATIVES_LEAST] =
        shcd_norm(shcd_cross(j.s1, j.s2)) / sqrt(mean + sqrt(half * half + mixed * mixed));
    assert_true(out[DERIVATIVES_LEAST] <= out[0] * (1.0 + DERIVATIVES_ROUNDING));
    *error = h * h / 6.0 * degree * degree * model->m[2] + DERIVATIVES_ROUNDING * model->m[1] / h;
}

static inline void derivatives_assert_contained(const double value[DERIVATIVES_SAMPLES],
                                                const double bound[SHCDI_SUPREMA], double least,
                                                double third_error,
                                                const double whole[SHCDI_SUPREMA]) {
    assert_true(value[0] <= bound[0] * (1.0 + DERIVATIVES_ROUNDING));
    assert_true(value[1] <= bound[1] * (1.0 + DERIVATIVES_ROUNDING));
    assert_true(value[2] <= bound[2] * (1.0 + DERIVATIVES_ROUNDING) + third_error);
    /* a sum that may cancel: it rounds like its terms */
    assert_true(value[DERIVATIVES_PRODUCT] <=
                bound[DERIVATIVES_PRODUCT] + DERIVATIVES_ROUNDING * whole[0] * whole[1]);
    assert_true(least >= 0.0);
    assert_true(value[DERIVATIVES_LEAST] >= least - DERIVATIVES_ROUNDING * whole[0]);
}

#endif
