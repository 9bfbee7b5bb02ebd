/* SPDX-License-Identifier: BSD-3-Clause */
/* Every loop of a query and of a tick has a cap, so a tick has a longest time on every input. Here
 * the counters that the results carry are held against the caps, where they are hardest to keep:
 * centres of spheres (nothing can be pruned), medial axes and focal points (no unique foot),
 * needles and plates of aspect 1000, surfaces that cut themselves, points at 1e9 m, tolerances that
 * cannot be met.
 *
 * What is begun below a cap is finished, so the counters may pass it by:
 * - evaluations: the patch's own, a Newton run (24 steps of at most 10 trials) and a split (3);
 * - bounds: four siblings, and one for each of the leaves (256) and patches (28 levels of 3, and 4)
 *   that were already waiting.
 * The first Newton run has no cap to look at, nor do the fast tier's four. */
#include "support/bodies.h"
#include "support/scene_fixture.h"

#define NEWTON_RUN (24 * 10)
#define EVALUATIONS_OVER (1 + NEWTON_RUN + 3)
#define EVALUATIONS_FAST (4 * (1 + NEWTON_RUN))
#define BOUNDS_OVER (4 + 256 + 3 * 28 + 4)
#define TRACK_STEPS 16
#define TRACK_EVALUATIONS (1 + TRACK_STEPS * 10)

/* caps of one query in a tick (libshcd/response/contact.c) */
#define TICK_BOUNDS 12000
#define TICK_EVALUATIONS 400
/* in contact: the proxy is followed once, then by up to four steps of a slide; then one query */
#define TICK_TRACKS 5

#define N_MODELS 9
#define N_SPECIAL 12

typedef struct case_body {
    const char *name;
    shcd_model *model;
    shcd_model_info info;
    shcd_vec3 points[N_SPECIAL];
    size_t n_points;
} case_body;

static case_body bodies[N_MODELS];
static size_t n_bodies;

static case_body *add(const char *name, shcd_model *model) {
    case_body *b = &bodies[n_bodies++];
    b->name = name;
    b->model = model;
    b->info = bodies_info(model);
    b->points[b->n_points++] = b->info.centre_m;
    b->points[b->n_points++] = b->info.star_centre_m;
    b->points[b->n_points++] = shcd_vec3_make(1e9, -1e9, 1e9);
    b->points[b->n_points++] = shcd_vec3_make(0.0, 0.0, -1e9);
    b->points[b->n_points++] = shcd_add(b->info.centre_m, shcd_vec3_make(1e-12, 0.0, 0.0));
    return b;
}

/* Foci of curvature on the axis a of the section a > b, where the foot splits, just inside and
 * outside of one, and a point of the medial disc. */
static void add_ellipsoid(const char *name, double a, double b, double c) {
    case_body *e = add(name, bodies_create_ellipsoid(a, b, c));
    const double cusp = (a * a - b * b) / a;
    const double offsets[4] = {0.0, 1e-9, -1e-9, -0.4};
    for (size_t i = 0; i < 4; i++) {
        e->points[e->n_points++] = shcd_vec3_make(cusp * (1.0 + offsets[i]), 0.0, 0.0);
    }
    e->points[e->n_points++] = shcd_vec3_make(0.3 * a, 0.0, 0.2 * (a * a - c * c) / a);
}

static int make_bodies(void **state) {
    check_random random = {7};
    (void)state;
    add_ellipsoid("sphere", 1.0, 1.0, 1.0);
    add_ellipsoid("nearly a sphere", 1.0, 1.0 - 1e-7, 1.0 - 2e-7);
    add_ellipsoid("ellipsoid", 2.0, 1.0, 0.7);
    add_ellipsoid("needle", 1.0, 1e-3, 1e-3);
    add_ellipsoid("plate", 1.0, 1.0, 1e-3);
    add("uneven, degree 15", bodies_create_random(&random, 15, 0.05));
    add("cut by itself, degree 15", bodies_create_random(&random, 15, 0.5));
    add("cut by itself, degree 15, again", bodies_create_random(&random, 15, 0.5));
    add("bent", bodies_create_bent(0.3, 0.3, 1.0, 0.8));
    return 0;
}

static int free_bodies(void **state) {
    (void)state;
    for (size_t i = 0; i < n_bodies; i++) {
        shcd_model_free(bodies[i].model);
    }
    return 0;
}

/* Special points first, then random ones, on and near the surface too. */
static shcd_vec3 point_of(const case_body *b, size_t i, check_random *random) {
    if (i < b->n_points) {
        return b->points[i];
    }
    const shcd_vec3 w = bodies_random_direction(random);
    shcd_vec3 x = b->info.centre_m;
    assert_int_equal(shcd_model_surface(b->model, -1, w, &x, NULL, NULL), SHCD_OK);
    static const double away[4] = {0.0, 1e-13, 1e-4, 0.5};
    return shcd_mul_add(x, away[i % 4] * b->info.diagonal_m, bodies_random_direction(random));
}

typedef struct worst {
    double evaluations_over, bounds_over;
} worst;

