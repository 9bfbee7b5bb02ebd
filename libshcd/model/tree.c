/* SPDX-License-Identifier: BSD-3-Clause */
/* The quadtree over the parameter sphere and its bounds.
 *
 * Deviation of a leaf. Let T be the flat triangle of the unit vectors w_1, w_2, w_3 with longest
 * edge h and circumradius r, so that its plane lies at c = sqrt(1 - r^2) from the origin, and g(x)
 * = S(x/|x|) on T. Linear interpolation of g errs by at most rho^2/2 sup|D^2 g|, rho the radius of
 * the smallest disc containing T (Waldron, SIAM J. Numer. Anal. 35, 1998), rho <= h/sqrt(3) (Jung).
 * Along a unit direction u of the plane x/|x| runs on a great circle; with p the distance of that
 * line from the origin and s the coordinate along it, |x|^2 = p^2 + s^2, theta' = p/|x|^2 and
 * theta'' = -2 p s/|x|^4. Here |x| >= c, p <= |x| and |s| <= r, so |theta'| <= 1/c, |theta''| <= 2
 * r/c^3, and
 *
 *   |D^2 g| = |S'' theta'^2 + S' theta''| <= M2/c^2 + 2 M1 r/c^3.
 */
#include "model/tree.h"

#include <string.h>

#define OUTWARD (1.0 + 1e-12)

int shcdi_tree_level_for(int degree) {
    return degree <= 3 ? 3 : degree <= 8 ? 4 : degree <= 40 ? 5 : 6;
}

/* Lattice point (i, j, k), |i| + |j| + |k| = n, to its cell of the unfolded octahedron: the upper
 * half is the diamond |u| + |v| <= n, the lower half is folded out over the diamond's edges. Points
 * with i = 0 or j = 0 on the lower half have two images; sign(0) = + chooses one. */
size_t shcdi_lattice_cell(const int p[3], int n) {
    int u = p[0], v = p[1];
    if (p[2] < 0) {
        const int au = p[0] < 0 ? -p[0] : p[0];
        const int av = p[1] < 0 ? -p[1] : p[1];
        u = p[0] < 0 ? av - n : n - av;
        v = p[1] < 0 ? au - n : n - au;
    }
    return (size_t)(u + n) * (size_t)(2 * n + 1) + (size_t)(v + n);
}

typedef struct corner {
    int p[3]; /* lattice point at the finest level */
} corner;

typedef struct lattice {
    int n;
    uint32_t *index; /* of each cell, UINT32_MAX: none yet */
    shcdi_tree *tree;
} lattice;

static uint32_t vertex_at(lattice *g, const int p[3], shcd_vec3 direction) {
    uint32_t *cell = &g->index[shcdi_lattice_cell(p, g->n)];
    if (*cell == UINT32_MAX) {
        *cell = (uint32_t)g->tree->n_vertices;
        g->tree->direction[g->tree->n_vertices++] = direction;
    }
    return *cell;
}

/* Splits one triangle; children in the order corner 0, corner 1, corner 2, middle. */
static void split(lattice *g, const corner c[3], const uint32_t v[3], corner out[4][3],
                  uint32_t out_v[4][3]) {
    corner mid[3];
    uint32_t mid_v[3];
    for (int e = 0; e < 3; e++) {
        const int f = (e + 1) % 3;
        for (int k = 0; k < 3; k++) {
            mid[e].p[k] = (c[e].p[k] + c[f].p[k]) / 2;
        }
        const shcd_vec3 sum = shcd_add(g->tree->direction[v[e]], g->tree->direction[v[f]]);
        mid_v[e] = vertex_at(g, mid[e].p, shcd_unit(sum));
    }
    for (int e = 0; e < 3; e++) {
        /* keep each corner in its place, so that orientation is kept */
        const int before = (e + 2) % 3;
        out[e][e] = c[e];
        out_v[e][e] = v[e];
        out[e][(e + 1) % 3] = mid[e];
        out_v[e][(e + 1) % 3] = mid_v[e];
        out[e][before] = mid[before];
        out_v[e][before] = mid_v[before];
        out[3][e] = mid[e];
        out_v[3][e] = mid_v[e];
    }
}

static void octahedron(lattice *g, corner (*c)[3], uint32_t (*v)[3]) {
    for (int o = 0; o < 8; o++) {
        const int sign[3] = {o & 1 ? -1 : 1, o & 2 ? -1 : 1, o & 4 ? -1 : 1};
        const int even = sign[0] * sign[1] * sign[2] > 0;
        const int axis[3] = {0, even ? 1 : 2, even ? 2 : 1};
        for (int k = 0; k < 3; k++) {
            double d[3] = {0.0, 0.0, 0.0};
            memset(c[o][k].p, 0, sizeof c[o][k].p);
            c[o][k].p[axis[k]] = sign[axis[k]] * g->n;
            d[axis[k]] = sign[axis[k]];
            v[o][k] = vertex_at(g, c[o][k].p, shcd_vec3_make(d[0], d[1], d[2]));
        }
    }
}

