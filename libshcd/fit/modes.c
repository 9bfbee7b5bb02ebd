/* SPDX-License-Identifier: BSD-3-Clause */
/* Modes of a surface: K v = lambda M v, by quadrature that is refined until they stand still.
 *
 * A solver's rounding is relative to the largest eigenvalue that it sees, and the wanted ones are
 * the smallest. Hence it gets the inverse problem M v = mu (K + M/A) v, mu = 1/(lambda + 1/A), A
 * the area: the shift makes the right-hand matrix positive definite without anchors, where
 * constants have lambda = 0, and the error of lambda_k is a few roundings times (lambda_k + 1/A)
 * (1 + A lambda_k). */
#include "modes.h"

#include "fail.h"
#include "galerkin.h"

#include <gsl/gsl_eigen.h>
#include <gsl/gsl_errno.h>
#include <gsl/gsl_sort_vector.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define AGREEMENT 1e-8
/* The first grid integrates products of two harmonics exactly on a sphere, with as much again for
 * the metric; the last takes about ten seconds. */
#define RINGS_MIN 32
#define RINGS_PER_DEGREE 4
#define RINGS_MAX 4096

#define SQRT_4PI 3.5449077018110320546

typedef struct job {
    const double *coefficients_m;
    const shcd_modes_options *settings;
    shcdi_progress progress;
    shcdi_galerkin g;
    double *copies;          /* of the matrices, which the solver destroys: 2 n^2 */
    double *vectors;         /* n^2: one eigenvector in each column */
    double *eigenvalues;     /* memory of the next two */
    double *lambda, *before; /* n each: of this quadrature and of the one before */
    size_t n_rings;
    double agreement;
    shcd_error *error;
} job;

static shcd_status explain(const job *j, shcd_status status) {
    const char *why = status == SHCD_ERR_MEMORY      ? "out of memory"
                      : status == SHCD_ERR_CANCELLED ? "stopped by the caller"
                      : status == SHCD_ERR_GEOMETRY
                          ? "the surface has a point without a tangent plane"
                          : shcd_status_string(status);
    return shcdi_fit_fail(j->error, status, "fit_modes: %s", why);
}

static shcd_status prepare(job *j, int degree) {
    const size_t n = SHCD_COUNT(degree);
    const shcd_status status = shcdi_galerkin_init(&j->g, degree, j->settings->n_anchors);
    j->copies = malloc(2 * n * n * sizeof *j->copies);
    j->vectors = malloc(n * n * sizeof *j->vectors);
    j->eigenvalues = malloc(2 * n * sizeof *j->eigenvalues);
    if (status != SHCD_OK || j->copies == NULL || j->vectors == NULL || j->eigenvalues == NULL) {
        return SHCD_ERR_MEMORY;
    }
    j->lambda = j->eigenvalues;
    j->before = j->eigenvalues + n;
    return SHCD_OK;
}

static void release(job *j) {
    shcdi_galerkin_release(&j->g);
    free(j->copies);
    free(j->vectors);
    free(j->eigenvalues);
}

/* ---- the eigenproblem ---- */

/* The matrices M and K + M/A, for the solver to destroy. */
static void copy_matrices(job *j, gsl_matrix_view *m, gsl_matrix_view *k) {
    const size_t n = j->g.n;
    const double shift = 1.0 / j->g.area_m2;
    double *mass = j->copies, *shifted = j->copies + n * n;
    for (size_t i = 0; i < n * n; ++i) {
        mass[i] = j->g.mass[i];
        shifted[i] = j->g.stiffness[i] + shift * j->g.mass[i];
    }
    *m = gsl_matrix_view_array(mass, n, n);
    *k = gsl_matrix_view_array(shifted, n, n);
}

static int solve_values(gsl_matrix *m, gsl_matrix *k, gsl_vector *mu) {
    gsl_eigen_gensymm_workspace *work = gsl_eigen_gensymm_alloc(mu->size);
    int status = GSL_ENOMEM;
    if (work != NULL) {
        status = gsl_eigen_gensymm(m, k, mu, work);
        gsl_eigen_gensymm_free(work);
    }
    if (status == GSL_SUCCESS) {
        gsl_sort_vector(mu);
        gsl_vector_reverse(mu);
    }
    return status;
}

static int solve_vectors(gsl_matrix *m, gsl_matrix *k, gsl_vector *mu, gsl_matrix *vectors) {
    gsl_eigen_gensymmv_workspace *work = gsl_eigen_gensymmv_alloc(mu->size);
    int status = GSL_ENOMEM;
    if (work != NULL) {
        status = gsl_eigen_gensymmv(m, k, mu, vectors, work);
        gsl_eigen_gensymmv_free(work);
    }
    return status == GSL_SUCCESS ? gsl_eigen_gensymmv_sort(mu, vectors, GSL_EIGEN_SORT_VAL_DESC)
                                 : status;
}

