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

static shcd_status allocate_pieces(shcdi_index *index, const shcd_allocator *allocator) {
    shcdi_index_table *table = &index->table;
    table->direction =
        allocator->allocate(table->n_vertices * sizeof *table->direction, allocator->user);
    table->node = allocator->allocate(SHCDI_BLOCK_NODES * table->n_blocks * sizeof *table->node,
                                      allocator->user);
    table->image_block =
        allocator->allocate(table->n_blocks * sizeof *table->image_block, allocator->user);
    table->image_node = allocator->allocate(
        SHCDI_BLOCK_NODES * table->n_blocks * sizeof *table->image_node, allocator->user);
    index->bounds = allocator->allocate(table->n_blocks * sizeof *index->bounds, allocator->user);
    void *memory = allocator->allocate(shcdi_positions_bytes(index), allocator->user);
    if (memory != NULL) {
        index->rest = shcdi_positions_at(index, memory);
    }
    return table->direction != NULL && table->node != NULL && table->image_block != NULL &&
                   table->image_node != NULL && index->bounds != NULL && memory != NULL
               ? SHCD_OK
               : SHCD_ERR_MEMORY;
}

void shcdi_index_free(shcdi_index *index, const shcd_allocator *allocator) {
    void *pieces[6] = {index->table.direction,  index->table.node, index->table.image_block,
                       index->table.image_node, index->bounds,     index->rest.block};
    for (int i = 0; i < 6; i++) {
        if (pieces[i] != NULL) {
            allocator->release(pieces[i], allocator->user);
        }
    }
    memset(index, 0, sizeof *index);
}

size_t shcdi_index_table_bytes(const shcdi_index *index) {
    const shcdi_index_table *t = &index->table;
    return t->n_vertices * sizeof *t->direction +
           t->n_blocks * (SHCDI_BLOCK_NODES * (sizeof *t->node + sizeof *t->image_node) +
                          sizeof *t->image_block);
}

size_t shcdi_index_body_bytes(const shcdi_index *index) {
    return shcdi_positions_bytes(index) + index->table.n_blocks * sizeof *index->bounds;
}

/* ---- tables ---- */

static shcd_vec3 mirrored(shcd_vec3 w, size_t s) {
    return shcd_vec3_make(s & 1 ? -w.x : w.x, s & 2 ? -w.y : w.y, s & 4 ? -w.z : w.z);
}

/* Node of block `j` whose image s is the direction w, or SHCDI_BLOCK_NODES. Midpoints of mirrored
 * edges are mirrored to the last bit, since negation is exact: images are found by comparison. */
static size_t image_in(const shcdi_index_table *table, size_t j, size_t s, shcd_vec3 w) {
    const shcd_vec3 m = mirrored(w, s);
    for (size_t i = 0; i < SHCDI_BLOCK_NODES; i++) {
        const shcd_vec3 o = table->direction[table->node[SHCDI_BLOCK_NODES * j + i]];
        if (o.x == m.x && o.y == m.y && o.z == m.z) {
            return i;
        }
    }
    return SHCDI_BLOCK_NODES;
}

/* Octants follow each other in the order of s (tree.c). Three corners tell which block it is. */
static void fill_images(shcdi_index_table *table) {
    const size_t n = table->n_blocks / 8;
    for (size_t b = 0; b < table->n_blocks; b++) {
        const size_t s = b / n;
        const uint16_t *node = table->node + SHCDI_BLOCK_NODES * b;
        size_t j = 0;
        while (j < n && (image_in(table, j, s, table->direction[node[14]]) == SHCDI_BLOCK_NODES ||
                         image_in(table, j, s, table->direction[node[4]]) == SHCDI_BLOCK_NODES ||
                         image_in(table, j, s, table->direction[node[0]]) == SHCDI_BLOCK_NODES)) {
            j++;
        }
        SHCD_ASSERT(j < n);
        table->image_block[8 * j + s] = (uint16_t)b;
        for (size_t i = 0; i < SHCDI_BLOCK_NODES; i++) {
            table->image_node[SHCDI_BLOCK_NODES * b + i] =
                (uint8_t)image_in(table, j, s, table->direction[node[i]]);
        }
    }
}

