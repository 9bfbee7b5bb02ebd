/* SPDX-License-Identifier: BSD-3-Clause */
/* Which bodies a tool touches.
 *
 * Bodies are visited in the order of their certified lower bounds, those in contact first, and the
 * visit ends when the next bound proves that no body further on touches the tool or is nearer than
 * the nearest so far: a far body costs one square root. Forces are then summed in the order of the
 * scene, so that their sum does not depend on the order of the visit. */
#include "response/visit.h"

#include "response/accuracy.h"

/* Of a point or sphere only the centre counts. */
static shcd_pose pose_in_body(const shcdi_visit *v, size_t b) {
    const shcd_pose body = v->scene->bodies[b].body_in_world;
    const shcd_quat p = shcd_conjugate(body.orientation);
    const shcd_quat q = v->pose.orientation;
    shcd_pose pose = {shcd_transform_inverse(body, v->pose.position_m), {1.0, 0.0, 0.0, 0.0}};
    if (v->tool->geometry != NULL) {
        shcd_quat r;
        r.w = p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z;
        r.x = p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y;
        r.y = p.w * q.y - p.x * q.z + p.y * q.w + p.z * q.x;
        r.z = p.w * q.z + p.x * q.y - p.y * q.x + p.z * q.w;
        pose.orientation = shcdi_unit_quaternion(r);
    }
    return pose;
}

static void look_at(shcdi_visit *v, shcdi_contact *contacts, size_t b, double *nearest_m) {
    const shcdi_body *body = &v->scene->bodies[b];
    const shcd_pose pose = pose_in_body(v, b);
    const double dt_s = v->input->dt_s;
    v->was_touching[b] = contacts[b].is_touching != 0;
    v->is_visited[b] = true;
    v->gaps[b].allowance_ns = shcdi_allowance(v->left_ns[b], v->n_tools_left);
    v->gaps[b].shape = shcdi_shape_of(body, v->state);
    if (v->tool->geometry == NULL) {
        shcdi_contact_update(body, v->tool, &pose, dt_s, &contacts[b], &v->gaps[b]);
    } else if (v->tool->kind == SHCD_TOOL_SHELL) {
        shcdi_shell_update(body, v->tool, pose, dt_s, &contacts[b],
                           shcdi_shell_memory(v->scene, v->state, v->tool_index, b), &v->gaps[b]);
    } else {
        shcdi_convex_update(body, v->tool, pose, dt_s, &contacts[b], &v->gaps[b]);
    }
    v->left_ns[b] =
        shcdi_max(0.0, v->left_ns[b] - shcdi_spent(&body->accuracy, v->gaps[b].n_evaluations,
                                                   v->gaps[b].n_patches));
    *nearest_m = shcdi_min(*nearest_m, v->gaps[b].gap_m);
}

void shcdi_visit_bodies(shcdi_visit *v) {
    double bounds[SHCD_BODIES_MAX];
    shcd_vec3 at[SHCD_BODIES_MAX];
    double nearest_m = HUGE_VAL;
    shcdi_contact *contacts = shcdi_contacts_of(v->scene, v->state, v->tool_index);
    const size_t n = v->scene->n_bodies;
    for (size_t b = 0; b < n; b++) {
        const shcdi_body *body = &v->scene->bodies[b];
        v->is_visited[b] = false;
        if (contacts[b].is_touching) {
            look_at(v, contacts, b, &nearest_m);
            continue;
        }
        const shcd_pose ball = shcdi_ball_pose(v->tool, pose_in_body(v, b));
        at[b] = ball.position_m;
        bounds[b] = shcdi_contact_lower_bound(body, shcdi_shape_of(body, v->state), v->tool,
                                              &contacts[b], &ball);
    }
    for (size_t k = 0; k < n; k++) {
        size_t next = n;
        for (size_t b = 0; b < n; b++) {
            if (!v->is_visited[b] && (next == n || bounds[b] < bounds[next])) {
                next = b;
            }
        }
        if (next == n || bounds[next] >= shcdi_max(nearest_m, 0.0)) {
            break;
        }
        look_at(v, contacts, next, &nearest_m);
    }
    for (size_t b = 0; b < n; b++) {
        if (!v->is_visited[b]) {
            contacts[b].last_m = at[b];
            contacts[b].apart_m = shcdi_max(bounds[b], 0.0);
        }
    }
}
