/* SPDX-License-Identifier: BSD-3-Clause */
/* The distance map's look-up, and its building.
 *
 * Nodes are the lattice points of the octahedron |x| + |y| + |z| = N, so that there are no poles
 * and a look-up needs no trigonometry: q = N d/|d|_1 lies in a lattice triangle of one face, with
 * barycentric coordinates from the fractions of its coordinates.
 *
 * Linear: r = sum b_i r_i. Hermite: the side-vertex method (Nielson, Math. Comput. 33, 1979, for
 * planar triangulations), with the radius as a function of R^3 that is constant along rays, so that
 * its gradient at a lattice point q is s/|q|, s the stored slope. On the edge opposite corner i:
 * the cubic with the two ends' values and derivatives; across it, along the normal nu of the great
 * circle through the edge, the linear interpolant of the ends' derivatives; along the ray, zero.
 * From corner i to that edge point: a cubic with both ends' values and derivatives. The three are
 * blended with weights (b_j b_k)^2. Value and gradient on an edge depend on that edge's nodes only
 * and do not know the face, so r is C1 on the whole sphere, across the edges of the octahedron too.
 */
#include "model/distance_map.h"

#include "model/model.h"

#include <string.h>

/* 4098 nodes; resolution is not what limits a radial map (finer ones gain nothing for depth) */
#define RESOLUTION 32

/* ---- look-up ---- */

typedef struct map_triangle {
    int p[3][3];
    double weight[3];
} map_triangle;

static map_triangle triangle_of(int n, shcd_vec3 d) {
    const double sum = fabs(d.x) + fabs(d.y) + fabs(d.z);
    const double q[3] = {fabs(d.x) / sum * n, fabs(d.y) / sum * n, fabs(d.z) / sum * n};
    const double component[3] = {d.x, d.y, d.z};
    int whole[3], left = n;
    double part[3];
    for (int k = 0; k < 3; k++) {
        whole[k] = (int)q[k];
        part[k] = q[k] - whole[k];
        left -= whole[k];
    }
    /* Rounding can make the parts of a node sum to 0 or 3: it is then the nearest corner of a
     * triangle of the first kind, with one weight of 1. */
    const int up = left != 2;
    if (left == 0 || left == 3) {
        int top = 0;
        for (int k = 1; k < 3; k++) {
            top = whole[k] + part[k] > whole[top] + part[top] ? k : top;
        }
        whole[top] += left - 1;
        for (int k = 0; k < 3; k++) {
            part[k] = k == top ? 1.0 : 0.0;
        }
    }
    map_triangle t;
    for (int i = 0; i < 3; i++) {
        t.weight[i] = up ? part[i] : 1.0 - part[i];
        for (int k = 0; k < 3; k++) {
            const int step = up ? (i == k) : (i != k);
            t.p[i][k] = (whole[k] + step) * (component[k] < 0.0 ? -1 : 1);
        }
    }
    const double total = t.weight[0] + t.weight[1] + t.weight[2];
    for (int i = 0; i < 3; i++) {
        t.weight[i] /= total;
    }
    return t;
}

static shcd_vec3 lattice_direction(const int p[3]) {
    return shcd_unit(shcd_vec3_make((double)p[0], (double)p[1], (double)p[2]));
}

/* One crossing at the three nodes: radius and gradient over R^3 at the lattice points q. */
typedef struct node_data {
    shcd_vec3 q[3], gradient[3];
    double radius[3];
} node_data;

/* Cubic on [0, 1] with end values and derivatives; *slope gets its derivative. */
static double cubic(double u, double f0, double d0, double f1, double d1, double *slope) {
    const double v = 1.0 - u;
    *slope = 6.0 * u * v * (f1 - f0) + v * (v - 2.0 * u) * d0 + u * (u - 2.0 * v) * d1;
    return v * v * (1.0 + 2.0 * u) * f0 + u * v * v * d0 + u * u * (1.0 + 2.0 * v) * f1 -
           u * u * v * d1;
}

/* Along the line from corner i through the point, to the opposite edge. */
static double side_vertex(const node_data *n, const double b[3], int i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const double t = b[k] / (b[j] + b[k]);
    const shcd_vec3 e = shcd_sub(n->q[k], n->q[j]);
    const shcd_vec3 q = shcd_mul_add(n->q[j], t, e);
    const shcd_vec3 nu = shcd_unit(shcd_cross(n->q[j], n->q[k]));
    double along_e, unused;
    const double edge = cubic(t, n->radius[j], shcd_dot(n->gradient[j], e), n->radius[k],
                              shcd_dot(n->gradient[k], e), &along_e);
    const double along_nu =
        (1.0 - t) * shcd_dot(n->gradient[j], nu) + t * shcd_dot(n->gradient[k], nu);
    const shcd_vec3 v = shcd_sub(q, n->q[i]);
    /* v = alpha e + beta q + gamma nu; e and q are orthogonal to nu */
    const double ee = shcd_dot(e, e), qq = shcd_dot(q, q), eq = shcd_dot(e, q);
    const double alpha = (shcd_dot(v, e) * qq - shcd_dot(v, q) * eq) / (ee * qq - eq * eq);
    const double slope = alpha * along_e + shcd_dot(v, nu) * along_nu;
    return cubic(1.0 - b[i], n->radius[i], shcd_dot(n->gradient[i], v), edge, slope, &unused);
}

