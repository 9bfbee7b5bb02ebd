/* SPDX-License-Identifier: BSD-3-Clause */
/* Progress reports and wall-clock time. */
#ifndef SHCD_FIT_PROGRESS_H
#define SHCD_FIT_PROGRESS_H

#include "shcd/fit.h"

#include <time.h>

/** The caller's callback; `call` may be NULL. */
typedef struct shcdi_progress {
    shcd_progress call;
    void *user;
} shcdi_progress;

/** @return SHCD_OK or SHCD_ERR_CANCELLED */
static inline shcd_status shcdi_progress_report(const shcdi_progress *progress, const char *stage,
                                                double fraction) {
    if (progress->call == NULL) {
        return SHCD_OK;
    }
    const double clamped = fraction < 0.0 ? 0.0 : fraction > 1.0 ? 1.0 : fraction;
    return progress->call(stage, clamped, progress->user) == 0 ? SHCD_OK : SHCD_ERR_CANCELLED;
}

/** Seconds since some start; for differences only. */
static inline double shcdi_seconds(void) {
    struct timespec now;
    return timespec_get(&now, TIME_UTC) == TIME_UTC
               ? (double)now.tv_sec + 1e-9 * (double)now.tv_nsec
               : 0.0;
}

#endif
