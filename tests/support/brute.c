/* SPDX-License-Identifier: BSD-3-Clause */
#include "support/brute.h"

#include <math.h>
#include <stdlib.h>

#define STARTS 10
#define SEPARATION 0.03 /* radians between starts: basins nearer than that are one to Newton */

struct brute {
    const shcd_model *model;
    const shcd_shape *shape; /* NULL: at rest */
    size_t n, n_points;
    shcd_vec3 *w, *x;
};

static shcd_vec3 cube_direction(int face, double u, double v) {
    /* equal angles: cells differ in size by less than sqrt(2) */
    const double a = tan(0.785398163397448310 * u), b = tan(0.785398163397448310 * v);
    switch (face) {
    case 0:
        return shcd_unit(shcd_vec3_make(1.0, a, b));
    case 1:
        return shcd_unit(shcd_vec3_make(-1.0, -a, b));
    case 2:
        return shcd_unit(shcd_vec3_make(-a, 1.0, b));
    case 3:
        return shcd_unit(shcd_vec3_make(a, -1.0, b));
    case 4:
        return shcd_unit(shcd_vec3_make(a, b, 1.0));
    default:
        return shcd_unit(shcd_vec3_make(a, -b, -1.0));
    }
}

static shcd_vec3 surface(const brute *b, shcd_vec3 w, double *jacobian) {
    shcd_vec3 x = {0.0, 0.0, 0.0};
    const shcd_status status = b->shape == NULL
                                   ? shcd_model_surface(b->model, -1, w, &x, NULL, jacobian)
                                   : shcd_shape_surface(b->model, b->shape, w, &x, NULL, jacobian);
    if (status != SHCD_OK) {
        abort();
    }
    return x;
}

/* Grid points lie on the faces' borders too, so that neighbouring faces share their corner
 * positions and the tessellation is closed. */
brute *brute_create_shape(const shcd_model *model, const shcd_shape *shape, size_t n) {
    brute *b = calloc(1, sizeof *b);
    if (b == NULL) {
        return NULL;
    }
    b->model = model;
    b->shape = shape;
    b->n = n;
    b->n_points = 6 * (n + 1) * (n + 1);
    b->w = malloc(b->n_points * sizeof *b->w);
    b->x = malloc(b->n_points * sizeof *b->x);
    if (b->w == NULL || b->x == NULL) {
        brute_free(b);
        return NULL;
    }
    size_t at = 0;
    for (int face = 0; face < 6; face++) {
        for (size_t i = 0; i <= n; i++) {
            for (size_t k = 0; k <= n; k++, at++) {
                const double u = 2.0 * (double)i / (double)n - 1.0;
                const double v = 2.0 * (double)k / (double)n - 1.0;
                b->w[at] = cube_direction(face, u, v);
                b->x[at] = surface(b, b->w[at], NULL);
            }
        }
    }
    return b;
}

brute *brute_create(const shcd_model *model, size_t n) {
    return brute_create_shape(model, NULL, n);
}

void brute_free(brute *b) {
    if (b != NULL) {
        free(b->w);
        free(b->x);
        free(b);
    }
}

/* ---- polishing: damped Newton in a tangent plane, Hessian by differences of the gradient ---- */

typedef struct value {
    double f, g1, g2;
} value;

static value value_at(const brute *b, shcd_vec3 p, shcd_vec3 w, shcd_vec3 t1, shcd_vec3 t2) {
    double j[9];
    const shcd_vec3 x = surface(b, w, j);
    const shcd_vec3 r = shcd_sub(x, p);
    const shcd_vec3 g = {r.x * j[0] + r.y * j[3] + r.z * j[6], r.x * j[1] + r.y * j[4] + r.z * j[7],
                         r.x * j[2] + r.y * j[5] + r.z * j[8]};
    const value v = {0.5 * shcd_dot(r, r), shcd_dot(g, t1), shcd_dot(g, t2)};
    return v;
}

static shcd_vec3 step_to(shcd_vec3 w, shcd_vec3 t1, shcd_vec3 t2, double a, double c) {
    return shcd_unit(shcd_mul_add(shcd_mul_add(w, a, t1), c, t2));
}

