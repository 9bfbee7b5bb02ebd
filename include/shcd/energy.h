/* SPDX-License-Identifier: BSD-3-Clause */
/** @file
 *  The energy ledger: what a hand gives to the bodies and takes from them, and by which effect.
 *
 *  A force F_n that is published at tick n is held until the next one, while the tool moves by
 *  dx_n = x_{n+1} - x_n. Whatever the path between, the hand then gives exactly
 *
 *      W_n = -(F_n . dx_n + tau_n . phi_n)      (phi_n: the rotation vector)
 *
 *  (a trapezoid of F_n and F_{n+1} is not what the hand does). The ledger books W_n for the
 *  published force, for the model's, for each effect's share, and the difference between the first
 *  two as what the output chain did.
 *
 *  **A held spring yields energy.** For a contact whose foot S_n is the nearest point of the
 *  surface (of the convex or concave body, at a focal point, anywhere) let p be the tool's point,
 *  d = |p - S| its depth, U = k d^2/2 and F = k d n with d n = S - p. The nearest point of p_{n+1}
 *  is not farther than S_n:
 *
 *      U_{n+1} <= k |p_{n+1} - S_n|^2/2 = k |(p_n - S_n) + dx|^2/2 = U_n - F_n . dx + k |dx|^2/2,
 *
 *  so U_{n+1} - U_n <= W_n + k |dx|^2/2, whatever the curvature. On touching (F_n = 0) the depth
 *  is at most |dx|, on leaving U_{n+1} = 0 <= k |(p_n - S_n) + dx|^2/2: the same. A sphere of
 *  radius r about p has U = k (r - s)^2/2, s the signed distance of p. With depth D = r - s >= 0
 *  the second derivative of U along a unit vector u is k (n . u)^2 - k D u . (Hess s) u, and Hess s
 *  has the eigenvalues kappa/(1 + s kappa) of the surface's curvatures kappa (positive where
 *  convex). A convex surface only lowers it below k. Where it is concave, kappa = -1/R, the
 *  tangential part is k D/(R + D - r), which does not exceed k as long as r <= R. So the same
 *  inequality holds, if the tool fits into the hollow; where it does not, two feet compete and
 *  k has to be replaced by the force's Lipschitz constant over the tick.
 *
 *  Damping gives -f(u_n) along n, f rising, f(0) = 0, with slope at most D [N s/m], where u_n is
 *  the rate that the tick was told. With u the rate of the tick that follows, its work is
 *  f(u_n) u dt >= -D |u_n u| dt, and only if the signs differ, so >= -D (u - u_n)^2 dt/4.
 *
 *  Summed over ticks, with K_n and D_n of the force that was held:
 *
 *      given - taken - output_chain + driven + sum K_n |dx_n|^2/2 + D_n |dx_n/dt - v_n|^2 dt/4
 *          >= stored >= 0.
 *
 *  shcd_ledger_margin() is the left side minus `stored`: what has been dissipated, never negative
 *  beyond rounding.
 *
 *  Source: J. E. Colgate, G. Schenkel, J. Robot. Syst. 14(1), 37-47 (1997), for what sampling and
 *  holding yields; B. Hannaford, J.-H. Ryu, IEEE Trans. Robot. Autom. 18(1), 1-10 (2002), for the
 *  account.
 */
#ifndef SHCD_ENERGY_H
#define SHCD_ENERGY_H

#include "shcd/base.h"

