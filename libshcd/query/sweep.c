/* SPDX-License-Identifier: BSD-3-Clause */
/* Conservative advancement from certified gaps.
 *
 * Every point of the tool moves by at most |p_1 - p_0| + Omega rho per unit of time, every point of
 * the surface (at fixed w) by at most B_0(c_1 - c_0): their sum V bounds how fast the gap changes,
 * whichever pair of points it is attained by. A gap >= g > keep at t thus proves the gap >= keep on
 * [t - h, t + h], h = (g - keep)/V. keep is half the tolerance: an advance never lands nearer than
 * that, so the next query, narrower than the tolerance, cannot fail to see a positive gap.
 *
 * Rotation. q(t) = u/|u|, u = (1 - t) q_0 + t q_1, runs along the great arc from q_0 to q_1 of
 * angle a <= pi/2 at sin(a)/|u|^2, and |u| >= cos(a/2); a rotation turns by twice the arc of its
 * quaternion, so Omega = 2 sin(a)/cos^2(a/2) = 4 tan(a/2) = 4 |q_1 - q_0|/|q_1 + q_0|.
 *
 * The gap at a later time may be large again (the tool leaves, or slides past): a query at t + 2 h
 * then proves the stretch between from its other side. Such a query is made where the closing speed
 * seen at the last one promises it, and costs one query where the promise fails.
 *
 * Inside or outside is asked once, at the start: where the gap stays positive the tool cannot
 * change sides.
 */
#include "query/sweep.h"

#include "query/growth.h"
#include "query/tool_geometry.h"
#include "query/tool_search.h"

#include <string.h>

#define TOLERANCE_DEFAULT 1e-5
#define TOLERANCE_MIN 1e-8
#define QUERY_TOLERANCE_MAX 1e-6
/* of a quaternion's length: more is not a rotation */
#define UNIT_ERROR_MAX 1e-9
/* advances by gap/V before the patches are swept */
#define PLAIN_STEPS 3u
/* evaluations of one sweep over the patches; one that fails is not repeated for a few steps: the
 * tool may be as near to much of the surface, or the body deform faster than the tool moves */
#define PATCHES_EVALUATIONS 4096u
#define PATCHES_PAUSE 8u

typedef struct sample {
    double time, lower, upper;
    shcd_vec3 tool_point, point, normal, parameter;
    double closing; /* of the gap, as seen at the closest points */
} sample;

typedef struct sweep {
    const shcd_model *model;
    const shcd_shape *shape; /* what queries see: the caller's, or the scratch */
    shcd_shape *scratch;     /* NULL: nothing deforms */
    const double *from, *to; /* coefficients */
    double *blend;
    shcdi_motion motion;
    double growth[4]; /* B_k(c_1 - c_0) */
    double speed;     /* V */
    double tolerance, keep, slack;
    shcd_query_options query;
    shcd_certificate certificate; /* of a ball's queries */
    shcd_vec3 seed;               /* of a tool's */
    uint32_t steps_max, evaluations_max;
    uint32_t patches_from; /* no sweep over the patches before this many steps */
    shcd_sweep_result *out;
} sweep;

/* ---- the path ---- */

static shcd_quat blend_quat(shcd_quat a, shcd_quat b, double t) {
    shcd_quat q = {(1.0 - t) * a.w + t * b.w, (1.0 - t) * a.x + t * b.x, (1.0 - t) * a.y + t * b.y,
                   (1.0 - t) * a.z + t * b.z};
    const double n = sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    q.w /= n;
    q.x /= n;
    q.y /= n;
    q.z /= n;
    return q;
}

shcd_pose shcdi_motion_at(const shcdi_motion *motion, double t) {
    shcd_pose pose;
    pose.position_m = shcd_mul_add(motion->from.position_m, t, motion->velocity);
    pose.orientation = blend_quat(motion->from.orientation, motion->to.orientation, t);
    return pose;
}

/* Omega; the quaternions have the signs of the shorter turn. */
static double turning_speed(shcd_quat a, shcd_quat b) {
    const shcd_quat d = {b.w - a.w, b.x - a.x, b.y - a.y, b.z - a.z};
    const shcd_quat e = {b.w + a.w, b.x + a.x, b.y + a.y, b.z + a.z};
    const double dd = d.w * d.w + d.x * d.x + d.y * d.y + d.z * d.z;
    const double ee = e.w * e.w + e.x * e.x + e.y * e.y + e.z * e.z;
    /* both lengths are within UNIT_ERROR_MAX of 1 */
    return 4.0 * sqrt(dd / ee) * (1.0 + 8.0 * UNIT_ERROR_MAX);
}

