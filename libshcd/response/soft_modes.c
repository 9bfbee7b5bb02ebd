/* SPDX-License-Identifier: BSD-3-Clause */
/* The modes over a tick, and the surface that they make. */
#include "response/modal.h"
#include "response/scene_private.h"

#include "base/elementary.h"

#include <string.h>

/* Below this energy [J] a body without contact is put to rest: under the softest foundation of the
 * parameters' range that matters, 1 N/m, it is a displacement of a nanometre. */
#define REST_J 1e-18

#define PI 3.14159265358979324

static shcd_vec3 q_of(const shcdi_soft *soft, const shcdi_soft_parts *p, size_t k) {
    return shcd_scale(soft->q_of_x[k], p->x[k]);
}

static shcd_vec3 v_of(const shcdi_soft *soft, const shcdi_soft_parts *p, size_t k) {
    const shcdi_mode *mode = &soft->mode[k];
    return mode->is_turn ? shcd_mul_add(p->y[k], -mode->decay_per_s, q_of(soft, p, k)) : p->y[k];
}

static void set_tick(const shcdi_soft *soft, shcdi_soft_parts *p, double dt_s) {
    for (size_t k = 0; k < soft->n_modes; k++) {
        shcdi_propagator_set(&soft->mode[k], dt_s, &p->propagator[k]);
    }
    p->head->dt_s = dt_s;
}

static void propagate(const shcdi_soft *soft, shcdi_soft_parts *p) {
    for (size_t k = 0; k < soft->n_modes; k++) {
        const shcdi_mode *mode = &soft->mode[k];
        const shcdi_propagator *step = &p->propagator[k];
        shcdi_propagate(mode, step, &p->x[k].x, &p->y[k].x);
        shcdi_propagate(mode, step, &p->x[k].y, &p->y[k].y);
        shcdi_propagate(mode, step, &p->x[k].z, &p->y[k].z);
    }
}

void shcdi_soft_push(const shcdi_soft_parts *p, size_t k, shcd_vec3 acceleration) {
    p->x[k] = shcd_mul_add(p->x[k], p->propagator[k].forced_x, acceleration);
    p->y[k] = shcd_mul_add(p->y[k], p->propagator[k].forced_y, acceleration);
}

/* ---- pulse ---------------------------------------------------------------------------------- */

/* sin^2 over the share of the period in which it drives, at the middle of the tick */
static double waveform(const shcdi_soft *soft, double phase) {
    double sine, cosine;
    if (phase >= soft->drive_share) {
        return 0.0;
    }
    shcdi_sincos(PI * phase / soft->drive_share, &sine, &cosine);
    return sine * sine;
}

static void drive(const shcdi_soft *soft, shcdi_soft_parts *p, double gain, double dt_s) {
    const double turn = soft->drive_hz * dt_s;
    const double middle = p->head->phase + 0.5 * turn;
    const double level = gain * waveform(soft, middle - (double)(int64_t)middle);
    p->head->phase += turn;
    p->head->phase -= (double)(int64_t)p->head->phase;
    for (size_t k = 0; k < soft->n_modes; k++) {
        const double w = soft->mode[k].omega_rad_per_s;
        p->before[k] = q_of(soft, p, k);
        p->drive[k] = shcd_scale(level * w * w, soft->drive_m2[k]);
    }
}

/* Energy of mode k, over rho h, with so much more of x and y; what the drive did on it is added. */
static double energy_of(const shcdi_soft *soft, const shcdi_soft_parts *p, size_t k, shcd_vec3 x,
                        shcd_vec3 y, double *work) {
    const shcdi_mode *mode = &soft->mode[k];
    const double w = mode->omega_rad_per_s;
    const shcd_vec3 q = shcd_scale(soft->q_of_x[k], shcd_add(p->x[k], x));
    const shcd_vec3 at = shcd_add(p->y[k], y);
    const shcd_vec3 v = mode->is_turn ? shcd_mul_add(at, -mode->decay_per_s, q) : at;
    if (soft->drive_m2 != NULL) {
        *work += shcd_dot(p->drive[k], shcd_sub(q, p->before[k]));
    }
    return 0.5 * (shcd_dot(v, v) + w * w * shcd_dot(q, q));
}

double shcdi_soft_energy(const shcdi_soft *soft, unsigned char *memory,
                         const shcd_vec3 *acceleration, double *drive_j) {
    const shcdi_soft_parts p = shcdi_soft_parts_of(soft, memory);
    const shcd_vec3 none = {0.0, 0.0, 0.0};
    double sum = 0.0, work = 0.0;
    for (size_t k = 0; k < soft->n_modes; k++) {
        const shcd_vec3 a = acceleration != NULL ? acceleration[k] : none;
        sum += energy_of(soft, &p, k, shcd_scale(p.propagator[k].forced_x, a),
                         shcd_scale(p.propagator[k].forced_y, a), &work);
    }
    *drive_j = soft->mass_kg_per_m2 * work;
    return soft->mass_kg_per_m2 * sum;
}

