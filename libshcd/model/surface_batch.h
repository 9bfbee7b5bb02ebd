/* SPDX-License-Identifier: BSD-3-Clause */
/* Evaluation of many sums, body of a path: all degrees at one direction, and many directions with a
 * lane each. The end of surface_kernel.h, whose types it uses. */

/* ---- all partial sums: rows outside, so that every block has reached row l ---- */

#define BLOCKS_MAX (SHCD_DEGREE_MAX / 8 + 1)

/* What a strip carries from row to row: q, q1 and six sums. */
typedef struct running {
    vec q, q1, a[6];
} running;

INLINE void partial_row(running *r, const surface_rows *rows, int row, int lane, double z,
                        const power *now, vec sum[3]) {
    const double *c = rows->c + 48 * row + lane;
    const vec g = load(rows->gamma + 8 * row + lane);
    const vec back = row < 8 ? g * r->q1 - load(unit_row[row] + lane) : g * r->q1;
    const vec q = all(z) * r->q - back;
    r->q1 = r->q;
    r->q = q;
    UNROLL for (int k = 0; k < 6; k++) {
        r->a[k] += q * load(c + 8 * k);
    }
    UNROLL for (int k = 0; k < 3; k++) {
        sum[k] += r->a[k] * now->c + r->a[k + 3] * now->s;
    }
}

void NAME(partial)(const shcdi_series *series, double x, double y, double z, shcd_vec3 *out) {
    running state[BLOCKS_MAX][STRIPS];
    power powers[BLOCKS_MAX][STRIPS], next[STRIPS];
    const power eighth = first_powers(x, y, next);
    for (int l = 0; l <= series->degree; l++) {
        vec sum[STRIPS][3];
        UNROLL for (int k = 0; k < 3 * STRIPS; k++) {
            sum[k / 3][k % 3] = all(0.0);
        }
        for (int b = 0; 8 * b <= l; b++) {
            const surface_rows rows = rows_of(series, b);
            UNROLL for (int h = 0; h < STRIPS; h++) {
                if (l == 8 * b) {
                    running *s = &state[b][h];
                    s->q = s->q1 = all(0.0);
                    UNROLL for (int k = 0; k < 6; k++) {
                        s->a[k] = all(0.0);
                    }
                    powers[b][h] = next[h];
                    next[h] = times(next[h], eighth);
                }
                if (l >= 8 * b + h * LANES) {
                    partial_row(&state[b][h], &rows, l - 8 * b, h * LANES, z, &powers[b][h],
                                sum[h]);
                }
            }
        }
        const vec4 total = totals(sum[0], 3);
        out[l] = to_vec3(&total);
    }
}

/* ---- a lane for each direction ---- */

typedef struct directions {
    vec x, y, z;
} directions;

/* Lanes beyond n repeat the last direction. */
INLINE directions directions_from(const shcd_vec3 *w, size_t n) {
    double x[LANES], y[LANES], z[LANES];
    for (size_t i = 0; i < LANES; i++) {
        const shcd_vec3 *from = w + (i < n ? i : n - 1);
        x[i] = from->x;
        y[i] = from->y;
        z[i] = from->z;
    }
    const directions d = {load(x), load(y), load(z)};
    return d;
}

/* Three coordinates of LANES points to their places. */
INLINE void directions_to(shcd_vec3 *out, size_t n, const vec v[3]) {
    for (size_t i = 0; i < LANES && i < n; i++) {
        out[i] = shcd_vec3_make(v[0][i], v[1][i], v[2][i]);
    }
}

/* zeta^0 .. zeta^7 with the operations of first_powers(), and zeta^8. */
INLINE void powers_of(const directions *d, power base[9]) {
    const power one = {d->x, d->y};
    const power two = {one.c * one.c - one.s * one.s, one.c * one.s + one.s * one.c};
    const power four = {two.c * two.c - two.s * two.s, two.c * two.s + two.s * two.c};
    base[8].c = four.c * four.c - four.s * four.s;
    base[8].s = four.c * four.s + four.s * four.c;
    for (int j = 0; j < 8; j++) {
        const double b0 = digit[0][j], b1 = digit[1][j], b2 = digit[2][j];
        const double n0 = no_digit[0][j], n1 = no_digit[1][j], n2 = no_digit[2][j];
        const power p1 = {all(b0) * one.c + all(n0), all(b0) * one.s};
        const power p2 = {all(b1) * two.c + all(n1), all(b1) * two.s};
        const power p4 = {all(b2) * four.c + all(n2), all(b2) * four.s};
        base[j] = times(times(p1, p2), p4);
    }
}

/* One row of one order: q of the row l - 1 becomes q of the row l. */
INLINE void column_step(vec *q, vec *q1, vec z, const double *gamma) {
    const vec back = all(*gamma) * *q1;
    const vec next = z * *q - back;
    *q1 = *q;
    *q = next;
}

INLINE void column_add(vec a[6], vec q, const double *c) {
    UNROLL for (int k = 0; k < 6; k++) {
        a[k] += q * all(c[8 * k]);
    }
}

