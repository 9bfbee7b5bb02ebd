/* SPDX-License-Identifier: BSD-3-Clause */
/* Preconditioned L-BFGS for unit vectors on a mesh. */
#ifndef SHCD_FIT_OPTIMISE_H
#define SHCD_FIT_OPTIMISE_H

#include "energy.h"
#include "laplacian.h"
#include "progress.h"

typedef struct shcdi_optimiser shcdi_optimiser;

/** One run of descent at fixed eps and area weight. */
typedef struct shcdi_descent {
    double eps;              /**< regularisation of the barrier; 0: stay unfolded */
    uint64_t iterations_max; /**< cap */
    uint64_t window;         /**< stop if `window` iterations gained less than ... */
    double tolerance;        /**< ... this share of the energy */
    double first_step_rad;   /**< longest move of a vertex while no curvature is known */
    uint64_t refactor_every; /**< iterations between reweighted factorisations; 0: never refactor */
    int stop_unfolded;       /**< stop as soon as no triangle is folded */
    const char *stage;       /**< for the progress callback */
    const shcdi_progress *progress;
} shcdi_descent;

shcd_status shcdi_optimiser_create(const shcdi_energy *energy, shcdi_laplacian *laplacian,
                                   shcdi_optimiser **optimiser);
void shcdi_optimiser_free(shcdi_optimiser *optimiser);

/** Lowers the energy of the map u in place. With refactor_every = 0 the laplacian must have been
 *  factorised by the caller.
 *  @param[in,out] iterations  grows by the number of iterations done
 *  @return SHCD_OK (converged or capped), SHCD_ERR_MEMORY, SHCD_ERR_CANCELLED, SHCD_ERR_CONVERGENCE
 *  (the preconditioner broke down) */
shcd_status shcdi_optimiser_descend(shcdi_optimiser *optimiser, const shcdi_descent *descent,
                                    shcd_vec3 *u, uint64_t *iterations);

#endif
