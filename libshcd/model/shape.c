/* SPDX-License-Identifier: BSD-3-Clause */
/* Box, volume, area, enclosing ball and kernel of a body, from its leaf tessellation. */
#include "model/model.h"

#define SPREAD_VERTICES 1026 /* of a tree of level 4 */

static void measure_box(shcd_model *model) {
    const shcdi_tree *tree = &model->tree;
    shcd_vec3 lo = tree->position[0], hi = lo;
    for (size_t i = 1; i < tree->n_vertices; i++) {
        const shcd_vec3 p = tree->position[i];
        lo = shcd_vec3_make(shcdi_min(lo.x, p.x), shcdi_min(lo.y, p.y), shcdi_min(lo.z, p.z));
        hi = shcd_vec3_make(shcdi_max(hi.x, p.x), shcdi_max(hi.y, p.y), shcdi_max(hi.z, p.z));
    }
    model->info.box_min_m = lo;
    model->info.box_max_m = hi;
    model->info.diagonal_m = shcd_norm(shcd_sub(hi, lo));
}

/* Volume and its centroid (kept in star_centre_m until the kernel is known), relative to the box
 * centre so that a body far from the origin loses nothing. */
static void measure_volume(shcd_model *model) {
    const shcdi_tree *tree = &model->tree;
    const shcd_vec3 o = shcd_scale(0.5, shcd_add(model->info.box_min_m, model->info.box_max_m));
    double volume = 0.0, area = 0.0;
    shcd_vec3 moment = {0.0, 0.0, 0.0};
    for (size_t i = 0; i < tree->n_leaves; i++) {
        const uint32_t *v = tree->leaf[i].vertex;
        const shcd_vec3 a = shcd_sub(tree->position[v[0]], o);
        const shcd_vec3 b = shcd_sub(tree->position[v[1]], o);
        const shcd_vec3 c = shcd_sub(tree->position[v[2]], o);
        const double dv = shcd_dot(a, shcd_cross(b, c)) / 6.0;
        volume += dv;
        area += 0.5 * shcd_norm(shcd_cross(shcd_sub(b, a), shcd_sub(c, a)));
        moment = shcd_mul_add(moment, 0.25 * dv, shcd_add(a, shcd_add(b, c)));
    }
    model->info.volume_m3 = volume;
    model->info.area_m2 = area;
    model->info.star_centre_m = volume != 0.0 ? shcd_mul_add(o, 1.0 / volume, moment) : o;
}

/* Smallest ball around the vertices by Badoiu and Clarkson's iteration (step 1/(i+1) towards the
 * farthest point: radius within 1/sqrt(i) of the smallest); then as large as the leaves' flat
 * triangles and deviations need, which makes it certified. */
static void measure_ball(shcd_model *model) {
    const shcdi_tree *tree = &model->tree;
    shcd_vec3 c = shcd_scale(0.5, shcd_add(model->info.box_min_m, model->info.box_max_m));
    for (int step = 1; step <= 400; step++) {
        size_t far = 0;
        double largest = -1.0;
        for (size_t i = 0; i < tree->n_vertices; i++) {
            const shcd_vec3 d = shcd_sub(tree->position[i], c);
            const double d2 = shcd_dot(d, d);
            if (d2 > largest) {
                largest = d2;
                far = i;
            }
        }
        c = shcd_mul_add(c, 1.0 / (step + 1.0), shcd_sub(tree->position[far], c));
    }
    double radius = 0.0;
    for (size_t i = 0; i < tree->n_leaves; i++) {
        for (int k = 0; k < 3; k++) {
            const shcd_vec3 p = tree->position[tree->leaf[i].vertex[k]];
            radius = shcdi_max(radius, shcd_norm(shcd_sub(p, c)) + (double)tree->leaf[i].deviation);
        }
    }
    model->info.centre_m = c;
    model->info.radius_m = radius * (1.0 + 1e-12);
}

/* How much the surface spreads the parameter sphere: the smallest |S(a) - S(b)| / angle(a, b), over
 * pairs of the coarser vertices, which come first, and over neighbours by the leaves' bounds. */
static void measure_spread(shcd_model *model) {
    const shcdi_tree *tree = &model->tree;
    const size_t n = tree->n_vertices < SPREAD_VERTICES ? tree->n_vertices : SPREAD_VERTICES;
    double least = HUGE_VAL;
    for (size_t i = 0; i < tree->n_leaves; i++) {
        least = shcdi_min(least, (double)tree->leaf[i].sigma);
    }
    for (size_t i = 1; i < n; i++) {
        for (size_t k = 0; k < i; k++) {
            const shcd_vec3 w = shcd_sub(tree->direction[i], tree->direction[k]);
            const shcd_vec3 x = shcd_sub(tree->position[i], tree->position[k]);
            const double angle = 2.0 * asin(shcdi_min(1.0, 0.5 * shcd_norm(w)));
            least = shcdi_min(least, shcd_norm(x) / angle);
        }
    }
    model->spread_m = least;
}

void shcdi_shape_measure(shcd_model *model) {
    measure_spread(model);
    measure_box(model);
    measure_volume(model);
    measure_ball(model);
}

