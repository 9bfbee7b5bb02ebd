/* SPDX-License-Identifier: BSD-3-Clause */
/* minimise over d: int [h G/(2 beta) (exp(beta |grad_S d|^2) - 1) + kappa |d|^2/2] dA
 *          subject to int g_a(w0) (d . n0) dA = -depth.
 *
 * d is -u n0 with a scalar u. The energy is strictly convex (a convex, increasing function of
 * |grad_S d|^2, plus kappa > 0 or an anchor), so the minimiser is unique; and neither the energy
 * nor the constraint changes when d is turned about n0 or mirrored in a plane through it, so the
 * minimiser is left in place by all of these, which only multiples of n0 are. One unknown function
 * instead of three.
 *
 * In the modes, u = sum_k q_k phi_k, the energy splits into the wave's own static energy and a
 * remainder, both convex:
 *   E = 1/2 sum_k D_k q_k^2 + G h int r(|grad_S u|^2) dA + W_res f^2/2, D_k = G h lambda_k + kappa,
 *   r(s) = (e^(beta s) - 1 - beta s)/(2 beta),
 * so that beta = 0 needs no quadrature, and an anchored region, which lambda_k contains, stays
 * linear. W_res is the compliance of the modes that are left out, in series: it carries the contact
 * force f and takes W_res f of the depth,
 *   sum_k c_k q_k + W_res f = depth, c_k = b_k phi_k(w0).
 * At beta = 0 this is depth^2/(2 (W_modes + W_res)). The part in series does not stiffen: fewer
 * modes, less stiffening; tests/fit/test_membrane.c measures it.
 *
 * Newton on (q, f) inside the constraint. Its linear systems are solved by conjugate gradients
 * preconditioned by D and projected onto the constraint (Gould, Hribar, Nocedal, SIAM J. Sci.
 * Comput. 23(4), 2001); the f component of a residual is a multiple of W_res throughout and is kept
 * divided by it, so that W_res = 0 is no special case. The multiplier at the minimum is
 * dU/d depth, and dU/dw = -F sum_k q_k b_k grad phi_k(w0) by the envelope theorem. */
#include "membrane.h"

#include "fail.h"
#include "membrane_grid.h"

#include "shcd/vec.h"

#include <gsl/gsl_sf_expint.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define NEWTON_MAX 100
#define PRODUCTS_MAX 400 /* of one Newton step */
#define HALVINGS_MAX 40
/* Newton stops where the step would lower the energy by less than this part of it: the amplitudes
 * are then within its root of the minimiser, in the norm of the energy. */
#define DECREMENT_MIN 1e-20
/* beta |grad u|^2 of the start: each step takes about 1 off where it is large. */
#define EXPONENT_MAX 30.0

static const double pi = 3.14159265358979324;

struct shcdi_membrane {
    shcdi_membrane_material material;
    size_t n_modes, n_harmonics, n_nodes;
    int degree;
    const shcd_modes *modes; /* borrowed */
    shcdi_membrane_grid *grid;
    double tension, residual;  /* G h [N/m], W_res [m/N] */
    double *d, *patch;         /* D_k, b_k */
    double *phi, *slope, *c;   /* at the contact: phi_k, its gradient (3 each), c_k */
    double compliance;         /* sum c_k^2/D_k + W_res */
    double *y, *dy;            /* harmonics and their gradients there */
    double *ux, *uy, *px, *py; /* at the nodes: grad u, grad of a direction */
    double *gradient, *step, *r, *z, *p, *hp, *trial; /* in the modes */
};

void shcdi_membrane_match(shcdi_membrane_material *m) {
    const double ratio = 0.5 * m->patch_radius_m / m->support_length_m, x = ratio * ratio;
    const double shear = m->young_pa / (2.0 * (1.0 + m->poisson));
    m->thickness_m = m->patch_radius_m * gsl_sf_expint_E1_scaled(x) / (pi * (1.0 - m->poisson));
    m->foundation_n_per_m3 = shear * m->thickness_m / (m->support_length_m * m->support_length_m);
}

