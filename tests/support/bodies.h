/* SPDX-License-Identifier: BSD-3-Clause */
/* Bodies for the tests of the core: coefficients of polynomial images of the sphere by quadrature,
 * and random ones. */
#ifndef SHCD_TESTS_BODIES_H
#define SHCD_TESTS_BODIES_H

#include "shcd/model.h"
#include "shcd/vec.h"
#include "support/check.h"

#include <string.h>

#define BODIES_PI 3.14159265358979324

/** Nodes and weights of n-point Gauss-Legendre quadrature on [-1, 1]. */
static inline void bodies_gauss_legendre(int n, double *node, double *weight) {
    for (int i = 0; i < n; i++) {
        double x = cos(BODIES_PI * (i + 0.75) / (n + 0.5)), slope = 1.0;
        for (int step = 0; step < 60; step++) {
            double p = 1.0, before = 0.0;
            for (int l = 1; l <= n; l++) {
                const double next = ((2.0 * l - 1.0) * x * p - (l - 1.0) * before) / l;
                before = p;
                p = next;
            }
            slope = n * (x * p - before) / (x * x - 1.0);
            if (fabs(p / slope) < 1e-16) {
                break;
            }
            x -= p / slope;
        }
        node[i] = x;
        weight[i] = 2.0 / ((1.0 - x * x) * slope * slope);
    }
}

static inline shcd_vec3 bodies_random_direction(check_random *random) {
    const double x = check_normal(random), y = check_normal(random);
    return shcd_unit(shcd_vec3_make(x, y, check_normal(random)));
}

/** Image of a point of the unit sphere. */
typedef shcd_vec3 (*bodies_map)(shcd_vec3 w, const double *parameters);

/** Coefficients of a map whose coordinates are polynomials of at most the given degree in w: the
 *  quadrature is exact, so the surface is the map itself. */
static inline void bodies_project(int degree, bodies_map map, const double *parameters,
                                  double *coefficients) {
    const int n_theta = degree + 1, n_phi = 2 * degree + 2;
    double *node = calloc(2 * (size_t)n_theta + SHCD_COUNT(degree), sizeof *node);
    assert_non_null(node);
    double *weight = node + n_theta, *y = weight + n_theta;
    bodies_gauss_legendre(n_theta, node, weight);
    memset(coefficients, 0, 3 * SHCD_COUNT(degree) * sizeof *coefficients);
    for (int j = 0; j < n_theta; j++) {
        const double s = sqrt(1.0 - node[j] * node[j]);
        for (int k = 0; k < n_phi; k++) {
            const double phi = 2.0 * BODIES_PI * k / n_phi;
            const double share = weight[j] * 2.0 * BODIES_PI / n_phi;
            const shcd_vec3 w = {s * cos(phi), s * sin(phi), node[j]};
            const shcd_vec3 x = map(w, parameters);
            assert_int_equal(shcd_harmonics(degree, w, y, NULL, NULL), SHCD_OK);
            for (size_t i = 0; i < SHCD_COUNT(degree); i++) {
                coefficients[3 * i] += share * y[i] * x.x;
                coefficients[3 * i + 1] += share * y[i] * x.y;
                coefficients[3 * i + 2] += share * y[i] * x.z;
            }
        }
    }
    free(node);
}

/** A bent body of degree 2, not star-shaped if bent enough: the unit ball under the volume
 *  preserving map (x, y, z) -> (a x + bend z^2, b y, c z), parameters a, b, c, bend. */
static inline shcd_vec3 bodies_bent(shcd_vec3 w, const double *p) {
    return shcd_vec3_make(p[0] * w.x + p[3] * w.z * w.z, p[1] * w.y, p[2] * w.z);
}

/** Below 1 inside that body, 1 on its surface: the map undone. */
static inline double bodies_bent_level(shcd_vec3 x, const double *p) {
    const double z = x.z / p[2], y = x.y / p[1], u = (x.x - p[3] * z * z) / p[0];
    return sqrt(u * u + y * y + z * z);
}

