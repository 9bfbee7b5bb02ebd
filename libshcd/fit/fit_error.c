/* SPDX-License-Identifier: BSD-3-Clause */
/* Both directions are needed: the surface may be near the mesh everywhere and still miss an ear of
 * it, or follow the mesh and overshoot in between. The mean squares of the two directions are
 * averaged with equal weight.
 *
 * The surface points are visited in a scattered order, so that a search over degrees leaves a
 * hopeless one after a few of them. */
#include "fit_error.h"

#include "triangle_tree.h"

#include <stdlib.h>

#define MESH_SAMPLES 20000
#define FREQUENCY_MIN 48
#define FREQUENCY_PER_DEGREE 2
#define POINTS_PER_REPORT 512
#define MAXIMUM_SHARE 1e-3 /* of the mesh's side of the Hausdorff distance: found to this */
#define MAXIMUM_FLOOR 1e-5 /* of the diagonal, for a fit without error */
#define MAXIMUM_LEVELS 20
#define MAXIMUM_DISTANCES 400000
#define PARALLEL_COSINE 0.86602540378443865 /* 30 degrees */

struct shcdi_comparison {
    const shcdi_body *body;
    shcdi_samples samples;
    shcdi_triangle_tree *tree;
};

shcd_status shcdi_comparison_create(const shcdi_body *body, shcdi_comparison **comparison) {
    shcdi_comparison *c = calloc(1, sizeof *c);
    if (c == NULL) {
        return SHCD_ERR_MEMORY;
    }
    c->body = body;
    shcd_status status = shcdi_samples_make(&c->samples, body, NULL, MESH_SAMPLES);
    if (status == SHCD_OK) {
        status = shcdi_triangle_tree_create(body->positions_m, body->triangles, body->n_triangles,
                                            &c->tree);
    }
    if (status != SHCD_OK) {
        shcdi_comparison_free(c);
        return status;
    }
    *comparison = c;
    return SHCD_OK;
}

void shcdi_comparison_free(shcdi_comparison *comparison) {
    if (comparison != NULL) {
        shcdi_samples_release(&comparison->samples);
        shcdi_triangle_tree_free(comparison->tree);
        free(comparison);
    }
}

/* ---- the surface's side: an icosahedron whose faces are cut into n^2 triangles each ---- */

typedef struct tessellation {
    size_t n_points, n_triangles;
    shcd_vec3 *directions, *points_m;
    uint32_t *triangles;
    double *areas_m2; /* a third of the triangles around each point */
} tessellation;

static void tessellation_release(tessellation *s) {
    free(s->directions);
    free(s->points_m);
    free(s->triangles);
    free(s->areas_m2);
}

