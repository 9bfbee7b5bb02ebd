/* SPDX-License-Identifier: BSD-3-Clause */
/* Newton's method for the closest point, on the unit sphere with a tangent frame for each iterate.
 *
 * With r = S - p: grad f = (S_1 . r, S_2 . r), Hess f = S_a . S_b + r . S_ab. Angles as parameters
 * fail at the poles and Gauss-Newton (without r . S_ab) is only linear; near focal points the
 * Hessian is nearly singular, and indefinite beyond them, so eigenvalues are taken by their
 * absolute value and kept above a share of |S_1|^2 + |S_2|^2.
 */
#include "query/foot.h"

#define STEP_MAX 0.3
#define LINE_SEARCH_MAX 10

static void fill_derivatives(shcd_vec3 p, shcdi_foot *foot) {
    const shcdi_jet *j = &foot->jet;
    foot->r = shcd_sub(j->s, p);
    foot->f = 0.5 * shcd_dot(foot->r, foot->r);
    foot->distance = shcd_norm(foot->r);
    foot->g1 = shcd_dot(j->s1, foot->r);
    foot->g2 = shcd_dot(j->s2, foot->r);
    foot->h11 = shcd_dot(j->s1, j->s1) + shcd_dot(foot->r, j->s11);
    foot->h12 = shcd_dot(j->s1, j->s2) + shcd_dot(foot->r, j->s12);
    foot->h22 = shcd_dot(j->s2, j->s2) + shcd_dot(foot->r, j->s22);
}

static void fill_eigenvalues(shcdi_foot *foot) {
    const double mean = 0.5 * (foot->h11 + foot->h22);
    const double half = 0.5 * (foot->h11 - foot->h22);
    const double root = sqrt(half * half + foot->h12 * foot->h12);
    foot->high = mean + root;
    foot->low = mean - root;
    /* of the two forms of the eigenvector the one without cancellation */
    const double a = half >= 0.0 ? half + root : foot->h12;
    const double b = half >= 0.0 ? foot->h12 : root - half;
    const double n = sqrt(a * a + b * b);
    foot->e1 = n > 0.0 ? a / n : 1.0;
    foot->e2 = n > 0.0 ? b / n : 0.0;
}

static void fill_step(shcdi_foot *foot) {
    const shcdi_jet *j = &foot->jet;
    const double floor_value =
        SHCDI_EIGENVALUE_FLOOR * (shcd_dot(j->s1, j->s1) + shcd_dot(j->s2, j->s2)) + 1e-300;
    const double high = shcdi_max(fabs(foot->high), floor_value);
    const double low = shcdi_max(fabs(foot->low), floor_value);
    const double a = -(foot->g1 * foot->e1 + foot->g2 * foot->e2) / high;
    const double b = -(foot->g2 * foot->e1 - foot->g1 * foot->e2) / low;
    foot->step1 = a * foot->e1 - b * foot->e2;
    foot->step2 = a * foot->e2 + b * foot->e1;
    foot->step = sqrt(a * a + b * b);
    foot->is_definite = foot->low > floor_value;
}

void shcdi_foot_at(const shcdi_view *view, shcd_vec3 p, shcd_vec3 w, shcdi_foot *foot) {
    foot->w = w;
    shcdi_view_jet(view, w, &foot->jet);
    fill_derivatives(p, foot);
    fill_eigenvalues(foot);
    fill_step(foot);
}

static shcd_vec3 move(const shcdi_foot *foot, double s1, double s2) {
    return shcd_unit(shcd_mul_add(shcd_mul_add(foot->w, s1, foot->jet.t1), s2, foot->jet.t2));
}

double shcdi_foot_finish(shcdi_foot *foot, shcd_vec3 p, double m3) {
    const double s1 = foot->step1, s2 = foot->step2, d = foot->step;
    shcdi_jet *j = &foot->jet;
    const shcd_vec3 change1 = shcd_mul_add(shcd_scale(s1, j->s11), s2, j->s12);
    const shcd_vec3 change2 = shcd_mul_add(shcd_scale(s1, j->s12), s2, j->s22);
    j->s = shcd_add(j->s, shcd_mul_add(shcd_scale(s1, j->s1), s2, j->s2));
    j->s = shcd_mul_add(j->s, 0.5 * s1, change1);
    j->s = shcd_mul_add(j->s, 0.5 * s2, change2);
    j->s1 = shcd_add(j->s1, change1);
    j->s2 = shcd_add(j->s2, change2);
    /* move() turns by the arctangent of what it is given: this makes it d, up to d^5 */
    const double turn = 1.0 + d * d / 3.0;
    foot->w = move(foot, turn * s1, turn * s2);
    fill_derivatives(p, foot);
    return m3 * d * d * d / 6.0;
}

