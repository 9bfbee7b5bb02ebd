/* SPDX-License-Identifier: BSD-3-Clause */
/* How large derivatives along great circles can get, between samples too.
 *
 * Let T_k(w, a) = (a . D)^k S at w be the k-th derivative of S along the great circle through w
 * with axis a (generators.c), M_k = sup |T_k| over all w and all unit a orthogonal to w. Take a
 * point w' and an axis a', and a node w within angle s of w'. Rotate both along the great circle
 * from w to w': with R(t) that rotation, F(t) = T_k(R(t) w, R(t) a) is the k-th derivative at a
 * *fixed* place of the series S o R(t), whose coefficients are trigonometric polynomials of degree
 * L in t. So for any unit vector e, e . F is a real trigonometric polynomial of degree <= L with |e
 * . F| <= M_k, and the Bernstein-Szegoe inequality (e.F)'^2 + L^2 (e.F)^2 <= L^2 M_k^2 bounds the
 * slope of arcsin(e.F/M_k) by L:
 *
 *   |T_k(w', a')| <= M_k sin(min(pi/2, arcsin(m_k(w)/M_k) + L s)),  m_k(w) = sup_a |T_k(w, a)|,
 *   M_k <= max over nodes of m_k / cos(L delta),  delta the covering angle of the nodes, L delta <
 * pi/2.
 *
 * (Second line: at the point where M_k is attained the same inequality gives F(s) >= M_k cos(L s).)
 * At a node T_k(w, .) is a vector-valued trigonometric polynomial of degree k in the angle of a, so
 * its supremum is at most the maximum over n equal steps of pi, divided by cos(k pi/(2 n)).
 *
 * The product T_1.T_2 = S'.S'', half the slope of |S'|^2, is a trigonometric polynomial of degree 2
 * L in t and obeys the same with 2 L; in the angle of a it is of degree 3.
 *
 * The infimum of |S'| (the smallest singular value of the derivative) has no such bound; but from a
 * node w to w' within angle s the derivative, its directions transported along the great circle,
 * changes by the covariant second derivative, a symmetric bilinear form whose values at pairs of
 * unit vectors are bounded by those at equal ones: it falls by at most s M_2.
 *
 * Source of the inequality: Boas, Entire Functions, Academic Press (1954), chapter 11.
 */
#include "model/bounds.h"

#include "base/harmonics.h"
#include "model/generators.h"

#include <string.h>

#define PI 3.14159265358979324
#define AXES 16
/* columns: 3 first, 6 second, 10 third derivatives, each with three coordinates */
#define FIRST 0
#define SECOND 9
#define THIRD 27
#define COLUMNS 57
/* of a node: the suprema, and the infimum of the first order */
#define SAMPLES (SHCDI_SUPREMA + 1)
#define PRODUCT 3
#define LEAST SHCDI_SUPREMA
/* Outward rounding: evaluation and sums here err below 1e-11 relative to M_k up to degree 150. */
#define OUTWARD (1.0 + 1e-9)

double shcdi_grid_covering(size_t n_theta) {
    /* haversine with |dtheta| <= step/2 and |dphi| <= step/2 */
    const double step = PI / (double)n_theta;
    return 2.0 * asin(1.41421356237309515 * sin(0.25 * step));
}

static size_t grid_size(int degree) {
    /* L delta of about 0.075: what is added between samples falls with it, and with that the work
     * of every query. Beyond degree 24 coarser (0.3 at 54, 0.83 at 150), to bound the time. */
    const double wanted = ceil(degree * PI / (1.414 * 0.075));
    const double limit = degree <= 24 ? 720.0 : 400.0;
    return wanted < 24.0 ? 24 : wanted > limit ? (size_t)limit : (size_t)wanted;
}

/* ---- the series of all derivatives ---- */

typedef struct series_set {
    int degree;
    size_t count;
    double *column[COLUMNS]; /* count values each */
} series_set;

/* out += D_axis in, or out = */
static void apply(const series_set *s, int axis, const double *in, double *out, double *work,
                  int add) {
    double *image = work + 4 * s->count;
    shcdi_generator(s->degree, axis, in, image, work);
    for (size_t i = 0; i < s->count; i++) {
        out[i] = (add ? out[i] : 0.0) + image[i];
    }
}

static const int PAIR[6][2] = {{0, 0}, {0, 1}, {0, 2}, {1, 1}, {1, 2}, {2, 2}};
static const int TRIPLE[10][3] = {{0, 0, 0}, {0, 0, 1}, {0, 0, 2}, {0, 1, 1}, {0, 1, 2},
                                  {0, 2, 2}, {1, 1, 1}, {1, 1, 2}, {1, 2, 2}, {2, 2, 2}};

