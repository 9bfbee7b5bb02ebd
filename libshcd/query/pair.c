/* SPDX-License-Identifier: BSD-3-Clause */
/* Body against body: a ball by one query; else a pair by projections and Newton, a proof by branch
 * and bound, a depth where they overlap.
 *
 * Overlap is decided by points, never by numbers of pairs: a point of one surface that a query
 * proves inside the other body is an overlap. Where the distance of the surfaces is proven positive
 * each surface lies wholly inside or outside the other body, and one point of each decides which.
 */
#include "query/pair.h"

#include <string.h>

#define PROJECTIONS_MAX 4
#define ROUNDS_MAX 16
#define TOLERANCE_DEFAULT 1e-6
#define TOLERANCE_MIN 1e-8
/* of the larger diagonal: nearer surfaces are not told from touching ones */
#define APART_MIN 1e-9
#define UNIT_ERROR_MAX 1e-9

void shcdi_pair_leaf(shcdi_pair_search *s, int which, const shcdi_view_leaf *leaf,
                     shcdi_pair_patch *out) {
    for (int i = 0; i < 3; i++) {
        out->patch.w[i] = leaf->w[i];
        out->patch.x[i] = shcdi_pair_point(s, which, leaf->w[i]);
    }
    out->m1 = leaf->m1;
    out->m2 = leaf->m2;
    out->deviation = shcdi_patch_deviation(leaf->w[0], leaf->w[1], leaf->w[2], leaf->m1, leaf->m2);
}

void shcdi_pair_split(shcdi_pair_search *s, int which, const shcdi_pair_patch *a,
                      shcdi_pair_patch child[4]) {
    shcdi_image image[4];
    shcdi_image_split(&a->patch, image);
    for (int i = 0; i < 3; i++) {
        image[3].x[i] = shcdi_pair_point(s, which, image[3].w[i]);
    }
    shcdi_image_complete(&a->patch, image);
    for (int k = 0; k < 4; k++) {
        const shcd_vec3 *w = image[k].w;
        child[k].patch = image[k];
        child[k].m1 = a->m1;
        child[k].m2 = a->m2;
        child[k].deviation = shcdi_patch_deviation(w[0], w[1], w[2], a->m1, a->m2);
    }
}

/* ---- result ---- */

static void fill_pair(const shcdi_pair_search *s, const shcdi_pair_end end[2],
                      shcd_pair_proximity *out) {
    out->point_a_m = end[0].jet.s;
    out->point_b_m = end[1].jet.s;
    out->normal_a = shcd_unit(shcd_cross(end[0].jet.s1, end[0].jet.s2));
    out->normal_b = shcd_unit(shcd_cross(end[1].jet.s1, end[1].jet.s2));
    out->parameter_a = end[0].w;
    out->parameter_b = end[1].w;
    out->n_evaluations = s->n_evaluations;
    out->n_patches = s->n_patches;
    out->n_newton = s->n_newton;
}

/* No point is deeper in a body than the radius of a ball that holds it. */
static double deepest_possible(const shcdi_pair_search *s) {
    return shcdi_max(s->body[0].view.radius_m, s->body[1].view.radius_m) + s->slack;
}

/* Looks for the deepest points; 1 in *found if there is a point proven inside. */
static shcd_status fill_overlap(shcdi_pair_search *s, shcd_pair_proximity *out, int *found) {
    double deepest;
    int which = 0;
    shcd_proximity where;
    shcd_vec3 w;
    shcd_status status = shcdi_pair_depth(s, &deepest, &which, &where, &w);
    *found = deepest + s->slack < 0.0;
    if (status != SHCD_OK || !*found) {
        return status;
    }
    shcdi_pair_end end[2];
    shcdi_pair_end_at(s, which, w, &end[which]);
    shcdi_pair_end_at(s, 1 - which, where.parameter, &end[1 - which]);
    fill_pair(s, end, out);
    out->flags |= SHCD_PAIR_OVERLAP;
    out->gap_m = where.distance_m;
    out->upper_m = deepest + s->slack;
    out->lower_m = -deepest_possible(s);
    return SHCD_OK;
}

