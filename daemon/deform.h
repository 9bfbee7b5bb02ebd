/* SPDX-License-Identifier: BSD-3-Clause */
/* The shapes of soft bodies on their way from the loop to viewers: the loop leaves the latest
 * coefficients of one body at a time in a mailbox, the publisher turns them into messages. */
#ifndef SHCDD_DEFORM_H
#define SHCDD_DEFORM_H

#include "config.h"
#include "exchange.h"

#include "shcd/shcd.h"

#include <stdint.h>

#define DEFORM_SOFT_NS 16666667   /* 60 Hz: least time between two messages of a soft body */
#define DEFORM_RIGID_NS 100000000 /* of one that never changes */

/** What the loop knows of one body at the end of a tick; 3 (degree+1)^2 coefficients follow. */
typedef struct deform_snapshot {
    int64_t tick;
    int64_t utime_ns;
    double coefficients[];
} deform_snapshot;

/** Mailboxes of all bodies. */
typedef struct deform_boxes {
    size_t n_bodies;
    mailbox box[SHCD_BODIES_MAX]; /* of soft bodies only */
    bool is_soft[SHCD_BODIES_MAX];
    size_t count[SHCD_BODIES_MAX]; /* of coefficients */
    void *memory;
} deform_boxes;

/** @return false without memory */
bool deform_create(const daemon_config *config, deform_boxes *boxes);
void deform_free(deform_boxes *boxes);

/** Volume inside the surface of these coefficients [m^3], exact up to rounding.
 *  @param[in] shape  of the model; its content is replaced */
double deform_volume(const shcd_model *model, shcd_shape *shape, const double *coefficients);

#endif
