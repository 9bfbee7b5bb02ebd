/* SPDX-License-Identifier: BSD-3-Clause */
/* A soft body's constants, from the model's modes and the parameters of `wave`.
 *
 * A point load on a membrane has no finite deflection, and under the patch of radius a the modes
 * converge only once their wavelength is below a: those that are left out are kept as a compliance
 * in series. By Weyl's law n modes reach lambda = 4 pi n/A, and what a patch of heat kernels does
 * beyond that is (1/(4 pi G h)) int_{4 pi n/A}^inf e^(-sigma^2 lambda)/(lambda + 1/l^2) dlambda
 *   = e^x E1(sigma^2 (4 pi n/A + 1/l^2))/(4 pi G h),  x = sigma^2/l^2. */
#include "base/elementary.h"
#include "response/modal.h"
#include "response/scene_private.h"

#include <string.h>

#define PI 3.14159265358979324
#define EULER 0.577215664901532860607
/* Largest angle by which a mode may turn in the longest tick, 0.1 s. */
#define ANGLE_MAX 1e6
#define DT_MAX_S 0.1

/* ---- the membrane --------------------------------------------------------------------------- */

/* Series up to 1, continued fraction by Lentz's method beyond (Abramowitz, Stegun, 5.1.11, 5.1.22):
 * of e^x E1(x), which neither overflows nor vanishes. The functions are the library's own: a scene
 * is the same to the bit whatever the C library. */
double shcdi_scaled_e1(double x) {
    if (x <= 1.0) {
        double sum = 0.0, term = 1.0;
        for (int n = 1; n <= 40; n++) {
            term *= -x / n;
            sum -= term / n;
        }
        return shcdi_exp(x) * (sum - shcdi_log(x) - EULER);
    }
    double b = x + 1.0, c = 1e300, d = 1.0 / b, h = d;
    for (int i = 1; i <= 200; i++) {
        const double a = -(double)i * (double)i;
        b += 2.0;
        d = 1.0 / (a * d + b);
        c = b + a / c;
        h *= c * d;
        if (fabs(c * d - 1.0) < 1e-16) {
            break;
        }
    }
    return h;
}

shcdi_membrane shcdi_membrane_of(const double *wave) {
    const double nu = wave[SHCDI_WAVE_POISSON], l = wave[SHCDI_WAVE_SUPPORT];
    shcdi_membrane m;
    m.shear_pa = wave[SHCDI_WAVE_YOUNG] / (2.0 * (1.0 + nu));
    m.patch_m = 0.5 * wave[SHCDI_WAVE_PATCH];
    m.density_kg_per_m3 = wave[SHCDI_WAVE_DENSITY];
    m.thickness_m = wave[SHCDI_WAVE_THICKNESS];
    if (m.thickness_m == 0.0 && l > 0.0) {
        const double x = m.patch_m * m.patch_m / (l * l);
        m.thickness_m = wave[SHCDI_WAVE_PATCH] * shcdi_scaled_e1(x) / (PI * (1.0 - nu));
    }
    m.foundation_pa_per_m = l > 0.0 ? m.shear_pa * m.thickness_m / (l * l) : 0.0;
    return m;
}

double shcdi_residual_compliance(const shcdi_membrane *m, double area_m2, size_t n) {
    const double stiffness = m->shear_pa * m->thickness_m;
    const double s2 = m->patch_m * m->patch_m;
    const double x = s2 * m->foundation_pa_per_m / stiffness;
    const double beyond = s2 * 4.0 * PI * (double)n / area_m2;
    return shcdi_exp(-beyond) * shcdi_scaled_e1(beyond + x) / (4.0 * PI * stiffness);
}

/* ---- checks --------------------------------------------------------------------------------- */

static const shcdi_active_effect *find(const shcdi_active_effect *effects, size_t n,
                                       const shcdi_effect *effect, int32_t *index) {
    *index = -1;
    for (size_t e = 0; e < n; e++) {
        if (effects[e].effect == effect) {
            *index = (int32_t)e;
            return &effects[e];
        }
    }
    return NULL;
}

