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
/* Times that a law is withheld a part in a tick, by how much more than is missing, since what
 * yields lets the surface out, and what is left of it each time at least. */
#define WITHHOLDS_MAX 4
#define WITHHELD_MORE 1.25
#define KEPT_MIN 0.125
/* What must at least be let out, as a share of what is missing. */
#define HELPS 0.75

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

typedef double square[SHCDI_WALLS_MAX][SHCDI_WALLS_MAX];

/* The walls of one tool, or one other contact. */
typedef struct block {
    size_t of[SHCDI_WALLS_MAX];
    shcdi_wall_system a; /* depths under the forces of all others */
    square w;
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

/* What a held force yields goes with the square of a motion and half of this: how fast the law's
 * force rises with its own depth. Seen through the surface, which gives way by w, that is t/w (its
 * mean over a twentieth of the depth, which no tick goes by far), so that by itself it is
 * t/w/(1 - t). Where all is the membrane's, t = 1, each wall is one of its own, and twice as much,
 * since a tick's force acts on the modes from the tick's start with its value at the end. */
static double slope_at(const shcdi_press *press, const shcdi_active_effect *law, double gain,
                       size_t n_walls, double depth_m, double w, double f) {
    double unused;
    const double more_m = 0.05 * depth_m;
    const double slope =
        more_m > 0.0 ? (force_at(press, law, gain, depth_m + more_m, w, &unused) - f) / more_m
                     : 0.0;
    const double most = 2.0 * (double)n_walls, left = 1.0 - slope * w;
    return slope * (left * most > 1.0 ? 1.0 / left : most);
}

/* ---- one block ------------------------------------------------------------------------------ */

/* The next block, from contact i on: walls of one tool are noted one after the other. */
static block block_at(const relaxation *r, size_t i) {
    const shcdi_press *p = r->parts->press;
    shcdi_wall wall[SHCDI_WALLS_MAX];
    block b;
    size_t n = 0;
    do {
        b.of[n] = i;
        wall[n].normal = p[i].touch.normal;
        wall[n++].depth_m = p[i].response.depth_m;
        i++;
    } while (i < r->parts->head->n_presses && n < SHCDI_WALLS_MAX && p[i].is_wall &&
             p[i - 1].is_wall && p[i].tool == p[i - 1].tool);
    for (size_t j = 0; j < n; j++) {
        for (size_t k = 0; k < r->parts->head->n_presses; k++) {
            wall[j].depth_m -=
                k < b.of[0] || k > b.of[n - 1] ? r->w[b.of[j]][k] * r->force_n[k] : 0.0;
        }
        for (size_t k = 0; k < n; k++) {
            b.w[j][k] = r->w[b.of[j]][b.of[k]];
        }
    }
    b.a = shcdi_walls_couple(wall, (1u << n) - 1u);
    b.a.n = n;
    return b;
}

static double form(size_t n, const square q, const double m[SHCDI_WALLS_MAX]) {
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) {
        for (size_t j = 0; j < n; j++) {
            sum += m[i] * q[i][j] * m[j];
        }
    }
    return sum;
}

/* Rigid contacts; of a gain below one each yields in that proportion. */
static void press_rigid(const relaxation *r, const block *b, double force_n[]) {
    shcdi_wall_system q = b->a;
    for (size_t i = 0; i < q.n; i++) {
        force_n[i] = 0.0;
        for (size_t j = 0; j < q.n; j++) {
            q.at[i][j] = b->w[i][j];
        }
        q.at[i][i] /= r->gain > 0.0 ? r->gain : 1.0;
    }
    if (r->gain > 0.0) {
        (void)shcdi_walls_solve(&q, force_n);
    }
}

