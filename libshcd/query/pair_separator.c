/* SPDX-License-Identifier: BSD-3-Clause */
/* A sphere between two surfaces.
 *
 * Pairs of patches are a four-dimensional search, and where the bodies are near each other the
 * squared distance of pairs is almost flat along the two directions in which both points slide
 * together: its convexity ends nothing. A sphere splits the search in two of two dimensions. For
 * any centre z
 *
 *   |S_a - S_b| >= |S_b - z| - |S_a - z|,                                                 (1)
 *
 * with equality at the closest pair (a, b) if z lies on the line through a and b behind a. If a is
 * the farthest point of A from z and b the nearest of B, (1) proves the distance for all pairs at
 * once, without regard to how near the bodies are.
 *
 * With n = (b - a)/d, z = a - n/c (c the sphere's curvature; c < 0 puts z behind b and swaps the
 * roles), the Hessians at a and b of |S - z|^2/2 are G_a + n.S_a''/c and G_b + (1/c + d) n.S_b'', G
 * the metric. The first is negative if c is below the least curvature k_a of A towards n, the
 * second positive if c > -k_b/(1 + d k_b), k_b the least of B towards -n. Between these two c is
 * free; where they leave nothing (two saddles crossed), there is no separator.
 *
 * Cap about the foot w0, with gradient g and Hessian at most -k there: along a great circle, f =
 * |S - z|^2/2 satisfies f(s) <= f(0) + |g| s - k s^2/2 + F3 s^3/6 with |f'''| <= F3 = 3 P + (|S(w0)
 * - z| + M1 s) M3, P >= |S'.S''|, so f <= f(0) + |g| s - k s^2/6 <= f(0) + 3 g^2/(2 k) for s <= 2
 * k/F3; the outer body with both signs turned. Outside the cap a patch has its own bounds: |x - z|
 * is convex, so over a triangle it is largest at a corner; and Taylor's formula about the patch's
 * centre, with the remainder F3 s^3/6, which near the cap's border needs far fewer patches.
 */
#include "query/pair.h"

#define LEVELS_MAX 12
#define REFINE_EVALUATIONS_MAX 600u
/* curvature of the flattest sphere, over the larger diagonal: beyond it rounding of |x - z| grows
 * and nothing is gained */
#define FLATTEST 1e-2

/* Eigenvalues of the symmetric 2 x 2 matrix n.S'' with respect to the metric S'.S'; 0 if the
 * surface is singular here. */
static int curvatures(const shcdi_jet *j, shcd_vec3 n, double *low, double *high) {
    const double g11 = shcd_dot(j->s1, j->s1), g12 = shcd_dot(j->s1, j->s2);
    const double g22 = shcd_dot(j->s2, j->s2);
    const double a = shcd_dot(n, j->s11), b = shcd_dot(n, j->s12), c = shcd_dot(n, j->s22);
    const double det = g11 * g22 - g12 * g12;
    if (!(det > 1e-14 * g11 * g22)) {
        return 0;
    }
    const double mean = 0.5 * (a * g22 + c * g11 - 2.0 * b * g12) / det;
    const double product = (a * c - b * b) / det;
    const double root = sqrt(shcdi_max(0.0, mean * mean - product));
    *low = mean - root;
    *high = mean + root;
    return 1;
}

/* Curvature of the separating sphere, > 0 with body 0 inside; 0: there is none. */
static double choose_curvature(const shcdi_pair_search *s, shcd_vec3 n) {
    const double flattest =
        FLATTEST / shcdi_max(s->body[0].view.diagonal_m, s->body[1].view.diagonal_m);
    double low, high, unused;
    if (!curvatures(&s->best[0].jet, n, &unused, &high) ||
        !curvatures(&s->best[1].jet, n, &low, &unused)) {
        return 0.0;
    }
    const double most = -high, below = 1.0 + s->upper * low;
    const double least = below > 0.0 ? -low / below : HUGE_VAL;
    if (!(least < most)) {
        return 0.0;
    }
    const double middle = 0.5 * (least + most);
    if (fabs(middle) >= flattest) {
        return middle;
    }
    return flattest < most ? flattest : -flattest > least ? -flattest : 0.0;
}

/* f = |S - z|^2/2 at a point: gradient, and the extreme eigenvalues of its Hessian with the
 * direction of the larger. */
typedef struct field {
    double f, distance;
    double g1, g2;
    double low, high, e1, e2;
} field;