static shcd_vec3 polish(const brute *b, shcd_vec3 p, shcd_vec3 w) {
    for (int i = 0; i < 40; i++) {
        const shcd_vec3 other =
            fabs(w.x) < 0.6 ? shcd_vec3_make(1.0, 0.0, 0.0) : shcd_vec3_make(0.0, 1.0, 0.0);
        const shcd_vec3 t1 = shcd_unit(shcd_cross(w, other)), t2 = shcd_cross(w, t1);
        const double h = 1e-5;
        const value v = value_at(b, p, w, t1, t2);
        const value xp = value_at(b, p, step_to(w, t1, t2, h, 0.0), t1, t2);
        const value xm = value_at(b, p, step_to(w, t1, t2, -h, 0.0), t1, t2);
        const value yp = value_at(b, p, step_to(w, t1, t2, 0.0, h), t1, t2);
        const value ym = value_at(b, p, step_to(w, t1, t2, 0.0, -h), t1, t2);
        const double a = (xp.g1 - xm.g1) / (2.0 * h), d = (yp.g2 - ym.g2) / (2.0 * h);
        const double c = 0.25 * (xp.g2 - xm.g2 + yp.g1 - ym.g1) / h;
        /* shift until definite */
        const double root = sqrt(0.25 * (a - d) * (a - d) + c * c);
        const double low = 0.5 * (a + d) - root, high = 0.5 * (a + d) + root;
        const double shift = low < 1e-6 * fabs(high) ? 1e-3 * fabs(high) - low : 0.0;
        const double det = (a + shift) * (d + shift) - c * c;
        const double s1 = -((d + shift) * v.g1 - c * v.g2) / det;
        const double s2 = -((a + shift) * v.g2 - c * v.g1) / det;
        double t = fmin(1.0, 0.1 / hypot(s1, s2));
        int better = 0;
        for (int k = 0; k < 20 && !better; k++, t *= 0.4) {
            const shcd_vec3 next = step_to(w, t1, t2, t * s1, t * s2);
            if (value_at(b, p, next, t1, t2).f < v.f) {
                w = next;
                better = 1;
            }
        }
        if (!better || hypot(s1, s2) < 1e-13) {
            break;
        }
    }
    return w;
}

double brute_distance(const brute *b, shcd_vec3 p, shcd_vec3 *parameter) {
    size_t start[STARTS];
    double d2[STARTS];
    size_t n = 0;
    for (size_t i = 0; i < b->n_points; i++) {
        const shcd_vec3 r = shcd_sub(b->x[i], p);
        const double f = shcd_dot(r, r);
        if (n == STARTS && f >= d2[n - 1]) {
            continue;
        }
        /* a nearer start in the neighbourhood stands for this one; farther ones give way to it */
        int is_new = 1;
        size_t kept = 0;
        for (size_t k = 0; k < n; k++) {
            const shcd_vec3 apart = shcd_sub(b->w[start[k]], b->w[i]);
            const int is_near = shcd_dot(apart, apart) < SEPARATION * SEPARATION;
            if (is_near && d2[k] <= f) {
                is_new = 0;
            }
            if (!is_near || d2[k] <= f) {
                start[kept] = start[k];
                d2[kept++] = d2[k];
            }
        }
        n = kept;
        if (is_new) {
            size_t at = n < STARTS ? n++ : n - 1;
            for (; at > 0 && d2[at - 1] > f; at--) {
                start[at] = start[at - 1];
                d2[at] = d2[at - 1];
            }
            start[at] = i;
            d2[at] = f;
        }
    }
    double best = HUGE_VAL;
    for (size_t k = 0; k < n; k++) {
        const shcd_vec3 w = polish(b, p, b->w[start[k]]);
        const double d = shcd_norm(shcd_sub(surface(b, w, NULL), p));
        if (d < best) {
            best = d;
            *parameter = w;
        }
    }
    return best;
}

static double solid_angle(shcd_vec3 p, shcd_vec3 x, shcd_vec3 y, shcd_vec3 z) {
    const shcd_vec3 a = shcd_sub(x, p), b = shcd_sub(y, p), c = shcd_sub(z, p);
    const double la = shcd_norm(a), lb = shcd_norm(b), lc = shcd_norm(c);
    return 2.0 *
           atan2(shcd_dot(a, shcd_cross(b, c)),
                 la * lb * lc + shcd_dot(a, b) * lc + shcd_dot(b, c) * la + shcd_dot(c, a) * lb);
}

double brute_winding(const brute *b, shcd_vec3 p) {
    const size_t side = b->n + 1;
    double sum = 0.0;
    for (size_t face = 0; face < 6; face++) {
        for (size_t i = 0; i < b->n; i++) {
            for (size_t k = 0; k < b->n; k++) {
                const shcd_vec3 *q = b->x + (face * side + i) * side + k;
                sum += solid_angle(p, q[0], q[side], q[side + 1]) +
                       solid_angle(p, q[0], q[side + 1], q[1]);
            }
        }
    }
    return sum / 12.566370614359172;
}

double brute_deviation(const brute *b) {
    const size_t side = b->n + 1;
    double largest = 0.0;
    for (size_t face = 0; face < 6; face++) {
        for (size_t i = 0; i < b->n; i++) {
            for (size_t k = 0; k < b->n; k++) {
                /* the middle of a cell's diagonal and of its first edge, where deviation is largest
                 */
                const size_t at = (face * side + i) * side + k;
                const size_t other[2] = {at + side + 1, at + 1};
                for (int e = 0; e < 2; e++) {
                    const shcd_vec3 middle = shcd_scale(0.5, shcd_add(b->x[at], b->x[other[e]]));
                    const shcd_vec3 w = shcd_unit(shcd_add(b->w[at], b->w[other[e]]));
                    largest = fmax(largest, shcd_norm(shcd_sub(surface(b, w, NULL), middle)));
                }
            }
        }
    }
    return largest;
}
