/* SPDX-License-Identifier: BSD-3-Clause */
/* Time of one evaluation of a surface: point, point and first derivatives, the full jet, all
 * partial sums, and the refresh of an octahedral lattice of nodes by mirror images; by compiled
 * path, with GSL beside it (Legendre arrays, sines and cosines of m phi, sums for three
 * coordinates).
 *
 * Latency: the next direction depends on the last result. Methods take turns in short rounds;
 * printed is the median round and, in brackets, the fastest. Before timing, every method must give
 * the same point. usage: bench_evaluation [ROUNDS] */
#include "model/surface.h"

#include <errno.h>
#include <gsl/gsl_sf_legendre.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define DEGREE_MAX 50
#define LATTICE 32 /* edges on a side of an octant: the query tree's level 5 */
/* with x >= y */
#define N_WEDGE ((LATTICE / 2 + 1) * (LATTICE / 2 + 1))
#define ROUNDS_MAX 1001

enum { POINT, FIRST, JET, PARTIAL, IMAGES, N_KINDS };
enum { GSL = SHCD_SIMD_AVX512 + 1, N_METHODS };
static const char *const method_name[N_METHODS] = {"", "portable", "avx2", "avx512", "GSL"};

typedef struct bench {
    shcdi_series series;
    double *coefficients, *recurrence, *packed;
    double *p, *dp, *ddp, *trig; /* GSL's arrays; cosines, then sines */
    shcd_vec3 wedge[N_WEDGE], image[16 * N_WEDGE];
} bench;

