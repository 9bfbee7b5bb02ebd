/* SPDX-License-Identifier: BSD-3-Clause */
/* How large derivatives along great circles can get, between samples too.
 *
 * Let T_k(w, a) = (a . D)^k S at w be the k-th derivative of S along the great circle through w
 * with axis a (great_circles.c), M_k = sup |T_k| over all w and all unit a orthogonal to w. Take a
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
 * At a node m_1 is a singular value, and T_k(w, .) a vector-valued trigonometric polynomial of
 * degree k in the angle of a, so m_k is at most the maximum over n equal steps of pi, divided by
 * cos(k pi/(2 n)). Its square has few coefficients, of even degrees only; since it is nowhere
 * negative and its maximum over the steps no less than its mean, at least half the sum of the
 * squared columns, summing it up errs by no more than some roundings of the maximum.
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

#include "model/great_circles.h"

#include <string.h>

#define PI 3.14159265358979324
#define AXES 16
#define LANES SHCDI_CIRCLE_LANES
/* Neighbours on a ring whose common extremes are kept, too; divides its number of nodes. */
#define GROUP 4
/* of a node: the suprema, and the infimum of the first order */
#define SAMPLES (SHCDI_SUPREMA + 1)
#define PRODUCT 3
#define LEAST SHCDI_SUPREMA
/* Outward rounding: evaluation and sums here err below 1e-11 relative to M_k up to degree 150. */
#define ROUNDING 1e-11
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

/* ---- nodes ---- */

typedef double lanes[LANES];

static double dot(shcdi_circle_values v, int a, int b, int i) {
    return v[a][i] * v[b][i] + v[a + 1][i] * v[b + 1][i] + v[a + 2][i] * v[b + 2][i];
}

/* Largest and smallest |U cos(alpha) + V sin(alpha)|: the singular values of (U, V). The smaller is
 * their product over the larger: without the cancellation of a difference. */
static void first_order(shcdi_circle_values v, lanes largest, lanes least) {
    const int u0 = SHCDI_CIRCLE_U, v0 = SHCDI_CIRCLE_V;
    for (int i = 0; i < LANES; i++) {
        const double uu = dot(v, u0, u0, i), vv = dot(v, v0, v0, i), uv = dot(v, u0, v0, i);
        const double half = 0.5 * (uu - vv);
        const double larger = sqrt(0.5 * (uu + vv) + sqrt(half * half + uv * uv));
        const double x = v[u0 + 1][i] * v[v0 + 2][i] - v[u0 + 2][i] * v[v0 + 1][i];
        const double y = v[u0 + 2][i] * v[v0][i] - v[u0][i] * v[v0 + 2][i];
        const double z = v[u0][i] * v[v0 + 1][i] - v[u0 + 1][i] * v[v0][i];
        largest[i] = larger;
        least[i] = sqrt(x * x + y * y + z * z) / shcdi_max(larger, 1e-300);
    }
}

/* Of a trigonometric polynomial: the mean, then cosine and sine coefficients by turns. */
#define TERMS 7

/* |S''|^2 in terms of beta = 2 alpha. */
static void second_order(shcdi_circle_values v, lanes f[TERMS]) {
    const int x = SHCDI_CIRCLE_X, y = SHCDI_CIRCLE_Y, z = SHCDI_CIRCLE_Z;
    for (int i = 0; i < LANES; i++) {
        const double xx = dot(v, x, x, i), yy = dot(v, y, y, i);
        f[0][i] = dot(v, z, z, i) + 0.5 * (xx + yy);
        f[1][i] = 2.0 * dot(v, z, x, i);
        f[2][i] = 2.0 * dot(v, z, y, i);
        f[3][i] = 0.5 * (xx - yy);
        f[4][i] = dot(v, x, y, i);
        f[5][i] = f[6][i] = 0.0;
    }
}

