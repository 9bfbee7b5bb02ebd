/* SPDX-License-Identifier: BSD-3-Clause */
/* Balls around feet over which f is known. f(w) = |S(w) - p|^2/2; s is the angle along a great
 * circle from an evaluated w0 with gradient g, Hessian H, r = S - p, |r| = d.
 *
 * Lower bounds of f''(s) along every great circle from w0, while f''' = 3 S'.S'' + r.S''':
 *
 *   A: the lowest eigenvalue k of H, from which f''' takes off. |r.S'''| <= (d + m1 s) m3. And
 *      |S'.S''| is at most m12 anywhere, tau at w0; since (S'.S'')' = |S''|^2 + S'.S''', it is
 *      no less than -(tau + m1 m3 s). So f'' >= k - F s - G s^2/2 + 3 G u min(s, u) -
 *      3 G min(s, u)^2/2 with F = 3 m12 + d m3, G = m1 m3, u = (m12 - tau)/G;
 *
 *   B: sigma^2 + the lowest eigenvalue of r.S'', less (m1 m2 + d m3) s: |S'|^2 >= sigma^2, and
 *      r.S'' changes by at most d m3 s through S'' and m1 s m2 through r;
 *
 *   C: sigma^2 - d m2, less m1 m2 s.
 *
 * A is right at the foot, B and C do not pay for the change of |S'|^2. Integrated twice, A gives
 *
 *   f(s) >= f0 - |g| s + c(s) s^2,
 *   c(s) = k/2 - F s/6 - G s^2/24 + (3/4) G u^2 (1 - (2/3) u/s + (u/s)^2/6),   s >= u.      (1)
 *
 * A is below k + 3 G u^2/2 - F s - G s^2/2, which meets X = B or C, k_X - F_X s, at some t; beyond,
 * X is above A by at least (F - F_X + G t) (s - t), which adds (F - F_X + G t) (s - t)^3/(6 s^2) to
 * c(s).
 *
 * All these bounds of f'' fall with s, so c does, and where c >= k/20 at some s, f >= f0 - |g| s +
 * k s^2/20 at all smaller ones: at least f0 - 5 |g|^2/k, and at least f0 from s = 20 |g|/k on.
 *
 * Near the foot the quadratic form itself is better than (1): with h = -H^-1 g the Newton step,
 * t = |s - h|, q(s) = f0 + g.h/2 + (s - h).H.(s - h)/2 and |s|^3 <= 4 |h|^3 + 4 t^3,
 *
 *   f >= q - F s^3/6 >= f0 + g.h/2 - 2 F |h|^3/3 + k t^2/2 - 2 F t^3/3                     (2)
 *
 * where the last two terms are positive for t <= 3 k/(4 F). Both together hold f from below over
 * (1)'s ball if (2) reaches to where (1) has passed f0. */
#include "query/search.h"

/* tau: S'.S'' is a cubic form of the direction (cos a, sin a), which has the frequencies 1 and 3
 * only, and no more than the sum of their amplitudes. */
static double cubic_bound(const shcdi_jet *j) {
    const shcd_vec3 mean = shcd_scale(0.5, shcd_add(j->s11, j->s22));
    const shcd_vec3 half = shcd_scale(0.5, shcd_sub(j->s11, j->s22));
    const double p1 = shcd_dot(j->s1, half), p2 = shcd_dot(j->s2, half);
    const double q1 = shcd_dot(j->s1, j->s12), q2 = shcd_dot(j->s2, j->s12);
    const double c1 = shcd_dot(j->s1, mean) + 0.5 * (p1 + q2);
    const double s1 = shcd_dot(j->s2, mean) + 0.5 * (q1 - p2);
    const double c3 = 0.5 * (p1 - q2), s3 = 0.5 * (q1 + p2);
    return (sqrt(c1 * c1 + s1 * s1) + sqrt(c3 * c3 + s3 * s3)) * (1.0 + 1e-14);
}

shcdi_curve shcdi_curve_of(const shcdi_foot *foot, const shcdi_leaf_bounds *b) {
    shcdi_curve a = {foot->low, 3.0 * b->product + foot->distance * b->m3, b->m1 * b->m3, 0.0};
    const double spare = b->product - cubic_bound(&foot->jet);
    a.until = a.growth > 0.0 && spare > 0.0 ? spare / a.growth : 0.0;
    return a;
}

