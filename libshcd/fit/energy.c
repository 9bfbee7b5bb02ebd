/* SPDX-License-Identifier: BSD-3-Clause */
/* Energy of a map of the mesh onto the unit sphere, one term per triangle t with corners u1,u2,u3:
 *
 *   E_t = w_t [ D_t / (A_t chi) + lambda (q^2 + 1) / (2 chi) ],   q = det(u1,u2,u3) / (2 A_t),
 *   chi = (q + sqrt(q^2 + eps^2)) / 2.
 *
 * D_t is the Dirichlet energy of the chord triangle with the cotangents of the mesh triangle, A_t
 * the mesh area (sum 4 pi), w_t its share. D/(A q) measures the angles, (q + 1/q)/2 the areas; both
 * grow without bound as q falls to 0. With eps > 0 the barrier is smooth and finite also for folded
 * triangles and pulls them open; with eps = 0 it keeps an unfolded map unfolded.
 *
 * det, the volume spanned with the centre, is what must stay positive: the area of the flat
 * triangle would not do, since three points of one great circle span a flat triangle of positive
 * area.
 *
 * The regularised barrier is that of Garanzha, Kaporin, Kudryavtseva, Protais, Ray, Sokolov,
 * "Foldover-free maps in 50 lines of code", ACM Trans. Graph. 40(4), 2021, moved to the sphere. */
#include "energy.h"

#include <stdlib.h>

static const double four_pi = 12.566370614359172954;

/* A triangle flatter than this (height over longest edge about 2 %) or smaller than 1e-4 of the
 * mean has no usable cotangents; it gets those of an equilateral triangle of the floored area. */
#define FLOOR_OF_MEAN_AREA 1e-4
#define FLOOR_OF_EDGE_SQUARED 0.01

/* Clamp of one triangle's share in an edge weight: two shares make [0.05, 10]. */
#define COTANGENT_SHARE_MIN 0.025
#define COTANGENT_SHARE_MAX 5.0

/* The stiffness of the barrier grows as q^-3; beyond this it would drown the rest of the matrix in
 * rounding (1e9 of 1e16), and the line search does what is left. */
#define STIFFNESS_RATIO_MIN 1e-3

typedef struct corners {
    shcd_vec3 u[3];
    shcd_vec3 edge[3]; /* edge k is opposite corner k */
    double square[3];  /* squared lengths of the edges */
    double det;
} corners;

static corners corners_of(const uint32_t *triangle, const shcd_vec3 *u) {
    corners c;
    for (int k = 0; k < 3; ++k) {
        c.u[k] = u[triangle[k]];
    }
    for (int k = 0; k < 3; ++k) {
        c.edge[k] = shcd_sub(c.u[(k + 2) % 3], c.u[(k + 1) % 3]);
        c.square[k] = shcd_dot(c.edge[k], c.edge[k]);
    }
    /* u1 . (u2 x u3) from edges: the products are small where the triangle is, so is the rounding
     */
    c.det = shcd_dot(c.u[0], shcd_cross(c.edge[2], shcd_sub(c.u[2], c.u[0])));
    return c;
}

static double dirichlet(const corners *c, const double *cotangent) {
    return 0.25 * (cotangent[0] * c->square[0] + cotangent[1] * c->square[1] +
                   cotangent[2] * c->square[2]);
}

static void set_shape(shcdi_energy *energy, size_t t, const corners *c, double area,
                      double mean_area) {
    double longest = 0.0;
    for (int k = 0; k < 3; ++k) {
        longest = fmax(longest, c->square[k]);
    }
    const double floor_area = fmax(FLOOR_OF_MEAN_AREA * mean_area, FLOOR_OF_EDGE_SQUARED * longest);
    const int floored = !(area >= floor_area);
    energy->n_floored += (uint64_t)floored;
    energy->area[t] = floored ? floor_area : area;
    for (int k = 0; k < 3; ++k) {
        const double dot = -shcd_dot(c->edge[(k + 1) % 3], c->edge[(k + 2) % 3]);
        energy->cotangent[3 * t + (size_t)k] = floored ? 0.57735026918962576 : dot / (2.0 * area);
    }
}