/* Whether a step h, which lowers f by `gain`, is not worth an evaluation. Bound (2) of ball.c
 * leaves 2 F h^3/3 in f, over d in the distance, d the distance that is left after the step, and
 * finishing the foot errs by m3 h^3/6: together a quarter of the tolerance. Before that the foot
 * must be near enough for (2) to reach to where (1) takes over. */
static int is_enough(const shcdi_leaf_bounds *b, const shcdi_foot *foot, double tolerance, double h,
                     double gain) {
    const double left = 2.0 * (foot->f - gain);
    const double d = shcdi_max(left > 0.0 ? sqrt(left) : 0.0, tolerance);
    const double third = 3.0 * b->product + (foot->distance + b->m1 * b->reach) * b->m3;
    const double g = sqrt(foot->g1 * foot->g1 + foot->g2 * foot->g2);
    return foot->is_definite &&
           third * (h + g / (SHCDI_BALL_SHARE * foot->low)) <= 0.7 * foot->low &&
           (third * (2.0 / 3.0) / d + b->m3 / 6.0) * h * h * h <= 0.25 * tolerance;
}

int shcdi_newton(const shcdi_view *view, shcd_vec3 p, int steps_max,
                 const shcdi_leaf_bounds *bounds, double tolerance, shcdi_foot *foot,
                 uint32_t *n_steps, uint32_t *n_evaluations) {
    const double error = view->evaluation_error_m;
    /* |S'| times a step below this moves the foot by less than S is evaluated to */
    const double m1 = view->model->m[0] + view->growth[1];
    const double still = 1e-15 + 0.5 * error / (m1 > 0.0 ? m1 : 1.0);
    for (int step = 0; step < steps_max; step++) {
        const double s1 = foot->step1, s2 = foot->step2, length = foot->step;
        if (!(length > still) ||
            (bounds != NULL &&
             is_enough(bounds, foot, tolerance, length, -0.5 * (foot->g1 * s1 + foot->g2 * s2)))) {
            return 1;
        }
        /* what rounding makes of f, through r */
        const double noise =
            foot->distance * (8.0 * error + 1e-15 * (foot->distance + shcd_norm(p)));
        const double g2 = foot->g1 * foot->g1 + foot->g2 * foot->g2;
        const int is_last = 0.5 * fabs(foot->g1 * s1 + foot->g2 * s2) <= noise;
        double t = length > STEP_MAX ? STEP_MAX / length : 1.0;
        shcdi_foot next;
        int accepted = 0;
        for (int i = 0; i < LINE_SEARCH_MAX && !accepted; i++) {
            shcdi_foot_at(view, p, move(foot, t * s1, t * s2), &next);
            ++*n_evaluations;
            /* below the noise of f the gradient tells whether the step is good: it fixes the foot
             * to twice as many digits as f does */
            accepted = next.f < foot->f || (next.f <= foot->f + noise &&
                                            next.g1 * next.g1 + next.g2 * next.g2 < 0.25 * g2);
            if (!accepted && is_last) {
                return 1;
            }
            t *= 0.35;
        }
        ++*n_steps;
        if (!accepted) {
            return 0;
        }
        *foot = next;
    }
    return 0;
}

/* min over |s| <= radius of g s + h s^2/2 */
static double parabola_lower(double g, double h, double radius) {
    const double a = fabs(g);
    if (h > 0.0 && a < h * radius) {
        return -a * a / (2.0 * h);
    }
    return -a * radius + 0.5 * h * radius * radius;
}

double shcdi_foot_lower(const shcdi_foot *foot, double radius, double loss) {
    /* Taylor along the great circle to any point of the cap; the disc |s| <= radius lies in the
     * square of the eigenvectors, over which the quadratic form separates. Where the gradient is
     * askew to them, |g| and the lowest eigenvalue say more. */
    const double gh = foot->g1 * foot->e1 + foot->g2 * foot->e2;
    const double gl = foot->g2 * foot->e1 - foot->g1 * foot->e2;
    const double square =
        parabola_lower(gh, foot->high, radius) + parabola_lower(gl, foot->low, radius);
    const double disc = parabola_lower(sqrt(gh * gh + gl * gl), foot->low, radius);
    return foot->f + shcdi_max(square, disc) - loss;
}