/* ---- kernel: maximise the smallest (S_i - c) . n_i over c ----
 * A linear programme with one constraint per vertex; here by Newton on its soft minimum
 * -tau log sum exp(-(S_i - c).n_i/tau), which is concave, with tau lowered step by step to 1e-4 of
 * the diagonal: within tau log(n) of the optimum. Only the margin that is then measured is claimed.
 */

typedef struct half_space {
    shcd_vec3 n;
    double d; /* S . n, relative to the box centre */
} half_space;

static double margin_at(const half_space *h, size_t n, shcd_vec3 c) {
    double least = HUGE_VAL;
    for (size_t i = 0; i < n; i++) {
        least = shcdi_min(least, h[i].d - shcd_dot(h[i].n, c));
    }
    return least;
}

/* Solves the symmetric positive definite 3x3 system by Cholesky; 0 if it is not definite. */
static int solve3(const double a[6], const double b[3], double x[3]) {
    const double l00 = sqrt(a[0]);
    const double l10 = a[1] / l00, l20 = a[2] / l00;
    const double l11 = sqrt(a[3] - l10 * l10);
    const double l21 = (a[4] - l20 * l10) / l11;
    const double l22 = sqrt(a[5] - l20 * l20 - l21 * l21);
    const double y0 = b[0] / l00, y1 = (b[1] - l10 * y0) / l11;
    const double y2 = (b[2] - l20 * y0 - l21 * y1) / l22;
    x[2] = y2 / l22;
    x[1] = (y1 - l21 * x[2]) / l11;
    x[0] = (y0 - l10 * x[1] - l20 * x[2]) / l00;
    return shcdi_is_finite(x[0]) && shcdi_is_finite(x[1]) && shcdi_is_finite(x[2]);
}

static shcd_vec3 soft_newton_step(const half_space *h, size_t n, shcd_vec3 c, double tau) {
    const double least = margin_at(h, n, c);
    double sum = 0.0, g[3] = {0}, s[6] = {0};
    for (size_t i = 0; i < n; i++) {
        const double e = exp((least - (h[i].d - shcd_dot(h[i].n, c))) / tau);
        const shcd_vec3 v = h[i].n;
        sum += e;
        g[0] += e * v.x;
        g[1] += e * v.y;
        g[2] += e * v.z;
        s[0] += e * v.x * v.x;
        s[1] += e * v.x * v.y;
        s[2] += e * v.x * v.z;
        s[3] += e * v.y * v.y;
        s[4] += e * v.y * v.z;
        s[5] += e * v.z * v.z;
    }
    for (int k = 0; k < 3; k++) {
        g[k] /= sum;
    }
    const double a[6] = {s[0] / sum - g[0] * g[0] + 1e-6, s[1] / sum - g[0] * g[1],
                         s[2] / sum - g[0] * g[2],        s[3] / sum - g[1] * g[1] + 1e-6,
                         s[4] / sum - g[1] * g[2],        s[5] / sum - g[2] * g[2] + 1e-6};
    double x[3];
    if (!solve3(a, g, x)) {
        return shcd_vec3_make(0.0, 0.0, 0.0);
    }
    return shcd_scale(-tau, shcd_vec3_make(x[0], x[1], x[2]));
}

static shcd_vec3 kernel_centre(const half_space *h, size_t n, shcd_vec3 start, double diagonal) {
    shcd_vec3 best = start;
    double best_margin = margin_at(h, n, start);
    shcd_vec3 c = start;
    for (double tau = 0.1 * diagonal; tau > 0.9e-4 * diagonal; tau *= 0.5) {
        for (int i = 0; i < 8; i++) {
            const shcd_vec3 step = soft_newton_step(h, n, c, tau);
            const double length = shcd_norm(step);
            const double cap = 0.1 * diagonal;
            c = shcd_mul_add(c, length > cap ? cap / length : 1.0, step);
            const double margin = margin_at(h, n, c);
            if (margin > best_margin) {
                best_margin = margin;
                best = c;
            }
        }
        c = best;
    }
    return best;
}

shcd_status shcdi_shape_kernel(shcd_model *model) {
    const shcd_allocator *allocator = &model->allocator;
    const size_t n = model->tree.n_vertices;
    half_space *h = allocator->allocate(n * sizeof *h, allocator->user);
    if (h == NULL) {
        return SHCD_ERR_MEMORY;
    }
    const shcd_vec3 o = shcd_scale(0.5, shcd_add(model->info.box_min_m, model->info.box_max_m));
    for (size_t i = 0; i < n; i++) {
        shcdi_jet jet;
        shcdi_surface_first(&model->series, model->degree, model->tree.direction[i], &jet);
        h[i].n = shcd_unit(shcd_cross(jet.s1, jet.s2));
        h[i].d = shcd_dot(shcd_sub(jet.s, o), h[i].n);
    }
    const shcd_vec3 centroid = shcd_sub(model->info.star_centre_m, o);
    const shcd_vec3 centre = kernel_centre(h, n, centroid, model->info.diagonal_m);
    const double margin = margin_at(h, n, centre);
    model->info.is_star_shaped = margin > 0.0;
    model->info.star_certainty = SHCD_CERTAINTY_SAMPLED;
    model->info.star_margin_m = margin;
    if (margin > 0.0) {
        model->info.star_centre_m = shcd_add(o, centre);
    }
    allocator->release(h, allocator->user);
    return SHCD_OK;
}
