/* SPDX-License-Identifier: BSD-3-Clause */
/* Reference surfaces for D = r_ref - r_body. Each is proven to be met once by every ray from the
 * origin C, by a lower bound m > 0 of (x - C) . n over it:
 *
 * Ball about c: m = R - |c - C|.
 *
 * Low degree: map_star.c on the truncated series. To make it enclose the body it is scaled about C
 * by 1 + offset/m: the solid K it bounds is star-shaped about every point of the ball B of radius m
 * about C, since (x - y) . n >= m - |y - C| there. A point of the body is q + offset v with q in K
 * and |v| <= 1 (shcd_model_enclosure_offset()); seen from C, divided by 1 + offset/m, it is a
 * convex combination of q and of m v in B, and the segment between these lies in K.
 *
 * Superquadric about c with gauge g (positively homogeneous, g = 1 on it) and e1, e2 <= 2: convex.
 * If g(C - c) < 1 it contains C + (1 - g) times itself, and it contains the octahedron of its tips:
 * m = (1 - g)/sqrt(1/a^2 + 1/b^2 + 1/c^2).
 */
#include "model/map.h"

#include "model/map_cast.h"

#include <string.h>

#define DEFAULT_DEGREE 3
#define ROOT_STEPS_MAX 200

/* ---- superquadric ---- */

static double gauge(const shcdi_reference *s, shcd_vec3 x) {
    const double ax = fabs(x.x) / s->half[0], ay = fabs(x.y) / s->half[1];
    const double az = fabs(x.z) / s->half[2];
    const double top = shcdi_max(ax, shcdi_max(ay, az));
    if (!(top > 0.0)) {
        return 0.0;
    }
    /* homogeneous: with the largest term 1 no power overflows */
    const double flat = pow(ax / top, 2.0 / s->e2) + pow(ay / top, 2.0 / s->e2);
    return top * pow(pow(flat, s->e2 / s->e1) + pow(az / top, 2.0 / s->e1), 0.5 * s->e1);
}

static double term_slope(double x, double half, double e) {
    const double a = fabs(x) / half;
    const double slope = a > 0.0 ? pow(a, 2.0 / e - 1.0) / half : 0.0;
    return x < 0.0 ? -slope : slope;
}

static shcd_vec3 superquadric_normal(const shcdi_reference *s, shcd_vec3 x) {
    const double flat =
        pow(fabs(x.x) / s->half[0], 2.0 / s->e2) + pow(fabs(x.y) / s->half[1], 2.0 / s->e2);
    const double outer = flat > 0.0 ? pow(flat, s->e2 / s->e1 - 1.0) : 0.0;
    const shcd_vec3 n = {outer * term_slope(x.x, s->half[0], s->e2),
                         outer * term_slope(x.y, s->half[1], s->e2),
                         term_slope(x.z, s->half[2], s->e1)};
    return shcd_unit(n);
}

/* g along the ray is convex, below 1 at C, and grows without bound: one root, between brackets. */
static double superquadric_radius(const shcdi_reference *s, shcd_vec3 d) {
    const shcd_vec3 start = shcd_sub(s->origin, s->centre);
    double low = 0.0, high = s->half[0] + s->half[1] + s->half[2];
    while (gauge(s, shcd_mul_add(start, high, d)) < 1.0) {
        high *= 2.0;
    }
    double f_low = gauge(s, start) - 1.0, f_high = gauge(s, shcd_mul_add(start, high, d)) - 1.0;
    int side = 0;
    for (int i = 0; i < ROOT_STEPS_MAX && high - low > 4e-16 * high; i++) {
        /* regula falsi, an end that stays put twice is halved (Illinois) */
        double r = (low * f_high - high * f_low) / (f_high - f_low);
        r = r > low && r < high ? r : 0.5 * (low + high);
        const double f = gauge(s, shcd_mul_add(start, r, d)) - 1.0;
        if (f == 0.0) {
            return r;
        }
        if (f < 0.0) {
            low = r;
            f_low = f;
            f_high *= side == -1 ? 0.5 : 1.0;
            side = -1;
        } else {
            high = r;
            f_high = f;
            f_low *= side == 1 ? 0.5 : 1.0;
            side = 1;
        }
    }
    return 0.5 * (low + high);
}

static shcd_status superquadric(const shcd_model *model, const shcd_map_options *options,
                                shcdi_reference *r, shcd_error *error) {
    const shcd_model_info *info = &model->info;
    r->e1 = options->superquadric_e1 != 0.0 ? options->superquadric_e1 : 1.0;
    r->e2 = options->superquadric_e2 != 0.0 ? options->superquadric_e2 : 1.0;
    if (!(r->e1 >= 0.1 && r->e1 <= 2.0 && r->e2 >= 0.1 && r->e2 <= 2.0)) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "map_create: superquadric exponents (%g, %g) are not in 0.1 .. 2 (beyond "
                          "2 it is not convex)",
                          r->e1, r->e2);
    }
    const shcd_vec3 side = shcd_sub(info->box_max_m, info->box_min_m);
    r->centre = shcd_scale(0.5, shcd_add(info->box_min_m, info->box_max_m));
    r->half[0] = 0.5 * side.x;
    r->half[1] = 0.5 * side.y;
    r->half[2] = 0.5 * side.z;
    const double at = gauge(r, shcd_sub(r->origin, r->centre)) * (1.0 + 1e-12);
    double tips = 0.0;
    for (int k = 0; k < 3; k++) {
        tips += 1.0 / (r->half[k] * r->half[k]);
    }
    r->margin = (1.0 - at) / sqrt(tips);
    if (!(r->margin > 0.0)) {
        return shcdi_fail(error, SHCD_ERR_GEOMETRY,
                          "map_create: the centre lies outside the superquadric, so rays do not "
                          "cross it exactly once");
    }
    return SHCD_OK;
}

