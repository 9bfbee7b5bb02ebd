/* SPDX-License-Identifier: BSD-3-Clause */
/* Rows of a strip: LANES consecutive orders m advance together along l. Included by
 * surface_kernel.h once for each number of lanes that a path needs; names end in that number.
 *
 * A lane does the same IEEE operations in the same order whatever LANES is, so every path gives the
 * same bits. Lanes with m > l are zero until the start term sets q_mm = 1. */
#define PASTE_(a, b) a##b
#define PASTE(a, b) PASTE_(a, b)
#define N(name) PASTE(name, LANES)

typedef double N(vec) __attribute__((vector_size(8 * LANES)));
typedef double N(unaligned) __attribute__((vector_size(8 * LANES), aligned(8), may_alias));

/* q_lm at l and l - 1, their z-derivatives p, and the sums: a[6 j + k], j = 0 of q c, j = 1 of p c,
 * j = 2 of -l(l+1) q c; k = cosine x, y, z, then sine. */
typedef struct N(strip) {
    N(vec) q, q1, p, p1, a[18];
} N(strip);

INLINE N(vec) N(load)(const double *from) {
    return *(const N(unaligned) *)from;
}
INLINE N(vec) N(all)(double v) {
#if LANES == 8
    const N(vec) same = {v, v, v, v, v, v, v, v};
#elif LANES == 4
    const N(vec) same = {v, v, v, v};
#else
    const N(vec) same = {v, v};
#endif
    return same;
}

INLINE void N(strip_clear)(N(strip) * s) {
    const N(vec) zero = N(all)(0.0);
    s->q = s->q1 = s->p = s->p1 = zero;
    UNROLL for (int k = 0; k < 18; k++) {
        s->a[k] = zero;
    }
}

/* One row; `start` is the unit vector of the lane with m == l, NULL where there is none. */
INLINE void N(strip_row)(N(strip) * s, const double *gamma, const double *c, const double *lambda,
                         const double *start, N(vec) z, int families) {
    const N(vec) g = N(load)(gamma);
    const N(vec) back = start != NULL ? g * s->q1 - N(load)(start) : g * s->q1;
    const N(vec) q = z * s->q - back;
    if (families > 1) {
        const N(vec) p = z * s->p - (g * s->p1 - s->q);
        s->p1 = s->p;
        s->p = p;
    }
    s->q1 = s->q;
    s->q = q;
    const N(vec) weighted = families > 2 ? q * N(all)(*lambda) : q;
    UNROLL for (int k = 0; k < 6; k++) {
        N(vec) ck = N(load)(c + 8 * k);
        if (families > 1) {
            IN_REGISTER(ck);
        }
        s->a[k] += q * ck;
        if (families > 1) {
            s->a[6 + k] += s->p * ck;
        }
        if (families > 2) {
            s->a[12 + k] += weighted * ck;
        }
    }
}

/* Rows first .. end - 1 of a block's table, of which row i has the start term of lane i < 8. */
INLINE void N(strip_rows)(N(strip) * s, const surface_rows *rows, int lane, int first, int end,
                          N(vec) z, int families) {
    const double *g = rows->gamma + 8 * first + lane, *c = rows->c + 48 * first + lane;
    const double *lambda = rows->lambda + first;
    int i = first;
    for (; i < end && i < lane + LANES; i++, g += 8, c += 48, lambda++) {
        N(strip_row)(s, g, c, lambda, unit_row[i] + lane, z, families);
    }
    for (; i < end; i++, g += 8, c += 48, lambda++) {
        N(strip_row)(s, g, c, lambda, NULL, z, families);
    }
}

#undef N
