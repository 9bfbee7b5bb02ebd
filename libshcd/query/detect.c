/* SPDX-License-Identifier: BSD-3-Clause */
/* Detection in stages: is the signed distance d of p at most the reach r?
 *
 * Ball. S lies in the ball (c, R): if |p - c| - R > 0 the ball separates, p is outside and d >= |p
 * - c| - R. (R covers the current shape.)
 *
 * Low degree. S_1(w) = c + A w is an ellipsoid, and |S(w) - S_1(w)| <= o for all w: o is the
 * certified offset of degree 1 plus B_0 of the displacement. So for every unit vector n and all w
 *   n . S(w) <= n . c + |A^T n| + o,
 * and g(n) = n . (p - c) - |A^T n| - o > 0 means that a plane lies between p and the whole surface:
 * p is outside, and d >= g(n). Any n gives a proof; the best one points from the
 * ellipsoid's closest point x to p. There x - c = A A^T n/v, v = |A^T n|, and p - x = e n, e its
 * distance, so n is parallel to (A A^T + v e)^-1 (p - c): from e = 0, which gives the normal where
 * the ray from c leaves the ellipsoid, v and e = n . (p - c) - v of one step give the next n. A few
 * steps, each a product with an adjugate and two roots, and the largest g counts. Higher degrees
 * have smaller offsets but no closed form: searching them costs as much as searching the body
 * (bench_stages).
 *
 * Seed. The unsigned distance is at most |p - S(w)|, and the signed one at most the unsigned one.
 *
 * Search. The exact tier, with an interval.
 *
 * Rounding: c lies within R of the ball's centre C, and |A|_F <= sqrt(4 pi) sqrt(3/(4 pi)) R (a
 * projection of S - C), so that every sum below has at most 12 terms of size |p| + |C| + 3 R, each
 * with at most 6 roundings of 2^-53. `slack` is more than that; where S is evaluated its evaluation
 * error is added.
 */
#include "shcd/accuracy.h"

#include "base/harmonics.h"
#include "model/model.h"
#include "query/view.h"

#include <string.h>

#define PLANE_STEPS 4
#define ROUNDING (256.0 * 0x1p-53) /* 12 * 6 * 3 = 216 */
/* sqrt(3/(4 pi)) and sqrt(1/(4 pi)): Y_11, Y_1,-1, Y_10 are the first times x, y, z */
#define Y1 0.48860251190291992
#define Y0 0.28209479177387814

typedef struct detection {
    const shcd_model *model;
    shcdi_view view;
    shcd_vec3 p;
    double reach_m, slack;
    shcd_detection out;
} detection;

static int ends(detection *d, int stage, int is_within) {
    d->out.stage = stage;
    d->out.is_within = is_within;
    return 1;
}

static int raise_lower(detection *d, int stage, double lower_m) {
    if (lower_m > 0.0) { /* else nothing separates */
        d->out.lower_m = shcdi_max(d->out.lower_m, lower_m);
    }
    return lower_m > d->reach_m && ends(d, stage, 0);
}

static int try_ball(detection *d) {
    const shcd_vec3 to_centre = shcd_sub(d->p, d->model->info.centre_m);
    return raise_lower(d, SHCD_STAGE_BALL, shcd_norm(to_centre) - d->view.radius_m - d->slack);
}

/* Columns of A, and c. */
static void ellipsoid_of(const shcd_model *model, shcd_vec3 *centre, shcd_vec3 axis[3]) {
    const double *c = model->coefficients;
    static const int order[3] = {1, -1, 0};
    *centre = shcd_scale(Y0, shcd_vec3_make(c[0], c[1], c[2]));
    for (int k = 0; k < 3; k++) {
        const double *a = c + 3 * SHCD_INDEX(1, order[k]);
        axis[k] = shcd_scale(Y1, shcd_vec3_make(a[0], a[1], a[2]));
    }
}

/* A multiple of (A A^T + t)^-1 q: the adjugate serves, only the direction counts. */
static shcd_vec3 solve(const shcd_vec3 axis[3], double t, shcd_vec3 q) {
    double m[6] = {t, 0.0, 0.0, t, 0.0, t}; /* xx, xy, xz, yy, yz, zz */
    for (int k = 0; k < 3; k++) {
        const shcd_vec3 a = axis[k];
        m[0] += a.x * a.x;
        m[1] += a.x * a.y;
        m[2] += a.x * a.z;
        m[3] += a.y * a.y;
        m[4] += a.y * a.z;
        m[5] += a.z * a.z;
    }
    const double xx = m[3] * m[5] - m[4] * m[4], xy = m[2] * m[4] - m[1] * m[5];
    const double xz = m[1] * m[4] - m[2] * m[3], yy = m[0] * m[5] - m[2] * m[2];
    const double yz = m[1] * m[2] - m[0] * m[4], zz = m[0] * m[3] - m[1] * m[1];
    return shcd_vec3_make(xx * q.x + xy * q.y + xz * q.z, xy * q.x + yy * q.y + yz * q.z,
                          xz * q.x + yz * q.y + zz * q.z);
}

