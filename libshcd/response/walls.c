/* SPDX-License-Identifier: BSD-3-Clause */
/* How the walls that a ball touches share its depth.
 *
 * A spring on each wall would add up: two walls whose normals lie 40 degrees apart are, along the
 * middle, nearly twice as stiff as one, and the device was promised one. So the ball hangs on one
 * spring, to the place nearest to it that is out of all walls: with wall i the half-space
 * n_i . x >= d_i, d_i its depth, that place is at sum_i m_i n_i, where
 *
 *     m >= 0,   A m >= d,   m_i (A m - d)_i = 0,   a_ij = max(0, n_i . n_j), (1)
 *
 * and depth D = sqrt(m . A m) = sqrt(m . d) is what the elastic law gets; wall i takes the share
 * m_i/D of its force, and the share m_i d_i/D^2 of its energy (they sum up to 1). With flat walls
 *
 *   D dD = -(sum m_i n_i) . dx, so that the force is the gradient of the law's energy at D, for any
 *   law; and where all normals are within 90 degrees of each other, A is their Gram matrix, the
 *   place is the projection on a convex set, and the stiffness along no direction exceeds that of
 *   one wall (a projection and its complement are non-expansive).
 *
 * A wall that bends turns its normal as the ball moves, dn_i = H_i dx, H_i the second derivative of
 * the distance to it, and A changes with that: D dD = -(sum m_i n_i) . dx - m . dA m/2. The second
 * term is the work of tangential forces: wall i pushes along n_i + sum_j a'_ij m_j H_i n_j. With it
 * the force is the gradient again. It is continuous if a' is: between 90 and 75.5 degrees a goes
 * over from 0 to the cosine c as c^2/c0 (2 - c/c0), c0 the latter's; it is less than c by 0.037
 * there at most, and the stiffness more than one wall's by as much. (A steeper
 * way over is stiffer itself, by a'' m H.)
 * From p = S + s n, with J the derivative of the foot S, H = (1 - n n^T - J)/s, which has a limit
 * where p is on the surface and goes on behind it (foot_motion.h). Towards a focal point of a
 * hollow wall, where it goes to infinity and the foot is about to end, it fades: the force is no
 * gradient there, and account.h sees to it that nothing is gained by that.
 *
 * Walls beyond 90 degrees are not coupled: what one pushes the ball towards is no reason for a
 * force until it is touched there. Each has its own spring then, and between walls that face each
 * other, about a ball that does not fit in, there are up to 1 + |n_i . n_j| <= 2 of them along one
 * line. No continuous force that is k d on one wall alone has less: from the middle, where it is
 * zero, to where the far wall is left, the ball moves by half of what the near wall is then pressed
 * by. And where walls turn towards each other as the ball goes in, D grows faster than the way
 * inwards, D' = 1 + h D for some h, and the stiffness is D'^2 + D D'' = 1 + 3 h D = D'^3 times
 * that of one wall, to first order. Such a contact yields in time: its stiffness goes down by that
 * factor, to what one wall has, and stays there until the ball leaves the body. A spring that
 * softens while it is held gives nothing.
 *
 * A has ones on its diagonal and no entry below zero, so that m . A m > 0 for all m >= 0 but zero,
 * and 2 m . d - m . A m has a largest value over them, at a solution of (1). Among the walls that
 * are active there A has no negative eigenvalue (or the value could be raised), so that of the
 * seven sets of walls the one with a regular block, m >= 0 and the largest value is taken. */
#include "response/walls.h"

#include "response/foot_motion.h"

/* c0: cosine of 75.5 degrees. */
#define BEGINS 0.25

/* Walls that differ less, as a share of the diagonal that the others leave, are one. */
#define SINGULAR 1e-9

/* Time in which a contact would yield altogether [s]. */
#define YIELD_TIME_S 0.4

double shcdi_wall_coupling(const shcdi_wall *a, const shcdi_wall *b, double *rate) {
    const double c = shcdi_max(0.0, shcd_dot(a->normal, b->normal)), t = c / BEGINS;
    *rate = t < 1.0 ? t * (4.0 - 3.0 * t) : 1.0;
    return t < 1.0 ? c * t * (2.0 - t) : c;
}

/* With the contacts of a set alone. @return whether its block is regular and m >= 0 */
static bool solve_set(const shcdi_wall_system *q, unsigned set, double m[SHCDI_WALLS_MAX]) {
    double l[SHCDI_WALLS_MAX][SHCDI_WALLS_MAX + 1]; /* and the right side */
    for (size_t i = 0; i < q->n; i++) {
        const bool is_in = (set >> i & 1u) != 0;
        for (size_t j = 0; j < q->n; j++) {
            l[i][j] = is_in && (set >> j & 1u) != 0 ? q->at[i][j] : i == j ? 1.0 : 0.0;
        }
        l[i][q->n] = is_in ? q->depth_m[i] : 0.0;
    }
    for (size_t k = 0; k < q->n; k++) {
        if (!(l[k][k] > ((set >> k & 1u) != 0 ? SINGULAR * q->at[k][k] : 0.0))) {
            return false;
        }
        for (size_t i = k + 1; i < q->n; i++) {
            const double share = l[i][k] / l[k][k];
            for (size_t j = k; j <= q->n; j++) {
                l[i][j] -= share * l[k][j];
            }
        }
    }
    bool is_positive = true;
    for (size_t i = q->n; i-- > 0;) {
        m[i] = l[i][q->n];
        for (size_t j = i + 1; j < q->n; j++) {
            m[i] -= l[i][j] * m[j];
        }
        m[i] /= l[i][i];
        is_positive = is_positive && m[i] >= 0.0;
    }
    return is_positive;
}