static void fill_apart(const shcdi_pair_search *s, double lower, double allowed, int is_sure,
                       shcd_pair_proximity *out) {
    fill_pair(s, s->best, out);
    out->gap_m = s->upper;
    out->upper_m = s->upper + s->slack;
    out->lower_m = is_sure ? lower : -deepest_possible(s);
    if (!is_sure) {
        out->flags |= SHCD_PROXIMITY_SIGN_UNSURE;
    }
    if (!(out->upper_m - lower <= allowed)) {
        out->flags |= SHCD_PROXIMITY_TRUNCATED;
    }
}

/* ---- search ---- */

static double ball_gap(const shcdi_pair_search *s) {
    return shcd_norm(shcd_sub(s->body[0].centre, s->body[1].centre)) - s->body[0].view.radius_m -
           s->body[1].view.radius_m - s->slack;
}

/* Projects from one surface to the other and back; 1 in *inside if a point of one is proven inside
 * the other body. */
static shcd_status project(shcdi_pair_search *s, int *inside) {
    shcd_proximity got;
    shcdi_pair_end end[2];
    *inside = 0;
    shcd_status status = shcdi_pair_query(s, 0, s->body[1].centre, SHCD_TIER_FAST, &got);
    if (status != SHCD_OK) {
        return status;
    }
    shcd_vec3 w[2] = {got.parameter, got.parameter};
    shcd_vec3 p = got.point_m;
    double before = HUGE_VAL;
    for (int i = 0; i < 2 * PROJECTIONS_MAX && !*inside; i++) {
        const int onto = i % 2 == 0 ? 1 : 0;
        status = shcdi_pair_query(s, onto, p, SHCD_TIER_FAST, &got);
        if (status != SHCD_OK) {
            return status;
        }
        w[onto] = got.parameter;
        p = got.point_m;
        *inside = got.upper_m + s->slack < 0.0;
        const double distance = fabs(got.distance_m);
        if (distance > 0.8 * before && onto == 0) {
            break;
        }
        before = distance;
    }
    shcdi_pair_end_at(s, 0, w[0], &end[0]);
    shcdi_pair_end_at(s, 1, w[1], &end[1]);
    if (*inside) {
        /* the point that is inside, for the search of the deepest one to start from */
        s->best[0] = end[0];
        s->best[1] = end[1];
        s->upper = shcd_norm(shcd_sub(end[1].jet.s, end[0].jet.s));
    } else {
        shcdi_pair_polish(s, end);
    }
    return SHCD_OK;
}

/* The proven distance of the surfaces; s->upper falls with every better pair that is met. */
static double prove(shcdi_pair_search *s, double allowed) {
    const double apart_min =
        APART_MIN * shcdi_max(s->body[0].view.diagonal_m, s->body[1].view.diagonal_m);
    for (int round = 0; round < ROUNDS_MAX; round++) {
        /* near contact the interval must not reach zero */
        s->tolerance = 0.9 * shcdi_min(allowed, 0.5 * s->upper);
        if (s->upper <= apart_min) {
            return 0.0;
        }
        shcdi_separator_make(s);
        shcdi_pair_bound(s);
        if (!s->improved) {
            return shcdi_max(0.0, shcdi_min(s->lower, s->upper) - s->slack);
        }
    }
    return 0.0;
}

/* The surfaces do not meet: -1 if one body is inside the other, +1 if neither is, 0 if not known.
 */
static shcd_status side(shcdi_pair_search *s, int *sign) {
    *sign = 1;
    for (int which = 0; which < 2; which++) {
        shcd_proximity got;
        const shcd_status status =
            shcdi_pair_query(s, 1 - which, s->best[which].jet.s, SHCD_TIER_EXACT, &got);
        if (status != SHCD_OK) {
            return status;
        }
        if (got.upper_m + s->slack < 0.0) {
            *sign = -1;
            return SHCD_OK;
        }
        *sign = got.lower_m - s->slack > 0.0 ? *sign : 0;
    }
    return SHCD_OK;
}

static shcd_status run(shcdi_pair_search *s, double allowed, shcd_pair_proximity *out) {
    int inside, found = 0, sign = 0;
    double lower = 0.0;
    const double balls = ball_gap(s);
    shcd_status status = shcdi_pair_ball(s, allowed, &lower);
    if (status == SHCD_OK && lower > 0.0 && s->upper + s->slack - lower <= allowed) {
        fill_apart(s, lower, allowed, 1, out);
        return SHCD_OK;
    }
    if (status == SHCD_OK) {
        status = project(s, &inside);
    }
    if (status != SHCD_OK) {
        return status;
    }
    lower = 0.0;
    if (!inside) {
        lower = shcdi_max(prove(s, allowed), balls);
        sign = balls > 0.0 ? 1 : 0;
        if (lower > 0.0 && sign == 0) {
            status = side(s, &sign);
        }
    }
    if (status == SHCD_OK && sign != 1) {
        s->tolerance = allowed;
        status = fill_overlap(s, out, &found);
    }
    if (status == SHCD_OK && !found) {
        fill_apart(s, shcdi_max(lower, 0.0), allowed, sign == 1, out);
    }
    return status;
}

