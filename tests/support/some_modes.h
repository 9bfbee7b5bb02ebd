/* SPDX-License-Identifier: BSD-3-Clause */
/* Modes that a model accepts, every number with a value of its own; they belong to no surface. */
#ifndef SHCD_TESTS_SOME_MODES_H
#define SHCD_TESTS_SOME_MODES_H

#include "shcd/model.h"

/** Doubles that the modes need. */
#define SOME_MODES_SIZE(degree, n_modes) ((n_modes) * (1 + SHCD_COUNT(degree)))

static inline shcd_modes some_modes(int degree, size_t n_modes, double *numbers) {
    shcd_modes modes = {n_modes, numbers, numbers + n_modes, 0.03, 1.5e-9, 5e-4, 1, 0};
    for (size_t i = 0; i < n_modes; i++) {
        numbers[i] = 100.0 * (double)i;
    }
    for (size_t i = n_modes; i < SOME_MODES_SIZE(degree, n_modes); i++) {
        numbers[i] = (i % 2 == 0 ? 0.25 : -0.25) * (double)i;
    }
    return modes;
}

#endif