double shcdi_walls_solve(const shcdi_wall_system *q, double m[SHCDI_WALLS_MAX]) {
    double best = 0.0;
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        m[i] = 0.0;
    }
    for (unsigned set = 1; set < 1u << q->n; set++) {
        double try[SHCDI_WALLS_MAX], value = 0.0;
        if (!solve_set(q, set, try)) {
            continue;
        }
        for (size_t i = 0; i < q->n; i++) {
            value += try[i] * q->depth_m[i];
        }
        if (value > best) {
            best = value;
            for (size_t i = 0; i < q->n; i++) {
                m[i] = try[i];
            }
        }
    }
    return best;
}

shcdi_wall_system shcdi_walls_couple(const shcdi_wall wall[], unsigned set) {
    shcdi_wall_system q = {.n = SHCDI_WALLS_MAX};
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        const bool is_in = (set >> i & 1u) != 0;
        q.depth_m[i] = is_in ? wall[i].depth_m : 0.0;
        for (size_t j = 0; j < SHCDI_WALLS_MAX; j++) {
            double rate;
            q.at[i][j] = i == j ? 1.0
                         : is_in && (set >> j & 1u) != 0
                             ? shcdi_wall_coupling(&wall[i], &wall[j], &rate)
                             : 0.0;
        }
    }
    return q;
}

unsigned shcdi_walls_touched(const shcdi_wall wall[]) {
    unsigned set = 0;
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        set |= wall[i].is_touching && wall[i].depth_m > 0.0 ? 1u << i : 0u;
    }
    return set;
}

/* The springs that lie along one line at most: the normals' Gram matrix differs from A by c - a,
 * a matrix whose spectral radius is at most its largest row sum. */
static double springs(const shcdi_wall wall[], const double m[]) {
    double most = 1.0;
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        double sum = 1.0;
        for (size_t j = 0; m[i] > 0.0 && j < SHCDI_WALLS_MAX; j++) {
            double rate;
            sum += j != i && m[j] > 0.0 ? fabs(shcd_dot(wall[i].normal, wall[j].normal) -
                                               shcdi_wall_coupling(&wall[i], &wall[j], &rate))
                                        : 0.0;
        }
        most = shcdi_max(most, sum);
    }
    return shcdi_min(most, 2.0);
}

void shcdi_walls_share(shcdi_contact *contact) {
    shcdi_wall *wall = contact->wall;
    double m[SHCDI_WALLS_MAX];
    const shcdi_wall_system q = shcdi_walls_couple(wall, shcdi_walls_touched(wall));
    const double depth_m = sqrt(shcdi_walls_solve(&q, m));
    const shcd_vec3 none = {0.0, 0.0, 0.0};
    contact->pressed_m = depth_m;
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        const bool is_pressed = depth_m > 0.0 && m[i] > 0.0;
        wall[i].way_m = is_pressed ? m[i] : 0.0;
        wall[i].share = is_pressed ? m[i] / depth_m : 0.0;
        wall[i].energy_share = wall[i].share * (is_pressed ? wall[i].depth_m / depth_m : 0.0);
        wall[i].slope = none;
    }
}

void shcdi_walls_yield(double dt_s, shcdi_contact *contact) {
    shcdi_wall *wall = contact->wall;
    shcd_vec3 gradient = {0.0, 0.0, 0.0};
    double m[SHCDI_WALLS_MAX];
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        m[i] = wall[i].way_m;
        gradient = shcd_mul_add(gradient, wall[i].share, shcd_add(wall[i].normal, wall[i].slope));
    }
    const double rise = shcd_norm(gradient);
    const double yielded = 1.0 - 1.0 / shcdi_max(springs(wall, m), rise * rise * rise);
    if (yielded > contact->yielded) {
        contact->yielded = shcdi_min(yielded, contact->yielded + dt_s / YIELD_TIME_S);
    }
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        wall[i].share *= 1.0 - contact->yielded;
        wall[i].energy_share *= 1.0 - contact->yielded;
    }
}

shcd_vec3 shcdi_wall_lean(const shcdi_wall wall[], size_t i) {
    shcd_vec3 sum = {0.0, 0.0, 0.0};
    for (size_t j = 0; j < SHCDI_WALLS_MAX; j++) {
        double rate = 0.0;
        if (j != i && wall[j].way_m > 0.0 && shcdi_wall_coupling(&wall[i], &wall[j], &rate) > 0.0) {
            sum = shcd_mul_add(sum, rate * wall[j].way_m, wall[j].normal);
        }
    }
    return sum;
}

void shcdi_walls_tilt(const shcd_model *model, shcd_vec3 p, shcdi_contact *contact) {
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        shcdi_wall *wall = &contact->wall[i];
        const double s = shcd_dot(shcd_sub(p, wall->foot_m), wall->normal);
        const shcd_vec3 lean = shcdi_wall_lean(contact->wall, i), none = {0.0, 0.0, 0.0};
        const bool is_alone = lean.x == 0.0 && lean.y == 0.0 && lean.z == 0.0;
        wall->slope = wall->way_m > 0.0 && !is_alone
                          ? shcdi_foot_turn(&model->series, wall->parameter, wall->normal, s, lean)
                          : none;
    }
}
