/* SPDX-License-Identifier: BSD-3-Clause */
/* Split at the median of the centroids along the longest side of the box: the depth is then at most
 * log2(n) + 1, and so is the stack of a traversal. For reports and tests; not for the tick. */
#include "triangle_tree.h"

#include <stdlib.h>

#define LEAF_TRIANGLES 4
#define STACK_MAX 128

typedef struct box {
    double low[3], high[3];
} box;

typedef struct node {
    box bounds;
    uint32_t first, count; /* triangles in `order`; a leaf if right == 0 */
    uint32_t right;        /* the left child follows its parent */
} node;

struct shcdi_triangle_tree {
    const shcd_vec3 *positions;
    const uint32_t *triangles;
    uint32_t *order;
    double *centroids; /* 3 per triangle, while building */
    node *nodes;
    size_t n_nodes;
};

static double component(shcd_vec3 v, int axis) {
    return axis == 0 ? v.x : axis == 1 ? v.y : v.z;
}

static box bounds_of(const shcdi_triangle_tree *tree, uint32_t first, uint32_t count) {
    box b = {{HUGE_VAL, HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}};
    for (uint32_t i = first; i < first + count; ++i) {
        for (int corner = 0; corner < 3; ++corner) {
            const shcd_vec3 v =
                tree->positions[tree->triangles[3 * (size_t)tree->order[i] + (size_t)corner]];
            for (int axis = 0; axis < 3; ++axis) {
                b.low[axis] = fmin(b.low[axis], component(v, axis));
                b.high[axis] = fmax(b.high[axis], component(v, axis));
            }
        }
    }
    return b;
}

/* Quickselect: the middle of order[first ..] gets its place by centroid, smaller ones before it.
 * Ties are broken by the triangle's number, so that the tree is the same everywhere. */
static void select_median(shcdi_triangle_tree *tree, uint32_t first, uint32_t count, size_t axis) {
    uint32_t *order = tree->order;
    size_t low = first, high = (size_t)first + count - 1;
    const size_t middle = first + count / 2;
    while (low < high) {
        const uint32_t pivot = order[low + (high - low) / 2];
        const double value = tree->centroids[3 * (size_t)pivot + axis];
        size_t i = low, j = high;
        for (;;) {
            while (tree->centroids[3 * (size_t)order[i] + axis] < value ||
                   (tree->centroids[3 * (size_t)order[i] + axis] == value && order[i] < pivot)) {
                ++i;
            }
            while (tree->centroids[3 * (size_t)order[j] + axis] > value ||
                   (tree->centroids[3 * (size_t)order[j] + axis] == value && order[j] > pivot)) {
                --j;
            }
            if (i >= j) {
                break;
            }
            const uint32_t swap = order[i];
            order[i] = order[j];
            order[j] = swap;
        }
        if (i == middle) {
            return;
        }
        low = i < middle ? i + 1 : low;
        high = i < middle ? high : i - 1;
    }
}

static size_t longest_axis(const box *b) {
    const double x = b->high[0] - b->low[0], y = b->high[1] - b->low[1], z = b->high[2] - b->low[2];
    return x >= y && x >= z ? 0 : y >= z ? 1 : 2;
}

/* Depth first, so that a left child lies beside its parent; a right child notes its own number in
 * the parent when its turn comes. */
static void build(shcdi_triangle_tree *tree, uint32_t n_triangles) {
    struct {
        uint32_t first, count, parent;
    } stack[STACK_MAX] = {{0, n_triangles, UINT32_MAX}};
    size_t n_stacked = 1;
    while (n_stacked > 0) {
        const uint32_t first = stack[n_stacked - 1].first, count = stack[n_stacked - 1].count;
        const uint32_t parent = stack[--n_stacked].parent;
        const uint32_t self = (uint32_t)tree->n_nodes++;
        node *n = &tree->nodes[self];
        *n = (node){bounds_of(tree, first, count), first, count, 0};
        if (parent != UINT32_MAX) {
            tree->nodes[parent].right = self;
        }
        if (count > LEAF_TRIANGLES) {
            const uint32_t half = count / 2;
            select_median(tree, first, count, longest_axis(&n->bounds));
            stack[n_stacked].first = first + half;
            stack[n_stacked].count = count - half;
            stack[n_stacked++].parent = self;
            stack[n_stacked].first = first;
            stack[n_stacked].count = half;
            stack[n_stacked++].parent = UINT32_MAX;
        }
    }
}

