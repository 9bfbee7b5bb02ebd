/* SPDX-License-Identifier: BSD-3-Clause */
/* Half axes of a surface of degree 1.
 *
 * S(w) = C + A w, C = Y_00 c_00, the columns of A = Y_1 times c_11, c_1-1, c_10. One-sided Jacobi
 * turns the columns against each other until they are orthogonal, A V = X H; it works on the
 * columns themselves, not on their products, and so keeps short half axes to full relative accuracy
 * (Hestenes 1958). How far it got, and what its rounding did, is measured on the result:
 *
 * Let u = 2^-53, E_X = X^T X - I, E_V likewise. There are orthonormal X', V' (polar factors) with
 * |X - X'| <= |E_X|, |V - V'| <= |E_V| (singular values sqrt(1 + e) of X: |sqrt(1 + e) - 1| <=
 * |e|), and |A - X' H V'^T| <= |A - X H V^T| + h_0 (|E_X| |V| + |E_V|). Frobenius norms bound
 * these. What calculating them rounds: C and A carry a rounded constant and a product, 2 u each,
 * |A|_F <= sqrt(3) h_0 (1 + small): 3.5 u h_0. An entry of A - X H V^T takes 5 roundings of its
 * terms h_k X_ik V_jk and 3 of A_ij: all together 5 u sum_k h_k |X_k| |V_k| + 3 u |A|_F <= 20.2 u
 * h_0. An entry of E_X takes 4 of numbers whose sizes sum up to 1: together 12 u. So 26 u h_0 + 2 u
 * |C| is enough for A and C, and 16 u for each of |E|.
 *
 * The right side out: det A > 0. The product of columns is calculated within 8 u |a_0| |a_1| |a_2|:
 * two products and a difference make a cross product's coordinate, 3 more roundings the dot's. The
 * ellipsoid that is calculated with has that sign too if it is nearer to A than its shortest half
 * axis, which is its distance from a singular matrix. */
#include "model/ellipsoid.h"

#include <string.h>

#define SWEEPS_MAX 16
/* cosine of two columns that counts as none: below it a turn changes nothing but rounding */
#define ORTHOGONAL 4e-16
#define U 0x1p-53
/* [m] below, products underflow */
#define HALF_MIN 1e-60
#define SKEW_MAX 1e-9
/* sqrt(3/(4 pi)) and sqrt(1/(4 pi)): Y_11, Y_1,-1, Y_10 are the first times x, y, z */
#define Y1 0.48860251190291992
#define Y0 0.28209479177387814

/* 1 if the columns a, b were orthogonal, else turns them until they are. */
static int make_orthogonal(shcd_vec3 *a, shcd_vec3 *b, shcd_vec3 *va, shcd_vec3 *vb) {
    const double aa = shcd_dot(*a, *a), bb = shcd_dot(*b, *b), ab = shcd_dot(*a, *b);
    if (fabs(ab) <= ORTHOGONAL * sqrt(aa * bb)) {
        return 1;
    }
    const double zeta = (bb - aa) / (2.0 * ab);
    const double t = (zeta < 0.0 ? -1.0 : 1.0) / (fabs(zeta) + sqrt(1.0 + zeta * zeta));
    const double c = 1.0 / sqrt(1.0 + t * t), s = c * t;
    const shcd_vec3 a0 = *a, va0 = *va;
    *a = shcd_sub(shcd_scale(c, a0), shcd_scale(s, *b));
    *b = shcd_add(shcd_scale(s, a0), shcd_scale(c, *b));
    *va = shcd_sub(shcd_scale(c, va0), shcd_scale(s, *vb));
    *vb = shcd_add(shcd_scale(s, va0), shcd_scale(c, *vb));
    return 0;
}

static void order_pair(shcdi_ellipsoid *e, int i, int k) {
    if (e->half_m[i] < e->half_m[k]) {
        const double h = e->half_m[i];
        const shcd_vec3 axis = e->axis[i], turn = e->turn[i];
        e->half_m[i] = e->half_m[k];
        e->axis[i] = e->axis[k];
        e->turn[i] = e->turn[k];
        e->half_m[k] = h;
        e->axis[k] = axis;
        e->turn[k] = turn;
    }
}

/* |X^T X - I|, Frobenius. */
static double skew_of(const shcd_vec3 x[3]) {
    double sum = 0.0;
    for (int i = 0; i < 3; i++) {
        const double on = shcd_dot(x[i], x[i]) - 1.0;
        const double off = shcd_dot(x[i], x[(i + 1) % 3]);
        sum += on * on + 2.0 * off * off;
    }
    return sqrt(sum) * (1.0 + 16.0 * U) + 16.0 * U;
}

/* Bound of |S - what e says|, by what is left of the columns a of A. */
static double error_of(const shcdi_ellipsoid *e, const shcd_vec3 a[3]) {
    double sum = 0.0;
    for (int j = 0; j < 3; j++) {
        shcd_vec3 left = a[j];
        for (int k = 0; k < 3; k++) {
            const shcd_vec3 v = e->turn[k];
            const double along = j == 0 ? v.x : j == 1 ? v.y : v.z;
            left = shcd_mul_add(left, -(e->half_m[k] * along), e->axis[k]);
        }
        sum += shcd_dot(left, left);
    }
    const double h = e->half_m[0], turn = skew_of(e->turn);
    return sqrt(sum) * (1.0 + 16.0 * U) + h * (e->skew * (1.0 + turn) + turn + 26.0 * U) +
           2.0 * U * shcd_norm(e->centre_m);
}

void shcdi_ellipsoid_make(const double coefficients[12], shcdi_ellipsoid *e) {
    static const int order[3] = {3, 1, 2}; /* of m = 1, -1, 0 */
    shcd_vec3 a[3], x[3];
    memset(e, 0, sizeof *e);
    e->centre_m = shcd_scale(Y0, shcd_vec3_make(coefficients[0], coefficients[1], coefficients[2]));
    for (int i = 0; i < 3; i++) {
        const double *c = coefficients + 3 * order[i];
        x[i] = a[i] = shcd_scale(Y1, shcd_vec3_make(c[0], c[1], c[2]));
        e->turn[i] = shcd_vec3_make(i == 0, i == 1, i == 2);
    }
    const double sizes = shcd_norm(a[0]) * shcd_norm(a[1]) * shcd_norm(a[2]);
    if (!(shcd_dot(a[0], shcd_cross(a[1], a[2])) > 10.0 * U * sizes)) {
        return;
    }
    for (int sweep = 0; sweep < SWEEPS_MAX; sweep++) {
        int done = make_orthogonal(&x[0], &x[1], &e->turn[0], &e->turn[1]);
        done &= make_orthogonal(&x[0], &x[2], &e->turn[0], &e->turn[2]);
        done &= make_orthogonal(&x[1], &x[2], &e->turn[1], &e->turn[2]);
        if (done) {
            break;
        }
    }
    for (int i = 0; i < 3; i++) {
        e->half_m[i] = shcd_norm(x[i]);
        e->axis[i] = shcd_scale(1.0 / e->half_m[i], x[i]);
    }
    order_pair(e, 0, 1);
    order_pair(e, 1, 2);
    order_pair(e, 0, 1);
    e->skew = skew_of(e->axis);
    e->error_m = error_of(e, a);
    if (!(e->half_m[2] > HALF_MIN && e->skew < SKEW_MAX && e->error_m < e->half_m[2])) {
        memset(e->half_m, 0, sizeof e->half_m);
    }
}
