/* SPDX-License-Identifier: BSD-3-Clause */
/* Distance from a point to an ellipsoid.
 *
 * Half axes h_0 >= h_1 >= h_2, point y >= 0 (by symmetry), both over h_0; closest x_i = h_i q_i
 * with |q| = 1. Stationarity: h_i (h_i q_i - y_i) + t q_i = 0, so q_i = h_i y_i/(s + d_i),   s = t
 * + h_2^2,   d_i = (h_i - h_2)(h_i + h_2),   |q(s)| = 1, and the global minimum has the largest
 * root s >= 0, inside and outside alike (t < 0 inside). With s as the unknown nothing cancels,
 * however thin the ellipsoid.
 *
 * Root: 1/|q(s)| is increasing and concave, so Newton's method on 1/|q| = 1 from a point below the
 * root climbs to it without overshooting, and needs few steps because 1/|q| is nearly linear
 * (Reinsch 1971; More and Sorensen, Computing a trust region step, SIAM J. Sci. Stat. Comput. 4(3),
 * 1983). Each term alone is at most 1 there: s >= h_i y_i - d_i. Symmetry planes: with y_2 = 0 (of
 * equal half axes: all of them 0) the root may be s = 0, where q_2 is what |q| = 1 leaves over; the
 * closest point is not unique then, one of two or of a circle.
 *
 * Certificate, whatever led to q and s >= 0: with r_i = h_i q_i - y_i, t = s - h_2^2 and e_i = h_i
 * r_i + t q_i, every unit q + delta, |delta_i| <= 1 + |q|, has
 *     |r'|^2 - |r|^2 = sum_i [h_i^2 delta_i^2 + 2 h_i r_i delta_i]
 *                    = sum_i [(s + d_i) delta_i^2 + 2 e_i delta_i] - t (1 - |q|^2),
 * which is at least -sum_i min(e_i^2/(s + d_i), 2 (1 + |q|) |e_i|) - |t| |1 - |q|^2|: the loss of
 * stopping short is known.
 *
 * Its rounding, u = 2^-53. The numbers h, y, s, q are taken as they are; that h and y are rounded
 * moves the ellipsoid and the point, see below. d_i is right within 3 u d_i, so s + d_i within 4 u
 * of itself. e_i: h q and the difference, r, the product with h, take u (3 h_i^2 + 2 h_i y_i)
 * together; t is right within u (|t| + h_2^2) and its product with q_i, so u (2 |t| + h_2^2) q_i;
 * the sum once more. With q_i <= 1, h_2 <= h_i: below 8 u (h_i (h_i + y_i) + |t| q_i). |q| is 1
 * within 4 u: three squares summed and a root, 2.5 u, and a division; or 1 - sum at a symmetry
 * plane, 3 u. So |1 - |q|^2| <= 9 u. Products of these, and |delta_i| <= 2 + 4 u: a factor
 * 1 + 32 u.
 *
 * Rounding of positions, [h_0 or |p - c|, as it is counted]: p - c takes 1, three dot products with
 * the axes 3 sqrt(3), over h_0 1: 7.2 |p - c|. h_i over h_0: 1 h_0. r: 1 h_0 and 1 |r|, |r| <= h_0
 * + |p - c|, its norm 3 |r|, times h_0 1. That |q| is not 1: 4 h_0. Together below 12 h_0 + 13 |p -
 * c|, so that 16 u (h_0 + |p - c|) is enough; it is taken off before and after the loss is, since a
 * root comes between. The axes themselves are right within their skew, which is the caller's.
 *
 * Inside or outside is told by sum_i (y_i/h_i)^2, which is calculated within 6 u of itself, not by
 * the sign of t. */
#include "query/ellipsoid.h"

#define STEPS_MAX 128
#define U 0x1p-53
#define NOTHING 1e-150 /* of h_0^2: an h_i y_i below it counts as on the plane */
#define FAR 1e100      /* of h_0 */
/* [of max(diagonal, distance)] what the closed form leaves open even of a needle; no search of
 * rounded positions does better */
