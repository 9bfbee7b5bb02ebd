/* SPDX-License-Identifier: BSD-3-Clause */
/* A hand on a haptic device, simulated: a mass with viscous and Coulomb friction, held by a spring
 * and damper (the grip) that follow a target, under a force that is held over a tick.
 *
 *     m x'' = F - b x' - f x'/|x'| + k_h (p - x) + b_h (p' - x')
 *
 * F is constant over a tick and p linear in time, so between Coulomb impulses the equation is
 * linear with constant coefficients: a substep applies the exact solution, a matrix exponential
 * made once. That is exact to rounding: work of F and of the grip minus what b and b_h dissipate
 * equals the change of energy. The Coulomb force acts in half substeps before and after it
 * (Strang), as the factor max(0, 1 - f h/(2 m |v|)) on the velocity, which is the exact solution of
 * m v' = -f v/|v| and never raises the kinetic energy. So the integrator adds no energy, whatever
 * the step; what the steps do change is how exactly Coulomb friction holds: a mass that it should
 * hold creeps by at most F h/m, 0.3 mm/s for 0.5 N at 50 us and 0.1 kg. */
#ifndef SHCD_TESTS_HAND_H
#define SHCD_TESTS_HAND_H

#include "shcd/base.h"

#include <stddef.h>

#define HAND_SUBSTEPS 20
/* 2 ms of delay at 4 kHz are 160 substeps */
#define HAND_HISTORY 256

typedef struct hand_parameters {
    double mass_kg;           /* of device and hand */
    double damping_n_s_per_m; /* to the ground */
    double coulomb_n;
    double grip_n_per_m;   /* towards the target */
    double grip_n_s_per_m; /* towards the target's velocity */
    double encoder_m;      /* step of each coordinate; 0: none */
    double delay_s;        /* age of the position that a tick sees; a multiple of a substep */
    double rate_hz;
} hand_parameters;

typedef struct hand {
    hand_parameters parameters;
    double step_s;
    double to_x[4], to_v[4]; /* rows of the propagator on (x, v, c0, c1), x'' = c0 + c1 t + ... */
    shcd_vec3 position_m, velocity_m_per_s;
    shcd_vec3 target_m;
    size_t n_steps;
    size_t delay_steps;
    shcd_vec3 history_m[HAND_HISTORY]; /* [n_steps % HAND_HISTORY]: after n_steps */
    double dissipated_j;               /* by damping_n_s_per_m and Coulomb friction, not the grip */
    double travel_m;                   /* length of the path */
} hand;

/** At rest at a position, the target there too, and since ever. */
void hand_begin(hand *h, const hand_parameters *parameters, shcd_vec3 position_m);

/** What a tick sees now: the position delay_s ago, in encoder steps. */
shcd_vec3 hand_measured(const hand *h);

/** A tick under a force, while the target moves to `target_m`. */
void hand_tick(hand *h, shcd_vec3 force_n, shcd_vec3 target_m);

/** Kinetic energy and that of the grip's spring [J]. */
double hand_energy(const hand *h);

#endif
