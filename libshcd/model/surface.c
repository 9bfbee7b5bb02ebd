/* SPDX-License-Identifier: BSD-3-Clause */
/* Fused evaluation: for each order m the sums A_m(z) = sum_l c_lm Q_lm(z) and B_m(z) (with c_l,-m)
 * and their z-derivatives run along the recurrence of base/harmonics.c, three coordinates at a
 * time; then S = sum_m A_m C_m + B_m S_m with C_m + i S_m = (x + i y)^m. Y is never stored.
 *
 * The polynomial in (x, y, z) extends S off the sphere; first derivatives along a tangent t are
 * t.G, covariant second derivatives t.H.t' - (t.t') (w.G), G and H the Euclidean gradient and
 * Hessian of the extension.
 */
#include "model/surface.h"

#include "base/harmonics.h"

#define Q_00 0.28209479177387814

void shcdi_recurrence_fill(int degree, double *recurrence) {
    size_t n = 0;
    for (int m = 0; m <= degree; m++) {
        for (int l = m; l <= degree; l++) {
            recurrence[n++] = l > m ? shcdi_recurrence_a(l, m) : 0.0;
            recurrence[n++] = l > m ? shcdi_recurrence_b(l, m) : 0.0;
        }
    }
    recurrence[n++] = Q_00;
    for (int m = 1; m <= degree; m++, n++) {
        recurrence[n] = recurrence[n - 1] * shcdi_recurrence_diagonal(m);
    }
}

void shcdi_pack(int degree, const double *coefficients, double *packed) {
    for (int m = 0; m <= degree; m++) {
        for (int l = m; l <= degree; l++) {
            for (size_t k = 0; k < 3; k++) {
                packed[k] = coefficients[3 * SHCD_INDEX(l, m) + k];
                packed[k + 3] = m > 0 ? coefficients[3 * SHCD_INDEX(l, -m) + k] : 0.0;
            }
            packed += 6;
        }
    }
}

shcd_vec3 shcdi_surface_point(const shcdi_series *series, int degree, shcd_vec3 w) {
    const int top = series->degree;
    const double *r = series->recurrence;
    const double *c = series->packed;
    const double *diagonal = r + 2 * shcdi_pair_count(top);
    double cm = 1.0, sm = 0.0;
    double s[3] = {0.0, 0.0, 0.0};
    for (int m = 0; m <= degree; m++) {
        double q1 = 0.0, q = diagonal[m];
        double a[6];
        for (int k = 0; k < 6; k++) {
            a[k] = q * c[k];
        }
        for (int l = m + 1; l <= degree; l++) {
            const double *rl = r + 2 * (l - m);
            const double *cl = c + 6 * (l - m);
            const double next = rl[0] * (w.z * q - rl[1] * q1);
            q1 = q;
            q = next;
            for (int k = 0; k < 6; k++) {
                a[k] += q * cl[k];
            }
        }
        for (int k = 0; k < 3; k++) {
            s[k] += a[k] * cm + a[k + 3] * sm;
        }
        const double next = w.x * cm - w.y * sm;
        sm = w.x * sm + w.y * cm;
        cm = next;
        r += 2 * (top - m + 1);
        c += 6 * (top - m + 1);
    }
    return shcd_vec3_make(s[0], s[1], s[2]);
}

/* Value, gradient and Hessian (xx, xy, xz, yy, yz, zz) of the extension, one coordinate each. */
typedef struct extension {
    double f[3], g[3][3], h[6][3];
} extension;

/* Adds order m: a[j] = sums of the j-th z-derivative, cosine coefficients then sine. */
static void add_order(extension *e, int m, const double a[3][6], const double power[6]) {
    const double n = (double)m, nn = n * (n - 1.0);
    const double c = power[0], s = power[1], c1 = n * power[2], s1 = n * power[3];
    const double c2 = nn * power[4], s2 = nn * power[5];
    for (int k = 0; k < 3; k++) {
        const double a0 = a[0][k], b0 = a[0][k + 3], a1 = a[1][k], b1 = a[1][k + 3];
        const double xx = a0 * c2 + b0 * s2;
        e->f[k] += a0 * c + b0 * s;
        e->g[0][k] += a0 * c1 + b0 * s1;
        e->g[1][k] += b0 * c1 - a0 * s1;
        e->g[2][k] += a1 * c + b1 * s;
        e->h[0][k] += xx;
        e->h[1][k] += b0 * c2 - a0 * s2;
        e->h[2][k] += a1 * c1 + b1 * s1;
        e->h[3][k] -= xx;
        e->h[4][k] += b1 * c1 - a1 * s1;
        e->h[5][k] += a[2][k] * c + a[2][k + 3] * s;
    }
}