/* Centre of a leaf, and the angle from it to the farthest corner, rounded up. */
static double leaf_angle(const shcdi_tree *tree, size_t i, shcd_vec3 *centre) {
    const uint32_t *v = tree->leaf[i].vertex;
    const shcd_vec3 w[3] = {tree->direction[v[0]], tree->direction[v[1]], tree->direction[v[2]]};
    *centre = shcd_unit(shcd_add(w[0], shcd_add(w[1], w[2])));
    double chord = 0.0;
    for (int k = 0; k < 3; k++) {
        chord = shcdi_max(chord, shcd_norm(shcd_sub(w[k], *centre)));
    }
    return 2.0 * asin(shcdi_min(1.0, 0.5 * chord)) * OUTWARD;
}

/* Triangles of all levels, finest last; the two buffers hold n_leaves triangles each. */
static void subdivide(shcdi_tree *tree, uint32_t *index, corner (*corners)[3], uint32_t (*ids)[3]) {
    lattice g = {1 << tree->level, index, tree};
    octahedron(&g, corners, ids);
    for (int level = 0; level < tree->level; level++) {
        /* from the last triangle on, so that children do not overwrite triangles still to be split
         */
        for (size_t t = shcdi_tree_level_size(level); t-- > 0;) {
            corner c[3];
            uint32_t v[3];
            memcpy(c, corners[t], sizeof c);
            memcpy(v, ids[t], sizeof v);
            split(&g, c, v, &corners[4 * t], &ids[4 * t]);
        }
    }
    for (size_t t = 0; t < tree->n_leaves; t++) {
        memcpy(tree->leaf[t].vertex, ids[t], sizeof ids[t]);
    }
    for (size_t t = 0; t < tree->n_leaves; t++) {
        shcd_vec3 centre;
        tree->angle_max = shcdi_max(tree->angle_max, leaf_angle(tree, t, &centre));
    }
    tree->reach = SHCDI_TREE_REACH * tree->angle_max;
}

shcd_status shcdi_tree_create(int level, const shcd_allocator *allocator, shcdi_tree *tree) {
    shcdi_tree t = {.level = level, .n_leaves = shcdi_tree_level_size(level)};
    const size_t n_vertices = t.n_leaves / 2 + 2;
    const size_t side = ((size_t)2 << level) + 1;
    t.direction = allocator->allocate(n_vertices * sizeof *t.direction, allocator->user);
    t.position = allocator->allocate(n_vertices * sizeof *t.position, allocator->user);
    t.leaf = allocator->allocate(t.n_leaves * sizeof *t.leaf, allocator->user);
    t.ball = allocator->allocate(shcdi_tree_ball_count(level) * sizeof *t.ball, allocator->user);
    uint32_t *index = allocator->allocate(side * side * sizeof *index, allocator->user);
    corner(*corners)[3] = allocator->allocate(t.n_leaves * sizeof *corners, allocator->user);
    uint32_t(*ids)[3] = allocator->allocate(t.n_leaves * sizeof *ids, allocator->user);
    shcd_status status = SHCD_ERR_MEMORY;
    if (t.direction != NULL && t.position != NULL && t.leaf != NULL && t.ball != NULL &&
        index != NULL && corners != NULL && ids != NULL) {
        memset(index, 0xff, side * side * sizeof *index);
        subdivide(&t, index, corners, ids);
        SHCD_ASSERT(t.n_vertices == n_vertices);
        status = SHCD_OK;
    }
    void *scratch[3] = {index, corners, ids};
    for (int i = 0; i < 3; i++) {
        if (scratch[i] != NULL) {
            allocator->release(scratch[i], allocator->user);
        }
    }
    if (status != SHCD_OK) {
        shcdi_tree_free(&t, allocator);
        return status;
    }
    *tree = t;
    return SHCD_OK;
}

void shcdi_tree_free(shcdi_tree *tree, const shcd_allocator *allocator) {
    void *pieces[4] = {tree->direction, tree->position, tree->leaf, tree->ball};
    for (int i = 0; i < 4; i++) {
        if (pieces[i] != NULL) {
            allocator->release(pieces[i], allocator->user);
        }
    }
    memset(tree, 0, sizeof *tree);
}

