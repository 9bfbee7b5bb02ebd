/* SPDX-License-Identifier: BSD-3-Clause */
/* The compact form of the tree.
 *
 * A block's 15 nodes are stored on a grid of its own (16 bits a coordinate), derivative bounds as
 * the upper halves of floats rounded outward: 178 bytes for 16 leaves. What rounding moves is far
 * below the leaves' deviations, and is added to them where they are used (scan_kernel.h).
 */
#include "model/index.h"

#include <string.h>

const uint8_t shcdi_block_corner[3][SHCDI_BLOCK_LEAVES] = {
    {SHCDI_BLOCK_CORNER_0}, {SHCDI_BLOCK_CORNER_1}, {SHCDI_BLOCK_CORNER_2}};

#define OUTWARD (1.0 + 1e-12)

/* ---- rounding ---- */

static uint16_t half_up(double a) {
    union {
        float f;
        uint32_t u;
    } c = {(float)(a * (1.0 + 0x1p-22))};
    return (uint16_t)((c.u + 0xffffu) >> 16);
}

static uint16_t half_down(double a) {
    union {
        float f;
        uint32_t u;
    } c = {(float)(a * (1.0 - 0x1p-22))};
    return (uint16_t)(c.u >> 16);
}

/* ---- memory ---- */

static shcd_status allocate_pieces(shcdi_index *index, const shcd_allocator *allocator) {
    shcdi_index_table *table = &index->table;
    table->direction =
        allocator->allocate(table->n_vertices * sizeof *table->direction, allocator->user);
    table->node = allocator->allocate(SHCDI_BLOCK_NODES * table->n_blocks * sizeof *table->node,
                                      allocator->user);
    table->sector_block =
        allocator->allocate(table->n_blocks * sizeof *table->sector_block, allocator->user);
    table->source = allocator->allocate(SHCDI_BLOCK_NODES * table->n_blocks * sizeof *table->source,
                                        allocator->user);
    table->sector_vertex = allocator->allocate(
        shcdi_sector_vertex_count(table->n_blocks) * sizeof *table->sector_vertex, allocator->user);
    index->bounds = allocator->allocate(table->n_blocks * sizeof *index->bounds, allocator->user);
    void *memory = allocator->allocate(shcdi_positions_bytes(index), allocator->user);
    if (memory != NULL) {
        index->rest = shcdi_positions_at(index, memory);
    }
    return table->direction != NULL && table->node != NULL && table->sector_block != NULL &&
                   table->source != NULL && table->sector_vertex != NULL && index->bounds != NULL &&
                   memory != NULL
               ? SHCD_OK
               : SHCD_ERR_MEMORY;
}

void shcdi_index_free(shcdi_index *index, const shcd_allocator *allocator) {
    void *pieces[7] = {index->table.direction,     index->table.node,
                       index->table.sector_block,  index->table.source,
                       index->table.sector_vertex, index->bounds,
                       index->rest.block};
    for (int i = 0; i < 7; i++) {
        if (pieces[i] != NULL) {
            allocator->release(pieces[i], allocator->user);
        }
    }
    memset(index, 0, sizeof *index);
}

size_t shcdi_index_table_bytes(const shcdi_index *index) {
    const shcdi_index_table *t = &index->table;
    return t->n_vertices * sizeof *t->direction +
           t->n_blocks * (SHCDI_BLOCK_NODES * (sizeof *t->node + sizeof *t->source) +
                          sizeof *t->sector_block) +
           shcdi_sector_vertex_count(t->n_blocks) * sizeof *t->sector_vertex;
}

size_t shcdi_index_body_bytes(const shcdi_index *index) {
    return shcdi_positions_bytes(index) + index->table.n_blocks * sizeof *index->bounds;
}

/* ---- tables ---- */

