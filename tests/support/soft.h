/* SPDX-License-Identifier: BSD-3-Clause */
/* Soft spheres: their modes are the harmonics themselves, in closed form. */
#ifndef SHCD_TESTS_SOFT_H
#define SHCD_TESTS_SOFT_H

#include "support/scene_fixture.h"

#define SOFT_PI 3.14159265358979324

/** A sphere with all modes of its degree: phi = Y_lm/R, lambda = l(l+1)/R^2. */
static inline shcd_model *soft_sphere(double radius_m, int degree) {
    const size_t n = (size_t)(degree + 1) * (size_t)(degree + 1);
    double *coefficients = calloc(3 * n, sizeof *coefficients);
    double *rows = calloc(n * n, sizeof *rows);
    double *eigenvalues = calloc(n, sizeof *eigenvalues);
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_modes modes = {n,    eigenvalues,
                        rows, 4.0 * SOFT_PI * radius_m * radius_m,
                        0.0,  4.0 / 3.0 * SOFT_PI * radius_m * radius_m * radius_m,
                        0,    0};
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    const double unit = 2.0466534158929770; /* sqrt(4 pi / 3) */
    assert_non_null(coefficients);
    assert_non_null(rows);
    assert_non_null(eigenvalues);
    coefficients[3 * SHCD_INDEX(1, 1) + 0] = radius_m * unit;
    coefficients[3 * SHCD_INDEX(1, -1) + 1] = radius_m * unit;
    coefficients[3 * SHCD_INDEX(1, 0) + 2] = radius_m * unit;
    for (int l = 0; l <= degree; l++) {
        for (int m = -l; m <= l; m++) {
            const size_t i = SHCD_INDEX(l, m);
            eigenvalues[i] = l * (l + 1) / (radius_m * radius_m);
            rows[i * n + i] = 1.0 / radius_m;
        }
    }
    def.degree = degree;
    def.coefficients = coefficients;
    def.modes = &modes;
    if (shcd_model_create(&def, NULL, &model, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    free(coefficients);
    free(rows);
    free(eigenvalues);
    return model;
}

#endif
