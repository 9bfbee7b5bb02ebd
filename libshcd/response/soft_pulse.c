/* SPDX-License-Identifier: BSD-3-Clause */
/* Which amplitudes of the modes `pulse` asks for.
 *
 * One mode: the amplitude times the direction, scaled by what the mode moves at its root mean
 * square, 1/sqrt(A). The whole body swelling: d = amplitude (S - C)/R, with C the centre of the
 * enclosing ball and R its radius; its coefficients are those of S, and the modes' part of them is
 * the least squares one, min |sum_k q_k b_k v_k - d|^2, by conjugate gradients on the normal
 * equations. */
#include "response/scene_private.h"

#include <string.h>

#define ITERATIONS_MAX 200
#define CONVERGED 1e-20 /* of the squared gradient */

/* gradient = V (d - V^T q), over the modes */
static void to_modes(const shcdi_soft *soft, const double *rest, double *out) {
    for (size_t k = 0; k < soft->n_modes; k++) {
        double sum = 0.0;
        for (size_t i = 0; i < soft->n_harmonics; i++) {
            sum += soft->shape_per_m[k * soft->stride + i] * rest[i];
        }
        out[k] = sum;
    }
}

static void from_modes(const shcdi_soft *soft, const double *q, double *out) {
    memset(out, 0, soft->n_harmonics * sizeof *out);
    for (size_t k = 0; k < soft->n_modes; k++) {
        for (size_t i = 0; i < soft->n_harmonics; i++) {
            out[i] += soft->shape_per_m[k * soft->stride + i] * q[k];
        }
    }
}

static double square(const double *a, size_t n) {
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) {
        sum += a[i] * a[i];
    }
    return sum;
}

static double *coordinate(shcd_vec3 *q, int c) {
    return c == 0 ? &q->x : c == 1 ? &q->y : &q->z;
}

/* rest: on entry the wanted coefficients of one coordinate. The solution grows in drive_m2. */
static void solve(shcdi_soft *soft, int c, double *rest, double *image, double *direction,
                  double *gradient) {
    to_modes(soft, rest, gradient);
    memcpy(direction, gradient, soft->n_modes * sizeof *direction);
    double size = square(gradient, soft->n_modes);
    const double first = size;
    for (int n = 0; n < ITERATIONS_MAX && size > CONVERGED * first; n++) {
        from_modes(soft, direction, image);
        const double step = size / square(image, soft->n_harmonics);
        for (size_t k = 0; k < soft->n_modes; k++) {
            *coordinate(&soft->drive_m2[k], c) += step * direction[k];
        }
        for (size_t i = 0; i < soft->n_harmonics; i++) {
            rest[i] -= step * image[i];
        }
        to_modes(soft, rest, gradient);
        const double next = square(gradient, soft->n_modes);
        for (size_t k = 0; k < soft->n_modes; k++) {
            direction[k] = gradient[k] + next / size * direction[k];
        }
        size = next;
    }
}

static void swell(const shcd_model *model, double amplitude_m, shcdi_soft *soft, double *work) {
    const double *coefficients = shcd_model_coefficients(model);
    const double centre[3] = {model->info.centre_m.x, model->info.centre_m.y,
                              model->info.centre_m.z};
    const double constant = 3.54490770181103205; /* 1/Y_00 */
    for (int c = 0; c < 3; c++) {
        for (size_t i = 0; i < soft->n_harmonics; i++) {
            const double s =
                coefficients[3 * i + (size_t)c] - (i == 0 ? constant * centre[c] : 0.0);
            work[i] = amplitude_m / model->info.radius_m * s;
        }
        solve(soft, c, work, work + soft->n_harmonics, work + 3 * soft->n_harmonics,
              work + 3 * soft->n_harmonics + soft->n_modes);
    }
}

void shcdi_soft_drive(const double *constants, const shcd_model *model, shcdi_soft *soft,
                      double *work) {
    const double amplitude_m = constants[SHCDI_PULSE_AMPLITUDE];
    const size_t k = (size_t)constants[SHCDI_PULSE_MODE];
    soft->drive_hz = constants[SHCDI_PULSE_FREQUENCY];
    soft->drive_share = constants[SHCDI_PULSE_SHARE];
    memset(soft->drive_m2, 0, soft->n_modes * sizeof *soft->drive_m2);
    if (k == 0) {
        swell(model, amplitude_m, soft, work);
        return;
    }
    const shcd_vec3 direction = shcd_unit(shcd_vec3_make(
        constants[SHCDI_PULSE_X], constants[SHCDI_PULSE_Y], constants[SHCDI_PULSE_Z]));
    const shcd_modes *modes = shcd_model_modes(model);
    soft->drive_m2[k] = shcd_scale(amplitude_m * sqrt(modes->area_m2), direction);
}