/* All eigenvalues, ascending, into lambda; the vectors, too, if wanted.
 * @return SHCD_ERR_CONVERGENCE: the matrix is not positive definite with so few nodes. */
static shcd_status solve(job *j, int with_vectors) {
    gsl_matrix_view m, k;
    gsl_matrix_view vectors = gsl_matrix_view_array(j->vectors, j->g.n, j->g.n);
    gsl_vector_view mu = gsl_vector_view_array(j->lambda, j->g.n);
    copy_matrices(j, &m, &k);
    gsl_error_handler_t *handler = gsl_set_error_handler_off();
    const int status = with_vectors
                           ? solve_vectors(&m.matrix, &k.matrix, &mu.vector, &vectors.matrix)
                           : solve_values(&m.matrix, &k.matrix, &mu.vector);
    gsl_set_error_handler(handler);
    if (status != GSL_SUCCESS) {
        return status == GSL_ENOMEM ? SHCD_ERR_MEMORY : SHCD_ERR_CONVERGENCE;
    }
    for (size_t i = 0; i < j->g.n; ++i) {
        const double lambda = 1.0 / j->lambda[i] - 1.0 / j->g.area_m2;
        j->lambda[i] = lambda > 0.0 ? lambda : 0.0;
        if (!(isfinite(lambda) && j->lambda[i] >= (i > 0 ? j->lambda[i - 1] : 0.0))) {
            return SHCD_ERR_CONVERGENCE; /* some mu is not positive: as above */
        }
    }
    if (j->settings->n_anchors == 0) {
        j->lambda[0] = 0.0;
    }
    return SHCD_OK;
}

/* ---- refinement ---- */

static double largest_change(const job *j) {
    double largest = 0.0;
    for (int i = 0; i < j->settings->n_modes; ++i) {
        const double change = fabs(j->lambda[i] - j->before[i]);
        largest = fmax(largest, change / (j->lambda[i] + 1.0 / j->g.area_m2));
    }
    return largest;
}

/* The next grid: matrices and eigenvalues; infinite ones if the solver refuses. */
static shcd_status refine(job *j) {
    double *const last = j->lambda;
    j->lambda = j->before;
    j->before = last;
    shcd_status status =
        shcdi_galerkin_fill(&j->g, j->coefficients_m, j->n_rings, j->settings->anchors,
                            j->settings->n_anchors, &j->progress);
    if (status == SHCD_OK) {
        status = shcdi_progress_report(&j->progress, "modes: eigenvalues", 0.0);
    }
    if (status != SHCD_OK) {
        return status;
    }
    status = solve(j, 0);
    if (status == SHCD_ERR_CONVERGENCE) {
        for (size_t i = 0; i < j->g.n; ++i) {
            j->lambda[i] = HUGE_VAL;
        }
    }
    return status == SHCD_ERR_MEMORY ? status : SHCD_OK;
}

static shcd_status converge(job *j) {
    const size_t by_degree = RINGS_PER_DEGREE * ((size_t)j->g.degree + 1);
    j->n_rings = by_degree > RINGS_MIN ? by_degree : RINGS_MIN;
    shcd_status status = refine(j);
    j->agreement = HUGE_VAL;
    while (status == SHCD_OK && 2 * j->n_rings <= RINGS_MAX) {
        j->n_rings *= 2;
        status = refine(j);
        const double change = status == SHCD_OK ? largest_change(j) : HUGE_VAL;
        j->agreement = isfinite(change) ? change : HUGE_VAL;
        if (j->agreement <= AGREEMENT) {
            return SHCD_OK;
        }
    }
    if (status != SHCD_OK) {
        return explain(j, status);
    }
    return shcdi_fit_fail(j->error, SHCD_ERR_CONVERGENCE,
                          "fit_modes: with %zu x %zu nodes eigenvalues still change by %.2g of "
                          "lambda + 1/area, more than %.0e: the surface is too thin or too sharply "
                          "creased for its parameterization",
                          j->n_rings, 2 * j->n_rings, j->agreement, AGREEMENT);
}

static shcd_status check_anchors(const job *j) {
    for (size_t i = 0; i < j->settings->n_anchors; ++i) {
        if (!(j->g.anchor_integral[i] > 0.0)) {
            return shcdi_fit_fail(
                j->error, SHCD_ERR_ARGUMENT,
                "fit_modes: anchor %zu, radius %g m about (%g, %g, %g), reaches "
                "no point of the surface",
                i, j->settings->anchors[i].radius_m, j->settings->anchors[i].point_m.x,
                j->settings->anchors[i].point_m.y, j->settings->anchors[i].point_m.z);
        }
    }
    return SHCD_OK;
}

/* ---- the result ---- */

static double dot(const double *a, const double *b, size_t n) {
    double sum = 0.0;
    for (size_t i = 0; i < n; ++i) {
        sum += a[i] * b[i];
    }
    return sum;
}

static void times_mass(const job *j, const double *x, double *mx) {
    for (size_t i = 0; i < j->g.n; ++i) {
        mx[i] = dot(j->g.mass + i * j->g.n, x, j->g.n);
    }
}

