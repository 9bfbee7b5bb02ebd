/* SPDX-License-Identifier: BSD-3-Clause */
/* minimise sum_s w_s |sum_i c_i Y_i(u_s) - p_s|^2.
 *
 * With N = sum w Y Y^T = L L^T and b = sum w Y p^T the minimiser is c = L^-T (L^-1 b). Harmonics
 * are ordered by degree, so that the equations of a lower degree are the leading block of N, its
 * factor is the leading block of L, and y = L^-1 b starts with the y of every lower degree: one
 * factorisation serves all degrees, each solved for itself and not cut from a higher one. The
 * square sum that is left is sum w |p|^2 - |y|^2 over the leading part of y.
 *
 * Normal equations square the condition number, but it is small to begin with: for samples spread
 * evenly over the sphere N is close to the identity over 4 pi, and its condition is at most the
 * ratio of the largest to the smallest density of sample weight on the sphere, 10 to 1000 on bodies
 * with limbs. It is checked all the same. */
#include "coefficients.h"

#include <gsl/gsl_blas.h>
#include <gsl/gsl_errno.h>
#include <gsl/gsl_linalg.h>

#include <stdlib.h>

/* At this condition number of N the coefficients are good to 1e-6 of the body, far below the error
 * of any fit: eps / 1e-10. */
#define RCOND_MIN 1e-10

#define PANEL 4   /* columns that one register tile takes */
#define BLOCK 128 /* samples accumulated at a time */

struct shcdi_least_squares {
    int degree;
    size_t n_terms, n_padded;
    double *matrix;    /* n_padded x n_padded; after factorising L below the diagonal */
    double *solved;    /* n_padded x 3: b, then y */
    double square_sum; /* sum w |p|^2 */
    double rcond;
};

/* tile += sum over the block of a^T b; panels hold PANEL values per sample */
static void multiply_panels(const double *restrict a, const double *restrict b,
                            double *restrict tile, size_t stride) {
    double sum[PANEL][PANEL] = {{0.0}};
    for (size_t s = 0; s < BLOCK; ++s) {
        for (size_t i = 0; i < PANEL; ++i) {
            for (size_t j = 0; j < PANEL; ++j) {
                sum[i][j] += a[s * PANEL + i] * b[s * PANEL + j];
            }
        }
    }
    for (size_t i = 0; i < PANEL; ++i) {
        for (size_t j = 0; j < PANEL; ++j) {
            tile[i * stride + j] += sum[i][j];
        }
    }
}

/* Adds a block of weighted rows to the lower triangle. */
static void add_block(shcdi_least_squares *ls, const double *panels) {
    const size_t n_panels = ls->n_padded / PANEL;
    for (size_t i = 0; i < n_panels; ++i) {
        for (size_t j = 0; j <= i; ++j) {
            multiply_panels(panels + i * PANEL * BLOCK, panels + j * PANEL * BLOCK,
                            ls->matrix + i * PANEL * ls->n_padded + j * PANEL, ls->n_padded);
        }
    }
}

static void add_right_hand_side(shcdi_least_squares *ls, const double *row, double weight,
                                shcd_vec3 point) {
    ls->square_sum += weight * shcd_dot(point, point);
    for (size_t i = 0; i < ls->n_terms; ++i) {
        const double wy = weight * row[i];
        ls->solved[3 * i] += wy * point.x;
        ls->solved[3 * i + 1] += wy * point.y;
        ls->solved[3 * i + 2] += wy * point.z;
    }
}

static shcd_status accumulate(shcdi_least_squares *ls, const shcdi_samples *samples,
                              const shcdi_progress *progress) {
    double *row = malloc(ls->n_terms * sizeof *row);
    double *panels = calloc(ls->n_padded * BLOCK, sizeof *panels);
    shcd_status status = row != NULL && panels != NULL ? SHCD_OK : SHCD_ERR_MEMORY;
    for (size_t first = 0; first < samples->n && status == SHCD_OK; first += BLOCK) {
        status =
            shcdi_progress_report(progress, "least squares", (double)first / (double)samples->n);
        for (size_t s = 0; s < BLOCK && status == SHCD_OK; ++s) {
            const int is_sample = first + s < samples->n;
            const double weight = is_sample ? samples->weights[first + s] : 0.0;
            if (is_sample) {
                status =
                    shcd_harmonics(ls->degree, samples->directions[first + s], row, NULL, NULL);
                add_right_hand_side(ls, row, weight, samples->points_m[first + s]);
            }
            const double root = sqrt(weight);
            for (size_t i = 0; i < ls->n_terms; ++i) {
                panels[(i / PANEL) * PANEL * BLOCK + s * PANEL + i % PANEL] = root * row[i];
            }
        }
        if (status == SHCD_OK) {
            add_block(ls, panels);
        }
    }
    free(row);
    free(panels);
    return status;
}

