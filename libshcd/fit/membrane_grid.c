/* SPDX-License-Identifier: BSD-3-Clause */
/* On a parallel, u = sum over m of A_m cos(m phi) + B_m sin(m phi) with A_m = sum_l c_lm Q_lm and
 * B_m = sum_l c_l,-m Q_lm (transform.c). So with D = dQ/dtheta and R = m Q/sin(theta)
 *   u_theta          = sum_m (sum_l c_lm D) cos + (sum_l c_l,-m D) sin
 *   u_phi/sin(theta) = sum_m (sum_l c_l,-m R) cos - (sum_l c_lm R) sin
 * and both are one FFT of a parallel: L^3 work where a table of the modes' gradients takes L^4.
 * shcd_harmonics() at longitude 0 gives Q, D and R without a division by sin(theta).
 *
 * The surface has J = (S_theta, S_phi/sin(theta)), metric g = J^T J = C C^T (C lower triangular),
 * area sqrt(det g) for each unit of the sphere's, and |grad_S u|^2 = |C^-1 grad u|^2: C^-1 grad u
 * are the components in an orthonormal frame of the surface. */
#include "membrane_grid.h"

#include "gauss.h"

#include "shcd/vec.h"

#include <fftw3.h>
#include <gsl/gsl_cblas.h>

#include <math.h>
#include <stdlib.h>

struct shcdi_membrane_grid {
    int degree;
    size_t n_modes, n_latitudes, n_longitudes, n_frequencies, n_legendre;
    double *legendre;     /* per parallel and (m, l): Q, D, R */
    double *area;         /* per node [m^2] */
    double *frame;        /* per node: C^-1 = (f0, 0; f1, f2) [1/m] */
    double *coefficients; /* of one function */
    const double *modes;  /* borrowed: rows v_k */
    double *samples;      /* two parallels */
    fftw_complex *frequency;
    fftw_plan to_samples, to_frequency;
};

void shcdi_membrane_grid_free(shcdi_membrane_grid *grid) {
    if (grid == NULL) {
        return;
    }
    if (grid->to_samples != NULL) {
        fftw_destroy_plan(grid->to_samples);
    }
    if (grid->to_frequency != NULL) {
        fftw_destroy_plan(grid->to_frequency);
    }
    fftw_free(grid->samples);
    fftw_free(grid->frequency);
    free(grid->legendre);
    free(grid->area);
    free(grid->frame);
    free(grid->coefficients);
    free(grid);
}

/* ---- making one ---- */

static shcd_status allocate(shcdi_membrane_grid *g) {
    const size_t n = g->n_latitudes * g->n_longitudes;
    const int length = (int)g->n_longitudes, pitch = (int)g->n_frequencies;
    g->legendre = malloc(3 * g->n_legendre * g->n_latitudes * sizeof *g->legendre);
    g->area = malloc(n * sizeof *g->area);
    g->frame = malloc(3 * n * sizeof *g->frame);
    g->coefficients = malloc(SHCD_COUNT(g->degree) * sizeof *g->coefficients);
    g->samples = fftw_alloc_real(2 * g->n_longitudes);
    g->frequency = fftw_alloc_complex(2 * g->n_frequencies);
    if (g->legendre == NULL || g->area == NULL || g->frame == NULL || g->coefficients == NULL ||
        g->samples == NULL || g->frequency == NULL) {
        return SHCD_ERR_MEMORY;
    }
    g->to_samples = fftw_plan_many_dft_c2r(1, &length, 2, g->frequency, NULL, 1, pitch, g->samples,
                                           NULL, 1, length, FFTW_ESTIMATE);
    g->to_frequency = fftw_plan_many_dft_r2c(1, &length, 2, g->samples, NULL, 1, length,
                                             g->frequency, NULL, 1, pitch, FFTW_ESTIMATE);
    return g->to_samples != NULL && g->to_frequency != NULL ? SHCD_OK : SHCD_ERR_MEMORY;
}

/* Q, D and R of one parallel. y, gradient: scratch for all harmonics. */
static shcd_status fill_parallel(shcdi_membrane_grid *g, size_t j, double z, double *y,
                                 double *gradient) {
    const double s = sqrt((1.0 - z) * (1.0 + z));
    const shcd_status status =
        shcd_harmonics(g->degree, shcd_vec3_make(s, 0.0, z), y, gradient, NULL);
    double *out = g->legendre + 3 * g->n_legendre * j;
    for (int m = 0; status == SHCD_OK && m <= g->degree; m++) {
        for (int l = m; l <= g->degree; l++, out += 3) {
            const double *even = gradient + 3 * SHCD_INDEX(l, m);
            const double *odd = gradient + 3 * SHCD_INDEX(l, -m);
            out[0] = y[SHCD_INDEX(l, m)];
            out[1] = even[0] * z - even[2] * s;
            out[2] = m > 0 ? odd[1] : 0.0;
        }
    }
    return status;
}

