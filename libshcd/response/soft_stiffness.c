/* SPDX-License-Identifier: BSD-3-Clause */
/* How stiff a membrane is to a press anywhere, in one tick and held for good.
 *
 * Under one contact at w the surface gives way by W(w) for each newton along the normal,
 *
 *     W(w) = W_res + g(w),   g = sum_k a_k (b_k phi_k(w))^2,
 *
 * a_k = c_k/(rho h) within a tick and 1/(omega_k^2 rho h) when it is held (soft_contact.c has the
 * first). g is a polynomial on the sphere of degree n = 2 L, so along each great circle a
 * trigonometric one between its extremes lo and hi. By M. Riesz (Jahresber. DMV 23, 1914) such a
 * one leaves an extreme no faster than the cosine of degree n: at an angle t from the lowest point
 *
 *     g <= lo + (hi - lo) s(t),   s(t) = (1 - cos n t)/2,   n t <= pi,
 *
 * and likewise below hi. On a grid that leaves no direction farther than t from one of its own,
 * with the smallest value m and the largest M on it, m - lo <= (hi - lo) s and hi - M <= (hi - lo)
 * s, so
 *
 *     lo >= m - (M - m) s/(1 - 2 s),   hi <= M + (M - m) s/(1 - 2 s).
 *
 * Other tools are walls to the membrane while they are held: of n contacts in all the compliance of
 * one is 1/(W^-1)_11, W = W_res I + V^T V with |V_i|^2 = g(w_i), the least of |V_1 - sum a_j V_j|^2
 * + W_res |a|^2, plus W_res. Since |sum a_j V_j|^2 <= (n - 1) hi |a|^2, that is at least
 *
 *     W_res + lo W_res/(W_res + (n - 1) hi),
 *
 * which n tools at one place reach where all places are equal.
 *
 * The grid has rows at the middles of bands of width h, and in each row as many directions that two
 * neighbours are no farther apart than h anywhere in the band. From any direction the nearest of
 * the row is within h/2 in latitude and pi/P in longitude, P >= 2 pi sin/h: by the haversines
 * sin^2(t/2) <= sin^2(h/4) + sin^2 (pi/(2 P))^2 <= h^2/8. */
#include "base/elementary.h"
#include "response/scene_private.h"

#define PI 3.14159265358979324
#define DT_MAX_S 0.1
/* n t, a compromise between the grid's size and what s leaves open: s/(1 - 2 s) = 0.15 */
#define STEP 0.7
#define BATCH 32
/* Values of g are sums of squares of sums over the harmonics, each rounded to 1e-13 of its size. */
#define ROUNDING 1e-12

/* Extremes on the grid, of the tick and of the held press. */
typedef struct extremes {
    double least[2], most[2];
} extremes;

static double one_tick(const shcdi_soft *soft, size_t k, double dt_s) {
    shcdi_propagator p;
    shcdi_propagator_set(&soft->mode[k], dt_s, &p);
    return p.forced_q_s2 / soft->mass_kg_per_m2;
}

/* 0 for a mode that nothing holds, which gives way for ever. */
static double held(const shcdi_soft *soft, size_t k) {
    const double w = soft->mode[k].omega_rad_per_s;
    return w > 0.0 ? 1.0 / (w * w * soft->mass_kg_per_m2) : 0.0;
}

static void look(const shcdi_soft *soft, const double *weight, const shcd_vec3 *w, size_t n,
                 extremes *e) {
    const int degree = shcd_model_degree(soft->model);
    shcdi_series series = soft->model->series;
    double sum[2][BATCH] = {{0.0}};
    shcd_vec3 value[BATCH];
    for (size_t g = 0; g < soft->n_groups; g++) {
        series.packed = soft->packed + g * soft->packed_size;
        shcdi_surface_points(&series, degree, w, n, value);
        for (size_t i = 0; i < n; i++) {
            const double v[3] = {value[i].x, value[i].y, value[i].z};
            for (size_t c = 0; c < 3 && 3 * g + c < soft->n_modes; c++) {
                const double *a = weight + 2 * (3 * g + c);
                sum[0][i] += a[0] * v[c] * v[c];
                sum[1][i] += a[1] * v[c] * v[c];
            }
        }
    }
    for (size_t i = 0; i < n; i++) {
        for (int c = 0; c < 2; c++) {
            e->least[c] = shcdi_min(e->least[c], sum[c][i]);
            e->most[c] = shcdi_max(e->most[c], sum[c][i]);
        }
    }
}