/* Axis of the turn from a to b: the vector part of b a*. */
static shcd_vec3 turning_axis(shcd_quat a, shcd_quat b) {
    const shcd_vec3 u = {a.x, a.y, a.z}, v = {b.x, b.y, b.z};
    return shcd_unit(shcd_sub(shcd_sub(shcd_scale(a.w, v), shcd_scale(b.w, u)), shcd_cross(v, u)));
}

/* Makes the body what it is at t. */
static shcd_status deform(sweep *s, double t) {
    if (s->scratch == NULL) {
        return SHCD_OK;
    }
    const size_t n = 3 * SHCD_COUNT(shcd_model_degree(s->model));
    for (size_t i = 0; i < n; i++) {
        s->blend[i] = (1.0 - t) * s->from[i] + t * s->to[i];
    }
    return shcd_shape_set(s->model, s->scratch, s->blend, SHCD_FOLLOW_AUTO);
}

/* ---- queries ---- */

static uint32_t evaluations_left(const sweep *s) {
    const uint32_t used = s->out->n_evaluations;
    return used < s->evaluations_max ? s->evaluations_max - used : 1;
}

static shcd_status query_ball(sweep *s, shcd_vec3 centre, sample *at) {
    shcd_proximity got;
    const shcd_status status =
        shcd_closest_next(s->model, s->shape, centre, &s->query, &s->certificate, &got);
    if (status != SHCD_OK) {
        return status;
    }
    at->lower = got.lower_m - s->motion.radius_m;
    at->upper = got.upper_m - s->motion.radius_m;
    at->point = got.point_m;
    at->normal = got.normal;
    at->parameter = got.parameter;
    const shcd_vec3 to_surface = shcd_unit(shcd_sub(got.point_m, centre));
    at->tool_point = shcd_mul_add(centre, s->motion.radius_m, to_surface);
    at->closing = shcd_dot(s->motion.velocity, to_surface);
    s->out->n_evaluations += got.n_evaluations;
    s->out->n_patches += got.n_patches;
    s->out->n_newton += got.n_newton;
    return SHCD_OK;
}

/* A gap that the rest of the motion cannot use up ends the sweep, however large it is. */
static shcd_status query_tool(sweep *s, double t, shcd_pose pose, sample *at) {
    shcd_tool_proximity got;
    const double reach = (s->keep + (1.0 - t) * s->speed + s->slack) * (1.0 + 1e-9);
    const shcd_status status =
        shcdi_tool_closest_from(s->model, s->shape, s->motion.tool, pose,
                                s->out->n_queries > 1 ? &s->seed : NULL, reach, &s->query, &got);
    if (status != SHCD_OK) {
        return status;
    }
    at->lower = got.lower_m;
    at->upper = got.upper_m;
    at->point = got.point_m;
    at->normal = got.normal;
    at->parameter = got.parameter;
    at->tool_point = got.tool_point_m;
    s->seed = got.parameter;
    at->closing = shcd_dot(s->motion.velocity, shcd_unit(shcd_sub(got.point_m, got.tool_point_m)));
    s->out->n_evaluations += got.n_evaluations;
    s->out->n_patches += got.n_patches;
    s->out->n_newton += got.n_newton;
    return SHCD_OK;
}

/* The gap at t; `known` is a lower bound of it that is proven already, or -inf. */
static shcd_status take_sample(sweep *s, double t, double known, sample *at) {
    const shcd_pose pose = shcdi_motion_at(&s->motion, t);
    shcd_status status = deform(s, t);
    if (status != SHCD_OK) {
        return status;
    }
    s->query.evaluations_max = evaluations_left(s);
    s->out->n_queries++;
    status =
        s->motion.tool == NULL ? query_ball(s, pose.position_m, at) : query_tool(s, t, pose, at);
    at->time = t;
    at->lower = shcdi_max(at->lower - s->slack, known);
    at->upper += s->slack;
    return status;
}

/* ---- advancement ---- */