/* |S'''|^2 in terms of beta = 2 alpha. */
static void third_order(shcdi_circle_values v, lanes f[TERMS]) {
    const int p = SHCDI_CIRCLE_P, q = SHCDI_CIRCLE_Q, c = SHCDI_CIRCLE_C, d = SHCDI_CIRCLE_D;
    for (int i = 0; i < LANES; i++) {
        const double pp = dot(v, p, p, i), qq = dot(v, q, q, i);
        const double cc = dot(v, c, c, i), dd = dot(v, d, d, i);
        const double pc = dot(v, p, c, i), pd = dot(v, p, d, i);
        const double qc = dot(v, q, c, i), qd = dot(v, q, d, i);
        f[0][i] = 0.5 * (pp + qq + cc + dd);
        f[1][i] = 0.5 * (pp - qq) + pc + qd;
        f[2][i] = dot(v, p, q, i) + pd - qc;
        f[3][i] = pc - qd;
        f[4][i] = pd + qc;
        f[5][i] = 0.5 * (cc - dd);
        f[6][i] = dot(v, c, d, i);
    }
}

/* S'.S'': coefficients of cos and sin of alpha, then of 3 alpha. */
static void product(shcdi_circle_values v, lanes f[4]) {
    const int p = SHCDI_CIRCLE_U, q = SHCDI_CIRCLE_V;
    const int x = SHCDI_CIRCLE_X, y = SHCDI_CIRCLE_Y, z = SHCDI_CIRCLE_Z;
    for (int i = 0; i < LANES; i++) {
        const double px = dot(v, p, x, i), py = dot(v, p, y, i);
        const double qx = dot(v, q, x, i), qy = dot(v, q, y, i);
        f[0][i] = dot(v, p, z, i) + 0.5 * (px + qy);
        f[1][i] = dot(v, q, z, i) + 0.5 * (py - qx);
        f[2][i] = 0.5 * (px - qy);
        f[3][i] = 0.5 * (py + qx);
    }
}

/* cos(n pi/AXES) over two periods: the sine is three quarters of one ahead. */
typedef struct axis_table {
    double cosine[4 * AXES];
} axis_table;

static double cosine_of(const axis_table *t, int n) {
    return t->cosine[n % (2 * AXES)];
}

static double sine_of(const axis_table *t, int n) {
    return t->cosine[n % (2 * AXES) + 3 * AXES / 2];
}

/* Root of the maximum over the axes; beta and its mirror images in both axes go together. */
static void largest_root(const axis_table *t, lanes f[TERMS], lanes largest) {
    lanes square = {0.0};
    for (int n = 0; n <= AXES / 4; n++) {
        const double c1 = cosine_of(t, 2 * n), c2 = cosine_of(t, 4 * n), c3 = cosine_of(t, 6 * n);
        const double s1 = sine_of(t, 2 * n), s2 = sine_of(t, 4 * n), s3 = sine_of(t, 6 * n);
        for (int i = 0; i < LANES; i++) {
            const double mean = f[0][i] + f[3][i] * c2, cosines = f[1][i] * c1 + f[5][i] * c3;
            const double sines = f[2][i] * s1 + f[6][i] * s3, twice = f[4][i] * s2;
            const double right = mean + cosines + fabs(sines + twice);
            const double left = mean - cosines + fabs(sines - twice);
            square[i] = shcdi_max(square[i], shcdi_max(right, left));
        }
    }
    for (int i = 0; i < LANES; i++) {
        largest[i] = sqrt(square[i]);
    }
}

/* Maximum over the axes of the size; alpha and pi - alpha go together. */
static void largest_size(const axis_table *t, lanes f[4], lanes largest) {
    memset(largest, 0, sizeof(lanes));
    for (int n = 0; n <= AXES / 2; n++) {
        const double c1 = cosine_of(t, n), s1 = sine_of(t, n);
        const double c3 = cosine_of(t, 3 * n), s3 = sine_of(t, 3 * n);
        for (int i = 0; i < LANES; i++) {
            const double size =
                fabs(f[0][i] * c1 + f[2][i] * c3) + fabs(f[1][i] * s1 + f[3][i] * s3);
            largest[i] = shcdi_max(largest[i], size);
        }
    }
}

/* Suprema over the axes of the three orders and the product; then the infimum of the first. */
static void node_suprema(const axis_table *t, shcdi_circle_values v, lanes sup[SAMPLES]) {
    lanes f[TERMS];
    first_order(v, sup[0], sup[LEAST]);
    second_order(v, f);
    largest_root(t, f, sup[1]);
    third_order(v, f);
    largest_root(t, f, sup[2]);
    product(v, f);
    largest_size(t, f, sup[PRODUCT]);
    static const int order[SHCDI_SUPREMA] = {0, 2, 3, 3};
    for (int k = 0; k < SHCDI_SUPREMA; k++) {
        const double factor = OUTWARD / cos(order[k] * PI / (2.0 * AXES));
        for (int i = 0; i < LANES; i++) {
            sup[k][i] *= factor;
        }
    }
}

