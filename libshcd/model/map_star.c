/* SPDX-License-Identifier: BSD-3-Clause */
/* Proof that every ray from a centre C meets the surface exactly once.
 *
 * With x = S - C and N = S_1 x S_2 (derivatives along a tangent frame; its length and direction do
 * not depend on the frame) let h = x . N. If h > 0 at every w, then x is never zero and the
 * projection w -> x/|x| of the parameter sphere to the sphere of directions is a local
 * diffeomorphism everywhere; a local diffeomorphism of a compact surface onto the sphere is a
 * covering, and the sphere, being simply connected, has only one-to-one ones.
 *
 * Over a patch within angle a of c, along a great circle through c with a parallel frame: |N'| <= 2
 * M1 M2, and h' = S'.N + x.N' = x.N' since S' lies in the span of S_1 and S_2. So with |x| <= X =
 * |x(c)| + M1 a
 *
 *   (S - C).n = h/|N| >= (h(c) - 2 X M1 M2 a)/(|N(c)| + 2 M1 M2 a)   where the numerator is
 * positive.
 *
 * M1, M2 are the leaf's, or what follows from the derivatives at c. A patch that does not pass is
 * split in four.
 */
#include "model/model.h"

#define SPLIT_LEVELS_MAX 8
#define PATCHES_MAX 100000 /* and 4 a leaf; a disc of aspect 500 would take millions */
/* a bound this near the value at the patch's centre is not worth splitting for */
#define TIGHT 0.7

typedef struct star_patch {
    shcd_vec3 w[3];
    int level;
} star_patch;

/* Largest eigenvalue of the Gram matrix gives |S'|. */
static double first_norm(const shcdi_jet *jet) {
    const double a = shcd_dot(jet->s1, jet->s1), b = shcd_dot(jet->s1, jet->s2);
    const double c = shcd_dot(jet->s2, jet->s2);
    const double half = 0.5 * (a - c);
    return sqrt(0.5 * (a + c) + sqrt(half * half + b * b));
}

/* Lower bound of (S - C).n over a patch, or a value <= 0; *at_centre gets its value at the centre.
 */
static double patch_margin(const shcd_model *model, shcd_vec3 origin, const shcdi_leaf *leaf,
                           const star_patch *p, double *at_centre) {
    const shcd_vec3 c = shcd_unit(shcd_add(p->w[0], shcd_add(p->w[1], p->w[2])));
    double chord = 0.0;
    for (int i = 0; i < 3; i++) {
        chord = shcdi_max(chord, shcd_norm(shcd_sub(p->w[i], c)));
    }
    const double a = 2.0 * asin(shcdi_min(1.0, 0.5 * chord)) * (1.0 + 1e-12);
    shcdi_jet jet;
    shcdi_surface_jet(&model->series, model->degree, c, &jet);
    const shcd_vec3 x = shcd_sub(jet.s, origin), normal = shcd_cross(jet.s1, jet.s2);
    const double m2 = (double)leaf->m2;
    const double m1 = shcdi_min((double)leaf->m1, first_norm(&jet) + m2 * a);
    const double h = shcd_dot(x, normal), length = shcd_norm(normal);
    const double turn = 2.0 * m1 * m2 * a;
    /* rounding: derivatives err by far less than 1e-9 of their bounds */
    const double far = shcd_norm(x) + m1 * a;
    const double low = h - far * turn - (1e-9 * far + model->evaluation_error_m) * m1 * m1;
    *at_centre = length > 0.0 ? h / length : 0.0;
    return low / ((length + turn) * (1.0 + 1e-9));
}

double shcdi_star_margin(const shcd_model *model, shcd_vec3 centre) {
    const shcdi_tree *tree = &model->tree;
    double least = HUGE_VAL;
    size_t n_left = PATCHES_MAX + 4 * tree->n_leaves;
    for (size_t i = 0; i < tree->n_leaves; i++) {
        star_patch stack[3 * SPLIT_LEVELS_MAX + 1];
        for (int k = 0; k < 3; k++) {
            stack[0].w[k] = tree->direction[tree->leaf[i].vertex[k]];
        }
        stack[0].level = 0;
        size_t n = 1;
        while (n > 0) {
            const star_patch top = stack[--n];
            double value;
            const double low = patch_margin(model, centre, &tree->leaf[i], &top, &value);
            if (!(value > 0.0) || (top.level == SPLIT_LEVELS_MAX && !(low > 0.0)) ||
                n_left-- == 0) {
                return 0.0;
            }
            if (low >= TIGHT * value || (low > 0.0 && low >= least) ||
                top.level == SPLIT_LEVELS_MAX) {
                least = shcdi_min(least, low);
                continue;
            }
            shcd_vec3 mid[3];
            for (int k = 0; k < 3; k++) {
                mid[k] = shcd_unit(shcd_add(top.w[k], top.w[(k + 1) % 3]));
            }
            for (int k = 0; k < 3; k++) {
                stack[n++] = (star_patch){{top.w[k], mid[k], mid[(k + 2) % 3]}, top.level + 1};
            }
            stack[n++] = (star_patch){{mid[0], mid[1], mid[2]}, top.level + 1};
        }
    }
    return least;
}