static int pair_index(int i, int j) {
    const int lo = i < j ? i : j, hi = i < j ? j : i;
    return lo == 0 ? hi : lo + hi + 1;
}

/* Symmetrised products: SECOND + pair (i, j) holds the sum over distinct orders of D_i D_j, so that
 * (a . D)^2 = sum over pairs of a_i a_j times it; likewise for triples, built from
 * sym(i, j, k) = sum over distinct choices of the first factor of D_first sym(the other two). */
static void fill_series(series_set *s, const double *coefficients, double *work) {
    double *f = work + 5 * s->count;
    for (int c = 0; c < 3; c++) {
        for (size_t i = 0; i < s->count; i++) {
            f[i] = coefficients[3 * i + (size_t)c];
        }
        for (int a = 0; a < 3; a++) {
            apply(s, a, f, s->column[FIRST + 3 * a + c], work, 0);
        }
        for (int p = 0; p < 6; p++) {
            const int i = PAIR[p][0], j = PAIR[p][1];
            double *out = s->column[SECOND + 3 * p + c];
            apply(s, i, s->column[FIRST + 3 * j + c], out, work, 0);
            if (i != j) {
                apply(s, j, s->column[FIRST + 3 * i + c], out, work, 1);
            }
        }
        for (int t = 0; t < 10; t++) {
            double *out = s->column[THIRD + 3 * t + c];
            int add = 0;
            for (int n = 0; n < 3; n++) {
                if (n > 0 && TRIPLE[t][n] == TRIPLE[t][n - 1]) {
                    continue;
                }
                const int rest = pair_index(TRIPLE[t][(n + 1) % 3], TRIPLE[t][(n + 2) % 3]);
                apply(s, TRIPLE[t][n], s->column[SECOND + 3 * rest + c], out, work, add);
                add = 1;
            }
        }
    }
}

/* ---- synthesis ring by ring ---- */

/* Sums over l for one ring: fourier[(2 m) COLUMNS + c] with cos(m phi), [(2 m + 1) ..] with sin. */
static void ring_fourier(const series_set *s, double theta, double *fourier) {
    const double z = cos(theta), sine = sin(theta);
    double q_mm = 0.28209479177387814;
    for (int m = 0; m <= s->degree; m++) {
        double *a = fourier + (size_t)(2 * m) * COLUMNS;
        double *b = a + COLUMNS;
        memset(a, 0, 2 * COLUMNS * sizeof *a);
        if (m > 0) {
            q_mm *= sine * shcdi_recurrence_diagonal(m);
        }
        double q = q_mm, q1 = 0.0;
        for (int l = m; l <= s->degree; l++) {
            if (l > m) {
                const double next =
                    shcdi_recurrence_a(l, m) * (z * q - shcdi_recurrence_b(l, m) * q1);
                q1 = q;
                q = next;
            }
            const size_t i = SHCD_INDEX(l, m), k = SHCD_INDEX(l, -m);
            for (int c = 0; c < COLUMNS; c++) {
                a[c] += q * s->column[c][i];
                b[c] += m > 0 ? q * s->column[c][k] : 0.0;
            }
        }
    }
}