/* End of the stretch that a sample proves, rounded inward. */
static double proven_until(const sweep *s, const sample *at) {
    const double h = at->lower > s->keep ? (at->lower - s->keep) / s->speed : 0.0;
    return at->time + h * (1.0 - 1e-12);
}

static int is_exhausted(const sweep *s) {
    return s->out->n_steps >= s->steps_max || s->out->n_evaluations >= s->evaluations_max;
}

/* Sweeps the patches from the time of a sample on; *until becomes later if that proves more. */
static void advance_over_patches(sweep *s, const sample *at, double *until) {
    shcdi_view view;
    shcdi_sweep_free freed;
    shcdi_view_of(s->model, s->shape, &view);
    const shcdi_sweep_path path = {&s->motion,   at->time,     s->keep,
                                   s->growth[0], s->tolerance, s->slack};
    const uint32_t left = evaluations_left(s);
    shcdi_sweep_patches(&view, &path, at->parameter,
                        left < PATCHES_EVALUATIONS ? left : PATCHES_EVALUATIONS, &freed);
    s->out->n_evaluations += freed.n_evaluations;
    s->out->n_patches += freed.n_patches;
    if (!(freed.upper_m <= s->tolerance) && freed.time < HUGE_VAL) {
        s->patches_from = s->out->n_steps + PATCHES_PAUSE;
    }
    if (freed.time == HUGE_VAL) {
        *until = 1.0;
    } else {
        *until = shcdi_max(*until, freed.time);
    }
}

/* A later time than `until` from which the stretch in between may be proven backward. */
static double promising(const sweep *s, const sample *at, double until) {
    const double closing = at->closing + s->growth[0];
    if (!(closing < 0.75 * s->speed)) {
        return until;
    }
    /* the gap expected at t + h is g - h closing, which proves back to t + h - (that)/V */
    const double both = at->lower - s->keep + (until - at->time) * s->speed;
    const double h = 0.9 * both / shcdi_max(s->speed + closing, 1e-3 * s->speed);
    return shcdi_max(until, shcdi_min(1.0, at->time + h));
}

static void finish(sweep *s, const sample *at, double t, int outcome) {
    shcd_sweep_result *out = s->out;
    /* from the last query to t the gap changes by at most this, and stays at keep or more */
    const double drift = fabs(t - at->time) * s->speed * (1.0 + 1e-12);
    out->time = t;
    out->lower_m = t == at->time ? at->lower : shcdi_max(at->lower - drift, s->keep);
    out->upper_m = at->upper + drift;
    out->tool_in_body = shcdi_motion_at(&s->motion, t);
    out->tool_point_m = at->tool_point;
    out->point_m = at->point;
    out->normal = at->normal;
    out->parameter = at->parameter;
    out->outcome = outcome;
}

static shcd_status advance(sweep *s, sample at) {
    uint32_t shy = 0; /* plain steps to be made before the next promise is believed */
    for (;;) {
        if (at.upper <= s->tolerance) {
            finish(s, &at, at.time, SHCD_SWEEP_CONTACT);
            return SHCD_OK;
        }
        double until = proven_until(s, &at);
        /* an advance below the spacing of times is none: the query could not tell how far it is */
        const double least = at.time * (1.0 + 1e-15);
        if (until < 1.0 && (s->out->n_steps >= s->patches_from || !(until > least))) {
            advance_over_patches(s, &at, &until);
        }
        if (!(until < 1.0)) {
            finish(s, &at, 1.0, SHCD_SWEEP_SEPARATED);
            return SHCD_OK;
        }
        if (is_exhausted(s) || !(until > least)) {
            finish(s, &at, until, SHCD_SWEEP_TRUNCATED);
            return SHCD_OK;
        }
        s->out->n_steps++;
        sample next;
        const double later = shy == 0 ? promising(s, &at, until) : until;
        shy -= shy > 0;
        if (later > until) {
            const shcd_status status = take_sample(s, later, -HUGE_VAL, &next);
            if (status != SHCD_OK) {
                return status;
            }
            if (next.lower > s->keep && 2.0 * next.time - proven_until(s, &next) <= until) {
                at = next;
                continue;
            }
            shy = 4;
        }
        const shcd_status status = take_sample(s, until, s->keep, &next);
        if (status != SHCD_OK) {
            return status;
        }
        at = next;
    }
}

