/* SPDX-License-Identifier: BSD-3-Clause */
#include "hand.h"

#include "shcd/vec.h"

#include <assert.h>
#include <string.h>

/* exp(A) for 4 x 4, |A| of order 1 at most, by Horner's scheme of Taylor's series: no squaring,
 * which would multiply the rounding by 2 each time. */
static void exponential(double a[4][4], double e[4][4]) {
    double next[4][4];
    for (int n = 30; n >= 0; n--) { /* e = 1 + a/(n + 1) e */
        for (int i = 0; i < 4; i++) {
            for (int j = 0; j < 4; j++) {
                double sum = 0.0;
                for (int k = 0; k < 4 && n < 30; k++) {
                    sum += a[i][k] * e[k][j];
                }
                next[i][j] = (i == j ? 1.0 : 0.0) + sum / (n + 1);
            }
        }
        memcpy(e, next, sizeof next);
    }
}

void hand_begin(hand *h, const hand_parameters *p, shcd_vec3 position_m) {
    const hand blank = {.parameters = *p};
    const double s = 1.0 / (p->rate_hz * HAND_SUBSTEPS);
    const double b = p->damping_n_s_per_m + p->grip_n_s_per_m;
    double a[4][4] = {{0.0, s, 0.0, 0.0},
                      {-s * p->grip_n_per_m / p->mass_kg, -s * b / p->mass_kg, s, 0.0},
                      {0.0, 0.0, 0.0, s},
                      {0.0, 0.0, 0.0, 0.0}};
    double e[4][4];
    *h = blank;
    h->step_s = s;
    h->delay_steps = (size_t)(p->delay_s / s + 0.5);
    assert(h->delay_steps < HAND_HISTORY);
    assert(fabs((double)h->delay_steps * s - p->delay_s) < 1e-6 * s);
    exponential(a, e);
    memcpy(h->to_x, e[0], sizeof h->to_x);
    memcpy(h->to_v, e[1], sizeof h->to_v);
    h->position_m = h->target_m = position_m;
    for (size_t i = 0; i < HAND_HISTORY; i++) {
        h->history_m[i] = position_m;
    }
}

static double quantised(double x, double step) {
    return step > 0.0 ? step * round(x / step) : x;
}

shcd_vec3 hand_measured(const hand *h) {
    const size_t i = (h->n_steps + HAND_HISTORY - h->delay_steps) % HAND_HISTORY;
    const double step = h->parameters.encoder_m;
    return shcd_vec3_make(quantised(h->history_m[i].x, step), quantised(h->history_m[i].y, step),
                          quantised(h->history_m[i].z, step));
}

static shcd_vec3 propagate(const double row[4], shcd_vec3 x, shcd_vec3 v, shcd_vec3 c0,
                           shcd_vec3 c1) {
    return shcd_add(shcd_add(shcd_scale(row[0], x), shcd_scale(row[1], v)),
                    shcd_add(shcd_scale(row[2], c0), shcd_scale(row[3], c1)));
}

/* Half a substep of Coulomb friction. */
static void rub(hand *h) {
    const double v = shcd_norm(h->velocity_m_per_s);
    const double m = h->parameters.mass_kg;
    const double loss = 0.5 * h->step_s * h->parameters.coulomb_n / m;
    if (v > 0.0 && loss > 0.0) {
        const double left = v > loss ? v - loss : 0.0;
        h->velocity_m_per_s = shcd_scale(left / v, h->velocity_m_per_s);
        h->dissipated_j += 0.5 * m * (v * v - left * left);
    }
}

static void substep(hand *h, shcd_vec3 force_n, shcd_vec3 target_m) {
    const hand_parameters *p = &h->parameters;
    const shcd_vec3 rate = shcd_scale(1.0 / h->step_s, shcd_sub(target_m, h->target_m));
    const shcd_vec3 c0 = shcd_scale(
        1.0 / p->mass_kg, shcd_add(force_n, shcd_add(shcd_scale(p->grip_n_per_m, h->target_m),
                                                     shcd_scale(p->grip_n_s_per_m, rate))));
    const shcd_vec3 c1 = shcd_scale(p->grip_n_per_m / p->mass_kg, rate);
    rub(h);
    const shcd_vec3 x = h->position_m, v = h->velocity_m_per_s;
    h->position_m = propagate(h->to_x, x, v, c0, c1);
    h->velocity_m_per_s = propagate(h->to_v, x, v, c0, c1);
    /* the square of a velocity that is linear in time: exact to second order in the step */
    const shcd_vec3 w = h->velocity_m_per_s;
    h->dissipated_j +=
        p->damping_n_s_per_m * h->step_s * (shcd_dot(v, v) + shcd_dot(v, w) + shcd_dot(w, w)) / 3.0;
    rub(h);
    h->travel_m += shcd_norm(shcd_sub(h->position_m, x));
    h->target_m = target_m;
    h->n_steps++;
    h->history_m[h->n_steps % HAND_HISTORY] = h->position_m;
}

void hand_tick(hand *h, shcd_vec3 force_n, shcd_vec3 target_m) {
    const shcd_vec3 from = h->target_m;
    for (int i = 1; i <= HAND_SUBSTEPS; i++) {
        const double share = (double)i / HAND_SUBSTEPS;
        substep(h, force_n, shcd_mul_add(from, share, shcd_sub(target_m, from)));
    }
}

double hand_energy(const hand *h) {
    const shcd_vec3 stretch = shcd_sub(h->target_m, h->position_m);
    return 0.5 * h->parameters.mass_kg * shcd_dot(h->velocity_m_per_s, h->velocity_m_per_s) +
           0.5 * h->parameters.grip_n_per_m * shcd_dot(stretch, stretch);
}
