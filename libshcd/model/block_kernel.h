/* SPDX-License-Identifier: BSD-3-Clause */
/* Blocks from node positions on a lattice: the end of scan_kernel.h, whose types it uses.
 *
 * Places are whole numbers of lattice steps, so that a block's centre and the ways from it to its
 * nodes are exact. The centre is the mean of the corners, rounded to what a float holds. The ways
 * become floats (an error of 2^-24), then multiples q of the block's unit, at least 256 steps and
 * such that |q| <= 32766. In units, a coordinate errs by at most
 *
 *   1/256 (the lattice) + 1/2 (rounding) + 32766 (3 + 1/2) 2^-24 (way, 1/unit, product, sum) <
 * 0.511
 *
 * and a node by sqrt(3) times that, below SHCDI_GRID_ERROR.
 *
 * Radius, thickness and width are measured in floats, each within 2^-20 of the radius of what exact
 * arithmetic gives, and two steps for the lattice. Flat triangles lie within the nodes' convex
 * hull, S within the deviation of them. The normal is used as rounded: it only has to be of unit
 * length at most, and both distances are measured with it. */

#define FILL_GROUP 8
#define VECTORS (SHCDI_BLOCK_NODES / LANES)
#define UNIT_LEAST 256.0f

typedef int16_t vs __attribute__((vector_size(2 * LANES)));

INLINE vf size_of(vf a) {
    const vi rest = {0};
    return (vf)((vi)a & (rest + 0x7fffffff));
}

/* a, with the sign of b */
INLINE vf with_sign(float a, vf b) {
    const vi rest = {0};
    const vf v = {0.0f};
    return (vf)(((vi)(v + a)) | ((vi)b & ~(rest + 0x7fffffff)));
}

/* Plane of the corners, in place of the block's old normal. */
INLINE void fill_normal(shcdi_block *block, int32_t x[3][SHCDI_BLOCK_NODES]) {
    double e[3], f[3], n[3];
    for (int k = 0; k < 3; k++) {
        e[k] = (double)x[k][4] - (double)x[k][14];
        f[k] = (double)x[k][0] - (double)x[k][14];
    }
    n[0] = e[1] * f[2] - e[2] * f[1];
    n[1] = e[2] * f[0] - e[0] * f[2];
    n[2] = e[0] * f[1] - e[1] * f[0];
    const double nn = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    const double per = nn > 0.0 ? (1.0 - 0x1p-22) / sqrt(nn) : 0.0;
    for (int k = 0; k < 3; k++) {
        block->normal[k] = (float)(n[k] * per);
    }
}

INLINE void fill_block(const shcdi_block_fill *f, size_t b, int32_t x[3][SHCDI_BLOCK_NODES]) {
    shcdi_block *block = &f->block[b];
    const vf zero = {0.0f};
    vf d[3][VECTORS], half = zero, far = zero, high = zero, wide = zero;
    fill_normal(block, x);
    const float n[3] = {block->normal[0], block->normal[1], block->normal[2]};
    for (int k = 0; k < 3; k++) {
        const int32_t centre = (x[k][0] + x[k][4] + x[k][14]) / 3 & ~63;
        block->centre[k] = (float)centre * f->step;
        for (int i = 0; i < VECTORS; i++) {
            vi at;
            memcpy(&at, x[k] + i * LANES, sizeof at);
            d[k][i] = __builtin_convertvector(at - centre, vf);
            half = larger(half, size_of(d[k][i]));
        }
    }
    for (int i = 0; i < VECTORS; i++) {
        const vf h = d[0][i] * n[0] + d[1][i] * n[1] + d[2][i] * n[2];
        const vf dd = d[0][i] * d[0][i] + d[1][i] * d[1][i] + d[2][i] * d[2][i];
        high = larger(high, size_of(h));
        far = larger(far, dd);
        wide = larger(wide, dd - h * h);
    }
    const float wanted = most(half) * (float)((1.0 + 0x1p-22) / 32766.0);
    const float unit = wanted > UNIT_LEAST ? wanted : UNIT_LEAST, per_unit = 1.0f / unit;
    block->unit = unit * f->step;
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < VECTORS; i++) {
            const vf q = d[k][i] * per_unit;
            const vs grid =
                __builtin_convertvector(__builtin_convertvector(q + with_sign(0.5f, q), vi), vs);
            memcpy(block->q[k] + i * LANES, &grid, sizeof grid);
        }
    }
    const double step = (double)f->step, deviation = (double)shcdi_from_half(f->bounds[b].largest);
    const double far2 = (double)most(far), radius = sqrt(far2) * (1.0 + 0x1p-20) + 2.0;
    const double width = sqrt((double)most(wide) + 0x1p-20 * far2) + 2.0;
    const double thickness = (double)most(high) + 0x1p-20 * radius + 2.0;
    block->thickness = (float)((thickness * step + deviation) * (1.0 + 0x1p-22));
    block->width = (float)((width * step + deviation) * (1.0 + 0x1p-22));
    for (size_t k = 0; k < 3; k++) {
        f->ball[k * f->n_balls + b] = block->centre[k];
    }
    f->ball[3 * f->n_balls + b] = (float)((radius * step + deviation) * (1.0 + 0x1p-22));
}

void NAMED(shcdi_scan_fill_, SCAN_PATH)(const shcdi_block_fill *f) {
    for (size_t first = 0; first < f->n; first += FILL_GROUP) {
        /* gathered for a few blocks before they are used: single stores cannot be forwarded to a
         * vector's load */
        int32_t x[FILL_GROUP][3][SHCDI_BLOCK_NODES];
        const size_t n = f->n - first < FILL_GROUP ? f->n - first : FILL_GROUP;
        for (size_t t = 0; t < n; t++) {
            const uint16_t *source = f->source + SHCDI_BLOCK_NODES * (first + t);
            for (size_t i = 0; i < SHCDI_BLOCK_NODES; i++) {
                for (size_t k = 0; k < 3; k++) {
                    x[t][k][i] = f->place[k * f->plane + source[i]];
                }
            }
        }
        for (size_t t = 0; t < n; t++) {
            fill_block(f, f->index[first + t], x[t]);
        }
    }
}
