/* SPDX-License-Identifier: BSD-3-Clause */
/* A series and its two derivatives are Fourier series in longitude on each parallel, whose terms
 * follow from the harmonics at longitude 0: what costs (degree+1)^2 operations at a node alone
 * costs a logarithm in company. The frame (e_theta, e_phi) has no meaning at the poles, but no
 * Gauss-Legendre node lies there, and at any other place it is an orthonormal frame like all
 * others; turn = m value / sine comes from the library's gradients without a division by sine. */
#include "rings.h"

#include "gauss.h"

#include <fftw3.h>

#include <limits.h>
#include <stdlib.h>

#define TWO_PI 6.283185307179586477

struct shcdi_rings {
    int degree;
    const double *coefficients; /* borrowed */
    size_t n_rings, n_nodes;
    double *z, *weight;
    double *values, *gradients; /* of the harmonics at longitude 0, public order */
    double *tables;             /* ring.harmonics */
    shcd_vec3 *vectors;         /* ring.point and derivatives */
    double *samples;            /* FFTW's: one function on the nodes, and its frequencies */
    fftw_complex *frequency;
    fftw_plan to_nodes, to_frequency;
    shcdi_ring ring;
};

size_t shcdi_rings_node_count(const shcdi_rings *rings) {
    return rings->n_nodes;
}

void shcdi_rings_free(shcdi_rings *rings) {
    if (rings == NULL) {
        return;
    }
    if (rings->to_nodes != NULL) {
        fftw_destroy_plan(rings->to_nodes);
    }
    if (rings->to_frequency != NULL) {
        fftw_destroy_plan(rings->to_frequency);
    }
    fftw_free(rings->samples);
    fftw_free(rings->frequency);
    free(rings->z);
    free(rings->values);
    free(rings->gradients);
    free(rings->tables);
    free(rings->vectors);
    free(rings);
}

static shcd_status prepare(shcdi_rings *r) {
    const size_t count = SHCD_COUNT(r->degree), n = r->n_nodes;
    const size_t n_table = shcdi_ring_index(r->degree, r->degree, r->degree) + 1;
    r->z = malloc(2 * r->n_rings * sizeof *r->z);
    r->values = malloc(count * sizeof *r->values);
    r->gradients = malloc(3 * count * sizeof *r->gradients);
    r->tables = malloc(3 * n_table * sizeof *r->tables);
    r->vectors = malloc(3 * n * sizeof *r->vectors);
    r->samples = fftw_alloc_real(n);
    r->frequency = fftw_alloc_complex(n / 2 + 1);
    if (r->z == NULL || r->values == NULL || r->gradients == NULL || r->tables == NULL ||
        r->vectors == NULL || r->samples == NULL || r->frequency == NULL) {
        return SHCD_ERR_MEMORY;
    }
    r->weight = r->z + r->n_rings;
    r->ring.harmonics =
        (shcdi_ring_harmonics){r->tables, r->tables + n_table, r->tables + 2 * n_table};
    r->ring.point = r->vectors;
    r->ring.along_theta = r->vectors + n;
    r->ring.along_phi = r->vectors + 2 * n;
    /* a measured plan differs from run to run, and so would the last bits */
    r->to_nodes = fftw_plan_dft_c2r_1d((int)n, r->frequency, r->samples, FFTW_ESTIMATE);
    r->to_frequency = fftw_plan_dft_r2c_1d((int)n, r->samples, r->frequency, FFTW_ESTIMATE);
    if (r->to_nodes == NULL || r->to_frequency == NULL) {
        return SHCD_ERR_MEMORY;
    }
    return shcdi_gauss_nodes(r->n_rings, r->z, r->weight);
}

shcd_status shcdi_rings_create(int degree, const double *coefficients, size_t n_rings,
                               shcdi_rings **rings) {
    if (degree < 0 || degree > SHCD_DEGREE_MAX || n_rings <= 2 * (size_t)degree ||
        n_rings > INT_MAX / 4) {
        return SHCD_ERR_ARGUMENT;
    }
    shcdi_rings *made = calloc(1, sizeof *made);
    if (made == NULL) {
        return SHCD_ERR_MEMORY;
    }
    made->degree = degree;
    made->coefficients = coefficients;
    made->n_rings = n_rings;
    made->n_nodes = 2 * n_rings;
    const shcd_status status = prepare(made);
    if (status != SHCD_OK) {
        shcdi_rings_free(made);
        return status;
    }
    *rings = made;
    return SHCD_OK;
}