/* ---- making one ---- */

void shcdi_membrane_free(shcdi_membrane *m) {
    if (m != NULL) {
        shcdi_membrane_grid_free(m->grid);
        free(m->d);
        free(m->y);
        free(m->ux);
        free(m);
    }
}

static shcd_status allocate(shcdi_membrane *m) {
    const size_t n = m->n_modes;
    double *p = calloc(15 * n, sizeof *p);
    m->d = p;
    m->y = malloc(4 * m->n_harmonics * sizeof *m->y);
    m->ux = malloc(4 * m->n_nodes * sizeof *m->ux);
    if (p == NULL || m->y == NULL || m->ux == NULL) {
        return SHCD_ERR_MEMORY;
    }
    double **const piece[] = {&m->patch, &m->phi, &m->c, &m->gradient, &m->step,
                              &m->r,     &m->z,   &m->p, &m->hp,       &m->trial};
    for (size_t i = 0; i < sizeof piece / sizeof piece[0]; i++) {
        *piece[i] = p + (i + 1) * n;
    }
    m->slope = p + 11 * n; /* three for each mode */
    m->dy = m->y + m->n_harmonics;
    m->uy = m->ux + m->n_nodes;
    m->px = m->uy + m->n_nodes;
    m->py = m->px + m->n_nodes;
    return SHCD_OK;
}

/* e^x E1(sigma^2 (4 pi N/A + 1/l^2))/(4 pi G h): the spectrum beyond the N-th eigenvalue by Weyl's
 * law, DESIGN of `wave`; 0 once the argument underflows. */
static double residual_of(const shcdi_membrane *m) {
    const double l2 = m->material.support_length_m * m->material.support_length_m;
    const double sigma = 0.5 * m->material.patch_radius_m, sigma2 = sigma * sigma;
    const double cut = sigma2 * 4.0 * pi * (double)m->n_modes / m->modes->area_m2;
    /* e^x E1(cut + x) = e^-cut (scaled E1)(cut + x) */
    return exp(-cut) * gsl_sf_expint_E1_scaled(cut + sigma2 / l2) / (4.0 * pi * m->tension);
}

static void fill_modes(shcdi_membrane *m) {
    const double sigma = 0.5 * m->material.patch_radius_m;
    for (size_t k = 0; k < m->n_modes; k++) {
        const double lambda = m->modes->eigenvalue_per_m2[k];
        m->d[k] = m->tension * lambda + m->material.foundation_n_per_m3;
        m->patch[k] = exp(-0.5 * sigma * sigma * lambda);
    }
    m->residual = residual_of(m);
}

shcd_status shcdi_membrane_create(const shcd_model *model, const shcd_modes *modes, size_t n_modes,
                                  const shcdi_membrane_material *material, size_t n_latitudes,
                                  shcdi_membrane **membrane, shcd_error *error) {
    if (n_modes < 1 || n_modes > modes->n_modes) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT,
                              "membrane: %zu modes are wanted, the body has %zu", n_modes,
                              modes->n_modes);
    }
    shcdi_membrane *m = calloc(1, sizeof *m);
    if (m == NULL) {
        return shcdi_fit_fail(error, SHCD_ERR_MEMORY, "membrane: out of memory");
    }
    m->material = *material;
    m->n_modes = n_modes;
    m->degree = shcd_model_degree(model);
    m->n_harmonics = SHCD_COUNT(m->degree);
    m->modes = modes;
    m->tension = material->young_pa / (2.0 * (1.0 + material->poisson)) * material->thickness_m;
    n_latitudes = n_latitudes > 0 ? n_latitudes : 3 * ((size_t)m->degree + 1);
    shcd_status status = shcdi_membrane_grid_create(model, modes, n_modes, n_latitudes, &m->grid);
    if (status == SHCD_OK) {
        m->n_nodes = shcdi_membrane_grid_size(m->grid);
        status = allocate(m);
    }
    if (status != SHCD_OK) {
        shcdi_membrane_free(m);
        return shcdi_fit_fail(error, status, "membrane: %s",
                              status == SHCD_ERR_GEOMETRY
                                  ? "the surface is singular at a node of the quadrature"
                                  : shcd_status_string(status));
    }
    fill_modes(m);
    *membrane = m;
    return SHCD_OK;
}