#ifdef __cplusplus
extern "C" {
#endif

/** The account of one tool, in the caller's memory; all zero is a new one. Frozen layout. */
typedef struct shcd_ledger {
    double given_j;        /**< work of the hand against the published force, where positive */
    double taken_j;        /**< the same where negative, as a positive number */
    double output_chain_j; /**< taken up by what limits and ramps did to the model's force */
    double slack_j;        /**< sum of K_n |dx_n|^2/2 and of the damping's term */
    double driven_j;       /**< brought in by what drives a body, e.g. a heartbeat */
    double stored_j;       /**< held now by springs, anchors and modes */
    double requery_j;     /**< part of the changes of stored_j that asking for the foot anew gave */
    double forgotten_j;   /**< what was stored when the tool was lifted out, shcd_ledger_lift() */
    uint64_t n_ticks;     /**< that shcd_ledger_move() saw */
    uint64_t is_held;     /**< 1: the following describe the last tick */
    shcd_vec3 moved_m;    /**< the last motion; zero after the first pose */
    shcd_vec3 turned_rad; /**< its rotation vector, world frame */
    shcd_pose tool_in_world;
    shcd_vec3 velocity_m_per_s;
    shcd_wrench published;
    shcd_wrench model;
    double stiffness_n_per_m;
    double damping_n_s_per_m;
    double reach_m;
} shcd_ledger;

/** What a tick made, at the pose that the last shcd_ledger_move() got. Wrenches act on the tool,
 *  world frame, torques about the tool's origin. Effects with a memory add what they store to
 *  stored_j; what drives a body reports it in driven_j. Frozen layout. */
typedef struct shcd_ledger_input {
    shcd_wrench published;      /**< what the hand feels until the next tick */
    shcd_wrench model;          /**< what shcd_step() gave */
    shcd_vec3 velocity_m_per_s; /**< that the tick was told */
    double stored_j;            /**< held now by all springs, anchors, modes; >= 0 */
    double requery_j;           /**< see shcd_ledger_requery(); 0: unknown */
    double driven_j;            /**< brought in since the last tick by what drives a body */
    double stiffness_n_per_m;   /**< K_n: Lipschitz constant of the model's elastic force. Of a
                                     membrane without a spring before it twice that within a tick,
                                     shcd_scene_wave_stiffness(): the force of a tick acts on the
                                     modes from the tick's start, with its value at the end */
    double damping_n_s_per_m;   /**< D_n: largest slope of the model's force over the rate */
    double reach_m;             /**< largest distance of a contact from the tool's origin: what
                                     turning adds to |dx| */
} shcd_ledger_input;

/** The tool has come to a pose: books what the held forces did on the way.
 *  @param[in] dt_s  time since the last tick, > 0 [s]
 *  @return W, the energy that the hand gave against the published force; negative: took [J]; 0 for
 *  the first pose or a null argument. A rotation counts by its rotation vector, the shorter way
 *  round, relative error below 1e-10 up to half a radian. RT safe. */
SHCD_API SHCD_RT double shcd_ledger_move(shcd_ledger *ledger, const shcd_pose *tool_in_world,
                                         double dt_s);

/** After shcd_ledger_move(): books the same motion for each part of the force that was held, e.g.
 *  for each effect of the scene (shcd_output::effect_forces_n as the *last* tick left it).
 *  @param[in]     forces_n  n forces on the tool, world frame
 *  @param[in,out] entry_j   n sums; -forces_n[i] . moved_m is added [J]. RT safe. */
SHCD_API SHCD_RT void shcd_ledger_share(const shcd_ledger *ledger, const shcd_vec3 *forces_n,
                                        size_t n, double *entry_j);

/** The tick has made its forces: they are held until the next shcd_ledger_move().
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT (null, or no pose yet; then nothing is changed). RT safe. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_ledger_hold(shcd_ledger *ledger,
                                                             const shcd_ledger_input *input);

/** The tool leaves the scene or is put elsewhere: no force is held, no motion follows, and what was
 *  stored becomes forgotten_j. The sums stay. NULL is allowed. RT safe. */
SHCD_API SHCD_RT void shcd_ledger_lift(shcd_ledger *ledger);

/** given - taken - output_chain + driven + slack - stored - forgotten [J]: dissipated since the
 *  account was opened, see the file's comment. RT safe. */
SHCD_API SHCD_RT double shcd_ledger_margin(const shcd_ledger *ledger);

/** What asking for foot and normal anew did to a spring at the tool's new place: U_{n+1} minus
 *  that of the plane that was held, k max(0, depth_n - n_n . dx)^2/2 [J].
 *  @param[in] before_m, normal  depth and unit normal of the last tick; < 0: the gap
 *  @param[in] dx_m              motion of the contact's point on the tool since then
 *  @param[in] now_m             depth now; 0: left. RT safe. */
SHCD_API SHCD_RT double shcd_ledger_requery(double stiffness_n_per_m, double before_m,
                                            shcd_vec3 normal, shcd_vec3 dx_m, double now_m);

#ifdef __cplusplus
}
#endif
#endif