double shcdi_curve_mean(const shcdi_curve *a, double s) {
    const double u = a->until, v = u / s;
    /* before u, the integral ends at s */
    const double gain =
        s < u ? (2.0 / 3.0 * u - s / 6.0) * s : u * u * (1.0 - (2.0 / 3.0 - v / 6.0) * v);
    return 0.5 * a->k - (a->first / 6.0 + a->growth * s / 24.0) * s + 0.75 * a->growth * gain;
}

/* Largest of a few radii up to `room` for which (1) holds with its share. */
static double reach_of(double room, const shcdi_curve *a, double k_x, double f_x) {
    static const double trial[] = {1.0, 0.85, 0.72, 0.61, 0.52, 0.44, 0.37, 0.31, 0.26};
    const double share = SHCDI_BALL_SHARE * a->k, spare = 0.5 * a->k - share, line = a->first / 6.0;
    const double fall = a->k + 1.5 * a->growth * a->until * a->until - k_x, slope = a->first - f_x;
    const double root = sqrt(shcdi_max(0.0, slope * slope + 2.0 * a->growth * fall));
    const double turn = !(fall > 0.0)        ? 0.0
                        : slope + root > 0.0 ? 2.0 * fall / (slope + root)
                                             : room;
    const double bend = shcdi_max(0.0, slope + a->growth * turn);
    /* with k, F and G alone */
    const double least =
        2.0 * spare / (line + sqrt(line * line + a->growth * spare / 6.0) + 1e-300);
    for (size_t i = 0; i < sizeof trial / sizeof trial[0] && trial[i] * room > least; i++) {
        const double s = trial[i] * room, e = shcdi_max(0.0, s - turn);
        if (shcdi_curve_mean(a, s) + bend * e * e * e / (6.0 * s * s) >= share) {
            return s;
        }
    }
    return shcdi_min(room, least);
}

/* Radius of the ball: with A and the better of B and C; 0 if f is not convex at the foot. */
static double radius_of(const shcdi_foot *foot, const shcdi_leaf_bounds *b, double room) {
    const double d = foot->distance, least2 = b->sigma * b->sigma;
    if (!(foot->low > 0.0)) {
        return 0.0;
    }
    const shcdi_curve a = shcdi_curve_of(foot, b);
    if (shcdi_curve_mean(&a, room) >= SHCDI_BALL_SHARE * a.k) {
        return room;
    }
    const double a11 = shcd_dot(foot->r, foot->jet.s11), a12 = shcd_dot(foot->r, foot->jet.s12),
                 a22 = shcd_dot(foot->r, foot->jet.s22);
    const double half = 0.5 * (a11 - a22);
    const double bend = 0.5 * (a11 + a22) - sqrt(half * half + a12 * a12);
    const double with_b = reach_of(room, &a, least2 + bend, b->m1 * b->m2 + d * b->m3);
    const double with_c = reach_of(room, &a, least2 - d * b->m2, b->m1 * b->m2);
    return shcdi_max(with_b, with_c) * (1.0 - 1e-12);
}

double shcdi_ball_about(const shcdi_foot *foot, const shcdi_leaf_bounds *bounds, double room,
                        shcdi_ball_bound *ball) {
    const double radius = room > 0.0 ? radius_of(foot, bounds, room) : 0.0;
    if (!(radius > 0.0)) {
        return 0.0;
    }
    const double g2 = foot->g1 * foot->g1 + foot->g2 * foot->g2, g = sqrt(g2);
    double f = foot->f - g2 / (4.0 * SHCDI_BALL_SHARE * foot->low);
    if (foot->is_definite) {
        const double third = shcdi_third_bound(bounds, foot->distance, room), h = foot->step;
        const double quadratic = foot->f + 0.5 * (foot->g1 * foot->step1 + foot->g2 * foot->step2) -
                                 third * h * h * h * (2.0 / 3.0);
        /* t <= 3 k/(4 F) covers s <= 3 k/(4 F) - h */
        const double passed = g / (SHCDI_BALL_SHARE * foot->low);
        if (0.75 * foot->low >= third * (h + shcdi_min(radius, passed))) {
            f = shcdi_max(f, quadratic);
        }
    }
    shcdi_ball_of(foot->w, radius, ball);
    ball->lower = sqrt(shcdi_max(0.0, 2.0 * f));
    return radius;
}
