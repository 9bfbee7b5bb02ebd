/* SPDX-License-Identifier: BSD-3-Clause */
/* Static deflection of the soft organ under a tool, by the tick (64 modes and what stands for the
 * others), against a finite-element membrane on a tessellation of the same surface, with the same
 * patch. Oracle: its patch is made by the elements, too, by small implicit steps of heat flow, so
 * it shares the surface's points with libshcd, and nothing else. */
#include "fit_support.h"
#include "support/membrane_fe.h"
#include "support/scene_fixture.h"

#include "shcd/fit.h"

/* Error of the oracle: elements fall by 4 with each level, and 5 and 6 are extrapolated; the heat
 * flow in n steps errs by t^2 lambda^2/(2 n), 0.1 % where it matters. The bound of the test is 2 %,
 * for the 192 modes of the space that one number stands for, and all beyond. */
#define HEAT_STEPS 128
#define TOLERANCE 0.02

#define DEPTH_M 2e-5
#define TOOL_RADIUS_M 0.002

static shcd_model *organ;

static int make_organ(void **state) {
    shcd_mesh *mesh = NULL;
    shcd_fit_options options = SHCD_FIT_OPTIONS_INIT;
    shcd_error error = {SHCD_OK, ""};
    (void)state;
    options.n_modes = 64;
    if (shcd_mesh_import(SHCD_SCENES "/organ.obj", 1.0, &mesh, NULL, &error) != SHCD_OK ||
        shcd_fit(mesh, &options, NULL, &organ, NULL, &error) != SHCD_OK) {
        print_error("%s\n", error.message);
        return 1;
    }
    shcd_mesh_free(mesh);
    return 0;
}

static int free_organ(void **state) {
    (void)state;
    shcd_model_free(organ);
    return 0;
}

/* exp(-t L) of a unit impulse at a vertex, t = sigma^2/2: (M + t/n K)^-n. */
static double *patch_at(const membrane_fe *fe, size_t vertex, double sigma_m) {
    const size_t n = membrane_fe_count(fe);
    const double step = 0.5 * sigma_m * sigma_m / HEAT_STEPS;
    double *g = calloc(n, sizeof *g), *image = calloc(n, sizeof *image);
    membrane_fe_factor *factor = membrane_fe_factorise(fe, step, 1.0);
    assert_non_null(g);
    assert_non_null(image);
    g[vertex] = 1.0; /* the impulse, already times the mass */
    membrane_fe_solve(factor, g);
    for (int k = 1; k < HEAT_STEPS; k++) {
        membrane_fe_times_mass(fe, g, image);
        memcpy(g, image, n * sizeof *g);
        membrane_fe_solve(factor, g);
    }
    membrane_fe_factor_free(factor);
    free(image);
    return g;
}

/* Coarse vertices come first, so that one index is the same place on every level. */
static double oracle(const membrane_fe *fe, size_t vertex, double shear_pa, double thickness_m,
                     double kappa, double sigma_m) {
    double *g = patch_at(fe, vertex, sigma_m);
    const double w = membrane_fe_compliance(fe, shear_pa * thickness_m, kappa, g, NULL);
    free(g);
    return w;
}

/* Force of a ball held at a small depth over S(w) until nothing moves. */
static double held_force(shcd_vec3 w) {
    const shcd_parameter_value wave[3] = {{.name = "modes", .value = 64.0},
                                          {.name = "damping_ratio", .value = 1.0},
                                          {.name = "thickness_m", .value = 0.01}};
    const shcd_effect_def effect = {"wave", wave, 3};
    const shcd_body_def body =
        fixture_body("organ", organ, fixture_pose(0.0, 0.0, 0.0), &effect, 1);
    const shcd_tool_def tool = fixture_tool("ball", TOOL_RADIUS_M);
    const shcd_vec3 still = {0.0, 0.0, 0.0};
    shcd_vec3 s, n;
    fixture f;
    fixture_open(&f, &body, 1, &tool, 1);
    assert_int_equal(shcd_model_surface(organ, -1, w, &s, &n, NULL), SHCD_OK);
    for (int i = 0; i < 2000; i++) {
        const double depth_m = i < 100 ? DEPTH_M * i / 100.0 : DEPTH_M;
        fixture_move(&f, shcd_mul_add(s, TOOL_RADIUS_M - depth_m, n), still);
    }
    const double force = shcd_norm(f.out[0].wrench.force_n);
    fixture_close(&f);
    return force;
}

static void test_deflection_is_that_of_the_elements(void **state) {
    const double shear_pa = 5000.0 / (2.0 * 1.45), thickness_m = 0.01;
    const double kappa = shear_pa * thickness_m / (0.02 * 0.02), sigma_m = 0.0025;
    const size_t vertices[] = {0, 5, 11};
    membrane_fe *coarse = membrane_fe_create(organ, 5), *fine = membrane_fe_create(organ, 6);
    (void)state;
    for (size_t i = 0; i < sizeof vertices / sizeof vertices[0]; i++) {
        const double a = oracle(coarse, vertices[i], shear_pa, thickness_m, kappa, sigma_m);
        const double b = oracle(fine, vertices[i], shear_pa, thickness_m, kappa, sigma_m);
        const double expected = b + (b - a) / 3.0;
        const double found = DEPTH_M / held_force(membrane_fe_directions(fine)[vertices[i]]);
        print_message("place %zu: %.6f m/N by 64 modes and the rest, elements %.6f, %.6f -> %.6f: "
                      "%+.2f %%\n",
                      vertices[i], found, a, b, expected, 100.0 * (found / expected - 1.0));
        assert_near(found, expected, TOLERANCE * expected);
    }
    membrane_fe_free(coarse);
    membrane_fe_free(fine);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_deflection_is_that_of_the_elements),
    };
    return cmocka_run_group_tests(tests, make_organ, free_organ);
}
