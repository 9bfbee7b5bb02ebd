/* SPDX-License-Identifier: BSD-3-Clause */
/* A tree of boxes, each split at the median of its triangles' centres along its longest side.
 *
 * The sign is the parity of the crossings of a ray, by the majority of three rays: the normal at
 * the closest point tells the wrong side where a mesh folds, a ray does so only where it passes an
 * edge within rounding, which hardly happens to two of three. */
#include "cost_mesh.h"

#include "shcd/vec.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LEAF 4
/* The halves differ by at most one triangle, so 2^32 of them make a tree of 32 levels. */
#define STACK 40

typedef struct box {
    double low[3], high[3];
} box;

typedef struct tree_node {
    box bounds;
    uint32_t first, n; /**< triangles, in the tree's order */
    uint32_t children; /**< the first of two; 0: a leaf */
} tree_node;

typedef struct sort_entry {
    double key;
    uint32_t triangle;
} sort_entry;

struct cost_mesh {
    size_t n_triangles, n_nodes;
    shcd_vec3 (*corner)[3]; /**< of the triangles, in the tree's order */
    double *area;           /**< of triangles 0 .. i together */
    tree_node *nodes;
};

static box box_of(const cost_mesh *mesh, const sort_entry *order, size_t n) {
    box b = {{HUGE_VAL, HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}};
    for (size_t t = 0; t < n; t++) {
        for (int k = 0; k < 3; k++) {
            const shcd_vec3 v = mesh->corner[order[t].triangle][k];
            const double x[3] = {v.x, v.y, v.z};
            for (int a = 0; a < 3; a++) {
                b.low[a] = fmin(b.low[a], x[a]);
                b.high[a] = fmax(b.high[a], x[a]);
            }
        }
    }
    return b;
}

static int compare(const void *a, const void *b) {
    const double x = ((const sort_entry *)a)->key;
    const double y = ((const sort_entry *)b)->key;
    return (x > y) - (x < y);
}

static void sort_along(const cost_mesh *mesh, int axis, sort_entry *order, size_t n) {
    for (size_t t = 0; t < n; t++) {
        const shcd_vec3 *c = mesh->corner[order[t].triangle];
        order[t].key = axis == 0   ? c[0].x + c[1].x + c[2].x
                       : axis == 1 ? c[0].y + c[1].y + c[2].y
                                   : c[0].z + c[1].z + c[2].z;
    }
    qsort(order, n, sizeof *order, compare);
}

/* The array of nodes is its own queue. */
static void build_tree(cost_mesh *mesh, sort_entry *order) {
    mesh->n_nodes = 1;
    mesh->nodes[0] = (tree_node){.first = 0, .n = (uint32_t)mesh->n_triangles};
    for (size_t i = 0; i < mesh->n_nodes; i++) {
        tree_node *node = &mesh->nodes[i];
        node->bounds = box_of(mesh, order + node->first, node->n);
        if (node->n <= LEAF) {
            continue;
        }
        int axis = 0;
        for (int a = 1; a < 3; a++) {
            const box *b = &node->bounds;
            axis = b->high[a] - b->low[a] > b->high[axis] - b->low[axis] ? a : axis;
        }
        sort_along(mesh, axis, order + node->first, node->n);
        const uint32_t half = node->n / 2;
        node->children = (uint32_t)mesh->n_nodes;
        mesh->nodes[mesh->n_nodes++] = (tree_node){.first = node->first, .n = half};
        mesh->nodes[mesh->n_nodes++] =
            (tree_node){.first = node->first + half, .n = node->n - half};
    }
}

/* Triangles in the tree's order; their areas summed up. */
static bool arrange(cost_mesh *mesh, const sort_entry *order) {
    shcd_vec3(*corner)[3] = malloc(mesh->n_triangles * sizeof *corner);
    if (corner == NULL) {
        return false;
    }
    double sum = 0.0;
    for (size_t t = 0; t < mesh->n_triangles; t++) {
        memcpy(corner[t], mesh->corner[order[t].triangle], sizeof corner[t]);
        sum += 0.5 * shcd_norm(shcd_cross(shcd_sub(corner[t][1], corner[t][0]),
                                          shcd_sub(corner[t][2], corner[t][0])));
        mesh->area[t] = sum;
    }
    free(mesh->corner);
    mesh->corner = corner;
    return true;
}