static field field_at(const shcdi_jet *j, shcd_vec3 z) {
    field at;
    const shcd_vec3 r = shcd_sub(j->s, z);
    const double h11 = shcd_dot(j->s1, j->s1) + shcd_dot(r, j->s11);
    const double h12 = shcd_dot(j->s1, j->s2) + shcd_dot(r, j->s12);
    const double h22 = shcd_dot(j->s2, j->s2) + shcd_dot(r, j->s22);
    const double mean = 0.5 * (h11 + h22), half = 0.5 * (h11 - h22);
    const double root = sqrt(half * half + h12 * h12);
    const double a = half >= 0.0 ? half + root : h12, b = half >= 0.0 ? h12 : root - half;
    const double n = sqrt(a * a + b * b);
    at.f = 0.5 * shcd_dot(r, r);
    at.distance = shcd_norm(r);
    at.g1 = shcd_dot(j->s1, r);
    at.g2 = shcd_dot(j->s2, r);
    at.low = mean - root;
    at.high = mean + root;
    at.e1 = n > 0.0 ? a / n : 1.0;
    at.e2 = n > 0.0 ? b / n : 0.0;
    return at;
}

/* Bound of |f'''| within an angle of where f was taken; m1..m3 hold there. */
static double third_of(const shcdi_view_leaf *leaf, double distance, double angle) {
    return 3.0 * leaf->product + (distance + leaf->m1 * angle) * leaf->m3;
}

/* Rounding of a second derivative of f: 1e-13 of the sizes of its terms. */
static double noise_of(const shcdi_view_leaf *leaf, double distance) {
    return 1e-13 * (leaf->m1 * leaf->m1 + distance * leaf->m2);
}

/* min over |t| <= radius of g t + h t^2/2 */
static double parabola_least(double g, double h, double radius) {
    const double a = fabs(g);
    if (h > 0.0 && a < h * radius) {
        return -a * a / (2.0 * h);
    }
    return -a * radius + 0.5 * h * radius * radius;
}

/* Distance from z over a cap of an angle about a point: sign +1 the largest, -1 the least. The disc
 * of Taylor's formula lies in the square of the Hessian's eigenvectors, where the form separates.
 */
static double taylor(const field *at, const shcdi_view_leaf *leaf, double angle, double sign) {
    const double gh = at->g1 * at->e1 + at->g2 * at->e2, gl = at->g2 * at->e1 - at->g1 * at->e2;
    const double noise = noise_of(leaf, at->distance) * angle * angle;
    const double least = parabola_least(gh, -sign * at->high, angle) +
                         parabola_least(gl, -sign * at->low, angle) - noise -
                         third_of(leaf, at->distance, angle) * angle * angle * angle / 6.0;
    return sqrt(shcdi_max(0.0, 2.0 * (at->f - sign * least)));
}

/* sign +1: the largest |S - z| over a cap about the end, -1: the least. */
static void make_cap(shcdi_pair_search *s, int which, double sign) {
    shcdi_separator *separator = &s->separator;
    const shcdi_pair_end *end = &s->best[which];
    shcdi_view_leaf leaf;
    shcdi_view_leaf_at(&s->body[which].view, shcdi_view_leaf_of(&s->body[which].view, end->w),
                       &leaf);
    const field at = field_at(&end->jet, separator->centre);
    const double gg = at.g1 * at.g1 + at.g2 * at.g2;
    const double k = (sign > 0.0 ? -at.high : at.low) - noise_of(&leaf, at.distance);
    const double room = leaf.reach - shcdi_angle_upper(shcd_norm(shcd_sub(leaf.centre, end->w)));
    separator->cap[which].w = end->w;
    separator->cap[which].chord2 = -1.0;
    if (!(k > 0.0) || !(room > 0.0)) {
        return;
    }
    const double third = third_of(&leaf, at.distance, room);
    const double angle = third > 0.0 ? shcdi_min(room, 2.0 * k / third) : room;
    const double chord = angle * (1.0 - angle * angle / 24.0) * (1.0 - 1e-14);
    separator->cap[which].chord2 = chord * chord;
    separator->cap[which].bound = sqrt(shcdi_max(0.0, 2.0 * at.f + sign * 3.0 * gg / k));
}

void shcdi_separator_make(shcdi_pair_search *s) {
    shcdi_separator *separator = &s->separator;
    const shcd_vec3 a = s->best[0].jet.s, b = s->best[1].jet.s;
    const shcd_vec3 n = shcd_unit(shcd_sub(b, a));
    const double c = s->upper > 0.0 ? choose_curvature(s, n) : 0.0;
    separator->exists = c != 0.0;
    if (c == 0.0) {
        return;
    }
    separator->inner = c > 0.0 ? 0 : 1;
    separator->centre = shcd_mul_add(a, -1.0 / c, n);
    for (int which = 0; which < 2; which++) {
        const double sign = which == separator->inner ? 1.0 : -1.0;
        separator->radius[which] = shcd_norm(shcd_sub(s->best[which].jet.s, separator->centre));
        separator->goal[which] = separator->radius[which] + sign * 0.25 * s->tolerance;
        make_cap(s, which, sign);
    }
}