static double hermite_radius(const node_data *n, const double b[3]) {
    double sum = 0.0, r = 0.0;
    for (int i = 0; i < 3; i++) {
        const double pair = b[(i + 1) % 3] * b[(i + 2) % 3];
        const double w = pair * pair;
        if (w > 0.0) {
            sum += w;
            r += w * side_vertex(n, b, i);
        }
    }
    if (sum > 0.0) {
        return r / sum;
    }
    const int top = b[0] > 0.5 ? 0 : b[1] > 0.5 ? 1 : 2; /* at a node */
    return n->radius[top];
}

static double interpolate(const shcdi_map *map, const map_triangle *t, const size_t cell[3],
                          uint32_t crossing, int hermite) {
    node_data n;
    for (int i = 0; i < 3; i++) {
        const shcdi_crossing *c = &map->crossing[map->first[cell[i]] + crossing];
        n.radius[i] = (double)c->radius;
        if (hermite) {
            n.q[i] = shcd_vec3_make((double)t->p[i][0], (double)t->p[i][1], (double)t->p[i][2]);
            n.gradient[i] = shcd_scale(
                1.0 / shcd_norm(n.q[i]),
                shcd_vec3_make((double)c->slope[0], (double)c->slope[1], (double)c->slope[2]));
        }
    }
    const double *b = t->weight;
    return hermite ? hermite_radius(&n, b)
                   : b[0] * n.radius[0] + b[1] * n.radius[1] + b[2] * n.radius[2];
}

void shcdi_map_look_up(const shcdi_map *map, shcd_vec3 direction, int hermite, shcdi_map_ray *ray) {
    const map_triangle t = triangle_of(map->resolution, direction);
    size_t cell[3];
    int top = 0;
    for (int i = 0; i < 3; i++) {
        cell[i] = shcdi_lattice_cell(t.p[i], map->resolution);
        top = t.weight[i] > t.weight[top] ? i : top;
    }
    ray->nearest_cell = cell[top];
    const uint8_t count = map->count[cell[0]];
    if (count == SHCDI_MAP_UNSURE || map->count[cell[1]] != count || map->count[cell[2]] != count) {
        ray->count = -1;
        return;
    }
    ray->count = count;
    for (uint32_t n = 0; n < count; n++) {
        ray->radius[n] = interpolate(map, &t, cell, n, hermite);
    }
}

/* ---- building ---- */

typedef struct ray_hit {
    double radius;
    shcd_vec3 w, normal;
} ray_hit;

/* Newton for S(w) - C parallel to d, from a leaf's centre; 1 if it converges in front of C. */
static int refine(const shcd_model *model, shcd_vec3 d, shcd_vec3 start, ray_hit *hit) {
    shcd_vec3 e1, e2, w = start;
    shcdi_tangent_frame(d, &e1, &e2);
    const double tolerance = 1e-13 * model->info.diagonal_m + 4.0 * model->evaluation_error_m;
    for (int i = 0; i < 20; i++) {
        shcdi_jet jet;
        shcdi_surface_jet(&model->series, model->degree, w, &jet);
        const shcd_vec3 x = shcd_sub(jet.s, model->map.centre);
        const double f1 = shcd_dot(e1, x), f2 = shcd_dot(e2, x);
        if (fabs(f1) + fabs(f2) <= tolerance) {
            hit->radius = shcd_dot(d, x);
            hit->w = w;
            hit->normal = shcd_unit(shcd_cross(jet.s1, jet.s2));
            return hit->radius > 0.0;
        }
        const double a = shcd_dot(e1, jet.s1), b = shcd_dot(e1, jet.s2);
        const double c = shcd_dot(e2, jet.s1), e = shcd_dot(e2, jet.s2);
        const double det = a * e - b * c;
        if (det == 0.0) {
            return 0;
        }
        double u = -(e * f1 - b * f2) / det, v = -(a * f2 - c * f1) / det;
        const double length = sqrt(u * u + v * v);
        if (!(length < 1.0)) {
            return 0; /* leaves this leaf's neighbourhood: another leaf finds that root */
        }
        w = shcd_unit(shcd_mul_add(shcd_mul_add(w, u, jet.t1), v, jet.t2));
    }
    return 0;
}

