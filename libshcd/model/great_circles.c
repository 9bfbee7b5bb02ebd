/* SPDX-License-Identifier: BSD-3-Clause */
/* Derivatives along great circles by rotating the node to the pole.
 *
 * For a point w at (theta, phi) let R be the rotation that takes z to w, x to e_theta, y to e_phi,
 * and g = f o R for a coordinate f of S. The great circle through w with axis R a, a = (cos alpha,
 * sin alpha, 0), is the image of that through the pole with axis a, so with D_+- = D_x +- i D_y,
 * D_a the derivative of a rotation about a (i times angular momentum),
 *
 *   T_k(alpha) = 2^-k (e^{-i alpha} D_+ + e^{i alpha} D_-)^k g  at the pole.
 *
 * D_+ takes Y_l^m to i sqrt((l - m)(l + m + 1)) Y_l^{m+1}, D_- the same way back, and at the pole
 * only m = 0 is left, Y_l^0 = nu_l = sqrt((2 l + 1)/(4 pi)). What arrives there after k steps
 * started at order s = k, k - 2, .., -k; orders s and -s are conjugate since f is real. With G_s[c]
 * the sum over l of c_l nu_l times the coefficient (l, s) of g, u = sqrt(l(l+1)), w_2 = u sqrt((l +
 * 2)(l - 1)), w_3 = w_2 sqrt((l + 3)(l - 2)), and alpha counted from the tangent of the circle
 * instead of its axis, which takes the powers of i away:
 *
 *   T_1 = Re(e^{i alpha} G_1[u]),     T_2 = -1/2 G_0[u^2] + 1/2 Re(e^{2 i alpha} G_2[w_2]),
 *   T_3 = -1/4 Re(e^{i alpha} G_1[u (3 u^2 - 2)]) + 1/4 Re(e^{3 i alpha} G_3[w_3]).
 *
 * The coefficient (l, s) of g is the sum over m of a_lm e^{i m phi} d^l_ms(theta), a_lm the complex
 * coefficients of f and d Wigner's functions: trigonometric sums over the ring of the degree of S,
 * from recurrences without a pole. Let P and N be (-1)^{m+s} d_{m,s} and (-1)^s d_{-m,s}; for real
 * coefficients c of the cosine and s of the sine G has the cosine coefficients (c (P + N), -s (P -
 * N)) of its real and imaginary part, and the sine coefficients (s (P + N), c (P - N)).
 *
 * Source of d: Varshalovich, Moskalev, Khersonskii, Quantum Theory of Angular Momentum, World
 * Scientific (1988), chapter 4.
 */
#include "model/great_circles.h"

#include <string.h>

#define PI 3.14159265358979324
#define COLUMNS SHCDI_CIRCLE_COLUMNS
#define LANES SHCDI_CIRCLE_LANES
#define SPINS 4 /* s = 0 .. 3 */
#define SETS 5  /* sums over l: G_0, two of G_1, G_2, G_3 */

/* Spin of each set and the columns of its real part and of its negative imaginary part. */
static const struct {
    int spin, real, imaginary;
} SET[SETS] = {{0, SHCDI_CIRCLE_Z, -1},
               {1, SHCDI_CIRCLE_U, SHCDI_CIRCLE_V},
               {1, SHCDI_CIRCLE_P, SHCDI_CIRCLE_Q},
               {2, SHCDI_CIRCLE_X, SHCDI_CIRCLE_Y},
               {3, SHCDI_CIRCLE_C, SHCDI_CIRCLE_D}};
static const int FIRST_SET[SPINS + 1] = {0, 1, 3, 4, 5};

static double set_weight(int set, int l) {
    const double u2 = (double)l * (l + 1.0), u = sqrt(u2);
    const double w2 = u * sqrt(shcdi_max(0.0, (l + 2.0) * (l - 1.0)));
    switch (set) {
    case 0:
        return -0.5 * u2;
    case 1:
        return u;
    case 2:
        return -0.25 * u * (3.0 * u2 - 2.0);
    case 3:
        return 0.5 * w2;
    default:
        return 0.25 * w2 * sqrt(shcdi_max(0.0, (l + 3.0) * (l - 2.0)));
    }
}

/* ---- tables ---- */

/* Pairs (m, l), 0 <= m <= l <= degree, m slowest. */
static size_t triangle(int degree, int m, int l) {
    const size_t first = (size_t)m * (2 * (size_t)degree + 3 - (size_t)m) / 2;
    return first + (size_t)(l - m);
}

static size_t triangle_size(int degree) {
    return triangle(degree, degree, degree) + 1;
}

static double *series_at(const shcdi_great_circles *g, int set, int m, int l) {
    const size_t n = triangle_size(g->degree);
    return g->series + 6 * ((size_t)set * n + triangle(g->degree, m, l));
}

