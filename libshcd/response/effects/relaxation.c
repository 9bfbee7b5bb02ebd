/* SPDX-License-Identifier: BSD-3-Clause */
/* relaxation: the force of a held depth falls with time, as tissue's does (quasi-linear
 * viscoelasticity with a Prony series),
 *
 *     F(t) = int G(t - s) dF_e(s),  G(t) = 1 - sum_i g_i (1 - e^(-t/tau_i)),
 *
 * F_e the force that the effects before this one left: a step keeps the share 1 - sum g_i in the
 * end. With h_i' = (F_e - h_i)/tau_i, h_i = 0 at the start of the contact, that is
 * F = F_e - sum g_i h_i. Over a tick F_e counts as a ramp from f to f', for which, x = dt/tau and
 * r = (1 - e^(-x))/x,
 *
 *     h' = h + (f - h) x r + (f' - f) (1 - r)
 *
 * is exact, whatever the length of the tick.
 *
 * Passive: with a linear law F is that of a spring (1 - sum g) k beside one Maxwell element g_i k,
 * tau_i for each term, which hold k/2 [(1 - sum g) x^2 + sum g_i (x - h_i/k)^2]. That is what is
 * booked as stored, with k/2 = U/F_e^2 of the law at hand; a law that is not linear makes it an
 * estimate. A tool that leaves faster than the tissue follows loses contact instead of being held:
 * F >= 0. */
#include "base/elementary.h"
#include "base/internal.h"
#include "response/effects.h"

#define N_TERMS 3
enum { SHARE = 0, TIME = N_TERMS, N_PARAMETERS = 2 * N_TERMS };

static const shcd_parameter_info parameters[] = {
    {"g_1", "1", 0.3, 0.0, 0.99, "share of the force that is lost with tau_1"},
    {"g_2", "1", 0.2, 0.0, 0.99, "share that is lost with tau_2; all shares together below 1"},
    {"g_3", "1", 0.0, 0.0, 0.99, "share that is lost with tau_3"},
    {"tau_1_s", "s", 1.0, 1e-3, 1e4, "tau_1"},
    {"tau_2_s", "s", 10.0, 1e-3, 1e4, "tau_2"},
    {"tau_3_s", "s", 100.0, 1e-3, 1e4, "tau_3"},
};

typedef struct history {
    double force_n; /* F_e of the last tick */
    double relaxed_n[N_TERMS];
} history;

static void prepare(const double *values, double *constants) {
    for (int i = 0; i < N_PARAMETERS; i++) {
        constants[i] = values[i];
    }
}

shcd_status shcdi_settle_relaxation(const char *body, const shcdi_settings *s, double *constants,
                                    shcd_error *error) {
    double sum = 0.0;
    (void)constants;
    for (int i = 0; i < N_TERMS; i++) {
        sum += s->value[SHARE + i];
    }
    return sum < 1.0 ? SHCD_OK
                     : shcdi_fail(error, SHCD_ERR_ARGUMENT,
                                  "scene_create: body '%s': effect 'relaxation': g_1 + g_2 + g_3 "
                                  "is %g, must be below 1",
                                  body, sum);
}

/* (1 - e^(-x))/x, x > 0 */
static double mean_decay(double x) {
    return x <= 1.0 ? shcdi_expm1_ratio(-x) : (1.0 - shcdi_exp(-x)) / x;
}

static void apply(const double *constants, const shcdi_touch *touch, void *memory,
                  shcdi_response *response) {
    history *past = memory;
    const double now = response->normal_force_n, before = past->force_n;
    double force = now, kept = 1.0, stretched = 0.0;
    for (int i = 0; i < N_TERMS; i++) {
        const double g = constants[SHARE + i];
        const double x = touch->dt_s / constants[TIME + i];
        const double r = mean_decay(x);
        const double h = past->relaxed_n[i];
        const double relaxed = h + (before - h) * (x * r) + (now - before) * (1.0 - r);
        past->relaxed_n[i] = relaxed;
        force -= g * relaxed;
        kept -= g;
        stretched += g * (now - relaxed) * (now - relaxed);
    }
    past->force_n = now;
    if (kept < 1.0) {
        const double square = now * now;
        response->normal_force_n = force > 0.0 ? force : 0.0;
        response->stored_j *= square > 0.0 ? kept + stretched / square : 0.0;
    }
}

const shcdi_effect shcdi_effect_relaxation = {
    {"relaxation",
     "viscoelastic relaxation by a Prony series: F = int (1 - sum g_i (1 - e^(-(t-s)/tau_i))) "
     "dF_e(s), never pulling; a contact begins unrelaxed",
     "Y. C. Fung, Biomechanics: Mechanical Properties of Living Tissues, Springer (1993), 7.6; "
     "defaults: half of the force lost within tens of seconds, the order that tests of organs find",
     N_PARAMETERS, parameters},
    sizeof(history),
    prepare,
    NULL,
    NULL,
    apply,
};
