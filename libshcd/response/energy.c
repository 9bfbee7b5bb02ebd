/* SPDX-License-Identifier: BSD-3-Clause */
/* The energy ledger: see shcd/energy.h for the identities and the inequality. */
#include "shcd/energy.h"

#include "shcd/vec.h"

/* asin(s)/s = 1 + s^2/6 + 3 s^4/40 + ...; the next term is 0.014 s^14, 6e-11 for half a radian,
 * s = sin(angle/2). The tick calls no libm function. */
static double arcsine_share(double s2) {
    return 1.0 +
           s2 * (1.0 / 6.0 +
                 s2 * (3.0 / 40.0 +
                       s2 * (5.0 / 112.0 + s2 * (35.0 / 1152.0 +
                                                 s2 * (63.0 / 2816.0 + s2 * (231.0 / 13312.0))))));
}

/* Rotation vector that leads from a to b, outer frame: twice the arc of the vector part of
 * b conj(a). */
static shcd_vec3 rotation_between(shcd_quat a, shcd_quat b) {
    const shcd_vec3 u = {a.x, a.y, a.z};
    const shcd_vec3 v = {b.x, b.y, b.z};
    const double w = b.w * a.w + shcd_dot(u, v);
    const shcd_vec3 s = shcd_sub(shcd_mul_add(shcd_scale(a.w, v), -b.w, u), shcd_cross(v, u));
    const double s2 = shcd_dot(s, s);
    return shcd_scale((w < 0.0 ? -2.0 : 2.0) * arcsine_share(s2 < 1.0 ? s2 : 1.0), s);
}

static double work_against(const shcd_wrench *wrench, shcd_vec3 dx_m, shcd_vec3 turn_rad) {
    return -(shcd_dot(wrench->force_n, dx_m) + shcd_dot(wrench->torque_n_m, turn_rad));
}

double shcd_ledger_move(shcd_ledger *ledger, const shcd_pose *tool_in_world, double dt_s) {
    if (ledger == NULL || tool_in_world == NULL || !(dt_s > 0.0)) {
        return 0.0;
    }
    double given_j = 0.0;
    ledger->moved_m = shcd_vec3_make(0.0, 0.0, 0.0);
    ledger->turned_rad = ledger->moved_m;
    if (ledger->is_held) {
        const shcd_vec3 dx = shcd_sub(tool_in_world->position_m, ledger->tool_in_world.position_m);
        const shcd_vec3 turn =
            rotation_between(ledger->tool_in_world.orientation, tool_in_world->orientation);
        const double swing = ledger->reach_m * shcd_norm(turn);
        const double way = shcd_norm(dx) + swing;
        const double miss =
            shcd_norm(shcd_sub(shcd_scale(1.0 / dt_s, dx), ledger->velocity_m_per_s)) +
            swing / dt_s;
        given_j = work_against(&ledger->published, dx, turn);
        ledger->output_chain_j += given_j - work_against(&ledger->model, dx, turn);
        ledger->slack_j += 0.5 * ledger->stiffness_n_per_m * way * way +
                           0.25 * ledger->damping_n_s_per_m * miss * miss * dt_s;
        ledger->moved_m = dx;
        ledger->turned_rad = turn;
    }
    ledger->given_j += given_j > 0.0 ? given_j : 0.0;
    ledger->taken_j += given_j < 0.0 ? -given_j : 0.0;
    ledger->tool_in_world = *tool_in_world;
    ledger->is_held = 1;
    ledger->n_ticks++;
    return given_j;
}

void shcd_ledger_share(const shcd_ledger *ledger, const shcd_vec3 *forces_n, size_t n,
                       double *entry_j) {
    for (size_t i = 0; i < n; i++) {
        entry_j[i] -= shcd_dot(forces_n[i], ledger->moved_m);
    }
}

shcd_status shcd_ledger_hold(shcd_ledger *ledger, const shcd_ledger_input *input) {
    if (ledger == NULL || input == NULL || !ledger->is_held) {
        return SHCD_ERR_ARGUMENT;
    }
    ledger->published = input->published;
    ledger->model = input->model;
    ledger->velocity_m_per_s = input->velocity_m_per_s;
    ledger->stiffness_n_per_m = input->stiffness_n_per_m;
    ledger->damping_n_s_per_m = input->damping_n_s_per_m;
    ledger->reach_m = input->reach_m;
    ledger->stored_j = input->stored_j;
    ledger->requery_j += input->requery_j;
    ledger->driven_j += input->driven_j;
    return SHCD_OK;
}

void shcd_ledger_lift(shcd_ledger *ledger) {
    static const shcd_wrench none = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    if (ledger != NULL) {
        ledger->forgotten_j += ledger->stored_j;
        ledger->stored_j = 0.0;
        ledger->is_held = 0;
        ledger->moved_m = ledger->turned_rad = none.force_n;
        ledger->published = ledger->model = none;
        ledger->stiffness_n_per_m = ledger->damping_n_s_per_m = ledger->reach_m = 0.0;
    }
}

double shcd_ledger_margin(const shcd_ledger *ledger) {
    return ledger->given_j - ledger->taken_j - ledger->output_chain_j + ledger->driven_j +
           ledger->slack_j - ledger->stored_j - ledger->forgotten_j;
}

double shcd_ledger_requery(double stiffness_n_per_m, double before_m, shcd_vec3 normal,
                           shcd_vec3 dx_m, double now_m) {
    const double held_m = before_m - shcd_dot(normal, dx_m);
    const double plane_m = held_m > 0.0 ? held_m : 0.0;
    return 0.5 * stiffness_n_per_m * (now_m * now_m - plane_m * plane_m);
}