/* Sums of order 8 block + lane, as in run_strip(). */
INLINE void run_column(vec a[6], const surface_rows *rows, int lane, int n_rows, vec z) {
    const double *g = rows->gamma + 8 * lane + lane, *c = rows->c + 48 * lane + lane;
    vec q = all(1.0), q1 = all(0.0);
    UNROLL for (int k = 0; k < 6; k++) {
        a[k] = all(0.0);
    }
    column_add(a, q, c);
    for (int i = lane + 1; i < n_rows; i++) {
        g += 8;
        c += 48;
        column_step(&q, &q1, z, g);
        column_add(a, q, c);
    }
}

INLINE void points_together(const shcdi_series *series, int degree, const directions *d,
                            vec out[3]) {
    power base[9];
    vec sum[8][3];
    powers_of(d, base);
    for (int j = 0; j < 8; j++) {
        sum[j][0] = sum[j][1] = sum[j][2] = all(0.0);
    }
    for (int b = 0; 8 * b <= degree; b++) {
        const surface_rows rows = rows_of(series, b);
        for (int j = 0; j < 8 && 8 * b + j <= degree; j++) {
            vec a[6];
            run_column(a, &rows, j, degree - 8 * b + 1, d->z);
            UNROLL for (int k = 0; k < 3; k++) {
                sum[j][k] += a[k] * base[j].c + a[k + 3] * base[j].s;
            }
            base[j] = times(base[j], base[8]);
        }
    }
    UNROLL for (int k = 0; k < 3; k++) {
        out[k] = ((sum[0][k] + sum[4][k]) + (sum[2][k] + sum[6][k])) +
                 ((sum[1][k] + sum[5][k]) + (sum[3][k] + sum[7][k]));
    }
}

void NAME(points)(const shcdi_series *series, int degree, const shcd_vec3 *w, size_t n,
                  shcd_vec3 *out) {
    for (size_t i = 0; i < n; i += LANES) {
        const directions d = directions_from(w + i, n - i);
        vec s[3];
        points_together(series, degree, &d, s);
        directions_to(out + i, n - i, s);
    }
}

/* ---- mirror images ----
 *
 * q_lm(-z) = (-1)^(l-m) q_lm(z); with x negated zeta^m becomes (-1)^m conj(zeta^m), with y negated
 * its conjugate. So with the sums of the terms apart by the parity of l - m, by that of m, and by
 * cosine or sine, eight images differ by signs only. The eight with x and y exchanged need a few
 * more sums. */

/* Sums of one order, l - m even: a[0..5], odd: a[6..11]. */
INLINE void run_column_by_parity(vec a[12], const surface_rows *rows, int lane, int n_rows, vec z) {
    const double *g = rows->gamma + 8 * lane + lane, *c = rows->c + 48 * lane + lane;
    vec q = all(1.0), q1 = all(0.0);
    int i = lane + 1;
    UNROLL for (int k = 0; k < 12; k++) {
        a[k] = all(0.0);
    }
    column_add(a, q, c);
    for (; i + 1 < n_rows; i += 2) {
        g += 16;
        c += 96;
        column_step(&q, &q1, z, g - 8);
        column_add(a + 6, q, c - 48);
        column_step(&q, &q1, z, g);
        column_add(a, q, c);
    }
    if (i < n_rows) {
        column_step(&q, &q1, z, g + 8);
        column_add(a + 6, q, c + 48);
    }
}

/* Group sums by parity of l - m (outer), then by the part of zeta^m that they are taken with; three
 * coordinates each. Exchanging x and y makes i conj(zeta) of zeta, hence i^m conj(zeta^m) of its
 * powers: cosine and sine of even m keep their places up to signs that depend on m mod 4, those of
 * odd m change places, up to the sign `turn`. */
enum group {
    EVEN_COS_0,
    EVEN_COS_2,
    EVEN_SIN_0,
    EVEN_SIN_2,
    ODD_COS,
    ODD_SIN,
    ODD_COS_X,
    ODD_SIN_X
};
typedef struct parities {
    vec sum[2][8][3];
} parities;

/* Orders m = first, first + 4, ... */
INLINE void sum_even(const shcdi_series *series, int first, power now, const power *fourth, vec z,
                     parities *p) {
    vec sum[2][2][3];
    UNROLL for (int i = 0; i < 12; i++) {
        sum[i / 6][i / 3 % 2][i % 3] = all(0.0);
    }
    for (int m = first; m <= series->degree; m += 4) {
        const surface_rows rows = rows_of(series, m / 8);
        vec a[12];
        run_column_by_parity(a, &rows, m % 8, series->degree - m / 8 * 8 + 1, z);
        UNROLL for (int i = 0; i < 12; i++) {
            sum[i / 6][i / 3 % 2][i % 3] += a[i] * (i / 3 % 2 == 0 ? now.c : now.s);
        }
        now = times(now, *fourth);
    }
    UNROLL for (int i = 0; i < 12; i++) {
        p->sum[i / 6][(i / 3 % 2 == 0 ? EVEN_COS_0 : EVEN_SIN_0) + first / 2][i % 3] =
            sum[i / 6][i / 3 % 2][i % 3];
    }
}