/* Metric and area of one node, weight its share of the unit sphere. */
static shcd_status fill_node(shcdi_membrane_grid *g, const shcd_model *model, size_t i, double z,
                             double phi, double weight) {
    const double s = sqrt((1.0 - z) * (1.0 + z)), c = cos(phi), d = sin(phi);
    double jacobian[9];
    const shcd_status status =
        shcd_model_surface(model, -1, shcd_vec3_make(s * c, s * d, z), NULL, NULL, jacobian);
    if (status != SHCD_OK) {
        return status;
    }
    double g11 = 0.0, g12 = 0.0, g22 = 0.0;
    for (size_t k = 0; k < 3; k++) {
        const double *row = jacobian + 3 * k;
        const double theta = row[0] * z * c + row[1] * z * d - row[2] * s;
        const double across = row[1] * c - row[0] * d;
        g11 += theta * theta;
        g12 += theta * across;
        g22 += across * across;
    }
    const double det = g11 * g22 - g12 * g12;
    /* a singular metric has no gradient; the squares of lengths below 1e-9 m are rounding */
    if (!(det > 1e-36 && det > 1e-14 * g11 * g22)) {
        return SHCD_ERR_GEOMETRY;
    }
    const double c11 = sqrt(g11), c21 = g12 / c11, c22 = sqrt(det) / c11;
    g->area[i] = weight * sqrt(det);
    g->frame[3 * i] = 1.0 / c11;
    g->frame[3 * i + 1] = -c21 / (c11 * c22);
    g->frame[3 * i + 2] = 1.0 / c22;
    return SHCD_OK;
}

static shcd_status fill(shcdi_membrane_grid *g, const shcd_model *model) {
    const double two_pi = 6.283185307179586477;
    const size_t n = SHCD_COUNT(g->degree);
    double *node = malloc((2 * g->n_latitudes + 4 * n) * sizeof *node);
    if (node == NULL) {
        return SHCD_ERR_MEMORY;
    }
    double *weight = node + g->n_latitudes, *scratch = weight + g->n_latitudes;
    shcd_status status = shcdi_gauss_nodes(g->n_latitudes, node, weight);
    for (size_t j = 0; j < g->n_latitudes && status == SHCD_OK; j++) {
        status = fill_parallel(g, j, node[j], scratch, scratch + n);
        for (size_t k = 0; k < g->n_longitudes && status == SHCD_OK; k++) {
            const double step = two_pi / (double)g->n_longitudes;
            status = fill_node(g, model, j * g->n_longitudes + k, node[j], step * (double)k,
                               weight[j] * step);
        }
    }
    free(node);
    return status;
}

shcd_status shcdi_membrane_grid_create(const shcd_model *model, const shcd_modes *modes,
                                       size_t n_modes, size_t n_latitudes,
                                       shcdi_membrane_grid **grid) {
    shcdi_membrane_grid *g = calloc(1, sizeof *g);
    if (g == NULL) {
        return SHCD_ERR_MEMORY;
    }
    g->degree = shcd_model_degree(model);
    g->n_modes = n_modes;
    g->n_latitudes = n_latitudes;
    g->n_longitudes = 2 * n_latitudes;
    g->n_frequencies = n_latitudes + 1;
    g->n_legendre = (size_t)(g->degree + 1) * (size_t)(g->degree + 2) / 2;
    g->modes = modes->coefficient_per_m;
    shcd_status status = allocate(g);
    status = status == SHCD_OK ? fill(g, model) : status;
    if (status != SHCD_OK) {
        shcdi_membrane_grid_free(g);
        return status;
    }
    *grid = g;
    return SHCD_OK;
}

size_t shcdi_membrane_grid_size(const shcdi_membrane_grid *grid) {
    return grid->n_latitudes * grid->n_longitudes;
}

const double *shcdi_membrane_grid_area(const shcdi_membrane_grid *grid) {
    return grid->area;
}

/* ---- amplitudes to nodes ---- */

static void series_of(shcdi_membrane_grid *g, const double *q) {
    const int n = (int)SHCD_COUNT(g->degree);
    cblas_dgemv(CblasRowMajor, CblasTrans, (int)g->n_modes, n, 1.0, g->modes, n, q, 1, 0.0,
                g->coefficients, 1);
}

/* Frequency m of the real function A cos(m phi) + B sin(m phi): the transform adds the conjugate.
 */
static void set_frequency(fftw_complex *at, int m, double a, double b) {
    (*at)[0] = m == 0 ? a : 0.5 * a;
    (*at)[1] = m == 0 ? 0.0 : -0.5 * b;
}

static void clear_frequencies(shcdi_membrane_grid *g) {
    for (size_t m = 0; m < 2 * g->n_frequencies; m++) {
        g->frequency[m][0] = g->frequency[m][1] = 0.0;
    }
}