static double omega_of(const shcdi_membrane *m, double eigenvalue_per_m2) {
    const double stiffness =
        m->shear_pa * eigenvalue_per_m2 + m->foundation_pa_per_m / m->thickness_m;
    return sqrt(stiffness / m->density_kg_per_m3);
}

static shcd_status check_wave(const char *body, const shcd_modes *modes, const double *wave,
                              shcd_error *error) {
    const double n = wave[SHCDI_WAVE_MODES];
    const shcdi_membrane m = shcdi_membrane_of(wave);
    if (n != (double)(size_t)n) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: body '%s': effect 'wave': 'modes' is %g, must be whole",
                          body, n);
    }
    if (modes == NULL || (size_t)n > modes->n_modes) {
        return shcdi_fail(
            error, SHCD_ERR_ARGUMENT,
            "scene_create: body '%s': effect 'wave': 'modes' is %g, its model has %zu; "
            "'shcd modes' adds them",
            body, n, modes != NULL ? modes->n_modes : (size_t)0);
    }
    if (wave[SHCDI_WAVE_SUPPORT] == 0.0 && (!modes->is_anchored || m.thickness_m == 0.0)) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: body '%s': effect 'wave': without a foundation "
                          "(support_length_m 0) the model needs anchors and the effect a "
                          "thickness_m, or a push moves the body for ever",
                          body);
    }
    if (omega_of(&m, modes->eigenvalue_per_m2[(size_t)n - 1]) * DT_MAX_S > ANGLE_MAX) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: body '%s': effect 'wave': mode %g oscillates at %.3g "
                          "rad/s, at most %g can be computed; use fewer modes or a softer tissue",
                          body, n, omega_of(&m, modes->eigenvalue_per_m2[(size_t)n - 1]),
                          ANGLE_MAX / DT_MAX_S);
    }
    return SHCD_OK;
}

static shcd_status check_pulse(const char *body, const double *pulse, const double *wave,
                               shcd_error *error) {
    const double k = pulse[SHCDI_PULSE_MODE];
    if (k != (double)(size_t)k || k >= wave[SHCDI_WAVE_MODES]) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: body '%s': effect 'pulse': 'mode' is %g, must be a whole "
                          "number below the %g modes of 'wave'",
                          body, k, wave[SHCDI_WAVE_MODES]);
    }
    if (k > 0.0 && pulse[SHCDI_PULSE_X] == 0.0 && pulse[SHCDI_PULSE_Y] == 0.0 &&
        pulse[SHCDI_PULSE_Z] == 0.0) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: body '%s': effect 'pulse': its direction is zero", body);
    }
    return SHCD_OK;
}

shcd_status shcdi_soft_check(const char *body, const shcd_model *model,
                             const shcdi_active_effect *effects, size_t n, shcd_error *error) {
    int32_t at;
    size_t n_laws = 0;
    const shcdi_active_effect *wave = find(effects, n, &shcdi_effect_wave, &at);
    const shcdi_active_effect *pulse = find(effects, n, &shcdi_effect_pulse, &at);
    if (wave == NULL) {
        return pulse == NULL
                   ? SHCD_OK
                   : shcdi_fail(
                         error, SHCD_ERR_ARGUMENT,
                         "scene_create: body '%s': effect 'pulse': it needs 'wave' beside it",
                         body);
    }
    shcd_status status = check_wave(body, shcd_model_modes(model), wave->constants, error);
    if (status == SHCD_OK && pulse != NULL) {
        status = check_pulse(body, pulse->constants, wave->constants, error);
    }
    for (size_t e = 0; status == SHCD_OK && e < n; e++) {
        n_laws += effects[e].effect->press != NULL;
        if (n_laws > 1) {
            status =
                shcdi_fail(error, SHCD_ERR_ARGUMENT,
                           "scene_create: body '%s': effect '%s': with 'wave' there can be one "
                           "elastic law at most, and this is a second one",
                           body, effects[e].effect->info.name);
        }
    }
    return status;
}