#define OPEN_MAX 1e-12

/* q at the largest root s, unit; returns s. h_i y_i = n_i, d ascending to d_2 = 0. */
static double solve(const double n[3], const double d[3], double q[3], int *n_steps) {
    double s = 0.0, free2 = 0.0;
    int is_held = 0; /* a term grows without bound as s falls to 0 */
    for (int i = 0; i < 3; i++) {
        s = shcdi_max(s, n[i] - d[i]);
        is_held = is_held || (n[i] > 0.0 && !(d[i] > 0.0));
        q[i] = 0.0;
        if (n[i] > 0.0 && d[i] > 0.0) {
            q[i] = n[i] / d[i];
            free2 += q[i] * q[i];
        }
    }
    *n_steps = 0;
    if (!is_held && free2 <= 1.0) {
        q[2] = sqrt(1.0 - free2);
        return 0.0;
    }
    for (;;) {
        double n2 = 0.0, slope = 0.0;
        for (int i = 0; i < 3; i++) {
            const double a = n[i] > 0.0 ? 1.0 / (s + d[i]) : 0.0;
            q[i] = n[i] * a;
            n2 += q[i] * q[i];
            slope += q[i] * q[i] * a;
        }
        const double length = sqrt(n2);
        const double next = s + (length - 1.0) * n2 / slope;
        if (!(length > 1.0 + 4.0 * U) || !(next > s) || *n_steps == STEPS_MAX) {
            for (int i = 0; i < 3; i++) {
                q[i] /= length;
            }
            return s;
        }
        s = next;
        ++*n_steps;
    }
}

/* The point and the ellipsoid in the ellipsoid's frame, over h_0. */
typedef struct scaled {
    double h[3], y[3], sign[3], d[3];
} scaled;

static void scale_to(const shcdi_ellipsoid *e, shcd_vec3 off, scaled *at, double n[3]) {
    const double unit = e->half_m[0];
    for (int i = 0; i < 3; i++) {
        const double c = shcd_dot(e->axis[i], off) / unit;
        at->h[i] = e->half_m[i] / unit;
        at->sign[i] = c < 0.0 ? -1.0 : 1.0;
        at->y[i] = fabs(c);
        n[i] = at->h[i] * at->y[i] > NOTHING ? at->h[i] * at->y[i] : 0.0;
    }
    for (int i = 0; i < 3; i++) {
        at->d[i] = (at->h[i] - at->h[2]) * (at->h[i] + at->h[2]);
    }
}

/* Squared distance that other points of the ellipsoid may be nearer than x(q) by, at most. */
static double loss_of(const scaled *at, const double q[3], double s, double t) {
    double loss = 9.0 * U * fabs(t);
    for (int i = 0; i < 3; i++) {
        const double h = at->h[i], y = at->y[i];
        const double k = s + at->d[i];
        const double residual =
            fabs(h * (h * q[i] - y) + t * q[i]) + 8.0 * U * (h * (h + y) + fabs(t) * q[i]);
        loss += residual < 4.0 * k ? residual * residual / k : 4.0 * residual;
    }
    return loss * (1.0 + 32.0 * U);
}

static int sign_of(const scaled *at) {
    double level = 0.0;
    for (int i = 0; i < 3; i++) {
        const double a = at->y[i] / at->h[i];
        level += a * a;
    }
    return level < 1.0 - 8.0 * U ? -1 : level > 1.0 + 8.0 * U ? 1 : 0;
}