static void fill_table(shcdi_index_table *table, const shcdi_tree *tree, int degree) {
    memcpy(table->direction, tree->direction, table->n_vertices * sizeof *table->direction);
    for (size_t i = 0; i < tree->n_leaves; i++) {
        uint16_t *node = table->node + i / SHCDI_BLOCK_LEAVES * SHCDI_BLOCK_NODES;
        for (int k = 0; k < 3; k++) {
            node[shcdi_block_corner[k][i % SHCDI_BLOCK_LEAVES]] = (uint16_t)tree->leaf[i].vertex[k];
        }
    }
    for (size_t b = 0; b < table->n_blocks; b++) {
        table->node[SHCDI_BLOCK_NODES * b + 15] = table->node[SHCDI_BLOCK_NODES * b];
    }
    shcdi_sectors_fill(table, degree);
    table->angle = tree->angle_max;
    /* as a short number: the last bits of the arcsine behind it are the libm's own, and must not
     * show in what a tick does */
    table->reach = (double)shcdi_from_half(half_down(tree->reach));
    for (size_t i = 0; i < tree->n_leaves; i++) {
        const uint32_t *v = tree->leaf[i].vertex;
        const shcd_vec3 a = tree->direction[v[0]], b = tree->direction[v[1]],
                        c = tree->direction[v[2]];
        /* the deviation is linear in the two bounds (tree.c) */
        table->per_first =
            shcdi_max(table->per_first, shcdi_patch_deviation(a, b, c, 1.0, 0.0) * OUTWARD);
        table->per_second =
            shcdi_max(table->per_second, shcdi_patch_deviation(a, b, c, 0.0, 1.0) * OUTWARD);
    }
}

/* ---- bounds ---- */

static void fill_bounds(shcdi_index *index, const shcdi_tree *tree) {
    for (size_t b = 0; b < index->table.n_blocks; b++) {
        shcdi_block_bounds *bounds = &index->bounds[b];
        const shcdi_leaf *leaf = tree->leaf + SHCDI_BLOCK_LEAVES * b;
        bounds->largest = 0;
        for (size_t i = 0; i < SHCDI_BLOCK_LEAVES; i++) {
            bounds->deviation[i] = half_up((double)leaf[i].deviation * index->scale);
            /* positive floats are ordered like their bits */
            bounds->largest =
                bounds->deviation[i] > bounds->largest ? bounds->deviation[i] : bounds->largest;
        }
        for (size_t g = 0; g < 4; g++) {
            double m[4] = {0.0, 0.0, 0.0, 0.0}, sigma = HUGE_VAL;
            for (size_t i = 4 * g; i < 4 * g + 4; i++) {
                m[0] = shcdi_max(m[0], (double)leaf[i].m1);
                m[1] = shcdi_max(m[1], (double)leaf[i].m2);
                m[2] = shcdi_max(m[2], (double)leaf[i].m3);
                m[3] = shcdi_max(m[3], (double)leaf[i].product);
                sigma = shcdi_min(sigma, (double)leaf[i].sigma);
            }
            bounds->m1[g] = half_up(m[0] * index->scale);
            bounds->m2[g] = half_up(m[1] * index->scale);
            bounds->m3[g] = half_up(m[2] * index->scale);
            bounds->product[g] = half_up(m[3] * index->scale * index->scale);
            bounds->sigma[g] = half_down(sigma * index->scale);
        }
    }
}

shcd_status shcdi_index_create(const shcdi_tree *tree, const shcdi_series *series, shcd_vec3 origin,
                               double radius, const shcd_allocator *allocator, shcdi_index *index) {
    shcdi_index made = {.origin = origin, .scale = 1.0};
    made.table.level = tree->level;
    made.table.n_vertices = tree->n_vertices;
    made.table.n_blocks = tree->n_leaves / SHCDI_BLOCK_LEAVES;
    made.n_balls = (made.table.n_blocks + 15) & ~(size_t)15;
    while (radius * made.scale > 1.0) {
        made.scale *= 0.5;
    }
    while (radius * made.scale <= 0.5) {
        made.scale *= 2.0;
    }
    const shcd_status status = allocate_pieces(&made, allocator);
    if (status == SHCD_OK) {
        fill_table(&made.table, tree, series->degree);
        fill_bounds(&made, tree);
        shcdi_positions_fill(&made, series, radius, &made.rest);
        *index = made;
    } else {
        shcdi_index_free(&made, allocator);
    }
    return status;
}
