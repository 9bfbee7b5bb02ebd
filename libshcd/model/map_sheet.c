/* SPDX-License-Identifier: BSD-3-Clause */
/* Existence, uniqueness and derivatives of the radius over a cone of directions.
 *
 * Let d be the axis of the cone, R its angle, x(w) = S(w) - C, z = d.x and phi = E x/z in R^2, with
 * the rows of E an orthonormal basis across d: the gnomonic coordinates of the direction of x. A
 * ray of the cone has coordinates tau with |tau| <= T = tan R, and its crossings are the solutions
 * of phi(w) = tau with z > 0. Let w be the crossing on the axis, phi(w) = 0, A = D phi(w) with
 * singular values s_min <= s_max.
 *
 * Derivatives. Along a great circle, phi' = (E - phi d^T) x'/z and phi'' = (E - phi d^T) x''/z -
 * 2 phi' (d.x')/z. Within angle rho of w: |S''| <= M2, |S'| <= M1, |d.S'| <= Mz, z >= z_low and
 * |phi| <= F follow from the values at w and Taylor's formula, M2 being the smaller of the leaves'
 * bound and |S''(w)| + (M3 + 2/3 M1) rho. (The covariant derivative of the Hessian in a direction u
 * differs from its symmetric part, which M3 bounds, by Ricci's identity: at most 2/3 of |S'|.) So
 *
 *   P1 = sqrt(1 + F^2) M1/z_low >= |phi'|,  P2 = sqrt(1 + F^2) M2/z_low + 2 P1 Mz/z_low >= |phi''|,
 *
 * and along a great circle from w, with parallel frames, D phi changes by at most P2 rho.
 *
 * Existence. Lift the segment from 0 to tau: w(t) with D phi w' = tau. At angle s from w, |w'| <=
 * |tau|/(s_min - P2 s), so s_min s - P2 s^2/2 <= T, and the lift stays within
 * rho_e = 2 T/(s_min + sqrt(s_min^2 - 2 P2 T)), if the root is real and rho_e <= rho.
 *
 * Uniqueness within rho. For two points a, b of that cap, joined by a great circle of length l that
 * stays in it, phi(b) - phi(a) is the integral of D phi applied to the unit tangent. D phi differs
 * from A (as a 2 x 3 matrix with A w = 0) by at most P2 rho + s_max (1 - cos rho): the second term
 * is what projecting a tangent at angle rho from w onto the tangent plane at w loses along the way.
 * The chord b - a is orthogonal to a + b, which is within rho of w, so its part in that plane is at
 * least cos rho of it, and |b - a| = 2 sin(l/2) >= l sin(rho)/rho. Hence |phi(b) - phi(a)| >= k l,
 *
 *   k = s_min cos(rho) sin(rho)/rho - P2 rho - s_max (1 - cos rho);
 *
 * k > 0 makes phi one-to-one. A point with |phi - tau| <= eps is within eps/k of the crossing.
 *
 * The radius. Let a dash now be the derivative along a great circle of directions, n the normal and
 * c = |n.d|. Gnomonic coordinates stretch by at most 1/cos^2 R, so |w'| <= W = 1/(cos^2 R (s_min -
 * P2 rho_e)). From S = C + r d twice differentiated, d'' = -d, with n.S' = 0: r' = -r (n.d')/(n.d)
 * and
 *
 *   r'' = n.S''(w', w')/(n.d) + 2 r'^2/r + r,   |r''| <= M2 W^2/c + 2 r'^2/r + r.
 *
 * |r'| = |d.S'(w')| <= (Mz + R M1) W; also |r'| <= r tan(alpha), cos(alpha) = c, and the angle
 * alpha between n and d changes over the cone by at most R + M2 rho_e/(|S'|_min(w) - M2 rho_e), the
 * normal turning by |S''|/|S'|_min per unit angle of parameter. Either bound of r' gives one of c,
 * since c = 1/sqrt(1 + (r'/r)^2) for the steepest direction.
 */
#include "model/map_sheet.h"

#include <string.h>

/* Outward rounding: the quantities at w come from sums that err by less than 1e-11 relative. */
#define OUTWARD (1.0 + 1e-9)
#define INWARD (1.0 - 1e-9)
/* Nodes keep slopes down to c = 1e-3 unchanged (shcdi_map_crossing()). */
#define GRAZING 2e-3
#define RHO_MAX 0.5

/* ---- suprema over caps ---- */

