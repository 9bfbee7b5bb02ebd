/* SPDX-License-Identifier: BSD-3-Clause */
/* A ball in a groove: the walls that it touches beside the deepest one, against brute force over a
 * dense sampling of the surface. */
#include "support/scene_fixture.h"

#define STIFFNESS_N_PER_M 300.0
#define DEGREE 8

/* A ball with a waist: r(theta) = 0.03 (1 - 0.75 e^(-(z/0.28)^2)), projected on degree 8 by
 * midpoint sums in z = cos(theta): the coefficients of r w need only m = 0 for z, m = +-1 for x and
 * y. */
static shcd_model *peanut(void) {
    static double c[3 * SHCD_COUNT(DEGREE)];
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    const int n = 4000;
    memset(c, 0, sizeof c);
    for (int i = 0; i < n; i++) {
        const double z = -1.0 + 2.0 * (i + 0.5) / n, s = sqrt(1.0 - z * z);
        const double r = 0.03 * (1.0 - 0.75 * exp(-z * z / (0.28 * 0.28)));
        double y[SHCD_COUNT(DEGREE)];
        assert_int_equal(shcd_harmonics(DEGREE, shcd_vec3_make(s, 0.0, z), y, NULL, NULL), SHCD_OK);
        for (int l = 0; l <= DEGREE; l++) {
            const double weight = 2.0 / n * 2.0 * 3.14159265358979324;
            c[3 * SHCD_INDEX(l, 0) + 2] += weight * r * z * y[SHCD_INDEX(l, 0)];
            if (l > 0) { /* int cos^2 over the azimuth is half of the whole turn */
                const double x = 0.5 * weight * r * s * y[SHCD_INDEX(l, 1)];
                c[3 * SHCD_INDEX(l, 1) + 0] += x;
                c[3 * SHCD_INDEX(l, -1) + 1] += x;
            }
        }
    }
    def.degree = DEGREE;
    def.coefficients = c;
    if (shcd_model_create(&def, NULL, &model, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    return model;
}

static shcd_model *body;

static int make_body(void **state) {
    (void)state;
    body = peanut();
    return 0;
}

static int free_body(void **state) {
    (void)state;
    shcd_model_free(body);
    return 0;
}

/* Distance from p to the surface on one side of the plane z = 0, in the half plane y = 0, x > 0,
 * where the feet of a point of it lie: the body turns about z. */
static double distance_to_side(shcd_vec3 p, int is_upper) {
    double nearest = HUGE_VAL;
    for (int i = 0; i <= 200000; i++) {
        const double theta = 0.5 * 3.14159265358979324 * (i / 200000.0 + (is_upper ? 0.0 : 1.0));
        const shcd_vec3 w = {sin(theta), 0.0, cos(theta)};
        shcd_vec3 s;
        assert_int_equal(shcd_model_surface(body, -1, w, &s, NULL, NULL), SHCD_OK);
        nearest = fmin(nearest, shcd_norm(shcd_sub(s, p)));
    }
    return nearest;
}

/* A ball larger than the waist is hollow rests on both flanks. In the middle it feels both equally,
 * and no force along z; off the middle each by its own depth. */
static void test_a_ball_in_the_waist_touches_both_flanks(void **state) {
    const double radius_m = 0.012, heights[] = {0.0, 2e-4, -5e-4};
    (void)state;
    for (size_t h = 0; h < 3; h++) {
        fixture f;
        fixture_open_one(&f, body, fixture_pose(0.0, 0.0, 0.0), radius_m);
        for (int i = 0; i < 200; i++) {
            const shcd_vec3 p = {0.0300 - 1e-5 * i, 0.0, heights[h]};
            const shcd_tool_output *out = fixture_move(&f, p, shcd_vec3_make(-0.01, 0.0, 0.0));
            if (i % 40 == 39) {
                const double up = fmax(0.0, radius_m - distance_to_side(p, 1));
                const double down = fmax(0.0, radius_m - distance_to_side(p, 0));
                const double z = out->wrench.force_n.z / STIFFNESS_N_PER_M;
                print_message(
                    "x %.5f, z %.5f: %u contacts, depths %.6f and %.6f, F/k (%.6f, %.6f)\n", p.x,
                    p.z, out->n_contacts, up, down, out->wrench.force_n.x / STIFFNESS_N_PER_M, z);
                assert_int_equal(out->n_contacts, (up > 0.0) + (down > 0.0));
                assert_near(out->penetration_m, fmax(up, down), 1e-8);
                if (heights[h] == 0.0) {
                    assert_near(z, 0.0, 1e-9);
                } else if (up > 0.0 && down > 0.0) {
                    /* the deeper flank pushes away from itself */
                    assert_true((z > 0.0) == (down > up));
                }
            }
        }
        fixture_close(&f);
    }
}

/* Across the waist the force goes over from one flank to the other without a jump: a step of 10 um
 * changes it by no more than three walls of the stiffness and the turn of their normals do. */
static void test_the_force_is_continuous_across_the_waist(void **state) {
    const double radius_m = 0.012, step_m = 1e-5;
    fixture f;
    shcd_vec3 last = {0.0, 0.0, 0.0};
    double largest = 0.0;
    uint32_t most = 0;
    (void)state;
    fixture_open_one(&f, body, fixture_pose(0.0, 0.0, 0.0), radius_m);
    for (int i = 0; i < 600; i++) {
        const shcd_vec3 p = {0.0285, 0.0, -0.003 + step_m * i};
        const shcd_vec3 force = fixture_move(&f, p, shcd_vec3_make(0.0, 0.0, 0.01))->wrench.force_n;
        if (i > 0) {
            largest = fmax(largest, shcd_norm(shcd_sub(force, last)));
        }
        most = f.out[0].n_contacts > most ? f.out[0].n_contacts : most;
        last = force;
    }
    print_message("steps of at most %.3g N, up to %u contacts\n", largest, most);
    assert_int_equal(most, 2);
    assert_true(largest <= 6.0 * STIFFNESS_N_PER_M * step_m);
    fixture_close(&f);
}

/* On a convex part there is one wall, however large the ball. */
static void test_a_convex_body_has_one_wall(void **state) {
    shcd_model *egg = fixture_ellipsoid(0.03, 0.02, 0.025);
    check_random random = {5};
    (void)state;
    for (size_t i = 0; i < check_scaled(50); i++) {
        fixture f;
        const shcd_vec3 d = fixture_random_direction(&random);
        fixture_open_one(&f, egg, fixture_pose(0.0, 0.0, 0.0), 0.05);
        fixture_move(&f, shcd_scale(0.068, d), shcd_vec3_make(0.0, 0.0, 0.0));
        assert_true(f.out[0].n_contacts <= 1);
        fixture_close(&f);
    }
    shcd_model_free(egg);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_ball_in_the_waist_touches_both_flanks),
        cmocka_unit_test(test_the_force_is_continuous_across_the_waist),
        cmocka_unit_test(test_a_convex_body_has_one_wall),
    };
    return cmocka_run_group_tests(tests, make_body, free_body);
}
