/* SPDX-License-Identifier: BSD-3-Clause */
#include "safety.h"

#include "shcd/vec.h"

watchdog_level watchdog_of_age(int64_t age_ns) {
    if (age_ns < 0 || age_ns > SAFETY_INACTIVE_NS) {
        return WATCHDOG_INACTIVE;
    }
    if (age_ns > SAFETY_RAMP_NS) {
        return WATCHDOG_RAMP;
    }
    return age_ns > SAFETY_STALE_NS ? WATCHDOG_HOLD : WATCHDOG_FRESH;
}

/* Length, also where the squares overflow; the components must not exceed a quarter of the largest
 * double. */
static double length(shcd_vec3 v) {
    const double m = fmax(fabs(v.x), fmax(fabs(v.y), fabs(v.z)));
    return m > 1e150 ? m * shcd_norm(shcd_vec3_make(v.x / m, v.y / m, v.z / m)) : shcd_norm(v);
}

shcd_vec3 safety_clamp(shcd_vec3 v, double max, bool *acted) {
    const shcd_vec3 quarter = shcd_scale(0.25, v); /* exact, and its length cannot overflow */
    const double n = length(quarter);
    *acted = n > 0.25 * max;
    return *acted ? shcd_scale(max / n, quarter) : v;
}

shcd_vec3 safety_slew(shcd_vec3 last, shcd_vec3 wanted, double step_max, bool *acted) {
    const shcd_vec3 change = shcd_sub(wanted, last);
    const double n = length(change);
    *acted = n > step_max;
    return *acted ? shcd_mul_add(last, step_max / n, change) : wanted;
}

double safety_ramp(double gain, bool up, double dt_s) {
    const double step = dt_s / (up ? SAFETY_RAMP_ON_S : SAFETY_RAMP_OFF_S);
    /* a rest that only rounding left must not cost another tick */
    const double rest = step * (1.0 + 1e-9);
    if (up) {
        return 1.0 - gain > rest ? gain + step : 1.0;
    }
    return gain > rest ? gain - step : 0.0;
}

static bool wrench_is_finite(const shcd_wrench *w) {
    return shcd_vec3_is_finite(w->force_n) && shcd_vec3_is_finite(w->torque_n_m);
}

static bool wrench_is_zero(const shcd_wrench *w) {
    return length(w->force_n) == 0.0 && length(w->torque_n_m) == 0.0;
}

shcd_wrench safety_apply(const safety_limits *limits, safety_state *state, shcd_wrench wanted,
                         safety_wish wish, double dt_s, uint32_t *flags) {
    const shcd_wrench zero = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    bool force_acted, torque_acted;
    *flags = 0;

    const bool fault = !wrench_is_finite(&wanted);
    *flags |= fault ? SAFETY_FAULT : 0u;
    const bool cut = fault || wish == SAFETY_CUT;
    shcd_wrench w = cut ? zero : wanted;

    w.force_n = safety_clamp(w.force_n, limits->force_max_n, &force_acted);
    w.torque_n_m = safety_clamp(w.torque_n_m, limits->torque_max_n_m, &torque_acted);
    *flags |= force_acted || torque_acted ? SAFETY_LIMITED : 0u;

    const double step = limits->slew_max_n_per_s * dt_s;
    const double torque_step = step * (limits->torque_max_n_m / limits->force_max_n);
    w.force_n = safety_slew(state->slewed.force_n, w.force_n, step, &force_acted);
    w.torque_n_m = safety_slew(state->slewed.torque_n_m, w.torque_n_m, torque_step, &torque_acted);
    *flags |= force_acted || torque_acted ? SAFETY_SLEW : 0u;
    state->slewed = w;

    if (!cut) {
        state->gain = safety_ramp(state->gain, wish == SAFETY_FULL, dt_s);
    } else if (wrench_is_zero(&w)) {
        state->gain = 0.0; /* whatever comes next starts softly */
    }
    *flags |= state->gain < 1.0 ? SAFETY_RAMP : 0u;
    w.force_n = shcd_scale(state->gain, w.force_n);
    w.torque_n_m = shcd_scale(state->gain, w.torque_n_m);

    /* The gain moves the force too, so that the two together could exceed the cap of the slew: what
     * leaves is limited once more. Where the gain rests at 1 this changes no bit. */
    w.force_n = safety_slew(state->published.force_n, w.force_n, step, &force_acted);
    w.torque_n_m =
        safety_slew(state->published.torque_n_m, w.torque_n_m, torque_step, &torque_acted);
    *flags |= force_acted || torque_acted ? SAFETY_SLEW : 0u;

    state->published = w;
    return safety_finish(state, w, flags);
}

shcd_wrench safety_finish(safety_state *state, shcd_wrench wrench, uint32_t *flags) {
    const shcd_wrench zero = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    if (wrench_is_finite(&wrench)) {
        return wrench;
    }
    *flags |= SAFETY_FAULT;
    *state = (safety_state){zero, 0.0, zero};
    return zero;
}
