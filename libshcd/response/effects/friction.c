/* SPDX-License-Identifier: BSD-3-Clause */
/* friction: Coulomb's, static and kinetic, by a spring to an anchor on the surface.
 *
 * The spring's stretch e lies in the tangent plane; F = -k e acts on the tool. Each tick
 *
 *     e <- P (e + dx - u dt),
 *
 * dx the way of that point of the tool which was in contact at the last tick, u the surface's
 * velocity (the anchor goes with the surface), P the orthogonal projection onto the present tangent
 * plane; then, with L = mu N the limit for the present normal force N, e is shortened to L/k if it
 * is longer: the anchor slides after the tool. As long as it is not, the anchor stands to the bit:
 * a tool that trembles by less than L/k neither creeps nor chatters. That is the dead band.
 *
 * Energy. The hand works k e . dx against the held force, the spring gains at most
 * k |e + dx|^2/2 - k |e|^2/2 = k e . dx + k |dx|^2/2; neither P, nor shortening, lengthens e. So
 * nothing is gained beyond the k |dx|^2/2 that any held spring yields, however the normal turns.
 * In a groove the springs of all walls together are to have no more than k along it, so that each
 * has a part of k, and its force a share: their product, its weight w, changes as the ball moves.
 * w k |e|^2/2 is then kept, and e goes by the root: held as it is, e would gain energy where w
 * grows. This can be undone, so that a tool that trembles between two walls does not creep either.
 * The limit mu N is each wall's own: a wedge holds by more than a plane.
 *
 * The point of the tool is followed as such: a ball that rolls does not slide, and a box whose
 * deepest point jumps to another corner feels no jump.
 *
 * mu = mu_k + (mu_s - mu_k) (1 - s/l), s the way slid, 0 .. l. s grows by the tool's own way while
 * it slides, so that the force drops within the slip length and not in a jump, however soft the
 * spring; and it falls by l dt/t_rest while it sticks, which changes no force: only how much it
 * takes to break away again.
 *
 * Within a tick the force thus changes by at most
 *     k |dx - u dt| + |F| angle(n, n') + mu_s max(0, N - N') + N (mu_s - mu_k) |dx_before|/l,
 * dx_before that of the tick before: shortening to a ball is non-expansive; in a groove also by the
 * change of the root of w. */
#include "base/internal.h"
#include "response/effects.h"

enum { STIFFNESS, STATIC, KINETIC, SLIP, REST, N_PARAMETERS };

static const shcd_parameter_info parameters[] = {
    [STIFFNESS] = {"stiffness_n_per_m", "N/m", 300.0, 1.0, 1e5,
                   "k, of the spring along the surface; as that of stiffness by default"},
    [STATIC] = {"static_ratio", "1", 0.3, 0.0, 10.0,
                "mu_s: force along the surface at which the tool breaks away, over the normal one"},
    [KINETIC] = {"kinetic_ratio", "1", 0.2, 0.0, 10.0, "mu_k: the same while it slides; <= mu_s"},
    [SLIP] = {"slip_length_m", "m", 0.001, 1e-6, 1.0, "l: way slid over which mu_s falls to mu_k"},
    [REST] = {"rest_time_s", "s", 0.1, 1e-3, 100.0,
              "t_rest: time of sticking over which mu_s comes back"},
};

typedef struct anchor {
    shcd_vec3 stretch_m;
    shcd_vec3 point_m;       /* of the tool that was in contact, where it was: body frame */
    shcd_vec3 point_in_tool; /* the same, tool frame [m] */
    double slid_m;
    double is_set;
    double weight; /* with which the spring acted */
} anchor;

static void prepare(const double *values, double *constants) {
    for (int i = 0; i < N_PARAMETERS; i++) {
        constants[i] = values[i];
    }
}

shcd_status shcdi_settle_friction(const char *body, const shcdi_settings *s, double *constants,
                                  shcd_error *error) {
    (void)constants;
    if (s->value[KINETIC] <= s->value[STATIC]) {
        return SHCD_OK;
    }
    return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                      "scene_create: body '%s': effect 'friction': 'kinetic_ratio' is %g, must not "
                      "be above 'static_ratio', %g",
                      body, s->value[KINETIC], s->value[STATIC]);
}

/* How far the surface has slid under the tool's old contact point, which is then forgotten. */
static shcd_vec3 slide_to(const shcdi_touch *touch, anchor *a) {
    shcd_vec3 way = {0.0, 0.0, 0.0};
    if (a->is_set != 0.0) {
        way = shcd_sub(shcd_transform(touch->tool_in_body, a->point_in_tool), a->point_m);
        way = shcd_mul_add(way, -touch->dt_s, touch->surface_velocity_m_per_s);
    }
    a->point_m = touch->tool_point_m;
    a->point_in_tool = shcd_transform_inverse(touch->tool_in_body, touch->tool_point_m);
    a->is_set = 1.0;
    return way;
}

static shcd_vec3 in_plane(shcd_vec3 v, shcd_vec3 normal) {
    return shcd_mul_add(v, -shcd_dot(v, normal), normal);
}

/* Keeps w |e|^2, the energy, as the weight changes. */
static void weigh(anchor *a, double weight) {
    if (a->weight != weight) {
        a->stretch_m = shcd_scale(weight > 0.0 ? sqrt(a->weight / weight) : 0.0, a->stretch_m);
        a->weight = weight;
    }
}

static void apply(const double *constants, const shcdi_touch *touch, void *memory,
                  shcdi_response *response) {
    anchor *a = memory;
    const double k = constants[STIFFNESS] * touch->along_part, length_m = constants[SLIP];
    const double drop = (constants[STATIC] - constants[KINETIC]) * (1.0 - a->slid_m / length_m);
    const double limit_m =
        k > 0.0 ? (constants[KINETIC] + drop) * response->normal_force_n / k : 0.0;
    weigh(a, touch->along_weight);
    const shcd_vec3 way = in_plane(slide_to(touch, a), touch->normal);
    const shcd_vec3 stretch = in_plane(shcd_add(a->stretch_m, way), touch->normal);
    const double length = shcd_norm(stretch);
    if (length > limit_m) {
        a->stretch_m = shcd_scale(limit_m / length, stretch);
        a->slid_m = shcdi_min(length_m, a->slid_m + shcdi_min(length - limit_m, shcd_norm(way)));
    } else {
        a->stretch_m = stretch;
        a->slid_m = shcdi_max(0.0, a->slid_m - length_m * touch->dt_s / constants[REST]);
    }
    response->other_force_n = shcd_mul_add(response->other_force_n, -k, a->stretch_m);
    response->anchored_j += 0.5 * k * shcd_dot(a->stretch_m, a->stretch_m);
}

const shcdi_effect shcdi_effect_friction = {
    {"friction",
     "Coulomb friction by a spring to an anchor: |F| <= mu N along the surface, mu from mu_s to "
     "mu_k over the slip length; nothing without a normal force",
     "D. Karnopp, J. Dyn. Syst. Meas. Control 107(1), 100-103 (1985); V. Hayward, B. Armstrong, "
     "Experimental Robotics VI, 403-412 (2000); default mu_s: S. Shacham, D. Castel, A. Gefen, J. "
     "Biomech. Eng. 132(8) (2010), muscle on bone",
     N_PARAMETERS, parameters},
    sizeof(anchor),
    prepare,
    NULL,
    NULL,
    apply,
};
