/* SPDX-License-Identifier: BSD-3-Clause */
/* Distance from a point to an ellipsoid without any iteration that could fail: bisection of the
 * secular equation in long double.
 *
 * With half axes a_0 >= a_1 >= a_2 and y in the first octant the foot is x_i = a_i^2 y_i/(t +
 * a_i^2) with t the largest root of F(t) = sum (a_i y_i/(t + a_i^2))^2 - 1, which falls from +inf
 * at t = -a_2^2 if y_2 > 0. With y_2 = 0 the foot may leave the plane (inside the focal ellipse) or
 * be that of the ellipse in it (Eberly, Distance from a Point to an Ellipse, an Ellipsoid, or a
 * Hyperellipsoid, 2013). */
#ifndef SHCD_TESTS_ELLIPSOID_H
#define SHCD_TESTS_ELLIPSOID_H

#include "shcd/vec.h"

/* F at u = t + a_last^2, which does not cancel for a foot far off the plane of y. */
static inline long double ellipsoid_secular(int n, const long double *a, const long double *y,
                                            long double u) {
    long double sum = -1.0L;
    for (int i = 0; i < n; i++) {
        const long double below = u + (a[i] - a[n - 1]) * (a[i] + a[n - 1]);
        const long double q = y[i] == 0.0L ? 0.0L : a[i] * y[i] / below;
        sum += q * q;
    }
    return sum;
}

/* Foot in n dimensions, y[n-1] > 0. */
static inline void ellipsoid_foot_regular(int n, const long double *a, const long double *y,
                                          long double *x) {
    long double low = a[n - 1] * y[n - 1], high, sum = 0.0L;
    for (int i = 0; i < n; i++) {
        sum += a[i] * a[i] * y[i] * y[i];
    }
    high = sqrtl(sum);
    for (int i = 0; i < 16500 && low < high; i++) {
        const long double u = 0.5L * (low + high);
        if (u <= low || u >= high) {
            break;
        }
        if (ellipsoid_secular(n, a, y, u) > 0.0L) {
            low = u;
        } else {
            high = u;
        }
    }
    for (int i = 0; i < n; i++) {
        const long double below = high + (a[i] - a[n - 1]) * (a[i] + a[n - 1]);
        x[i] = y[i] == 0.0L ? 0.0L : a[i] * a[i] * y[i] / below;
    }
}

static inline void ellipsoid_foot(const long double a[3], const long double y[3],
                                  long double x[3]) {
    int n = 3;
    x[0] = x[1] = x[2] = 0.0L;
    for (; n > 1; n--) {
        const long double last = a[n - 1];
        long double left = 1.0L;
        if (y[n - 1] > 0.0L) {
            ellipsoid_foot_regular(n, a, y, x);
            return;
        }
        for (int i = 0; i < n - 1; i++) {
            const long double top = a[i] * y[i], below = a[i] * a[i] - last * last;
            const long double q = top == 0.0L ? 0.0L : top / below;
            x[i] = a[i] * q;
            left -= top < below || top == 0.0L ? q * q : 2.0L;
        }
        if (left > 0.0L) { /* off the plane, to one side or the other */
            x[n - 1] = last * sqrtl(left);
            return;
        }
        x[n - 1] = 0.0L;
    }
    x[0] = a[0];
}

/** Signed distance, negative inside. */
static inline double ellipsoid_distance(const double axes[3], shcd_vec3 p) {
    const double q[3] = {fabs(p.x), fabs(p.y), fabs(p.z)};
    int order[3] = {0, 1, 2};
    long double a[3], y[3], x[3], d2 = 0.0L, level = 0.0L;
    for (int i = 0; i < 2; i++) {
        for (int k = 0; k < 2 - i; k++) {
            if (axes[order[k]] < axes[order[k + 1]]) {
                const int swap = order[k];
                order[k] = order[k + 1];
                order[k + 1] = swap;
            }
        }
    }
    for (int i = 0; i < 3; i++) {
        a[i] = axes[order[i]];
        y[i] = q[order[i]];
        level += (y[i] / a[i]) * (y[i] / a[i]);
    }
    ellipsoid_foot(a, y, x);
    for (int i = 0; i < 3; i++) {
        d2 += (x[i] - y[i]) * (x[i] - y[i]);
    }
    return (double)(level < 1.0L ? -sqrtl(d2) : sqrtl(d2));
}

#endif