static void note(worst *w, const shcd_proximity *found, double evaluations_max, double bounds_max) {
    w->evaluations_over = fmax(w->evaluations_over, (double)found->n_evaluations - evaluations_max);
    w->bounds_over = fmax(w->bounds_over, (double)found->n_patches - bounds_max);
}

static void test_closest_keeps_the_caps_it_is_given(void **state) {
    static const uint32_t bounds_max[] = {1, 50, 1000, 12000, 0};
    static const uint32_t evaluations_max[] = {1, 20, 100, 400, 0};
    static const double tolerances[] = {1e-15, 0.0, 1e-4};
    check_random random = {11};
    worst exact = {-1.0, -1.0}, fast = {-1.0, -1.0};
    (void)state;
    for (size_t b = 0; b < n_bodies; b++) {
        for (size_t i = 0; i < N_SPECIAL + check_scaled(20); i++) {
            const shcd_vec3 p = point_of(&bodies[b], i, &random);
            for (size_t k = 0; k < 3 * 2 * 5; k++) {
                shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
                shcd_proximity found;
                options.patches_max = bounds_max[k % 5];
                options.evaluations_max = evaluations_max[k % 5];
                options.tier = k / 5 % 2 == 0 ? SHCD_TIER_EXACT : SHCD_TIER_FAST;
                options.tolerance = tolerances[k / 10];
                assert_int_equal(shcd_closest(bodies[b].model, p, &options, &found), SHCD_OK);
                const double limit = options.patches_max != 0 ? (double)options.patches_max
                                                              : SHCD_QUERY_PATCHES_DEFAULT;
                const double evaluations = options.evaluations_max != 0
                                               ? (double)options.evaluations_max
                                               : SHCD_QUERY_EVALUATIONS_DEFAULT;
                note(options.tier == SHCD_TIER_EXACT ? &exact : &fast, &found, evaluations, limit);
                /* a closed form's steps evaluate nothing */
                assert_true(found.n_newton <= found.n_evaluations || found.n_patches == 0);
                if (options.tier == SHCD_TIER_EXACT) {
                    assert_at_most((double)found.n_evaluations, evaluations + EVALUATIONS_OVER);
                } else {
                    assert_at_most((double)found.n_evaluations,
                                   fmax(evaluations, EVALUATIONS_FAST));
                }
                assert_at_most((double)found.n_patches, limit + BOUNDS_OVER);
            }
        }
    }
    printf("beyond the caps at most: exact %g evaluations, %g bounds; fast %g and %g\n",
           exact.evaluations_over, exact.bounds_over, fast.evaluations_over, fast.bounds_over);
}

static void test_map_tier_costs_one_evaluation(void **state) {
    check_random random = {12};
    (void)state;
    for (size_t b = 0; b < n_bodies; b++) {
        for (size_t i = 0; i < N_SPECIAL + check_scaled(200); i++) {
            const shcd_vec3 p = point_of(&bodies[b], i, &random);
            for (int hermite = 0; hermite < 2; hermite++) {
                shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
                shcd_proximity found;
                options.tier = SHCD_TIER_MAP;
                options.map_hermite = hermite;
                assert_int_equal(shcd_closest(bodies[b].model, p, &options, &found), SHCD_OK);
                assert_in_range(found.n_evaluations, 0, 1);
                assert_int_equal(found.n_patches, 0);
                assert_int_equal(found.n_newton, 0);
            }
        }
    }
}

static void test_track_takes_at_most_16_newton_steps(void **state) {
    check_random random = {13};
    uint32_t most_steps = 0, most_evaluations = 0;
    (void)state;
    for (size_t b = 0; b < n_bodies; b++) {
        for (size_t i = 0; i < N_SPECIAL + check_scaled(500); i++) {
            const shcd_vec3 p = point_of(&bodies[b], i, &random);
            shcd_proximity found;
            assert_int_equal(
                shcd_track(bodies[b].model, p, bodies_random_direction(&random), &found), SHCD_OK);
            assert_in_range(found.n_newton, 0, TRACK_STEPS);
            assert_in_range(found.n_evaluations, 1, TRACK_EVALUATIONS);
            most_steps = found.n_newton > most_steps ? found.n_newton : most_steps;
            most_evaluations =
                found.n_evaluations > most_evaluations ? found.n_evaluations : most_evaluations;
        }
    }
    printf("at most %u Newton steps, %u evaluations\n", most_steps, most_evaluations);
}

/* A convex tool's contact: one query, two descents along the core of ten followed feet each, and
 * the query that looks for a deeper point (libshcd/response/contact_convex.c, sink.c). */
#define SINK_TRACKS 10
#define CONVEX_EVALUATIONS                                                                         \
    (TICK_EVALUATIONS + (TICK_TRACKS + 2 * SINK_TRACKS) * TRACK_EVALUATIONS + 2 * EVALUATIONS_OVER)
/* A shell has four times the caps, for all of its points; what is begun is one point. */
#define SHELL_FACTOR 4
#define SHELL_POINTS 200
#define N_TOOLS 5