static shcd_status run(sweep *s) {
    sample at;
    const shcd_status status = take_sample(s, 0.0, -HUGE_VAL, &at);
    if (status != SHCD_OK) {
        return status;
    }
    if (!(at.lower > 0.0)) {
        finish(s, &at, 0.0, SHCD_SWEEP_OVERLAP_AT_START);
        return SHCD_OK;
    }
    return advance(s, at);
}

/* ---- arguments ---- */

size_t shcd_sweep_scratch_size(const shcd_model *model) {
    if (model == NULL) {
        return 0;
    }
    const size_t shape = (shcd_shape_size(model) + 15) / 16 * 16;
    return shape + 3 * SHCD_COUNT(shcd_model_degree(model)) * sizeof(double);
}

static shcd_status prepare_body(sweep *s, const double *coefficients_to, void *scratch) {
    s->from =
        s->shape != NULL ? shcd_shape_coefficients(s->shape) : shcd_model_coefficients(s->model);
    s->to = coefficients_to;
    if (coefficients_to == NULL) {
        return SHCD_OK;
    }
    const int degree = shcd_model_degree(s->model);
    for (size_t i = 0; i < 3 * SHCD_COUNT(degree); i++) {
        if (!shcdi_is_finite(coefficients_to[i])) {
            return SHCD_ERR_NOT_FINITE;
        }
    }
    const size_t size = shcd_shape_size(s->model);
    shcd_status status = SHCD_OK;
    if (s->shape != NULL) {
        memcpy(scratch, s->shape, size);
        s->scratch = scratch;
    } else {
        status = shcd_shape_init(s->model, scratch, size, &s->scratch);
    }
    s->blend = (double *)(void *)((unsigned char *)scratch + (size + 15) / 16 * 16);
    s->shape = s->scratch;
    shcdi_growth(degree, coefficients_to, s->from, s->growth);
    return status;
}

/* Speeds, tolerances and caps, once the path is known. */
static shcd_status prepare(sweep *s, double tolerance_m) {
    shcdi_view view;
    shcdi_view_of(s->model, s->shape, &view);
    shcdi_motion *motion = &s->motion;
    motion->velocity = shcd_sub(motion->to.position_m, motion->from.position_m);
    if (motion->tool != NULL) {
        motion->bounding_m = shcdi_tool_bounding_radius(motion->tool);
        motion->omega = turning_speed(motion->from.orientation, motion->to.orientation);
        motion->axis = turning_axis(motion->from.orientation, motion->to.orientation);
    }
    s->speed = (shcd_norm(motion->velocity) + motion->omega * motion->bounding_m + s->growth[0]) *
               (1.0 + 1e-12);
    s->tolerance = tolerance_m > 0.0 ? tolerance_m : TOLERANCE_DEFAULT * view.diagonal_m;
    s->keep = 0.5 * s->tolerance;
    /* positions on the path round by 8 2^-53 of these, blended coefficients like an evaluation */
    s->slack = 16.0 * 2.2e-16 *
                   (shcd_norm(motion->from.position_m) + shcd_norm(motion->to.position_m) +
                    motion->radius_m + motion->bounding_m) +
               4.0 * view.evaluation_error_m;
    if (!(s->tolerance >= TOLERANCE_MIN * view.diagonal_m) || !(s->tolerance > 8.0 * s->slack)) {
        return SHCD_ERR_ARGUMENT;
    }
    const shcd_query_options defaults = SHCD_QUERY_OPTIONS_INIT;
    s->query = defaults;
    /* of a point the default costs no more than a coarser one */
    if (s->motion.tool != NULL) {
        s->query.tolerance = shcdi_min(QUERY_TOLERANCE_MAX, 0.1 * s->tolerance / view.diagonal_m);
    }
    return SHCD_OK;
}

static void begin(sweep *s, const shcd_model *model, const shcd_shape *shape,
                  shcd_sweep_result *result) {
    memset(s, 0, sizeof *s);
    memset(result, 0, sizeof *result);
    s->model = model;
    s->shape = shape;
    s->out = result;
    s->motion.from.orientation.w = s->motion.to.orientation.w = 1.0;
    s->steps_max = SHCD_SWEEP_STEPS_DEFAULT;
    s->evaluations_max = SHCD_QUERY_EVALUATIONS_DEFAULT;
    s->patches_from = PLAIN_STEPS;
}