/* ---- ball ---- */

static shcd_status ball(const shcd_model *model, shcdi_reference *r, shcd_error *error) {
    r->centre = model->info.centre_m;
    r->radius = model->info.radius_m;
    r->margin = r->radius * (1.0 - 1e-12) - shcd_norm(shcd_sub(r->centre, r->origin));
    if (!(r->margin > 0.0)) {
        return shcdi_fail(error, SHCD_ERR_GEOMETRY,
                          "map_create: the centre lies outside the enclosing ball, so rays do not "
                          "cross it exactly once");
    }
    return SHCD_OK;
}

/* Root of |o + r d|^2 = R^2, o = C - c; the form without cancellation for either sign of o.d. */
static double ball_radius(const shcdi_reference *s, shcd_vec3 d) {
    const shcd_vec3 o = shcd_sub(s->origin, s->centre);
    const double along = shcd_dot(o, d);
    const double inside = s->radius * s->radius - shcd_dot(o, o);
    const double root = sqrt(along * along + inside);
    return along > 0.0 ? inside / (root + along) : root - along;
}

/* ---- low degree ---- */

static shcd_status low_degree(const shcd_model *model, const shcd_map_options *options,
                              const shcd_allocator *allocator, shcdi_reference *r,
                              shcd_error *error) {
    const int usual = model->degree < DEFAULT_DEGREE ? model->degree : DEFAULT_DEGREE;
    r->degree = options->reference_degree != 0 ? options->reference_degree : usual;
    if (r->degree < 1 || r->degree > model->degree) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "map_create: reference degree %d is not in 1 .. %d", r->degree,
                          model->degree);
    }
    shcd_error why = {SHCD_OK, ""};
    const shcd_status status = shcdi_model_create_plain(
        r->degree, model->coefficients, model->series.simd, allocator, &r->low, &why);
    if (status != SHCD_OK) {
        return shcdi_fail(error, status, "map_create: no surface of degree %d: %.180s", r->degree,
                          why.message);
    }
    r->margin = shcdi_star_margin(r->low, r->origin);
    if (!(r->margin > 0.0)) {
        return shcdi_fail(
            error, SHCD_ERR_GEOMETRY,
            "map_create: not every ray from (%g, %g, %g) provably crosses the surface "
            "of degree %d exactly once; take a lower degree or another centre",
            r->origin.x, r->origin.y, r->origin.z, r->degree);
    }
    if (options->reference_enclosing) {
        r->scale = 1.0 + model->enclosure[r->degree] / r->margin * (1.0 + 1e-9);
        r->margin *= r->scale;
    }
    return SHCD_OK;
}

/* ---- any ---- */

shcd_status shcdi_reference_create(const shcd_model *model, const shcd_map_options *options,
                                   shcd_vec3 origin, const shcd_allocator *allocator,
                                   shcdi_reference *reference, shcd_error *error) {
    reference->kind = options->reference;
    reference->origin = origin;
    reference->scale = 1.0;
    switch (options->reference) {
    case SHCD_MAP_REFERENCE_NONE:
        return SHCD_OK;
    case SHCD_MAP_REFERENCE_BALL:
        return ball(model, reference, error);
    case SHCD_MAP_REFERENCE_LOW_DEGREE:
        return low_degree(model, options, allocator, reference, error);
    case SHCD_MAP_REFERENCE_SUPERQUADRIC:
        return superquadric(model, options, reference, error);
    default:
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, "map_create: unknown reference surface %d",
                          (int)options->reference);
    }
}

void shcdi_reference_free(shcdi_reference *reference) {
    shcd_model_free(reference->low);
    memset(reference, 0, sizeof *reference);
}

int shcdi_reference_at(const shcdi_reference *reference, shcd_vec3 d, double *radius,
                       shcd_vec3 *normal) {
    const shcd_vec3 o = shcd_sub(reference->origin, reference->centre);
    switch (reference->kind) {
    case SHCD_MAP_REFERENCE_BALL:
        *radius = ball_radius(reference, d);
        *normal = shcd_unit(shcd_mul_add(o, *radius, d));
        return 1;
    case SHCD_MAP_REFERENCE_SUPERQUADRIC:
        *radius = superquadric_radius(reference, d);
        *normal = superquadric_normal(reference, shcd_mul_add(o, *radius, d));
        return 1;
    case SHCD_MAP_REFERENCE_LOW_DEGREE: {
        shcdi_hit hits[SHCDI_MAP_CROSSINGS_MAX + 1];
        if (shcdi_cast(reference->low, reference->origin, d, hits) != 1) {
            return 0;
        }
        *radius = reference->scale * hits[0].radius;
        *normal = hits[0].normal;
        return 1;
    }
    default:
        return 0;
    }
}
