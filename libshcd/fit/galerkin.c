/* SPDX-License-Identifier: BSD-3-Clause */
/* Assembly that uses the product structure of the harmonics. On a parallel a product of two of them
 * is P_l(z) P_l'(z) times a product of a cosine or sine of m phi and one of m' phi, so that a ring
 * of nodes enters the matrices through the moments of its weights in longitude: (degree+1)^4
 * operations for a ring instead of one for each node.
 *
 * With I the inverse metric and dY = (slope T, turn U), T and U the functions of longitude,
 *   int grad_S Y . grad_S Y' dA = sum_rings  slope slope' <I11 T T'> + turn turn' <I22 U U'>
 *                                          + slope turn' <I12 T U'> + turn slope' <I12 U T'>
 * where <> sums over the nodes with weight dA. */
#include "galerkin.h"

#include "rings.h"

#include <stdlib.h>
#include <string.h>

#define Y00 0.28209479177387814347 /* 1 / sqrt(4 pi) */

/* Rings that are added in one pass over the matrices, which do not fit a cache. */
#define BATCH 8

enum { MASS, I11, I12, I22, ALPHA, N_WEIGHTS };

/* What a ring leaves behind for the matrices. */
typedef struct ring_part {
    double *value, *slope, *turn; /* as shcdi_ring_harmonics */
    double *even[N_WEIGHTS], *odd[N_WEIGHTS];
} ring_part;

/* One row of a block, of each ring in the batch: what slope, turn and value of the row's harmonic
 * are to be multiplied by. */
typedef struct block_row {
    double by_slope[SHCD_DEGREE_MAX + 1], by_turn[SHCD_DEGREE_MAX + 1];
    double by_value[SHCD_DEGREE_MAX + 1], mass[SHCD_DEGREE_MAX + 1];
} block_row;

typedef struct assembly {
    shcdi_galerkin *g;
    shcdi_rings *rings;
    const shcd_anchor *anchors;
    size_t n_anchors;
    double *memory;
    double *weights; /* N_WEIGHTS functions on the nodes of a ring */
    ring_part part[BATCH];
    block_row row[BATCH];
} assembly;

shcd_status shcdi_galerkin_init(shcdi_galerkin *g, int degree, size_t n_anchors) {
    const size_t n = SHCD_COUNT(degree);
    *g = (shcdi_galerkin){.degree = degree, .n = n};
    g->mass = malloc(n * n * sizeof *g->mass);
    g->stiffness = malloc(n * n * sizeof *g->stiffness);
    g->anchor_integral = malloc((n_anchors + 1) * sizeof *g->anchor_integral);
    return g->mass != NULL && g->stiffness != NULL && g->anchor_integral != NULL ? SHCD_OK
                                                                                 : SHCD_ERR_MEMORY;
}

void shcdi_galerkin_release(shcdi_galerkin *g) {
    free(g->mass);
    free(g->stiffness);
    free(g->anchor_integral);
    g->mass = g->stiffness = g->anchor_integral = NULL;
}

static shcd_status assembly_create(shcdi_galerkin *g, shcdi_rings *rings, assembly **made) {
    const size_t n_table = shcdi_ring_index(g->degree, g->degree, g->degree) + 1;
    const size_t n_moments = 2 * (size_t)g->degree + 1;
    const size_t n_part = 3 * n_table + 2 * N_WEIGHTS * n_moments;
    const size_t n_nodes = shcdi_rings_node_count(rings);
    assembly *a = calloc(1, sizeof *a);
    if (a == NULL) {
        return SHCD_ERR_MEMORY;
    }
    a->g = g;
    a->rings = rings;
    a->memory = malloc((N_WEIGHTS * n_nodes + BATCH * n_part) * sizeof *a->memory);
    if (a->memory == NULL) {
        free(a);
        return SHCD_ERR_MEMORY;
    }
    a->weights = a->memory;
    for (size_t b = 0; b < BATCH; ++b) {
        double *p = a->memory + N_WEIGHTS * n_nodes + b * n_part;
        a->part[b].value = p;
        a->part[b].slope = p + n_table;
        a->part[b].turn = p + 2 * n_table;
        for (size_t i = 0; i < N_WEIGHTS; ++i) {
            a->part[b].even[i] = p + 3 * n_table + 2 * i * n_moments;
            a->part[b].odd[i] = a->part[b].even[i] + n_moments;
        }
    }
    *made = a;
    return SHCD_OK;
}

static void assembly_free(assembly *a) {
    if (a != NULL) {
        free(a->memory);
        free(a);
    }
}

/* ---- one ring ---- */

/* alpha at a point, and its share of each anchor's integral. (1 - (d/r)^2)^4 has three continuous
 * derivatives where it ends, so that the quadrature converges fast. */