/* ---- layout --------------------------------------------------------------------------------- */

static size_t aligned(size_t bytes) {
    return (bytes + 15) / 16 * 16;
}

/* Sizes of the arrays behind a shcdi_soft, in order. */
static void block_sizes(const shcd_model *model, size_t n, size_t sizes[6]) {
    const size_t n_harmonics = SHCD_COUNT(shcd_model_degree(model));
    sizes[0] = aligned(n * sizeof(shcdi_mode));
    sizes[1] = aligned(n * shcdi_modal_stride(n_harmonics) * sizeof(double));
    sizes[2] = aligned((n + 2) / 3 * shcdi_packed_size(shcd_model_degree(model)) * sizeof(double));
    sizes[3] = aligned(n * sizeof(shcd_vec3));
    sizes[5] = aligned(n * sizeof(double));
    sizes[4] = aligned((3 * n_harmonics + 2 * n) * sizeof(double)); /* while it is made */
}

size_t shcdi_soft_bytes(const shcd_model *model, const shcdi_active_effect *effects, size_t n) {
    int32_t at;
    size_t sizes[6], sum = aligned(sizeof(shcdi_soft));
    const shcdi_active_effect *wave = find(effects, n, &shcdi_effect_wave, &at);
    if (wave == NULL) {
        return 0;
    }
    block_sizes(model, (size_t)wave->constants[SHCDI_WAVE_MODES], sizes);
    for (size_t i = 0; i < 6; i++) {
        sum += sizes[i];
    }
    return sum;
}

static size_t lay_out(const shcdi_soft *soft, unsigned char *memory, shcdi_soft_parts *p) {
    const size_t n = soft->n_modes;
    const size_t sizes[] = {sizeof(shcdi_soft_state),
                            n * sizeof(shcd_vec3),
                            n * sizeof(shcd_vec3),
                            n * sizeof(shcdi_propagator),
                            soft->drive_m2 != NULL ? n * sizeof(shcd_vec3) : 0,
                            soft->drive_m2 != NULL ? n * sizeof(shcd_vec3) : 0,
                            n * sizeof(shcd_vec3),
                            n * sizeof(shcd_vec3),
                            3 * soft->n_harmonics * sizeof(double),
                            SHCDI_PRESSES_MAX * n * sizeof(double),
                            SHCDI_PRESSES_MAX * sizeof(shcdi_press),
                            shcd_shape_size(soft->model)};
    void *part[sizeof sizes / sizeof sizes[0]];
    size_t at = 0;
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        part[i] = memory != NULL ? memory + at : NULL;
        at += aligned(sizes[i]);
    }
    p->head = part[0];
    p->x = part[1];
    p->y = part[2];
    p->propagator = part[3];
    p->drive = part[4];
    p->before = part[5];
    p->tilt = part[6];
    p->trial = part[7];
    p->coefficients = part[8];
    p->at = part[9];
    p->press = part[10];
    p->shape = part[11];
    return at;
}

shcdi_soft_parts shcdi_soft_parts_of(const shcdi_soft *soft, unsigned char *memory) {
    shcdi_soft_parts p;
    lay_out(soft, memory, &p);
    return p;
}

const shcd_shape *shcdi_soft_shape(const shcdi_soft *soft, const unsigned char *memory) {
    shcdi_soft_parts p;
    lay_out(soft, (unsigned char *)(uintptr_t)memory, &p);
    return p.shape;
}

/* ---- making --------------------------------------------------------------------------------- */

