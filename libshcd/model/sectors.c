/* SPDX-License-Identifier: BSD-3-Clause */
/* Which blocks are evaluated together. A direction's 16 mirror images (surface.h) cost little more
 * than itself, and neighbouring blocks share nodes: a sector is a run of the first octant's blocks,
 * with those that they become when x and y are exchanged, and all their images. */
#include "model/index.h"

#include <string.h>

#define OCTANT_BLOCKS_MAX (SHCDI_BLOCKS_MAX / 8)

static const shcd_vec3 *node_of(const shcdi_index_table *table, size_t block, size_t i) {
    return &table->direction[table->node[SHCDI_BLOCK_NODES * block + i]];
}

static shcd_vec3 mirrored(shcd_vec3 w, size_t image) {
    const shcd_vec3 v = image & 8 ? shcd_vec3_make(w.y, w.x, w.z) : w;
    return shcd_vec3_make(image & 1 ? -v.x : v.x, image & 2 ? -v.y : v.y, image & 4 ? -v.z : v.z);
}

static int is_same(shcd_vec3 a, shcd_vec3 b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
}

/* Midpoints of mirrored edges are mirrored to the last bit, since negation is exact and so is the
 * sum of two squares exchanged: images are found by comparison. */
static int has_node(const shcdi_index_table *table, size_t block, shcd_vec3 w) {
    for (size_t i = 0; i < SHCDI_BLOCK_NODES; i++) {
        if (is_same(*node_of(table, block, i), w)) {
            return 1;
        }
    }
    return 0;
}

/* The first octant's block that block b is an image of. Three corners tell. */
static size_t original_of(const shcdi_index_table *table, size_t b, size_t image) {
    const size_t n = table->n_blocks / 8;
    const shcd_vec3 c[3] = {*node_of(table, b, 14), *node_of(table, b, 4), *node_of(table, b, 0)};
    size_t j = 0;
    while (j < n && (!has_node(table, j, mirrored(c[0], image)) ||
                     !has_node(table, j, mirrored(c[1], image)) ||
                     !has_node(table, j, mirrored(c[2], image)))) {
        j++;
    }
    SHCD_ASSERT(j < n);
    return j;
}

/* Runs of at least `wanted` blocks, closed under the exchange. @return their number. */
static size_t cut(const shcdi_index_table *table, size_t wanted, uint8_t *sector) {
    const size_t n = table->n_blocks / 8;
    size_t at = 0, filled = 0;
    memset(sector, 0xff, n);
    for (size_t j = 0; j < n; j++) {
        if (sector[j] != 0xff) {
            continue;
        }
        if (filled >= wanted) {
            at++;
            filled = 0;
        }
        const size_t other = original_of(table, j, 8);
        sector[j] = sector[other] = (uint8_t)at;
        filled += other == j ? 1 : 2;
    }
    return at + 1;
}

/* Place of a node among the sector's vertices and their images. Vertices have x >= y >= 0, z >= 0.
 * A new one is added. */
static size_t source_of(shcdi_index_table *table, size_t sector, shcd_vec3 w, size_t *image) {
    const double x = fabs(w.x), y = fabs(w.y);
    const shcd_vec3 v = x < y ? shcd_vec3_make(y, x, fabs(w.z)) : shcd_vec3_make(x, y, fabs(w.z));
    *image =
        (x < y ? 8u : 0u) | (w.x < 0.0 ? 1u : 0u) | (w.y < 0.0 ? 2u : 0u) | (w.z < 0.0 ? 4u : 0u);
    const size_t first = table->sector_vertex_at[sector];
    size_t end = table->sector_vertex_at[sector + 1], i = first;
    while (i < end && !is_same(table->sector_vertex[i], v)) {
        i++;
    }
    if (i == end) {
        SHCD_ASSERT(end < shcdi_sector_vertex_count(table->n_blocks));
        table->sector_vertex[end] = v;
        table->sector_vertex_at[sector + 1] = (uint16_t)++end;
        SHCD_ASSERT(end - first <= SHCDI_SECTOR_VERTICES_MAX);
    }
    return i - first;
}

static void fill_sector(shcdi_index_table *table, size_t sector) {
    const size_t first = table->sector_at[sector], end = table->sector_at[sector + 1];
    table->sector_vertex_at[sector + 1] = table->sector_vertex_at[sector];
    /* twice: how far images are apart is known when all vertices are */
    for (int round = 0; round < 2; round++) {
        const size_t stride = shcdi_sector_stride(table, sector);
        for (size_t t = first; t < end; t++) {
            for (size_t i = 0; i < SHCDI_BLOCK_NODES; i++) {
                size_t image;
                const size_t vertex =
                    source_of(table, sector, *node_of(table, table->sector_block[t], i), &image);
                table->source[SHCDI_BLOCK_NODES * t + i] = (uint16_t)(image * stride + vertex);
            }
        }
    }
}

size_t shcdi_sector_vertex_count(size_t n_blocks) {
    /* 89 for 128 blocks, 29 for 32: the cuts are the same for every body of a level and a degree
     * below or above SHCDI_SECTOR_DEGREE */
    return n_blocks;
}

void shcdi_sectors_fill(shcdi_index_table *table, int degree) {
    const size_t n = table->n_blocks / 8;
    const size_t share = n < 16 ? 1 : degree <= SHCDI_SECTOR_DEGREE ? 4 : 16;
    uint8_t sector[OCTANT_BLOCKS_MAX];
    uint16_t image_block[8][OCTANT_BLOCKS_MAX];
    size_t filled = 0;
    table->n_sectors = cut(table, n / share < 16 ? n / share : 16, sector);
    SHCD_ASSERT(table->n_sectors <= SHCDI_SECTORS_MAX);
    /* octants follow each other in the order of the images (tree.c) */
    for (size_t b = 0; b < table->n_blocks; b++) {
        image_block[b / n][original_of(table, b, b / n)] = (uint16_t)b;
    }
    table->sector_at[0] = table->sector_vertex_at[0] = 0;
    for (size_t q = 0; q < table->n_sectors; q++) {
        for (size_t j = 0; j < n; j++) {
            for (size_t s = 0; s < 8 && sector[j] == q; s++) {
                table->sector_block[filled++] = image_block[s][j];
            }
        }
        table->sector_at[q + 1] = (uint16_t)filled;
        fill_sector(table, q);
    }
}