shcd_status shcdi_triangle_tree_create(const shcd_vec3 *positions, const uint32_t *triangles,
                                       size_t n_triangles, shcdi_triangle_tree **tree) {
    if (n_triangles == 0 || n_triangles > UINT32_MAX / 4) {
        return SHCD_ERR_ARGUMENT;
    }
    shcdi_triangle_tree *t = calloc(1, sizeof *t);
    if (t == NULL) {
        return SHCD_ERR_MEMORY;
    }
    t->positions = positions;
    t->triangles = triangles;
    t->order = malloc(n_triangles * sizeof *t->order);
    t->centroids = malloc(3 * n_triangles * sizeof *t->centroids);
    t->nodes = malloc(2 * n_triangles * sizeof *t->nodes);
    if (t->order == NULL || t->centroids == NULL || t->nodes == NULL) {
        shcdi_triangle_tree_free(t);
        return SHCD_ERR_MEMORY;
    }
    for (size_t i = 0; i < n_triangles; ++i) {
        const shcd_vec3 a = positions[triangles[3 * i]], b = positions[triangles[3 * i + 1]];
        const shcd_vec3 sum = shcd_add(shcd_add(a, b), positions[triangles[3 * i + 2]]);
        t->order[i] = (uint32_t)i;
        t->centroids[3 * i] = sum.x;
        t->centroids[3 * i + 1] = sum.y;
        t->centroids[3 * i + 2] = sum.z;
    }
    build(t, (uint32_t)n_triangles);
    *tree = t;
    return SHCD_OK;
}

void shcdi_triangle_tree_free(shcdi_triangle_tree *tree) {
    if (tree != NULL) {
        free(tree->order);
        free(tree->centroids);
        free(tree->nodes);
        free(tree);
    }
}

static double box_distance_squared(const box *b, shcd_vec3 p) {
    double sum = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const double x = component(p, axis);
        const double gap = fmax(0.0, fmax(b->low[axis] - x, x - b->high[axis]));
        sum += gap * gap;
    }
    return sum;
}

static double segment_distance_squared(shcd_vec3 p, shcd_vec3 a, shcd_vec3 b) {
    const shcd_vec3 ab = shcd_sub(b, a), ap = shcd_sub(p, a);
    const double length2 = shcd_dot(ab, ab);
    const double t = length2 > 0.0 ? fmin(1.0, fmax(0.0, shcd_dot(ap, ab) / length2)) : 0.0;
    const shcd_vec3 gap = shcd_mul_add(ap, -t, ab);
    return shcd_dot(gap, gap);
}

/* The plane's distance if p projects into the triangle, else the nearest edge: right for triangles
 * without area too, which project nothing. */
static double triangle_distance_squared(shcd_vec3 p, const shcd_vec3 *v) {
    const shcd_vec3 normal = shcd_cross(shcd_sub(v[1], v[0]), shcd_sub(v[2], v[0]));
    int is_inside = 1;
    for (int k = 0; k < 3; ++k) {
        const shcd_vec3 edge = shcd_sub(v[(k + 1) % 3], v[k]);
        is_inside &= shcd_dot(shcd_cross(normal, edge), shcd_sub(p, v[k])) > 0.0;
    }
    if (is_inside) {
        const double height = shcd_dot(normal, shcd_sub(p, v[0]));
        return height * height / shcd_dot(normal, normal);
    }
    return fmin(
        segment_distance_squared(p, v[0], v[1]),
        fmin(segment_distance_squared(p, v[1], v[2]), segment_distance_squared(p, v[2], v[0])));
}

static void corners(const shcdi_triangle_tree *tree, uint32_t triangle, shcd_vec3 *v) {
    for (size_t k = 0; k < 3; ++k) {
        v[k] = tree->positions[tree->triangles[3 * (size_t)triangle + k]];
    }
}

