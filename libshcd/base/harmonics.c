/* SPDX-License-Identifier: BSD-3-Clause */
/* Real spherical harmonics, their tangential gradients and covariant Hessians at one direction.
 *
 * Y_lm(x, y, z) = Q_lm(z) C_m(x, y) with C_m + i S_m = (x + i y)^m and Q_lm proportional to the
 * m-th derivative of the Legendre polynomial: polynomials, hence no pole and no division by
 * sin(theta). With the normalisation inside Q (fully normalised, factor sqrt(2) for m > 0):
 *
 *   Q_mm = sqrt((2m+1)/(2m)) Q_{m-1,m-1},   Q_lm = a_lm (z Q_{l-1,m} - b_lm Q_{l-2,m}),
 *   a_lm^2 = (4 l^2 - 1)/(l^2 - m^2),       b_lm^2 = ((l-1)^2 - m^2)/(4 (l-1)^2 - 1)
 *
 * (Holmes and Featherstone, J. Geodesy 76, 2002, sections 2 and 3; the sin^m that they factor out
 * for range is C_m and S_m here: up to degree 150 both stay far inside the range of double).
 *
 * Near a pole z loses the angle: a rounding of z by 1e-16 moves theta by 1e-16/sin(theta), 3e-13 in
 * the value at degree 150 and theta = 0.05. So z is carried as z + zl, from x and y; and nearest to
 * the pole, where the recurrence in z itself amplifies its roundings, the polynomials scaled to 1
 * at the pole, G_l = Q_lm/Q_lm(1), are advanced by their differences in u = 1 - |z| = (x^2 +
 * y^2)/(1 + |z|):
 *
 *   (l+m) (G_l - G_{l-1}) = (l-1-m) (G_{l-1} - G_{l-2}) - (2l-1) u G_{l-1},
 *   Q_lm(1)/Q_{l-1,m}(1) = sqrt((2l+1)(l+m)/((2l-1)(l-m)))
 *
 * (Reinsch's modification, here for every order m). Away from the pole that form cancels: its error
 * relative to the first can grow like exp(l theta/2), 400 at the switch for l = 150.
 */
#include "base/harmonics.h"

/* 1/sqrt(4 pi) */
#define Q_00 0.28209479177387814

typedef struct basis_output {
    double *y, *gradient, *hessian;
} basis_output;

/* sin^2(theta) below which the difference form is used: theta = 0.08. */
#define POLAR_SIN2 0.0064

/* Q_lm and two derivatives in z for one order m, degree advancing. */
typedef struct column {
    double q[3];      /* Q, Q', Q'' */
    double before[3]; /* interior: of degree l - 1; polar: G_l - G_{l-1} and derivatives */
    double g[3];      /* polar: G and derivatives in |z| */
    double pole;      /* polar: Q_lm(1) */
} column;

typedef struct position {
    double z, zl; /* z = cos(theta) to twice the precision: z + zl */
    double u;     /* 1 - |z| */
    int is_polar;
} position;

static position position_of(shcd_vec3 w) {
    position at = {w.z, 0.0, 0.0, 0};
    const double sin2 = w.x * w.x + w.y * w.y;
    if (sin2 < 0.75) {
        /* from x and y, which keep the angle where z has lost it */
        const double sign = w.z < 0.0 ? -1.0 : 1.0;
        at.u = sin2 / (1.0 + fabs(w.z));
        at.z = 1.0 - at.u;
        at.zl = sign * ((1.0 - at.z) - at.u);
        at.z *= sign;
        at.is_polar = sin2 < POLAR_SIN2;
    }
    return at;
}