/* x^T M x = 1 and x^T M y = 0 for the vectors before it: the solver's are orthogonal to a few
 * roundings times 1 + A lambda, so that one pass of Gram-Schmidt leaves roundings. */
static void orthonormalise(const job *j, double *rows, size_t k, double *mx) {
    const size_t n = j->g.n;
    double *x = rows + k * n;
    times_mass(j, x, mx);
    for (size_t i = 0; i < k; ++i) {
        const double share = dot(rows + i * n, mx, n);
        for (size_t c = 0; c < n; ++c) {
            x[c] -= share * rows[i * n + c];
        }
    }
    times_mass(j, x, mx);
    const double scale = 1.0 / sqrt(dot(x, mx, n));
    for (size_t c = 0; c < n; ++c) {
        x[c] *= scale;
    }
}

/* From the matrices' order to the public one, the largest coefficient positive. */
static void write_row(const job *j, const double *x, double *row) {
    const int degree = j->g.degree;
    double largest = 0.0;
    for (int l = 0; l <= degree; ++l) {
        for (int m = -l; m <= l; ++m) {
            const double value = x[shcdi_galerkin_index(degree, l, m)];
            row[SHCD_INDEX(l, m)] = value;
            largest = fabs(value) > fabs(largest) ? value : largest;
        }
    }
    for (size_t i = 0; largest < 0.0 && i < j->g.n; ++i) {
        row[i] = -row[i];
    }
}

/* The copies of the matrices have served: their memory holds the rows, the vectors' the product. */
static void write_modes(job *j, shcd_modes *modes, double *numbers) {
    const size_t n = j->g.n, n_modes = modes->n_modes;
    double *rows = j->copies;
    for (size_t k = 0; k < n_modes; ++k) {
        for (size_t i = 0; i < n; ++i) {
            rows[k * n + i] = j->vectors[i * n + k];
        }
    }
    for (size_t k = 0; k < n_modes; ++k) {
        if (k == 0 && !modes->is_anchored) {
            memset(rows, 0, n * sizeof *rows);
            rows[shcdi_galerkin_index(j->g.degree, 0, 0)] = SQRT_4PI / sqrt(j->g.area_m2);
        } else {
            orthonormalise(j, rows, k, j->vectors);
        }
        numbers[k] = j->lambda[k];
        write_row(j, rows + k * n, numbers + n_modes + k * n);
    }
}

static shcd_status make(job *j, shcd_modes **modes) {
    const size_t n_modes = (size_t)j->settings->n_modes;
    const size_t n_numbers = n_modes * (1 + j->g.n);
    shcd_status status = shcdi_progress_report(&j->progress, "modes: vectors", 0.0);
    status = status == SHCD_OK ? solve(j, 1) : status;
    shcd_modes *made = NULL;
    if (status == SHCD_OK) {
        made = malloc(sizeof *made + n_numbers * sizeof(double));
        status = made != NULL ? SHCD_OK : SHCD_ERR_MEMORY;
    }
    if (status != SHCD_OK) {
        return explain(j, status);
    }
    double *numbers = (double *)(void *)(made + 1);
    *made = (shcd_modes){.n_modes = n_modes,
                         .eigenvalue_per_m2 = numbers,
                         .coefficient_per_m = numbers + n_modes,
                         .area_m2 = j->g.area_m2,
                         .eigenvalue_error = j->agreement,
                         .volume_m3 = j->g.volume_m3,
                         .is_anchored = j->settings->n_anchors > 0};
    write_modes(j, made, numbers);
    *modes = made;
    return SHCD_OK;
}

shcd_status shcdi_modes_compute(int degree, const double *coefficients,
                                const shcd_modes_options *settings, shcd_modes **modes,
                                shcd_error *error) {
    job j = {.coefficients_m = coefficients,
             .settings = settings,
             .progress = {settings->progress, settings->progress_user},
             .error = error};
    shcd_status status = prepare(&j, degree);
    if (status != SHCD_OK) {
        (void)explain(&j, status);
    } else {
        status = converge(&j);
    }
    status = status == SHCD_OK ? check_anchors(&j) : status;
    status = status == SHCD_OK ? make(&j, modes) : status;
    release(&j);
    return status;
}

shcd_status shcd_fit_modes(const shcd_model *model, const shcd_modes_options *options,
                           shcd_modes **modes, shcd_error *error) {
    if (model == NULL || modes == NULL) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT, "fit_modes: null argument");
    }
    const int degree = shcd_model_degree(model);
    shcd_modes_options settings;
    shcd_anchor anchors[SHCD_ANCHORS_MAX];
    const shcd_status status = shcdi_modes_settings(options, degree, &settings, anchors, error);
    return status == SHCD_OK ? shcdi_modes_compute(degree, shcd_model_coefficients(model),
                                                   &settings, modes, error)
                             : status;
}

void shcd_modes_free(shcd_modes *modes) {
    free(modes);
}