static void include(const float sample[SAMPLES], float extreme[SAMPLES]) {
    for (int c = 0; c < SHCDI_SUPREMA; c++) {
        extreme[c] = sample[c] > extreme[c] ? sample[c] : extreme[c];
    }
    extreme[LEAST] = sample[LEAST] < extreme[LEAST] ? sample[LEAST] : extreme[LEAST];
}

/* Node of the ring that image `n` of the quarter's k-th is: k, half - k, half + k, -k. */
static size_t image_of(const shcdi_bounds *b, int n, size_t k) {
    const size_t half = b->n_phi / 2;
    const size_t at = n == 0 ? k : n == 1 ? half - k : n == 2 ? half + k : b->n_phi - k;
    return at % b->n_phi;
}

/* Keeps a lane of suprema as the k-th node of a ring. */
static void keep_node(shcdi_bounds *b, size_t j, size_t k, lanes sup[SAMPLES], size_t lane) {
    float *sample = b->sample + SAMPLES * (j * b->n_phi + k);
    for (int c = 0; c < SHCDI_SUPREMA; c++) {
        sample[c] = (float)(sup[c][lane] * (1.0 + 0x1p-23));
        b->sup[c] = shcdi_max(b->sup[c], sup[c][lane]);
    }
    sample[LEAST] = (float)(sup[LEAST][lane] * (1.0 - 0x1p-23));
}

static void sample_ring(shcdi_bounds *b, size_t j, const axis_table *t,
                        const shcdi_great_circles *circles) {
    shcdi_circle_values image[SHCDI_CIRCLE_IMAGES];
    lanes sup[SAMPLES];
    for (size_t block = 0; block < circles->n_blocks; block++) {
        shcdi_great_circles_block(circles, block, image);
        for (int n = 0; n < SHCDI_CIRCLE_IMAGES; n++) {
            node_suprema(t, image[n], sup);
            for (size_t i = 0; i < LANES && block * LANES + i <= b->n_phi / 4; i++) {
                keep_node(b, j, image_of(b, n, block * LANES + i), sup, i);
            }
        }
    }
    for (size_t k = 0; k < b->n_phi; k++) {
        float *group = b->group + SAMPLES * ((j * b->n_phi + k) / GROUP);
        const float *sample = b->sample + SAMPLES * (j * b->n_phi + k);
        if (k % GROUP == 0) {
            memcpy(group, sample, SAMPLES * sizeof *group);
        } else {
            include(sample, group);
        }
    }
}

/* Degree of the trigonometric polynomial behind a supremum; its value at half pi bounds nothing. */
static double rate(int degree, int k) {
    return k == PRODUCT ? 2.0 * degree : degree;
}

static void sample_all(shcdi_bounds *b, shcdi_great_circles *circles) {
    axis_table t;
    for (int n = 0; n < 4 * AXES; n++) {
        t.cosine[n] = cos(n * PI / AXES);
    }
    for (size_t j = 0; j < b->n_theta; j++) {
        const double theta = ((double)j + 0.5) * PI / (double)b->n_theta;
        b->ring[2 * j] = cos(theta);
        b->ring[2 * j + 1] = sin(theta);
        shcdi_great_circles_ring(circles, theta);
        sample_ring(b, j, &t, circles);
    }
    for (int k = 0; k < SHCDI_SUPREMA; k++) {
        const double wave = rate(b->degree, k) * b->covering;
        b->sup[k] = wave < 1.5 ? b->sup[k] * OUTWARD / cos(wave) : HUGE_VAL;
    }
    b->sup[PRODUCT] = shcdi_min(b->sup[PRODUCT], b->sup[0] * b->sup[1]);
}