/* At longitude 0 e_theta = (z, 0, -sine) and e_phi = (0, 1, 0). */
static shcd_status fill_harmonics(shcdi_rings *r) {
    const double z = r->ring.z, sine = r->ring.sine;
    const shcdi_ring_harmonics *h = &r->ring.harmonics;
    const shcd_status status =
        shcd_harmonics(r->degree, shcd_vec3_make(sine, 0.0, z), r->values, r->gradients, NULL);
    for (int m = 0; m <= r->degree; ++m) {
        for (int l = m; l <= r->degree; ++l) {
            const size_t at = shcdi_ring_index(r->degree, l, m), i = SHCD_INDEX(l, m);
            h->value[at] = r->values[i];
            h->slope[at] = z * r->gradients[3 * i] - sine * r->gradients[3 * i + 2];
            h->turn[at] = m > 0 ? r->gradients[3 * SHCD_INDEX(l, -m) + 1] : 0.0;
        }
    }
    return status;
}

/* One coordinate of the series with a table in the place of the harmonics; is_turn: the derivative
 * along phi exchanges cosines and sines. */
static void synthesise(shcdi_rings *r, const double *table, int is_turn, size_t coordinate,
                       double *out) {
    const double *c = r->coefficients + coordinate;
    for (size_t k = 0; k < r->n_nodes / 2 + 1; ++k) {
        r->frequency[k][0] = r->frequency[k][1] = 0.0;
    }
    for (int m = 0; m <= r->degree; ++m) {
        double plus = 0.0, minus = 0.0; /* of c_lm and c_l,-m */
        for (int l = m; l <= r->degree; ++l) {
            const double q = table[shcdi_ring_index(r->degree, l, m)];
            plus += q * c[3 * SHCD_INDEX(l, m)];
            minus += q * c[3 * SHCD_INDEX(l, -m)];
        }
        const double even = is_turn ? minus : plus, odd = is_turn ? -plus : minus;
        /* the real transform adds each frequency and its conjugate */
        r->frequency[m][0] = m == 0 ? even : 0.5 * even;
        r->frequency[m][1] = m == 0 ? 0.0 : -0.5 * odd;
    }
    fftw_execute(r->to_nodes);
    for (size_t k = 0; k < r->n_nodes; ++k) {
        out[3 * k] = r->samples[k];
    }
}

_Static_assert(sizeof(shcd_vec3) == 3 * sizeof(double), "a vector is three doubles in a row");

const shcdi_ring *shcdi_rings_at(shcdi_rings *rings, size_t j) {
    if (j >= rings->n_rings) {
        return NULL;
    }
    shcdi_ring *ring = &rings->ring;
    ring->z = rings->z[j];
    ring->sine = sqrt((1.0 - ring->z) * (1.0 + ring->z));
    ring->share_sr = rings->weight[j] * TWO_PI / (double)rings->n_nodes;
    if (fill_harmonics(rings) != SHCD_OK) {
        return NULL;
    }
    for (size_t k = 0; k < 3; ++k) {
        synthesise(rings, ring->harmonics.value, 0, k, (double *)ring->point + k);
        synthesise(rings, ring->harmonics.slope, 0, k, (double *)ring->along_theta + k);
        synthesise(rings, ring->harmonics.turn, 1, k, (double *)ring->along_phi + k);
    }
    return ring;
}

void shcdi_rings_moments(shcdi_rings *rings, const double *f, double *even, double *odd) {
    for (size_t k = 0; k < rings->n_nodes; ++k) {
        rings->samples[k] = f[k];
    }
    fftw_execute(rings->to_frequency);
    for (size_t k = 0; k <= 2 * (size_t)rings->degree; ++k) {
        even[k] = rings->frequency[k][0];
        odd[k] = -rings->frequency[k][1];
    }
}

/* With S_theta = a and S_phi = b the first fundamental form is [a.a a.b; a.b b.b], its determinant
 * |a x b|^2. */
shcdi_metric shcdi_ring_metric(const shcdi_ring *ring, size_t k) {
    const shcd_vec3 a = ring->along_theta[k], b = ring->along_phi[k];
    shcdi_metric metric = {shcd_cross(a, b), 0.0, 0.0, 0.0, 0.0};
    const double determinant = shcd_dot(metric.area_vector, metric.area_vector);
    metric.area = sqrt(determinant);
    if (metric.area > 0.0) {
        metric.i11 = shcd_dot(b, b) / determinant;
        metric.i12 = -shcd_dot(a, b) / determinant;
        metric.i22 = shcd_dot(a, a) / determinant;
    }
    return metric;
}
