/* SPDX-License-Identifier: BSD-3-Clause */
/* A surface is sampled through a triangulation of its parameter sphere: a triangle by the area of
 * its image, then a point of it by barycentric coordinates, lifted to the true surface. Inside a
 * triangle of 20480 the area element varies too little to matter for a statistic. */
#include "cost_points.h"

#include "sphere_mesh.h"

#include "shcd/query.h"
#include "shcd/vec.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SAMPLER_LEVEL 5
#define PATH_PERIOD 400.0 /* steps from the deepest point to the next deepest */
#define PI 3.14159265358979323846

struct cost_sampler {
    const shcd_model *model;
    sphere_mesh mesh;
    double *area; /**< of the images of triangles 0 .. i together */
};

/* splitmix64: Steele, Lea, Flood, Fast splittable pseudorandom number generators, OOPSLA (2014) */
double cost_random_next(cost_random *random) {
    random->state += 0x9e3779b97f4a7c15u;
    uint64_t z = random->state;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    z ^= z >> 31;
    return (double)(z >> 11) * 0x1p-53;
}

/* The arguments are in order by construction, so the call cannot fail. */
static void evaluate(const shcd_model *model, shcd_vec3 w, shcd_vec3 *point, shcd_vec3 *normal,
                     double *jacobian) {
    if (shcd_model_surface(model, -1, w, point, normal, jacobian) != SHCD_OK) {
        abort();
    }
}

cost_sampler *cost_sampler_create(const shcd_model *model) {
    cost_sampler *sampler = calloc(1, sizeof *sampler);
    if (sampler == NULL || !sphere_mesh_create(SAMPLER_LEVEL, &sampler->mesh)) {
        free(sampler);
        return NULL;
    }
    const sphere_mesh *mesh = &sampler->mesh;
    sampler->model = model;
    sampler->area = malloc(mesh->n_triangles * sizeof *sampler->area);
    shcd_vec3 *image = malloc(mesh->n_vertices * sizeof *image);
    if (sampler->area == NULL || image == NULL) {
        free(image);
        cost_sampler_free(sampler);
        return NULL;
    }
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        evaluate(model, mesh->vertices[i], &image[i], NULL, NULL);
    }
    double sum = 0.0;
    for (size_t t = 0; t < mesh->n_triangles; t++) {
        const uint32_t *corner = mesh->triangles[t];
        const shcd_vec3 a = image[corner[0]];
        sum += 0.5 *
               shcd_norm(shcd_cross(shcd_sub(image[corner[1]], a), shcd_sub(image[corner[2]], a)));
        sampler->area[t] = sum;
    }
    free(image);
    return sampler;
}

void cost_sampler_free(cost_sampler *sampler) {
    if (sampler != NULL) {
        sphere_mesh_free(&sampler->mesh);
        free(sampler->area);
        free(sampler);
    }
}

void cost_sampler_draw(const cost_sampler *sampler, cost_random *random, shcd_vec3 *point,
                       shcd_vec3 *normal) {
    const sphere_mesh *mesh = &sampler->mesh;
    const double wanted = cost_random_next(random) * sampler->area[mesh->n_triangles - 1];
    size_t low = 0, high = mesh->n_triangles - 1;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (sampler->area[middle] > wanted) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    const uint32_t *corner = mesh->triangles[low];
    const double root = sqrt(cost_random_next(random));
    const double share = cost_random_next(random);
    shcd_vec3 w = shcd_scale(1.0 - root, mesh->vertices[corner[0]]);
    w = shcd_mul_add(w, root * (1.0 - share), mesh->vertices[corner[1]]);
    w = shcd_mul_add(w, root * share, mesh->vertices[corner[2]]);
    evaluate(sampler->model, w, point, normal, NULL);
}

static bool reserve(size_t n, cost_points *points) {
    memset(points, 0, sizeof *points);
    points->n = n;
    points->point = malloc(n * sizeof *points->point);
    points->distance_m = malloc(n * sizeof *points->distance_m);
    points->normal = malloc(n * sizeof *points->normal);
    points->before = malloc(n * sizeof *points->before);
    if (points->point == NULL || points->distance_m == NULL || points->normal == NULL ||
        points->before == NULL) {
        cost_points_free(points);
        return false;
    }
    return true;
}