static int is_in_cap(const shcdi_separator *separator, int which, const shcd_vec3 w[3]) {
    return shcdi_patch_in_cap(w, separator->cap[which].w, separator->cap[which].chord2);
}

double shcdi_separator_bound(const shcdi_separator *separator, int which, const shcdi_image *patch,
                             double deviation) {
    if (is_in_cap(separator, which, patch->w)) {
        return separator->cap[which].bound;
    }
    if (which != separator->inner) {
        double b[3];
        return shcdi_triangle_distance(separator->centre, patch->x, b) - deviation;
    }
    double far2 = 0.0;
    for (int i = 0; i < 3; i++) {
        const shcd_vec3 d = shcd_sub(patch->x[i], separator->centre);
        far2 = shcdi_max(far2, shcd_dot(d, d));
    }
    return sqrt(far2) + deviation;
}

/* Whether a corner is beyond what any refinement of its patch could prove. */
static int pokes_through(const shcdi_separator *separator, int which, const shcdi_image *patch) {
    for (int i = 0; i < 3; i++) {
        const double r = shcd_norm(shcd_sub(patch->x[i], separator->centre));
        if (which == separator->inner ? r > separator->goal[which] : r < separator->goal[which]) {
            return 1;
        }
    }
    return 0;
}

/* Taylor's bound of a patch. */
static double centre_bound(shcdi_pair_search *s, int which, const shcdi_view_leaf *leaf,
                           const shcdi_image *patch) {
    shcdi_pair_end end;
    double angle;
    shcdi_pair_end_at(s, which, shcdi_cap_of(patch->w, &angle), &end);
    const field at = field_at(&end.jet, s->separator.centre);
    return taylor(&at, leaf, angle, which == s->separator.inner ? 1.0 : -1.0);
}

/* 1 if the patch reaches the goal, with its bound. */
static int reaches(shcdi_pair_search *s, int which, const shcdi_view_leaf *leaf,
                   const shcdi_pair_patch *patch, int level, double *bound) {
    const shcdi_separator *separator = &s->separator;
    const double sign = which == separator->inner ? 1.0 : -1.0;
    s->n_patches++;
    *bound = shcdi_separator_bound(separator, which, &patch->patch, patch->deviation);
    if (sign * (*bound - separator->goal[which]) <= 0.0 ||
        is_in_cap(separator, which, patch->patch.w)) {
        return 1;
    }
    /* not of a whole leaf: its third derivatives are too far apart */
    if (level == 0 || pokes_through(separator, which, &patch->patch)) {
        return 0;
    }
    *bound = centre_bound(s, which, leaf, &patch->patch);
    return sign * (*bound - separator->goal[which]) <= 0.0;
}

double shcdi_separator_refine(shcdi_pair_search *s, int which, size_t leaf, double unrefined) {
    const int is_inner = which == s->separator.inner;
    shcdi_view_leaf table;
    struct {
        shcdi_pair_patch patch;
        int level;
    } stack[3 * LEVELS_MAX + 4];
    shcdi_view_leaf_at(&s->body[which].view, leaf, &table);
    shcdi_pair_leaf(s, which, &table, &stack[0].patch);
    stack[0].level = 0;
    const uint32_t end = s->n_evaluations + REFINE_EVALUATIONS_MAX;
    double worst = s->separator.radius[which], bound;
    for (size_t n = 1; n > 0;) {
        const shcdi_pair_patch top = stack[--n].patch;
        const int level = stack[n].level;
        if (reaches(s, which, &table, &top, level, &bound)) {
            worst = is_inner ? shcdi_max(worst, bound) : shcdi_min(worst, bound);
            continue;
        }
        if (pokes_through(&s->separator, which, &top.patch) || level == LEVELS_MAX ||
            s->n_evaluations >= end || shcdi_pair_exhausted(s)) {
            return unrefined;
        }
        shcdi_pair_patch child[4];
        shcdi_pair_split(s, which, &top, child);
        for (int k = 0; k < 4; k++) {
            stack[n].patch = child[k];
            stack[n++].level = level + 1;
        }
    }
    return worst;
}
