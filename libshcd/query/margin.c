/* SPDX-License-Identifier: BSD-3-Clause */
/* How far a point may move before a foot elsewhere can be nearer.
 *
 * Let S0 = S(w0) be a foot of p0, d0 = |S0 - p0|, n = (S0 - p0)/d0, y = S(w) - S0. The difference
 * of the squares is linear in the point,
 *
 *   h(p) = |S(w) - p|^2 - |S0 - p|^2 = |y|^2 + 2 y.(S0 - p),
 *
 * so where p0 has h >= 2 rho |y|, a point p within rho of it has h >= 2 (rho - |p - p0|) |y|: rho
 * is a lower bound of the distance from p0 to the plane halfway between S0 and S(w),
 *
 *   mu(w) = h(p0)/(2 |y|) = |y|/2 + d0 n.y/|y|.
 *
 * That is much more than half the difference of the distances, which is what distances alone allow:
 * near the foot |y| is small beside d0, and p carries both distances along with it. mu from below:
 *
 *   Ring. At an angle s of w0, bounds holding there, h = 2 (f - f0) >= 2 (c(s) s^2 - |g| s) with
 * the c(s) of ball.c, (1), and |y| <= m1 s. So mu >= (c(s) s - |g|)/m1, which is concave in s (the
 *   second derivative of its last term, G u^4/(4 s^3), is below F/3 as F >= 3 G u): over a ring it
 *   is least at one of its borders.
 *
 *   Leaf. S is within e of a flat triangle, |y| >= a = d(S0, triangle) - e, n.y >= b, the least
 * over the corners, less e. So mu >= a/2 + d0 min(0, b)/a. That pairs the least |y| with the least
 * n.y; better: as 2 |y| <= |y|^2/a + a, mu >= rho where (1 - rho/a) |y|^2 + 2 d0 n.y >= rho a,
 * which is: S is not in the ball about S0 - d n of squared radius rho a/(1 - rho/a) + d^2, d =
 * d0/(1 - rho/a). It is not if the triangle's distance from that centre, less e, is at least the
 * radius.
 *
 *   Far. |S - p0| >= L. As |y| <= |S - p0| + d0, mu >= (L - d0)/2, and |y| >= L - d0.
 *
 * Distances follow from h: where |y| >= M,
 *
 *   |S - p| - |S0 - p| = h/(|S - p| + |S0 - p|) >= 2 (rho - |p - p0|) M/(M + 2 |S0 - p|),
 *
 * since |S - p| <= |y| + |S0 - p| and the quotient grows with |y|. In the ring m1 s stands for |y|
 * on both sides, hence M = m1 s; and where only mu of far is known the left side is at least
 * 2 (rho - |p - p0|) by itself.
 *
 * Rounding. S is evaluated to within slack: h errs by 2 (|S - p0| + d0) slack at most, mu by
 * (1 + 2 d0/|y|) slack, and about a centre up to ten times as far away by ten times as much; twice
 * that is taken off, with |y| >= M. */
#include "query/margin.h"

#include "query/patch.h"

#define INWARD (1.0 - 1e-12)

typedef struct ring {
    shcdi_curve curve;
    double g, m1;
} ring;

static double ring_at(const ring *r, double s) {
    return (shcdi_curve_mean(&r->curve, s) * s - r->g) / r->m1;
}

/* Where the ring ends: a wide one says little of its outer border, a narrow one leaves leaves to be
 * bounded that begin a leaf's diameter, sqrt(3) circumradii, before that. What a leaf is worth is
 * only guessed here, from the curvature of f. */
static double ring_end(const ring *r, double leaf, double room) {
    static const double share[] = {1.0, 0.9, 0.8, 0.7, 0.6};
    double best = 0.0, end = room;
    for (size_t i = 0; i < sizeof share / sizeof share[0]; i++) {
        const double to = share[i] * room, guess = 0.5 * r->curve.k * (to - leaf) / r->m1;
        const double worth = guess > best ? shcdi_min(ring_at(r, to), guess) : 0.0;
        if (worth > best) {
            best = worth;
            end = to;
        }
    }
    return end;
}

