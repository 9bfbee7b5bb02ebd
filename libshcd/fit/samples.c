/* SPDX-License-Identifier: BSD-3-Clause */
/* Samples are stratified over the faces: each face gets its number, only the place within a face is
 * random. Vertices alone would not do: a coarse mesh has fewer of them than a series has terms, and
 * they say nothing about the faces between. Half of the samples follow the mesh area, since that is
 * what the error is measured by; half follow the parameter area, so that no part of the sphere is
 * left without equations. Each counts as the mesh area it stands for. */
#include "samples.h"

#include <stdlib.h>

static const double four_pi = 12.566370614359172954;

static const uint64_t random_seed = UINT64_C(0x5348434466697401);

/* splitmix64 (Steele, Lea, Flood, OOPSLA 2014): the same numbers on every platform */
static double next_uniform(uint64_t *state) {
    uint64_t z = (*state += UINT64_C(0x9e3779b97f4a7c15));
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return (double)((z ^ (z >> 31)) >> 11) * 0x1p-53;
}

static void centre_positions(shcdi_body *body, const double *vertices_m) {
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (size_t i = 0; i < 3 * body->n_vertices; ++i) {
        low[i % 3] = fmin(low[i % 3], vertices_m[i]);
        high[i % 3] = fmax(high[i % 3], vertices_m[i]);
    }
    const shcd_vec3 a = shcd_vec3_make(low[0], low[1], low[2]);
    const shcd_vec3 b = shcd_vec3_make(high[0], high[1], high[2]);
    body->diagonal_m = shcd_norm(shcd_sub(b, a));
    body->centre_m = shcd_add(shcd_scale(0.5, a), shcd_scale(0.5, b));
    for (size_t i = 0; i < body->n_vertices; ++i) {
        const double *v = vertices_m + 3 * i;
        body->positions_m[i] = shcd_sub(shcd_vec3_make(v[0], v[1], v[2]), body->centre_m);
    }
}

shcd_status shcdi_body_init(shcdi_body *body, const shcd_mesh *mesh) {
    *body = (shcdi_body){.n_vertices = shcd_mesh_vertex_count(mesh),
                         .n_triangles = shcd_mesh_triangle_count(mesh),
                         .triangles = shcd_mesh_triangles(mesh)};
    body->positions_m = malloc(body->n_vertices * sizeof *body->positions_m);
    body->share = malloc(body->n_triangles * sizeof *body->share);
    if (body->positions_m == NULL || body->share == NULL) {
        shcdi_body_release(body);
        return SHCD_ERR_MEMORY;
    }
    centre_positions(body, shcd_mesh_vertices(mesh));
    for (size_t t = 0; t < body->n_triangles; ++t) {
        const uint32_t *triangle = body->triangles + 3 * t;
        const shcd_vec3 a = body->positions_m[triangle[0]];
        body->share[t] = 0.5 * shcd_norm(shcd_cross(shcd_sub(body->positions_m[triangle[1]], a),
                                                    shcd_sub(body->positions_m[triangle[2]], a)));
        body->area_m2 += body->share[t];
    }
    for (size_t t = 0; t < body->n_triangles; ++t) {
        body->share[t] /= body->area_m2;
    }
    return SHCD_OK;
}

void shcdi_body_release(shcdi_body *body) {
    free(body->positions_m);
    free(body->share);
    body->positions_m = NULL;
    body->share = NULL;
}

double shcdi_sphere_share(shcd_vec3 a, shcd_vec3 b, shcd_vec3 c) {
    const double det = shcd_dot(a, shcd_cross(shcd_sub(b, a), shcd_sub(c, a)));
    return 2.0 * atan2(det, 1.0 + shcd_dot(a, b) + shcd_dot(b, c) + shcd_dot(c, a)) / four_pi;
}

static size_t count_on_face(const shcdi_body *body, const shcd_vec3 *u, size_t t,
                            uint64_t n_wanted) {
    const uint32_t *triangle = body->triangles + 3 * t;
    double share = body->share[t];
    if (u != NULL) {
        const double on_sphere = shcdi_sphere_share(u[triangle[0]], u[triangle[1]], u[triangle[2]]);
        share = 0.5 * share + 0.5 * fmax(on_sphere, 0.0);
    }
    const double count = ceil((double)n_wanted * share);
    return count > 1.0 ? (size_t)count : 1;
}

static shcd_vec3 mix(const uint32_t *triangle, const shcd_vec3 *x, const double *weights) {
    return shcd_mul_add(
        shcd_mul_add(shcd_scale(weights[0], x[triangle[0]]), weights[1], x[triangle[1]]),
        weights[2], x[triangle[2]]);
}

/* Uniform on the triangle: fold the unit square along its diagonal. */
static void random_barycentric(uint64_t *state, double *weights) {
    const double a = next_uniform(state), b = next_uniform(state);
    const int outside = a + b > 1.0;
    weights[1] = outside ? 1.0 - a : a;
    weights[2] = outside ? 1.0 - b : b;
    weights[0] = 1.0 - weights[1] - weights[2];
}

static void fill(shcdi_samples *samples, const shcdi_body *body, const shcd_vec3 *u,
                 uint64_t n_wanted) {
    uint64_t state = random_seed;
    size_t n = 0;
    for (size_t t = 0; t < body->n_triangles; ++t) {
        const uint32_t *triangle = body->triangles + 3 * t;
        const size_t count = count_on_face(body, u, t, n_wanted);
        for (size_t k = 0; k < count; ++k, ++n) {
            double weights[3];
            random_barycentric(&state, weights);
            samples->points_m[n] = mix(triangle, body->positions_m, weights);
            if (u != NULL) {
                samples->directions[n] = shcd_unit(mix(triangle, u, weights));
            }
            samples->weights[n] = body->share[t] / (double)count;
            samples->faces[n] = (uint32_t)t;
        }
    }
}

shcd_status shcdi_samples_make(shcdi_samples *samples, const shcdi_body *body, const shcd_vec3 *u,
                               uint64_t n_wanted) {
    *samples = (shcdi_samples){0};
    for (size_t t = 0; t < body->n_triangles; ++t) {
        samples->n += count_on_face(body, u, t, n_wanted);
    }
    if (samples->n > SIZE_MAX / sizeof *samples->points_m) {
        return SHCD_ERR_MEMORY;
    }
    samples->points_m = malloc(samples->n * sizeof *samples->points_m);
    samples->directions = u != NULL ? malloc(samples->n * sizeof *samples->directions) : NULL;
    samples->weights = malloc(samples->n * sizeof *samples->weights);
    samples->faces = malloc(samples->n * sizeof *samples->faces);
    if (samples->points_m == NULL || (u != NULL && samples->directions == NULL) ||
        samples->weights == NULL || samples->faces == NULL) {
        shcdi_samples_release(samples);
        return SHCD_ERR_MEMORY;
    }
    fill(samples, body, u, n_wanted);
    return SHCD_OK;
}

void shcdi_samples_release(shcdi_samples *samples) {
    free(samples->points_m);
    free(samples->directions);
    free(samples->weights);
    free(samples->faces);
    *samples = (shcdi_samples){0};
}
