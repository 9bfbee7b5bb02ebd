/* SPDX-License-Identifier: BSD-3-Clause */
/* Subspace iteration with (K + s M)^-1 M, s of the size of the lowest eigenvalues: from a block
 * that is larger than the number of wanted ones, error components die off by the ratio of a wanted
 * lambda + s to the first one outside of the block, squared in the Ritz values. */
#include "support/membrane_fe.h"

#include "support/check.h"

#include <gsl/gsl_eigen.h>
#include <gsl/gsl_sort_vector.h>

#include <string.h>

#define SETTLED 1e-10
#define SWEEPS_MAX 200

typedef struct block {
    const membrane_fe *fe;
    membrane_fe_factor *factor;
    size_t n, size;      /* vertices, vectors */
    double *x, *mx, *kx; /* size rows of n */
    gsl_matrix *k, *m, *vectors;
    gsl_vector *ritz;
    gsl_eigen_gensymmv_workspace *work;
} block;

static double dot(const double *a, const double *b, size_t n) {
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

/* x <- (K + s M)^-1 M x, scaled so that nothing overflows. */
static void power(block *b) {
    for (size_t j = 0; j < b->size; j++) {
        double *x = b->x + j * b->n, *mx = b->mx + j * b->n;
        membrane_fe_times_mass(b->fe, x, mx);
        membrane_fe_solve(b->factor, mx);
        const double scale = 1.0 / sqrt(dot(mx, mx, b->n));
        for (size_t i = 0; i < b->n; i++) {
            x[i] = scale * mx[i];
        }
    }
}

/* The best approximations within the block become its vectors, their values ascend in b->ritz. */
static void rayleigh_ritz(block *b) {
    for (size_t j = 0; j < b->size; j++) {
        membrane_fe_times_mass(b->fe, b->x + j * b->n, b->mx + j * b->n);
        membrane_fe_times_stiffness(b->fe, b->x + j * b->n, b->kx + j * b->n);
    }
    for (size_t i = 0; i < b->size; i++) {
        for (size_t j = 0; j < b->size; j++) {
            gsl_matrix_set(b->k, i, j, dot(b->x + i * b->n, b->kx + j * b->n, b->n));
            gsl_matrix_set(b->m, i, j, dot(b->x + i * b->n, b->mx + j * b->n, b->n));
        }
    }
    assert_int_equal(gsl_eigen_gensymmv(b->k, b->m, b->ritz, b->vectors, b->work), 0);
    gsl_eigen_gensymmv_sort(b->ritz, b->vectors, GSL_EIGEN_SORT_VAL_ASC);
    memset(b->mx, 0, b->size * b->n * sizeof *b->mx);
    for (size_t j = 0; j < b->size; j++) {
        for (size_t k = 0; k < b->size; k++) {
            const double share = gsl_matrix_get(b->vectors, k, j);
            for (size_t i = 0; i < b->n; i++) {
                b->mx[j * b->n + i] += share * b->x[k * b->n + i];
            }
        }
    }
    memcpy(b->x, b->mx, b->size * b->n * sizeof *b->x);
}

static block make_block(const membrane_fe *fe, size_t size, double shift) {
    const size_t n = membrane_fe_count(fe);
    block b = {fe,   membrane_fe_factorise(fe, 1.0, shift),
               n,    size,
               NULL, NULL,
               NULL, NULL,
               NULL, NULL,
               NULL, NULL};
    check_random random = {0xe16e11u};
    b.x = malloc(3 * size * n * sizeof *b.x);
    assert_non_null(b.x);
    b.mx = b.x + size * n;
    b.kx = b.mx + size * n;
    for (size_t i = 0; i < size * n; i++) {
        b.x[i] = check_uniform(&random, -1.0, 1.0);
    }
    b.k = gsl_matrix_alloc(size, size);
    b.m = gsl_matrix_alloc(size, size);
    b.vectors = gsl_matrix_alloc(size, size);
    b.ritz = gsl_vector_alloc(size);
    b.work = gsl_eigen_gensymmv_alloc(size);
    return b;
}

void membrane_fe_eigenvalues(const membrane_fe *fe, size_t n, double *lambda_per_m2) {
    const double shift = 1.0 / membrane_fe_integral(fe, NULL, NULL);
    block b = make_block(fe, 2 * n + 8, shift);
    double change = HUGE_VAL;
    for (int sweep = 0; sweep < SWEEPS_MAX && change > SETTLED; sweep++) {
        power(&b);
        rayleigh_ritz(&b);
        change = 0.0;
        for (size_t i = 0; i < n; i++) {
            const double value = gsl_vector_get(b.ritz, i);
            const double before = sweep > 0 ? lambda_per_m2[i] : HUGE_VAL;
            change = fmax(change, fabs(value - before) / (fabs(value) + shift));
            lambda_per_m2[i] = value;
        }
    }
    assert_at_most(change, SETTLED);
    gsl_eigen_gensymmv_free(b.work);
    gsl_vector_free(b.ritz);
    gsl_matrix_free(b.vectors);
    gsl_matrix_free(b.m);
    gsl_matrix_free(b.k);
    free(b.x);
    membrane_fe_factor_free(b.factor);
}
