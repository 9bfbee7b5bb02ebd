/* SPDX-License-Identifier: BSD-3-Clause */
/* How the walls of a ball on a soft body push because they turn.
 *
 * The law's energy U(D) is one of the walls' depths d and of their normals, D dD = m . dd - m . dA
 * m/2 (walls.c). With the forces f = F m/D and g_i = sum_j a'_ij m_j n_j,
 *
 *     dU = sum f_i dd_i - sum f_i g_i . dn_i,
 *
 * and normal and depth of wall i change with the ball's centre p and with the modes. At its foot,
 * of which J is the derivative and H that of the normal (foot_motion.h), a displacement u of the
 * surface gives dd_i = n_i . (u - dp) and dn_i = H dp - J grad(u . n_i), grad along the surface. So
 * the ball is pushed by f_i (n_i + H g_i), and mode k, with t = J g_i, by
 *
 *     -f_i (phi_k (n_i + H g_i) + (t . grad phi_k) n_i),
 *
 * as if the wall were pressed at S + t along the normal there. The first term is that of
 * soft_contact.c. What turning adds is small beside it, and is added to the modes where the tick
 * that follows begins: for as long as the ball's share of it is held. Its error is of second order
 * in what moves within a tick. */
#include "response/foot_motion.h"
#include "response/walls.h"

#include "query/view.h"

#include <string.h>

/* What one wall adds to the modes' acceleration in the tick that follows. */
static void note(const shcdi_soft *soft, const shcdi_soft_parts *p, size_t press,
                 const shcdi_foot_frame *f, shcd_vec3 lean, double push) {
    const shcdi_touch *touch = &p->press[press].touch;
    const double *at = p->at + press * soft->n_modes;
    const shcd_vec3 slope = shcdi_foot_frame_turn(f, lean);
    shcdi_series series = soft->model->series;
    double a1, a2;
    (void)shcdi_foot_frame_motion(f, lean, &a1, &a2);
    for (size_t g = 0; g < soft->n_groups; g++) {
        shcdi_jet phi; /* of three modes, as if they were the coordinates of a surface */
        series.packed = soft->packed + g * soft->packed_size;
        shcdi_surface_first(&series, series.degree, touch->parameter, &phi);
        const shcd_vec3 along = shcd_add(shcd_scale(a1, phi.s1), shcd_scale(a2, phi.s2));
        const double rate[3] = {along.x, along.y, along.z};
        for (size_t c = 0, k = 3 * g; c < 3 && k < soft->n_modes; c++, k++) {
            const shcd_vec3 way = shcd_mul_add(shcd_scale(at[k], slope), rate[c], touch->normal);
            p->tilt[k] = shcd_mul_add(p->tilt[k], -push, way);
        }
    }
}

static void tilt(const shcdi_soft *soft, const shcdi_soft_parts *p, const shcdi_series *now,
                 size_t first, size_t n, double shown) {
    shcdi_wall wall[SHCDI_WALLS_MAX];
    memset(wall, 0, sizeof wall);
    for (size_t i = 0; i < n; i++) {
        wall[i].normal = p->press[first + i].touch.normal;
        wall[i].way_m = p->press[first + i].way_m;
    }
    for (size_t i = 0; i < n; i++) {
        shcdi_press *press = &p->press[first + i];
        const shcdi_touch *t = &press->touch;
        const shcd_vec3 centre_m = shcd_mul_add(t->tool_point_m, t->tool_radius_m, t->normal);
        const double s = shcd_dot(shcd_sub(centre_m, t->foot_m), t->normal);
        const shcd_vec3 lean = shcdi_wall_lean(wall, i);
        const double force_n = press->share * press->response.normal_force_n;
        shcdi_foot_frame f;
        if (!(force_n > 0.0) || (lean.x == 0.0 && lean.y == 0.0 && lean.z == 0.0) ||
            !shcdi_foot_frame_at(now, t->parameter, t->normal, s, &f)) {
            continue;
        }
        if (p->head->is_tilted == 0) {
            memset(p->tilt, 0, soft->n_modes * sizeof *p->tilt);
            p->head->is_tilted = 1;
        }
        note(soft, p, first + i, &f, lean, shown * force_n / soft->mass_kg_per_m2);
        press->tilt = shcdi_foot_frame_turn(&f, lean);
        press->response.slope = shcd_add(press->response.slope, press->tilt);
    }
}

void shcdi_soft_tilt(const shcdi_soft *soft, unsigned char *memory, double shown) {
    const shcdi_soft_parts p = shcdi_soft_parts_of(soft, memory);
    const size_t n_presses = p.head->n_presses;
    shcdi_view view;
    shcdi_view_of(soft->model, p.shape, &view);
    for (size_t first = 0, n; first < n_presses; first += n) {
        const shcdi_press *press = &p.press[first];
        n = 1;
        while (press->is_wall && first + n < n_presses && n < SHCDI_WALLS_MAX && press[n].is_wall &&
               press[n].tool == press->tool) {
            n++;
        }
        if (n > 1) {
            tilt(soft, &p, &view.series, first, n, shown);
        }
    }
}