void shcdi_soft_account(const shcdi_soft *soft, unsigned char *memory) {
    shcdi_soft_parts p = shcdi_soft_parts_of(soft, memory);
    double work_j = 0.0;
    p.head->stored_j = p.head->is_moving ? shcdi_soft_energy(soft, memory, NULL, &work_j) : 0.0;
    p.head->drive_work_j += work_j;
}

/* ---- the tick ------------------------------------------------------------------------------- */

void shcdi_soft_coefficients(const shcdi_soft *soft, const unsigned char *memory, double shown,
                             double *coefficients) {
    const shcdi_soft_parts p = shcdi_soft_parts_of(soft, (unsigned char *)(uintptr_t)memory);
    const double *rest = shcd_model_coefficients(soft->model);
    memcpy(coefficients, rest, 3 * soft->n_harmonics * sizeof *coefficients);
    if (!p.head->is_moving) {
        return;
    }
    double sum[3][SHCDI_MODAL_COLUMNS];
    for (size_t i = 0; i < soft->n_harmonics; i += SHCDI_MODAL_COLUMNS) {
        const size_t left = soft->n_harmonics - i;
        shcdi_modal_sum(soft->model->series.simd, soft->shape_per_m + i, soft->stride,
                        soft->n_modes, p.x, soft->q_of_x, sum);
        for (size_t c = 0; c < 3; c++) {
            for (size_t n = 0; n < SHCDI_MODAL_COLUMNS && n < left; n++) {
                coefficients[3 * (i + n) + c] += shown * sum[c][n];
            }
        }
    }
}

static void rest(const shcdi_soft *soft, shcdi_soft_parts *p) {
    memset(p->x, 0, soft->n_modes * sizeof *p->x);
    memset(p->y, 0, soft->n_modes * sizeof *p->y);
    p->head->stored_j = 0.0;
    p->head->is_moving = 0;
}

void shcdi_soft_evolve(const shcdi_soft *soft, unsigned char *memory, shcdi_soft_gain gain,
                       double dt_s) {
    shcdi_soft_parts p = shcdi_soft_parts_of(soft, memory);
    const bool was_moving = p.head->is_moving != 0;
    const bool had_contact = p.head->n_presses > 0;
    p.head->n_presses = 0;
    if (p.head->dt_s != dt_s) {
        set_tick(soft, &p, dt_s);
    }
    if (was_moving && !had_contact && p.head->stored_j < REST_J) {
        rest(soft, &p);
    }
    if (soft->drive_m2 != NULL) {
        drive(soft, &p, gain.pulse, dt_s);
        p.head->is_moving = 1;
    }
    if (p.head->is_moving) {
        propagate(soft, &p);
        for (size_t k = 0; k < soft->n_modes && soft->drive_m2 != NULL; k++) {
            shcdi_soft_push(&p, k, p.drive[k]);
        }
        for (size_t k = 0; k < soft->n_modes && p.head->is_tilted; k++) {
            shcdi_soft_push(&p, k, p.tilt[k]);
        }
    }
    p.head->is_tilted = 0;
    if (p.head->is_moving || was_moving) {
        shcdi_soft_coefficients(soft, memory, gain.shown, p.coefficients);
        /* every other tick: a contact is followed on the surface itself, and a search near it bears
         * twice the staleness better than a tick bears the refresh */
        const int follow = p.shape->n_sets % 2 == 0 ? SHCD_FOLLOW_PROGRESSIVE : SHCD_FOLLOW_INFLATE;
        const shcd_status status = shcd_shape_set(soft->model, p.shape, p.coefficients, follow);
        (void)status; /* only a number beyond all bounds is refused; then the last shape stays */
    }
}

/* ---- where a contact is --------------------------------------------------------------------- */

shcdi_press *shcdi_soft_note(const shcdi_soft *soft, unsigned char *memory, shcd_vec3 parameter) {
    const shcdi_soft_parts p = shcdi_soft_parts_of(soft, memory);
    const int degree = shcd_model_degree(soft->model);
    shcdi_series series = soft->model->series;
    if (p.head->n_presses == SHCDI_PRESSES_MAX) {
        return NULL;
    }
    double *at = p.at + p.head->n_presses * soft->n_modes;
    for (size_t g = 0; g < soft->n_groups; g++) {
        series.packed = soft->packed + g * soft->packed_size;
        const shcd_vec3 s = shcdi_surface_point(&series, degree, parameter);
        const double value[3] = {s.x, s.y, s.z};
        for (size_t c = 0; c < 3 && 3 * g + c < soft->n_modes; c++) {
            at[3 * g + c] = value[c];
        }
    }
    return &p.press[p.head->n_presses++];
}

shcd_vec3 shcdi_soft_velocity(const shcdi_soft *soft, unsigned char *memory, size_t press,
                              double shown) {
    const shcdi_soft_parts p = shcdi_soft_parts_of(soft, memory);
    const double *at = p.at + press * soft->n_modes;
    shcd_vec3 sum = {0.0, 0.0, 0.0};
    for (size_t k = 0; k < soft->n_modes; k++) {
        sum = shcd_mul_add(sum, at[k], v_of(soft, &p, k));
    }
    return shcd_scale(shown, sum);
}
