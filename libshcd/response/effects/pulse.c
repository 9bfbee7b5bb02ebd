/* SPDX-License-Identifier: BSD-3-Clause */
/* pulse: forces that drive the modes of `wave` in time: a heart that beats, a vessel that throbs.
 * The drive is s(t) = sin^2(pi t f/share) while t f mod 1 < share, else 0, times the force that
 * would displace the body by the amplitude if it were held: a fast mode follows it, a slow one
 * lags. */
#include "response/soft.h"

#include <string.h>

static const shcd_parameter_info parameters[] = {
    {"frequency_hz", "Hz", 1.2, 0.01, 100.0, "f"},
    {"amplitude_m", "m", 0.002, 0.0, 0.1, "displacement at the peak if it were held"},
    {"systole_share", "1", 0.4, 0.01, 1.0, "share of the period in which it drives"},
    {"mode", "1", 0.0, 0.0, SHCD_MODES_MAX - 1.0,
     "0: the whole body swells about its centre; k: mode k alone, along the direction"},
    {"direction_x", "1", 0.0, -1.0, 1.0, "of a single mode, body frame"},
    {"direction_y", "1", 0.0, -1.0, 1.0, "of a single mode, body frame"},
    {"direction_z", "1", 1.0, -1.0, 1.0, "of a single mode, body frame"},
};
#define N_PARAMETERS (sizeof parameters / sizeof parameters[0])

_Static_assert(N_PARAMETERS == SHCDI_PULSE_Z + 1, "the constants are the parameters");

static void prepare(const double *values, double *constants) {
    memcpy(constants, values, N_PARAMETERS * sizeof *values);
}

const shcdi_effect shcdi_effect_pulse = {
    {"pulse", "drives the modes of wave in time: a heartbeat; needs wave",
     "raised sine over the systole; docs/effects.md", N_PARAMETERS, parameters},
    0,
    prepare,
    NULL,
    NULL,
    NULL,
};
