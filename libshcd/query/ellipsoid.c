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
 * Certificate: with any unit q and any t, r_i = h_i q_i - y_i and e_i = h_i r_i + t q_i, every
 * other unit q + delta has |r'|^2 - |r|^2 = sum_i [(s + d_i) delta_i^2 + 2 e_i delta_i], |delta_i|
 * <= 2, which is at least -sum_i min(e_i^2/(s + d_i), 4 |e_i|): the loss of stopping short is
 * known. */
#include "query/ellipsoid.h"

#define STEPS_MAX 128
#define SWEEPS_MAX 16
#define EPSILON 2.3e-16
#define NOTHING 1e-150 /* of h_0^2: an h_i y_i below it counts as on the plane */

/* ---- half axes ---- */

/* One-sided Jacobi: turns columns a_i, a_k against each other until they are orthogonal. Works on
 * the columns themselves, not on their products, and so keeps short half axes to full relative
 * accuracy (Hestenes 1958). 1 if they were. */
static int make_orthogonal(shcd_vec3 *a, shcd_vec3 *b, shcd_vec3 *va, shcd_vec3 *vb) {
    const double aa = shcd_dot(*a, *a), bb = shcd_dot(*b, *b), ab = shcd_dot(*a, *b);
    if (fabs(ab) <= EPSILON * sqrt(aa) * sqrt(bb)) {
        return 1;
    }
    const double zeta = (bb - aa) / (2.0 * ab);
    const double t = (zeta < 0.0 ? -1.0 : 1.0) / (fabs(zeta) + sqrt(1.0 + zeta * zeta));
    const double c = 1.0 / sqrt(1.0 + t * t), s = c * t;
    const shcd_vec3 a0 = *a, va0 = *va;
    *a = shcd_sub(shcd_scale(c, a0), shcd_scale(s, *b));
    *b = shcd_add(shcd_scale(s, a0), shcd_scale(c, *b));
    *va = shcd_sub(shcd_scale(c, va0), shcd_scale(s, *vb));
    *vb = shcd_add(shcd_scale(s, va0), shcd_scale(c, *vb));
    return 0;
}

static void order_pair(shcdi_ellipsoid *e, int i, int k) {
    if (e->half_m[i] < e->half_m[k]) {
        const double h = e->half_m[i];
        const shcd_vec3 axis = e->axis[i], turn = e->turn[i];
        e->half_m[i] = e->half_m[k];
        e->axis[i] = e->axis[k];
        e->turn[i] = e->turn[k];
        e->half_m[k] = h;
        e->axis[k] = axis;
        e->turn[k] = turn;
    }
}

int shcdi_ellipsoid_of(const shcdi_view *view, shcdi_ellipsoid *e) {
    if (view->model->degree != 1) {
        return 0;
    }
    shcd_vec3 a[3];
    for (int i = 0; i < 3; i++) {
        e->turn[i] = shcd_vec3_make(i == 0, i == 1, i == 2);
    }
    const shcd_vec3 far = shcdi_view_point(view, shcd_scale(-1.0, e->turn[0]));
    for (int i = 0; i < 3; i++) {
        a[i] = shcdi_view_point(view, e->turn[i]);
    }
    e->centre_m = shcd_scale(0.5, shcd_add(a[0], far));
    for (int i = 0; i < 3; i++) {
        a[i] = shcd_sub(a[i], e->centre_m);
    }
    if (!(shcd_dot(a[0], shcd_cross(a[1], a[2])) > 0.0)) {
        return 0;
    }
    for (int sweep = 0; sweep < SWEEPS_MAX; sweep++) {
        int done = make_orthogonal(&a[0], &a[1], &e->turn[0], &e->turn[1]);
        done &= make_orthogonal(&a[0], &a[2], &e->turn[0], &e->turn[2]);
        done &= make_orthogonal(&a[1], &a[2], &e->turn[1], &e->turn[2]);
        if (done) {
            break;
        }
    }
    for (int i = 0; i < 3; i++) {
        e->half_m[i] = shcd_norm(a[i]);
        e->axis[i] = shcd_unit(a[i]);
    }
    order_pair(e, 0, 1);
    order_pair(e, 1, 2);
    order_pair(e, 0, 1);
    /* S is evaluated to its error, four times; each rotation adds a few roundings of the columns */
    e->error_m =
        4.0 * view->evaluation_error_m + 64.0 * EPSILON * (e->half_m[0] + shcd_norm(e->centre_m));
    return e->half_m[2] > 0.0;
}