static int ball_meets_ray(const shcdi_ball *ball, shcd_vec3 origin, shcd_vec3 d) {
    const shcd_vec3 v = shcd_sub(ball->centre, origin);
    const double along = shcdi_max(0.0, shcd_dot(v, d));
    const shcd_vec3 off = shcd_mul_add(v, -along, d);
    return shcd_dot(off, off) <= ball->radius * ball->radius;
}

static void insert(ray_hit *hits, int *n, const ray_hit *hit, double apart) {
    int at = 0;
    for (int i = 0; i < *n; i++) {
        if (fabs(hits[i].radius - hit->radius) <= apart &&
            shcd_norm(shcd_sub(hits[i].w, hit->w)) <= 1e-6) {
            return;
        }
        at += hits[i].radius < hit->radius;
    }
    if (*n <= SHCDI_MAP_CROSSINGS_MAX) {
        memmove(hits + at + 1, hits + at, (size_t)(*n - at) * sizeof *hits);
        hits[at] = *hit;
        (*n)++;
    }
}

/* All crossings of a ray, nearest first: Newton from every leaf whose ball it meets. Returns their
 * number, which exceeds SHCDI_MAP_CROSSINGS_MAX if there are more than the map keeps. */
static int cast(const shcd_model *model, shcd_vec3 d, ray_hit hits[SHCDI_MAP_CROSSINGS_MAX + 1]) {
    const shcdi_tree *tree = &model->tree;
    uint32_t stack[8 + 4 * (SHCDI_TREE_LEVEL_MAX + 1)];
    int level_of[8 + 4 * (SHCDI_TREE_LEVEL_MAX + 1)];
    int n_stack = 0, n = 0;
    for (uint32_t i = 0; i < 8; i++) {
        stack[n_stack] = i;
        level_of[n_stack++] = 0;
    }
    while (n_stack > 0) {
        const uint32_t i = stack[--n_stack];
        const int level = level_of[n_stack];
        const shcdi_ball *ball = &tree->ball[shcdi_tree_level_start(level) + i];
        if (!ball_meets_ray(ball, model->map.centre, d)) {
            continue;
        }
        if (level < tree->level) {
            for (uint32_t k = 0; k < 4; k++) {
                stack[n_stack] = 4 * i + k;
                level_of[n_stack++] = level + 1;
            }
            continue;
        }
        const uint32_t *v = tree->leaf[i].vertex;
        const shcd_vec3 sum =
            shcd_add(tree->direction[v[0]], shcd_add(tree->direction[v[1]], tree->direction[v[2]]));
        ray_hit hit;
        if (refine(model, d, shcd_unit(sum), &hit)) {
            insert(hits, &n, &hit, 1e-9 * model->info.diagonal_m);
        }
    }
    return n;
}

/* Along a tangent e of the direction d: n . (dr d + r e) = 0, so grad r = -r (n - (n.d) d)/(n.d).
 */
static shcdi_crossing crossing_of(const ray_hit *hit, shcd_vec3 d) {
    const double nd = shcd_dot(hit->normal, d);
    /* a grazing ray has no slope; a capped one keeps the look-up finite */
    const double safe = fabs(nd) > 1e-3 ? nd : nd < 0.0 ? -1e-3 : 1e-3;
    const shcd_vec3 s = shcd_scale(-hit->radius / safe, shcd_mul_add(hit->normal, -nd, d));
    const shcdi_crossing c = {(float)hit->radius,
                              {(float)s.x, (float)s.y, (float)s.z},
                              {(float)hit->w.x, (float)hit->w.y, (float)hit->w.z}};
    return c;
}

typedef int (*node_visitor)(shcd_model *model, const int p[3], void *user);

/* Visits every cell once for each lattice point that maps to it first. */
static int visit_nodes(shcd_model *model, node_visitor visit, void *user) {
    const int n = model->map.resolution;
    for (int i = -n; i <= n; i++) {
        const int rest = n - (i < 0 ? -i : i);
        for (int j = -rest; j <= rest; j++) {
            const int k = rest - (j < 0 ? -j : j);
            const int up[3] = {i, j, k}, down[3] = {i, j, -k};
            if (!visit(model, up, user) || (k != 0 && !visit(model, down, user))) {
                return 0;
            }
        }
    }
    return 1;
}

typedef struct fill {
    size_t capacity, odd, even;
} fill;

