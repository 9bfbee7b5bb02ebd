/* SPDX-License-Identifier: BSD-3-Clause */
/* When may a moving tool first meet each patch of the surface? Branch and bound in time.
 *
 * Advancing by gap/speed crawls where the tool grazes: the gap is small and stays so. A patch below
 * the path is not approached at all, though, and a plane between it and the tool shows it. Let K be
 * the tool's core (a ball's centre, a capsule's segment, a box), at time t + h. For any unit vector
 * n, a patch within eps of the triangle x_0 x_1 x_2 keeps apart from the tool by
 *
 *   min over K(t) of n.y - max_i n.x_i - eps - radius - h c                                (1)
 *   c = B_0 - n.v + Omega |n x a| rho
 *
 * since a point of K at distance <= rho from the origin moves along n at v.n + omega (a x r).n, and
 * (a x r).n = (n x a).r. (1) is linear in h: the patch is not met before it falls to keep_m. n is
 * that of the closest points of triangle and core, and is taken again where (1) fell. Of a ball,
 * (1) is the tangent of a convex function, the distance of a point on a line to the triangle, so
 * this is Newton's method from the left and converges quadratically. Each step is proven by itself,
 * whatever n rounds to.
 *
 * Patches that may be met before the earliest time known to end the free path are split in four,
 * the earliest first, until eps <= tolerance/8. Then the surface point under the triangle's closest
 * one lies within 2 eps of keep_m + radius from the core: contact within the tolerance, if neither
 * B_0 nor the turn was overestimated by more. The time that ends the path falls as such patches are
 * found, and everything that was dropped before them was dropped because it is met later: at the
 * end all patches are free up to it.
 */
#include "query/sweep.h"

#include "query/image.h"
#include "query/tool_core.h"

#include <string.h>

#define LEVELS_MAX 26
#define STEPS_MAX 16
#define LAST_STEPS_MAX 100

typedef struct swept {
    shcdi_image patch;
    double time; /* not met before */
    double deviation;
    shcd_vec3 nearest; /* barycentric, of the triangle's closest point at `time` */
    int level;
} swept;

typedef struct search {
    const shcdi_view *view;
    const shcdi_sweep_path *path;
    const shcdi_motion *motion;
    shcdi_sweep_free *out;
    double reach; /* radius + keep + slack: what the core keeps from the surface */
    uint32_t evaluations_max;
} search;

/* A plane between the core at one time and a triangle: n.y - max n.x_i over the core, and the
 * barycentric coordinates of the triangle's closest point. */
typedef struct plane {
    double gap;
    shcd_vec3 n, nearest;
} plane;

static plane plane_of_ball(const search *s, const shcd_vec3 x[3], double t) {
    plane found;
    const shcd_vec3 p = shcd_mul_add(s->motion->from.position_m, t, s->motion->velocity);
    double b[3];
    shcdi_triangle_distance(p, x, b);
    shcd_vec3 n = p;
    for (int i = 0; i < 3; i++) {
        n = shcd_mul_add(n, -b[i], x[i]);
    }
    found.n = n = shcd_unit(n);
    found.nearest = shcd_vec3_make(b[0], b[1], b[2]);
    found.gap = shcd_dot(n, p) -
                shcdi_max(shcdi_max(shcd_dot(n, x[0]), shcd_dot(n, x[1])), shcd_dot(n, x[2]));
    return found;
}

static plane plane_of_core(const search *s, const shcd_vec3 x[3], double t) {
    plane found;
    shcdi_core_gap gap;
    const shcd_pose pose = shcdi_motion_at(s->motion, t);
    shcd_vec3 y[3];
    for (int i = 0; i < 3; i++) {
        y[i] = shcd_transform_inverse(pose, x[i]);
    }
    shcdi_core_gap_to(s->motion->tool, y, 3, 0.01 * s->path->tolerance_m, HUGE_VAL, &gap);
    found.gap = gap.lower;
    found.n = shcd_scale(-1.0, shcd_rotate(pose.orientation, gap.u));
    found.nearest = shcd_vec3_make(gap.weight[0], gap.weight[1], gap.weight[2]);
    return found;
}

/* Time before which no point within `deviation` of the triangle comes within s->reach of the core;
 * from t on. HUGE_VAL: not on this path. */
