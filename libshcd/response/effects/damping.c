/* SPDX-License-Identifier: BSD-3-Clause */
/* damping: dissipation in proportion to the elastic force,
 *
 *     F = F_e max(0, 1 + (3/2) (ratio / v_ref) clamp(u, -10 v_ref, 10 v_ref)),   u = d(depth)/dt,
 *
 * with F_e the force that the effects before this one left. Hunt and Crossley's model
 * F = k x^n (1 + (3/2) alpha u) loses the share alpha v of the speed in a bounce of impact speed v,
 * to first order: e = 1 - alpha v. Here ratio = alpha v_ref, so ratio is 1 - e at v_ref. Beyond
 * first order e solves b - log(1 + b) = -e b - log(1 - e b), b = (3/2) ratio v / v_ref (energy
 * balance of the way in and the way out; tests/unit/test_effect_damping.c): 0.77 for ratio 0.3 at
 * v_ref.
 *
 * Unlike a dashpot the force starts from zero on touching. The lower bound keeps it from pulling
 * when the tool leaves fast (no sticking); the clamp of u bounds the factor by 1 + 15 ratio, so
 * that a wild velocity estimate cannot make a force of any size. */
#include "response/effects.h"

#define RATE_LIMIT 10.0 /* largest |u| / v_ref that counts */

static const shcd_parameter_info parameters[] = {
    {"ratio", "1", 0.3, 0.0, 1.0,
     "share of the speed lost in a bounce at the reference speed, to first order"},
    {"reference_speed_m_per_s", "m/s", 0.1, 1e-3, 100.0, "speed to which the ratio refers"},
};

static void prepare(const double *values, double *constants) {
    constants[0] = 1.5 * values[0];
    constants[1] = 1.0 / values[1];
}

static void apply(const double *constants, const shcdi_touch *touch, void *memory,
                  shcdi_response *response) {
    double rate = touch->depth_rate_m_per_s * constants[1];
    double factor;
    (void)memory;
    rate = rate > RATE_LIMIT ? RATE_LIMIT : rate;
    rate = rate < -RATE_LIMIT ? -RATE_LIMIT : rate;
    factor = 1.0 + constants[0] * rate;
    response->normal_force_n *= factor > 0.0 ? factor : 0.0;
}

const shcdi_effect shcdi_effect_damping = {
    {"damping",
     "Hunt-Crossley damping: elastic force times 1 + 1.5 ratio / reference_speed * depth rate, "
     "never pulling; gives no force without an elastic effect",
     "K. H. Hunt, F. R. E. Crossley, J. Appl. Mech. 42(2), 440-445 (1975)", 2, parameters},
    0,
    prepare,
    NULL,
    NULL,
    apply,
};