static column column_start(double q_mm) {
    const column c = {{q_mm, 0.0, 0.0}, {0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, q_mm};
    return c;
}

static void column_next_interior(column *c, int l, int m, position at) {
    const double a = shcdi_recurrence_a(l, m);
    const double b = shcdi_recurrence_b(l, m);
    const double n0 = a * (at.z * c->q[0] + (at.zl * c->q[0] - b * c->before[0]));
    const double n1 = a * (at.z * c->q[1] + (c->q[0] + at.zl * c->q[1] - b * c->before[1]));
    const double n2 = a * (at.z * c->q[2] + (2.0 * c->q[1] + at.zl * c->q[2] - b * c->before[2]));
    for (int k = 0; k < 3; k++) {
        c->before[k] = c->q[k];
    }
    c->q[0] = n0;
    c->q[1] = n1;
    c->q[2] = n2;
}

static void column_next_polar(column *c, int l, int m, position at) {
    const double n = 2.0 * l - 1.0;
    const double k1 = (double)(l - 1 - m);
    const double d[3] = {k1 * c->before[0] - n * (at.u * c->g[0]),
                         k1 * c->before[1] - n * (at.u * c->g[1] - c->g[0]),
                         k1 * c->before[2] - n * (at.u * c->g[2] - 2.0 * c->g[1])};
    c->pole *= sqrt((2.0 * l + 1.0) * (l + m) / (n * (l - m)));
    const int odd = (l - m) % 2 != 0;
    for (int k = 0; k < 3; k++) {
        c->before[k] = d[k] / (double)(l + m);
        c->g[k] += c->before[k];
        /* parity: Q_lm(-z) = (-1)^(l-m) Q_lm(z), one more sign for each derivative */
        const double sign = at.z < 0.0 && (odd != (k % 2 != 0)) ? -1.0 : 1.0;
        c->q[k] = sign * c->pole * c->g[k];
    }
}

/* G - w (w . G) = (w x G) x w: without the cancellation of the first form, whose radial part grows
 * like l^2 near the poles while the tangential part stays below l. */
static shcd_vec3 tangential(shcd_vec3 w, shcd_vec3 g) {
    return shcd_cross(shcd_cross(w, g), w);
}

/* Covariant Hessian P H P - (w . G) P of the restriction to the sphere of a function with Euclidean
 * gradient G and Hessian H (xx, xy, xz, yy, yz, zz); P = I - w w^T, applied as above: near the
 * poles w.H.w grows like l^4, what remains stays below l^2. */
static void covariant_hessian(shcd_vec3 w, shcd_vec3 g, const double h[6], double out[6]) {
    const shcd_vec3 a = tangential(w, shcd_vec3_make(h[0], h[1], h[2]));
    const shcd_vec3 b = tangential(w, shcd_vec3_make(h[1], h[3], h[4]));
    const shcd_vec3 c = tangential(w, shcd_vec3_make(h[2], h[4], h[5]));
    const shcd_vec3 x = tangential(w, shcd_vec3_make(a.x, b.x, c.x));
    const shcd_vec3 y = tangential(w, shcd_vec3_make(a.y, b.y, c.y));
    const shcd_vec3 z = tangential(w, shcd_vec3_make(a.z, b.z, c.z));
    const double wg = shcd_dot(w, g);
    out[0] = x.x - wg * (w.y * w.y + w.z * w.z);
    out[1] = 0.5 * (x.y + y.x) + wg * w.x * w.y;
    out[2] = 0.5 * (x.z + z.x) + wg * w.x * w.z;
    out[3] = y.y - wg * (w.x * w.x + w.z * w.z);
    out[4] = 0.5 * (y.z + z.y) + wg * w.y * w.z;
    out[5] = z.z - wg * (w.x * w.x + w.y * w.y);
}

/* Powers (x + i y)^m and their derivatives: d/dx (x+iy)^m = m (x+iy)^(m-1), d/dy = i m
 * (x+iy)^(m-1). */
typedef struct power {
    double c, s;   /* m */
    double c1, s1; /* m - 1 */
    double c2, s2; /* m - 2 */
} power;

/* One harmonic Q(z) T(x, y) with T = C_m or S_m; tx.. are the derivatives of T. */
static void put(const basis_output *out, size_t i, shcd_vec3 w, const double q[3], double t,
                double tx, double ty, double txx, double txy, double tyy) {
    const shcd_vec3 g = {q[0] * tx, q[0] * ty, q[1] * t};
    if (out->y != NULL) {
        out->y[i] = q[0] * t;
    }
    if (out->gradient != NULL) {
        const shcd_vec3 tangent = tangential(w, g);
        out->gradient[3 * i] = tangent.x;
        out->gradient[3 * i + 1] = tangent.y;
        out->gradient[3 * i + 2] = tangent.z;
    }
    if (out->hessian != NULL) {
        const double h[6] = {q[0] * txx, q[0] * txy, q[1] * tx, q[0] * tyy, q[1] * ty, q[2] * t};
        covariant_hessian(w, g, h, out->hessian + 6 * i);
    }
}

static void put_pair(const basis_output *out, int l, int m, shcd_vec3 w, const double q[3],
                     const power *p) {
    const double n = (double)m;
    const double nn = n * (n - 1.0);
    put(out, SHCD_INDEX(l, m), w, q, p->c, n * p->c1, -n * p->s1, nn * p->c2, -nn * p->s2,
        -nn * p->c2);
    if (m > 0) {
        put(out, SHCD_INDEX(l, -m), w, q, p->s, n * p->s1, n * p->c1, nn * p->s2, nn * p->c2,
            -nn * p->s2);
    }
}

shcd_status shcd_harmonics(int degree, shcd_vec3 direction, double *y, double *gradient,
                           double *hessian) {
    if (degree < 0 || degree > SHCD_DEGREE_MAX) {
        return SHCD_ERR_ARGUMENT;
    }
    shcd_vec3 w;
    const shcd_status status = shcdi_direction(direction, &w);
    if (status != SHCD_OK) {
        return status;
    }
    const position at = position_of(w);
    const basis_output out = {y, gradient, hessian};
    power p = {1.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    double q_mm = Q_00;
    for (int m = 0; m <= degree; m++) {
        column c = column_start(q_mm);
        put_pair(&out, m, m, w, c.q, &p);
        for (int l = m + 1; l <= degree; l++) {
            if (at.is_polar) {
                column_next_polar(&c, l, m, at);
            } else {
                column_next_interior(&c, l, m, at);
            }
            put_pair(&out, l, m, w, c.q, &p);
        }
        q_mm *= shcdi_recurrence_diagonal(m + 1);
        p = (power){w.x * p.c - w.y * p.s, w.x * p.s + w.y * p.c, p.c, p.s, p.c1, p.s1};
    }
    return SHCD_OK;
}