double shcdi_triangle_tree_distance(const shcdi_triangle_tree *tree, shcd_vec3 p) {
    struct {
        uint32_t node;
        double lower;
    } stack[STACK_MAX] = {{0, 0.0}};
    size_t n_stacked = 1;
    double best = HUGE_VAL;
    while (n_stacked > 0) {
        const uint32_t self = stack[--n_stacked].node;
        if (stack[n_stacked].lower >= best) {
            continue;
        }
        const node *n = &tree->nodes[self];
        if (n->right == 0) {
            for (uint32_t i = n->first; i < n->first + n->count; ++i) {
                shcd_vec3 v[3];
                corners(tree, tree->order[i], v);
                best = fmin(best, triangle_distance_squared(p, v));
            }
            continue;
        }
        const double left = box_distance_squared(&tree->nodes[self + 1].bounds, p);
        const double right = box_distance_squared(&tree->nodes[n->right].bounds, p);
        const int left_first = left <= right; /* the nearer one is stacked last */
        stack[n_stacked].node = left_first ? n->right : self + 1;
        stack[n_stacked++].lower = left_first ? right : left;
        stack[n_stacked].node = left_first ? self + 1 : n->right;
        stack[n_stacked++].lower = left_first ? left : right;
    }
    return sqrt(best);
}

static int ray_meets_box(const box *b, shcd_vec3 p, shcd_vec3 d, double length_max) {
    double enter = 0.0, leave = length_max;
    for (int axis = 0; axis < 3; ++axis) {
        const double x = component(p, axis), slope = component(d, axis);
        if (slope == 0.0) {
            if (x < b->low[axis] || x > b->high[axis]) {
                return 0;
            }
            continue;
        }
        const double a = (b->low[axis] - x) / slope, c = (b->high[axis] - x) / slope;
        enter = fmax(enter, fmin(a, c));
        leave = fmin(leave, fmax(a, c));
    }
    return enter <= leave;
}

/* Moeller, Trumbore, "Fast, minimum storage ray/triangle intersection", JGT 2(1), 1997 */
static double ray_hits(shcd_vec3 p, shcd_vec3 d, const shcd_vec3 *v) {
    const shcd_vec3 e1 = shcd_sub(v[1], v[0]), e2 = shcd_sub(v[2], v[0]);
    const shcd_vec3 h = shcd_cross(d, e2), s = shcd_sub(p, v[0]), q = shcd_cross(s, e1);
    const double det = shcd_dot(e1, h);
    if (det == 0.0) {
        return HUGE_VAL;
    }
    const double a = shcd_dot(s, h) / det, b = shcd_dot(d, q) / det, t = shcd_dot(e2, q) / det;
    return a >= 0.0 && b >= 0.0 && a + b <= 1.0 && t >= 0.0 ? t : (double)HUGE_VAL;
}

static int share_a_vertex(const uint32_t *a, const uint32_t *b) {
    for (int i = 0; i < 3; ++i) {
        if (a[i] == b[0] || a[i] == b[1] || a[i] == b[2]) {
            return 1;
        }
    }
    return 0;
}

double shcdi_triangle_tree_ray(const shcdi_triangle_tree *tree, shcd_vec3 p, shcd_vec3 d,
                               uint32_t own, uint32_t *hit) {
    uint32_t stack[STACK_MAX] = {0};
    size_t n_stacked = 1;
    double best = HUGE_VAL;
    while (n_stacked > 0) {
        const uint32_t self = stack[--n_stacked];
        const node *n = &tree->nodes[self];
        if (!ray_meets_box(&n->bounds, p, d, best)) {
            continue;
        }
        if (n->right != 0) {
            stack[n_stacked++] = n->right;
            stack[n_stacked++] = self + 1;
            continue;
        }
        for (uint32_t i = n->first; i < n->first + n->count; ++i) {
            const uint32_t t = tree->order[i];
            if (share_a_vertex(tree->triangles + 3 * (size_t)t,
                               tree->triangles + 3 * (size_t)own)) {
                continue;
            }
            shcd_vec3 v[3];
            corners(tree, t, v);
            const double length = ray_hits(p, d, v);
            if (length < best) {
                best = length;
                *hit = t;
            }
        }
    }
    return best;
}