double shcdi_patch_deviation(shcd_vec3 a, shcd_vec3 b, shcd_vec3 c, double m1, double m2) {
    const shcd_vec3 ab = shcd_sub(b, a), bc = shcd_sub(c, b), ca = shcd_sub(a, c);
    const double ab2 = shcd_dot(ab, ab), bc2 = shcd_dot(bc, bc), ca2 = shcd_dot(ca, ca);
    const shcd_vec3 normal = shcd_cross(ab, bc); /* twice the area */
    const double h2 = shcdi_max(ab2, shcdi_max(bc2, ca2));
    const double area2 = shcd_dot(normal, normal);
    /* r = (product of the edges)/(4 area) */
    const double r2 = area2 > 0.0 ? ab2 * bc2 * ca2 / (4.0 * area2) : 1.0;
    const double c2 = shcdi_max(1e-6, 1.0 - r2);
    const double cosine = sqrt(c2);
    return h2 / 6.0 * (m2 / c2 + 2.0 * m1 * sqrt(r2) / (c2 * cosine)) * OUTWARD;
}

static float round_up(double a) {
    return (float)(a * (1.0 + 0x1p-22));
}

static void fill_leaf(shcdi_tree *tree, const shcdi_bounds *bounds, double evaluation_error_m,
                      size_t i) {
    shcdi_leaf *leaf = &tree->leaf[i];
    shcd_vec3 w[3], x[3];
    for (int k = 0; k < 3; k++) {
        w[k] = tree->direction[leaf->vertex[k]];
        x[k] = tree->position[leaf->vertex[k]];
    }
    shcd_vec3 centre;
    const double radius = leaf_angle(tree, i, &centre);
    double inner[SHCDI_SUPREMA], outer[SHCDI_SUPREMA], least;
    /* the deviation needs the leaf itself, proofs of uniqueness look beyond it */
    shcdi_bounds_cap(bounds, centre, radius, inner, NULL);
    shcdi_bounds_cap(bounds, centre, tree->reach, outer, &least);
    leaf->deviation = round_up(shcdi_patch_deviation(w[0], w[1], w[2], inner[0], inner[1]) +
                               2.0 * evaluation_error_m);
    leaf->m1 = round_up(outer[0]);
    leaf->m2 = round_up(outer[1]);
    leaf->m3 = round_up(outer[2]);
    leaf->product = round_up(outer[3]);
    leaf->sigma = (float)(least * (1.0 - 0x1p-22));
    shcdi_ball *ball = &tree->ball[shcdi_tree_level_start(tree->level) + i];
    ball->centre = shcd_scale(1.0 / 3.0, shcd_add(x[0], shcd_add(x[1], x[2])));
    ball->radius = 0.0;
    for (int k = 0; k < 3; k++) {
        ball->radius = shcdi_max(ball->radius, shcd_norm(shcd_sub(x[k], ball->centre)));
    }
    ball->radius = (ball->radius + (double)leaf->deviation) * OUTWARD;
    tree->deviation_max = shcdi_max(tree->deviation_max, (double)leaf->deviation);
}

/* Ball of a node that contains its children's balls: centred at the mean of their centres, as
 * large as needed. */
static shcdi_ball enclose(const shcdi_ball child[4]) {
    shcd_vec3 sum = {0.0, 0.0, 0.0};
    for (int k = 0; k < 4; k++) {
        sum = shcd_add(sum, child[k].centre);
    }
    shcdi_ball ball = {shcd_scale(0.25, sum), 0.0};
    for (int k = 0; k < 4; k++) {
        const double far = shcd_norm(shcd_sub(child[k].centre, ball.centre)) + child[k].radius;
        ball.radius = shcdi_max(ball.radius, far * OUTWARD);
    }
    return ball;
}

void shcdi_tree_fill(shcdi_tree *tree, const shcdi_series *series, const shcdi_bounds *bounds,
                     double evaluation_error_m) {
    for (size_t i = 0; i < tree->n_vertices; i++) {
        tree->position[i] = shcdi_surface_point(series, series->degree, tree->direction[i]);
    }
    tree->deviation_max = 0.0;
    for (size_t i = 0; i < tree->n_leaves; i++) {
        fill_leaf(tree, bounds, evaluation_error_m, i);
    }
    for (int level = tree->level; level-- > 0;) {
        const shcdi_ball *child = tree->ball + shcdi_tree_level_start(level + 1);
        shcdi_ball *ball = tree->ball + shcdi_tree_level_start(level);
        for (size_t i = 0; i < shcdi_tree_level_size(level); i++) {
            ball[i] = enclose(child + 4 * i);
        }
    }
}