/* ---- the secular equation ---- */

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
        if (!(length > 1.0 + 2.0 * EPSILON) || !(next > s) || *n_steps == STEPS_MAX) {
            for (int i = 0; i < 3; i++) {
                q[i] /= length;
            }
            return s;
        }
        s = next;
        ++*n_steps;
    }
}

void shcdi_ellipsoid_foot_at(const shcdi_ellipsoid *e, shcd_vec3 p, shcdi_ellipsoid_foot *foot) {
    const shcd_vec3 off = shcd_sub(p, e->centre_m);
    const double unit = e->half_m[0];
    double h[3], y[3], sign[3], d[3], n[3], q[3];
    for (int i = 0; i < 3; i++) {
        const double c = shcd_dot(e->axis[i], off) / unit;
        h[i] = e->half_m[i] / unit;
        sign[i] = c < 0.0 ? -1.0 : 1.0;
        y[i] = fabs(c);
        n[i] = h[i] * y[i] > NOTHING ? h[i] * y[i] : 0.0;
        d[i] = (h[i] - e->half_m[2] / unit) * (h[i] + e->half_m[2] / unit);
    }
    const double s = solve(n, d, q, &foot->n_steps), t = s - h[2] * h[2];
    double r2 = 0.0, loss = 0.0;
    shcd_vec3 x = e->centre_m, normal = {0.0, 0.0, 0.0}, w = {0.0, 0.0, 0.0};
    for (int i = 0; i < 3; i++) {
        const double r = h[i] * q[i] - y[i];
        const double residual =
            fabs(h[i] * r + t * q[i]) + 4.0 * EPSILON * (h[i] * (h[i] + y[i]) + fabs(t) * q[i]);
        const double k = s + d[i];
        r2 += r * r;
        loss += k > 0.0 && residual < 4.0 * k ? residual * residual / k : 4.0 * residual;
        x = shcd_mul_add(x, unit * sign[i] * h[i] * q[i], e->axis[i]);
        /* times h_2, so that needles do not overflow it */
        normal = shcd_mul_add(normal, sign[i] * q[i] * (h[2] / h[i]), e->axis[i]);
        w = shcd_mul_add(w, sign[i] * q[i], e->turn[i]);
    }
    const double distance = unit * sqrt(r2);
    const double slack = 16.0 * EPSILON * (shcd_norm(off) + unit);
    foot->distance_m = t < 0.0 ? -distance : distance;
    foot->upper_m = distance + slack;
    foot->lower_m = shcdi_max(0.0, unit * sqrt(shcdi_max(0.0, r2 - loss)) - slack);
    foot->point_m = x;
    foot->normal = shcd_unit(normal);
    foot->parameter = shcd_unit(w);
}

int shcdi_ellipsoid_closest(const shcdi_view *view, shcd_vec3 p, shcd_proximity *out) {
    shcdi_ellipsoid e;
    shcdi_ellipsoid_foot foot;
    if (!shcdi_ellipsoid_of(view, &e) ||
        !(shcd_norm(shcd_sub(p, e.centre_m)) < 1e100 * e.half_m[0])) {
        return 0;
    }
    shcdi_ellipsoid_foot_at(&e, p, &foot);
    const double slack = e.error_m + 4.0 * EPSILON * (shcd_norm(p) + shcd_norm(e.centre_m));
    const double lower = shcdi_max(0.0, foot.lower_m - slack), upper = foot.upper_m + slack;
    out->distance_m = foot.distance_m;
    out->lower_m = foot.distance_m < 0.0 ? -upper : lower;
    out->upper_m = foot.distance_m < 0.0 ? -lower : upper;
    if (!(lower > 0.0)) {
        out->flags |= SHCD_PROXIMITY_SIGN_UNSURE;
        out->lower_m = -upper;
        out->upper_m = upper;
    }
    out->point_m = foot.point_m;
    out->normal = foot.normal;
    out->parameter = foot.parameter;
    out->n_evaluations = 4;
    out->n_newton = (uint32_t)foot.n_steps;
    return 1;
}