static int fill_node(shcd_model *model, const int p[3], void *user) {
    fill *f = user;
    shcdi_map *map = &model->map;
    const shcd_vec3 d = lattice_direction(p);
    const size_t cell = shcdi_lattice_cell(p, map->resolution);
    ray_hit hits[SHCDI_MAP_CROSSINGS_MAX + 1];
    const int n = cast(model, d, hits);
    map->first[cell] = (uint32_t)map->n_crossings;
    map->count[cell] = n <= SHCDI_MAP_CROSSINGS_MAX ? (uint8_t)n : SHCDI_MAP_UNSURE;
    f->odd += n % 2 == 1;
    f->even += n % 2 == 0;
    if (n > SHCDI_MAP_CROSSINGS_MAX) {
        return 1;
    }
    if (map->n_crossings + (size_t)n > f->capacity) {
        const size_t capacity = 2 * f->capacity + SHCDI_MAP_CROSSINGS_MAX;
        shcdi_crossing *larger =
            model->allocator.allocate(capacity * sizeof *larger, model->allocator.user);
        if (larger == NULL) {
            return 0;
        }
        if (map->n_crossings > 0) {
            memcpy(larger, map->crossing, map->n_crossings * sizeof *larger);
        }
        if (map->crossing != NULL) {
            model->allocator.release(map->crossing, model->allocator.user);
        }
        map->crossing = larger;
        f->capacity = capacity;
    }
    for (int i = 0; i < n; i++) {
        map->crossing[map->n_crossings++] = crossing_of(&hits[i], d);
    }
    return 1;
}

typedef struct parity {
    size_t one, all;
    int most;
} parity;

/* From a fixed centre all rays cross a closed surface an odd number of times, or all an even
 * number; a ray that differs has grazed it. */
static int check_parity(shcd_model *model, const int p[3], void *user) {
    parity *count = user;
    uint8_t *n = &model->map.count[shcdi_lattice_cell(p, model->map.resolution)];
    if (*n != SHCDI_MAP_UNSURE && (*n % 2 == 1) != (model->map.centre_inside != 0)) {
        *n = SHCDI_MAP_UNSURE;
    }
    count->all++;
    count->one += *n == 1;
    if (*n != SHCDI_MAP_UNSURE && *n > count->most) {
        count->most = *n;
    }
    return 1;
}

/* Errors at directions off the nodes: a golden-angle spiral, 1021 of them (prime, so that it does
 * not fall into step with the lattice). */
static void measure_errors(shcd_model *model) {
    shcdi_map *map = &model->map;
    for (int i = 0; i < 1021; i++) {
        const double z = 1.0 - (2.0 * i + 1.0) / 1021.0, s = sqrt(1.0 - z * z);
        const double phi = 2.39996322972865332 * i;
        const shcd_vec3 d = {s * cos(phi), s * sin(phi), z};
        shcdi_map_ray linear, hermite;
        shcdi_map_look_up(map, d, 0, &linear);
        shcdi_map_look_up(map, d, 1, &hermite);
        ray_hit hits[SHCDI_MAP_CROSSINGS_MAX + 1];
        const int n = linear.count > 0 ? cast(model, d, hits) : -1;
        for (int k = 0; k < n && n == linear.count; k++) {
            map->linear_error_m =
                shcdi_max(map->linear_error_m, fabs(linear.radius[k] - hits[k].radius));
            map->hermite_error_m =
                shcdi_max(map->hermite_error_m, fabs(hermite.radius[k] - hits[k].radius));
        }
    }
}

shcd_status shcdi_map_create(shcd_model *model) {
    shcdi_map *map = &model->map;
    const size_t side = 2 * RESOLUTION + 1;
    map->resolution = RESOLUTION;
    map->centre = model->info.star_centre_m;
    map->first = model->allocator.allocate(side * side * sizeof *map->first, model->allocator.user);
    map->count = model->allocator.allocate(side * side, model->allocator.user);
    if (map->first == NULL || map->count == NULL) {
        return SHCD_ERR_MEMORY;
    }
    memset(map->first, 0, side * side * sizeof *map->first);
    memset(map->count, SHCDI_MAP_UNSURE, side * side);
    fill f = {0, 0, 0};
    if (!visit_nodes(model, fill_node, &f)) {
        return SHCD_ERR_MEMORY;
    }
    map->centre_inside = f.odd > f.even;
    parity count = {0, 0, 0};
    visit_nodes(model, check_parity, &count);
    map->crossings_max = count.most;
    map->one_crossing_share = (double)count.one / (double)count.all;
    measure_errors(model);
    return SHCD_OK;
}

void shcdi_map_free(shcdi_map *map, const shcd_allocator *allocator) {
    void *pieces[3] = {map->first, map->count, map->crossing};
    for (int i = 0; i < 3; i++) {
        if (pieces[i] != NULL) {
            allocator->release(pieces[i], allocator->user);
        }
    }
    memset(map, 0, sizeof *map);
}

size_t shcdi_map_bytes(const shcdi_map *map) {
    const size_t side = 2 * (size_t)map->resolution + 1;
    return side * side * (sizeof *map->first + sizeof *map->count) +
           map->n_crossings * sizeof *map->crossing;
}
