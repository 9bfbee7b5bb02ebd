/* SPDX-License-Identifier: BSD-3-Clause */
/* Closed paths of a tool over a body: in at one place, about, and out again there. A path is a
 * direction w(s) and a depth(s), s = 0 .. 1; the tool's centre is S(w) + n (r - depth). */
#ifndef SHCD_TESTS_PATHS_H
#define SHCD_TESTS_PATHS_H

#include "support/bodies.h"
#include "support/check.h"

#include "shcd/model.h"
#include "shcd/vec.h"

#define PATHS_TERMS 4

typedef enum path_kind { PATH_PRESS, PATH_SLIDE, PATH_CIRCLE, PATH_RANDOM, PATH_KINDS } path_kind;

typedef struct path {
    const shcd_model *model;
    double radius_m;
    path_kind kind;
    shcd_vec3 w, e[2]; /* direction and two tangents */
    double depth_m;
    double angle_rad;               /* half width of the region */
    double wave[3][2][PATHS_TERMS]; /* two angles and depth: cosine and sine, frequency 1 .. */
} path;

static inline path path_make(const shcd_model *model, path_kind kind, shcd_vec3 w, double radius_m,
                             double depth_m, double angle_rad, check_random *random) {
    path p = {model, radius_m, kind, shcd_unit(w), {{0.0, 0.0, 0.0}}, depth_m, angle_rad, {{{0}}}};
    const double turn = check_uniform(random, 0.0, 2.0 * BODIES_PI);
    const shcd_vec3 off =
        fabs(p.w.x) < 0.7 ? shcd_vec3_make(1.0, 0.0, 0.0) : shcd_vec3_make(0.0, 1.0, 0.0);
    const shcd_vec3 a = shcd_unit(shcd_cross(p.w, off)), b = shcd_cross(p.w, a);
    p.e[0] = shcd_mul_add(shcd_scale(cos(turn), a), sin(turn), b);
    p.e[1] = shcd_cross(p.w, p.e[0]);
    for (int c = 0; c < 3; c++) {
        for (int k = 0; k < PATHS_TERMS; k++) {
            p.wave[c][0][k] = check_uniform(random, -1.0, 1.0) / (k + 1);
            p.wave[c][1][k] = check_uniform(random, -1.0, 1.0) / (k + 1);
        }
    }
    return p;
}

static inline double path_wave(const path *p, int c, double s) {
    double sum = 0.0;
    for (int k = 0; k < PATHS_TERMS; k++) {
        const double t = 2.0 * BODIES_PI * (k + 1) * s;
        sum += p->wave[c][0][k] * (cos(t) - 1.0) + p->wave[c][1][k] * sin(t);
    }
    return sum;
}

/* 0 at the ends, 1 between: in during the first fifth, out during the last. */
static inline double path_gate(double s) {
    const double t = fmin(fmin(s, 1.0 - s) / 0.2, 1.0);
    return 0.5 - 0.5 * cos(BODIES_PI * t);
}

/** The tool's centre at s; the path begins and ends 1 mm outside. */
static inline shcd_vec3 path_at(const path *p, double s) {
    const double gate = path_gate(s);
    const double round = 2.0 * BODIES_PI * s;
    double u = 0.0, v = 0.0, depth = p->depth_m;
    shcd_vec3 point, normal;
    switch (p->kind) {
    case PATH_SLIDE:
        u = sin(round);
        break;
    case PATH_CIRCLE:
        u = cos(round) - 1.0;
        v = sin(round);
        break;
    case PATH_RANDOM:
        u = path_wave(p, 0, s);
        v = path_wave(p, 1, s);
        depth *= 0.5 + path_wave(p, 2, s); /* leaves now and then */
        break;
    case PATH_PRESS:
    default:
        break;
    }
    const shcd_vec3 w = shcd_add(p->w, shcd_add(shcd_scale(p->angle_rad * u, p->e[0]),
                                                shcd_scale(p->angle_rad * v, p->e[1])));
    if (shcd_model_surface(p->model, -1, w, &point, &normal, NULL) != SHCD_OK) {
        fail_msg("no surface at the parameter");
    }
    return shcd_mul_add(point, p->radius_m - (gate * (depth + 1e-3) - 1e-3), normal);
}

/* ---- bodies -----------------------------------------------------------------------------------
 */

/** Bent, with half axes 5, 4 and 6 cm: hollow at +x with a radius of 12 cm, convex at -x. */
static inline shcd_model *paths_bent(void) {
    return bodies_create_bent(0.05, 0.04, 0.06, 0.04);
}

/** Random, degree 8, about 6 cm in radius, with hills and hollows. */
static inline shcd_model *paths_random(uint64_t seed) {
    double c[3 * SHCD_COUNT(8)];
    check_random r = {seed};
    bodies_random_coefficients(&r, 8, 0.08, c);
    for (size_t i = 0; i < 3 * SHCD_COUNT(8); i++) {
        c[i] *= i < 3 ? 0.0 : 0.06;
    }
    return bodies_create(8, c);
}

#endif
