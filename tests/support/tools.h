/* SPDX-License-Identifier: BSD-3-Clause */
/* Tools for tests, and the signed distance from a point to each by other means than the library's:
 * a hull's facets are all triples of points with every other point on one side. */
#ifndef SHCD_TESTS_TOOLS_H
#define SHCD_TESTS_TOOLS_H

#include "shcd/tool.h"
#include "shcd/vec.h"
#include "support/bodies.h"
#include "support/check.h"

#define TOOLS_POINTS_MAX 12
#define TOOLS_FACETS_MAX 400

typedef struct test_tool {
    shcd_tool_geometry_def def;
    shcd_vec3 points[TOOLS_POINTS_MAX];
    int facet[TOOLS_FACETS_MAX][3];
    size_t n_facets;
    shcd_tool_geometry *geometry;
} test_tool;

static inline shcd_quat tools_random_rotation(check_random *r) {
    shcd_quat q = {check_normal(r), 0.0, 0.0, 0.0};
    q.x = check_normal(r);
    q.y = check_normal(r);
    q.z = check_normal(r);
    const double n = sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    q.w /= n;
    q.x /= n;
    q.y /= n;
    q.z /= n;
    return q;
}

/** At a uniform distance from the origin; in one order of draws with every compiler. */
static inline shcd_vec3 tools_random_point(double low, double high, check_random *r) {
    const double distance = check_uniform(r, low, high);
    return shcd_scale(distance, bodies_random_direction(r));
}

static inline shcd_pose tools_random_pose(double low, double high, check_random *r) {
    shcd_pose pose;
    pose.position_m = tools_random_point(low, high, r);
    pose.orientation = tools_random_rotation(r);
    return pose;
}

static inline void tools_find_facets(test_tool *t) {
    const int n = (int)t->def.n_points;
    for (int i = 0; i < n; i++) {
        for (int j = 0; j < n; j++) {
            for (int k = j + 1; k < n; k++) {
                const shcd_vec3 a = t->points[i];
                const shcd_vec3 normal =
                    shcd_unit(shcd_cross(shcd_sub(t->points[j], a), shcd_sub(t->points[k], a)));
                int above = 0, below = 0;
                for (int m = 0; m < n; m++) {
                    const double d = shcd_dot(normal, shcd_sub(t->points[m], a));
                    above += d > 1e-12;
                    below += d < -1e-12;
                }
                if (i < j && shcd_norm(normal) > 0.5 && (above == 0 || below == 0)) {
                    assert_true(t->n_facets < TOOLS_FACETS_MAX);
                    t->facet[t->n_facets][0] = i;
                    t->facet[t->n_facets][1] = above == 0 ? j : k;
                    t->facet[t->n_facets++][2] = above == 0 ? k : j;
                }
            }
        }
    }
}

