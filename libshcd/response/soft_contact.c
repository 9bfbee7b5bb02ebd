/* SPDX-License-Identifier: BSD-3-Clause */
/* The contacts of a soft body, solved together and implicitly.
 *
 * With the tools held, a force f_j along the normal n_j, kept over the tick, lowers the surface
 * under contact i by W_ij f_j at its end,
 *
 *   W_ij = (n_i . n_j) sum_k (b_k phi_k(w_i)) (b_k phi_k(w_j)) c_k/(rho h) + delta_ij W_res,
 *
 * a symmetric, positive semidefinite matrix (a Gram matrix of vectors n_i (x) phi(w_i)). Each
 * contact has a law F(indentation), increasing, and the depth d_i against the freely moved surface:
 *
 *   f_i >= 0,  indentation(f_i) + sum_j W_ij f_j = d_i, or f_i = 0 where the left side is larger:
 *
 * the stationary point of a convex energy, which relaxing one contact at a time approaches
 * monotonously (Gauss-Seidel). One contact takes one pass, and there is no stiffness and no tick
 * for which it diverges.
 *
 * The walls of one ball share one law as on a rigid body (walls.c), and are relaxed together. With
 * d' = d - W f what is left of their depths, the law gets D = sqrt(m . A m) at the m of d', and
 * wall i the force F(D) m_i/D: as D dD = m . dd', that is the gradient of the law's energy at D
 * over d', for any law. So f = s m, s = F(D)/D, and
 *
 *   m >= 0,  (A + s W) m >= d,  m_i ((A + s W) m - d)_i = 0,                                  (1)
 *   s D(s) = F(D(s)).                                                                         (2)
 *
 * With (1), d(m . A m)/ds = -2 m . A (A + s W)^-1 W m <= 0, the matrix being the parallel sum of A
 * and W where s is one, and d(s^2 m . A m)/ds = 2 s m . A (A + s W)^-1 A m >= 0, each over the
 * walls with a force: in (2) the left side does not fall and the right one does not rise, so that
 * the root is between any s of which one is the larger and one of which the other is. The next s is
 * that of one contact with the direction m/D of now, its depth m . d/D and its compliance
 * m . W m/D^2; for a linear law it is s at once. (Where A has a negative eigenvalue, as three walls
 * may have it, the bracket still closes, on a root of (2).)
 *
 * Without a law a contact is a constraint, f_i >= 0 and W f >= d: A does not occur, (1) with W
 * alone in place of A + s W gives the forces themselves. */
#include "response/walls.h"

#define SWEEPS_MAX 64
/* Forces that change by less than this share of the largest are settled, and ... */
#define SETTLED 1e-12
/* ... by less than this when the sweeps end, good enough not to be reported. */
#define GOOD_ENOUGH 1e-6

/* Steps of s, of which the later ones halve its bracket in turns, and the share of the force by
 * which two answers for it may differ. */
#define STEPS_MAX 64
#define ROOT 0x1p-48
/* Walls that differ less, as a share of the diagonal that the others leave, are one. */
#define SINGULAR 1e-9

/* Matrix among the contacts of a body. */
typedef double matrix[SHCDI_PRESSES_MAX][SHCDI_PRESSES_MAX];

/* The forces of all contacts, and what is known of them. */
typedef struct relaxation {
    const shcdi_soft_parts *parts;
    const shcdi_active_effect *law; /* NULL: rigid */
    double gain;                    /* of the force */
    matrix w;
    double force_n[SHCDI_PRESSES_MAX];
    double stored_j[SHCDI_PRESSES_MAX];
    bool is_alone; /* one block: nothing to sweep again for */
} relaxation;

typedef struct square {
    double at[SHCDI_WALLS_MAX][SHCDI_WALLS_MAX];
} square;

/* The walls of one tool, or one other contact. */
typedef struct block {
    size_t of[SHCDI_WALLS_MAX], n;
    double depth_m[SHCDI_WALLS_MAX]; /* under the forces of all others */
    square a, w;
} block;

