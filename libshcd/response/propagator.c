/* SPDX-License-Identifier: BSD-3-Clause */
/* The exact motion of a damped oscillator over a tick, and what a held force adds:
 *
 *   q'' + 2 zeta w q' + w^2 q = f,  w_d = w sqrt(1 - zeta^2)  (w_h = w sqrt(zeta^2 - 1) above 1),
 *   q(T)  = (C + zeta w S) q + S q' + c f,     C = e^(-zeta w T) cos w_d T,
 *   q'(T) = -w^2 S q + (C - zeta w S) q' + S f,  S = e^(-zeta w T) sin(w_d T)/w_d,
 *   c = (1 - C - zeta w S)/w^2.
 *
 * For small w T the difference in c cancels: there c and S come from the power series of the
 * solution, a_2 = 1/2, (n + 1)(n + 2) a_{n+2} = -2 zeta w (n + 1) a_{n+1} - w^2 a_n. */
#include "response/soft.h"

#include "base/elementary.h"

/* Above it the pair (w_d q, q' + zeta w q) degenerates, w_d -> 0. */
#define TURN_RATIO_MAX 0.9
/* The series' terms fall by (w T)/n and 2 zeta w T/n: 40 of them reach 1e-17 for both below 4. */
#define SERIES_MAX 0.5
#define SERIES_TERMS 40

void shcdi_mode_set(double omega_rad_per_s, double damping_ratio, shcdi_mode *mode) {
    mode->omega_rad_per_s = omega_rad_per_s;
    mode->decay_per_s = damping_ratio * omega_rad_per_s;
    mode->is_turn = damping_ratio <= TURN_RATIO_MAX && omega_rad_per_s > 0.0;
    mode->q_of_x = 1.0;
    if (mode->is_turn) {
        mode->q_of_x =
            1.0 / (omega_rad_per_s * sqrt((1.0 - damping_ratio) * (1.0 + damping_ratio)));
    }
}

/* C and S. */
static void free_motion(const shcdi_mode *mode, double dt_s, double *c, double *s) {
    const double w = mode->omega_rad_per_s, b = mode->decay_per_s;
    const double square = (w - b) * (w + b); /* w_d^2, or -w_h^2 */
    if (square >= 0.0) {
        const double w_d = sqrt(square), x = w_d * dt_s, decay = shcdi_exp(-b * dt_s);
        double sine, cosine;
        shcdi_sincos(x, &sine, &cosine);
        *c = decay * cosine;
        *s = decay * (x > 1e-4 ? sine / w_d : dt_s * (1.0 - x * x / 6.0));
        return;
    }
    /* e^(r1 T), e^(r2 T), r1 = -b + w_h without cancellation; their difference by e^x - 1 */
    const double w_h = sqrt(-square), gap = 2.0 * w_h * dt_s;
    const double slow = shcdi_exp(-(w * w / (b + w_h)) * dt_s);
    const double fast = shcdi_exp(-(b + w_h) * dt_s);
    *c = 0.5 * (slow + fast);
    *s = gap <= 1.0 ? fast * dt_s * shcdi_expm1_ratio(gap) : (slow - fast) / (2.0 * w_h);
}

static void forced_series(const shcdi_mode *mode, double dt_s, double *q, double *v) {
    const double w2 = mode->omega_rad_per_s * mode->omega_rad_per_s * dt_s * dt_s;
    const double b2 = 2.0 * mode->decay_per_s * dt_s;
    double before = 0.0, term = 0.5; /* a_n T^n/T^2 */
    *q = 0.5;
    *v = 1.0;
    for (int n = 1; n <= SERIES_TERMS; n++) {
        const double next = (-b2 * (n + 1) * term - w2 * before) / ((n + 1.0) * (n + 2.0));
        before = term;
        term = next;
        *q += term;
        *v += (n + 2) * term;
    }
    *q *= dt_s * dt_s;
    *v *= dt_s;
}

void shcdi_propagator_set(const shcdi_mode *mode, double dt_s, shcdi_propagator *p) {
    const double w = mode->omega_rad_per_s, b = mode->decay_per_s;
    double c, s, forced_v;
    free_motion(mode, dt_s, &c, &s);
    if (w * dt_s < SERIES_MAX && b * dt_s < SERIES_MAX) {
        forced_series(mode, dt_s, &p->forced_q_s2, &forced_v);
    } else {
        p->forced_q_s2 = (1.0 - (c + b * s)) / (w * w);
        forced_v = s;
    }
    p->matrix[0] = c + b * s;
    p->matrix[1] = s;
    p->matrix[2] = -w * w * s;
    p->matrix[3] = c - b * s;
    p->decay = shcdi_exp(-b * dt_s);
    p->n_quarters = 0;
    p->reserved0 = 0;
    p->lift = p->sine = 0.0;
    p->forced_x = p->forced_q_s2;
    p->forced_y = forced_v;
    if (mode->is_turn) {
        int n;
        const double rest = shcdi_quarters(dt_s / mode->q_of_x, &n);
        p->n_quarters = n;
        p->lift = shcdi_half_tangent(rest);
        p->sine = shcdi_sine_small(rest);
        p->forced_x = p->forced_q_s2 / mode->q_of_x;
        p->forced_y = forced_v + b * p->forced_q_s2;
    }
}

void shcdi_propagate(const shcdi_mode *mode, const shcdi_propagator *p, double *x, double *y) {
    double a = *x, b = *y;
    if (!mode->is_turn) {
        *x = p->matrix[0] * a + p->matrix[1] * b;
        *y = p->matrix[2] * a + p->matrix[3] * b;
        return;
    }
    if ((p->n_quarters & 1) != 0) {
        const double t = a;
        a = b;
        b = -t;
    }
    if ((p->n_quarters & 2) != 0) {
        a = -a;
        b = -b;
    }
    a += p->lift * b;
    b -= p->sine * a;
    a += p->lift * b;
    *x = p->decay * a;
    *y = p->decay * b;
}