shcd_status shcdi_bounds_create(int degree, const double *coefficients,
                                const shcd_allocator *allocator, shcdi_bounds *bounds) {
    shcdi_bounds b = {.degree = degree, .n_theta = (grid_size(degree) + 1) & ~(size_t)1};
    b.n_phi = 2 * b.n_theta;
    b.covering = shcdi_grid_covering(b.n_theta);
    const size_t doubles = shcdi_great_circles_size(degree, b.n_phi);
    double *work = allocator->allocate(doubles * sizeof *work, allocator->user);
    const size_t n_nodes = b.n_theta * b.n_phi, n_groups = n_nodes / GROUP;
    b.ring = allocator->allocate(2 * b.n_theta * sizeof *b.ring, allocator->user);
    b.sample =
        allocator->allocate(SAMPLES * (n_nodes + n_groups) * sizeof *b.sample, allocator->user);
    shcd_status status = SHCD_ERR_MEMORY;
    if (work != NULL && b.ring != NULL && b.sample != NULL) {
        b.group = b.sample + SAMPLES * n_nodes;
        shcdi_great_circles circles;
        shcdi_great_circles_init(&circles, degree, coefficients, b.n_phi, work);
        sample_all(&b, &circles);
        status = SHCD_OK;
    }
    if (work != NULL) {
        allocator->release(work, allocator->user);
    }
    if (status != SHCD_OK) {
        shcdi_bounds_free(&b, allocator);
        return status;
    }
    *bounds = b;
    return SHCD_OK;
}

void shcdi_bounds_free(shcdi_bounds *bounds, const shcd_allocator *allocator) {
    if (bounds->ring != NULL) {
        allocator->release(bounds->ring, allocator->user);
    }
    if (bounds->sample != NULL) {
        allocator->release(bounds->sample, allocator->user);
    }
    bounds->ring = NULL;
    bounds->sample = bounds->group = NULL;
}

/* Raises extreme[0 .. LEAST) and lowers extreme[LEAST] by the samples of one ring within the angle;
 * phi_c is the azimuth of the centre. */
static void ring_extremes(const shcdi_bounds *b, size_t j, const double centre[2], double phi_c,
                          double cosine_angle, float extreme[SAMPLES]) {
    const double step = 2.0 * PI / (double)b->n_phi;
    const double across = b->ring[2 * j + 1] * centre[1];
    const double cosine = cosine_angle - b->ring[2 * j] * centre[0];
    double half = PI;
    if (cosine > across) {
        return;
    }
    if (cosine > -across) {
        half = acos(cosine / across);
    }
    /* one node more on each side: rounding must not lose the node that covers the border */
    const long n = (long)b->n_phi;
    const long first = (long)floor((phi_c - half) / step) - 1;
    const long last = (long)ceil((phi_c + half) / step) + 1;
    long left = last - first + 1 < n ? last - first + 1 : n;
    size_t k = (size_t)(((first % n) + n) % n);
    const float *sample = b->sample + SAMPLES * j * b->n_phi;
    const float *group = b->group + SAMPLES * j * (b->n_phi / GROUP);
    while (left > 0) {
        const int whole = k % GROUP == 0 && left >= GROUP;
        include(whole ? group + SAMPLES * (k / GROUP) : sample + SAMPLES * k, extreme);
        left -= whole ? GROUP : 1;
        k += whole ? GROUP : 1;
        k = k == b->n_phi ? 0 : k;
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
    const double at_centre[2] = {cos(theta_c), sin(theta_c)}, cosine = cos(reach);
    float extreme[SAMPLES] = {0.0F, 0.0F, 0.0F, 0.0F, HUGE_VALF};
    for (size_t j = first; j <= last; j++) {
        ring_extremes(bounds, j, at_centre, phi_c, cosine, extreme);
    }
    for (int k = 0; k < SHCDI_SUPREMA; k++) {
        const double all = bounds->sup[k];
        if (!(all > 0.0)) {
            sup[k] = 0.0;
            continue;
        }
        const double at = asin(shcdi_min(1.0, (double)extreme[k] / all)) +
                          rate(bounds->degree, k) * bounds->covering;
        sup[k] = all * (at < 0.5 * PI ? sin(at) : 1.0) * OUTWARD;
    }
    sup[PRODUCT] = shcdi_min(sup[PRODUCT], sup[0] * sup[1]);
    if (least != NULL) {
        /* any point of the cap lies within the covering angle of one of these nodes, and so does
         * the way there: sup[1] holds along it, by the first inequality from that node */
        *least = shcdi_max(0.0, (double)extreme[LEAST] - bounds->covering * sup[1] * OUTWARD -
                                    ROUNDING * bounds->sup[0]);
    }
}