/* (b phi)_i . C (b phi)_j/(rho h): what a unit force at j moves the surface at i, along the force
 */
static double compliance(const shcdi_soft *soft, const shcdi_soft_parts *p, size_t i, size_t j) {
    const double *a = p->at + i * soft->n_modes, *b = p->at + j * soft->n_modes;
    double sum = 0.0;
    for (size_t k = 0; k < soft->n_modes; k++) {
        sum += a[k] * b[k] * p->propagator[k].forced_q_s2;
    }
    return sum / soft->mass_kg_per_m2;
}

static void fill(const shcdi_soft *soft, const shcdi_soft_parts *p, double gain, matrix w) {
    for (size_t i = 0; i < p->head->n_presses; i++) {
        for (size_t j = 0; j <= i; j++) {
            w[i][j] = w[j][i] = gain * gain * compliance(soft, p, i, j) *
                                shcd_dot(p->press[i].touch.normal, p->press[j].touch.normal);
        }
        w[i][i] += gain * gain * soft->residual_m_per_n;
    }
}

/* The whole force of a contact, its share included, at a depth under the compliance w. */
static double force_at(const shcdi_press *press, const shcdi_active_effect *law, double gain,
                       double depth_m, double w, double *stored_j) {
    *stored_j = 0.0;
    if (!(depth_m > 0.0)) {
        return 0.0;
    }
    if (law == NULL) {
        return w > 0.0 ? gain * depth_m / w : 0.0;
    }
    /* g f(indentation): the law under g w, times g */
    const double g = gain * press->share;
    const double f = law->effect->press(law->constants, &press->touch, depth_m, g * w, stored_j);
    *stored_j *= gain;
    return g * f;
}

/* ---- one block ------------------------------------------------------------------------------ */

/* The next block, from contact i on: walls of one tool are noted one after the other. */
static block block_at(const relaxation *r, size_t i) {
    const shcdi_press *p = r->parts->press;
    block b = {.n = 0};
    do {
        b.of[b.n++] = i++;
    } while (i < r->parts->head->n_presses && b.n < SHCDI_WALLS_MAX && p[i].is_wall &&
             p[i - 1].is_wall && p[i].tool == p[i - 1].tool);
    for (size_t j = 0; j < b.n; j++) {
        const shcdi_wall wall = {.normal = p[b.of[j]].touch.normal};
        b.depth_m[j] = p[b.of[j]].response.depth_m;
        for (size_t k = 0; k < r->parts->head->n_presses; k++) {
            b.depth_m[j] -=
                k < b.of[0] || k > b.of[b.n - 1] ? r->w[b.of[j]][k] * r->force_n[k] : 0.0;
        }
        for (size_t k = 0; k < b.n; k++) {
            const shcdi_wall other = {.normal = p[b.of[k]].touch.normal};
            double rate;
            b.a.at[j][k] = j == k ? 1.0 : shcdi_wall_coupling(&wall, &other, &rate);
            b.w.at[j][k] = r->w[b.of[j]][b.of[k]];
        }
    }
    return b;
}

/* (1) with the contacts of a set alone. @return whether its matrix is regular and m >= 0 */
static bool solve_set(const block *b, const square *q, unsigned set, double m[SHCDI_WALLS_MAX]) {
    double l[SHCDI_WALLS_MAX][SHCDI_WALLS_MAX + 1]; /* and the right side */
    for (size_t i = 0; i < b->n; i++) {
        const bool is_in = (set >> i & 1u) != 0;
        for (size_t j = 0; j < b->n; j++) {
            l[i][j] = is_in && (set >> j & 1u) != 0 ? q->at[i][j] : i == j ? 1.0 : 0.0;
        }
        l[i][b->n] = is_in ? b->depth_m[i] : 0.0;
    }
    for (size_t k = 0; k < b->n; k++) {
        if (!(l[k][k] > ((set >> k & 1u) != 0 ? SINGULAR * q->at[k][k] : 0.0))) {
            return false;
        }
        for (size_t i = k + 1; i < b->n; i++) {
            const double share = l[i][k] / l[k][k];
            for (size_t j = k; j <= b->n; j++) {
                l[i][j] -= share * l[k][j];
            }
        }
    }
    bool is_positive = true;
    for (size_t i = b->n; i-- > 0;) {
        m[i] = l[i][b->n];
        for (size_t j = i + 1; j < b->n; j++) {
            m[i] -= l[i][j] * m[j];
        }
        m[i] /= l[i][i];
        is_positive = is_positive && m[i] >= 0.0;
    }
    return is_positive;
}

