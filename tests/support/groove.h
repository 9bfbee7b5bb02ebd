/* SPDX-License-Identifier: BSD-3-Clause */
/* A body with a groove about its waist. */
#ifndef SHCD_TESTS_GROOVE_H
#define SHCD_TESTS_GROOVE_H

#include "support/check.h"

#include "shcd/shcd.h"

#include <stdlib.h>
#include <string.h>

#define GROOVE_DEGREE_MAX 12
#define GROOVE_COUNT (3 * SHCD_COUNT(GROOVE_DEGREE_MAX))
#define GROOVE_PI 3.14159265358979324

static inline shcd_model *groove_model(int degree, const double *c, const shcd_modes *modes) {
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    def.degree = degree;
    def.coefficients = c;
    def.modes = modes;
    if (shcd_model_create(&def, NULL, &model, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    return model;
}

/** A ball with a waist: r(theta) = 0.03 (1 - depth e^(-(z/0.28)^2)), projected by midpoint sums in
 *  z = cos(theta): the coefficients of r w need only m = 0 for z, m = +-1 for x and y. */
static inline void groove_coefficients(int degree, double depth, double c[GROOVE_COUNT]) {
    const int n = 4000;
    memset(c, 0, GROOVE_COUNT * sizeof *c);
    for (int i = 0; i < n; i++) {
        const double z = -1.0 + 2.0 * (i + 0.5) / n, s = sqrt(1.0 - z * z);
        const double r = 0.03 * (1.0 - depth * exp(-z * z / (0.28 * 0.28)));
        double y[SHCD_COUNT(GROOVE_DEGREE_MAX)];
        assert_int_equal(shcd_harmonics(degree, shcd_vec3_make(s, 0.0, z), y, NULL, NULL), SHCD_OK);
        for (int l = 0; l <= degree; l++) {
            const double weight = 2.0 / n * 2.0 * GROOVE_PI;
            c[3 * SHCD_INDEX(l, 0) + 2] += weight * r * z * y[SHCD_INDEX(l, 0)];
            if (l > 0) { /* int cos^2 over the azimuth is half of the whole turn */
                const double x = 0.5 * weight * r * s * y[SHCD_INDEX(l, 1)];
                c[3 * SHCD_INDEX(l, 1) + 0] += x;
                c[3 * SHCD_INDEX(l, -1) + 1] += x;
            }
        }
    }
}

static inline shcd_model *groove_body(int degree, double depth) {
    double c[GROOVE_COUNT];
    groove_coefficients(degree, depth, c);
    return groove_model(degree, c, NULL);
}

/** The same with the harmonics of its degree as its modes, which a body need not know to be
 *  another's: those of a sphere of its size. */
static inline shcd_model *groove_soft_body(int degree, double depth) {
    const size_t n = SHCD_COUNT(degree);
    double *rows = calloc(n * n, sizeof *rows), *eigenvalues = calloc(n, sizeof *eigenvalues);
    double c[GROOVE_COUNT];
    assert_non_null(rows);
    assert_non_null(eigenvalues);
    const shcd_modes modes = {
        n, eigenvalues, rows, 4.0 * GROOVE_PI * 9e-4, 0.0, 4.0 / 3.0 * GROOVE_PI * 2.7e-5, 0, 0};
    groove_coefficients(degree, depth, c);
    for (int l = 0; l <= degree; l++) {
        for (int m = -l; m <= l; m++) {
            const size_t i = SHCD_INDEX(l, m);
            eigenvalues[i] = l * (l + 1) / 9e-4;
            rows[i * n + i] = 1.0 / 0.03;
        }
    }
    shcd_model *model = groove_model(degree, c, &modes);
    free(rows);
    free(eigenvalues);
    return model;
}

#endif
