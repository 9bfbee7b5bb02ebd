/* SPDX-License-Identifier: BSD-3-Clause */
/* Grids of directions: where their nodes are, and which nodes surround a direction. Both are fixed
 * by (grid, n) alone. Samples live in slots; cells are the patches between nodes. */
#ifndef SHCDI_MODEL_MAP_GRID_H
#define SHCDI_MODEL_MAP_GRID_H

#include "base/internal.h"
#include "shcd/map.h"

/** The nodes around a direction, and their weights in linear interpolation. */
typedef struct shcdi_stencil {
    int n; /**< 3 or 4 */
    size_t slot[4];
    double weight[4]; /**< sum 1 */
    int p[3][3];      /**< octahedral: the nodes as lattice points */
    size_t cell;
} shcdi_stencil;

size_t shcdi_grid_slots(int grid, int n);
size_t shcdi_grid_nodes(int grid, int n);
size_t shcdi_grid_cells(int grid, int n);

/** RT safe; `d` finite, of any length that has a square. */
void shcdi_grid_locate(int grid, int n, shcd_vec3 d, shcdi_stencil *at);

/** Calls visit(user, slot, direction) for each node once; stops and returns 0 when that does. */
int shcdi_grid_visit_nodes(int grid, int n,
                           int (*visit)(void *user, size_t slot, shcd_vec3 direction), void *user);

/** A cell in coordinates in which it is flat: octahedral, the lattice (x, y, z) with
 *  |x| + |y| + |z| = n; latitude-longitude, (theta, phi, unused). */
typedef struct shcdi_cell {
    int n; /**< corners: 3, or 4 as (0,0), (0,1), (1,0), (1,1) in (theta, phi) */
    size_t index;
    size_t slot[4];
    double u[4][3];
} shcdi_cell;

int shcdi_grid_visit_cells(int grid, int n, int (*visit)(void *user, const shcdi_cell *cell),
                           void *user);

/** Unit direction of cell coordinates. Not RT safe (libm). */
shcd_vec3 shcdi_grid_direction(int grid, const double u[3]);

/** Angle of (x, y) in [0, 2 pi), within 2e-15 of the true one; 0 for (0, 0). RT safe: no libm. */
double shcdi_angle(double y, double x);

#endif