/* Where W ends and the ring begins: where it is as good as at its end, or at its best. */
static double ring_begin(const ring *r, double end) {
    static const double share[] = {0.4, 0.5, 0.6, 0.7, 0.8};
    const double enough = ring_at(r, end);
    double best = 0.0, begin = share[0] * end;
    for (size_t i = 0; i < sizeof share / sizeof share[0] && best < enough; i++) {
        const double worth = ring_at(r, share[i] * end);
        if (worth > best) {
            best = worth;
            begin = share[i] * end;
        }
    }
    return begin;
}

/* Whether mu >= rho over a flat triangle and what is within `deviation` of it, |y| >= tau there or
 * not. */
static int is_clear(const shcdi_foot *foot, const shcd_vec3 x[3], double deviation, double rho,
                    double tau) {
    const double q = 1.0 - rho / tau, d = foot->distance / q;
    double b[3];
    return q > 0.1 && shcdi_triangle_distance(shcd_mul_add(foot->jet.s, -1.0 / q, foot->r), x, b) -
                              deviation >=
                          sqrt(rho * tau / q + d * d);
}

/* Of a leaf whose |S - p0| is at least `lower`, up to `enough`; *y is lowered to its |y|. */
static double leaf_margin(const shcdi_search *s, const shcdi_foot *foot, size_t leaf, double lower,
                          double enough, double *y) {
    shcd_vec3 x[3];
    double b[3], along = 0.0;
    const double deviation = shcdi_view_deviation(s->view, leaf);
    const double by_distance = 0.5 * (lower - foot->distance);
    shcdi_view_triangle(s->view, leaf, x);
    const double a = shcdi_triangle_distance(foot->jet.s, x, b) - deviation;
    *y = shcdi_min(*y, shcdi_max(a, 2.0 * by_distance));
    if (by_distance >= enough || !(a > 0.0)) {
        return by_distance;
    }
    for (int k = 0; k < 3; k++) {
        along = shcdi_min(along, shcd_dot(foot->r, shcd_sub(x[k], foot->jet.s)));
    }
    if (0.5 * a * a + along - foot->distance * deviation >= enough * a) {
        return enough;
    }
    for (double rho = enough; rho > 0.3 * enough; rho *= 0.75) {
        if (is_clear(foot, x, deviation, rho, a)) {
            return rho;
        }
    }
    return by_distance;
}

shcdi_margin shcdi_margin_outside(shcdi_search *s, const shcdi_foot *foot,
                                  const shcdi_leaf_bounds *bounds, double room, double wanted,
                                  double least, double *cap) {
    const shcdi_margin none = {0.0, 0.0};
    const ring r = {shcdi_curve_of(foot, bounds), sqrt(foot->g1 * foot->g1 + foot->g2 * foot->g2),
                    bounds->m1};
    const double end = ring_end(&r, 1.75 * s->view->index->table.angle, room);
    *cap = ring_begin(&r, end);
    shcdi_margin margin = {shcdi_min(wanted, shcdi_min(ring_at(&r, *cap), ring_at(&r, end))),
                           r.m1 * *cap};
    if (!(margin.rho_m > least)) {
        return none;
    }
    const double limit = foot->distance + 2.0 * margin.rho_m;
    shcdi_search_scan_to(s, limit);
    margin.rho_m = shcdi_min(margin.rho_m, 0.5 * (s->beyond_lower - foot->distance));
    shcdi_ball_of(foot->w, end * INWARD, &s->balls[0]);
    s->n_balls = 1;
    shcdi_survivors it;
    size_t leaf;
    double lower, unused = 0.0;
    shcdi_survivors_begin(s, &it, limit);
    while (margin.rho_m > least && s->n_patches < s->patches_max &&
           shcdi_survivors_next(s, &it, &leaf, &lower)) {
        if (!shcdi_search_in_ball(s, leaf, &unused)) {
            margin.rho_m = shcdi_min(
                margin.rho_m, leaf_margin(s, foot, leaf, lower, margin.rho_m, &margin.near_m));
            s->n_patches++;
        }
    }
    /* a leaf around S0 itself leaves no near_m, and a budget that is spent leaves leaves */
    if (!(margin.rho_m > least && margin.near_m > 0.0) || s->n_patches >= s->patches_max) {
        return none;
    }
    margin.rho_m -= 20.0 * s->slack * (1.0 + 2.0 * foot->distance / margin.near_m);
    margin.rho_m *= INWARD;
    return margin.rho_m > least ? margin : none;
}