void shcdi_membrane_grid_gradient(shcdi_membrane_grid *g, const double *q, double *gx, double *gy) {
    series_of(g, q);
    const double *c = g->coefficients;
    for (size_t j = 0; j < g->n_latitudes; j++) {
        const double *legendre = g->legendre + 3 * g->n_legendre * j;
        clear_frequencies(g); /* the transform destroys its input */
        for (int m = 0; m <= g->degree; m++) {
            double a = 0.0, b = 0.0, even = 0.0, odd = 0.0;
            for (int l = m; l <= g->degree; l++, legendre += 3) {
                const double ce = c[SHCD_INDEX(l, m)], co = c[SHCD_INDEX(l, -m)];
                a += legendre[1] * ce;
                b += legendre[1] * co;
                even += legendre[2] * ce;
                odd += legendre[2] * co;
            }
            set_frequency(&g->frequency[m], m, a, b);
            set_frequency(&g->frequency[g->n_frequencies + (size_t)m], m, odd, -even);
        }
        fftw_execute(g->to_samples);
        const double *theta = g->samples, *across = g->samples + g->n_longitudes;
        for (size_t k = 0; k < g->n_longitudes; k++) {
            const size_t i = j * g->n_longitudes + k;
            const double *f = g->frame + 3 * i;
            gx[i] = f[0] * theta[k];
            gy[i] = f[1] * theta[k] + f[2] * across[k];
        }
    }
}

void shcdi_membrane_grid_values(shcdi_membrane_grid *g, const double *q, double *u) {
    series_of(g, q);
    const double *c = g->coefficients;
    for (size_t j = 0; j < g->n_latitudes; j++) {
        const double *legendre = g->legendre + 3 * g->n_legendre * j;
        clear_frequencies(g);
        for (int m = 0; m <= g->degree; m++) {
            double a = 0.0, b = 0.0;
            for (int l = m; l <= g->degree; l++, legendre += 3) {
                a += legendre[0] * c[SHCD_INDEX(l, m)];
                b += legendre[0] * c[SHCD_INDEX(l, -m)];
            }
            set_frequency(&g->frequency[m], m, a, b);
        }
        fftw_execute(g->to_samples);
        for (size_t k = 0; k < g->n_longitudes; k++) {
            u[j * g->n_longitudes + k] = g->samples[k];
        }
    }
}

/* ---- nodes to amplitudes ---- */

static void modes_of(const shcdi_membrane_grid *g, double *out) {
    const int n = (int)SHCD_COUNT(g->degree);
    cblas_dgemv(CblasRowMajor, CblasNoTrans, (int)g->n_modes, n, 1.0, g->modes, n, g->coefficients,
                1, 1.0, out, 1);
}

static void clear_series(shcdi_membrane_grid *g) {
    for (size_t i = 0; i < SHCD_COUNT(g->degree); i++) {
        g->coefficients[i] = 0.0;
    }
}

void shcdi_membrane_grid_gather_values(shcdi_membrane_grid *g, const double *s, double *out) {
    double *c = g->coefficients;
    clear_series(g);
    for (size_t j = 0; j < g->n_latitudes; j++) {
        const double *legendre = g->legendre + 3 * g->n_legendre * j;
        for (size_t k = 0; k < g->n_longitudes; k++) {
            g->samples[k] = s[j * g->n_longitudes + k];
            g->samples[g->n_longitudes + k] = 0.0;
        }
        fftw_execute(g->to_frequency);
        for (int m = 0; m <= g->degree; m++) {
            for (int l = m; l <= g->degree; l++, legendre += 3) {
                c[SHCD_INDEX(l, m)] += legendre[0] * g->frequency[m][0];
                if (m > 0) {
                    c[SHCD_INDEX(l, -m)] -= legendre[0] * g->frequency[m][1];
                }
            }
        }
    }
    modes_of(g, out);
}

void shcdi_membrane_grid_gather(shcdi_membrane_grid *g, const double *sx, const double *sy,
                                double *out) {
    double *c = g->coefficients;
    clear_series(g);
    for (size_t j = 0; j < g->n_latitudes; j++) {
        const double *legendre = g->legendre + 3 * g->n_legendre * j;
        double *theta = g->samples, *across = g->samples + g->n_longitudes;
        for (size_t k = 0; k < g->n_longitudes; k++) {
            const size_t i = j * g->n_longitudes + k;
            const double *f = g->frame + 3 * i;
            theta[k] = f[0] * sx[i] + f[1] * sy[i];
            across[k] = f[2] * sy[i];
        }
        fftw_execute(g->to_frequency);
        for (int m = 0; m <= g->degree; m++) {
            const double *t = g->frequency[m], *a = g->frequency[g->n_frequencies + (size_t)m];
            for (int l = m; l <= g->degree; l++, legendre += 3) {
                c[SHCD_INDEX(l, m)] += legendre[1] * t[0] + legendre[2] * a[1];
                if (m > 0) {
                    c[SHCD_INDEX(l, -m)] += legendre[2] * a[0] - legendre[1] * t[1];
                }
            }
        }
    }
    modes_of(g, out);
}