static double flat_area(const corners *c) {
    return 0.5 * shcd_norm(shcd_cross(c->edge[2], shcd_sub(c->u[2], c->u[0])));
}

shcd_status shcdi_energy_init(shcdi_energy *energy, const shcd_vec3 *positions, size_t n_vertices,
                              const uint32_t *triangles, size_t n_triangles) {
    *energy = (shcdi_energy){.n_vertices = n_vertices,
                             .n_triangles = n_triangles,
                             .triangles = triangles,
                             .area_weight = 1.0};
    energy->area = malloc(n_triangles * sizeof *energy->area);
    energy->cotangent = malloc(3 * n_triangles * sizeof *energy->cotangent);
    energy->vertex_area = calloc(n_vertices, sizeof *energy->vertex_area);
    if (energy->area == NULL || energy->cotangent == NULL || energy->vertex_area == NULL) {
        shcdi_energy_release(energy);
        return SHCD_ERR_MEMORY;
    }
    double total = 0.0;
    for (size_t t = 0; t < n_triangles; ++t) {
        const corners c = corners_of(triangles + 3 * t, positions);
        energy->area[t] = flat_area(&c);
        total += energy->area[t];
    }
    const double mean_area = total / (double)n_triangles;
    double floored_total = 0.0;
    for (size_t t = 0; t < n_triangles; ++t) {
        const corners c = corners_of(triangles + 3 * t, positions);
        set_shape(energy, t, &c, energy->area[t], mean_area);
        floored_total += energy->area[t];
    }
    for (size_t t = 0; t < n_triangles; ++t) {
        energy->area[t] *= four_pi / floored_total;
        for (int k = 0; k < 3; ++k) {
            energy->vertex_area[triangles[3 * t + (size_t)k]] += energy->area[t] / (3.0 * four_pi);
        }
    }
    return SHCD_OK;
}

void shcdi_energy_release(shcdi_energy *energy) {
    free(energy->area);
    free(energy->cotangent);
    free(energy->vertex_area);
    energy->area = energy->cotangent = energy->vertex_area = NULL;
}

/* chi and its derivative by q; the second form of chi avoids cancellation for q < 0 */
static double barrier(double q, double eps, double *derivative) {
    if (eps == 0.0) {
        *derivative = 1.0;
        return q;
    }
    const double r = sqrt(q * q + eps * eps);
    const double chi = q > 0.0 ? 0.5 * (q + r) : 0.5 * eps * eps / (r - q);
    *derivative = chi / r;
    return chi;
}

static void add_gradient(const corners *c, const double *cotangent, double by_dirichlet,
                         double by_det, const uint32_t *triangle, shcd_vec3 *gradient) {
    shcd_vec3 pull[3]; /* derivative by edge vector k: D = sum cot_k |edge_k|^2 / 4 */
    for (int k = 0; k < 3; ++k) {
        pull[k] = shcd_scale(0.5 * by_dirichlet * cotangent[k], c->edge[k]);
    }
    for (int k = 0; k < 3; ++k) {
        const int next = (k + 1) % 3, last = (k + 2) % 3;
        shcd_vec3 *g = &gradient[triangle[k]];
        *g = shcd_add(*g, shcd_sub(pull[next], pull[last]));
        *g = shcd_mul_add(*g, by_det, shcd_cross(c->u[next], c->u[last]));
    }
}