static int try_low_degree(detection *d) {
    shcd_vec3 centre, axis[3];
    ellipsoid_of(d->model, &centre, axis);
    const double offset = d->model->enclosure[1] + d->view.growth[0] + d->slack;
    const shcd_vec3 q = shcd_sub(d->p, centre);
    double best = 0.0, t = 0.0;
    for (int step = 0; step < PLANE_STEPS && best <= d->reach_m; step++) {
        const shcd_vec3 way = solve(axis, t, q);
        const double length = shcd_norm(way);
        if (!(length > 0.0 && length < HUGE_VAL)) {
            break;
        }
        const shcd_vec3 n = shcd_scale(1.0 / length, way);
        const double a[3] = {shcd_dot(axis[0], n), shcd_dot(axis[1], n), shcd_dot(axis[2], n)};
        const double width = sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
        const double apart = shcd_dot(n, q) - width;
        best = shcdi_max(best, apart - offset);
        t = width * shcdi_max(0.0, apart);
        if (apart + width <= offset + d->reach_m) {
            break; /* p is about as near to the middle: no plane will do */
        }
    }
    return raise_lower(d, SHCD_STAGE_LOW_DEGREE, best);
}

static int try_seed(detection *d, shcd_vec3 w) {
    const double distance = shcd_norm(shcd_sub(d->p, shcdi_view_point(&d->view, w)));
    d->out.n_evaluations++;
    d->out.parameter = w;
    d->out.upper_m = distance + d->slack + d->view.evaluation_error_m;
    return d->out.upper_m <= d->reach_m && ends(d, SHCD_STAGE_SEED, 1);
}

static shcd_status search(detection *d, const shcd_shape *shape,
                          const shcd_detect_options *options) {
    shcd_query_options query = SHCD_QUERY_OPTIONS_INIT;
    shcd_proximity found;
    query.tolerance = options->tolerance;
    query.patches_max = options->patches_max;
    query.evaluations_max = options->evaluations_max;
    const shcd_status status =
        options->certificate != NULL
            ? shcd_closest_next(d->model, shape, d->p, &query, options->certificate, &found)
        : shape != NULL ? shcd_shape_closest(d->model, shape, d->p, &query, &found)
                        : shcd_closest(d->model, d->p, &query, &found);
    if (status != SHCD_OK) {
        return status;
    }
    shcd_detection *out = &d->out;
    if (out->lower_m > 0.0) { /* proven outside, whatever side the foot was seen from */
        found.distance_m = fabs(found.distance_m);
    }
    out->lower_m = shcdi_max(out->lower_m, found.lower_m);
    out->upper_m = shcdi_min(out->upper_m, found.upper_m);
    out->parameter = found.parameter;
    out->flags = found.flags;
    out->n_evaluations += found.n_evaluations;
    out->n_patches += found.n_patches;
    out->n_newton += found.n_newton;
    const int is_within = out->upper_m <= d->reach_m  ? 1
                          : out->lower_m > d->reach_m ? 0
                                                      : found.distance_m <= d->reach_m;
    (void)ends(d, SHCD_STAGE_SEARCH, is_within);
    return SHCD_OK;
}

static int read_options(const shcd_detect_options *given, shcd_detect_options *options) {
    const shcd_detect_options defaults = SHCD_DETECT_OPTIONS_INIT;
    *options = defaults;
    if (given != NULL) {
        if (given->struct_size < sizeof given->struct_size) {
            return 0;
        }
        memcpy(options, given,
               given->struct_size < sizeof *options ? given->struct_size : sizeof *options);
    }
    return options->tolerance >= 0.0 && shcdi_is_finite(options->tolerance);
}

static int is_tried(const shcd_detect_options *options, int stage) {
    return (options->skipped >> stage & 1u) == 0;
}

shcd_status shcd_detect(const shcd_model *model, const shcd_shape *shape, shcd_vec3 point,
                        double reach_m, const shcd_detect_options *options, shcd_detection *out) {
    shcd_detect_options read;
    detection d;
    if (model == NULL || out == NULL || !read_options(options, &read)) {
        return SHCD_ERR_ARGUMENT;
    }
    if (!shcd_vec3_is_finite(point) || !(shcd_norm(point) < 1e150) || !shcdi_is_finite(reach_m)) {
        return SHCD_ERR_NOT_FINITE;
    }
    if (reach_m < 0.0) {
        return SHCD_ERR_ARGUMENT;
    }
    memset(&d.out, 0, sizeof d.out);
    d.model = model;
    shcdi_view_of(model, shape, &d.view);
    d.p = point;
    d.reach_m = reach_m;
    d.out.lower_m = -HUGE_VAL;
    d.out.upper_m = HUGE_VAL;
    d.slack = ROUNDING * (shcd_norm(point) + shcd_norm(model->info.centre_m) + d.view.radius_m);
    const int has_seed = !(read.seed.x == 0.0 && read.seed.y == 0.0 && read.seed.z == 0.0);
    shcd_vec3 w = {0.0, 0.0, 0.0};
    if (has_seed && shcdi_direction(read.seed, &w) != SHCD_OK) {
        return SHCD_ERR_NOT_FINITE;
    }
    const int is_done = (is_tried(&read, SHCD_STAGE_BALL) && try_ball(&d)) ||
                        (is_tried(&read, SHCD_STAGE_LOW_DEGREE) && try_low_degree(&d)) ||
                        (has_seed && is_tried(&read, SHCD_STAGE_SEED) && try_seed(&d, w));
    const shcd_status status = is_done ? SHCD_OK : search(&d, shape, &read);
    if (status == SHCD_OK) {
        *out = d.out;
    }
    return status;
}
