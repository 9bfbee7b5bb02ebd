/* SPDX-License-Identifier: BSD-3-Clause */
/* Transforms between a series and its values on a Gauss-Legendre x uniform grid.
 *
 * On a parallel a series is a Fourier series in longitude: f(z, phi) = A_0 + sum over m > 0 of
 * A_m cos(m phi) + B_m sin(m phi), A_m(z) = sum_l c_lm Q_lm(z), B_m likewise with c_l,-m, where
 * Q_lm(z) = Y_lm at phi = 0. The library's harmonics at (sqrt(1 - z^2), 0, z) are exactly the Q_lm,
 * normalised, so that no second recurrence is needed. FFTW does the sums over longitude; its
 * planner is told not to measure, since a measured plan differs from run to run, and so would the
 * last bits.
 *
 * Backwards, c_lm = sum_j w_j Q_lm(z_j) (2 pi/n) sum_k f_jk cos(m phi_k): exact, since products of
 * two functions of degree <= L have degree 2 L in z, below the 2 n of the nodes, and no frequency
 * above L < n/2 in longitude. */
#include "gauss.h"

#include "shcd/fit.h"
#include "shcd/vec.h"

#include <fftw3.h>

#include <limits.h>
#include <stdlib.h>

static const double two_pi = 6.283185307179586477;

typedef struct grid {
    int degree;
    size_t n_latitudes, n_longitudes, n_frequencies;
    double *z, *weight;      /* nodes, descending, and their weights */
    double *legendre;        /* Q_lm of one parallel at SHCD_INDEX(l, m), m >= 0 */
    double *samples;         /* one parallel */
    fftw_complex *frequency; /* of the same parallel */
    fftw_plan plan;
} grid;

static int is_admissible(int degree, const double *from, size_t n_latitudes, size_t n_longitudes,
                         const double *to) {
    return from != NULL && to != NULL && degree >= 0 && degree <= SHCD_DEGREE_MAX &&
           n_latitudes > (size_t)degree && n_latitudes <= INT_MAX / 2 &&
           n_longitudes > 2 * (size_t)degree && n_longitudes <= INT_MAX / 2;
}

static void grid_release(grid *g) {
    if (g->plan != NULL) {
        fftw_destroy_plan(g->plan);
    }
    fftw_free(g->samples);
    fftw_free(g->frequency);
    free(g->z);
    free(g->weight);
    free(g->legendre);
}

static shcd_status grid_init(grid *g, int degree, size_t n_latitudes, size_t n_longitudes,
                             int is_synthesis) {
    *g = (grid){.degree = degree,
                .n_latitudes = n_latitudes,
                .n_longitudes = n_longitudes,
                .n_frequencies = n_longitudes / 2 + 1};
    g->z = malloc(n_latitudes * sizeof *g->z);
    g->weight = malloc(n_latitudes * sizeof *g->weight);
    g->legendre = malloc(SHCD_COUNT(degree) * sizeof *g->legendre);
    g->samples = fftw_alloc_real(n_longitudes);
    g->frequency = fftw_alloc_complex(g->n_frequencies);
    if (g->z == NULL || g->weight == NULL || g->legendre == NULL || g->samples == NULL ||
        g->frequency == NULL) {
        grid_release(g);
        return SHCD_ERR_MEMORY;
    }
    const int n = (int)n_longitudes;
    g->plan = is_synthesis ? fftw_plan_dft_c2r_1d(n, g->frequency, g->samples, FFTW_ESTIMATE)
                           : fftw_plan_dft_r2c_1d(n, g->samples, g->frequency, FFTW_ESTIMATE);
    const shcd_status status =
        g->plan != NULL ? shcdi_gauss_nodes(n_latitudes, g->z, g->weight) : SHCD_ERR_MEMORY;
    if (status != SHCD_OK) {
        grid_release(g);
    }
    return status;
}

static shcd_status legendre_at(const grid *g, size_t j) {
    const double z = g->z[j];
    const shcd_vec3 direction = shcd_vec3_make(sqrt((1.0 - z) * (1.0 + z)), 0.0, z);
    return shcd_harmonics(g->degree, direction, g->legendre, NULL, NULL);
}

static void synthesise_parallel(const grid *g, const double *coefficients, double *values) {
    for (size_t m = 0; m < g->n_frequencies; ++m) {
        g->frequency[m][0] = g->frequency[m][1] = 0.0;
    }
    for (int m = 0; m <= g->degree; ++m) {
        double even = 0.0, odd = 0.0;
        for (int l = m; l <= g->degree; ++l) {
            const double q = g->legendre[SHCD_INDEX(l, m)];
            even += q * coefficients[SHCD_INDEX(l, m)];
            odd += q * coefficients[SHCD_INDEX(l, -m)];
        }
        /* the real transform adds each frequency and its conjugate */
        g->frequency[m][0] = m == 0 ? even : 0.5 * even;
        g->frequency[m][1] = m == 0 ? 0.0 : -0.5 * odd;
    }
    fftw_execute(g->plan);
    for (size_t k = 0; k < g->n_longitudes; ++k) {
        values[k] = g->samples[k];
    }
}

shcd_status shcd_synthesis(int degree, const double *coefficients, size_t n_latitudes,
                           size_t n_longitudes, double *values) {
    grid g;
    if (!is_admissible(degree, coefficients, n_latitudes, n_longitudes, values)) {
        return SHCD_ERR_ARGUMENT;
    }
    shcd_status status = grid_init(&g, degree, n_latitudes, n_longitudes, 1);
    if (status != SHCD_OK) {
        return status;
    }
    for (size_t j = 0; j < n_latitudes && status == SHCD_OK; ++j) {
        status = legendre_at(&g, j);
        if (status == SHCD_OK) {
            synthesise_parallel(&g, coefficients, values + j * n_longitudes);
        }
    }
    grid_release(&g);
    return status;
}

static void analyse_parallel(const grid *g, size_t j, const double *values, double *coefficients) {
    for (size_t k = 0; k < g->n_longitudes; ++k) {
        g->samples[k] = values[k];
    }
    fftw_execute(g->plan);
    const double area = g->weight[j] * two_pi / (double)g->n_longitudes;
    for (int m = 0; m <= g->degree; ++m) {
        const double even = area * g->frequency[m][0], odd = -area * g->frequency[m][1];
        for (int l = m; l <= g->degree; ++l) {
            const double q = g->legendre[SHCD_INDEX(l, m)];
            coefficients[SHCD_INDEX(l, m)] += q * even;
            if (m > 0) {
                coefficients[SHCD_INDEX(l, -m)] += q * odd;
            }
        }
    }
}

shcd_status shcd_analysis(int degree, const double *values, size_t n_latitudes, size_t n_longitudes,
                          double *coefficients) {
    grid g;
    if (!is_admissible(degree, values, n_latitudes, n_longitudes, coefficients)) {
        return SHCD_ERR_ARGUMENT;
    }
    shcd_status status = grid_init(&g, degree, n_latitudes, n_longitudes, 0);
    if (status != SHCD_OK) {
        return status;
    }
    for (size_t i = 0; i < SHCD_COUNT(degree); ++i) {
        coefficients[i] = 0.0;
    }
    for (size_t j = 0; j < n_latitudes && status == SHCD_OK; ++j) {
        status = legendre_at(&g, j);
        if (status == SHCD_OK) {
            analyse_parallel(&g, j, values + j * n_longitudes, coefficients);
        }
    }
    grid_release(&g);
    return status;
}