static shcd_tool_geometry *make_shell(check_random *random) {
    static shcd_vec3 points[SHELL_POINTS], normals[SHELL_POINTS];
    for (size_t i = 0; i < SHELL_POINTS; i++) {
        normals[i] = bodies_random_direction(random);
        points[i] = shcd_scale(-0.3, normals[i]);
    }
    return fixture_shell(points, normals, SHELL_POINTS);
}

/* A tool that leaps between the worst places, and lingers so that its contact gets old. */
static void test_tick_keeps_its_caps_per_body(void **state) {
    check_random random = {14};
    shcd_tool_geometry *const geometries[3] = {
        fixture_capsule(0.05, 0.4), fixture_box(0.4, 0.2, 0.1, 0.02), make_shell(&random)};
    const shcd_tool_def tools[N_TOOLS] = {
        fixture_tool("tip", 0.0), fixture_tool("ball", 0.05),
        fixture_tool_of("capsule", SHCD_TOOL_CAPSULE, geometries[0]),
        fixture_tool_of("box", SHCD_TOOL_BOX, geometries[1]),
        fixture_tool_of("shell", SHCD_TOOL_SHELL, geometries[2])};
    const double evaluations_max[N_TOOLS] = {
        TICK_TRACKS * TRACK_EVALUATIONS + TICK_EVALUATIONS + EVALUATIONS_OVER,
        TICK_TRACKS * TRACK_EVALUATIONS + TICK_EVALUATIONS + EVALUATIONS_OVER, CONVEX_EVALUATIONS,
        CONVEX_EVALUATIONS,
        SHELL_FACTOR * TICK_EVALUATIONS + TICK_TRACKS * TRACK_EVALUATIONS + EVALUATIONS_OVER};
    const double bounds_max[N_TOOLS] = {
        TICK_BOUNDS + BOUNDS_OVER, TICK_BOUNDS + BOUNDS_OVER, 2 * (TICK_BOUNDS + BOUNDS_OVER),
        2 * (TICK_BOUNDS + BOUNDS_OVER), SHELL_FACTOR * TICK_BOUNDS + BOUNDS_OVER};
    const shcd_effect_def effects[2] = {{"stiffness", NULL, 0}, {"damping", NULL, 0}};
    shcd_body_def defs[N_MODELS];
    char names[N_MODELS][24];
    double most_evaluations[N_TOOLS] = {0.0}, most_bounds[N_TOOLS] = {0.0};
    fixture f;
    (void)state;
    for (size_t b = 0; b < n_bodies; b++) {
        snprintf(names[b], sizeof names[b], "b%zu", b);
        defs[b] =
            fixture_body(names[b], bodies[b].model, fixture_random_pose(&random, 0.5), effects, 2);
    }
    fixture_open(&f, defs, n_bodies, tools, N_TOOLS);
    for (size_t i = 0; i < check_scaled(3000); i++) {
        for (size_t t = 0; t < N_TOOLS; t++) {
            shcd_tool_input *in = &f.in[t];
            if (i % 4 == 0) {
                const size_t b = (size_t)(check_random_bits(&random) % n_bodies);
                const size_t at = (size_t)(check_random_bits(&random) % (2 * N_SPECIAL));
                const shcd_vec3 p = point_of(&bodies[b], at, &random);
                const double far = shcd_norm(p) > 1e8 ? 0.1 : 1.0; /* 1e9 is the limit of input */
                in->tool_in_world.position_m =
                    shcd_transform(defs[b].body_in_world, shcd_scale(far, p));
            } else {
                in->tool_in_world.position_m =
                    shcd_mul_add(in->tool_in_world.position_m, 0.01 * (double)(i % 4),
                                 bodies_random_direction(&random));
            }
        }
        fixture_step(&f);
        for (size_t t = 0; t < N_TOOLS; t++) {
            most_evaluations[t] = fmax(most_evaluations[t], (double)f.out[t].n_evaluations);
            most_bounds[t] = fmax(most_bounds[t], (double)f.out[t].n_patches);
        }
    }
    for (size_t t = 0; t < N_TOOLS; t++) {
        printf("%s, one tick, %zu bodies that overlap: at most %g evaluations, %g bounds\n",
               tools[t].name, n_bodies, most_evaluations[t], most_bounds[t]);
        assert_at_most(most_evaluations[t], (double)n_bodies * evaluations_max[t]);
        assert_at_most(most_bounds[t], (double)n_bodies * bounds_max[t]);
    }
    fixture_close(&f);
    for (size_t g = 0; g < 3; g++) {
        shcd_tool_geometry_free(geometries[g]);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_closest_keeps_the_caps_it_is_given),
        cmocka_unit_test(test_map_tier_costs_one_evaluation),
        cmocka_unit_test(test_track_takes_at_most_16_newton_steps),
        cmocka_unit_test(test_tick_keeps_its_caps_per_body),
    };
    return cmocka_run_group_tests(tests, make_bodies, free_bodies);
}
