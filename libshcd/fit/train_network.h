/* SPDX-License-Identifier: BSD-3-Clause */
/* Least squares for the learned response: from samples at places of the surface to the centres and
 * weights of a network. */
#ifndef SHCD_FIT_TRAIN_NETWORK_H
#define SHCD_FIT_TRAIN_NETWORK_H

#include "progress.h"

/** One sample at a place. Energies and slopes that are not known are NAN. */
typedef struct shcdi_train_row {
    double depth_m, force_n, energy_j, speed_m_per_s;
    double slope_n[2]; /**< dU/dx along the place's tangents */
} shcdi_train_row;

/** A place of the surface and the samples there. */
typedef struct shcdi_train_place {
    shcd_vec3 point_m, tangent[2]; /**< tangents are read where rows have slopes */
    size_t first, n;               /**< rows */
} shcdi_train_place;

typedef struct shcdi_train_set {
    shcdi_train_place *place;
    size_t n_places;
    shcdi_train_row *row;
    size_t n_rows;
    double depth_max_m;
} shcdi_train_set;

typedef struct shcdi_train_settings {
    size_t n_centres; /**< at most; no more than there are places */
    size_t n_terms;   /**< at most */
    int has_speed;
    int wants_consistency;
} shcdi_train_settings;

/** Indices of the first n of all places in greedy order: each next one is farthest from those
 *  before it, the first is `start`. distance: of every place to the nearest chosen one, n_places.
 */
void shcdi_train_greedy(const shcdi_train_set *set, size_t start, size_t n, size_t *chosen,
                        double *distance);

/** Chooses centres, support, number of terms and ridge (cross-validation over the places), and
 *  solves for the weights. Fills of *network: n_centres, n_terms, the two arrays (in `numbers`),
 *  support_m, fill_m, depth_max_m, damping_n_s_per_m2, record.ridge.
 *  @param[out] numbers  room for 3 n_centres + (n_centres + 1) n_terms doubles
 *  @param[out] consistency_n  rms of force - dU/d depth of a network that saw the energies only;
 *                             0 if not all rows have both
 *  @return SHCD_OK, SHCD_ERR_MEMORY, SHCD_ERR_CONVERGENCE, SHCD_ERR_CANCELLED. */
shcd_status shcdi_train_network(const shcdi_train_set *set, const shcdi_train_settings *settings,
                                const shcdi_progress *progress, double *numbers,
                                shcd_learned *network, double *consistency_n);

#endif
