/* SPDX-License-Identifier: BSD-3-Clause */
/* The surface as triangles: what the peers search, and an oracle that shares no code with the
 * queries. */
#include "points.h"
#include "shcd/vec.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define GOLDEN 1.6180339887498949

typedef struct sphere {
    shcd_vec3 *w;
    uint32_t *triangles;
    size_t n_vertices, n_triangles;
} sphere;

static sphere icosahedron(size_t vertices_max, size_t triangles_max) {
    static const double corner[12][3] = {{-1, GOLDEN, 0},  {1, GOLDEN, 0},   {-1, -GOLDEN, 0},
                                         {1, -GOLDEN, 0},  {0, -1, GOLDEN},  {0, 1, GOLDEN},
                                         {0, -1, -GOLDEN}, {0, 1, -GOLDEN},  {GOLDEN, 0, -1},
                                         {GOLDEN, 0, 1},   {-GOLDEN, 0, -1}, {-GOLDEN, 0, 1}};
    static const uint32_t face[60] = {0, 11, 5, 0, 5,  1,  0,  1,  7,  0,  7, 10, 0, 10, 11,
                                      1, 5,  9, 5, 11, 4,  11, 10, 2,  10, 7, 6,  7, 1,  8,
                                      3, 9,  4, 3, 4,  2,  3,  2,  6,  3,  6, 8,  3, 8,  9,
                                      4, 9,  5, 2, 4,  11, 6,  2,  10, 8,  6, 7,  9, 8,  1};
    sphere s = {points_memory(vertices_max * sizeof *s.w),
                points_memory(3 * triangles_max * sizeof *s.triangles), 12, 20};
    for (size_t i = 0; i < 12; i++) {
        s.w[i] = shcd_unit(shcd_vec3_make(corner[i][0], corner[i][1], corner[i][2]));
    }
    memcpy(s.triangles, face, sizeof face);
    return s;
}

/* Middle of an edge, made once: `edges` holds for each vertex the few edges to a higher one. */
typedef struct midpoint {
    uint32_t other, middle;
} midpoint;
#define EDGES_MAX 6

static uint32_t middle_of(sphere *s, midpoint *edges, uint32_t a, uint32_t b) {
    midpoint *row = edges + (size_t)EDGES_MAX * (a < b ? a : b);
    const uint32_t other = a < b ? b : a;
    while (row->middle != 0 && row->other != other) {
        row++;
    }
    if (row->middle == 0) { /* vertex 0 is never the middle of an edge */
        row->other = other;
        row->middle = (uint32_t)s->n_vertices;
        s->w[s->n_vertices++] = shcd_unit(shcd_add(s->w[a], s->w[b]));
    }
    return row->middle;
}

static void subdivide(sphere *s) {
    const size_t n = s->n_triangles;
    midpoint *edges = points_memory(s->n_vertices * EDGES_MAX * sizeof *edges);
    memset(edges, 0, s->n_vertices * EDGES_MAX * sizeof *edges);
    for (size_t t = 0; t < n; t++) {
        uint32_t *old = s->triangles + 3 * t;
        const uint32_t a = old[0], b = old[1], c = old[2];
        const uint32_t ab = middle_of(s, edges, a, b), bc = middle_of(s, edges, b, c),
                       ca = middle_of(s, edges, c, a);
        const uint32_t made[9] = {a, ab, ca, b, bc, ab, c, ca, bc};
        memcpy(s->triangles + 3 * s->n_triangles, made, sizeof made);
        old[0] = ab;
        old[1] = bc;
        old[2] = ca;
        s->n_triangles += 3;
    }
    free(edges);
}

/* Over a spherical triangle let q run over the flat triangle of its corners and S(q/|q|) be
 * compared with the linear interpolant of S at the corners. With R the angle of the circumradius,
 * |q| >= c = cos R, and S(q/|q|) has second derivatives along lines of at most M2/c^2 + 2 M1 sin
 * R/c^3, M1 and M2 the model's proven bounds of |S'| and |S''| along great circles
 * (libshcd/model/bounds.c). The error of linear interpolation on a triangle that fits into a ball
 * of radius rho <= h/sqrt(3), h its longest edge, is at most rho^2/2 times that. q -> q/|q| is onto
 * both ways, so this bounds the Hausdorff distance of surface and triangles. */
static double deviation(const sphere *s, double first, double second) {
    double worst = 0.0;
    for (size_t t = 0; t < s->n_triangles; t++) {
        const shcd_vec3 a = s->w[s->triangles[3 * t]], b = s->w[s->triangles[3 * t + 1]],
                        c = s->w[s->triangles[3 * t + 2]];
        const double ab = shcd_norm(shcd_sub(a, b)), bc = shcd_norm(shcd_sub(b, c)),
                     ca = shcd_norm(shcd_sub(c, a));
        const double twice_area = shcd_norm(shcd_cross(shcd_sub(b, a), shcd_sub(c, a)));
        const double sin_r = ab * bc * ca / (2.0 * twice_area); /* circumradius of the chords */
        const double cos_r = sqrt(1.0 - sin_r * sin_r), h = fmax(ab, fmax(bc, ca));
        const double eps =
            h * h / 3.0 *
            (second / (cos_r * cos_r) + 2.0 * first * sin_r / (cos_r * cos_r * cos_r)) / 2.0;
        worst = fmax(worst, eps);
    }
    return worst * (1.0 + 1e-12); /* this sum's own rounding */
}

