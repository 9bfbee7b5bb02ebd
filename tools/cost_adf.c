/* SPDX-License-Identifier: BSD-3-Clause */
/* Built from the root down, level by level: the array of nodes is its own queue. The points at
 * which a cell is tested are the corners of its children, and neighbours share theirs; so every
 * sample is kept in a hash table under its place in the finest lattice (two steps to the side of
 * the finest cell). Cells that no query can reach, farther from the surface than the band, are not
 * split: what they would cost is not held against the method. */
#include "cost_adf.h"

#include "cost_clock.h"

#include "shcd/vec.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Lattice steps along the side of the root. */
#define LATTICE (2u << COST_ADF_DEPTH)
#define NO_KEY UINT32_MAX

typedef struct sample {
    uint32_t key; /**< x + y (LATTICE + 1) + z (LATTICE + 1)^2 < 2^31, or NO_KEY */
    float distance_m;
} sample;

typedef struct cell {
    uint16_t at[3]; /**< lowest corner in the lattice */
    uint16_t side;  /**< in lattice steps */
} cell;

typedef struct builder {
    const cost_source *source;
    double tolerance_m;
    cost_adf *adf;
    cell *cells; /**< of the nodes */
    size_t node_capacity, leaf_capacity;
    sample *table;
    size_t n_samples, table_size; /**< the size is a power of two */
} builder;

static size_t slot_of(const sample *table, size_t size, uint32_t key) {
    size_t slot = (key * 2654435769u) & (size - 1); /* Fibonacci hashing; then the next free one */
    while (table[slot].key != key && table[slot].key != NO_KEY) {
        slot = (slot + 1) & (size - 1);
    }
    return slot;
}

static bool grow_table(builder *b) {
    const size_t size = b->table_size > 0 ? 2 * b->table_size : 1u << 16;
    sample *table = malloc(size * sizeof *table);
    if (table == NULL) {
        return false;
    }
    memset(table, 0xff, size * sizeof *table);
    for (size_t i = 0; i < b->table_size; i++) {
        if (b->table[i].key != NO_KEY) {
            table[slot_of(table, size, b->table[i].key)] = b->table[i];
        }
    }
    free(b->table);
    b->table = table;
    b->table_size = size;
    return true;
}

/* Distance at a lattice point of a cell with this side; the caller has seen to room in the table.
 * It is kept for the cells that come later, which are no larger and so reach no farther. */
static float sample_at(builder *b, uint32_t x, uint32_t y, uint32_t z) {
    const uint32_t key = x + (LATTICE + 1) * (y + (LATTICE + 1) * z);
    sample *entry = &b->table[slot_of(b->table, b->table_size, key)];
    if (entry->key == NO_KEY) {
        const double step = b->adf->side_m / LATTICE;
        const shcd_vec3 offset = shcd_vec3_make((double)x, (double)y, (double)z);
        entry->key = key;
        entry->distance_m =
            (float)cost_source_ask(b->source, shcd_mul_add(b->adf->origin, step, offset));
        b->n_samples++;
    }
    return entry->distance_m;
}

/* Sample i, j, k half sides from the lowest corner. */
static float sample_in(builder *b, const cell *c, unsigned i, unsigned j, unsigned k) {
    const unsigned half = c->side / 2u;
    return sample_at(b, c->at[0] + i * half, c->at[1] + j * half, c->at[2] + k * half);
}

static bool must_split(builder *b, const cell *c, const float corner[8]) {
    const double half_m = 0.5 * b->adf->side_m * c->side / LATTICE;
    if (c->side <= 2 ||
        fabs((double)sample_in(b, c, 1, 1, 1)) > b->source->band_m + sqrt(3.0) * half_m) {
        return false;
    }
    for (unsigned t = 0; t < 27; t++) {
        const unsigned i = t % 3, j = t / 3 % 3, k = t / 9;
        if (i != 1 && j != 1 && k != 1) {
            continue; /* a corner: exact */
        }
        const double at[3] = {0.5 * i, 0.5 * j, 0.5 * k};
        double gradient[3];
        const double error =
            cost_trilinear(corner, at, gradient) - (double)sample_in(b, c, i, j, k);
        if (fabs(error) > b->tolerance_m) {
            return true;
        }
    }
    return false;
}