double shcdi_membrane_residual(const shcdi_membrane *membrane) {
    return membrane->residual;
}

double shcdi_membrane_mode_stiffness(const shcdi_membrane *membrane, size_t k) {
    return membrane->d[k];
}

double shcdi_membrane_patch(const shcdi_membrane *membrane, size_t k) {
    return membrane->patch[k];
}

double shcdi_membrane_compliance(const shcdi_membrane *membrane) {
    return membrane->compliance;
}

const double *shcdi_membrane_phi(const shcdi_membrane *membrane) {
    return membrane->phi;
}

size_t shcdi_membrane_nodes(const shcdi_membrane *membrane) {
    return membrane->n_nodes;
}

void shcdi_membrane_dent(shcdi_membrane *membrane, const double *q, double *u) {
    shcdi_membrane_grid_values(membrane->grid, q, u);
}

shcd_status shcdi_membrane_touch(shcdi_membrane *m, shcd_vec3 parameter) {
    const shcd_status status = shcd_harmonics(m->degree, parameter, m->y, m->dy, NULL);
    if (status != SHCD_OK) {
        return status;
    }
    m->compliance = m->residual;
    for (size_t k = 0; k < m->n_modes; k++) {
        const double *v = m->modes->coefficient_per_m + k * m->n_harmonics;
        double value = 0.0, slope[3] = {0.0, 0.0, 0.0};
        for (size_t i = 0; i < m->n_harmonics; i++) {
            value += v[i] * m->y[i];
            for (size_t x = 0; x < 3; x++) {
                slope[x] += v[i] * m->dy[3 * i + x];
            }
        }
        m->phi[k] = value;
        memcpy(m->slope + 3 * k, slope, sizeof slope);
        m->c[k] = m->patch[k] * value;
        m->compliance += m->c[k] * m->c[k] / m->d[k];
    }
    return SHCD_OK;
}

/* ---- energy and its derivatives ---- */

static double dot(const double *a, const double *b, size_t n) {
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) {
        sum += a[i] * b[i];
    }
    return sum;
}

/* Energy without the part in series; grad u at the nodes is kept. */
static double energy_of(shcdi_membrane *m, const double *q, double *strain2_max) {
    const double beta = m->material.stiffening;
    double sum = 0.0;
    for (size_t k = 0; k < m->n_modes; k++) {
        sum += 0.5 * m->d[k] * q[k] * q[k];
    }
    shcdi_membrane_grid_gradient(m->grid, q, m->ux, m->uy);
    const double *area = shcdi_membrane_grid_area(m->grid);
    double rest = 0.0, most = 0.0;
    for (size_t i = 0; i < m->n_nodes; i++) {
        const double s = m->ux[i] * m->ux[i] + m->uy[i] * m->uy[i], x = beta * s;
        most = s > most ? s : most;
        rest += area[i] * (expm1(x) - x);
    }
    *strain2_max = most;
    return beta > 0.0 ? sum + m->tension * rest / (2.0 * beta) : sum;
}

/* Gradient in q, from the grad u that energy_of() left. */
static void gradient_of(shcdi_membrane *m, const double *q, double *gradient) {
    const double beta = m->material.stiffening, *area = shcdi_membrane_grid_area(m->grid);
    for (size_t k = 0; k < m->n_modes; k++) {
        gradient[k] = m->d[k] * q[k];
    }
    if (!(beta > 0.0)) {
        return;
    }
    for (size_t i = 0; i < m->n_nodes; i++) {
        const double s = m->ux[i] * m->ux[i] + m->uy[i] * m->uy[i];
        const double stress = m->tension * area[i] * expm1(beta * s);
        m->px[i] = stress * m->ux[i];
        m->py[i] = stress * m->uy[i];
    }
    shcdi_membrane_grid_gather(m->grid, m->px, m->py, gradient);
}