INLINE void sum_odd(const shcdi_series *series, power base[9], vec z, parities *p) {
    UNROLL for (int i = 0; i < 24; i++) {
        p->sum[i / 12][ODD_COS + i / 3 % 4][i % 3] = all(0.0);
    }
    for (int m = 1; m <= series->degree; m += 2) {
        const surface_rows rows = rows_of(series, m / 8);
        power *now = &base[m % 8];
        vec a[12];
        run_column_by_parity(a, &rows, m % 8, series->degree - m / 8 * 8 + 1, z);
        const vec turn = all(m % 4 == 1 ? 1.0 : -1.0);
        const vec other_c = turn * now->s, other_s = turn * now->c;
        UNROLL for (int e = 0; e < 2; e++) {
            vec(*sum)[3] = p->sum[e];
            const vec *c = a + 6 * e, *s = c + 3;
            UNROLL for (int k = 0; k < 3; k++) {
                sum[ODD_COS][k] += c[k] * now->c;
                sum[ODD_SIN][k] += s[k] * now->s;
                sum[ODD_COS_X][k] += c[k] * other_c;
                sum[ODD_SIN_X][k] += s[k] * other_s;
            }
        }
        *now = times(*now, base[8]);
    }
}

/* Signs: cosine of odd m by that of x, sine of even m by those of x and y, sine of odd m by that of
 * y, odd l - m by that of z. */
INLINE void images_of(const parities *p, int exchanged, vec image[8][3]) {
    UNROLL for (int k = 0; k < 3; k++) {
        vec part[2][4];
        UNROLL for (int e = 0; e < 2; e++) {
            const vec(*s)[3] = p->sum[e];
            const vec even_c = exchanged ? s[EVEN_COS_0][k] - s[EVEN_COS_2][k]
                                         : s[EVEN_COS_0][k] + s[EVEN_COS_2][k];
            const vec even_s = exchanged ? s[EVEN_SIN_2][k] - s[EVEN_SIN_0][k]
                                         : s[EVEN_SIN_2][k] + s[EVEN_SIN_0][k];
            const vec odd_c = s[exchanged ? ODD_COS_X : ODD_COS][k];
            const vec odd_s = s[exchanged ? ODD_SIN_X : ODD_SIN][k];
            const vec x0 = even_c + odd_c, x1 = even_c - odd_c;
            const vec y0 = odd_s + even_s, y1 = odd_s - even_s;
            part[e][0] = x0 + y0;
            part[e][1] = x1 + y1;
            part[e][2] = x0 - y0;
            part[e][3] = x1 - y1;
        }
        UNROLL for (int s = 0; s < 4; s++) {
            image[s][k] = part[0][s] + part[1][s];
            image[s + 4][k] = part[0][s] - part[1][s];
        }
    }
}

/* The sums that all images of LANES directions are made of. */
INLINE void sum_parities(const shcdi_series *series, const directions *d, parities *p) {
    power base[9];
    powers_of(d, base);
    sum_even(series, 0, base[0], &base[4], d->z, p);
    sum_even(series, 2, base[2], &base[4], d->z, p);
    sum_odd(series, base, d->z, p);
}

void NAME(images)(const shcdi_series *series, const shcd_vec3 *w, size_t n, shcd_vec3 *out) {
    for (size_t i = 0; i < n; i += LANES) {
        const directions d = directions_from(w + i, n - i);
        parities p;
        sum_parities(series, &d, &p);
        for (size_t x = 0; x < 2; x++) {
            vec image[8][3];
            images_of(&p, (int)x, image);
            UNROLL for (int s = 0; s < 8; s++) {
                directions_to(out + (8 * x + (size_t)s) * n + i, n - i, image[s]);
            }
        }
    }
}

typedef int32_t whole __attribute__((vector_size(4 * LANES)));

/* Conversion truncates: an error below 1. */
void NAME(lattice)(const shcdi_series *series, const shcdi_lattice *lattice, const shcd_vec3 *w,
                   size_t n, int32_t *out) {
    const vec factor = all(lattice->factor);
    const vec origin[3] = {all(lattice->origin.x), all(lattice->origin.y), all(lattice->origin.z)};
    for (size_t i = 0; i < n; i += LANES) {
        const directions d = directions_from(w + i, n - i);
        parities p;
        sum_parities(series, &d, &p);
        for (size_t x = 0; x < 2; x++) {
            vec image[8][3];
            images_of(&p, (int)x, image);
            UNROLL for (size_t s = 0; s < 8; s++) {
                UNROLL for (size_t k = 0; k < 3; k++) {
                    const whole to =
                        __builtin_convertvector((image[s][k] - origin[k]) * factor, whole);
                    memcpy(out + (16 * k + 8 * x + s) * lattice->stride + i, &to, sizeof to);
                }
            }
        }
    }
}
