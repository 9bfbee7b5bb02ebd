/* SPDX-License-Identifier: BSD-3-Clause */
/* When an oscillation counts as one that does not end.
 *
 * Every session ends with a hold of three seconds: the target rests. In a stable loop the tool
 * comes to rest; in one that is not it oscillates, and whatever stops the growth (the air, where
 * there is no force, or a cap) it goes on. So what counts is the way there and back, length of the
 * way less the net way along an axis, in quarters of a second. That is at least the oscillation's
 * peak-to-peak size once in a quarter (hand and grip swing at 4 Hz or more), and nothing for a tool
 * that slides off a hill slowly, which turns back in one quarter at most. So of the second and of
 * the third second of the hold the quarter with the least is taken:
 *
 *     oscillating = third > floor and (third > 0.9 second or the contact is lost or made in it).
 *
 * A growing oscillation has third > second, one that has reached its size about as much, or it
 * leaves the surface again and again; one that decays has fallen by the share exp(-1 s/tau) and
 * touches all the time. With an encoder the floor is the way of an oscillation of 4 steps from peak
 * to peak at 80 Hz, the fastest here, sqrt(20 kN/m / 0.08 kg): the describing function of a
 * quantiser is at most 4/pi, so what cycles on it alone is about a step. Without, 1e-7 m.
 *
 * The energy says it at every instant and not only in the end: the device's own friction must
 * dissipate whatever the loop yields (rig.excess_j). */
#ifndef SHCD_TESTS_WATCH_H
#define SHCD_TESTS_WATCH_H

#include "rig.h"

#define WATCH_ENCODER_STEPS (2.0 * 4.0 * 80.0 / 4.0)
#define WATCH_FLOOR_M 1e-7

typedef struct watch {
    double second_m, third_m; /* there and back in a quarter of these seconds of the hold */
    double deepest_m;         /* over the hold */
    int n_changes;            /* of contact, in the third second */
} watch;

/** Holds the target where it is, and watches. */
watch watch_hold(rig *r);

/** Whether what was seen is an oscillation that does not end. */
bool watch_is_oscillating(const watch *w, double encoder_m);

#endif