static double norm3(const double v[3]) {
    return sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

/* Smallest singular value of the map a -> S' for axes a in the plane of t1 and t2. */
static double node_least(shcd_vec3 t1, shcd_vec3 t2, const double value[COLUMNS]) {
    const double *v = value + FIRST;
    const shcd_vec3 d1 = {t1.x * v[0] + t1.y * v[3] + t1.z * v[6],
                          t1.x * v[1] + t1.y * v[4] + t1.z * v[7],
                          t1.x * v[2] + t1.y * v[5] + t1.z * v[8]};
    const shcd_vec3 d2 = {t2.x * v[0] + t2.y * v[3] + t2.z * v[6],
                          t2.x * v[1] + t2.y * v[4] + t2.z * v[7],
                          t2.x * v[2] + t2.y * v[5] + t2.z * v[8]};
    const double mean = 0.5 * (shcd_dot(d1, d1) + shcd_dot(d2, d2));
    const double half = 0.5 * (shcd_dot(d1, d1) - shcd_dot(d2, d2)), mixed = shcd_dot(d1, d2);
    /* the product of the singular values over the larger: without the cancellation of a difference
     */
    const double larger = sqrt(mean + sqrt(half * half + mixed * mixed));
    return larger > 0.0 ? shcd_norm(shcd_cross(d1, d2)) / larger : 0.0;
}

/* Suprema over the axes orthogonal to w of the three orders, from the values of all columns there;
 * then the infimum of the first. */
static void node_suprema(shcd_vec3 w, const double value[COLUMNS], double sup[SAMPLES]) {
    shcd_vec3 t1, t2;
    shcdi_tangent_frame(w, &t1, &t2);
    sup[LEAST] = node_least(t1, t2, value) / OUTWARD;
    sup[0] = sup[1] = sup[2] = sup[PRODUCT] = 0.0;
    for (int n = 0; n < AXES; n++) {
        const double c = cos(PI * n / AXES), s = sin(PI * n / AXES);
        const double a[3] = {c * t1.x + s * t2.x, c * t1.y + s * t2.y, c * t1.z + s * t2.z};
        double d[3][3] = {{0}};
        for (int i = 0; i < 3; i++) {
            for (int k = 0; k < 3; k++) {
                d[0][k] += a[i] * value[FIRST + 3 * i + k];
            }
        }
        for (int p = 0; p < 6; p++) {
            const double weight = a[PAIR[p][0]] * a[PAIR[p][1]];
            for (int k = 0; k < 3; k++) {
                d[1][k] += weight * value[SECOND + 3 * p + k];
            }
        }
        for (int t = 0; t < 10; t++) {
            const double weight = a[TRIPLE[t][0]] * a[TRIPLE[t][1]] * a[TRIPLE[t][2]];
            for (int k = 0; k < 3; k++) {
                d[2][k] += weight * value[THIRD + 3 * t + k];
            }
        }
        for (int k = 0; k < 3; k++) {
            sup[k] = shcdi_max(sup[k], norm3(d[k]));
        }
        const double product = d[0][0] * d[1][0] + d[0][1] * d[1][1] + d[0][2] * d[1][2];
        sup[PRODUCT] = shcdi_max(sup[PRODUCT], fabs(product));
    }
    for (int k = 0; k < 3; k++) {
        sup[k] *= OUTWARD / cos((k + 1) * PI / (2.0 * AXES));
    }
    sup[PRODUCT] *= OUTWARD / cos(3.0 * PI / (2.0 * AXES));
}

static void sample_ring(shcdi_bounds *b, size_t j, const double *fourier, const double *cosine) {
    const double theta = ((double)j + 0.5) * PI / (double)b->n_theta;
    for (size_t k = 0; k < b->n_phi; k++) {
        double value[COLUMNS] = {0.0};
        for (int m = 0; m <= b->degree; m++) {
            /* sin(x) = cos(x - pi/2); n_phi is a multiple of 4 */
            const size_t at = ((size_t)m * k) % b->n_phi;
            const double c = cosine[at];
            const double s = cosine[(at + 3 * (b->n_phi / 4)) % b->n_phi];
            const double *f = fourier + (size_t)(2 * m) * COLUMNS;
            for (int n = 0; n < COLUMNS; n++) {
                value[n] += c * f[n] + s * f[n + COLUMNS];
            }
        }
        const double phi = 2.0 * PI * (double)k / (double)b->n_phi;
        const shcd_vec3 w = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
        double sup[SAMPLES];
        node_suprema(w, value, sup);
        float *sample = b->sample + SAMPLES * (j * b->n_phi + k);
        for (int n = 0; n < SHCDI_SUPREMA; n++) {
            sample[n] = (float)(sup[n] * (1.0 + 0x1p-23));
            b->sup[n] = shcdi_max(b->sup[n], sup[n]);
        }
        sample[LEAST] = (float)(sup[LEAST] * (1.0 - 0x1p-23));
    }
}

/* Degree of the trigonometric polynomial behind a supremum; its value at half pi bounds nothing. */
static double rate(int degree, int k) {
    return k == PRODUCT ? 2.0 * degree : degree;
}

shcd_status shcdi_bounds_create(int degree, const double *coefficients,
                                const shcd_allocator *allocator, shcdi_bounds *bounds) {
    const size_t count = SHCD_COUNT(degree);
    shcdi_bounds b = {.degree = degree, .n_theta = (grid_size(degree) + 1) & ~(size_t)1};
    b.n_phi = 2 * b.n_theta;
    b.covering = shcdi_grid_covering(b.n_theta);
    const size_t fourier_size = 2 * ((size_t)degree + 1) * COLUMNS;
    const size_t doubles = (COLUMNS + 6) * count + fourier_size + b.n_phi;
    double *work = allocator->allocate(doubles * sizeof *work, allocator->user);
    b.sample =
        allocator->allocate(SAMPLES * b.n_theta * b.n_phi * sizeof *b.sample, allocator->user);
    if (work == NULL || b.sample == NULL) {
        if (work != NULL) {
            allocator->release(work, allocator->user);
        }
        shcdi_bounds_free(&b, allocator);
        return SHCD_ERR_MEMORY;
    }
    series_set set = {degree, count, {NULL}};
    for (int c = 0; c < COLUMNS; c++) {
        set.column[c] = work + (size_t)c * count;
    }
    fill_series(&set, coefficients, work + COLUMNS * count);
    double *fourier = work + (COLUMNS + 6) * count;
    double *cosine = fourier + fourier_size;
    for (size_t k = 0; k < b.n_phi; k++) {
        cosine[k] = cos(2.0 * PI * (double)k / (double)b.n_phi);
    }
    for (size_t j = 0; j < b.n_theta; j++) {
        ring_fourier(&set, ((double)j + 0.5) * PI / (double)b.n_theta, fourier);
        sample_ring(&b, j, fourier, cosine);
    }
    for (int k = 0; k < SHCDI_SUPREMA; k++) {
        const double wave = rate(degree, k) * b.covering;
        b.sup[k] = wave < 1.5 ? b.sup[k] * OUTWARD / cos(wave) : HUGE_VAL;
    }
    b.sup[PRODUCT] = shcdi_min(b.sup[PRODUCT], b.sup[0] * b.sup[1]);
    allocator->release(work, allocator->user);
    *bounds = b;
    return SHCD_OK;
}

void shcdi_bounds_free(shcdi_bounds *bounds, const shcd_allocator *allocator) {
    if (bounds->sample != NULL) {
        allocator->release(bounds->sample, allocator->user);
        bounds->sample = NULL;
    }
}

/* Raises largest[0 .. LEAST) and lowers largest[LEAST] by the samples of one ring within the angle;
 * phi_c is the azimuth of the centre. */
static void ring_maximum(const shcdi_bounds *b, size_t j, double theta_c, double phi_c,
                         double angle, double largest[SAMPLES]) {
    const double theta = ((double)j + 0.5) * PI / (double)b->n_theta;
    const double step = 2.0 * PI / (double)b->n_phi;
    const double across = sin(theta) * sin(theta_c);
    const double cosine = cos(angle) - cos(theta) * cos(theta_c);
    double half = PI;
    if (cosine > across) {
        return;
    }
    if (cosine > -across) {
        half = acos(cosine / across);
    }
    /* one node more on each side: rounding must not lose the node that covers the border */
    const long first = (long)floor((phi_c - half) / step) - 1;
    const long last = (long)ceil((phi_c + half) / step) + 1;
    const long n = (long)b->n_phi;
    const long count = last - first + 1 < n ? last - first + 1 : n;
    for (long i = 0; i < count; i++) {
        const size_t k = (size_t)((((first + i) % n) + n) % n);
        const float *sample = b->sample + SAMPLES * (j * b->n_phi + k);
        for (size_t c = 0; c < SHCDI_SUPREMA; c++) {
            largest[c] = shcdi_max(largest[c], (double)sample[c]);
        }
        largest[LEAST] = shcdi_min(largest[LEAST], (double)sample[LEAST]);
    }
}

void shcdi_bounds_cap(const shcdi_bounds *bounds, shcd_vec3 centre, double angle,
                      double sup[SHCDI_SUPREMA], double *least) {
    const double theta_c = acos(shcdi_max(-1.0, shcdi_min(1.0, centre.z)));
    const double phi_c = atan2(centre.y, centre.x);
    const double reach = shcdi_min(PI, angle + bounds->covering);
    const double step = PI / (double)bounds->n_theta;
    const double low = floor((theta_c - reach) / step) - 1.0;
    const double high = ceil((theta_c + reach) / step) + 1.0;
    const size_t first = low > 0.0 ? (size_t)low : 0;
    const size_t last = high < (double)(bounds->n_theta - 1) ? (size_t)high : bounds->n_theta - 1;
    double largest[SAMPLES] = {0.0, 0.0, 0.0, 0.0, HUGE_VAL};
    for (size_t j = first; j <= last; j++) {
        ring_maximum(bounds, j, theta_c, phi_c, reach, largest);
    }
    for (int k = 0; k < SHCDI_SUPREMA; k++) {
        const double all = bounds->sup[k];
        if (!(all > 0.0)) {
            sup[k] = 0.0;
            continue;
        }
        const double at =
            asin(shcdi_min(1.0, largest[k] / all)) + rate(bounds->degree, k) * bounds->covering;
        sup[k] = all * (at < 0.5 * PI ? sin(at) : 1.0) * OUTWARD;
    }
    sup[PRODUCT] = shcdi_min(sup[PRODUCT], sup[0] * sup[1]);
    if (least != NULL) {
        /* any point of the cap lies within the covering angle of one of these nodes, and so does
         * the way there: sup[1] holds along it, by the first inequality from that node */
        *least = shcdi_max(0.0, largest[LEAST] - bounds->covering * sup[1] * OUTWARD);
    }
}