shcdi_cap *shcdi_caps_create(const shcd_model *model, const shcd_allocator *allocator) {
    const shcdi_tree *tree = &model->tree;
    const size_t n = shcdi_tree_ball_count(tree->level);
    shcdi_cap *caps = allocator->allocate(n * sizeof *caps, allocator->user);
    if (caps == NULL) {
        return NULL;
    }
    for (int level = tree->level; level >= 0; level--) {
        shcdi_cap *cap = caps + shcdi_tree_level_start(level);
        for (size_t i = 0; i < shcdi_tree_level_size(level); i++) {
            shcd_vec3 corner[3], sum = {0.0, 0.0, 0.0};
            for (size_t k = 0; k < 3; k++) {
                /* child k keeps corner k */
                size_t leaf = i;
                for (int l = level; l < tree->level; l++) {
                    leaf = 4 * leaf + k;
                }
                corner[k] = tree->direction[tree->leaf[leaf].vertex[k]];
                sum = shcd_add(sum, corner[k]);
            }
            cap[i].centre = shcd_unit(sum);
            double chord = 0.0;
            for (int k = 0; k < 3; k++) {
                chord = shcdi_max(chord, shcd_norm(shcd_sub(corner[k], cap[i].centre)));
            }
            cap[i].angle = 2.0 * asin(shcdi_min(1.0, 0.5 * chord)) + 1e-12;
            cap[i].cosine = cos(cap[i].angle);
            cap[i].sine = sin(cap[i].angle);
            if (level == tree->level) {
                const double m[3] = {(double)tree->leaf[i].m1, (double)tree->leaf[i].m2,
                                     (double)tree->leaf[i].m3};
                memcpy(cap[i].m, m, sizeof m);
                continue;
            }
            const shcdi_cap *child = caps + shcdi_tree_level_start(level + 1) + 4 * i;
            for (int k = 0; k < 3; k++) {
                cap[i].m[k] = shcdi_max(shcdi_max(child[0].m[k], child[1].m[k]),
                                        shcdi_max(child[2].m[k], child[3].m[k]));
            }
        }
    }
    return caps;
}

static void cap_suprema(const shcd_model *model, const shcdi_cap *caps, shcd_vec3 w, double angle,
                        double m[3]) {
    uint32_t stack[8 + 3 * (SHCDI_TREE_LEVEL_MAX + 1)];
    int level_of[8 + 3 * (SHCDI_TREE_LEVEL_MAX + 1)];
    int n = 0;
    /* at most RHO_MAX, and a cap's angle at most 0.96: their sum is below pi */
    const double cosine = cos(angle + 1e-7), sine = sin(angle + 1e-7);
    m[0] = m[1] = m[2] = 0.0;
    for (uint32_t i = 0; i < 8; i++) {
        stack[n] = i;
        level_of[n++] = 0;
    }
    while (n > 0) {
        const uint32_t i = stack[--n];
        const int level = level_of[n];
        const shcdi_cap *cap = &caps[shcdi_tree_level_start(level) + i];
        /* the angle to the cap's centre is above angle + 1e-7 + cap->angle */
        if (shcd_dot(w, cap->centre) < cosine * cap->cosine - sine * cap->sine) {
            continue;
        }
        if (level == model->tree.level || cap->angle < 0.25 * angle) {
            for (int k = 0; k < 3; k++) {
                m[k] = shcdi_max(m[k], cap->m[k]);
            }
            continue;
        }
        for (uint32_t k = 0; k < 4; k++) {
            stack[n] = 4 * i + k;
            level_of[n++] = level + 1;
        }
    }
}

/* ---- at the axis ---- */

typedef struct at_axis {
    shcd_vec3 w, d;
    double z, s_min, s_max;       /* of A */
    double first, first_min;      /* singular values of S' */
    double second, along, across; /* |S''|, |d.S'|, |E S'| */
    double alpha;                 /* angle between the line of n and d */
} at_axis;

/* Singular values of the n x 2 matrix with columns a, b; `area` is the area they span. */
static void singular(shcd_vec3 a, shcd_vec3 b, double area, double *low, double *high) {
    const double aa = shcd_dot(a, a), bb = shcd_dot(b, b), ab = shcd_dot(a, b);
    const double half = 0.5 * (aa - bb);
    *high = sqrt(0.5 * (aa + bb) + sqrt(half * half + ab * ab));
    *low = *high > 0.0 ? area / *high : 0.0;
}