static double *recurrence_at(const shcdi_great_circles *g, int spin, int m, int l) {
    const size_t n = triangle_size(g->degree);
    return g->recurrence + 3 * ((size_t)spin * n + triangle(g->degree, m, l));
}

/* Coefficient of the neighbours in cos(theta) e_l = gamma_l e_{l-1} + m s/(l(l+1)) e_l +
 * gamma_{l+1} e_{l+1}, e_l = nu_l d^l_ms. */
static double gamma_of(int l, int m, int s) {
    const double l2 = (double)l * l;
    return sqrt((l2 - (double)m * m) * (l2 - (double)s * s) / (4.0 * l2 - 1.0)) / l;
}

static void fill_series(shcdi_great_circles *g, int m, int l, const double *coefficients) {
    const double *c = coefficients + 3 * SHCD_INDEX(l, m);
    const double *s = coefficients + 3 * SHCD_INDEX(l, -m);
    for (int set = 0; set < SETS; set++) {
        double *out = series_at(g, set, m, l);
        const double weight = set_weight(set, l);
        for (int k = 0; k < 3; k++) {
            out[k] = weight * c[k];
            out[3 + k] = m > 0 ? weight * s[k] : 0.0;
        }
    }
}

/* e_{l+1} = (cos(theta) r[0] -+ r[1]) e_l - r[2] e_{l-1}, minus for +m */
static void fill_recurrence(shcdi_great_circles *g, int m, int l) {
    for (int spin = 0; spin < SPINS && spin <= l; spin++) {
        double *r = recurrence_at(g, spin, m, l);
        r[0] = 1.0 / gamma_of(l + 1, m, spin);
        r[1] = l > 0 ? r[0] * m * spin / ((double)l * (l + 1.0)) : 0.0;
        r[2] = l > 0 ? r[0] * gamma_of(l, m, spin) : 0.0;
    }
}

/* cos and sin of m phi_k, m slowest, lanes fastest */
static void fill_wave(shcdi_great_circles *g, int m) {
    for (size_t k = 0; k < g->n_blocks * LANES; k++) {
        const double angle = 2.0 * PI * (double)((size_t)m * k % g->n_phi) / (double)g->n_phi;
        double *wave = g->wave + 2 * LANES * ((size_t)m * g->n_blocks + k / LANES) + k % LANES;
        wave[0] = cos(angle);
        wave[LANES] = sin(angle);
    }
}

static size_t block_count(size_t n_phi) {
    return (n_phi / 4 + LANES) / LANES;
}

static size_t wave_size(int degree, size_t n_phi) {
    return 2 * LANES * ((size_t)degree + 1) * block_count(n_phi);
}

size_t shcdi_great_circles_size(int degree, size_t n_phi) {
    return (6 * SETS + 3 * SPINS) * triangle_size(degree) + wave_size(degree, n_phi) +
           2 * COLUMNS * ((size_t)degree + 1);
}

void shcdi_great_circles_init(shcdi_great_circles *g, int degree, const double *coefficients,
                              size_t n_phi, double *memory) {
    g->degree = degree;
    g->n_phi = n_phi;
    g->n_blocks = block_count(n_phi);
    g->series = memory;
    g->recurrence = g->series + 6 * SETS * triangle_size(degree);
    g->wave = g->recurrence + 3 * SPINS * triangle_size(degree);
    g->fourier = g->wave + wave_size(degree, n_phi);
    for (int m = 0; m <= degree; m++) {
        for (int l = m; l <= degree; l++) {
            fill_series(g, m, l, coefficients);
            fill_recurrence(g, m, l);
        }
        fill_wave(g, m);
    }
}

/* ---- a ring ---- */

/* Sums over l of one order and spin: even[set] of P + N, odd[set] of P - N times the six numbers of
 * the series. p and n are P and N at l = max(m, s). */
static void sum_degrees(const shcdi_great_circles *g, int spin, int m, double z, double p, double n,
                        double even[2][6], double odd[2][6]) {
    const int first = m > spin ? m : spin, sets = FIRST_SET[spin + 1] - FIRST_SET[spin];
    const size_t next_set = 6 * triangle_size(g->degree);
    double p1 = 0.0, n1 = 0.0;
    memset(even, 0, 2 * sizeof even[0]);
    memset(odd, 0, 2 * sizeof odd[0]);
    for (int l = first; l <= g->degree; l++) {
        const double e = p + n, o = p - n;
        const double *c = series_at(g, FIRST_SET[spin], m, l);
        for (int i = 0; i < sets; i++, c += next_set) {
            for (int k = 0; k < 6; k++) {
                even[i][k] += e * c[k];
                odd[i][k] += o * c[k];
            }
        }
        const double *r = recurrence_at(g, spin, m, l);
        const double p2 = (z * r[0] - r[1]) * p - r[2] * p1;
        const double n2 = (z * r[0] + r[1]) * n - r[2] * n1;
        p1 = p;
        n1 = n;
        p = p2;
        n = n2;
    }
}

