/* SPDX-License-Identifier: BSD-3-Clause */
/* The loop, closed: a simulated hand, the daemon's tick on a virtual clock (mailbox, velocity
 * filter, shcd_step, output chain, passivity), and the force back on the hand.
 *
 * The delay of the loop is the hand's: the pose that a tick sees is delay_s old, and its force acts
 * from the tick on. That is the same loop as one whose delay is split between both ways. */
#ifndef SHCD_TESTS_RIG_H
#define SHCD_TESTS_RIG_H

#include "hand.h"

#include "tick.h"

#include <stdbool.h>

/** What of the daemon varies; a profile without caps is rig_open_loop. */
typedef struct rig_setup {
    const shcd_model *model;
    const shcd_model *other; /* a second body with the same effects; NULL: none */
    shcd_vec3 other_at_m;
    double radius_m;           /* of the sphere tool; 0: a point */
    double stiffness_n_per_m;  /* 0: without, on a soft body */
    double damping_ratio;      /* of the effect; 0: without */
    double friction_n_per_m;   /* spring of `friction`; 0: without */
    double youngs_modulus_pa;  /* of `wave`; 0: a rigid body. The spring is in series. */
    double wave_damping_ratio; /* of its modes; 0: the default */
    const device_profile *device;
    double reserve_j; /* HUGE_VAL: no controller */
    double delay_s;   /* that the scene states; 0: the device's */
    hand_parameters hand;
} rig_setup;

/** No caps within reach, nothing between the spring and the hand. */
extern const device_profile rig_bare_device;

/** Stiffness that a press meets: the spring's, and in series the half-space's of the soft body. */
double rig_static_stiffness(const rig_setup *setup);

/** Largest stiffness that a motion within a tick meets, of both springs: the elastic law's, or
 *  without one the membrane's; and friction's where that is more. */
double rig_tick_stiffness(const rig_setup *setup);

typedef struct rig {
    daemon_config config;
    tick_core core;
    tick_record record;
    mailbox pose;
    ring commands, applied;
    hand hand;
    velocity_filter velocity;
    int64_t now_ns;
    int64_t seq;
    shcd_vec3 force_n; /* held */
    double taken_j;    /* that the hand took out, net: work of the published force, true motion */
    double taken_most_j;
    double uneven_j;        /* sum of |F_n - F_(n-1)| |e_n|: daemon/passivity.h */
    double uneven_most_m;   /* largest |e_n| */
    double excess_j;        /* largest of taken_j - dissipated by the device, over time */
    uint32_t most_contacts; /* of a tick */
    int64_t n_guarded;      /* ticks that the passivity controller changed */
    void *memory;
} rig;

/** A tool at rest outside of the body, whose force has started softly. */
void rig_open(rig *r, const rig_setup *setup, shcd_vec3 position_m);
void rig_close(rig *r);

/** Measures, ticks, and moves the hand, whose target goes to `target_m` meanwhile. */
void rig_tick(rig *r, shcd_vec3 target_m);

/** Depth of the tool as the tick saw it [m]. */
double rig_depth(const rig *r);

#endif
