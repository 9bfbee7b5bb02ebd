/* SPDX-License-Identifier: BSD-3-Clause */
/* Where the nodes are: positions evaluated on a lattice, sector by sector, and made into blocks
 * (block_kernel.h). */
#include "model/index.h"

#define LATTICE_BITS 29

static size_t aligned(size_t bytes) {
    return (bytes + 7) & ~(size_t)7;
}

size_t shcdi_positions_bytes(const shcdi_index *index) {
    return aligned(index->table.n_blocks * sizeof(shcdi_block)) +
           4 * index->n_balls * sizeof(float);
}

shcdi_positions shcdi_positions_at(const shcdi_index *index, const void *memory) {
    union {
        const void *given;
        char *bytes;
    } m = {memory}; /* the same layout serves constant and changing positions */
    shcdi_positions p;
    p.block = (shcdi_block *)(void *)m.bytes;
    p.ball = (float *)(void *)(m.bytes + aligned(index->table.n_blocks * sizeof(shcdi_block)));
    return p;
}

/* Steps so long that all of the surface lies within 2^29 of them from the origin; a power of two of
 * them makes a scaled length of 1. */
static double lattice_factor(const shcdi_index *index, double reach_m) {
    double factor = index->scale * (double)(1u << LATTICE_BITS);
    while (reach_m * (1.0 + 1e-9) * factor > (double)(1u << LATTICE_BITS)) {
        factor *= 0.5;
    }
    return factor;
}

void shcdi_positions_fill_sector(const shcdi_index *index, const shcdi_series *series,
                                 double reach_m, size_t sector, shcdi_positions *positions) {
    const shcdi_index_table *table = &index->table;
    const size_t first = table->sector_at[sector], vertex = table->sector_vertex_at[sector];
    const shcdi_lattice lattice = {index->origin, lattice_factor(index, reach_m),
                                   shcdi_sector_stride(table, sector)};
    int32_t place[SHCDI_SECTOR_PLACES_MAX];
    shcdi_surface_lattice(series, &lattice, table->sector_vertex + vertex,
                          (size_t)table->sector_vertex_at[sector + 1] - vertex, place);
    const shcdi_block_fill fill = {.place = place,
                                   .plane = 16 * lattice.stride,
                                   .source = table->source + SHCDI_BLOCK_NODES * first,
                                   .index = table->sector_block + first,
                                   .n = (size_t)table->sector_at[sector + 1] - first,
                                   .bounds = index->bounds,
                                   .step = (float)(index->scale / lattice.factor),
                                   .block = positions->block,
                                   .ball = positions->ball,
                                   .n_balls = index->n_balls};
    shcdi_scan_fill(series->simd, &fill);
}

void shcdi_positions_fill(const shcdi_index *index, const shcdi_series *series, double reach_m,
                          shcdi_positions *positions) {
    for (size_t q = 0; q < index->table.n_sectors; q++) {
        shcdi_positions_fill_sector(index, series, reach_m, q, positions);
    }
    for (size_t b = index->table.n_blocks; b < index->n_balls; b++) {
        for (size_t k = 0; k < 3; k++) {
            positions->ball[k * index->n_balls + b] = 0.0f;
        }
        positions->ball[3 * index->n_balls + b] = -HUGE_VALF;
    }
}