static bool reserve(builder *b) {
    cost_adf *adf = b->adf;
    if (adf->n_nodes + 8 > b->node_capacity) {
        const size_t capacity = 2 * b->node_capacity + 1024;
        int32_t *node = realloc(adf->node, capacity * sizeof *node);
        adf->node = node != NULL ? node : adf->node;
        cell *cells = realloc(b->cells, capacity * sizeof *cells);
        b->cells = cells != NULL ? cells : b->cells;
        if (node == NULL || cells == NULL) {
            return false;
        }
        b->node_capacity = capacity;
    }
    if (adf->n_leaves + 1 > b->leaf_capacity) {
        const size_t capacity = 2 * b->leaf_capacity + 1024;
        float(*leaf)[8] = realloc(adf->leaf, capacity * sizeof *leaf);
        if (leaf == NULL) {
            return false;
        }
        adf->leaf = leaf;
        b->leaf_capacity = capacity;
    }
    /* a cell looks at 27 samples; at most half of the table is filled */
    return 2 * (b->n_samples + 27) < b->table_size || grow_table(b);
}

static void visit(builder *b, size_t n) {
    cost_adf *adf = b->adf;
    const cell c = b->cells[n];
    float corner[8];
    for (unsigned i = 0; i < 8; i++) {
        corner[i] = sample_in(b, &c, 2 * (i & 1), 2 * (i >> 1 & 1), 2 * (i >> 2));
    }
    if (!must_split(b, &c, corner)) {
        memcpy(adf->leaf[adf->n_leaves], corner, sizeof corner);
        adf->node[n] = ~(int32_t)adf->n_leaves++;
        return;
    }
    adf->node[n] = (int32_t)adf->n_nodes;
    const uint16_t half = c.side / 2;
    for (unsigned i = 0; i < 8; i++) {
        cell *child = &b->cells[adf->n_nodes++];
        child->side = half;
        child->at[0] = (uint16_t)(c.at[0] + half * (i & 1));
        child->at[1] = (uint16_t)(c.at[1] + half * (i >> 1 & 1));
        child->at[2] = (uint16_t)(c.at[2] + half * (i >> 2));
    }
}

static enum cost_build build(builder *b) {
    if (!reserve(b)) {
        return COST_NO_MEMORY;
    }
    b->adf->n_nodes = 1;
    b->cells[0] = (cell){{0, 0, 0}, LATTICE};
    for (size_t n = 0; n < b->adf->n_nodes; n++) {
        if (!reserve(b)) {
            return COST_NO_MEMORY;
        }
        visit(b, n);
        if (n % 64 == 0) {
            if (cost_spent_s() > b->source->deadline_s) {
                return COST_TOO_LONG;
            }
            b->source->progress((double)n / (double)b->adf->n_nodes, b->source->user);
        }
    }
    return COST_BUILT;
}

enum cost_build cost_adf_build(const cost_source *source, double tolerance_m, cost_adf *adf) {
    const shcd_vec3 side = shcd_sub(source->high, source->low);
    memset(adf, 0, sizeof *adf);
    adf->origin = source->low;
    adf->side_m = fmax(side.x, fmax(side.y, side.z));
    builder b = {.source = source, .tolerance_m = tolerance_m, .adf = adf};
    const enum cost_build result = build(&b);
    free(b.cells);
    free(b.table);
    if (result != COST_BUILT) {
        cost_adf_free(adf);
    }
    return result;
}

void cost_adf_free(cost_adf *adf) {
    free(adf->node);
    free(adf->leaf);
    adf->node = NULL;
    adf->leaf = NULL;
}

size_t cost_adf_bytes(const cost_adf *adf) {
    return sizeof *adf + adf->n_nodes * sizeof *adf->node + adf->n_leaves * sizeof *adf->leaf;
}

void cost_adf_query(const cost_adf *adf, shcd_vec3 point, double *distance_m, shcd_vec3 *gradient) {
    const shcd_vec3 v = shcd_scale(1.0 / adf->side_m, shcd_sub(point, adf->origin));
    const double u[3] = {v.x, v.y, v.z};
    const double n_finest = (double)(1u << COST_ADF_DEPTH);
    uint32_t at[3];
    for (int a = 0; a < 3; a++) {
        const double clamped = u[a] > 0.0 ? (u[a] < 1.0 ? u[a] : 1.0 - 0x1p-53) : 0.0;
        at[a] = (uint32_t)(clamped * n_finest);
    }
    /* the bits of the place in the finest cells, highest first, name the children on the way */
    int32_t node = adf->node[0];
    int level = 0;
    while (node >= 0) {
        const int bit = COST_ADF_DEPTH - ++level;
        const uint32_t child =
            (at[0] >> bit & 1u) | (at[1] >> bit & 1u) << 1 | (at[2] >> bit & 1u) << 2;
        node = adf->node[(uint32_t)node + child];
    }
    const double cells = (double)(1u << level);
    double inside[3], slope[3];
    for (int a = 0; a < 3; a++) {
        inside[a] = u[a] * cells - (double)(at[a] >> (COST_ADF_DEPTH - level));
    }
    *distance_m = cost_trilinear(adf->leaf[~node], inside, slope);
    *gradient = shcd_scale(cells / adf->side_m, shcd_vec3_make(slope[0], slope[1], slope[2]));
}
