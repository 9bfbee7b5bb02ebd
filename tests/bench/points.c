/* SPDX-License-Identifier: BSD-3-Clause */
/* Query points near a body: what a benchmark of distances should ask is neither far away, where
 * everything is easy, nor on the surface. */
#include "points.h"
#include "shcd/vec.h"

#include <stdio.h>
#include <stdlib.h>

#define BAND 0.05  /* of the diagonal: how far from the surface */
#define STEP 0.001 /* of the diagonal: length of a step of a path */
#define TURN 0.05  /* how much of a step's direction is new */
#define DENSITY_TRIES 4000

void *points_memory(size_t size) {
    void *memory = malloc(size > 0 ? size : 1);
    if (memory == NULL) {
        fputs("bench: out of memory\n", stderr);
        exit(1);
    }
    return memory;
}

uint64_t points_bits(uint64_t *state) {
    uint64_t z = (*state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}

double points_uniform(uint64_t *state, double low, double high) {
    return low + (high - low) * ((double)(points_bits(state) >> 11) * 0x1p-53);
}

/* Uniform on the sphere: a point of the unit ball, by rejection from the cube, pushed outwards. */
static shcd_vec3 random_direction(uint64_t *state) {
    shcd_vec3 v;
    double r2;
    do {
        v.x = points_uniform(state, -1.0, 1.0);
        v.y = points_uniform(state, -1.0, 1.0);
        v.z = points_uniform(state, -1.0, 1.0);
        r2 = shcd_dot(v, v);
    } while (r2 > 1.0 || r2 < 1e-4);
    return shcd_unit(v);
}

static void demand(shcd_status status) {
    if (status != SHCD_OK) {
        fprintf(stderr, "bench: %s\n", shcd_status_string(status));
        exit(1);
    }
}

/* Area of the surface per area of the parameter sphere: |dS e1 x dS e2| for tangents e1, e2 of w,
 * which is the length of the cofactor of the Jacobian along w. */
static double area_density(const shcd_model *model, shcd_vec3 w, shcd_vec3 *point,
                           shcd_vec3 *normal) {
    double j[9];
    demand(shcd_model_surface(model, -1, w, point, normal, j));
    const shcd_vec3 helper =
        fabs(w.x) < 0.6 ? shcd_vec3_make(1.0, 0.0, 0.0) : shcd_vec3_make(0.0, 1.0, 0.0);
    const shcd_vec3 e1 = shcd_unit(shcd_cross(w, helper)), e2 = shcd_cross(w, e1);
    const shcd_vec3 row[3] = {{j[0], j[1], j[2]}, {j[3], j[4], j[5]}, {j[6], j[7], j[8]}};
    const shcd_vec3 a = {shcd_dot(row[0], e1), shcd_dot(row[1], e1), shcd_dot(row[2], e1)};
    const shcd_vec3 b = {shcd_dot(row[0], e2), shcd_dot(row[1], e2), shcd_dot(row[2], e2)};
    return shcd_norm(shcd_cross(a, b));
}

static double diagonal(const shcd_model *model) {
    shcd_model_info info = SHCD_MODEL_INFO_INIT;
    demand(shcd_model_describe(model, &info));
    return info.diagonal_m;
}

void points_random(const shcd_model *model, uint64_t seed, size_t n, double *points) {
    const double band = BAND * diagonal(model);
    shcd_vec3 point, normal;
    double densest = 0.0;
    for (int i = 0; i < DENSITY_TRIES; i++) {
        densest = fmax(densest, area_density(model, random_direction(&seed), &point, &normal));
    }
    for (size_t i = 0; i < n;) {
        const double density = area_density(model, random_direction(&seed), &point, &normal);
        if (points_uniform(&seed, 0.0, densest) < density) {
            const double offset = points_uniform(&seed, -band, band);
            const shcd_vec3 p = shcd_mul_add(point, offset, normal);
            points[3 * i] = p.x;
            points[3 * i + 1] = p.y;
            points[3 * i + 2] = p.z;
            i++;
        }
    }
}

/* A hand that keeps its direction, wanders a little, and turns back at the borders of the band: the
 * push grows with the distance, so that both sides of the surface are visited. */
void points_path(const shcd_model *model, uint64_t seed, size_t n, double *points) {
    const double size = diagonal(model);
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    shcd_proximity near;
    shcd_vec3 p, normal;
    (void)area_density(model, random_direction(&seed), &p, &normal);
    shcd_vec3 way = shcd_unit(shcd_cross(normal, random_direction(&seed)));
    options.tolerance = 1e-6;
    for (size_t i = 0; i < n; i++) {
        demand(shcd_closest(model, p, &options, &near));
        points[3 * i] = p.x;
        points[3 * i + 1] = p.y;
        points[3 * i + 2] = p.z;
        const double excess = near.distance_m / (BAND * size);
        way = shcd_mul_add(way, TURN, random_direction(&seed));
        way = shcd_mul_add(way, -TURN * excess * fabs(excess), near.normal);
        way = shcd_unit(way);
        p = shcd_mul_add(p, STEP * size, way);
    }
}
