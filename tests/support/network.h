/* SPDX-License-Identifier: BSD-3-Clause */
/* A learned response made by hand. */
#ifndef SHCD_TESTS_NETWORK_H
#define SHCD_TESTS_NETWORK_H

#include "shcd/learned.h"
#include "support/bodies.h"

#define NETWORK_CENTRES 12
#define NETWORK_TERMS 3
#define NETWORK_MODES 2
#define NETWORK_NUMBERS                                                                            \
    (3 * NETWORK_CENTRES + (NETWORK_CENTRES + 1 + NETWORK_MODES) * NETWORK_TERMS)

/* Centres on a ball of 5 cm; k between 60 and 140 N/m at half the depth, rising with it. */
static inline shcd_learned network_by_hand(double *numbers) {
    check_random random = {0x1ea2u};
    shcd_learned l;
    memset(&l, 0, sizeof l);
    l.n_centres = NETWORK_CENTRES;
    l.n_terms = NETWORK_TERMS;
    l.n_modes = NETWORK_MODES;
    l.centre_m = numbers;
    l.weight_n_per_m = numbers + 3 * NETWORK_CENTRES;
    l.dent_m3_per_n = numbers + 3 * NETWORK_CENTRES + (NETWORK_CENTRES + 1) * NETWORK_TERMS;
    for (size_t j = 0; j < NETWORK_CENTRES; j++) {
        const shcd_vec3 w = bodies_random_direction(&random);
        numbers[3 * j] = 0.05 * w.x;
        numbers[3 * j + 1] = 0.05 * w.y;
        numbers[3 * j + 2] = 0.05 * w.z;
    }
    double *weight = numbers + 3 * NETWORK_CENTRES;
    for (size_t i = 0; i < (NETWORK_CENTRES + 1) * NETWORK_TERMS; i++) {
        const double scale = i % NETWORK_TERMS == 0 ? 8.0 : 1.0;
        weight[i] = i == 0   ? 100.0
                    : i == 1 ? 20.0
                    : i == 2 ? 3.0
                             : scale * check_uniform(&random, -1.0, 1.0);
    }
    for (size_t i = 0; i < NETWORK_MODES * NETWORK_TERMS; i++) {
        weight[(NETWORK_CENTRES + 1) * NETWORK_TERMS + i] = check_uniform(&random, 1e-6, 2e-6);
    }
    l.support_m = 0.06;
    l.fill_m = 0.02;
    l.depth_max_m = 0.01;
    l.direct_n_per_m = 80.0;
    l.young_pa = 5000.0;
    l.poisson_ratio = 0.45;
    l.record.n_samples = 60;
    l.record.n_holdout = 20;
    l.record.force_error_max_n = 0.01;
    return l;
}

#endif