/* GSL's handler aborts the program by default; here a status is wanted. */
static shcd_status factorise(shcdi_least_squares *ls) {
    const size_t n = ls->n_terms;
    gsl_matrix_view matrix = gsl_matrix_view_array_with_tda(ls->matrix, n, n, ls->n_padded);
    gsl_error_handler_t *handler = gsl_set_error_handler_off();
    shcd_status status = SHCD_ERR_CONVERGENCE;
    gsl_vector *work = gsl_vector_alloc(3 * n);
    if (work == NULL) {
        status = SHCD_ERR_MEMORY;
    } else if (gsl_linalg_cholesky_decomp1(&matrix.matrix) == GSL_SUCCESS &&
               gsl_linalg_cholesky_rcond(&matrix.matrix, &ls->rcond, work) == GSL_SUCCESS &&
               ls->rcond >= RCOND_MIN) {
        gsl_matrix_view solved = gsl_matrix_view_array(ls->solved, n, 3);
        if (gsl_blas_dtrsm(CblasLeft, CblasLower, CblasNoTrans, CblasNonUnit, 1.0, &matrix.matrix,
                           &solved.matrix) == GSL_SUCCESS) {
            status = SHCD_OK;
        }
    }
    gsl_vector_free(work);
    gsl_set_error_handler(handler);
    return status;
}

shcd_status shcdi_least_squares_create(int degree, const shcdi_samples *samples,
                                       const shcdi_progress *progress,
                                       shcdi_least_squares **least_squares) {
    shcdi_least_squares *ls = calloc(1, sizeof *ls);
    if (ls == NULL) {
        return SHCD_ERR_MEMORY;
    }
    ls->degree = degree;
    ls->n_terms = SHCD_COUNT(degree);
    ls->n_padded = (ls->n_terms + PANEL - 1) / PANEL * PANEL;
    ls->matrix = calloc(ls->n_padded * ls->n_padded, sizeof *ls->matrix);
    ls->solved = calloc(3 * ls->n_padded, sizeof *ls->solved);
    shcd_status status = ls->matrix != NULL && ls->solved != NULL
                             ? accumulate(ls, samples, progress)
                             : SHCD_ERR_MEMORY;
    status = status == SHCD_OK ? factorise(ls) : status;
    if (status != SHCD_OK) {
        shcdi_least_squares_free(ls);
        return status;
    }
    *least_squares = ls;
    return SHCD_OK;
}

void shcdi_least_squares_free(shcdi_least_squares *least_squares) {
    if (least_squares != NULL) {
        free(least_squares->matrix);
        free(least_squares->solved);
        free(least_squares);
    }
}

void shcdi_least_squares_solve(const shcdi_least_squares *ls, int degree, double *coefficients_m) {
    const size_t n = SHCD_COUNT(degree), stride = ls->n_padded;
    for (size_t i = n; i-- > 0;) { /* L^T c = y, from the last row up */
        for (size_t k = 0; k < 3; ++k) {
            double sum = ls->solved[3 * i + k];
            for (size_t j = i + 1; j < n; ++j) {
                sum -= ls->matrix[j * stride + i] * coefficients_m[3 * j + k];
            }
            coefficients_m[3 * i + k] = sum / ls->matrix[i * stride + i];
        }
    }
}

double shcdi_least_squares_residual(const shcdi_least_squares *ls, int degree) {
    double left = ls->square_sum;
    for (size_t i = 0; i < 3 * SHCD_COUNT(degree); ++i) {
        left -= ls->solved[i] * ls->solved[i];
    }
    return left > 0.0 ? left : 0.0;
}

double shcdi_least_squares_rcond(const shcdi_least_squares *ls) {
    return ls->rcond;
}