static inline void tools_make(test_tool *t) {
    shcd_error error = {SHCD_OK, ""};
    t->n_facets = 0;
    if (t->def.kind == SHCD_TOOL_HULL) {
        t->def.points = t->points;
        tools_find_facets(t);
    }
    if (shcd_tool_geometry_create(&t->def, NULL, &t->geometry, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
}

/** Of any convex kind, sizes spread over two decades below `size`: needles and plates too. */
static inline void tools_make_random(test_tool *t, int kind, double size, check_random *r) {
    const shcd_tool_geometry_def blank = SHCD_TOOL_GEOMETRY_DEF_INIT;
    double length[4];
    for (int i = 0; i < 4; i++) {
        length[i] = size * pow(10.0, check_uniform(r, -2.0, 0.0));
    }
    t->def = blank;
    t->def.kind = kind;
    t->def.radius_m = kind == SHCD_TOOL_BOX || kind == SHCD_TOOL_HULL
                          ? (check_uniform(r, 0.0, 1.0) < 0.5 ? 0.0 : 0.3 * length[0])
                          : length[0];
    t->def.half_length_m = length[1];
    t->def.half_extents_m = shcd_vec3_make(length[1], length[2], length[3]);
    t->def.n_points = 4 + (size_t)check_uniform(r, 0.0, TOOLS_POINTS_MAX - 3.0);
    for (size_t i = 0; i < t->def.n_points; i++) {
        const shcd_vec3 d = bodies_random_direction(r);
        t->points[i] = shcd_vec3_make(length[1] * d.x, length[2] * d.y, length[3] * d.z);
    }
    tools_make(t);
}

static inline double tools_triangle_distance(shcd_vec3 p, shcd_vec3 a, shcd_vec3 b, shcd_vec3 c) {
    const shcd_vec3 corner[3] = {a, b, c};
    const shcd_vec3 n = shcd_unit(shcd_cross(shcd_sub(b, a), shcd_sub(c, a)));
    double least = HUGE_VAL;
    int inside = 1;
    for (int i = 0; i < 3; i++) {
        const shcd_vec3 e = shcd_sub(corner[(i + 1) % 3], corner[i]), d = shcd_sub(p, corner[i]);
        inside = inside && shcd_dot(shcd_cross(e, d), n) >= 0.0;
        const double t = fmin(1.0, fmax(0.0, shcd_dot(d, e) / shcd_dot(e, e)));
        least = fmin(least, shcd_norm(shcd_mul_add(d, -t, e)));
    }
    return inside ? fabs(shcd_dot(n, shcd_sub(p, a))) : least;
}

/** Signed distance from a point of the tool's frame to the core: the tool without its rounding. */
static inline double tools_core_distance(const test_tool *t, shcd_vec3 p) {
    const shcd_vec3 h = t->def.half_extents_m;
    switch (t->def.kind) {
    case SHCD_TOOL_CAPSULE: {
        const double z = fmax(-t->def.half_length_m, fmin(t->def.half_length_m, p.z));
        return sqrt(p.x * p.x + p.y * p.y + (p.z - z) * (p.z - z));
    }
    case SHCD_TOOL_BOX: {
        const double x = fabs(p.x) - h.x, y = fabs(p.y) - h.y, z = fabs(p.z) - h.z;
        const double ox = fmax(x, 0.0), oy = fmax(y, 0.0), oz = fmax(z, 0.0);
        return sqrt(ox * ox + oy * oy + oz * oz) + fmin(fmax(x, fmax(y, z)), 0.0);
    }
    case SHCD_TOOL_HULL: {
        double least = HUGE_VAL, most = -HUGE_VAL;
        for (size_t f = 0; f < t->n_facets; f++) {
            const shcd_vec3 a = t->points[t->facet[f][0]], b = t->points[t->facet[f][1]];
            const shcd_vec3 c = t->points[t->facet[f][2]];
            const shcd_vec3 n = shcd_unit(shcd_cross(shcd_sub(b, a), shcd_sub(c, a)));
            most = fmax(most, shcd_dot(n, shcd_sub(p, a)));
            least = fmin(least, tools_triangle_distance(p, a, b, c));
        }
        return most <= 0.0 ? most : least;
    }
    default:
        return shcd_norm(p);
    }
}

/** A random point of the core, its corners and edges often. */
static inline shcd_vec3 tools_core_point(const test_tool *t, check_random *r) {
    const shcd_vec3 h = t->def.half_extents_m;
    double u[3];
    for (int i = 0; i < 3; i++) {
        const double v = check_uniform(r, -2.0, 2.0);
        u[i] = fmax(-1.0, fmin(1.0, v));
    }
    if (t->def.kind == SHCD_TOOL_CAPSULE) {
        return shcd_vec3_make(0.0, 0.0, u[2] * t->def.half_length_m);
    }
    if (t->def.kind == SHCD_TOOL_BOX) {
        return shcd_vec3_make(u[0] * h.x, u[1] * h.y, u[2] * h.z);
    }
    if (t->def.kind == SHCD_TOOL_HULL) {
        double sum = 0.0;
        shcd_vec3 x = {0.0, 0.0, 0.0};
        for (size_t i = 0; i < t->def.n_points; i++) {
            const double v = check_uniform(r, 0.0, 1.0), weight = v * v * v * v * v * v * v * v;
            sum += weight;
            x = shcd_mul_add(x, weight, t->points[i]);
        }
        return shcd_scale(1.0 / sum, x);
    }
    return shcd_vec3_make(0.0, 0.0, 0.0);
}

#endif