cost_mesh *cost_mesh_create(const double *vertices_m, size_t n_vertices, const uint32_t *triangles,
                            size_t n_triangles) {
    cost_mesh *mesh = calloc(1, sizeof *mesh);
    sort_entry *order = malloc(n_triangles * sizeof *order);
    bool good = mesh != NULL && order != NULL && n_vertices > 0 && n_triangles > 0;
    if (good) {
        mesh->n_triangles = n_triangles;
        mesh->corner = malloc(n_triangles * sizeof *mesh->corner);
        mesh->area = malloc(n_triangles * sizeof *mesh->area);
        mesh->nodes = malloc(2 * n_triangles * sizeof *mesh->nodes);
        good = mesh->corner != NULL && mesh->area != NULL && mesh->nodes != NULL;
    }
    if (good) {
        for (size_t t = 0; t < n_triangles; t++) {
            order[t].triangle = (uint32_t)t;
            for (size_t k = 0; k < 3; k++) {
                const double *v = vertices_m + 3 * (size_t)triangles[3 * t + k];
                mesh->corner[t][k] = shcd_vec3_make(v[0], v[1], v[2]);
            }
        }
        build_tree(mesh, order);
        good = arrange(mesh, order);
    }
    free(order);
    if (!good) {
        cost_mesh_free(mesh);
        return NULL;
    }
    return mesh;
}

void cost_mesh_free(cost_mesh *mesh) {
    if (mesh != NULL) {
        free(mesh->corner);
        free(mesh->area);
        free(mesh->nodes);
        free(mesh);
    }
}

double cost_mesh_diagonal(const cost_mesh *mesh) {
    const box *b = &mesh->nodes[0].bounds;
    return shcd_norm(
        shcd_vec3_make(b->high[0] - b->low[0], b->high[1] - b->low[1], b->high[2] - b->low[2]));
}

static shcd_vec3 closest_on_segment(shcd_vec3 p, shcd_vec3 a, shcd_vec3 b) {
    const shcd_vec3 ab = shcd_sub(b, a);
    const double length2 = shcd_dot(ab, ab);
    const double t = length2 > 0.0 ? shcd_dot(shcd_sub(p, a), ab) / length2 : 0.0;
    return shcd_mul_add(a, fmin(1.0, fmax(0.0, t)), ab);
}

/* Square of the distance: of the foot on the plane if it lies inside, else of the nearest side. */
static double triangle_distance2(shcd_vec3 p, const shcd_vec3 c[3]) {
    const shcd_vec3 n = shcd_cross(shcd_sub(c[1], c[0]), shcd_sub(c[2], c[0]));
    const double n2 = shcd_dot(n, n);
    bool inside = n2 > 0.0;
    double best = HUGE_VAL;
    for (int k = 0; k < 3; k++) {
        const shcd_vec3 a = c[k], b = c[(k + 1) % 3];
        const shcd_vec3 away = shcd_sub(p, closest_on_segment(p, a, b));
        best = fmin(best, shcd_dot(away, away));
        inside = inside && shcd_dot(shcd_cross(shcd_sub(b, a), shcd_sub(p, a)), n) >= 0.0;
    }
    if (inside) {
        const double height = shcd_dot(shcd_sub(p, c[0]), n);
        return fmin(best, height * height / n2);
    }
    return best;
}

static double box_distance2(const box *b, const double x[3]) {
    double sum = 0.0;
    for (int a = 0; a < 3; a++) {
        const double out = fmax(0.0, fmax(b->low[a] - x[a], x[a] - b->high[a]));
        sum += out * out;
    }
    return sum;
}

