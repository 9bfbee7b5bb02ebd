/* SPDX-License-Identifier: BSD-3-Clause */
#include "passivity.h"

#include "safety.h"

#include "shcd/vec.h"

/* w(F): the most that a hand takes out of a wrench in a tick. */
static double most_taken(const passivity_limits *limits, const shcd_wrench *w) {
    return (shcd_norm(w->force_n) * limits->speed_max_m_per_s +
            shcd_norm(w->torque_n_m) * limits->turn_max_rad_per_s) *
           limits->period_s;
}

double passivity_reserve_min(const passivity_limits *limits) {
    const shcd_wrench full = {{limits->force_max_n, 0.0, 0.0}, {limits->torque_max_n_m, 0.0, 0.0}};
    return (1.0 + limits->delays) * most_taken(limits, &full);
}

void passivity_observe(const passivity_limits *limits, passivity_state *state, shcd_vec3 moved_m,
                       shcd_vec3 turned_rad, bool in_contact) {
    for (int d = 0; d <= limits->delays; d++) {
        state->balance_j[d] -= shcd_dot(state->past[d].force_n, moved_m) +
                               shcd_dot(state->past[d].torque_n_m, turned_rad);
        if (!in_contact && state->balance_j[d] > 0.0) {
            state->balance_j[d] = 0.0;
        }
    }
}

double passivity_left(const passivity_limits *limits, const passivity_state *state) {
    double least_j = state->balance_j[0];
    for (int d = 1; d <= limits->delays; d++) {
        least_j = state->balance_j[d] < least_j ? state->balance_j[d] : least_j;
    }
    return limits->reserve_j + least_j;
}

/* A hair of R stays, so that a reserve that was used up can grow again; and a debt is one only
 * beyond what rounding makes. */
#define SPENT_SHARE (1.0 - 0x1p-20)
#define DEBT_SHARE 0x1p-20

/* What the next wrench may cost: stage 2; negative: a debt. */
static double affordable(const passivity_limits *limits, const passivity_state *state) {
    double pending_j = 0.0;
    double least_j = limits->reserve_j + state->balance_j[0];
    for (int d = 1; d <= limits->delays; d++) {
        pending_j += most_taken(limits, &state->past[d - 1]);
        const double left_j = limits->reserve_j + state->balance_j[d] - pending_j;
        least_j = left_j < least_j ? left_j : least_j;
    }
    if (least_j < -DEBT_SHARE * limits->reserve_j) {
        return least_j;
    }
    return least_j > 0.0 ? SPENT_SHARE * least_j : 0.0;
}

bool passivity_is_in_debt(const passivity_limits *limits, const passivity_state *state) {
    return affordable(limits, state) < 0.0;
}

void passivity_renew(passivity_state *state) {
    for (int d = 0; d <= PASSIVITY_DELAYS_MAX; d++) {
        state->balance_j[d] = state->balance_j[d] > 0.0 ? state->balance_j[d] : 0.0;
    }
}

void passivity_jump(passivity_state *state) {
    const shcd_wrench none = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    for (int d = 0; d <= PASSIVITY_DELAYS_MAX; d++) {
        state->past[d] = none;
    }
}

/* Generalised force or velocity: the second half in units of the first, see passivity.h. */
typedef struct twin {
    shcd_vec3 line, turn;
} twin;

static double twin_dot(twin a, twin b) {
    return shcd_dot(a.line, b.line) + shcd_dot(a.turn, b.turn);
}

/* Stage 1: the coefficient that the expected balance asks for, 0 if it is good. */
static double wanted_damping(const passivity_limits *limits, double left_j, twin force, twin u) {
    const double power = twin_dot(force, u);
    const double expected_j = left_j - (power > 0.0 ? power * limits->period_s : 0.0);
    const double lack_j = 0.5 * limits->reserve_j - expected_j;
    const double square = twin_dot(u, u);
    if (!(lack_j > 0.0) || !(square > 0.0)) {
        return 0.0;
    }
    double alpha = lack_j / (square * limits->period_s);
    alpha = alpha < limits->damping_n_s_per_m ? alpha : limits->damping_n_s_per_m;
    const double longest = sqrt(twin_dot(force, force) / square); /* |alpha u| <= |F| */
    return alpha < longest ? alpha : longest;
}

static shcd_wrench control(const passivity_limits *limits, const passivity_state *state,
                           shcd_wrench wrench, shcd_vec3 velocity_m_per_s, shcd_vec3 turn_rad_per_s,
                           bool *acted) {
    const double lever_m = limits->torque_max_n_m / limits->force_max_n;
    const double afford_j = affordable(limits, state);
    const twin force = {wrench.force_n, shcd_scale(1.0 / lever_m, wrench.torque_n_m)};
    const twin u = {velocity_m_per_s, shcd_scale(lever_m, turn_rad_per_s)};
    const double alpha = wanted_damping(limits, passivity_left(limits, state), force, u);
    shcd_wrench w = wrench;
    if (afford_j < 0.0) {
        *acted = true;
        return (shcd_wrench){{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    }
    if (alpha > 0.0) {
        bool clamped;
        w.force_n =
            safety_clamp(shcd_mul_add(w.force_n, -alpha, u.line), limits->force_max_n, &clamped);
        w.torque_n_m = safety_clamp(shcd_mul_add(w.torque_n_m, -alpha * lever_m, u.turn),
                                    limits->torque_max_n_m, &clamped);
        *acted = true;
    }
    const double worst_j = most_taken(limits, &w);
    if (worst_j > afford_j) {
        w.force_n = shcd_scale(afford_j / worst_j, w.force_n);
        w.torque_n_m = shcd_scale(afford_j / worst_j, w.torque_n_m);
        *acted = true;
    }
    return w;
}

shcd_wrench passivity_apply(const passivity_limits *limits, passivity_state *state,
                            shcd_wrench wrench, shcd_vec3 velocity_m_per_s,
                            shcd_vec3 turn_rad_per_s, bool *acted) {
    const bool is_on = limits->reserve_j < HUGE_VAL;
    const bool is_some = most_taken(limits, &wrench) > 0.0;
    *acted = false;
    const shcd_wrench w =
        is_on && is_some ? control(limits, state, wrench, velocity_m_per_s, turn_rad_per_s, acted)
                         : wrench;
    for (int d = limits->delays; d > 0; d--) {
        state->past[d] = state->past[d - 1];
    }
    state->past[0] = w;
    return w;
}
