/* SPDX-License-Identifier: BSD-3-Clause */
/* Winding number without an arctangent, so that it can run in a tick.
 *
 * Half the solid angle of a triangle has the direction of the complex number
 * z = |a||b||c| + (a.b)|c| + (b.c)|a| + (c.a)|b| + i a.(b x c) (Van Oosterom and Strackee, IEEE
 * Trans. Biomed. Eng. 30, 1983). The product of the unit numbers z over all triangles turns by half
 * the total solid angle, 2 pi for each turn of the surface around p; turns are counted where the
 * product crosses the negative real axis. Each factor is applied as its square root, twice, so that
 * a step turns by at most a quarter and no crossing can be missed.
 */
#include "query/winding.h"

typedef struct turning {
    double re, im;
    int turns;
} turning;

static void turn(turning *t, double re, double im) {
    const double next_re = t->re * re - t->im * im;
    const double next_im = t->re * im + t->im * re;
    if (t->re < 0.0 || next_re < 0.0) {
        /* a step of at most a quarter that changes sides of the real axis near its negative half */
        if (t->im >= 0.0 && next_im < 0.0 && im > 0.0) {
            t->turns++;
        } else if (t->im < 0.0 && next_im >= 0.0 && im < 0.0) {
            t->turns--;
        }
    }
    const double n = sqrt(next_re * next_re + next_im * next_im);
    t->re = next_re / n;
    t->im = next_im / n;
}

/* One triangle, seen from p. */
static void turn_by(turning *t, shcd_vec3 a, shcd_vec3 b, shcd_vec3 c) {
    const double la = shcd_norm(a), lb = shcd_norm(b), lc = shcd_norm(c);
    const double re =
        la * lb * lc + shcd_dot(a, b) * lc + shcd_dot(b, c) * la + shcd_dot(c, a) * lb;
    const double im = shcd_dot(a, shcd_cross(b, c));
    const double n = sqrt(re * re + im * im);
    if (!(n > 0.0)) {
        return;
    }
    /* sqrt of the unit number: ((1 + re)/2)^(1/2), sign of im */
    const double half_re = sqrt(shcdi_max(0.0, 0.5 * (1.0 + re / n)));
    const double size = sqrt(shcdi_max(0.0, 0.5 * (1.0 - re / n)));
    const double half_im = im < 0.0 ? -size : size;
    turn(t, half_re, half_im);
    turn(t, half_re, half_im);
}

int shcdi_winding(const shcdi_view *view, shcd_vec3 p) {
    turning t = {1.0, 0.0, 0};
    const shcdi_index *index = view->index;
    const shcd_vec3 at = shcd_scale(index->scale, shcd_sub(p, index->origin));
    for (size_t b = 0; b < index->table.n_blocks; b++) {
        const shcdi_block *block = &view->positions.block[b];
        const double unit = (double)block->unit;
        const shcd_vec3 from = {(double)block->centre[0] - at.x, (double)block->centre[1] - at.y,
                                (double)block->centre[2] - at.z};
        shcd_vec3 x[SHCDI_BLOCK_NODES];
        for (size_t i = 0; i < SHCDI_BLOCK_NODES; i++) {
            x[i] = shcd_vec3_make(from.x + unit * (double)block->q[0][i],
                                  from.y + unit * (double)block->q[1][i],
                                  from.z + unit * (double)block->q[2][i]);
        }
        for (size_t i = 0; i < SHCDI_BLOCK_LEAVES; i++) {
            turn_by(&t, x[shcdi_block_corner[0][i]], x[shcdi_block_corner[1][i]],
                    x[shcdi_block_corner[2][i]]);
        }
    }
    return t.turns;
}

double shcdi_tessellation_error(const shcdi_view *view) {
    /* a block's unit is a 32766th of half its size, which is at most the ball's radius; blocks may
     * part by two grid errors along a common edge, and close again by as much on either side */
    return view->model->info.max_deviation_m + view->deviation_growth_m +
           4.0 * (double)SHCDI_GRID_ERROR / 32766.0 * 1.01 * view->radius_m;
}
