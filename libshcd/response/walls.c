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
 * the force is the gradient again. It is continuous if a' is: between 90 and 84 degrees a goes over
 * from 0 to the cosine c as c^2/c0 (2 - c/c0), c0 the latter's; it is less than c by 0.015 there at
 * most, and the stiffness more than one wall's by as much. From p = S + s n, with J the derivative
 * of the foot S, H = (1 - n n^T - J)/s, which has a limit where p is on the surface and goes on
 * behind it (foot_motion.h); near a focal point of a hollow wall, where both go to
 * infinity and the foot is about to end, both are taken for a nearer p.
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

/* c0: cosine of 84 degrees. */
#define BEGINS 0.1

/* Walls that differ less, 1 - c^2 below it, are one. */
#define SINGULAR 1e-9

/* Time in which a contact would yield altogether [s]. */
#define YIELD_TIME_S 0.4

double shcdi_wall_coupling(const shcdi_wall *a, const shcdi_wall *b, double *rate) {
    const double c = shcdi_max(0.0, shcd_dot(a->normal, b->normal)), t = c / BEGINS;
    *rate = t < 1.0 ? t * (4.0 - 3.0 * t) : 1.0;
    return t < 1.0 ? c * t * (2.0 - t) : c;
}

static double coupling(const shcdi_wall *a, const shcdi_wall *b) {
    double rate;
    return shcdi_wall_coupling(a, b, &rate);
}

/* A block of A by Cholesky's method. @return whether it is regular and m >= 0 */
static bool solve(const shcdi_wall wall[], unsigned set, double m[SHCDI_WALLS_MAX]) {
    double l[SHCDI_WALLS_MAX][SHCDI_WALLS_MAX], y[SHCDI_WALLS_MAX];
    size_t of[SHCDI_WALLS_MAX], n = 0;
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        m[i] = 0.0;
        if ((set >> i & 1u) != 0) {
            of[n++] = i;
        }
    }
    for (size_t i = 0; i < n; i++) {
        y[i] = wall[of[i]].depth_m;
        for (size_t j = 0; j <= i; j++) {
            double sum = i == j ? 1.0 : coupling(&wall[of[i]], &wall[of[j]]);
            for (size_t k = 0; k < j; k++) {
                sum -= l[i][k] * l[j][k];
            }
            if (i == j && !(sum > SINGULAR)) {
                return false;
            }
            l[i][j] = i == j ? sqrt(sum) : sum / l[j][j];
            y[i] -= i == j ? 0.0 : l[i][j] * y[j];
        }
        y[i] /= l[i][i];
    }
    for (size_t i = n; i-- > 0;) {
        for (size_t k = i + 1; k < n; k++) {
            y[i] -= l[k][i] * y[k];
        }
        y[i] /= l[i][i];
        if (!(y[i] >= 0.0)) {
            return false;
        }
        m[of[i]] = y[i];
    }
    return true;
}

double shcdi_walls_solve(const shcdi_wall wall[], unsigned set, double m[SHCDI_WALLS_MAX]) {
    double best = 0.0;
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        m[i] = 0.0;
    }
    for (unsigned s = 1; s < 1u << SHCDI_WALLS_MAX; s++) {
        double try[SHCDI_WALLS_MAX], value = 0.0;
        if ((s & ~set) != 0 || !solve(wall, s, try)) {
            continue;
        }
        for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
            value += (s >> i & 1u) != 0 ? try[i] * wall[i].depth_m : 0.0;
        }
        if (value > best) {
            best = value;
            for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
                m[i] = try[i];
            }
        }
    }
    return sqrt(best);
}

unsigned shcdi_walls_touched(const shcdi_wall wall[]) {
    unsigned set = 0;
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        set |= wall[i].is_touching && wall[i].depth_m > 0.0 ? 1u << i : 0u;
    }
    return set;
}

/* The springs that lie along one line at most: the normals' Gram matrix is A less a matrix of
 * entries |n_i . n_j| beyond 90 degrees, whose spectral radius is at most its largest row sum. */
static double springs(const shcdi_wall wall[], const double m[]) {
    double most = 1.0;
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        double sum = 1.0;
        for (size_t j = 0; m[i] > 0.0 && j < SHCDI_WALLS_MAX; j++) {
            sum += j != i && m[j] > 0.0 ? shcdi_max(0.0, -shcd_dot(wall[i].normal, wall[j].normal))
                                        : 0.0;
        }
        most = shcdi_max(most, sum);
    }
    return shcdi_min(most, 2.0);
}

void shcdi_walls_share(shcdi_contact *contact) {
    shcdi_wall *wall = contact->wall;
    double m[SHCDI_WALLS_MAX];
    const double depth_m = shcdi_walls_solve(wall, shcdi_walls_touched(wall), m);
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

void shcdi_walls_tilt(const shcd_model *model, shcd_vec3 p, shcdi_contact *contact) {
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        shcdi_wall *wall = &contact->wall[i];
        const double s = shcd_dot(shcd_sub(p, wall->foot_m), wall->normal);
        shcd_vec3 sum = {0.0, 0.0, 0.0};
        wall->slope = sum;
        if (!(wall->share > 0.0)) {
            continue;
        }
        for (size_t j = 0; j < SHCDI_WALLS_MAX; j++) {
            const shcdi_wall *other = &contact->wall[j];
            double rate = 0.0;
            if (j != i && other->share > 0.0 && shcdi_wall_coupling(wall, other, &rate) > 0.0) {
                sum = shcd_mul_add(sum, rate * other->way_m, other->normal);
            }
        }
        if (sum.x == 0.0 && sum.y == 0.0 && sum.z == 0.0) {
            continue; /* alone */
        }
        wall->slope = shcdi_foot_turn(model, wall->parameter, wall->normal, s, sum);
    }
}
