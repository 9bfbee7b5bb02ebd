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

int shcdi_winding(const shcdi_tree *tree, shcd_vec3 p) {
    turning t = {1.0, 0.0, 0};
    for (size_t i = 0; i < tree->n_leaves; i++) {
        const uint32_t *v = tree->leaf[i].vertex;
        const shcd_vec3 a = shcd_sub(tree->position[v[0]], p);
        const shcd_vec3 b = shcd_sub(tree->position[v[1]], p);
        const shcd_vec3 c = shcd_sub(tree->position[v[2]], p);
        const double la = shcd_norm(a), lb = shcd_norm(b), lc = shcd_norm(c);
        const double re =
            la * lb * lc + shcd_dot(a, b) * lc + shcd_dot(b, c) * la + shcd_dot(c, a) * lb;
        const double im = shcd_dot(a, shcd_cross(b, c));
        const double n = sqrt(re * re + im * im);
        if (!(n > 0.0)) {
            continue;
        }
        /* sqrt of the unit number: ((1 + re)/2)^(1/2), sign of im */
        const double half_re = sqrt(shcdi_max(0.0, 0.5 * (1.0 + re / n)));
        const double size = sqrt(shcdi_max(0.0, 0.5 * (1.0 - re / n)));
        const double half_im = im < 0.0 ? -size : size;
        turn(&t, half_re, half_im);
        turn(&t, half_re, half_im);
    }
    return t.turns;
}