static double anchored(const assembly *a, shcd_vec3 point, double dA) {
    double alpha = 0.0;
    for (size_t j = 0; j < a->n_anchors; ++j) {
        const shcd_anchor *anchor = &a->anchors[j];
        const shcd_vec3 d = shcd_scale(1.0 / anchor->radius_m, shcd_sub(point, anchor->point_m));
        const double s = 1.0 - shcd_dot(d, d);
        if (s > 0.0) {
            const double here = anchor->alpha_per_m2 * (s * s) * (s * s);
            a->g->anchor_integral[j] += here * dA;
            alpha += here;
        }
    }
    return alpha;
}

static shcd_status weigh_ring(assembly *a, const shcdi_ring *ring, shcd_vec3 centre) {
    const size_t n = shcdi_rings_node_count(a->rings);
    double area = 0.0, volume = 0.0;
    for (size_t k = 0; k < n; ++k) {
        const shcdi_metric metric = shcdi_ring_metric(ring, k);
        if (!(metric.area > 0.0)) {
            return SHCD_ERR_GEOMETRY;
        }
        const double dA = ring->share_sr * metric.area;
        double *w = a->weights + k;
        w[MASS * n] = dA;
        w[I11 * n] = dA * metric.i11;
        w[I12 * n] = dA * metric.i12;
        w[I22 * n] = dA * metric.i22;
        w[ALPHA * n] = a->n_anchors > 0 ? dA * anchored(a, ring->point[k], dA) : 0.0;
        area += metric.area;
        volume += shcd_dot(shcd_sub(ring->point[k], centre), metric.area_vector);
    }
    a->g->area_m2 += ring->share_sr * area;
    a->g->volume_m3 += ring->share_sr * volume / 3.0;
    return SHCD_OK;
}

static shcd_status take_ring(assembly *a, size_t j, shcd_vec3 centre, ring_part *part) {
    const size_t n = shcdi_rings_node_count(a->rings);
    const size_t n_table = shcdi_ring_index(a->g->degree, a->g->degree, a->g->degree) + 1;
    const shcdi_ring *ring = shcdi_rings_at(a->rings, j);
    const shcd_status status = ring != NULL ? weigh_ring(a, ring, centre) : SHCD_ERR_ARGUMENT;
    if (status != SHCD_OK) {
        return status;
    }
    memcpy(part->value, ring->harmonics.value, n_table * sizeof *part->value);
    memcpy(part->slope, ring->harmonics.slope, n_table * sizeof *part->slope);
    memcpy(part->turn, ring->harmonics.turn, n_table * sizeof *part->turn);
    for (size_t i = 0; i < (a->n_anchors > 0 ? N_WEIGHTS : ALPHA); ++i) {
        shcdi_rings_moments(a->rings, a->weights + i * n, part->even[i], part->odd[i]);
    }
    return SHCD_OK;
}

/* ---- products in longitude ---- */

/* cos(m phi), m >= 0, or sin(|m| phi), times a sign. */
typedef struct wave {
    int is_sine, frequency;
    double sign;
} wave;

static wave value_wave(int m) {
    return (wave){m < 0, m < 0 ? -m : m, 1.0};
}

/* The derivative of the above over its frequency; of no account for m = 0, where turn is 0. */
static wave turn_wave(int m) {
    return (wave){m >= 0, m < 0 ? -m : m, m >= 0 ? -1.0 : 1.0};
}

/* sum_k f_k p(phi_k) q(phi_k) from the moments of f, by the addition theorems. */
static double product(const ring_part *part, int weight, wave p, wave q) {
    const double *even = part->even[weight], *odd = part->odd[weight];
    const int sum = p.frequency + q.frequency, difference = p.frequency - q.frequency;
    const int distance = difference < 0 ? -difference : difference;
    const double half = 0.5 * p.sign * q.sign;
    if (p.is_sine == q.is_sine) {
        return half * (p.is_sine ? even[distance] - even[sum] : even[distance] + even[sum]);
    }
    /* sin a cos b = (sin(a + b) + sin(a - b)) / 2 */
    const int is_positive = p.is_sine ? difference >= 0 : difference <= 0;
    return half * (odd[sum] + (is_positive ? odd[distance] : -odd[distance]));
}

/* ---- blocks ---- */