/* At w, in the gnomonic coordinates about the direction of S(w). */
static int look_from(const shcd_model *model, shcd_vec3 origin, shcd_vec3 w, at_axis *f) {
    shcdi_jet jet;
    shcd_vec3 e1, e2;
    shcdi_surface_jet(&model->series, model->degree, w, &jet);
    const shcd_vec3 x = shcd_sub(jet.s, origin), normal = shcd_cross(jet.s1, jet.s2);
    const shcd_vec3 d = shcd_unit(x);
    shcdi_tangent_frame(d, &e1, &e2);
    const shcd_vec3 c1 = {shcd_dot(e1, jet.s1), shcd_dot(e2, jet.s1), 0.0};
    const shcd_vec3 c2 = {shcd_dot(e1, jet.s2), shcd_dot(e2, jet.s2), 0.0};
    double low, high;
    f->w = w;
    f->d = d;
    f->z = (shcd_norm(x) - model->evaluation_error_m) * INWARD;
    singular(c1, c2, fabs(c1.x * c2.y - c1.y * c2.x), &low, &f->across);
    const double d1 = shcd_dot(d, jet.s1), d2 = shcd_dot(d, jet.s2);
    f->along = sqrt(d1 * d1 + d2 * d2) * OUTWARD;
    /* rounding of S turns d by less than 1e-9: shcdi_sheet_prove() */
    f->s_min = (low * INWARD - 1e-9 * f->along) / shcd_norm(x) * INWARD;
    f->s_max = (f->across + 1e-9 * f->along) / f->z * OUTWARD;
    f->across = (f->across + 1e-9 * f->along) * OUTWARD;
    singular(jet.s1, jet.s2, shcd_norm(normal), &f->first_min, &f->first);
    f->first_min *= INWARD;
    f->first *= OUTWARD;
    /* S''(v, v) = mean + cos(2 t) h1 + sin(2 t) h2 */
    const shcd_vec3 mean = shcd_scale(0.5, shcd_add(jet.s11, jet.s22));
    const shcd_vec3 h1 = shcd_scale(0.5, shcd_sub(jet.s11, jet.s22));
    singular(h1, jet.s12, 0.0, &low, &high);
    f->second = (shcd_norm(mean) + high) * OUTWARD;
    const double c = fabs(shcd_dot(normal, d)) / shcd_norm(normal);
    f->alpha = acos(shcdi_min(1.0, c)) + 1e-7;
    return f->z > 0.0 && f->s_min > 0.0 && shcdi_is_finite(f->alpha);
}

static double angle_between(shcd_vec3 a, shcd_vec3 b) {
    return 2.0 * asin(shcdi_min(1.0, 0.5 * shcd_norm(shcd_sub(a, b))));
}

/* Any start near the crossing on the cone's axis will do: the proof runs about the direction of
 * S(start), in a cone that is wider by the angle between the two. Newton's method only where that
 * would waste much. */
static int look_along_axis(const shcd_model *model, const shcdi_cone *cone, shcd_vec3 start,
                           size_t *steps_left, at_axis *f) {
    if (look_from(model, cone->origin, start, f) &&
        angle_between(f->d, cone->d) <= 0.05 * cone->angle) {
        return 1;
    }
    shcdi_hit hit;
    return shcdi_ray_newton(model, cone->origin, cone->d, start, steps_left, &hit) &&
           look_from(model, cone->origin, hit.w, f);
}

/* ---- within an angle of it ---- */

typedef struct growth {
    double m1, m2, mz, z_low, r_high, p2;
    double k;     /* phi is one-to-one where this is positive */
    double reach; /* rho_e, or +inf */
} growth;

