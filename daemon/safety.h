/* SPDX-License-Identifier: BSD-3-Clause */
/* What stands between the model's force and a hand, as pure functions of their arguments.
 *
 * Input side: the watchdog. A pose that is not renewed is first held (a lost message or two must
 * not be felt), then the force is taken away, then the tool leaves the scene.
 *
 * Output side, per tool and tick: finite check -> magnitude clamp, direction kept -> slew limit ->
 * ramp gain -> passivity (passivity.h) -> finite check. The slew limits what comes before
 * passivity: a limiter behind it would give back the energy that it has just kept. A stage that
 * does not act passes its input through bit for bit, and each one that acts leaves a flag. */
#ifndef SHCDD_SAFETY_H
#define SHCDD_SAFETY_H

#include "shcd/base.h"

#include <stdbool.h>
#include <stdint.h>

#define SAFETY_STALE_NS 20000000     /* from here on the pose is held with zero velocity */
#define SAFETY_RAMP_NS 50000000      /* from here on the force ramps to zero */
#define SAFETY_INACTIVE_NS 500000000 /* from here on the tool touches nothing */

#define SAFETY_RAMP_OFF_S 0.05 /* full force to zero */
#define SAFETY_RAMP_ON_S 0.2   /* zero to full force: also after a first pose inside a body */

/* A longer step than this, after missed ticks, is not integrated at once by limits and filters. */
#define SAFETY_DT_MAX_S 0.005

typedef enum watchdog_level {
    WATCHDOG_FRESH = 0,
    WATCHDOG_HOLD = 1,
    WATCHDOG_RAMP = 2,
    WATCHDOG_INACTIVE = 3
} watchdog_level;

/** Level for the age of the last accepted pose; the age of a tool that has none is negative. */
watchdog_level watchdog_of_age(int64_t age_ns);

/** Bits that the stages leave; the values of tool_force_t on the wire. */
typedef enum safety_flag {
    SAFETY_LIMITED = 2,
    SAFETY_SLEW = 4,
    SAFETY_FAULT = 16,
    SAFETY_RAMP = 32
} safety_flag;

/** All > 0. The torque may change as fast as the force, each relative to its own cap. */
typedef struct safety_limits {
    double force_max_n;
    double torque_max_n_m;
    double slew_max_n_per_s;
} safety_limits;

/** Memory of the chain between ticks; all zero: no force yet, soft start ahead. */
typedef struct safety_state {
    shcd_wrench slewed;    /* after the slew stage */
    double gain;           /* of the ramp, 0 .. 1 */
    shcd_wrench published; /* what safety_apply() returned last */
} safety_state;

typedef enum safety_wish {
    SAFETY_FULL, /* the gain ramps to 1 */
    SAFETY_CUT,  /* a force of zero goes into the slew stage; soft start once it has arrived */
    SAFETY_FADE  /* the gain ramps to 0 */
} safety_wish;

/** v scaled to the length `max` if it is longer, without overflow for any finite v. */
shcd_vec3 safety_clamp(shcd_vec3 v, double max, bool *acted);

/** `wanted`, or the point at distance `step_max` from `last` on the way to it. */
shcd_vec3 safety_slew(shcd_vec3 last, shcd_vec3 wanted, double step_max, bool *acted);

/** The gain after dt_s towards 1 (up) or 0, linear in time; arrives at exactly 1 and 0. */
double safety_ramp(double gain, bool up, double dt_s);

/** The chain up to passivity. @param[out] flags  safety_flag bits, replaced. @return a wrench that
 * is finite, |force| <= force_max_n and |torque| <= torque_max_n_m up to rounding, and after a
 * change of less than slew_max dt at full gain exactly `wanted`. */
shcd_wrench safety_apply(const safety_limits *limits, safety_state *state, shcd_wrench wanted,
                         safety_wish wish, double dt_s, uint32_t *flags);

/** The end of the chain: a wrench that is not finite becomes zero, is flagged, and whatever comes
 *  next starts softly; every other passes bit for bit. */
shcd_wrench safety_finish(safety_state *state, shcd_wrench wrench, uint32_t *flags);

#endif