static void prepare_row(const assembly *a, size_t b, int m, int m2, block_row *row) {
    const ring_part *part = &a->part[b];
    const int degree = a->g->degree, order2 = m2 < 0 ? -m2 : m2;
    const size_t from = shcdi_ring_index(degree, order2, order2);
    const size_t n = (size_t)(degree - order2) + 1;
    const double *value = part->value + from, *slope = part->slope + from,
                 *turn = part->turn + from;
    const wave t = value_wave(m), u = turn_wave(m), t2 = value_wave(m2), u2 = turn_wave(m2);
    const double mass = product(part, MASS, t, t2);
    const double w11 = product(part, I11, t, t2), w12 = product(part, I12, t, u2);
    const double w21 = product(part, I12, u, t2), w22 = product(part, I22, u, u2);
    const double alpha = a->n_anchors > 0 ? product(part, ALPHA, t, t2) : 0.0;
    for (size_t i = 0; i < n; ++i) {
        row->mass[i] = mass * value[i];
        row->by_value[i] = alpha * value[i];
        row->by_slope[i] = w11 * slope[i] + w12 * turn[i];
        row->by_turn[i] = w21 * slope[i] + w22 * turn[i];
    }
}

/* Adds the batch to the block of rows of order m and columns of order m2. */
static void add_block(assembly *a, size_t n_batch, int m, int m2) {
    shcdi_galerkin *g = a->g;
    const int degree = g->degree, order = m < 0 ? -m : m, order2 = m2 < 0 ? -m2 : m2;
    const size_t first = shcdi_galerkin_index(degree, order, m);
    const size_t first2 = shcdi_galerkin_index(degree, order2, m2);
    const size_t rows = (size_t)(degree - order) + 1, columns = (size_t)(degree - order2) + 1;
    const size_t from = shcdi_ring_index(degree, order, order);
    for (size_t b = 0; b < n_batch; ++b) {
        prepare_row(a, b, m, m2, &a->row[b]);
    }
    for (size_t i = 0; i < rows; ++i) {
        double *restrict mass = g->mass + (first + i) * g->n + first2;
        double *restrict stiffness = g->stiffness + (first + i) * g->n + first2;
        for (size_t b = 0; b < n_batch; ++b) {
            const block_row *row = &a->row[b];
            const double value = a->part[b].value[from + i], slope = a->part[b].slope[from + i];
            const double turn = a->part[b].turn[from + i];
            for (size_t k = 0; k < columns; ++k) {
                mass[k] += value * row->mass[k];
                stiffness[k] +=
                    slope * row->by_slope[k] + turn * row->by_turn[k] + value * row->by_value[k];
            }
        }
    }
}

static void add_batch(assembly *a, size_t n_batch) {
    for (int m = -a->g->degree; m <= a->g->degree; ++m) {
        for (int m2 = -a->g->degree; m2 <= m; ++m2) {
            add_block(a, n_batch, m, m2);
        }
    }
}

static void mirror(double *matrix, size_t n) {
    for (size_t i = 0; i < n; ++i) {
        for (size_t k = i + 1; k < n; ++k) {
            matrix[i * n + k] = matrix[k * n + i];
        }
    }
}

static shcd_status add_rings(assembly *a, const double *coefficients, size_t n_rings,
                             const shcdi_progress *progress) {
    const shcd_vec3 centre =
        shcd_vec3_make(Y00 * coefficients[0], Y00 * coefficients[1], Y00 * coefficients[2]);
    shcd_status status = SHCD_OK;
    for (size_t j = 0; j < n_rings && status == SHCD_OK; j += BATCH) {
        const size_t left = n_rings - j, n_batch = left < BATCH ? left : BATCH;
        for (size_t b = 0; b < n_batch && status == SHCD_OK; ++b) {
            status = take_ring(a, j + b, centre, &a->part[b]);
        }
        if (status == SHCD_OK) {
            add_batch(a, n_batch);
            status =
                shcdi_progress_report(progress, "modes: matrices", (double)j / (double)n_rings);
        }
    }
    return status;
}

shcd_status shcdi_galerkin_fill(shcdi_galerkin *g, const double *coefficients, size_t n_rings,
                                const shcd_anchor *anchors, size_t n_anchors,
                                const shcdi_progress *progress) {
    shcdi_rings *rings = NULL;
    assembly *a = NULL;
    memset(g->mass, 0, g->n * g->n * sizeof *g->mass);
    memset(g->stiffness, 0, g->n * g->n * sizeof *g->stiffness);
    memset(g->anchor_integral, 0, n_anchors * sizeof *g->anchor_integral);
    g->area_m2 = g->volume_m3 = 0.0;
    shcd_status status = shcdi_rings_create(g->degree, coefficients, n_rings, &rings);
    if (status == SHCD_OK) {
        status = assembly_create(g, rings, &a);
    }
    if (status == SHCD_OK) {
        a->anchors = anchors;
        a->n_anchors = n_anchors;
        status = add_rings(a, coefficients, n_rings, progress);
    }
    if (status == SHCD_OK) {
        mirror(g->mass, g->n);
        mirror(g->stiffness, g->n);
    }
    assembly_free(a);
    shcdi_rings_free(rings);
    return status;
}