static void place(const shcd_model *model, const sphere *s, double **vertices_m,
                  double *deviation_m) {
    shcd_model_info info = SHCD_MODEL_INFO_INIT;
    *vertices_m = points_memory(3 * s->n_vertices * sizeof(double));
    for (size_t i = 0; i < s->n_vertices; i++) {
        shcd_vec3 x;
        if (shcd_model_surface(model, -1, s->w[i], &x, NULL, NULL) != SHCD_OK) {
            fputs("bench: shcd_model_surface failed\n", stderr);
            exit(1);
        }
        (*vertices_m)[3 * i] = x.x;
        (*vertices_m)[3 * i + 1] = x.y;
        (*vertices_m)[3 * i + 2] = x.z;
    }
    if (shcd_model_describe(model, &info) != SHCD_OK) {
        fputs("bench: shcd_model_describe failed\n", stderr);
        exit(1);
    }
    *deviation_m = deviation(s, info.max_first_derivative_m, info.max_second_derivative_m);
}

void points_mesh(const shcd_model *model, const shcd_model *moved, int level, bench_mesh *mesh) {
    const size_t fours = (size_t)1 << (2 * level);
    shcd_model_info info = SHCD_MODEL_INFO_INIT;
    sphere s = icosahedron(10 * fours + 2, 20 * fours);
    for (int i = 0; i < level; i++) {
        subdivide(&s);
    }
    mesh->n_vertices = s.n_vertices;
    mesh->n_triangles = s.n_triangles;
    mesh->triangles = s.triangles;
    place(model, &s, &mesh->vertices_m, &mesh->deviation_m);
    place(moved, &s, &mesh->moved_m, &mesh->moved_deviation_m);
    mesh->diagonal_m = shcd_model_describe(model, &info) == SHCD_OK ? info.diagonal_m : 0.0;
    free(s.w);
}

void points_mesh_free(bench_mesh *mesh) {
    free(mesh->vertices_m);
    free(mesh->moved_m);
    free(mesh->triangles);
    memset(mesh, 0, sizeof *mesh);
}

static double segment_distance2(shcd_vec3 p, shcd_vec3 a, shcd_vec3 b) {
    const shcd_vec3 ab = shcd_sub(b, a), ap = shcd_sub(p, a);
    const double t = fmin(1.0, fmax(0.0, shcd_dot(ap, ab) / shcd_dot(ab, ab)));
    const shcd_vec3 d = shcd_mul_add(ap, -t, ab);
    return shcd_dot(d, d);
}

/* Above the inside of a triangle the plane is nearest, else one of its edges. */
static double triangle_distance2(shcd_vec3 p, shcd_vec3 a, shcd_vec3 b, shcd_vec3 c) {
    const shcd_vec3 n = shcd_cross(shcd_sub(b, a), shcd_sub(c, a));
    const int inside = shcd_dot(shcd_cross(shcd_sub(b, a), shcd_sub(p, a)), n) >= 0.0 &&
                       shcd_dot(shcd_cross(shcd_sub(c, b), shcd_sub(p, b)), n) >= 0.0 &&
                       shcd_dot(shcd_cross(shcd_sub(a, c), shcd_sub(p, c)), n) >= 0.0;
    if (inside) {
        const double height = shcd_dot(shcd_sub(p, a), n);
        return height * height / shcd_dot(n, n);
    }
    return fmin(segment_distance2(p, a, b),
                fmin(segment_distance2(p, b, c), segment_distance2(p, c, a)));
}

static void corners(const bench_mesh *mesh, const double *vertices_m, size_t t,
                    shcd_vec3 corner[3]) {
    for (size_t k = 0; k < 3; k++) {
        const double *v = vertices_m + 3 * (size_t)mesh->triangles[3 * t + k];
        corner[k] = shcd_vec3_make(v[0], v[1], v[2]);
    }
}

double points_mesh_distance(const bench_mesh *mesh, const double *vertices_m,
                            const double point[3]) {
    const shcd_vec3 p = shcd_vec3_make(point[0], point[1], point[2]);
    double best = HUGE_VAL;
    for (size_t t = 0; t < mesh->n_triangles; t++) {
        shcd_vec3 c[3];
        corners(mesh, vertices_m, t, c);
        best = fmin(best, triangle_distance2(p, c[0], c[1], c[2]));
    }
    return sqrt(best);
}

/* tan(solid angle/2) = det(a, b, c)/(|a||b||c| + (a.b)|c| + (b.c)|a| + (c.a)|b|)
 * (Van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30 (1983)). */
double points_mesh_winding(const bench_mesh *mesh, const double *vertices_m,
                           const double point[3]) {
    const shcd_vec3 p = shcd_vec3_make(point[0], point[1], point[2]);
    double angle = 0.0;
    for (size_t t = 0; t < mesh->n_triangles; t++) {
        shcd_vec3 c[3];
        corners(mesh, vertices_m, t, c);
        const shcd_vec3 a = shcd_sub(c[0], p), b = shcd_sub(c[1], p), d = shcd_sub(c[2], p);
        const double la = shcd_norm(a), lb = shcd_norm(b), ld = shcd_norm(d);
        angle += 2.0 * atan2(shcd_dot(a, shcd_cross(b, d)), la * lb * ld + shcd_dot(a, b) * ld +
                                                                shcd_dot(b, d) * la +
                                                                shcd_dot(d, a) * lb);
    }
    return angle / (4.0 * 3.14159265358979324);
}