/* The solution of (1) with the largest 2 m . d - m . Q m = m . d, as in walls.c. */
static void solve(const block *b, const square *q, double m[SHCDI_WALLS_MAX]) {
    double best = 0.0;
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        m[i] = 0.0;
    }
    for (unsigned set = 1; set < 1u << b->n; set++) {
        double try[SHCDI_WALLS_MAX], value = 0.0;
        if (!solve_set(b, q, set, try)) {
            continue;
        }
        for (size_t i = 0; i < b->n; i++) {
            value += try[i] * b->depth_m[i];
        }
        if (value > best) {
            best = value;
            for (size_t i = 0; i < b->n; i++) {
                m[i] = try[i];
            }
        }
    }
}

static double form(const block *b, const square *q, const double m[SHCDI_WALLS_MAX]) {
    double sum = 0.0;
    for (size_t i = 0; i < b->n; i++) {
        for (size_t j = 0; j < b->n; j++) {
            sum += m[i] * q->at[i][j] * m[j];
        }
    }
    return sum;
}

/* Rigid contacts; of a gain below one each yields in that proportion. */
static void press_rigid(const relaxation *r, const block *b, double force_n[]) {
    square q = b->w;
    for (size_t i = 0; i < b->n; i++) {
        force_n[i] = 0.0;
        q.at[i][i] /= r->gain > 0.0 ? r->gain : 1.0;
    }
    if (r->gain > 0.0) {
        solve(b, &q, force_n);
    }
}

/* The root of (2). */
static void press_walls(const relaxation *r, const block *b, double force_n[], double stored_j[]) {
    const shcdi_press *press = &r->parts->press[b->of[0]];
    double m[SHCDI_WALLS_MAX], low = 0.0, high = HUGE_VAL, s = 0.0;
    double depth_m = 0.0, f = 0.0, energy_j = 0.0;
    for (int n = 0; n < STEPS_MAX; n++) {
        square q;
        for (size_t i = 0; i < b->n; i++) {
            for (size_t j = 0; j < b->n; j++) {
                q.at[i][j] = b->a.at[i][j] + s * b->w.at[i][j];
            }
        }
        solve(b, &q, m);
        depth_m = sqrt(form(b, &b->a, m));
        if (!(depth_m > 0.0)) {
            break;
        }
        const double w = form(b, &b->w, m) / (depth_m * depth_m);
        const double whole_m = depth_m * (1.0 + s * w); /* m . d/D, by (1) */
        f = force_at(press, r->law, r->gain, whole_m, w, &energy_j);
        if (fabs(f - s * depth_m) <= ROOT * f) {
            break;
        }
        const double left_m = whole_m - w * f;
        double next = left_m > 0.0 ? f / left_m : HUGE_VAL;
        low = next > s ? shcdi_max(low, s) : low;
        high = next > s ? high : shcdi_min(high, s);
        if (!(next > low && next < high) || (n % 2 == 1 && n > STEPS_MAX / 4 && high < HUGE_VAL)) {
            next = high < HUGE_VAL ? 0.5 * (low + high) : 2.0 * low + f / whole_m;
        }
        s = next;
    }
    for (size_t i = 0; i < b->n; i++) {
        const double share = depth_m > 0.0 ? m[i] / depth_m : 0.0;
        double left_m = 0.0; /* d'_i of a wall with a force: (A m)_i, by (1) */
        for (size_t j = 0; j < b->n; j++) {
            left_m += b->a.at[i][j] * m[j];
        }
        force_n[i] = f * share;
        stored_j[i] = depth_m > 0.0 ? energy_j * share * left_m / depth_m : 0.0;
    }
}