static double now_ns(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static double *lines(size_t n) {
    double *memory = aligned_alloc(64, (n * sizeof *memory + 63) / 64 * 64);
    if (memory == NULL) {
        fprintf(stderr, "bench_evaluation: out of memory\n");
        exit(1);
    }
    return memory;
}

/* ---- GSL: sums over l and m of value, theta and phi derivatives, three coordinates each ---- */

static void gsl_sums(bench *b, shcd_vec3 w, int order, double sum[6][3]) {
    const int degree = b->series.degree;
    const double phi = atan2(w.y, w.x);
    double *cosine = b->trig, *sine = b->trig + DEGREE_MAX + 1;
    if (order == 0) {
        gsl_sf_legendre_array(GSL_SF_LEGENDRE_SPHARM, (size_t)degree, w.z, b->p);
    } else if (order == 1) {
        gsl_sf_legendre_deriv_alt_array(GSL_SF_LEGENDRE_SPHARM, (size_t)degree, w.z, b->p, b->dp);
    } else {
        gsl_sf_legendre_deriv2_alt_array(GSL_SF_LEGENDRE_SPHARM, (size_t)degree, w.z, b->p, b->dp,
                                         b->ddp);
    }
    for (int m = 0; m <= degree; m++) {
        cosine[m] = (m > 0 ? sqrt(2.0) : 1.0) * cos(m * phi);
        sine[m] = sqrt(2.0) * sin(m * phi);
    }
    memset(sum, 0, 6 * sizeof sum[0]);
    for (int l = 0; l <= degree; l++) {
        for (int m = 0; m <= l; m++) {
            const size_t i = gsl_sf_legendre_array_index((size_t)l, (size_t)m);
            const double *up = b->coefficients + 3 * SHCD_INDEX(l, m);
            const double *down = b->coefficients + 3 * SHCD_INDEX(l, -m);
            for (int k = 0; k < 3; k++) {
                const double s = m > 0 ? down[k] : 0.0;
                const double f = up[k] * cosine[m] + s * sine[m];
                sum[0][k] += b->p[i] * f;
                if (order > 0) {
                    const double g = m * (s * cosine[m] - up[k] * sine[m]);
                    sum[1][k] += b->dp[i] * f;
                    sum[2][k] += b->p[i] * g;
                    if (order > 1) {
                        sum[3][k] += b->ddp[i] * f;
                        sum[4][k] += b->dp[i] * g;
                        sum[5][k] -= b->p[i] * m * m * f;
                    }
                }
            }
        }
    }
}

/* ---- one call of one method; a number that depends on all of the result's parts ---- */

static double ask_gsl(bench *b, int kind, shcd_vec3 w) {
    double sum[6][3];
    if (kind == IMAGES) {
        for (size_t i = 0; i < 16 * N_WEDGE; i++) {
            const shcd_vec3 of = b->wedge[i % N_WEDGE];
            const size_t image = i / N_WEDGE;
            const shcd_vec3 v = image & 8 ? shcd_vec3_make(of.y, of.x, of.z) : of;
            gsl_sums(b,
                     shcd_vec3_make(image & 1 ? -v.x : v.x, image & 2 ? -v.y : v.y,
                                    image & 4 ? -v.z : v.z),
                     0, sum);
            b->image[i] = shcd_vec3_make(sum[0][0], sum[0][1], sum[0][2]);
        }
        return b->image[0].x;
    }
    gsl_sums(b, w, kind, sum);
    return sum[0][0] + (kind == POINT ? 0.0 : kind == FIRST ? sum[2][2] : sum[5][2]);
}

static double ask(bench *b, int method, int kind, shcd_vec3 w) {
    if (method == GSL) {
        return ask_gsl(b, kind, w);
    }
    shcdi_jet jet;
    shcd_vec3 sum[DEGREE_MAX + 1];
    b->series.simd = method;
    switch (kind) {
    case POINT: {
        const shcd_vec3 s = shcdi_surface_point(&b->series, b->series.degree, w);
        return s.x + s.z;
    }
    case FIRST:
        shcdi_surface_first(&b->series, b->series.degree, w, &jet);
        return jet.s.x + jet.s2.z;
    case JET:
        shcdi_surface_jet(&b->series, b->series.degree, w, &jet);
        return jet.s.x + jet.s22.z;
    case PARTIAL:
        shcdi_surface_partial(&b->series, w, sum);
        return sum[0].x + sum[b->series.degree].x;
    default:
        shcdi_surface_images(&b->series, b->wedge, N_WEDGE, b->image);
        return b->image[0].x;
    }
}

static int is_measured(int method, int kind) {
    return method == GSL ? kind != PARTIAL : shcdi_simd_choose(method) == method;
}

/* Nanoseconds of one call. */
static double time_round(bench *b, int method, int kind) {
    const int slow = method == GSL ? 4 : 1;
    const int n =
        kind == IMAGES ? 1 : 20000 / (20 + b->series.degree * b->series.degree) / slow + 1;
    shcd_vec3 w = {0.36, 0.48, 0.8};
    volatile double result;
    const double start = now_ns();
    for (int i = 0; i < n; i++) {
        const double v = ask(b, method, kind, w);
        w.x = 0.36 + 1e-15 * v;
        result = v;
    }
    (void)result;
    return (now_ns() - start) / n;
}

static int ascending(const void *a, const void *b) {
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void open_bench(bench *b, int degree) {
    const size_t n = 3 * SHCD_COUNT(degree);
    double *recurrence = b->recurrence, *packed = b->packed;
    uint64_t state = 1;
    for (size_t i = 0; i < n; i++) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        b->coefficients[i] = (double)(int64_t)state * 0x1p-63;
    }
    shcdi_recurrence_fill(degree, recurrence);
    shcdi_pack(degree, b->coefficients, packed);
    b->series = (shcdi_series){degree, recurrence, packed, SHCD_SIMD_PORTABLE};
}

static void check_agreement(bench *b) {
    const shcd_vec3 w = {0.36, 0.48, 0.8};
    const shcd_vec3 s = shcdi_surface_point(&b->series, b->series.degree, w);
    double sum[6][3];
    gsl_sums(b, w, 0, sum);
    const double off = fabs(s.x - sum[0][0]) + fabs(s.y - sum[0][1]) + fabs(s.z - sum[0][2]);
    if (!(off <= 1e-12 * b->series.degree * b->series.degree)) {
        fprintf(stderr, "bench_evaluation: GSL's point is off by %.3g at degree %d\n", off,
                b->series.degree);
        exit(1);
    }
}

static void measure(bench *b, int rounds) {
    static double ns[N_METHODS][N_KINDS][ROUNDS_MAX];
    for (int r = 0; r < rounds; r++) {
        for (int method = SHCD_SIMD_PORTABLE; method < N_METHODS; method++) {
            for (int kind = 0; kind < N_KINDS; kind++) {
                if (is_measured(method, kind)) {
                    ns[method][kind][r] = time_round(b, method, kind);
                }
            }
        }
    }
    for (int method = SHCD_SIMD_PORTABLE; method < N_METHODS; method++) {
        if (!is_measured(method, POINT)) {
            continue;
        }
        printf("%6d  %-8s", b->series.degree, method_name[method]);
        for (int kind = 0; kind < N_KINDS; kind++) {
            if (!is_measured(method, kind)) {
                printf("  %17s", "-");
                continue;
            }
            const double unit = kind == IMAGES ? 1e-3 : 1.0;
            double *v = ns[method][kind];
            qsort(v, (size_t)rounds, sizeof *v, ascending);
            printf("  %8.*f (%6.*f)", kind == IMAGES, v[rounds / 2] * unit, kind == IMAGES,
                   v[0] * unit);
        }
        printf("\n");
    }
}

static int rounds_from(int argc, char **argv) {
    char *end = NULL;
    errno = 0;
    const long rounds = argc == 2 ? strtol(argv[1], &end, 10) : 31;
    if (argc > 2 || errno != 0 || (end != NULL && (end == argv[1] || *end != '\0')) || rounds < 1 ||
        rounds > ROUNDS_MAX) {
        fprintf(stderr, "usage: bench_evaluation [ROUNDS], 1 .. %d\n", ROUNDS_MAX);
        exit(2);
    }
    return (int)rounds;
}

int main(int argc, char **argv) {
    static const int degree[] = {5, 10, 15, 30, DEGREE_MAX};
    static bench b;
    const int rounds = rounds_from(argc, argv);
    const size_t n = gsl_sf_legendre_array_n(DEGREE_MAX);
    b.coefficients = lines(3 * SHCD_COUNT(DEGREE_MAX));
    b.recurrence = lines(shcdi_recurrence_size(DEGREE_MAX));
    b.packed = lines(shcdi_packed_size(DEGREE_MAX));
    b.p = lines(n);
    b.dp = lines(n);
    b.ddp = lines(n);
    b.trig = lines(2 * (DEGREE_MAX + 1));
    for (int i = 0, at = 0; i <= LATTICE; i++) {
        for (int j = 0; j <= i && i + j <= LATTICE; j++) {
            b.wedge[at++] = shcd_unit(shcd_vec3_make(i, j, LATTICE - i - j));
        }
    }
    printf(
        "ns, median of %d rounds (fastest); images: us for the 16 mirror images of %d directions\n",
        rounds, N_WEDGE);
    printf("%6s  %-8s  %17s  %17s  %17s  %17s  %17s\n", "degree", "path", "point", "and first",
           "jet", "partial sums", "images [us]");
    for (size_t d = 0; d < sizeof degree / sizeof degree[0]; d++) {
        open_bench(&b, degree[d]);
        check_agreement(&b);
        measure(&b, rounds);
    }
    double *memory[7] = {b.coefficients, b.recurrence, b.packed, b.p, b.dp, b.ddp, b.trig};
    for (int i = 0; i < 7; i++) {
        free(memory[i]);
    }
    return 0;
}
