/* SPDX-License-Identifier: BSD-3-Clause */
/* Geometry of patches. */
#include "query/patch.h"

typedef struct nearest {
    double d2;
    double b[3];
} nearest;

static void try_edge(shcd_vec3 p, const shcd_vec3 x[3], int i, int k, nearest *best) {
    const shcd_vec3 e = shcd_sub(x[k], x[i]), q = shcd_sub(p, x[i]);
    const double ee = shcd_dot(e, e);
    double t = ee > 0.0 ? shcd_dot(q, e) / ee : 0.0;
    t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
    const shcd_vec3 d = shcd_mul_add(q, -t, e);
    const double d2 = shcd_dot(d, d);
    if (d2 < best->d2) {
        best->d2 = d2;
        best->b[0] = best->b[1] = best->b[2] = 0.0;
        best->b[i] = 1.0 - t;
        best->b[k] = t;
    }
}

/* To the nearest edge; with the triangle's height over its longest edge taken off, a lower bound
 * for what lies between the edges of a sliver. */
static double edge_distance(shcd_vec3 p, const shcd_vec3 x[3], double height, double b[3]) {
    nearest best = {HUGE_VAL, {1.0, 0.0, 0.0}};
    try_edge(p, x, 0, 1, &best);
    try_edge(p, x, 1, 2, &best);
    try_edge(p, x, 2, 0, &best);
    for (int i = 0; i < 3; i++) {
        b[i] = best.b[i];
    }
    return shcdi_max(0.0, sqrt(best.d2) - height);
}

double shcdi_triangle_distance(shcd_vec3 p, const shcd_vec3 x[3], double b[3]) {
    const shcd_vec3 e1 = shcd_sub(x[1], x[0]), e2 = shcd_sub(x[2], x[0]), q = shcd_sub(p, x[0]);
    const shcd_vec3 n = shcd_cross(e1, e2);
    const double nn = shcd_dot(n, n);
    if (!(nn > 0.0)) {
        return edge_distance(p, x, 0.0, b);
    }
    const double b1 = shcd_dot(shcd_cross(q, e2), n) / nn;
    const double b2 = shcd_dot(shcd_cross(e1, q), n) / nn;
    if (!(b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0)) {
        return edge_distance(p, x, 0.0, b);
    }
    b[0] = 1.0 - b1 - b2;
    b[1] = b1;
    b[2] = b2;
    /* n rounds by 6e-16 |e1||e2|, which tilts the plane of a sliver: never say too much */
    const double qq = shcd_dot(q, q), length = sqrt(nn);
    const double ee = shcdi_max(shcd_dot(e1, e1), shcd_dot(e2, e2));
    const double tilt = 8e-16 * ee / length;
    const double plane = shcdi_max(0.0, fabs(shcd_dot(q, n)) / length - tilt * sqrt(qq));
    if (tilt < 1e-13) {
        return plane;
    }
    double unused[3];
    return shcdi_max(plane, edge_distance(p, x, length / sqrt(ee), unused));
}

void shcdi_split(const shcd_vec3 w[3], shcd_vec3 child[4][3]) {
    for (int i = 0; i < 3; i++) {
        child[3][i] = shcd_unit(shcd_add(w[i], w[(i + 1) % 3]));
    }
    for (int i = 0; i < 3; i++) {
        child[i][i] = w[i];
        child[i][(i + 1) % 3] = child[3][i];
        child[i][(i + 2) % 3] = child[3][(i + 2) % 3];
    }
}

shcd_vec3 shcdi_cap_of(const shcd_vec3 w[3], double *angle) {
    const shcd_vec3 c = shcd_unit(shcd_add(w[0], shcd_add(w[1], w[2])));
    double chord2 = 0.0;
    for (int i = 0; i < 3; i++) {
        const shcd_vec3 d = shcd_sub(w[i], c);
        chord2 = shcdi_max(chord2, shcd_dot(d, d));
    }
    /* a cap below a half-sphere is convex, so it holds the patch if it holds the corners */
    *angle = shcdi_angle_upper(sqrt(chord2));
    return c;
}

/* Descends with the midpoints that the tree was built from. */
size_t shcdi_leaf_of(int level, shcd_vec3 w) {
    const double s[3] = {w.x < 0.0 ? -1.0 : 1.0, w.y < 0.0 ? -1.0 : 1.0, w.z < 0.0 ? -1.0 : 1.0};
    size_t node = (w.x < 0.0 ? 1u : 0u) | (w.y < 0.0 ? 2u : 0u) | (w.z < 0.0 ? 4u : 0u);
    const shcd_vec3 axis[3] = {{s[0], 0.0, 0.0}, {0.0, s[1], 0.0}, {0.0, 0.0, s[2]}};
    const int even = s[0] * s[1] * s[2] > 0.0;
    shcd_vec3 c[3] = {axis[0], axis[even ? 1 : 2], axis[even ? 2 : 1]};
    for (int depth = 0; depth < level; depth++) {
        shcd_vec3 mid[3];
        for (int i = 0; i < 3; i++) {
            mid[i] = shcd_unit(shcd_add(c[i], c[(i + 1) % 3]));
        }
        size_t child = 3;
        for (size_t i = 0; i < 3; i++) {
            /* beyond the great circle that cuts corner i off */
            const shcd_vec3 across = shcd_cross(mid[(i + 2) % 3], mid[i]);
            if (shcd_dot(across, w) * shcd_dot(across, c[i]) > 0.0) {
                child = i;
            }
        }
        node = 4 * node + child;
        for (size_t i = 0; i < 3; i++) {
            c[i] = child == 3             ? mid[i]
                   : i == child           ? c[i]
                   : i == (child + 1) % 3 ? mid[child]
                                          : mid[(child + 2) % 3];
        }
    }
    return node;
}