/* ---- arguments ---- */

static void body_begin(shcdi_pair_body *body, const shcd_model *model, const shcd_shape *shape,
                       shcd_pose pose) {
    body->model = model;
    body->shape = shape;
    body->pose = pose;
    shcdi_view_of(model, shape, &body->view);
    body->centre = shcd_transform(pose, model->info.centre_m);
}

static shcd_status check_pose(shcd_pose pose) {
    const shcd_quat q = pose.orientation;
    const double n2 = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
    if (!shcd_vec3_is_finite(pose.position_m) || !shcdi_is_finite(n2) ||
        !(shcd_norm(pose.position_m) < 1e150)) {
        return SHCD_ERR_NOT_FINITE;
    }
    return fabs(n2 - 1.0) <= UNIT_ERROR_MAX ? SHCD_OK : SHCD_ERR_ARGUMENT;
}

/* A rotation to the last digit: distances must not stretch by the caller's rounding. */
static shcd_pose unit_pose(shcd_pose pose) {
    shcd_quat *q = &pose.orientation;
    const double n = sqrt(q->w * q->w + q->x * q->x + q->y * q->y + q->z * q->z);
    q->w /= n;
    q->x /= n;
    q->y /= n;
    q->z /= n;
    return pose;
}

static int options_read(const shcd_pair_options *given, shcd_pair_options *options) {
    const shcd_pair_options defaults = SHCD_PAIR_OPTIONS_INIT;
    *options = defaults;
    if (given != NULL) {
        if (given->struct_size < sizeof given->struct_size) {
            return 0;
        }
        memcpy(options, given,
               given->struct_size < sizeof *options ? given->struct_size : sizeof *options);
    }
    if (options->tolerance == 0.0) {
        options->tolerance = TOLERANCE_DEFAULT;
    }
    return options->tolerance >= TOLERANCE_MIN && shcdi_is_finite(options->tolerance);
}

shcd_status shcd_pair_closest(const shcd_model *model_a, const shcd_shape *shape_a,
                              const shcd_model *model_b, const shcd_shape *shape_b,
                              shcd_pose b_in_a, const shcd_pair_options *options,
                              shcd_pair_proximity *out) {
    shcd_pair_options read;
    if (model_a == NULL || model_b == NULL || out == NULL || !options_read(options, &read)) {
        return SHCD_ERR_ARGUMENT;
    }
    shcd_status status = check_pose(b_in_a);
    if (status != SHCD_OK) {
        return status;
    }
    shcdi_pair_search s;
    memset(&s, 0, sizeof s);
    const shcd_pose rest = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}};
    body_begin(&s.body[0], model_a, shape_a, rest);
    body_begin(&s.body[1], model_b, shape_b, unit_pose(b_in_a));
    const double diagonal = shcdi_max(s.body[0].view.diagonal_m, s.body[1].view.diagonal_m);
    const double allowed = read.tolerance * diagonal;
    s.upper = HUGE_VAL;
    s.tolerance = allowed;
    /* evaluations of both surfaces, and 64 roundings of numbers as large as the scene, the
     * separator (pair_separator.c: at most 100 diagonals away) included */
    s.slack = 2.0 * (s.body[0].view.evaluation_error_m + s.body[1].view.evaluation_error_m) +
              64.0 * 2.2e-16 *
                  (shcd_norm(s.body[0].centre) + shcd_norm(s.body[1].centre) + 100.0 * diagonal);
    s.evaluations_max =
        read.evaluations_max != 0 ? read.evaluations_max : SHCD_PAIR_EVALUATIONS_DEFAULT;
    s.patches_max = read.patches_max != 0 ? read.patches_max : SHCD_PAIR_PATCHES_DEFAULT;
    shcd_pair_proximity result;
    memset(&result, 0, sizeof result);
    status = run(&s, allowed, &result);
    if (status == SHCD_OK) {
        *out = result;
    }
    return status;
}
