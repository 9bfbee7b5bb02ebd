/* SPDX-License-Identifier: BSD-3-Clause */
/* Passivity by observation: what a hand takes out of the scene never exceeds what it gave by more
 * than a reserve that is stated.
 *
 * Observer: W_n = -F_n . dx_n - tau_n . phi_n for the wrench that was published and held, and the
 * motion meanwhile. Poses and forces travel, though: what the daemon sees as the motion of the last
 * tick may be that during the tick before, or the one before that. So there is a balance E_d for
 * each delay of d ticks up to `delays`, with F_{n-d} in the place of F_n, and the lowest counts.
 * What is left to take is R = reserve + min E_d.
 *
 * What holds of the hand's true energy, published force times true motion, if it is d + f ticks
 * late, 0 <= f < 1, T the tick: at the start t_n of tick n the tool is at x_n = l_n + e_n, where
 * l_n lies on the line between the two positions at t_n - f T and t_n + (1 - f) T, which are what
 * ticks n + d and n + d + 1 see. So with D_m the motion that tick m sees,
 *
 *     l_{n+1} - l_n = (1 - f) D_{n+d+1} + f D_{n+d+2},
 *     taken = sum F_n . (x_{n+1} - x_n)
 *           = -(1 - f) E_d - f E_{d+1} - sum (F_n - F_{n-1}) . e_n + F_N . e_{N+1}
 *           <= reserve + sum |F_n - F_{n-1}| |e_n| + |F_N| |e_{N+1}|   for d + f <= delays,
 *
 * and at most the reserve alone if the delay is whole ticks (e = 0). The e_n are what is uneven of
 * the motion within a tick, |e_n| <= |x''| T^2/8. Rotations likewise.
 *
 * Of a loop that is later than `delays` nothing follows but that what the daemon sees, E_0, stays
 * above -reserve: no balance here contains that force with that motion. A scene states its delay
 * (`delay_s`), or has its device's. tests/stability/test_reserve.c closes the loop up to 2 ms.
 *
 * Controller, on the way out, with the motion u of the last tick as the guess for the next:
 *
 *   1. Below half of the reserve damping is added, -alpha u, as much as brings the expected R back
 *      to one half, alpha at most damping_n_s_per_m and |alpha u| at most |F|. A surface that leaks
 *      k T/2 of damping is healed by as much, and nothing else is felt.
 *   2. Whatever the hand does next, at most speed_max and turn_max: it takes no more than
 *      w(F) = |F| speed_max T + |tau| turn_max T, from this wrench and from each that is still on
 *      its way, d of them. The wrench is shortened until w(F_n) <= reserve + E_d - sum of those
 *      w(F_{n-1}) .. w(F_{n-d}) for each d. Then no E_d ever falls below -reserve: no guess is
 *      involved. (The right side falls by at most w(F_n) from one tick to the next.)
 *
 * That right side can fall below zero only by a faster motion, or if ticks were skipped while a
 * force was held. That is a debt: no force at all; the caller starts the tool softly again, with a
 * new account. A motion that no hand makes, PASSIVITY_JUMP times speed_max, is a tool that was put
 * elsewhere, and does not count.
 *
 * A wrench of zero stays zero, and without an intervention the bits stay. Rotations count with the
 * lever l = torque_max/force_max: u = (v, l omega), F = (force, torque/l), which makes the damping
 * of rotations alpha l^2.
 *
 * Energy dissipated in one contact must not hide an oscillation in the next: out of contact, where
 * nothing is stored, no balance is above zero.
 *
 * Source: B. Hannaford, J.-H. Ryu, IEEE Trans. Robot. Autom. 18(1), 1-10 (2002). Deviations: the
 * force that really was held (no trapezoid), the delays, the reserve, and stage 2. */
#ifndef SHCDD_PASSIVITY_H
#define SHCDD_PASSIVITY_H

#include "shcd/base.h"

#include <stdbool.h>
#include <stdint.h>

#define PASSIVITY_ACTED 8u /* the value of tool_force_t on the wire */
#define PASSIVITY_DELAYS_MAX 8
#define PASSIVITY_JUMP 5.0

/** All > 0, but for the delays. */
typedef struct passivity_limits {
    double reserve_j;          /**< HUGE_VAL: the controller is off */
    double damping_n_s_per_m;  /**< most that stage 1 adds */
    double speed_max_m_per_s;  /**< up to which stage 2 holds */
    double turn_max_rad_per_s; /**< likewise */
    double force_max_n;        /**< caps, as in safety_limits */
    double torque_max_n_m;
    double period_s; /**< for which a force is held */
    int delays;      /**< 0 .. PASSIVITY_DELAYS_MAX */
} passivity_limits;

/** All zero: the reserve is full, and no force was published. */
typedef struct passivity_state {
    double balance_j[PASSIVITY_DELAYS_MAX + 1]; /**< E_d */
    shcd_wrench past[PASSIVITY_DELAYS_MAX + 1]; /**< F_{n-1}, F_{n-2} ... */
} passivity_state;

/** Least reserve that lets the full wrench pass while the balances are even [J]. */
double passivity_reserve_min(const passivity_limits *limits);

/** The observer: the motion since the last tick; out of contact no credit is kept. */
void passivity_observe(const passivity_limits *limits, passivity_state *state, shcd_vec3 moved_m,
                       shcd_vec3 turned_rad, bool in_contact);

/** The tool was put elsewhere: what is on its way does no work that is seen. */
void passivity_jump(passivity_state *state);

/** A soft start has ended: debts are forgiven, credit stays. */
void passivity_renew(passivity_state *state);

/** Whether more was taken than was there; not for what rounding makes. */
bool passivity_is_in_debt(const passivity_limits *limits, const passivity_state *state);

/** R [J]. */
double passivity_left(const passivity_limits *limits, const passivity_state *state);

/** The controller. @param[in,out] state  remembers what is published
 *  @param[in]  wrench  finite, within the caps
 *  @param[in]  velocity_m_per_s, turn_rad_per_s  of the last tick
 *  @param[out] acted  whether the wrench was changed
 *  @return the wrench to publish, |force| <= force_max_n and |torque| <= torque_max_n_m up to
 *  rounding; bit for bit `wrench` unless acted. Real-time safe. */
shcd_wrench passivity_apply(const passivity_limits *limits, passivity_state *state,
                            shcd_wrench wrench, shcd_vec3 velocity_m_per_s,
                            shcd_vec3 turn_rad_per_s, bool *acted);

#endif