static void grow(const shcd_model *model, const shcdi_cap *caps, const at_axis *f, double t,
                 double rho, growth *g) {
    double m[3];
    cap_suprema(model, caps, f->w, rho, m);
    g->m2 = shcdi_min(m[1], f->second + (m[2] + 0.6667 * m[0]) * rho);
    g->m1 = shcdi_min(m[0], f->first + g->m2 * rho);
    g->mz = shcdi_min(g->m1, f->along + g->m2 * rho);
    const double bend = 0.5 * g->m2 * rho * rho;
    const double across = f->across * rho + bend + f->z * 1e-9;
    const double z_high = (f->z + f->along * rho + bend) * OUTWARD;
    g->z_low = (f->z - f->along * rho - bend) * INWARD;
    g->reach = HUGE_VAL;
    g->k = -1.0;
    if (!(g->z_low > 0.0)) {
        return;
    }
    g->r_high = sqrt(z_high * z_high + across * across);
    const double tilt = across / g->z_low;
    const double row = sqrt(1.0 + tilt * tilt);
    const double p1 = row * g->m1 / g->z_low;
    const double wide = (row * g->m2 + 2.0 * p1 * g->mz) / g->z_low;
    /* |phi'| <= s_max + P2 rho may be the better bound of the two */
    const double p1_near = shcdi_min(p1, f->s_max + wide * rho);
    g->p2 = (row * g->m2 + 2.0 * p1_near * g->mz) / g->z_low * OUTWARD;
    g->k = f->s_min * cos(rho) * sin(rho) / rho - g->p2 * rho - f->s_max * (1.0 - cos(rho));
    const double square = f->s_min * f->s_min - 2.0 * g->p2 * t;
    if (square > 0.0) {
        g->reach = 2.0 * t / (f->s_min + sqrt(square)) * OUTWARD;
    }
}

static int is_proven(const at_axis *f, const growth *g, double rho) {
    return g->k >= 0.05 * f->s_min && g->reach <= rho;
}

/* A radius that proves the sheet, as large a one as a few trials find if `wide`; 0: none. */
static double proven_radius(const shcd_model *model, const shcdi_cap *caps, const at_axis *f,
                            double t, int wide, growth *g) {
    double rho = shcdi_min(RHO_MAX, 3.0 * t / f->s_min);
    grow(model, caps, f, t, rho, g);
    while (!is_proven(f, g, rho)) {
        rho *= 0.7;
        if (rho * f->s_min < t) {
            return 0.0;
        }
        grow(model, caps, f, t, rho, g);
    }
    while (wide && 1.5 * rho < RHO_MAX) {
        growth wider;
        grow(model, caps, f, t, 1.5 * rho, &wider);
        if (!is_proven(f, &wider, 1.5 * rho)) {
            break;
        }
        rho *= 1.5;
        *g = wider;
    }
    return rho;
}

int shcdi_sheet_prove(const shcd_model *model, const shcdi_cap *caps, const shcdi_cone *cone,
                      shcd_vec3 start, int wide, size_t *steps_left, shcdi_sheet *sheet) {
    at_axis f;
    if (!look_along_axis(model, cone, start, steps_left, &f)) {
        return 0;
    }
    const double angle = cone->angle + angle_between(f.d, cone->d) + 1e-9;
    const double off = (shcdi_ray_tolerance(model) + model->evaluation_error_m) / f.z;
    if (!(angle < 1.0 && off < 1e-9)) {
        return 0;
    }
    const double t = tan(angle) * OUTWARD;
    growth g;
    const double unique = proven_radius(model, caps, &f, t, wide, &g);
    /* the crossing at a corner is then within 5e-7 of what Newton's method found there; a corner's
     * own gnomonic coordinates differ by at most 1/cos^2 R < 4 */
    const double found = 4.0 * off * (f.z / g.z_low) / g.k;
    if (!(unique > 0.0 && found < 5e-7)) {
        return 0;
    }
    sheet->w = f.w;
    sheet->unique = unique;
    sheet->node = g.m1 * found;
    const double rho = g.reach;
    grow(model, caps, &f, t, rho, &g);
    const double slowest = f.s_min - g.p2 * rho;
    if (!(slowest > 0.0)) {
        return 0;
    }
    const double c_r = cos(angle);
    const double speed = OUTWARD / (c_r * c_r * slowest);
    double m1 = (g.mz + angle * g.m1) * speed, c = 0.0;
    const double thin = f.first_min - g.m2 * rho;
    const double alpha = thin > 0.0 ? f.alpha + angle + g.m2 * rho / thin : 2.0;
    if (alpha < 1.57) {
        c = cos(alpha);
        m1 = shcdi_min(m1, g.r_high * tan(alpha));
    }
    const double ratio = m1 / g.z_low;
    c = shcdi_max(c, 1.0 / sqrt(1.0 + ratio * ratio));
    sheet->m1 = m1 * OUTWARD;
    sheet->m2 = (g.m2 * speed * speed / c + 2.0 * m1 * m1 / g.z_low + g.r_high) * OUTWARD;
    sheet->r_max = g.r_high;
    return c > GRAZING;
}
