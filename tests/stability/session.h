/* SPDX-License-Identifier: BSD-3-Clause */
/* What a hand does in a session: press, tap, slide, then hold still. */
#ifndef SHCD_TESTS_SESSION_H
#define SHCD_TESTS_SESSION_H

#include "watch.h"

typedef enum session_kind { SESSION_PRESS, SESSION_TAP, SESSION_SLIDE, SESSION_KINDS } session_kind;

typedef struct session {
    session_kind kind;
    shcd_vec3 w;           /* where on the body, a parameter */
    shcd_vec3 along;       /* towards where it slides */
    double angle_rad;      /* how far, to each side */
    double target_depth_m; /* of the target below the surface, at the most */
    double tap_hz, slide_hz;
    double duration_s; /* before the hold */
} session;

/** A session that presses with about force_n in the end, on a spring of the setup's stiffness. */
session session_make(session_kind kind, const rig_setup *setup, shcd_vec3 w, shcd_vec3 along,
                     double force_n);

/** Runs it on a rig that it opens and leaves open. */
watch session_run(rig *r, const rig_setup *setup, const session *s);

#endif
