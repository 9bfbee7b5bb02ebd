/* SPDX-License-Identifier: BSD-3-Clause */
/* The slope of walls that bend, against a sphere's, whose normal turns by 1/(R + s) on the surface
 * and on both sides of it. */
#include "response/foot_motion.h"
#include "response/walls.h"
#include "support/groove.h"
#include "support/scene_fixture.h"

#define RADIUS_M 0.015

/* H = (1 - n n^T)/(R + s): of two walls 70 degrees apart each pushes along its normal and
 * m_j (n_j - c n_i)/(R + s_i), c the cosine. A ball of 2 mm passes one of the feet. */
static void test_slope_goes_on_where_the_centre_passes_a_foot(void **state) {
    shcd_model *model = fixture_ellipsoid(RADIUS_M, RADIUS_M, RADIUS_M);
    const double turn = 70.0 * GROOVE_PI / 180.0, cosine = cos(turn), step_m = 2e-5;
    (void)state;
    for (int i = -50; i <= 50; i++) {
        const double s = step_m * i;
        const shcd_vec3 p = {0.0, 0.0, RADIUS_M + s};
        shcdi_contact contact;
        memset(&contact, 0, sizeof contact);
        for (int k = 0; k < 2; k++) {
            shcdi_wall *wall = &contact.wall[k];
            wall->normal = shcd_vec3_make(k * sin(turn), 0.0, k == 0 ? 1.0 : cosine);
            wall->parameter = wall->normal;
            wall->foot_m = shcd_scale(RADIUS_M, wall->normal);
            wall->depth_m = k == 0 ? 0.002 - s : 0.0015;
            wall->is_touching = 1;
        }
        shcdi_walls_share(&contact);
        shcdi_walls_tilt(model, p, &contact);
        const shcd_vec3 n = contact.wall[0].normal, other = contact.wall[1].normal;
        const shcd_vec3 slope =
            shcd_scale(contact.wall[1].way_m / (RADIUS_M + s), shcd_mul_add(other, -cosine, n));
        assert_true(contact.wall[0].share > 0.0 && contact.wall[1].share > 0.0);
        assert_true(shcd_norm(slope) > 0.02);
        /* surface and sines to a few roundings, times the condition of degree 1: 1 */
        assert_near(shcd_norm(shcd_sub(contact.wall[0].slope, slope)), 0.0, 1e-12);
    }
    shcd_model_free(model);
}

/* In a waist, hollow one way and round the other: H (1 - s k) = -k along each curvature k, so that
 * H s and J add up to the identity of the tangent plane. */
static void test_turn_and_motion_add_up(void **state) {
    shcd_model *model = groove_body(8, 0.3);
    check_random random = {7};
    (void)state;
    for (size_t i = 0; i < check_scaled(200); i++) {
        const shcd_vec3 w = fixture_random_direction(&random),
                        u = fixture_random_direction(&random);
        shcd_vec3 value, normal;
        shcdi_jet jet;
        /* half of the least radius of curvature is far more: no bound cuts it down */
        const double s = 1e-4 * (2.0 * check_uniform(&random, 0.0, 1.0) - 1.0);
        shcdi_surface_jet(&model->series, model->degree, w, &jet);
        value = jet.s;
        normal = shcd_unit(shcd_cross(jet.s1, jet.s2));
        normal = shcd_dot(normal, value) < 0.0 ? shcd_scale(-1.0, normal) : normal;
        const shcd_vec3 moved = shcdi_foot_motion(&model->series, w, normal, s, u);
        const shcd_vec3 turned = shcdi_foot_turn(&model->series, w, normal, s, u);
        const shcd_vec3 flat = shcd_mul_add(u, -shcd_dot(u, normal), normal);
        assert_near(shcd_norm(shcd_sub(shcd_mul_add(moved, s, turned), flat)), 0.0, 1e-11);
    }
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_slope_goes_on_where_the_centre_passes_a_foot),
        cmocka_unit_test(test_turn_and_motion_add_up),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