shcd_status shcdi_sweep_point(const shcd_model *model, const shcd_shape *shape, shcd_vec3 from,
                              shcd_vec3 to, double radius_m, const double *coefficients_to,
                              void *scratch, double tolerance_m, shcd_sweep_result *out) {
    sweep s;
    shcd_sweep_result result;
    begin(&s, model, shape, &result);
    s.motion.radius_m = radius_m;
    s.motion.from.position_m = from;
    s.motion.to.position_m = to;
    shcd_status status = prepare_body(&s, coefficients_to, scratch);
    if (status == SHCD_OK) {
        status = prepare(&s, tolerance_m);
    }
    if (status == SHCD_OK) {
        status = run(&s);
    }
    if (status == SHCD_OK) {
        *out = result;
    }
    return status;
}

static shcd_status check_pose(shcd_pose pose) {
    const shcd_quat q = pose.orientation;
    const double n2 = q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z;
    if (!shcd_vec3_is_finite(pose.position_m) || !shcdi_is_finite(n2)) {
        return SHCD_ERR_NOT_FINITE;
    }
    return fabs(n2 - 1.0) <= UNIT_ERROR_MAX ? SHCD_OK : SHCD_ERR_ARGUMENT;
}

static shcd_status read_def(const shcd_sweep_def *given, shcd_sweep_def *def) {
    const shcd_sweep_def defaults = SHCD_SWEEP_DEF_INIT;
    *def = defaults;
    memcpy(def, given, given->struct_size < sizeof *def ? given->struct_size : sizeof *def);
    if (!shcdi_is_finite(def->radius_m) || !shcdi_is_finite(def->tolerance_m)) {
        return SHCD_ERR_NOT_FINITE;
    }
    if (def->radius_m < 0.0 || def->tolerance_m < 0.0) {
        return SHCD_ERR_ARGUMENT;
    }
    if (def->tool != NULL && shcdi_tool_kind(def->tool) == SHCD_TOOL_SHELL) {
        return SHCD_ERR_UNSUPPORTED;
    }
    const shcd_status status = check_pose(def->from);
    return status != SHCD_OK ? status : check_pose(def->to);
}

/* The shorter turn; points and spheres do not turn, and go by the query of a point. */
static void take_path(sweep *s, const shcd_sweep_def *def) {
    const shcd_quat a = def->from.orientation, b = def->to.orientation;
    const double sign = a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z < 0.0 ? -1.0 : 1.0;
    const shcd_quat near = {sign * b.w, sign * b.x, sign * b.y, sign * b.z};
    s->motion.from = def->from;
    s->motion.to = def->to;
    s->motion.to.orientation = near;
    s->motion.tool = def->tool;
    s->motion.radius_m = def->radius_m;
    if (def->tool != NULL) {
        s->motion.radius_m = shcdi_tool_radius(def->tool);
        s->motion.tool = shcdi_tool_kind(def->tool) <= SHCD_TOOL_SPHERE ? NULL : def->tool;
    }
}

shcd_status shcd_sweep(const shcd_model *model, const shcd_sweep_def *motion, void *scratch,
                       size_t scratch_size, shcd_sweep_result *out) {
    shcd_sweep_def def;
    if (model == NULL || motion == NULL || out == NULL ||
        motion->struct_size < sizeof motion->struct_size) {
        return SHCD_ERR_ARGUMENT;
    }
    shcd_status status = read_def(motion, &def);
    if (status != SHCD_OK) {
        return status;
    }
    if (def.coefficients_to != NULL &&
        (scratch == NULL || scratch_size < shcd_sweep_scratch_size(model) ||
         (uintptr_t)scratch % 16 != 0)) {
        return SHCD_ERR_ARGUMENT;
    }
    sweep s;
    shcd_sweep_result result;
    begin(&s, model, def.shape, &result);
    take_path(&s, &def);
    s.steps_max = def.steps_max != 0 ? def.steps_max : s.steps_max;
    s.evaluations_max = def.evaluations_max != 0 ? def.evaluations_max : s.evaluations_max;
    status = prepare_body(&s, def.coefficients_to, scratch);
    if (status == SHCD_OK) {
        status = prepare(&s, def.tolerance_m);
    }
    if (status == SHCD_OK) {
        status = run(&s);
    }
    if (status == SHCD_OK) {
        *out = result;
    }
    return status;
}
