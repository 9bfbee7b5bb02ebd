/* SPDX-License-Identifier: BSD-3-Clause */
/* The radial start needs no solve and is the best one for most bodies, whatever it folds. It fails
 * where the centroid lies outside the body: the projection then covers the sphere zero times on
 * balance, and opening it means to turn half of the mesh over. The other starts do not depend on
 * where the centroid is, or depend on it after limbs and bends have been smoothed away. */
#include "start.h"

#include "start_cylinder.h"

#include <stdlib.h>

static const double four_pi = 12.566370614359172954;

/* Conformalised mean curvature flow: enough implicit steps of this size, on a surface of area 4 pi,
 * to draw in limbs, too few to make vertices collapse. Kazhdan, Solomon, Ben-Chen, "Can mean
 * curvature flow be modified to be non-singular?", Computer Graphics Forum 31(5), 2012. */
#define N_SMOOTHING_STEPS 10
#define SMOOTHING_STEP 0.125

static shcd_vec3 area_vector(const uint32_t *triangle, const shcd_vec3 *x) {
    return shcd_cross(shcd_sub(x[triangle[1]], x[triangle[0]]),
                      shcd_sub(x[triangle[2]], x[triangle[0]]));
}

/* Moves the centroid of the surface to the origin and scales its area to 4 pi. */
static void normalise(const shcdi_energy *energy, shcd_vec3 *x) {
    shcd_vec3 moment = shcd_vec3_make(0.0, 0.0, 0.0);
    double total = 0.0;
    for (size_t t = 0; t < energy->n_triangles; ++t) {
        const uint32_t *triangle = energy->triangles + 3 * t;
        const double area = 0.5 * shcd_norm(area_vector(triangle, x));
        for (int k = 0; k < 3; ++k) {
            moment = shcd_mul_add(moment, area / 3.0, x[triangle[k]]);
        }
        total += area;
    }
    const double scale = total > 0.0 ? sqrt(four_pi / total) : 1.0;
    const shcd_vec3 centre =
        total > 0.0 ? shcd_scale(1.0 / total, moment) : shcd_vec3_make(0.0, 0.0, 0.0);
    for (size_t i = 0; i < energy->n_vertices; ++i) {
        x[i] = shcd_scale(scale, shcd_sub(x[i], centre));
    }
}

static void project(size_t n, shcd_vec3 *u) {
    for (size_t i = 0; i < n; ++i) {
        u[i] = shcd_unit(u[i]);
        if (!(shcd_dot(u[i], u[i]) > 0.5)) {
            u[i] = shcd_vec3_make(0.0, 0.0, 1.0); /* at the centroid every direction is as good */
        }
    }
}

static shcd_status smooth(const shcdi_energy *energy, shcdi_laplacian *laplacian, shcd_vec3 *x) {
    const size_t n = energy->n_vertices;
    double *weights = malloc(3 * energy->n_triangles * sizeof *weights);
    double *mass = malloc(n * sizeof *mass);
    shcd_vec3 *right_hand_side = malloc(n * sizeof *right_hand_side);
    shcd_status status =
        weights != NULL && mass != NULL && right_hand_side != NULL ? SHCD_OK : SHCD_ERR_MEMORY;
    if (status == SHCD_OK) {
        shcdi_energy_cotangent_weights(energy, weights);
        for (size_t k = 0; k < 3 * energy->n_triangles; ++k) {
            weights[k] *= SMOOTHING_STEP;
        }
    }
    for (int step = 0; step < N_SMOOTHING_STEPS && status == SHCD_OK; ++step) {
        for (size_t i = 0; i < n; ++i) {
            mass[i] = 1e-6 * energy->vertex_area[i]; /* where the flow has closed a triangle */
        }
        for (size_t t = 0; t < energy->n_triangles; ++t) {
            const uint32_t *triangle = energy->triangles + 3 * t;
            const double share = shcd_norm(area_vector(triangle, x)) / (6.0 * four_pi);
            for (int k = 0; k < 3; ++k) {
                mass[triangle[k]] += share;
            }
        }
        for (size_t i = 0; i < n; ++i) {
            right_hand_side[i] = shcd_scale(mass[i], x[i]);
        }
        status = shcdi_laplacian_factorise(laplacian, weights, mass);
        if (status == SHCD_OK) {
            status = shcdi_laplacian_solve(laplacian, right_hand_side, x);
            normalise(energy, x);
        }
    }
    free(weights);
    free(mass);
    free(right_hand_side);
    return status;
}

shcd_status shcdi_start_make(shcdi_start kind, const shcdi_energy *energy,
                             shcdi_laplacian *laplacian, const shcd_vec3 *positions, shcd_vec3 *u) {
    if (kind == SHCDI_START_CYLINDER) {
        return shcdi_start_cylinder(energy, laplacian, positions, u);
    }
    for (size_t i = 0; i < energy->n_vertices; ++i) {
        u[i] = positions[i];
    }
    normalise(energy, u);
    const shcd_status status =
        kind == SHCDI_START_SMOOTHED ? smooth(energy, laplacian, u) : SHCD_OK;
    project(energy->n_vertices, u);
    return status;
}