/* Uniform on the sphere: Archimedes' projection from the cylinder keeps areas. */
static shcd_vec3 random_direction(cost_random *random) {
    const double z = 2.0 * cost_random_next(random) - 1.0;
    const double phi = 2.0 * PI * cost_random_next(random);
    const double r = sqrt(1.0 - z * z);
    return shcd_vec3_make(r * cos(phi), r * sin(phi), z);
}

bool cost_points_random(const cost_sampler *sampler, double diagonal_m, size_t n,
                        cost_random *random, cost_points *points) {
    if (!reserve(n, points)) {
        return false;
    }
    for (size_t i = 0; i < n; i++) {
        shcd_vec3 normal;
        const double band = i % 2 == 0 ? COST_CONTACT_BAND : COST_NEAR_BAND;
        cost_sampler_draw(sampler, random, &points->point[i], &normal);
        const double offset = band * diagonal_m * (2.0 * cost_random_next(random) - 1.0);
        points->point[i] = shcd_mul_add(points->point[i], offset, normal);
        points->before[i] =
            shcd_mul_add(points->point[i], COST_PATH_STEP * diagonal_m, random_direction(random));
    }
    return true;
}

/* w and its direction of travel turn about an axis that is not their own, so that the path does
 * not close and covers the sphere. */
static void advance(shcd_vec3 *w, shcd_vec3 *along, double angle) {
    const double bend = 0.07; /* the curve of the path: a share of the turn */
    const shcd_vec3 side = shcd_cross(*w, *along);
    const shcd_vec3 next = shcd_add(shcd_scale(cos(angle), *w), shcd_scale(sin(angle), *along));
    const shcd_vec3 straight = shcd_sub(shcd_scale(cos(angle), *along), shcd_scale(sin(angle), *w));
    *w = shcd_unit(next);
    const shcd_vec3 turned = shcd_mul_add(straight, bend * angle, side);
    *along = shcd_unit(shcd_mul_add(turned, -shcd_dot(turned, *w), *w));
}

/* |dS along a tangent| for one radian */
static double speed_along(const double jacobian[9], shcd_vec3 t) {
    double sum = 0.0;
    for (int k = 0; k < 3; k++) {
        const double v =
            jacobian[3 * k] * t.x + jacobian[3 * k + 1] * t.y + jacobian[3 * k + 2] * t.z;
        sum += v * v;
    }
    return sqrt(sum);
}

bool cost_points_path(const shcd_model *model, double diagonal_m, size_t n, cost_random *random,
                      cost_points *points) {
    if (!reserve(n, points)) {
        return false;
    }
    shcd_vec3 w = shcd_unit(shcd_vec3_make(0.4 + cost_random_next(random), 0.3, -0.5));
    shcd_vec3 along = shcd_unit(shcd_cross(w, shcd_vec3_make(0.2, -0.7, 0.6)));
    for (size_t i = 0; i < n; i++) {
        shcd_vec3 normal;
        double jacobian[9];
        evaluate(model, w, &points->point[i], &normal, jacobian);
        const double phase = 2.0 * PI * (double)i / PATH_PERIOD;
        points->point[i] =
            shcd_mul_add(points->point[i], COST_PATH_DEPTH * diagonal_m * sin(phase), normal);
        points->before[i] = points->point[i > 0 ? i - 1 : 0];
        /* where the surface is singular along the path it is crossed at a hundredth of a radian */
        const double speed = speed_along(jacobian, along);
        advance(&w, &along, fmin(0.01, COST_PATH_STEP * diagonal_m / fmax(speed, 1e-300)));
    }
    return true;
}

void cost_points_free(cost_points *points) {
    free(points->point);
    free(points->distance_m);
    free(points->normal);
    free(points->before);
    free(points->mesh_m);
    memset(points, 0, sizeof *points);
}

void cost_points_ask(const shcd_model *model, size_t first, size_t n, cost_points *points) {
    for (size_t i = first; i < first + n; i++) {
        shcd_proximity answer;
        shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
        options.tolerance = COST_TRUTH;
        const shcd_status status = shcd_closest(model, points->point[i], &options, &answer);
        const bool known = status == SHCD_OK && (answer.flags & SHCD_PROXIMITY_TRUNCATED) == 0;
        points->distance_m[i] = known ? answer.distance_m : (double)NAN;
        points->normal[i] = known ? answer.normal : shcd_vec3_make(0.0, 0.0, 0.0);
        points->n_unknown += known ? 0 : 1;
    }
}