/* The root of (2). */
static void press_walls(const relaxation *r, const block *b, double force_n[], double stored_j[]) {
    shcdi_press *press = &r->parts->press[b->of[0]];
    const size_t n = b->a.n;
    double m[SHCDI_WALLS_MAX], low = 0.0, high = HUGE_VAL, s = 0.0;
    double depth_m = 0.0, f = 0.0, energy_j = 0.0;
    for (int step = 0; step < STEPS_MAX; step++) {
        shcdi_wall_system q = b->a;
        for (size_t i = 0; i < n; i++) {
            for (size_t j = 0; j < n; j++) {
                q.at[i][j] += s * b->w[i][j];
            }
        }
        (void)shcdi_walls_solve(&q, m);
        depth_m = sqrt(form(n, b->a.at, m));
        if (!(depth_m > 0.0)) {
            break;
        }
        const double w = form(n, b->w, m) / (depth_m * depth_m);
        const double whole_m = depth_m * (1.0 + s * w); /* m . d/D, by (1) */
        f = force_at(press, r->law, r->gain, whole_m, w, &energy_j);
        if (fabs(f - s * depth_m) <= ROOT * f) {
            break;
        }
        const double left_m = whole_m - w * f;
        double next = left_m > 0.0 ? f / left_m : HUGE_VAL;
        low = next > s ? shcdi_max(low, s) : low;
        high = next > s ? high : shcdi_min(high, s);
        if (!(next > low && next < high) ||
            (step % 2 == 1 && step > STEPS_MAX / 4 && high < HUGE_VAL)) {
            next = high < HUGE_VAL ? 0.5 * (low + high) : 2.0 * low + f / whole_m;
        }
        s = next;
    }
    const double w = depth_m > 0.0 ? form(n, b->w, m) / (depth_m * depth_m) : 0.0;
    const double slope = slope_at(press, r->law, r->gain, n, depth_m + w * f, w, f);
    for (size_t i = 0; i < n; i++) {
        const double share = depth_m > 0.0 ? m[i] / depth_m : 0.0;
        double left_m = 0.0; /* d'_i of a wall with a force: (A m)_i, by (1) */
        for (size_t j = 0; j < n; j++) {
            left_m += b->a.at[i][j] * m[j];
        }
        force_n[i] = f * share;
        stored_j[i] = depth_m > 0.0 ? energy_j * share * left_m / depth_m : 0.0;
        press[i].way_m = m[i];
        press[i].way_share = share;
        press[i].slope_n_per_m = slope;
    }
}

/* ---- all contacts --------------------------------------------------------------------------- */

/* @return by which share of the largest force one has changed */
static double sweep(relaxation *r) {
    double change = 0.0, largest = 0.0;
    for (size_t i = 0; i < r->parts->head->n_presses;) {
        const block b = block_at(r, i);
        double f[SHCDI_WALLS_MAX];
        if (b.a.n == 1) {
            shcdi_press *alone = &r->parts->press[i];
            f[0] = force_at(alone, r->law, r->gain, b.a.depth_m[0], b.w[0][0], &r->stored_j[i]);
            alone->way_m = shcdi_max(0.0, b.a.depth_m[0] - b.w[0][0] * f[0]);
            alone->way_share = 1.0;
            alone->slope_n_per_m =
                slope_at(alone, r->law, r->gain, 1, b.a.depth_m[0], b.w[0][0], f[0]);
        } else if (r->law == NULL) {
            press_rigid(r, &b, f);
        } else {
            press_walls(r, &b, f, &r->stored_j[i]);
        }
        for (size_t k = 0; k < b.a.n; k++, i++) {
            change = shcdi_max(change, fabs(f[k] - r->force_n[i]));
            largest = shcdi_max(largest, f[k]);
            r->force_n[i] = f[k];
        }
        r->is_alone = b.a.n == r->parts->head->n_presses;
    }
    return largest > 0.0 ? change / largest : change;
}

/* @return by which share of the largest force one has changed at last */
static double relax(relaxation *r) {
    double change = HUGE_VAL;
    for (int n = 0; n < SWEEPS_MAX && change > SETTLED; n++) {
        change = sweep(r);
        change = r->is_alone ? 0.0 : change;
    }
    return change;
}