/* out = Hessian p. */
static void product_of(shcdi_membrane *m, const double *p, double *out) {
    const double beta = m->material.stiffening, *area = shcdi_membrane_grid_area(m->grid);
    for (size_t k = 0; k < m->n_modes; k++) {
        out[k] = m->d[k] * p[k];
    }
    if (!(beta > 0.0)) {
        return;
    }
    shcdi_membrane_grid_gradient(m->grid, p, m->px, m->py);
    for (size_t i = 0; i < m->n_nodes; i++) {
        const double ux = m->ux[i], uy = m->uy[i], x = beta * (ux * ux + uy * uy);
        const double along = 2.0 * beta * exp(x) * (ux * m->px[i] + uy * m->py[i]);
        const double scale = m->tension * area[i], all = expm1(x);
        m->px[i] = scale * (all * m->px[i] + along * ux);
        m->py[i] = scale * (all * m->py[i] + along * uy);
    }
    shcdi_membrane_grid_gather(m->grid, m->px, m->py, out);
}

/* ---- Newton's step inside the constraint ---- */

/* The projected preconditioner: z = D^-1 (r - c y), y the multiplier. What it takes off r, a
 * multiple of the constraint, is taken off for good: near the minimum r would else be F c plus
 * little, and the difference would drown in rounding. @return y */
static double project(const shcdi_membrane *m, double *r, double *rf, double *z) {
    double y = m->residual * *rf;
    for (size_t k = 0; k < m->n_modes; k++) {
        y += m->c[k] * r[k] / m->d[k];
    }
    y /= m->compliance;
    for (size_t k = 0; k < m->n_modes; k++) {
        r[k] -= m->c[k] * y;
        z[k] = r[k] / m->d[k];
    }
    *rf -= y;
    return y;
}

/* Moves (q, f) back onto c . q + W_res f = depth, from which rounding takes it. */
static void restore(const shcdi_membrane *m, double depth_m, double *q, double *f) {
    const double missing = (depth_m - dot(m->c, q, m->n_modes) - m->residual * *f) / m->compliance;
    for (size_t k = 0; k < m->n_modes; k++) {
        q[k] += m->c[k] / m->d[k] * missing;
    }
    *f += missing;
}

/* Solves H (step, step_f) = -(gradient, W_res f) inside the constraint to `tolerance` of the first
 * residual. @return gradient . D^-1 gradient of the projected residual, which is at least Newton's
 * decrement, since H >= D; at most `enough` and no step was made. force: the multiplier. */
static double newton_step(shcdi_membrane *m, double f, double tolerance, double enough,
                          double *step_f, double *force, int *n_products) {
    const size_t n = m->n_modes;
    const double w = m->residual;
    double rf = f, pf;
    memcpy(m->r, m->gradient, n * sizeof *m->r);
    memset(m->step, 0, n * sizeof *m->step);
    *step_f = 0.0;
    *force = project(m, m->r, &rf, m->z);
    double rz = dot(m->r, m->z, n) + w * rf * rf;
    const double first = rz;
    if (!(first > enough)) {
        return first;
    }
    for (size_t k = 0; k < n; k++) {
        m->p[k] = -m->z[k];
    }
    pf = -rf;
    for (int i = 0; i < PRODUCTS_MAX && rz > tolerance * tolerance * first; i++) {
        product_of(m, m->p, m->hp);
        ++*n_products;
        const double curvature = dot(m->p, m->hp, n) + w * pf * pf;
        if (!(curvature > 0.0)) {
            break; /* rounding; what was found so far is a descent direction */
        }
        const double alpha = rz / curvature;
        for (size_t k = 0; k < n; k++) {
            m->step[k] += alpha * m->p[k];
            m->r[k] += alpha * m->hp[k];
        }
        *step_f += alpha * pf;
        rf += alpha * pf;
        (void)project(m, m->r, &rf, m->z);
        const double next = dot(m->r, m->z, n) + w * rf * rf, beta = next / rz;
        rz = next;
        for (size_t k = 0; k < n; k++) {
            m->p[k] = beta * m->p[k] - m->z[k];
        }
        pf = beta * pf - rf;
    }
    return first;
}