static double triangle_time(const search *s, const shcd_vec3 x[3], double deviation, double t,
                            int steps_max, shcd_vec3 *nearest) {
    const shcdi_motion *motion = s->motion;
    for (int step = 0; step < steps_max; step++) {
        const plane at = motion->tool == NULL ? plane_of_ball(s, x, t) : plane_of_core(s, x, t);
        *nearest = at.nearest;
        const double gap = at.gap - deviation - (t - s->path->from) * s->path->growth_m - s->reach;
        if (!(gap > 0.0)) {
            return t;
        }
        const double turning = motion->omega * motion->bounding_m *
                               (shcd_norm(shcd_cross(at.n, motion->axis)) + 1e-14);
        const double closing = s->path->growth_m - shcd_dot(at.n, motion->velocity) + turning;
        /* quotient and sum round by less than 4e-16 of the time left */
        const double advance = closing > 0.0 ? gap / closing : HUGE_VAL;
        if (!(t + advance < 1.0)) {
            return HUGE_VAL;
        }
        t += advance * (1.0 - 1e-14);
        if (gap <= 0.0625 * s->path->tolerance_m) {
            return t;
        }
    }
    return t;
}

/* Whether the tool may meet anything within r of c before the free path ends. */
static int is_ball_met(const search *s, shcd_vec3 c, double r) {
    const shcdi_motion *motion = s->motion;
    const shcd_vec3 d = shcd_sub(motion->from.position_m, c);
    const double vv = shcd_dot(motion->velocity, motion->velocity);
    const double end = shcdi_min(1.0, s->out->time);
    double t = vv > 0.0 ? -shcd_dot(d, motion->velocity) / vv : 0.0;
    t = t < s->path->from ? s->path->from : t > end ? end : t;
    const shcd_vec3 closest = shcd_mul_add(d, t, motion->velocity);
    /* t need not be exact: the distance to a point of the path exceeds the least by no more than
     * |v| times its error, which the slack in reach covers */
    const double whole = shcdi_max(motion->bounding_m, motion->radius_m) - motion->radius_m;
    return shcd_norm(closest) <= r + s->reach + whole + (end - s->path->from) * s->path->growth_m;
}

/* The time when a ball comes within radius + 3/4 tolerance of a point of a surface that does not
 * move. */
static void try_point(search *s, shcd_vec3 x) {
    const shcdi_motion *motion = s->motion;
    if (s->path->growth_m > 0.0 || motion->tool != NULL) {
        return;
    }
    const double near = motion->radius_m + 0.75 * s->path->tolerance_m;
    const shcd_vec3 from = shcd_mul_add(motion->from.position_m, s->path->from, motion->velocity);
    const shcd_vec3 d = shcd_sub(from, x);
    const double vv = shcd_dot(motion->velocity, motion->velocity);
    const double dv = shcd_dot(d, motion->velocity);
    const double c = shcd_dot(d, d) - near * near;
    const double discriminant = dv * dv - vv * c;
    if (!(dv < 0.0) || !(discriminant > 0.0) || !(c > 0.0)) {
        return;
    }
    const double h = c / (sqrt(discriminant) - dv), t = s->path->from + h;
    if (t < s->out->time && t <= 1.0) {
        /* what it comes to is evaluated, not inferred */
        s->out->time = t;
        s->out->upper_m =
            shcd_norm(shcd_mul_add(d, h, motion->velocity)) - motion->radius_m + s->path->slack_m;
    }
}

/* Distance of a point from the core at time t. */
static double core_distance(const search *s, shcd_vec3 x, double t) {
    const shcd_pose pose = shcdi_motion_at(s->motion, t);
    if (s->motion->tool == NULL) {
        return shcd_norm(shcd_sub(x, pose.position_m));
    }
    shcdi_core_foot foot;
    shcdi_core_closest(s->motion->tool, shcd_transform_inverse(pose, x), &foot);
    return foot.distance;
}

/* A patch as flat as the tolerance: its time ends the free path. */
static void end_at(search *s, swept *a) {
    const shcdi_sweep_path *path = s->path;
    a->time = triangle_time(s, a->patch.x, a->deviation, a->time, LAST_STEPS_MAX, &a->nearest);
    if (!(a->time < s->out->time)) {
        return;
    }
    shcd_vec3 w = shcd_scale(a->nearest.x, a->patch.w[0]);
    w = shcd_mul_add(w, a->nearest.y, a->patch.w[1]);
    w = shcd_unit(shcd_mul_add(w, a->nearest.z, a->patch.w[2]));
    s->out->n_evaluations++;
    s->out->time = a->time;
    s->out->upper_m = core_distance(s, shcdi_view_point(s->view, w), a->time) -
                      s->motion->radius_m + (a->time - path->from) * path->growth_m + path->slack_m;
}

