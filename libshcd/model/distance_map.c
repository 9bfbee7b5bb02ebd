/* SPDX-License-Identifier: BSD-3-Clause */
/* The distance map's look-up.
 *
 * Linear: r = sum b_i r_i over the nodes around; on the latitude-longitude grid these are the four
 * samples and the bilinear weights.
 *
 * Hermite, on the octahedral grid: the side-vertex method (Nielson, Math. Comput. 33, 1979, for
 * planar triangulations), with the radius as a function of R^3 that is constant along rays, so that
 * its gradient at a lattice point q is s/|q|, s the stored slope. On the edge opposite corner i:
 * the cubic with the two ends' values and derivatives; across it, along the normal nu of the great
 * circle through the edge, the linear interpolant of the ends' derivatives; along the ray, zero.
 * From corner i to that edge point: a cubic with both ends' values and derivatives. The three are
 * blended with weights (b_j b_k)^2. Value and gradient on an edge depend on that edge's nodes only
 * and do not know the face, so r is C1 on the whole sphere, across the edges of the octahedron too.
 */
#include "model/distance_map.h"

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

static double interpolate(const shcdi_stencil *at, const shcdi_crossing *const c[4], int hermite) {
    if (!hermite) {
        double r = 0.0;
        for (int i = 0; i < at->n; i++) {
            r += at->weight[i] * (double)c[i]->radius;
        }
        return r;
    }
    node_data n;
    for (int i = 0; i < 3; i++) {
        n.radius[i] = (double)c[i]->radius;
        n.q[i] = shcd_vec3_make((double)at->p[i][0], (double)at->p[i][1], (double)at->p[i][2]);
        n.gradient[i] = shcd_scale(1.0 / shcd_norm(n.q[i]), shcdi_from_floats(c[i]->slope));
    }
    return hermite_radius(&n, at->weight);
}

void shcdi_map_look_up(const shcdi_map *map, shcd_vec3 direction, int hermite, shcdi_map_ray *ray) {
    shcdi_stencil *at = &ray->at;
    shcdi_grid_locate(map->grid, map->resolution, direction, at);
    int top = 0, agree = 1;
    const uint8_t count = map->count[at->slot[0]];
    for (int i = 0; i < at->n; i++) {
        top = at->weight[i] > at->weight[top] ? i : top;
        agree = agree && map->count[at->slot[i]] == count;
    }
    ray->nearest_cell = at->slot[top];
    if (!agree || count == SHCDI_MAP_UNSURE) {
        ray->count = -1;
        return;
    }
    ray->count = count;
    for (uint32_t k = 0; k < count; k++) {
        const shcdi_crossing *c[4];
        for (int i = 0; i < 4; i++) {
            c[i] = &map->crossing[map->first[at->slot[i]] + k];
        }
        ray->radius[k] = interpolate(at, c, hermite);
    }
}

void shcdi_map_take_nearest(const shcdi_map *map, shcdi_map_ray *ray) {
    const size_t slot = ray->nearest_cell;
    ray->count = map->count[slot] == SHCDI_MAP_UNSURE ? 0 : map->count[slot];
    for (int k = 0; k < ray->count; k++) {
        ray->radius[k] = (double)map->crossing[map->first[slot] + (uint32_t)k].radius;
    }
    ray->at.n = 1;
    ray->at.slot[0] = slot;
    ray->at.weight[0] = 1.0;
}

void shcdi_map_detail(const shcdi_map *map, const shcdi_map_ray *ray, int k, shcd_vec3 unit,
                      shcd_vec3 *slope, shcd_vec3 *parameter) {
    const shcdi_stencil *at = &ray->at;
    const shcd_vec3 zero = {0.0, 0.0, 0.0};
    shcd_vec3 s = zero, w = zero;
    for (int i = 0; i < at->n; i++) {
        const shcdi_crossing *c = &map->crossing[map->first[at->slot[i]] + (uint32_t)k];
        s = shcd_mul_add(s, at->weight[i], shcdi_from_floats(c->slope));
        w = shcd_mul_add(w, at->weight[i], shcdi_from_floats(c->parameter));
    }
    *slope = shcd_mul_add(s, -shcd_dot(s, unit), unit);
    /* samples on different sheets can cancel out: then the nearest node's own */
    if (!(shcd_dot(w, w) > 0.25)) {
        w = shcdi_from_floats(map->crossing[map->first[ray->nearest_cell] + (uint32_t)k].parameter);
    }
    *parameter = shcd_unit(w);
}

double shcdi_map_reference(const shcdi_map *map, const shcdi_stencil *at, int hermite) {
    const shcdi_crossing *c[4];
    for (int i = 0; i < 4; i++) {
        c[i] = &map->reference[at->slot[i < at->n ? i : 0]];
    }
    return interpolate(at, c, hermite && at->n == 3);
}

double shcdi_map_bound_at(const shcdi_map *map, const shcdi_stencil *at, int hermite) {
    if (map->bound == NULL) {
        return HUGE_VAL;
    }
    return (double)map->bound[at->cell] * (hermite ? SHCDI_MAP_HERMITE_RATIO : 1.0);
}

/* Along a tangent e of the direction d: n . (dr d + r e) = 0, so grad r = -r (n - (n.d) d)/(n.d).
 */
shcdi_crossing shcdi_map_crossing(shcd_vec3 direction, double radius, shcd_vec3 normal,
                                  shcd_vec3 parameter) {
    const double nd = shcd_dot(normal, direction);
    /* a grazing ray has no slope; a capped one keeps the look-up finite */
    const double safe = fabs(nd) > 1e-3 ? nd : nd < 0.0 ? -1e-3 : 1e-3;
    const shcd_vec3 s = shcd_scale(-radius / safe, shcd_mul_add(normal, -nd, direction));
    const shcdi_crossing c = {(float)radius,
                              {(float)s.x, (float)s.y, (float)s.z},
                              {(float)parameter.x, (float)parameter.y, (float)parameter.z}};
    return c;
}

size_t shcdi_map_seed_bytes(const shcdi_map *map) {
    return map->n_crossings * sizeof map->crossing->parameter;
}