/* ---- the minimum ---- */

/* A start inside the constraint: the given amplitudes or the linear ones, made smaller where the
 * exponential would be out of hand; f takes what is missing. */
static double start_at(shcdi_membrane *m, double depth_m, double start_depth_m, double *q) {
    double scale = depth_m / start_depth_m, strain2;
    if (!(start_depth_m > 0.0)) {
        for (size_t k = 0; k < m->n_modes; k++) {
            q[k] = m->c[k] / (m->d[k] * m->compliance) * depth_m;
        }
        scale = 1.0;
    }
    (void)energy_of(m, q, &strain2);
    const double exponent = m->material.stiffening * strain2 * scale * scale;
    if (exponent > EXPONENT_MAX && m->residual > 0.0) {
        scale *= sqrt(EXPONENT_MAX / exponent);
    }
    for (size_t k = 0; k < m->n_modes; k++) {
        q[k] *= scale;
    }
    double f = m->residual > 0.0 ? (depth_m - dot(m->c, q, m->n_modes)) / m->residual : 0.0;
    restore(m, depth_m, q, &f);
    return f;
}

/* Lowers the energy along the step; @return the new energy, NAN if no length does. */
static double search(shcdi_membrane *m, double energy, double decrement, double step_f, double *q,
                     double *f, double *strain2) {
    double length = 1.0;
    for (int i = 0; i < HALVINGS_MAX; i++, length *= 0.5) {
        for (size_t k = 0; k < m->n_modes; k++) {
            m->trial[k] = q[k] + length * m->step[k];
        }
        const double ft = *f + length * step_f;
        const double found = energy_of(m, m->trial, strain2) + 0.5 * m->residual * ft * ft;
        /* near the minimum the change drowns in the energy's rounding: the full step is right */
        if (found <= energy || (i == 0 && decrement < 1e-11 * energy)) {
            memcpy(q, m->trial, m->n_modes * sizeof *q);
            *f = ft;
            return found;
        }
    }
    return (double)NAN;
}

shcd_status shcdi_membrane_press(shcdi_membrane *m, double depth_m, double start_depth_m, double *q,
                                 shcdi_indentation *out) {
    const double w = m->residual;
    double f = start_at(m, depth_m, start_depth_m, q), strain2 = 0.0, step_f = 0.0;
    double energy = energy_of(m, q, &strain2) + 0.5 * w * f * f;
    double tolerance = 0.1;
    *out = (shcdi_indentation){0};
    for (;;) {
        gradient_of(m, q, m->gradient);
        if (!(energy - energy == 0.0) || out->n_newton == NEWTON_MAX) {
            return SHCD_ERR_CONVERGENCE;
        }
        const double enough = DECREMENT_MIN * energy;
        const double decrement =
            newton_step(m, f, tolerance, enough, &step_f, &out->force_n, &out->n_products);
        if (!(decrement > enough)) {
            break;
        }
        energy = search(m, energy, decrement, step_f, q, &f, &strain2);
        restore(m, depth_m, q, &f);
        out->n_newton++;
        /* the residual of the next step is about the square of this one's: no need to go below */
        tolerance = fmax(1e-6, fmin(0.1, sqrt(decrement / energy)));
    }
    out->energy_j = energy;
    out->strain2_max = strain2;
    for (size_t k = 0; k < m->n_modes; k++) {
        const double share = -out->force_n * q[k] * m->patch[k];
        const double *s = m->slope + 3 * k;
        out->torque_n = shcd_mul_add(out->torque_n, share, shcd_vec3_make(s[0], s[1], s[2]));
    }
    return SHCD_OK;
}
