/* SPDX-License-Identifier: BSD-3-Clause */
/* Recurrence coefficients of the normalised Legendre functions, shared by the basis and by the
 * fused evaluation of surfaces. Formulas: base/harmonics.c. */
#ifndef SHCDI_BASE_HARMONICS_H
#define SHCDI_BASE_HARMONICS_H

#include "base/internal.h"

static inline double shcdi_recurrence_a(int l, int m) {
    const double l2 = (double)l * (double)l;
    return sqrt((4.0 * l2 - 1.0) / (l2 - (double)m * (double)m));
}

static inline double shcdi_recurrence_b(int l, int m) {
    const double k2 = (double)(l - 1) * (double)(l - 1);
    return l == m + 1 ? 0.0 : sqrt((k2 - (double)m * (double)m) / (4.0 * k2 - 1.0));
}

/** Q_mm / Q_{m-1,m-1}, m >= 1; the step from 0 to 1 carries the sqrt(2) of the real basis. */
static inline double shcdi_recurrence_diagonal(int m) {
    return m == 1 ? sqrt(3.0) : sqrt((2.0 * m + 1.0) / (2.0 * m));
}

/** Normalises a direction of any finite length but zero. Where squares
 * could overflow or vanish, the largest component is scaled to 1 first. RT safe. */
static inline shcd_status shcdi_direction(shcd_vec3 d, shcd_vec3 *w) {
    const double dd = shcd_dot(d, d);
    if (dd > 1e-200 && dd < 1e200) {
        const double length = sqrt(dd);
        *w = shcd_vec3_make(d.x / length, d.y / length, d.z / length);
        return SHCD_OK;
    }
    if (!shcd_vec3_is_finite(d)) {
        return SHCD_ERR_NOT_FINITE;
    }
    const double m = shcdi_max(shcdi_max(fabs(d.x), fabs(d.y)), fabs(d.z));
    if (m == 0.0) {
        return SHCD_ERR_ARGUMENT;
    }
    const shcd_vec3 s = {d.x / m, d.y / m, d.z / m};
    const double n = shcd_norm(s);
    *w = shcd_vec3_make(s.x / n, s.y / n, s.z / n);
    return SHCD_OK;
}

#endif
