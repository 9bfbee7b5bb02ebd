/* SPDX-License-Identifier: BSD-3-Clause */
/* Ray casting: the tree tells which leaves a ray may cross, Newton's method finds where. */
#include "model/map_cast.h"

#include <string.h>

#define STEPS_MAX 20

int shcdi_ray_newton(const shcd_model *model, shcd_vec3 origin, shcd_vec3 d, shcd_vec3 start,
                     size_t *steps_left, shcdi_hit *hit) {
    shcd_vec3 e1, e2, w = start;
    shcdi_tangent_frame(d, &e1, &e2);
    const double tolerance = shcdi_ray_tolerance(model);
    for (int i = 0; i<STEPS_MAX && * steps_left> 0; i++) {
        --*steps_left;
        shcdi_jet jet;
        shcdi_surface_first(&model->series, model->degree, w, &jet);
        const shcd_vec3 x = shcd_sub(jet.s, origin);
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
        const double u = -(e * f1 - b * f2) / det, v = -(a * f2 - c * f1) / det;
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

static void insert(shcdi_hit *hits, int *n, const shcdi_hit *hit, double apart) {
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

/* Leaves tried on one ray. Real bodies need 5 to 10 for a crossing and up to 50 for a ray that
 * grazes; a knot of a surface, made to take long, is given up: its ray counts as one with too many
 * crossings. */
#define LEAVES_MAX 96

int shcdi_cast_within(const shcd_model *model, shcd_vec3 origin, shcd_vec3 d, size_t *steps_left,
                      shcdi_hit hits[SHCDI_MAP_CROSSINGS_MAX + 1]) {
    const shcdi_tree *tree = &model->tree;
    uint32_t stack[8 + 4 * (SHCDI_TREE_LEVEL_MAX + 1)];
    int level_of[8 + 4 * (SHCDI_TREE_LEVEL_MAX + 1)];
    int n_stack = 0, n = 0, n_leaves = 0;
    for (uint32_t i = 0; i < 8; i++) {
        stack[n_stack] = i;
        level_of[n_stack++] = 0;
    }
    while (n_stack > 0) {
        const uint32_t i = stack[--n_stack];
        const int level = level_of[n_stack];
        const shcdi_ball *ball = &tree->ball[shcdi_tree_level_start(level) + i];
        if (!ball_meets_ray(ball, origin, d)) {
            continue;
        }
        if (level < tree->level) {
            for (uint32_t k = 0; k < 4; k++) {
                stack[n_stack] = 4 * i + k;
                level_of[n_stack++] = level + 1;
            }
            continue;
        }
        if (n > SHCDI_MAP_CROSSINGS_MAX || ++n_leaves > LEAVES_MAX) {
            return SHCDI_MAP_CROSSINGS_MAX + 1;
        }
        const uint32_t *v = tree->leaf[i].vertex;
        const shcd_vec3 sum =
            shcd_add(tree->direction[v[0]], shcd_add(tree->direction[v[1]], tree->direction[v[2]]));
        shcdi_hit hit;
        if (shcdi_ray_newton(model, origin, d, shcd_unit(sum), steps_left, &hit)) {
            insert(hits, &n, &hit, 1e-9 * model->info.diagonal_m);
        }
        if (*steps_left == 0) {
            return SHCDI_MAP_CROSSINGS_MAX + 1;
        }
    }
    return n;
}

int shcdi_cast(const shcd_model *model, shcd_vec3 origin, shcd_vec3 d,
               shcdi_hit hits[SHCDI_MAP_CROSSINGS_MAX + 1]) {
    size_t steps_left = (size_t)LEAVES_MAX * STEPS_MAX + 1;
    return shcdi_cast_within(model, origin, d, &steps_left, hits);
}