/** Half axes along x, y, z; exactly degree 1. coefficients: 12 values. */
static inline void bodies_ellipsoid_coefficients(double a, double b, double c,
                                                 double *coefficients) {
    const double unit = sqrt(4.0 * BODIES_PI / 3.0);
    memset(coefficients, 0, 12 * sizeof *coefficients);
    coefficients[3 * SHCD_INDEX(1, 1)] = a * unit;
    coefficients[3 * SHCD_INDEX(1, -1) + 1] = b * unit;
    coefficients[3 * SHCD_INDEX(1, 0) + 2] = c * unit;
}

/** An ellipsoid with half axes near 1 m and normal noise in every coefficient of degree 2 and more,
 *  falling like l^-2: `rough` 0.05 leaves it embedded as a rule, 0.5 does not. */
static inline void bodies_random_coefficients(check_random *random, int degree, double rough,
                                              double *coefficients) {
    memset(coefficients, 0, 3 * SHCD_COUNT(degree) * sizeof *coefficients);
    bodies_ellipsoid_coefficients(check_uniform(random, 0.8, 1.2), check_uniform(random, 0.6, 1.2),
                                  check_uniform(random, 0.6, 1.4), coefficients);
    for (int l = 2; l <= degree; l++) {
        for (size_t i = 3 * SHCD_INDEX(l, -l); i < 3 * SHCD_INDEX(l, l) + 3; i++) {
            coefficients[i] = rough * check_normal(random) / ((double)l * l);
        }
    }
    for (size_t k = 0; k < 3; k++) {
        coefficients[k] = check_normal(random);
    }
}

static inline shcd_model *bodies_create(int degree, const double *coefficients) {
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    def.degree = degree;
    def.coefficients = coefficients;
    if (shcd_model_create(&def, NULL, &model, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    return model;
}

static inline shcd_model *bodies_create_ellipsoid(double a, double b, double c) {
    double coefficients[12];
    bodies_ellipsoid_coefficients(a, b, c, coefficients);
    return bodies_create(1, coefficients);
}

/** The same surface in a turned parameterization: S(w) = A R w with a random rotation R, so that no
 *  symmetry of the body is one of the tree. */
static inline shcd_model *bodies_create_ellipsoid_turned(double a, double b, double c,
                                                         check_random *random) {
    const double axes[3] = {a, b, c}, unit = sqrt(4.0 * BODIES_PI / 3.0);
    const shcd_vec3 x = bodies_random_direction(random);
    const shcd_vec3 y = shcd_unit(shcd_cross(x, bodies_random_direction(random)));
    const shcd_vec3 row[3] = {x, y, shcd_cross(x, y)};
    double coefficients[12] = {0.0};
    for (size_t k = 0; k < 3; k++) {
        coefficients[3 * SHCD_INDEX(1, 1) + k] = unit * axes[k] * row[k].x;
        coefficients[3 * SHCD_INDEX(1, -1) + k] = unit * axes[k] * row[k].y;
        coefficients[3 * SHCD_INDEX(1, 0) + k] = unit * axes[k] * row[k].z;
    }
    return bodies_create(1, coefficients);
}

/** The same surface as one of degree 2 whose last coefficients are 0, in place of the given one of
 *  degree 1: queries search it, where those of degree 1 have a closed form. */
static inline shcd_model *bodies_searched(shcd_model *model) {
    double coefficients[27] = {0.0};
    memcpy(coefficients, shcd_model_coefficients(model), 12 * sizeof *coefficients);
    shcd_model_free(model);
    return bodies_create(2, coefficients);
}

static inline shcd_model *bodies_create_bent(double a, double b, double c, double bend) {
    const double parameters[4] = {a, b, c, bend};
    double coefficients[27];
    bodies_project(2, bodies_bent, parameters, coefficients);
    return bodies_create(2, coefficients);
}

static inline shcd_model *bodies_create_random(check_random *random, int degree, double rough) {
    double *coefficients = calloc(3 * SHCD_COUNT(degree), sizeof *coefficients);
    assert_non_null(coefficients);
    bodies_random_coefficients(random, degree, rough, coefficients);
    shcd_model *model = bodies_create(degree, coefficients);
    free(coefficients);
    return model;
}

static inline shcd_model_info bodies_info(const shcd_model *model) {
    shcd_model_info info = SHCD_MODEL_INFO_INIT;
    assert_int_equal(shcd_model_describe(model, &info), SHCD_OK);
    return info;
}

#endif