/* What the forces accelerate the modes by. */
static void set_trial(const shcdi_soft *soft, const relaxation *r, double shown) {
    const shcdi_soft_parts *p = r->parts;
    const shcd_vec3 none = {0.0, 0.0, 0.0};
    for (size_t k = 0; k < soft->n_modes; k++) {
        p->trial[k] = none;
    }
    for (size_t i = 0; i < p->head->n_presses; i++) {
        const double *at = p->at + i * soft->n_modes;
        const shcd_vec3 push =
            shcd_scale(-shown * r->force_n[i] / soft->mass_kg_per_m2, p->press[i].touch.normal);
        for (size_t k = 0; k < soft->n_modes; k++) {
            p->trial[k] = shcd_mul_add(p->trial[k], at[k], push);
        }
        p->head->is_moving |= r->force_n[i] > 0.0;
    }
}

static double residual_energy(const shcdi_soft *soft, const relaxation *r, double shown) {
    double sum = 0.0;
    for (size_t i = 0; i < r->parts->head->n_presses; i++) {
        sum += r->force_n[i] * r->force_n[i];
    }
    return 0.5 * shown * shown * soft->residual_m_per_n * sum;
}

/* Energy that modes and law hold beyond the work of the drive; the law's. */
static double hold(const shcdi_soft *soft, unsigned char *memory, const relaxation *r, double shown,
                   double *law_j) {
    const shcdi_soft_parts *p = r->parts;
    double drive_j;
    *law_j = 0.0;
    for (size_t i = 0; i < p->head->n_presses; i++) {
        *law_j += p->press[i].share * r->stored_j[i];
    }
    const double modes_j = shcdi_soft_energy(soft, memory, p->trial, &drive_j);
    return *law_j + residual_energy(soft, r, shown) + modes_j - drive_j;
}

static double relax_with(const shcdi_soft *soft, relaxation *r, double shown, double kept) {
    for (size_t i = 0; i < r->parts->head->n_presses; i++) {
        r->parts->press[i].share *= kept;
    }
    r->parts->head->account.withheld = 1.0 - kept * (1.0 - r->parts->head->account.withheld);
    const double change = relax(r);
    set_trial(soft, r, shown);
    return change;
}

/* Withholds of the law what is too much; not where that lets nothing out, as of a law that has gone
 * rigid in series with the membrane. */
static double withhold(const shcdi_soft *soft, unsigned char *memory, relaxation *r, double shown,
                       double most_j, double change) {
    double law_j, over_j = hold(soft, memory, r, shown, &law_j) - most_j;
    for (int n = 0; n < WITHHOLDS_MAX && over_j > 0.0 && law_j > 0.0; n++) {
        const double kept = shcdi_max(KEPT_MIN, 1.0 - WITHHELD_MORE * over_j / law_j);
        const double before_j = over_j;
        change = relax_with(soft, r, shown, kept);
        over_j = hold(soft, memory, r, shown, &law_j) - most_j;
        if (!(over_j <= HELPS * before_j)) {
            return relax_with(soft, r, shown, 1.0 / kept);
        }
    }
    return change;
}

void shcdi_soft_press(const shcdi_soft *soft, unsigned char *memory, const shcdi_active_effect *law,
                      shcdi_soft_gain gain, double most_j) {
    const shcdi_soft_parts p = shcdi_soft_parts_of(soft, memory);
    relaxation r = {.parts = &p, .law = law, .gain = gain.force};
    fill(soft, &p, gain.shown, r.w);
    double change = relax(&r);
    set_trial(soft, &r, gain.shown);
    if (law != NULL && most_j < HUGE_VAL) {
        change = withhold(soft, memory, &r, gain.shown, most_j, change);
    }
    for (size_t i = 0; i < p.head->n_presses; i++) {
        shcdi_response *out = &p.press[i].response;
        out->normal_force_n = p.press[i].share > 0.0 ? r.force_n[i] / p.press[i].share : 0.0;
        out->stored_j += r.stored_j[i];
        out->flags |= change <= GOOD_ENOUGH ? 0u : (uint32_t)SHCD_TOOL_OUTPUT_TRUNCATED;
    }
    for (size_t k = 0; k < soft->n_modes && p.head->is_moving; k++) {
        shcdi_soft_push(&p, k, p.trial[k]);
    }
    shcdi_soft_account(soft, memory);
    p.head->stored_j += residual_energy(soft, &r, gain.shown);
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