/* P and N at m = 0, l = s: nu_s sqrt((2 s)!)/s! (-cos sin)^s of the half angle, halved because m =
 * 0 stands for both. */
static double start_at_zero(int spin, double sine) {
    static const double root[SPINS] = {1.0, 1.4142135623730951, 2.449489742783178,
                                       4.47213595499958};
    double p = 0.5 * sqrt((2.0 * spin + 1.0) / (4.0 * PI)) * root[spin];
    for (int i = 0; i < spin; i++) {
        p *= -0.5 * sine;
    }
    return p;
}

/* Ratios of P and N at l = max(m, s) from m to m + 1; besides, orders m > 0 of the real basis come
 * with sqrt(2) of the halves. */
static void advance(int spin, int m, double sine, double tangent, double *p, double *n) {
    const double twice = m == 0 ? 1.4142135623730951 : 1.0;
    if (m < spin) {
        const double ratio = twice * sqrt((double)(spin - m) / (double)(spin + m + 1));
        *p *= -ratio / tangent;
        *n *= ratio * tangent;
    } else {
        const double ratio = twice * 0.5 * sine *
                             sqrt((2.0 * m + 3.0) * (2.0 * m + 2.0) /
                                  ((double)(m + 1 + spin) * (double)(m + 1 - spin)));
        *p *= ratio;
        *n *= ratio;
    }
}

/* Fourier coefficients of the columns of one spin at order m. */
static void keep_sums(shcdi_great_circles *g, int spin, int m, double even[2][6],
                      double odd[2][6]) {
    double *cosine = g->fourier + (size_t)(2 * m) * COLUMNS, *sine = cosine + COLUMNS;
    for (int set = FIRST_SET[spin]; set < FIRST_SET[spin + 1]; set++) {
        const double *e = even[set - FIRST_SET[spin]], *o = odd[set - FIRST_SET[spin]];
        const int real = SET[set].real, imaginary = SET[set].imaginary;
        for (int k = 0; k < 3; k++) {
            cosine[real + k] = e[k];
            sine[real + k] = e[3 + k];
            if (imaginary >= 0) {
                cosine[imaginary + k] = o[3 + k];
                sine[imaginary + k] = -o[k];
            }
        }
    }
}

void shcdi_great_circles_ring(shcdi_great_circles *g, double theta) {
    const double z = cos(theta), sine = sin(theta), tangent = tan(0.5 * theta);
    for (int spin = 0; spin < SPINS; spin++) {
        double p = start_at_zero(spin, sine), n = p;
        for (int m = 0; m <= g->degree; m++) {
            double even[2][6], odd[2][6];
            sum_degrees(g, spin, m, z, p, n, even, odd);
            keep_sums(g, spin, m, even, odd);
            advance(spin, m, sine, tangent, &p, &n);
        }
    }
}

/* Lanes as one value, so that the sums stay in registers; elementwise, whatever the processor. */
typedef double vec __attribute__((vector_size(8 * LANES)));
typedef double unaligned_vec __attribute__((vector_size(8 * LANES), aligned(8), may_alias));

/* Sums of the cosines and of the sines of every second order from m on. */
static void sum_orders(const shcdi_great_circles *g, size_t block, int column, int m,
                       unaligned_vec *cosines, unaligned_vec *sines) {
    const size_t wave_step = 4 * LANES * g->n_blocks;
    const double *wave = g->wave + 2 * LANES * ((size_t)m * g->n_blocks + block);
    const double *f = g->fourier + (size_t)(2 * m) * COLUMNS + column;
    vec a = {0.0}, b = {0.0};
    for (; m <= g->degree; m += 2) {
        a += f[0] * *(const unaligned_vec *)wave;
        b += f[COLUMNS] * *(const unaligned_vec *)(wave + LANES);
        f += 4 * COLUMNS;
        wave += wave_step;
    }
    *cosines = a;
    *sines = b;
}

void shcdi_great_circles_block(const shcdi_great_circles *g, size_t block,
                               shcdi_circle_values image[SHCDI_CIRCLE_IMAGES]) {
    for (int c = 0; c < COLUMNS; c++) {
        unaligned_vec cosines[2], sines[2];
        sum_orders(g, block, c, 0, &cosines[0], &sines[0]);
        sum_orders(g, block, c, 1, &cosines[1], &sines[1]);
        /* phi -> pi - phi: cos(m phi) times (-1)^m, sin(m phi) times -(-1)^m */
        const vec plus = cosines[0] + cosines[1], minus = cosines[0] - cosines[1];
        const vec up = sines[0] + sines[1], down = sines[0] - sines[1];
        *(unaligned_vec *)image[0][c] = plus + up;
        *(unaligned_vec *)image[1][c] = minus - down;
        *(unaligned_vec *)image[2][c] = minus + down;
        *(unaligned_vec *)image[3][c] = plus - up;
    }
}
