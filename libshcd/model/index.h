/* SPDX-License-Identifier: BSD-3-Clause */
/* What a query searches: the leaves of the tree (model/tree.h) in blocks of 16, stored compactly in
 * the order in which they are scanned. Two parts: tables that depend on the level only, and the
 * body's positions and bounds; the positions can be evaluated anew for a deformed shape. */
#ifndef SHCDI_MODEL_INDEX_H
#define SHCDI_MODEL_INDEX_H

#include "model/scan.h"
#include "model/surface.h"
#include "model/tree.h"

#define SHCDI_BLOCKS_MAX (8u << (2 * (SHCDI_TREE_LEVEL_MAX - 2)))

/** Sectors: a quarter of the blocks up to SHCDI_SECTOR_DEGREE, about a sixteenth beyond; all of the
 *  smallest tree. */
#define SHCDI_SECTORS_MAX 16
#define SHCDI_SECTOR_DEGREE 15
#define SHCDI_SECTOR_VERTICES_MAX 96
#define SHCDI_SECTOR_PLACES_MAX (3 * 16 * SHCDI_SECTOR_VERTICES_MAX)

/** Node directions and their places in the blocks; the same for every body. */
typedef struct shcdi_index_table {
    int level;
    size_t n_vertices, n_blocks;
    shcd_vec3 *direction; /**< n_vertices unit vectors */
    uint16_t *node;       /**< 16 n_blocks: vertices of each block */
    double angle;         /**< every leaf lies within this angle of its centre */
    double reach;         /**< derivative bounds hold within this angle of a leaf's centre */
    /** A leaf's deviation grows by at most this times what |S'|, |S''| grow by. */
    double per_first, per_second;
    /** Blocks that are evaluated together (sectors.c): those of sector q are sector_block[t],
     *  t = sector_at[q] .. sector_at[q + 1] - 1. Node i of the t-th is source[16 t + i] =
     *  image * stride + vertex, counted from sector_vertex_at[q]. */
    size_t n_sectors;
    uint16_t sector_at[SHCDI_SECTORS_MAX + 1], sector_vertex_at[SHCDI_SECTORS_MAX + 1];
    uint16_t *sector_block, *source;
    shcd_vec3 *sector_vertex;
} shcdi_index_table;

/** Where the nodes are; all lengths times `scale`, all places relative to the origin. */
typedef struct shcdi_positions {
    shcdi_block *block; /**< n_blocks */
    float *ball;        /**< x, y, z, radius of the blocks' balls, n_balls each */
} shcdi_positions;

typedef struct shcdi_index {
    shcdi_index_table table;
    shcd_vec3 origin; /**< [m] */
    double scale;     /**< a power of two [1/m]: |S - origin| scale <= 1 at rest */
    size_t n_balls;   /**< n_blocks, rounded up to a multiple of 16 */
    shcdi_positions rest;
    shcdi_block_bounds *bounds; /**< n_blocks */
} shcdi_index;

/** Bytes of positions, a multiple of 8. */
size_t shcdi_positions_bytes(const shcdi_index *index);
/** Lays positions out in such a block of memory. */
shcdi_positions shcdi_positions_at(const shcdi_index *index, const void *memory);

/** Evaluates all node positions of a series that stays within `reach_m` of the index's origin. RT
 *  safe. */
void shcdi_positions_fill(const shcdi_index *index, const shcdi_series *series, double reach_m,
                          shcdi_positions *positions);
/** Only those of a sector's blocks. RT safe. */
void shcdi_positions_fill_sector(const shcdi_index *index, const shcdi_series *series,
                                 double reach_m, size_t sector, shcdi_positions *positions);
/** Number of vertices to have room for. */
size_t shcdi_sector_vertex_count(size_t n_blocks);
/** Cuts the blocks into sectors; directions and nodes are there. */
void shcdi_sectors_fill(shcdi_index_table *table, int degree);

/** Places from one mirror image of a sector's vertices to the next. */
static inline size_t shcdi_sector_stride(const shcdi_index_table *table, size_t sector) {
    const size_t n =
        (size_t)table->sector_vertex_at[sector + 1] - (size_t)table->sector_vertex_at[sector];
    return (n + 7) & ~(size_t)7;
}

/** Builds the index of a filled tree. @return SHCD_OK or SHCD_ERR_MEMORY. */
shcd_status shcdi_index_create(const shcdi_tree *tree, const shcdi_series *series, shcd_vec3 origin,
                               double radius, const shcd_allocator *allocator, shcdi_index *index);
void shcdi_index_free(shcdi_index *index, const shcd_allocator *allocator);

/** Bytes of the tables and of the body's own part. */
size_t shcdi_index_table_bytes(const shcdi_index *index);
size_t shcdi_index_body_bytes(const shcdi_index *index);

static inline shcd_vec3 shcdi_index_direction(const shcdi_index *index, size_t leaf, int k) {
    const size_t block = leaf / SHCDI_BLOCK_LEAVES, i = leaf % SHCDI_BLOCK_LEAVES;
    return index->table
        .direction[index->table.node[block * SHCDI_BLOCK_NODES + shcdi_block_corner[k][i]]];
}

#endif
