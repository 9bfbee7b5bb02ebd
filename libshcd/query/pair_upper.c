/* SPDX-License-Identifier: BSD-3-Clause */
/* Newton's method for the closest pair of two surfaces.
 *
 * F = |r|^2/2, r = S_b - S_a, in the four variables (u_a, u_b) of the two tangent frames: gradient
 * (-S_a'.r, S_b'.r), Hessian [S_a'.S_a' - r.S_a'', -S_a'.S_b'; ., S_b'.S_b' + r.S_b'']. Each body's
 * variables are scaled by its |S'|, so that a ring of 1 cm and an organ of 30 cm weigh the same.
 * The Hessian is indefinite away from the pair and nearly singular where the surfaces are close: a
 * multiple of the unit matrix is added until Cholesky's factorisation succeeds and F falls.
 */
#include "query/pair.h"

#define STEPS_MAX 30
#define TRIALS_MAX 12
#define STEP_MAX 0.4 /* rad */

typedef struct model4 {
    double g[4], h[4][4];
    double scale[2]; /* |S'| of each body */
} model4;

static void turn(shcd_quat q, shcd_vec3 *v) {
    *v = shcd_rotate(q, *v);
}

void shcdi_pair_end_at(shcdi_pair_search *s, int which, shcd_vec3 w, shcdi_pair_end *end) {
    const shcdi_pair_body *body = &s->body[which];
    const shcd_quat q = body->pose.orientation;
    end->w = w;
    s->n_evaluations++;
    shcdi_view_jet(&body->view, w, &end->jet);
    end->jet.s = shcd_transform(body->pose, end->jet.s);
    turn(q, &end->jet.s1);
    turn(q, &end->jet.s2);
    turn(q, &end->jet.s11);
    turn(q, &end->jet.s12);
    turn(q, &end->jet.s22);
}

static double value(const shcdi_pair_end end[2]) {
    const shcd_vec3 r = shcd_sub(end[1].jet.s, end[0].jet.s);
    return 0.5 * shcd_dot(r, r);
}

static void expand(const shcdi_pair_end end[2], model4 *m) {
    const shcd_vec3 r = shcd_sub(end[1].jet.s, end[0].jet.s);
    for (int which = 0; which < 2; which++) {
        const shcdi_jet *j = &end[which].jet;
        const double sign = which == 0 ? -1.0 : 1.0;
        const int i = 2 * which;
        const double size = sqrt(shcd_dot(j->s1, j->s1) + shcd_dot(j->s2, j->s2));
        m->scale[which] = size > 0.0 ? size : 1.0;
        m->g[i] = sign * shcd_dot(j->s1, r);
        m->g[i + 1] = sign * shcd_dot(j->s2, r);
        m->h[i][i] = shcd_dot(j->s1, j->s1) + sign * shcd_dot(r, j->s11);
        m->h[i][i + 1] = m->h[i + 1][i] = shcd_dot(j->s1, j->s2) + sign * shcd_dot(r, j->s12);
        m->h[i + 1][i + 1] = shcd_dot(j->s2, j->s2) + sign * shcd_dot(r, j->s22);
    }
    const shcd_vec3 a[2] = {end[0].jet.s1, end[0].jet.s2}, b[2] = {end[1].jet.s1, end[1].jet.s2};
    for (int i = 0; i < 2; i++) {
        for (int k = 0; k < 2; k++) {
            m->h[i][2 + k] = m->h[2 + k][i] = -shcd_dot(a[i], b[k]);
        }
    }
    for (int i = 0; i < 4; i++) {
        m->g[i] /= m->scale[i / 2];
        for (int k = 0; k < 4; k++) {
            m->h[i][k] /= m->scale[i / 2] * m->scale[k / 2];
        }
    }
}

/* Solves (H + shift) x = -g; 0 if H + shift is not positive definite. */
static int solve(const model4 *m, double shift, double x[4]) {
    double l[4][4], y[4];
    for (int i = 0; i < 4; i++) {
        for (int k = 0; k <= i; k++) {
            double sum = m->h[i][k] + (i == k ? shift : 0.0);
            for (int n = 0; n < k; n++) {
                sum -= l[i][n] * l[k][n];
            }
            if (i == k) {
                if (!(sum > 1e-14)) {
                    return 0;
                }
                l[i][i] = sqrt(sum);
            } else {
                l[i][k] = sum / l[k][k];
            }
        }
    }
    for (int i = 0; i < 4; i++) {
        double sum = -m->g[i];
        for (int n = 0; n < i; n++) {
            sum -= l[i][n] * y[n];
        }
        y[i] = sum / l[i][i];
    }
    for (int i = 3; i >= 0; i--) {
        double sum = y[i];
        for (int n = i + 1; n < 4; n++) {
            sum -= l[n][i] * x[n];
        }
        x[i] = sum / l[i][i];
    }
    return 1;
}

static shcd_vec3 moved(const shcdi_pair_end *end, double u1, double u2) {
    return shcd_unit(shcd_mul_add(shcd_mul_add(end->w, u1, end->jet.t1), u2, end->jet.t2));
}

/* One step of the method; 0 if nothing better was found. */
static int step(shcdi_pair_search *s, shcdi_pair_end end[2], double *f, double *shift) {
    model4 m;
    expand(end, &m);
    for (int trial = 0; trial < TRIALS_MAX && s->n_evaluations < s->evaluations_max; trial++) {
        double x[4];
        if (!solve(&m, *shift, x)) {
            *shift = shcdi_max(10.0 * *shift, 1e-8);
            continue;
        }
        double u[4], longest = 0.0;
        for (int i = 0; i < 4; i++) {
            u[i] = x[i] / m.scale[i / 2];
            longest = shcdi_max(longest, fabs(u[i]));
        }
        const double t = longest > STEP_MAX ? STEP_MAX / longest : 1.0;
        if (!(longest > 1e-15)) {
            return 0;
        }
        shcdi_pair_end next[2];
        for (int which = 0; which < 2; which++) {
            const shcd_vec3 w = moved(&end[which], t * u[2 * which], t * u[2 * which + 1]);
            shcdi_pair_end_at(s, which, w, &next[which]);
        }
        const double fell = value(next);
        if (fell < *f) {
            *f = fell;
            end[0] = next[0];
            end[1] = next[1];
            *shift = *shift < 1e-7 ? 0.0 : 0.1 * *shift;
            return 1;
        }
        *shift = shcdi_max(10.0 * *shift, 1e-8);
    }
    return 0;
}

void shcdi_pair_polish(shcdi_pair_search *s, shcdi_pair_end end[2]) {
    double f = value(end), shift = 0.0;
    for (int i = 0; i < STEPS_MAX; i++) {
        const double before = f;
        if (!step(s, end, &f, &shift)) {
            break;
        }
        s->n_newton++;
        /* the distance falls by less than a ten-thousandth of what is asked for */
        const double distance = sqrt(2.0 * f);
        if (before - f < 1e-4 * s->tolerance * distance || distance < 1e-3 * s->tolerance) {
            break;
        }
    }
    const double distance = sqrt(2.0 * f);
    if (distance < s->upper) {
        s->upper = distance;
        s->best[0] = end[0];
        s->best[1] = end[1];
    }
}