static void icosahedron_face(size_t face, shcd_vec3 *corners) {
    static const unsigned char faces[20][3] = {
        {0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
        {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
        {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
    static const double g = 1.6180339887498948482;
    const shcd_vec3 v[12] = {{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0},
                             {0, -1, g}, {0, 1, g}, {0, -1, -g}, {0, 1, -g},
                             {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
    for (int k = 0; k < 3; ++k) {
        corners[k] = shcd_unit(v[faces[face][k]]);
    }
}

/* Points of a face in rows i = 0 .. n of n + 1 - i points. Points on the edges of the icosahedron
 * are made twice: distances do not mind, and the areas around the copies add up. */
static void cut_face(tessellation *s, size_t face, size_t n) {
    shcd_vec3 corner[3];
    icosahedron_face(face, corner);
    const size_t first = face * (n + 1) * (n + 2) / 2;
    size_t p = first, t = face * n * n;
    for (size_t i = 0; i <= n; ++i) {
        for (size_t j = 0; i + j <= n; ++j, ++p) {
            const shcd_vec3 sum = shcd_add(
                shcd_scale((double)(n - i - j), corner[0]),
                shcd_add(shcd_scale((double)i, corner[1]), shcd_scale((double)j, corner[2])));
            s->directions[p] = shcd_unit(sum);
            if (i + j == n) {
                continue;
            }
            const uint32_t self = (uint32_t)p, above = (uint32_t)(p + n + 1 - i);
            uint32_t *triangle = s->triangles + 3 * t++;
            triangle[0] = self;
            triangle[1] = above;
            triangle[2] = self + 1;
            if (i + j + 1 < n) {
                triangle = s->triangles + 3 * t++;
                triangle[0] = above;
                triangle[1] = above + 1;
                triangle[2] = self + 1;
            }
        }
    }
}

static shcd_status tessellation_make(tessellation *s, size_t n) {
    *s = (tessellation){.n_points = 10 * (n + 1) * (n + 2), .n_triangles = 20 * n * n};
    s->directions = malloc(s->n_points * sizeof *s->directions);
    s->points_m = malloc(s->n_points * sizeof *s->points_m);
    s->areas_m2 = calloc(s->n_points, sizeof *s->areas_m2);
    s->triangles = malloc(3 * s->n_triangles * sizeof *s->triangles);
    if (s->directions == NULL || s->points_m == NULL || s->areas_m2 == NULL ||
        s->triangles == NULL) {
        tessellation_release(s);
        return SHCD_ERR_MEMORY;
    }
    for (size_t face = 0; face < 20; ++face) {
        cut_face(s, face, n);
    }
    return SHCD_OK;
}

static void find_areas(tessellation *s) {
    for (size_t t = 0; t < s->n_triangles; ++t) {
        const uint32_t *triangle = s->triangles + 3 * t;
        const shcd_vec3 a = s->points_m[triangle[0]];
        const double area = 0.5 * shcd_norm(shcd_cross(shcd_sub(s->points_m[triangle[1]], a),
                                                       shcd_sub(s->points_m[triangle[2]], a)));
        for (int k = 0; k < 3; ++k) {
            s->areas_m2[triangle[k]] += area / 3.0;
        }
    }
}

/* ---- the two directions ---- */

static shcd_status surface_point(int degree, const double *coefficients_m, shcd_vec3 direction,
                                 double *row, shcd_vec3 *point) {
    const shcd_status status = shcd_harmonics(degree, direction, row, NULL, NULL);
    shcd_vec3 sum = shcd_vec3_make(0.0, 0.0, 0.0);
    for (size_t i = 0; status == SHCD_OK && i < SHCD_COUNT(degree); ++i) {
        const double *c = coefficients_m + 3 * i;
        sum = shcd_mul_add(sum, row[i], shcd_vec3_make(c[0], c[1], c[2]));
    }
    *point = sum;
    return status;
}

/* A stride of about the golden section of n, without a common divisor with n: visits all of 0 ..
 * n-1 and is spread evenly at any time. */
static size_t scattered_stride(size_t n) {
    size_t stride = (size_t)((double)n * 0.6180339887498949) | 1;
    for (;; stride += 2) {
        size_t a = n, b = stride;
        while (b != 0) {
            const size_t rest = a % b;
            a = b;
            b = rest;
        }
        if (a == 1) {
            return stride % n;
        }
    }
}

/* Distances of the surface's points to the mesh; squares[p] keeps them. */
static shcd_status measure_surface(const shcdi_comparison *c, tessellation *s, int degree,
                                   const double *coefficients_m, double stop_above_m,
                                   const shcdi_progress *progress, double *squares,
                                   shcdi_distance *distance) {
    double *row = malloc(SHCD_COUNT(degree) * sizeof *row);
    shcd_status status = row != NULL ? SHCD_OK : SHCD_ERR_MEMORY;
    const size_t stride = scattered_stride(s->n_points);
    size_t p = 0;
    for (size_t k = 0; k < s->n_points && status == SHCD_OK; ++k, p = (p + stride) % s->n_points) {
        if (k % POINTS_PER_REPORT == 0) {
            status =
                shcdi_progress_report(progress, "error", 0.5 * (double)k / (double)s->n_points);
        }
        if (status == SHCD_OK) {
            status = surface_point(degree, coefficients_m, s->directions[p], row, &s->points_m[p]);
        }
        const double d = shcdi_triangle_tree_distance(c->tree, s->points_m[p]);
        squares[p] = d * d;
        distance->hausdorff_m = fmax(distance->hausdorff_m, d);
        if (distance->hausdorff_m > stop_above_m) {
            distance->is_complete = 0;
            break;
        }
    }
    free(row);
    return status;
}

/* The largest distance over whole mesh triangles, not samples alone. The distance to the surface is
 * 1-Lipschitz, so over a triangle it is at most that of the centroid plus the way to the farthest
 * corner; what could still exceed the largest distance found by MAXIMUM_SHARE of it is cut in four.
 */
static void find_mesh_maximum(const shcdi_comparison *c, const shcdi_triangle_tree *surface,
                              double stop_above_m, shcdi_distance *distance) {
    const double floor_m = MAXIMUM_FLOOR * c->body->diagonal_m;
    size_t n_left = MAXIMUM_DISTANCES;
    for (size_t t = 0; t < c->body->n_triangles && n_left > 0; ++t) {
        shcd_vec3 stack[3 * MAXIMUM_LEVELS + 1][3];
        size_t n = 1;
        for (int k = 0; k < 3; ++k) {
            stack[0][k] = c->body->positions_m[c->body->triangles[3 * t + (size_t)k]];
        }
        while (n > 0 && n_left > 0 && distance->hausdorff_m <= stop_above_m) {
            const shcd_vec3 *top = stack[--n];
            const shcd_vec3 x[3] = {top[0], top[1], top[2]};
            const shcd_vec3 centre = shcd_scale(1.0 / 3.0, shcd_add(x[0], shcd_add(x[1], x[2])));
            const double d = shcdi_triangle_tree_distance(surface, centre);
            --n_left;
            double reach = 0.0;
            for (int k = 0; k < 3; ++k) {
                reach = fmax(reach, shcd_norm(shcd_sub(x[k], centre)));
            }
            distance->hausdorff_m = fmax(distance->hausdorff_m, d);
            const double enough =
                distance->hausdorff_m + fmax(MAXIMUM_SHARE * distance->hausdorff_m, floor_m);
            if (d + reach <= enough || n + 4 > sizeof stack / sizeof stack[0]) {
                continue;
            }
            shcd_vec3 middle[3];
            for (int k = 0; k < 3; ++k) {
                middle[k] = shcd_scale(0.5, shcd_add(x[k], x[(k + 1) % 3]));
            }
            for (int k = 0; k < 3; ++k) {
                stack[n][0] = x[k];
                stack[n][1] = middle[k];
                stack[n++][2] = middle[(k + 2) % 3];
            }
            for (int k = 0; k < 3; ++k) {
                stack[n][k] = middle[k];
            }
            ++n;
        }
    }
    if (distance->hausdorff_m > stop_above_m) {
        distance->is_complete = 0;
    }
}

/* Distances of the mesh's samples and vertices to the tessellated surface. */
static shcd_status measure_mesh(const shcdi_comparison *c, const tessellation *s,
                                double stop_above_m, const shcdi_progress *progress,
                                double *mean_square, shcdi_distance *distance) {
    shcdi_triangle_tree *tree = NULL;
    shcd_status status =
        shcdi_triangle_tree_create(s->points_m, s->triangles, s->n_triangles, &tree);
    const size_t n_vertices = c->body->n_vertices, n = n_vertices + c->samples.n;
    *mean_square = 0.0;
    for (size_t k = 0; k < n && status == SHCD_OK; ++k) {
        if (k % POINTS_PER_REPORT == 0) {
            status = shcdi_progress_report(progress, "error", 0.5 + 0.5 * (double)k / (double)n);
        }
        const int is_vertex = k < n_vertices;
        const size_t i = is_vertex ? k : k - n_vertices;
        const double d = shcdi_triangle_tree_distance(tree, is_vertex ? c->body->positions_m[i]
                                                                      : c->samples.points_m[i]);
        *mean_square += is_vertex ? 0.0 : c->samples.weights[i] * d * d;
        distance->hausdorff_m = fmax(distance->hausdorff_m, d);
        if (distance->hausdorff_m > stop_above_m) {
            distance->is_complete = 0;
            break;
        }
    }
    if (status == SHCD_OK && distance->is_complete) {
        find_mesh_maximum(c, tree, stop_above_m, distance);
    }
    shcdi_triangle_tree_free(tree);
    return status;
}

shcd_status shcdi_comparison_measure(shcdi_comparison *comparison, int degree,
                                     const double *coefficients_m, double stop_above_m,
                                     const shcdi_progress *progress, shcdi_distance *distance) {
    const int frequency = FREQUENCY_PER_DEGREE * degree;
    tessellation s;
    shcd_status status =
        tessellation_make(&s, (size_t)(frequency > FREQUENCY_MIN ? frequency : FREQUENCY_MIN));
    if (status != SHCD_OK) {
        return status;
    }
    double *squares = malloc(s.n_points * sizeof *squares);
    double mesh_square = 0.0;
    *distance = (shcdi_distance){.is_complete = 1};
    status = squares == NULL ? SHCD_ERR_MEMORY
                             : measure_surface(comparison, &s, degree, coefficients_m, stop_above_m,
                                               progress, squares, distance);
    if (status == SHCD_OK && distance->is_complete) {
        status = measure_mesh(comparison, &s, stop_above_m, progress, &mesh_square, distance);
    }
    if (status == SHCD_OK && distance->is_complete) {
        double sum = 0.0, total = 0.0;
        find_areas(&s);
        for (size_t p = 0; p < s.n_points; ++p) {
            sum += s.areas_m2[p] * squares[p];
            total += s.areas_m2[p];
        }
        distance->rms_m = sqrt(0.5 * (mesh_square + (total > 0.0 ? sum / total : 0.0)));
    }
    free(squares);
    tessellation_release(&s);
    return status;
}

/* ---- properties of the mesh and of the map ---- */

static shcd_vec3 normal_of(const shcdi_body *body, size_t t) {
    const uint32_t *triangle = body->triangles + 3 * t;
    const shcd_vec3 a = body->positions_m[triangle[0]];
    return shcd_unit(shcd_cross(shcd_sub(body->positions_m[triangle[1]], a),
                                shcd_sub(body->positions_m[triangle[2]], a)));
}

double shcdi_comparison_thickness(const shcdi_comparison *comparison) {
    const shcdi_body *body = comparison->body;
    double thickness_m = HUGE_VAL, any_m = HUGE_VAL;
    for (size_t i = 0; i < comparison->samples.n; ++i) {
        const uint32_t own = comparison->samples.faces[i];
        const shcd_vec3 normal = normal_of(body, own);
        uint32_t hit = own;
        if (!(shcd_dot(normal, normal) > 0.5)) {
            continue; /* a face without area has no inside */
        }
        const double length = shcdi_triangle_tree_ray(
            comparison->tree, comparison->samples.points_m[i], shcd_scale(-1.0, normal), own, &hit);
        any_m = fmin(any_m, length);
        if (shcd_dot(normal, normal_of(body, hit)) < -PARALLEL_COSINE) {
            thickness_m = fmin(thickness_m, length);
        }
    }
    const double found = isfinite(thickness_m) ? thickness_m : any_m;
    return isfinite(found) ? found : 0.0;
}

void shcdi_area_ratios(const shcdi_body *body, const shcd_vec3 *u, shcd_fit_record *record) {
    const double floor_share = 1e-4 / (double)body->n_triangles;
    double least = HUGE_VAL, most = 0.0, sum = 0.0, total = 0.0;
    for (size_t t = 0; t < body->n_triangles; ++t) {
        const uint32_t *triangle = body->triangles + 3 * t;
        if (body->share[t] < floor_share) {
            continue;
        }
        const double ratio =
            shcdi_sphere_share(u[triangle[0]], u[triangle[1]], u[triangle[2]]) / body->share[t];
        const double log_ratio = log(ratio);
        least = fmin(least, ratio);
        most = fmax(most, ratio);
        sum += body->share[t] * log_ratio * log_ratio;
        total += body->share[t];
    }
    record->area_ratio_min = least;
    record->area_ratio_max = most;
    record->area_log_ratio_rms = sqrt(sum / total);
}