/* ---- all contacts --------------------------------------------------------------------------- */

/* @return by which share of the largest force one has changed */
static double sweep(relaxation *r) {
    double change = 0.0, largest = 0.0;
    for (size_t i = 0; i < r->parts->head->n_presses;) {
        const block b = block_at(r, i);
        double f[SHCDI_WALLS_MAX];
        if (b.n == 1) {
            f[0] = force_at(&r->parts->press[i], r->law, r->gain, b.depth_m[0], b.w.at[0][0],
                            &r->stored_j[i]);
        } else if (r->law == NULL) {
            press_rigid(r, &b, f);
        } else {
            press_walls(r, &b, f, &r->stored_j[i]);
        }
        for (size_t k = 0; k < b.n; k++, i++) {
            change = shcdi_max(change, fabs(f[k] - r->force_n[i]));
            largest = shcdi_max(largest, f[k]);
            r->force_n[i] = f[k];
        }
        r->is_alone = b.n == r->parts->head->n_presses;
    }
    return largest > 0.0 ? change / largest : change;
}

static void move(const shcdi_soft *soft, const shcdi_soft_parts *p, const double force[],
                 double gain) {
    for (size_t i = 0; i < p->head->n_presses; i++) {
        const double *at = p->at + i * soft->n_modes;
        const shcd_vec3 push =
            shcd_scale(-gain * force[i] / soft->mass_kg_per_m2, p->press[i].touch.normal);
        for (size_t k = 0; k < soft->n_modes; k++) {
            shcdi_soft_push(p, k, shcd_scale(at[k], push));
        }
        p->head->is_moving |= force[i] > 0.0;
    }
}

void shcdi_soft_press(const shcdi_soft *soft, unsigned char *memory, const shcdi_active_effect *law,
                      shcdi_soft_gain gain) {
    const shcdi_soft_parts p = shcdi_soft_parts_of(soft, memory);
    relaxation r = {.parts = &p, .law = law, .gain = gain.force};
    double change = HUGE_VAL, residual_j = 0.0;
    fill(soft, &p, gain.shown, r.w);
    for (int n = 0; n < SWEEPS_MAX && change > SETTLED; n++) {
        change = sweep(&r);
        change = r.is_alone ? 0.0 : change;
    }
    for (size_t i = 0; i < p.head->n_presses; i++) {
        shcdi_response *out = &p.press[i].response;
        out->normal_force_n = r.force_n[i] / p.press[i].share;
        out->stored_j += r.stored_j[i];
        out->flags |= change <= GOOD_ENOUGH ? 0u : (uint32_t)SHCD_TOOL_OUTPUT_TRUNCATED;
        residual_j +=
            0.5 * gain.shown * gain.shown * soft->residual_m_per_n * r.force_n[i] * r.force_n[i];
    }
    move(soft, &p, r.force_n, gain.shown);
    shcdi_soft_account(soft, memory);
    p.head->stored_j += residual_j;
}

shcd_vec3 shcdi_soft_motion(const shcdi_soft *soft, unsigned char *memory, size_t press,
                            double shown) {
    const shcdi_soft_parts p = shcdi_soft_parts_of(soft, memory);
    shcd_vec3 sum = {0.0, 0.0, 0.0};
    for (size_t j = 0; j < p.head->n_presses; j++) {
        const double force_n = p.press[j].share * p.press[j].response.normal_force_n;
        sum = shcd_mul_add(sum, -shown * shown * compliance(soft, &p, press, j) * force_n,
                           p.press[j].touch.normal);
    }
    return sum;
}