static shcd_vec3 along(const double g[3][3], shcd_vec3 t) {
    return shcd_vec3_make(t.x * g[0][0] + t.y * g[1][0] + t.z * g[2][0],
                          t.x * g[0][1] + t.y * g[1][1] + t.z * g[2][1],
                          t.x * g[0][2] + t.y * g[1][2] + t.z * g[2][2]);
}

static shcd_vec3 along_twice(const double h[6][3], shcd_vec3 t, shcd_vec3 u) {
    const double weight[6] = {t.x * u.x, t.x * u.y + t.y * u.x, t.x * u.z + t.z * u.x,
                              t.y * u.y, t.y * u.z + t.z * u.y, t.z * u.z};
    double r[3] = {0.0, 0.0, 0.0};
    for (int j = 0; j < 6; j++) {
        for (int k = 0; k < 3; k++) {
            r[k] += weight[j] * h[j][k];
        }
    }
    return shcd_vec3_make(r[0], r[1], r[2]);
}

void shcdi_surface_jet(const shcdi_series *series, int degree, shcd_vec3 w, shcdi_jet *jet) {
    const int top = series->degree;
    const double *r = series->recurrence;
    const double *c = series->packed;
    const double *diagonal = r + 2 * shcdi_pair_count(top);
    double power[6] = {1.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    extension e = {{0}, {{0}}, {{0}}};
    for (int m = 0; m <= degree; m++) {
        double q1[3] = {0.0, 0.0, 0.0}, q[3] = {diagonal[m], 0.0, 0.0};
        double a[3][6] = {{0}};
        for (int k = 0; k < 6; k++) {
            a[0][k] = q[0] * c[k];
        }
        for (int l = m + 1; l <= degree; l++) {
            const double *rl = r + 2 * (l - m);
            const double *cl = c + 6 * (l - m);
            const double n0 = rl[0] * (w.z * q[0] - rl[1] * q1[0]);
            const double n1 = rl[0] * (w.z * q[1] + q[0] - rl[1] * q1[1]);
            const double n2 = rl[0] * (w.z * q[2] + 2.0 * q[1] - rl[1] * q1[2]);
            for (int j = 0; j < 3; j++) {
                q1[j] = q[j];
            }
            q[0] = n0;
            q[1] = n1;
            q[2] = n2;
            for (int k = 0; k < 6; k++) {
                a[0][k] += n0 * cl[k];
                a[1][k] += n1 * cl[k];
                a[2][k] += n2 * cl[k];
            }
        }
        add_order(&e, m, (const double(*)[6])a, power);
        const double next_c = w.x * power[0] - w.y * power[1];
        const double next_s = w.x * power[1] + w.y * power[0];
        for (int j = 5; j > 1; j--) {
            power[j] = power[j - 2];
        }
        power[0] = next_c;
        power[1] = next_s;
        r += 2 * (top - m + 1);
        c += 6 * (top - m + 1);
    }
    shcdi_tangent_frame(w, &jet->t1, &jet->t2);
    const shcd_vec3 radial = along((const double(*)[3])e.g, w);
    jet->s = shcd_vec3_make(e.f[0], e.f[1], e.f[2]);
    jet->s1 = along((const double(*)[3])e.g, jet->t1);
    jet->s2 = along((const double(*)[3])e.g, jet->t2);
    jet->s11 = shcd_sub(along_twice((const double(*)[3])e.h, jet->t1, jet->t1), radial);
    jet->s12 = along_twice((const double(*)[3])e.h, jet->t1, jet->t2);
    jet->s22 = shcd_sub(along_twice((const double(*)[3])e.h, jet->t2, jet->t2), radial);
}