static void fill_table(shcdi_index_table *table, const shcdi_tree *tree) {
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
    fill_images(table);
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

/* ---- positions ---- */

/* The plane of the block's three corners, through its centre. Flat triangles lie within the nodes'
 * convex hull, S within the deviation of them. The normal is used as rounded: it only has to be of
 * unit length at most, and both distances are measured with it. */
static void fill_slab(shcdi_block *block, double x[3][SHCDI_BLOCK_NODES], double deviation) {
    double e[3], f[3], n[3], thickness = 0.0, width2 = 0.0;
    for (int k = 0; k < 3; k++) {
        e[k] = x[k][4] - x[k][14];
        f[k] = x[k][0] - x[k][14];
    }
    n[0] = e[1] * f[2] - e[2] * f[1];
    n[1] = e[2] * f[0] - e[0] * f[2];
    n[2] = e[0] * f[1] - e[1] * f[0];
    const double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
    for (int k = 0; k < 3; k++) {
        block->normal[k] = length > 0.0 ? (float)(n[k] / length * (1.0 - 0x1p-22)) : 0.0f;
    }
    for (size_t i = 0; i < SHCDI_BLOCK_NODES; i++) {
        double h = 0.0, d2 = 0.0;
        for (int k = 0; k < 3; k++) {
            const double d = x[k][i] - (double)block->centre[k];
            h += d * (double)block->normal[k];
            d2 += d * d;
        }
        thickness = shcdi_max(thickness, fabs(h));
        width2 = shcdi_max(width2, d2 - h * h);
    }
    block->thickness = (float)((thickness + deviation) * (1.0 + 0x1p-20));
    block->width = (float)((sqrt(shcdi_max(0.0, width2)) + deviation) * (1.0 + 0x1p-20));
}

/* Centre: the middle of the nodes' box, rounded to float; unit: a 32767th of its largest half side.
 */
static void fill_block(const shcdi_index *index, const shcd_vec3 image[SHCDI_BLOCK_NODES], size_t b,
                       shcdi_positions *out) {
    const uint8_t *node = index->table.image_node + SHCDI_BLOCK_NODES * b;
    double x[3][SHCDI_BLOCK_NODES], half = 0.0;
    shcdi_block *block = &out->block[b];
    for (size_t i = 0; i < SHCDI_BLOCK_NODES; i++) {
        const shcd_vec3 p = shcd_scale(index->scale, shcd_sub(image[node[i]], index->origin));
        x[0][i] = p.x;
        x[1][i] = p.y;
        x[2][i] = p.z;
    }
    for (int k = 0; k < 3; k++) {
        double low = x[k][0], high = x[k][0];
        for (size_t i = 1; i < SHCDI_BLOCK_NODES - 1; i++) {
            low = shcdi_min(low, x[k][i]);
            high = shcdi_max(high, x[k][i]);
        }
        block->centre[k] = (float)(0.5 * (low + high));
        half = shcdi_max(
            half, shcdi_max(high - (double)block->centre[k], (double)block->centre[k] - low));
    }
    block->unit = (float)(half * (1.0 / 32766.0));
    const double per_unit = block->unit > 0.0f ? 1.0 / (double)block->unit : 0.0;
    double r2 = 0.0;
    for (size_t i = 0; i < SHCDI_BLOCK_NODES; i++) {
        double d2 = 0.0;
        for (int k = 0; k < 3; k++) {
            const double d = x[k][i] - (double)block->centre[k];
            const double q = d * per_unit;
            block->q[k][i] = (int16_t)(q < 0.0 ? q - 0.5 : q + 0.5);
            d2 += d * d;
        }
        r2 = shcdi_max(r2, d2);
    }
    float deviation = 0.0f;
    for (int i = 0; i < SHCDI_BLOCK_LEAVES; i++) {
        const float d = shcdi_from_half(index->bounds[b].deviation[i]);
        deviation = d > deviation ? d : deviation;
    }
    fill_slab(block, x, (double)deviation);
    const size_t n = index->n_balls;
    for (size_t k = 0; k < 3; k++) {
        out->ball[k * n + b] = block->centre[k];
    }
    out->ball[3 * n + b] = (float)((sqrt(r2) + (double)deviation) * (1.0 + 0x1p-22));
}

void shcdi_positions_fill(const shcdi_index *index, const shcdi_series *series,
                          shcdi_positions *positions) {
    const shcdi_index_table *table = &index->table;
    for (size_t j = 0; j < table->n_blocks / 8; j++) {
        shcd_vec3 w[SHCDI_BLOCK_NODES], image[8][SHCDI_BLOCK_NODES];
        for (size_t i = 0; i < SHCDI_BLOCK_NODES; i++) {
            w[i] = table->direction[table->node[SHCDI_BLOCK_NODES * j + i]];
        }
        shcdi_surface_octants(series, w, SHCDI_BLOCK_NODES, image[0]);
        for (size_t s = 0; s < 8; s++) {
            fill_block(index, image[s], table->image_block[8 * j + s], positions);
        }
    }
    for (size_t b = table->n_blocks; b < index->n_balls; b++) {
        for (size_t k = 0; k < 3; k++) {
            positions->ball[k * index->n_balls + b] = 0.0f;
        }
        positions->ball[3 * index->n_balls + b] = -HUGE_VALF;
    }
}

/* ---- bounds ---- */

static void fill_bounds(shcdi_index *index, const shcdi_tree *tree) {
    for (size_t b = 0; b < index->table.n_blocks; b++) {
        shcdi_block_bounds *bounds = &index->bounds[b];
        const shcdi_leaf *leaf = tree->leaf + SHCDI_BLOCK_LEAVES * b;
        for (size_t i = 0; i < SHCDI_BLOCK_LEAVES; i++) {
            bounds->deviation[i] = half_up((double)leaf[i].deviation * index->scale);
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
        fill_table(&made.table, tree);
        fill_bounds(&made, tree);
        shcdi_positions_fill(&made, series, &made.rest);
        *index = made;
    } else {
        shcdi_index_free(&made, allocator);
    }
    return status;
}