void shcdi_ellipsoid_foot_at(const shcdi_ellipsoid *e, shcd_vec3 p, shcdi_ellipsoid_foot *foot) {
    const shcd_vec3 off = shcd_sub(p, e->centre_m);
    const double unit = e->half_m[0];
    double n[3], q[3];
    scaled at;
    scale_to(e, off, &at, n);
    const double s = solve(n, at.d, q, &foot->n_steps), t = s - at.h[2] * at.h[2];
    double r2 = 0.0;
    shcd_vec3 x = e->centre_m, normal = {0.0, 0.0, 0.0}, w = {0.0, 0.0, 0.0};
    for (int i = 0; i < 3; i++) {
        const double r = at.h[i] * q[i] - at.y[i], along = at.sign[i] * q[i];
        r2 += r * r;
        x = shcd_mul_add(x, along * e->half_m[i], e->axis[i]);
        /* times h_2, so that needles do not overflow it */
        normal = shcd_mul_add(normal, along * (at.h[2] / at.h[i]), e->axis[i]);
        w = shcd_mul_add(w, along, e->turn[i]);
    }
    const double distance = unit * sqrt(r2), slack = 16.0 * U * (shcd_norm(off) + unit);
    const double low = shcdi_max(0.0, distance - slack) / unit;
    const double low2 = low * low * (1.0 - 8.0 * U) - loss_of(&at, q, s, t);
    foot->sign = sign_of(&at);
    foot->distance_m = foot->sign < 0 || (foot->sign == 0 && t < 0.0) ? -distance : distance;
    foot->upper_m = distance + slack;
    foot->lower_m = shcdi_max(0.0, unit * sqrt(shcdi_max(0.0, low2)) - slack);
    foot->point_m = shcdi_flushed3(x);
    foot->normal = shcdi_flushed3(shcd_unit(normal));
    foot->parameter = shcdi_flushed3(shcd_unit(w));
}

const shcdi_ellipsoid *shcdi_ellipsoid_of(const shcd_model *model, const shcd_shape *shape) {
    if (model->degree != 1) {
        return NULL;
    }
    const shcdi_ellipsoid *e =
        shape != NULL ? shcdi_shape_ellipsoid(model, shape) : &model->ellipsoid;
    return shcdi_is_ellipsoid(e) ? e : NULL;
}

/* The surface lies within error_m of the ellipsoid, its parameters matched, and the point's place
 * in the ellipsoid's frame is right within skew |p - c|: the distance changes by no more than both
 * together, and where it is larger than that the point stays on its side, since it is not passed by
 * the surface on the straight way from one to the other. */
int shcdi_ellipsoid_closest(const shcd_model *model, const shcd_shape *shape, shcd_vec3 p,
                            double tolerance, shcd_proximity *out) {
    const shcdi_ellipsoid *e = shcdi_ellipsoid_of(model, shape);
    if (e == NULL) {
        return 0;
    }
    const double off = shcd_norm(shcd_sub(p, e->centre_m));
    if (!(off < FAR * e->half_m[0])) {
        return 0;
    }
    shcdi_ellipsoid_foot foot;
    shcdi_ellipsoid_foot_at(e, p, &foot);
    const double slack = (e->error_m + e->skew * off) * (1.0 + 8.0 * U);
    const double upper = foot.upper_m + slack;
    const double lower = shcdi_max(0.0, foot.lower_m - slack);
    const double yardstick = shcdi_max(model->info.diagonal_m, lower);
    const double allowed = (tolerance > 0.0 ? tolerance : 1e-9) * yardstick;
    const double open = upper - lower;
    if (!(open <= shcdi_max(allowed, OPEN_MAX * yardstick))) {
        return 0;
    }
    out->distance_m = foot.distance_m;
    out->lower_m = foot.sign < 0 ? -upper : lower;
    out->upper_m = foot.sign < 0 ? -lower : upper;
    if (!(lower > 0.0) || foot.sign == 0) {
        out->flags |= SHCD_PROXIMITY_SIGN_UNSURE;
        out->lower_m = -upper;
        out->upper_m = upper;
    }
    if (!(open <= allowed)) {
        out->flags |= SHCD_PROXIMITY_TRUNCATED;
    }
    out->point_m = foot.point_m;
    out->normal = foot.normal;
    out->parameter = foot.parameter;
    out->n_evaluations = 1; /* about as dear as one, and budgets have to see it */
    out->n_newton = (uint32_t)foot.n_steps;
    return 1;
}
