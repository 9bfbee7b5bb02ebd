/* SPDX-License-Identifier: BSD-3-Clause */
/* Self-intersection of the leaf tessellation: pairs of nodes whose balls meet, down to pairs of
 * leaf triangles. It sees crossings wider than a leaf; finer ones can escape it (certainty:
 * sampled). */
#include "model/model.h"

/* Six times the signed volume of the tetrahedron (a, b, c, d). */
static double orient(shcd_vec3 a, shcd_vec3 b, shcd_vec3 c, shcd_vec3 d) {
    return shcd_dot(shcd_cross(shcd_sub(b, a), shcd_sub(c, a)), shcd_sub(d, a));
}

static int segment_crosses(shcd_vec3 p, shcd_vec3 q, const shcd_vec3 t[3]) {
    const double sp = orient(t[0], t[1], t[2], p), sq = orient(t[0], t[1], t[2], q);
    if ((sp > 0.0) == (sq > 0.0)) {
        return 0;
    }
    const double a = orient(p, q, t[0], t[1]), b = orient(p, q, t[1], t[2]);
    const double c = orient(p, q, t[2], t[0]);
    return (a > 0.0 && b > 0.0 && c > 0.0) || (a < 0.0 && b < 0.0 && c < 0.0);
}

static int leaves_cross(const shcdi_tree *tree, size_t i, size_t k) {
    const uint32_t *a = tree->leaf[i].vertex, *b = tree->leaf[k].vertex;
    shcd_vec3 x[3], y[3];
    for (int m = 0; m < 3; m++) {
        for (int n = 0; n < 3; n++) {
            if (a[m] == b[n]) {
                return 0;
            }
        }
        x[m] = tree->position[a[m]];
        y[m] = tree->position[b[m]];
    }
    for (int m = 0; m < 3; m++) {
        if (segment_crosses(x[m], x[(m + 1) % 3], y) || segment_crosses(y[m], y[(m + 1) % 3], x)) {
            return 1;
        }
    }
    return 0;
}

static int balls_meet(const shcdi_ball *a, const shcdi_ball *b) {
    const shcd_vec3 d = shcd_sub(a->centre, b->centre);
    const double r = a->radius + b->radius;
    return shcd_dot(d, d) <= r * r;
}

typedef struct node_pair {
    uint32_t i, k; /* of one level */
    int level;
} node_pair;

int shcdi_is_embedded(const shcdi_tree *tree) {
    /* depth first: each pair leaves at most 15 siblings waiting on each of 7 levels */
    node_pair stack[36 + 16 * (SHCDI_TREE_LEVEL_MAX + 1)];
    size_t n = 0;
    for (uint32_t i = 0; i < 8; i++) {
        for (uint32_t k = i; k < 8; k++) {
            stack[n++] = (node_pair){i, k, 0};
        }
    }
    while (n > 0) {
        const node_pair p = stack[--n];
        const shcdi_ball *ball = tree->ball + shcdi_tree_level_start(p.level);
        if (p.i != p.k && !balls_meet(&ball[p.i], &ball[p.k])) {
            continue;
        }
        if (p.level == tree->level) {
            if (p.i != p.k && leaves_cross(tree, p.i, p.k)) {
                return 0;
            }
            continue;
        }
        for (uint32_t a = 0; a < 4; a++) {
            for (uint32_t b = p.i == p.k ? a : 0; b < 4; b++) {
                stack[n++] = (node_pair){4 * p.i + a, 4 * p.k + b, p.level + 1};
            }
        }
    }
    return 1;
}