double shcdi_energy_value(const shcdi_energy *energy, const shcd_vec3 *u, double eps,
                          shcd_vec3 *gradient) {
    const double lambda = energy->area_weight;
    double sum = 0.0;
    if (gradient != NULL) {
        for (size_t i = 0; i < energy->n_vertices; ++i) {
            gradient[i] = shcd_vec3_make(0.0, 0.0, 0.0);
        }
    }
    for (size_t t = 0; t < energy->n_triangles; ++t) {
        const uint32_t *triangle = energy->triangles + 3 * t;
        const corners c = corners_of(triangle, u);
        if (eps == 0.0 && !(c.det > SHCDI_DET_MIN)) {
            return HUGE_VAL;
        }
        const double area = energy->area[t], weight = area / four_pi;
        const double *cotangent = energy->cotangent + 3 * t;
        const double q = c.det / (2.0 * area);
        double slope;
        const double chi = barrier(q, eps, &slope);
        const double numerator = dirichlet(&c, cotangent) / area + 0.5 * lambda * (q * q + 1.0);
        sum += weight * numerator / chi;
        if (gradient != NULL) {
            const double by_q = weight * (lambda * q - numerator * slope / chi) / chi;
            add_gradient(&c, cotangent, weight / (chi * area), by_q / (2.0 * area), triangle,
                         gradient);
        }
    }
    return sum;
}

void shcdi_energy_stiffness(const shcdi_energy *energy, const shcd_vec3 *u, double *weights) {
    for (size_t t = 0; t < energy->n_triangles; ++t) {
        const corners c = corners_of(energy->triangles + 3 * t, u);
        const double area = energy->area[t], weight = area / four_pi;
        const double *cotangent = energy->cotangent + 3 * t;
        const double q = fmax(c.det / (2.0 * area), STIFFNESS_RATIO_MIN);
        const double numerator =
            dirichlet(&c, cotangent) / area + 0.5 * energy->area_weight * (q * q + 1.0);
        const double longest = fmax(c.square[0], fmax(c.square[1], c.square[2]));
        /* second derivatives of D/(A chi) by the edges, and of 1/chi by q, with |dq/du| <= l/2A */
        const double angle = 0.5 * weight / (area * q);
        const double barrier_stiffness =
            0.5 * weight * numerator * longest / (q * q * q * 4.0 * area * area);
        for (size_t k = 0; k < 3; ++k) {
            weights[3 * t + k] =
                angle * fmax(cotangent[k], 2.0 * COTANGENT_SHARE_MIN) + barrier_stiffness;
        }
    }
}

void shcdi_energy_cotangent_weights(const shcdi_energy *energy, double *weights) {
    for (size_t k = 0; k < 3 * energy->n_triangles; ++k) {
        const double share = 0.5 * energy->cotangent[k];
        weights[k] = fmin(fmax(share, COTANGENT_SHARE_MIN), COTANGENT_SHARE_MAX) / four_pi;
    }
}

double shcdi_energy_coverage(const shcdi_energy *energy, const shcd_vec3 *u) {
    double sum = 0.0;
    for (size_t t = 0; t < energy->n_triangles; ++t) {
        const corners c = corners_of(energy->triangles + 3 * t, u);
        /* Van Oosterom, Strackee, "The solid angle of a plane triangle", IEEE Trans. Biomed. Eng.
         * 30(2), 1983, with u_i . u_j = 1 - |u_i - u_j|^2 / 2 */
        sum += atan2(c.det, 4.0 - 0.5 * (c.square[0] + c.square[1] + c.square[2]));
    }
    return 2.0 * sum / four_pi;
}

uint64_t shcdi_energy_count_folds(const shcdi_energy *energy, const shcd_vec3 *u,
                                  double *min_ratio) {
    uint64_t n_folded = 0;
    double least = HUGE_VAL;
    for (size_t t = 0; t < energy->n_triangles; ++t) {
        const corners c = corners_of(energy->triangles + 3 * t, u);
        n_folded += !(c.det > SHCDI_DET_MIN);
        least = fmin(least, c.det / (2.0 * energy->area[t]));
    }
    *min_ratio = least;
    return n_folded;
}