static double unsigned_distance(const cost_mesh *mesh, shcd_vec3 p) {
    const double x[3] = {p.x, p.y, p.z};
    uint32_t stack[STACK];
    int n = 0;
    double best = HUGE_VAL;
    stack[n++] = 0;
    while (n > 0) {
        const tree_node *node = &mesh->nodes[stack[--n]];
        if (box_distance2(&node->bounds, x) >= best) {
            continue;
        }
        if (node->children == 0) {
            for (uint32_t t = node->first; t < node->first + node->n; t++) {
                best = fmin(best, triangle_distance2(p, mesh->corner[t]));
            }
            continue;
        }
        const double left = box_distance2(&mesh->nodes[node->children].bounds, x);
        const double right = box_distance2(&mesh->nodes[node->children + 1].bounds, x);
        const uint32_t nearer = left <= right ? 0 : 1;
        stack[n++] = node->children + 1 - nearer;
        stack[n++] = node->children + nearer;
    }
    return sqrt(best);
}

/* Moeller, Trumbore, Fast, minimum storage ray/triangle intersection, J. Graphics Tools (1997). */
static bool ray_crosses(shcd_vec3 p, shcd_vec3 d, const shcd_vec3 c[3]) {
    const shcd_vec3 e1 = shcd_sub(c[1], c[0]), e2 = shcd_sub(c[2], c[0]);
    const shcd_vec3 h = shcd_cross(d, e2);
    const double det = shcd_dot(e1, h);
    if (det == 0.0) {
        return false;
    }
    const shcd_vec3 s = shcd_sub(p, c[0]);
    const shcd_vec3 q = shcd_cross(s, e1);
    const double u = shcd_dot(s, h) / det;
    const double v = shcd_dot(d, q) / det;
    return u >= 0.0 && v >= 0.0 && u + v <= 1.0 && shcd_dot(e2, q) / det > 0.0;
}

static bool ray_meets_box(const box *b, const double x[3], const double d[3]) {
    double enter = 0.0, leave = HUGE_VAL;
    for (int a = 0; a < 3; a++) {
        const double t0 = (b->low[a] - x[a]) / d[a];
        const double t1 = (b->high[a] - x[a]) / d[a];
        enter = fmax(enter, fmin(t0, t1));
        leave = fmin(leave, fmax(t0, t1));
    }
    /* a flat box and rounding: rather one box too many */
    return enter <= leave * (1.0 + 1e-12) + 1e-300;
}

static bool parity_along(const cost_mesh *mesh, shcd_vec3 p, shcd_vec3 direction) {
    const double x[3] = {p.x, p.y, p.z};
    const double d[3] = {direction.x, direction.y, direction.z};
    uint32_t stack[STACK];
    int n = 0;
    bool odd = false;
    stack[n++] = 0;
    while (n > 0) {
        const tree_node *node = &mesh->nodes[stack[--n]];
        if (!ray_meets_box(&node->bounds, x, d)) {
            continue;
        }
        if (node->children != 0) {
            stack[n++] = node->children;
            stack[n++] = node->children + 1;
            continue;
        }
        for (uint32_t t = node->first; t < node->first + node->n; t++) {
            odd = odd != ray_crosses(p, direction, mesh->corner[t]);
        }
    }
    return odd;
}

double cost_mesh_distance(const cost_mesh *mesh, shcd_vec3 point) {
    /* no component is zero, no two are alike */
    static const shcd_vec3 directions[3] = {
        {0.5377, 0.2311, -0.8109}, {-0.6813, 0.7013, 0.2099}, {0.1709, -0.7741, 0.6096}};
    int inside = 0;
    for (int i = 0; i < 3; i++) {
        inside += parity_along(mesh, point, directions[i]) ? 1 : 0;
    }
    const double d = unsigned_distance(mesh, point);
    return inside >= 2 ? -d : d;
}

shcd_vec3 cost_mesh_draw(const cost_mesh *mesh, cost_random *random) {
    const double wanted = cost_random_next(random) * mesh->area[mesh->n_triangles - 1];
    size_t low = 0, high = mesh->n_triangles - 1;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (mesh->area[middle] > wanted) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    const shcd_vec3 *c = mesh->corner[low];
    const double root = sqrt(cost_random_next(random));
    const double share = cost_random_next(random);
    const shcd_vec3 p = shcd_scale(1.0 - root, c[0]);
    return shcd_mul_add(shcd_mul_add(p, root * (1.0 - share), c[1]), root * share, c[2]);
}