/* b_k v_ki, as rows and packed by threes as the coordinates of surfaces. */
static void fill_shapes(const shcd_modes *modes, const shcdi_membrane *m, shcdi_soft *soft,
                        double *work) {
    const size_t count = soft->n_harmonics;
    const int degree = shcd_model_degree(soft->model);
    for (size_t k = 0; k < soft->n_modes; k++) {
        const double b = shcdi_exp(-0.5 * m->patch_m * m->patch_m * modes->eigenvalue_per_m2[k]);
        for (size_t i = 0; i < count; i++) {
            soft->shape_per_m[k * soft->stride + i] = b * modes->coefficient_per_m[k * count + i];
        }
    }
    for (size_t g = 0; g < soft->n_groups; g++) {
        memset(work, 0, 3 * count * sizeof *work);
        for (size_t c = 0; c < 3 && 3 * g + c < soft->n_modes; c++) {
            for (size_t i = 0; i < count; i++) {
                work[3 * i + c] = soft->shape_per_m[(3 * g + c) * soft->stride + i];
            }
        }
        shcdi_pack(degree, work, soft->packed + g * soft->packed_size);
    }
}

shcdi_soft *shcdi_soft_create(const shcd_model *model, const shcdi_active_effect *effects, size_t n,
                              unsigned char *memory) {
    shcdi_soft *soft = (shcdi_soft *)(void *)memory;
    const shcd_modes *modes = shcd_model_modes(model);
    const shcdi_active_effect *wave = find(effects, n, &shcdi_effect_wave, &soft->wave);
    const shcdi_active_effect *pulse = find(effects, n, &shcdi_effect_pulse, &soft->pulse);
    soft->law = -1;
    for (size_t e = 0; e < n; e++) {
        soft->law = effects[e].effect->press != NULL ? (int32_t)e : soft->law;
    }
    const shcdi_membrane m = shcdi_membrane_of(wave->constants);
    size_t sizes[6], at = aligned(sizeof *soft);
    void *part[6];
    soft->model = model;
    soft->n_modes = (size_t)wave->constants[SHCDI_WAVE_MODES];
    soft->n_harmonics = SHCD_COUNT(shcd_model_degree(model));
    soft->stride = shcdi_modal_stride(soft->n_harmonics);
    soft->n_groups = (soft->n_modes + 2) / 3;
    soft->packed_size = shcdi_packed_size(shcd_model_degree(model));
    block_sizes(model, soft->n_modes, sizes);
    for (size_t i = 0; i < 6; i++) {
        part[i] = memory + at;
        at += sizes[i];
    }
    soft->mode = part[0];
    soft->shape_per_m = part[1];
    soft->packed = part[2];
    soft->q_of_x = part[5];
    soft->mass_kg_per_m2 = m.density_kg_per_m3 * m.thickness_m;
    soft->residual_m_per_n = shcdi_residual_compliance(&m, modes->area_m2, soft->n_modes);
    for (size_t k = 0; k < soft->n_modes; k++) {
        shcdi_mode_set(omega_of(&m, modes->eigenvalue_per_m2[k]),
                       wave->constants[SHCDI_WAVE_DAMPING], &soft->mode[k]);
        soft->q_of_x[k] = soft->mode[k].q_of_x;
    }
    fill_shapes(modes, &m, soft, part[4]);
    if (pulse != NULL) {
        soft->drive_m2 = part[3];
        shcdi_soft_drive(pulse->constants, model, soft, part[4]);
    }
    shcdi_soft_parts parts;
    soft->state_bytes = lay_out(soft, NULL, &parts);
    return soft;
}

shcdi_soft_gain shcdi_soft_gain_of(const shcdi_soft *soft, const shcdi_gain *gains) {
    const double wave = gains[soft->wave].now;
    const shcdi_soft_gain gain = {soft->law >= 0 ? wave : 1.0,
                                  soft->law >= 0 ? gains[soft->law].now : wave,
                                  soft->pulse >= 0 ? gains[soft->pulse].now : 0.0};
    return gain;
}

void shcdi_soft_init(const shcdi_soft *soft, unsigned char *memory) {
    const shcdi_soft_parts p = shcdi_soft_parts_of(soft, memory);
    shcd_shape *shape;
    const shcd_status status =
        shcd_shape_init(soft->model, p.shape, shcd_shape_size(soft->model), &shape);
    SHCD_ASSERT(status == SHCD_OK);
    (void)status;
}