/* One row of the grid. */
static void look_along(const shcdi_soft *soft, const double *weight, double band, size_t row,
                       extremes *e) {
    double low, middle, high, cosine, unused;
    shcdi_sincos(band * (double)row, &low, &unused);
    shcdi_sincos(band * ((double)row + 1.0), &high, &unused);
    shcdi_sincos(band * ((double)row + 0.5), &middle, &cosine);
    const double widest = shcdi_max(middle, shcdi_max(low, high));
    const size_t count = (size_t)(2.0 * PI * widest / band) + 1;
    shcd_vec3 w[BATCH];
    for (size_t i = 0; i < count; i += BATCH) {
        const size_t n = count - i < BATCH ? count - i : BATCH;
        for (size_t k = 0; k < n; k++) {
            double s, c;
            shcdi_sincos(2.0 * PI * (double)(i + k) / (double)count, &s, &c);
            w[k] = shcd_unit(shcd_vec3_make(middle * c, middle * s, cosine));
        }
        look(soft, weight, w, n, e);
    }
}

/* sin(t/2) = x, in radians from above: asin x <= x (1 + x^2/5) up to 1/2. */
static double angle_above(double x) {
    return 2.0 * x * (1.0 + 0.2 * x * x);
}

static double stiffest(const shcdi_soft *soft, size_t n_contacts, double least, double most,
                       double share) {
    const double open = (most - least) * share / (1.0 - 2.0 * share) + ROUNDING * most;
    const double left = soft->residual_m_per_n;
    const double others = (double)(n_contacts - 1) * (most + open);
    return 1.0 /
           (left + shcdi_max(0.0, least - open) * (others > 0.0 ? left / (left + others) : 1.0));
}

shcd_status shcd_scene_wave_stiffness(const shcd_scene *scene, size_t body, double dt_s,
                                      double *tick_n_per_m, double *held_n_per_m) {
    double weight[2 * SHCD_MODES_MAX];
    extremes e = {{HUGE_VAL, HUGE_VAL}, {0.0, 0.0}};
    double sine, cosine;
    if (scene == NULL || body >= scene->n_bodies || tick_n_per_m == NULL || held_n_per_m == NULL ||
        !(dt_s > 0.0) || !(dt_s <= DT_MAX_S)) {
        return SHCD_ERR_ARGUMENT;
    }
    const shcdi_soft *soft = scene->bodies[body].soft;
    if (soft == NULL) {
        return SHCD_ERR_UNSUPPORTED;
    }
    bool is_held = true;
    for (size_t k = 0; k < soft->n_modes; k++) {
        is_held = is_held && soft->mode[k].omega_rad_per_s > 0.0;
        weight[2 * k] = one_tick(soft, k, dt_s);
        weight[2 * k + 1] = held(soft, k);
    }
    const double n = 2.0 * shcd_model_degree(soft->model);
    /* t = STEP/n, or less by what rounding up the number of rows makes */
    const size_t n_rows = (size_t)(PI * n / (STEP * 1.41)) + 1;
    const double band = PI / (double)n_rows;
    for (size_t row = 0; row < n_rows; row++) {
        look_along(soft, weight, band, row, &e);
    }
    shcdi_sincos(n * angle_above(band * 0.35355339059327379), &sine, &cosine); /* h/sqrt(8) */
    const double share = 0.5 * (1.0 - cosine);
    *tick_n_per_m = stiffest(soft, scene->n_tools, e.least[0], e.most[0], share);
    *held_n_per_m = !is_held ? 0.0 : stiffest(soft, scene->n_tools, e.least[1], e.most[1], share);
    return SHCD_OK;
}