static void bound(search *s, const shcdi_view_leaf *leaf, swept *a) {
    a->deviation =
        shcdi_patch_deviation(a->patch.w[0], a->patch.w[1], a->patch.w[2], leaf->m1, leaf->m2);
    a->time = triangle_time(s, a->patch.x, a->deviation, a->time, STEPS_MAX, &a->nearest);
    s->out->n_patches++;
}

/* Pushes the four parts of a patch, the earliest last. */
static size_t split(search *s, const shcdi_view_leaf *leaf, const swept *a, swept *stack,
                    size_t n) {
    shcdi_image child[4];
    shcdi_image_split(&a->patch, child);
    for (int i = 0; i < 3; i++) {
        child[3].x[i] = shcdi_view_point(s->view, child[3].w[i]);
        s->out->n_evaluations++;
        try_point(s, child[3].x[i]);
    }
    shcdi_image_complete(&a->patch, child);
    const size_t base = n;
    for (int k = 0; k < 4; k++) {
        swept part = *a;
        part.level++;
        part.patch = child[k];
        bound(s, leaf, &part);
        if (!(part.time < s->out->time)) {
            continue;
        }
        size_t at = n++;
        for (; at > base && stack[at - 1].time < part.time; at--) {
            stack[at] = stack[at - 1];
        }
        stack[at] = part;
    }
    return n;
}

static void sweep_leaf(search *s, size_t index) {
    shcdi_view_leaf leaf;
    swept stack[3 * LEVELS_MAX + 8];
    shcdi_view_leaf_at(s->view, index, &leaf);
    s->out->n_patches++;
    memcpy(stack[0].patch.w, leaf.w, sizeof leaf.w);
    memcpy(stack[0].patch.x, leaf.x, sizeof leaf.x);
    stack[0].deviation = leaf.deviation_m;
    stack[0].level = 0;
    stack[0].time =
        triangle_time(s, leaf.x, leaf.deviation_m, s->path->from, STEPS_MAX, &stack[0].nearest);
    size_t n = stack[0].time < s->out->time ? 1 : 0;
    /* a deformed body's table may inflate its leaves: the corners are evaluated anew */
    if (n == 1 && !s->out->is_exhausted) {
        for (int i = 0; i < 3; i++) {
            stack[0].patch.x[i] = shcdi_view_point(s->view, leaf.w[i]);
            s->out->n_evaluations++;
            try_point(s, stack[0].patch.x[i]);
        }
        stack[0].time = s->path->from;
        bound(s, &leaf, &stack[0]);
    }
    while (n > 0) {
        swept top = stack[--n];
        if (!(top.time < s->out->time)) {
            continue;
        }
        if (top.deviation <= 0.125 * s->path->tolerance_m || top.level == LEVELS_MAX) {
            end_at(s, &top);
        } else if (s->out->n_evaluations >= s->evaluations_max) {
            s->out->is_exhausted = 1;
            s->out->time = top.time;
            s->out->upper_m = HUGE_VAL;
        } else {
            n = split(s, &leaf, &top, stack, n);
        }
    }
}

void shcdi_sweep_patches(const shcdi_view *view, const shcdi_sweep_path *path, shcd_vec3 start,
                         uint32_t evaluations_max, shcdi_sweep_free *out) {
    const shcdi_motion *motion = path->motion;
    search s = {view,           path, motion, out, motion->radius_m + path->keep_m + path->slack_m,
                evaluations_max};
    memset(out, 0, sizeof *out);
    out->time = HUGE_VAL;
    out->upper_m = HUGE_VAL;
    /* where contact is expected first: the others are then measured against its time */
    sweep_leaf(&s, shcdi_view_leaf_of(view, start));
    const size_t n_blocks = shcdi_view_block_count(view);
    for (size_t block = 0; block < n_blocks; block++) {
        shcd_vec3 centre;
        const double radius = shcdi_view_block_ball(view, block, &centre);
        out->n_patches++;
        if (!is_ball_met(&s, centre, radius)) {
            continue;
        }
        for (size_t k = 0; k < SHCDI_BLOCK_LEAVES; k++) {
            sweep_leaf(&s, SHCDI_BLOCK_LEAVES * block + k);
        }
    }
}
