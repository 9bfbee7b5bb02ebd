/* SPDX-License-Identifier: BSD-3-Clause */
/* Convex tools against soft bodies: random bodies, random deformations, random tools (needles and
 * plates among them) at random poses, separated and overlapping.
 *
 * The truth is hunted by brute force on a surface made anew from the deformed coefficients: all
 * points of a dense grid, the best of them walked downhill by a compass search, with distances to
 * the tool computed in other ways than the library's (support/tools.h). What it finds is an upper
 * bound of the true gap, so: lower <= found, and found is never below upper by more than rounding.
 * The answer's own points must attain it. */
#include "shcd/shape.h"
#include "support/tools.h"

#define GRID 48
#define STARTS 6
#define ROUNDING                                                                                   \
    1e-11 /* of the diagonal: evaluation of S and transformations of the pose, in both */

typedef struct sample {
    shcd_vec3 w, x;
} sample;

typedef struct scene {
    shcd_model *rest, *now; /* `now`: the deformed coefficients as a body of its own */
    shcd_shape *shape;
    void *memory;
    double diagonal;
    shcd_vec3 centre;
    double radius;
    sample *grid;
    size_t n_grid;
} scene;

typedef struct tally {
    size_t n, separated, overlapping, unsure, truncated, depth_truncated;
    double evaluations, patches, worst;
    uint32_t evaluations_max, patches_max;
} tally;

static shcd_vec3 surface(const scene *s, shcd_vec3 w) {
    shcd_vec3 x = {0.0, 0.0, 0.0};
    assert_int_equal(shcd_model_surface(s->now, -1, w, &x, NULL, NULL), SHCD_OK);
    return x;
}

/* A body near 1 m, and a deformation that moves it by up to a tenth of that. */
static void open_scene(scene *s, int degree, double amount, int follow, check_random *r) {
    const size_t n = 3 * SHCD_COUNT(degree);
    double *rest = calloc(2 * n, sizeof *rest), *now = rest + n;
    assert_non_null(rest);
    bodies_random_coefficients(r, degree, 0.05, rest);
    for (size_t i = 0; i < n; i++) {
        now[i] = rest[i] + amount * check_normal(r) / (1.0 + (double)(i / 3));
    }
    s->rest = bodies_create(degree, rest);
    s->now = bodies_create(degree, now);
    const size_t size = shcd_shape_size(s->rest);
    s->memory = aligned_alloc(16, (size + 15) / 16 * 16);
    assert_non_null(s->memory);
    assert_int_equal(shcd_shape_init(s->rest, s->memory, size, &s->shape), SHCD_OK);
    assert_int_equal(shcd_shape_set(s->rest, s->shape, now, follow), SHCD_OK);
    free(rest);
    const shcd_model_info info = bodies_info(s->now);
    s->diagonal = fmax(info.diagonal_m, bodies_info(s->rest).diagonal_m);
    s->centre = info.centre_m;
    s->radius = info.radius_m;
    s->n_grid = 6 * (GRID + 1) * (GRID + 1);
    s->grid = calloc(s->n_grid, sizeof *s->grid);
    assert_non_null(s->grid);
    for (size_t i = 0; i < s->n_grid; i++) {
        const size_t face = i / ((GRID + 1) * (GRID + 1)), at = i % ((GRID + 1) * (GRID + 1));
        const double u = tan(0.78539816 * (2.0 * (double)(at / (GRID + 1)) / GRID - 1.0));
        const double v = tan(0.78539816 * (2.0 * (double)(at % (GRID + 1)) / GRID - 1.0));
        const double sign = face % 2 == 0 ? 1.0 : -1.0;
        const shcd_vec3 w = face / 2 == 0   ? shcd_vec3_make(sign, u, v)
                            : face / 2 == 1 ? shcd_vec3_make(u, sign, v)
                                            : shcd_vec3_make(u, v, sign);
        s->grid[i].w = shcd_unit(w);
        s->grid[i].x = surface(s, s->grid[i].w);
    }
}

static void close_scene(scene *s) {
    free(s->grid);
    free(s->memory);
    shcd_model_free(s->now);
    shcd_model_free(s->rest);
}

/* ---- brute force: distance between core and surface ----------------------------------------- */

static double core_distance_at(const scene *s, const test_tool *t, shcd_pose pose, shcd_vec3 w) {
    return tools_core_distance(t, shcd_transform_inverse(pose, surface(s, w)));
}

/* Derivative free, so that kinks do not matter: eight directions in the tangent plane, the step is
 * halved when none is better. */
static double walk_down(const scene *s, const test_tool *t, shcd_pose pose, shcd_vec3 w) {
    double best = core_distance_at(s, t, pose, w), step = 2.0 / GRID;
    while (step > 1e-9) {
        const shcd_vec3 other =
            fabs(w.x) < 0.6 ? shcd_vec3_make(1.0, 0.0, 0.0) : shcd_vec3_make(0.0, 1.0, 0.0);
        const shcd_vec3 t1 = shcd_unit(shcd_cross(w, other)), t2 = shcd_cross(w, t1);
        int better = 0;
        for (int k = 0; k < 8; k++) {
            const double a = 0.785398163397448310 * k;
            const shcd_vec3 next =
                shcd_unit(shcd_mul_add(shcd_mul_add(w, step * cos(a), t1), step * sin(a), t2));
            const double d = core_distance_at(s, t, pose, next);
            if (d < best) {
                best = d;
                w = next;
                better = 1;
                break;
            }
        }
        step *= better ? 1.0 : 0.5;
    }
    return best;
}

/* min over the surface of the signed distance to the core, of the starts' basins. */
static double brute_core_distance(const scene *s, const test_tool *t, shcd_pose pose) {
    double least[STARTS];
    shcd_vec3 start[STARTS];
    size_t n = 0;
    for (size_t i = 0; i < s->n_grid; i++) {
        const double d = tools_core_distance(t, shcd_transform_inverse(pose, s->grid[i].x));
        size_t near = n;
        for (size_t k = 0; k < n; k++) {
            const shcd_vec3 apart = shcd_sub(start[k], s->grid[i].w);
            near = shcd_dot(apart, apart) < 0.01 ? k : near;
        }
        if (near == n && n < STARTS) {
            least[n] = d;
            start[n++] = s->grid[i].w;
        } else if (near == n) {
            for (size_t k = 0; k < n; k++) { /* the worst start gives way */
                near = near == n || least[k] > least[near] ? k : near;
            }
        }
        if (near < n && d < least[near]) {
            least[near] = d;
            start[near] = s->grid[i].w;
        }
    }
    double best = HUGE_VAL;
    for (size_t k = 0; k < n; k++) {
        best = fmin(best, walk_down(s, t, pose, start[k]));
    }
    return best;
}

/* ---- brute force: depth ---------------------------------------------------------------------- */

/* Smallest signed distance of random points of the core, by the exact point query on the body made
 * of the deformed coefficients (itself held against brute force elsewhere). */
static double brute_depth(const scene *s, const test_tool *t, shcd_pose pose, check_random *r) {
    double least = HUGE_VAL;
    for (int i = 0; i < 40; i++) {
        shcd_proximity near;
        shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
        options.tolerance = 1e-7;
        const shcd_vec3 p = shcd_transform(pose, tools_core_point(t, r));
        assert_int_equal(shcd_closest(s->now, p, &options, &near), SHCD_OK);
        least = fmin(least, near.upper_m);
    }
    return least;
}

/* ---- one case -------------------------------------------------------------------------------- */

static void check_points(const scene *s, const test_tool *t, shcd_pose pose, double tolerance,
                         const shcd_tool_proximity *got) {
    const shcd_vec3 at = surface(s, got->parameter);
    const shcd_vec3 inner = shcd_transform_inverse(pose, got->tool_point_m);
    /* point queries may extrapolate their last step within the tolerance */
    const double allowed = ROUNDING * s->diagonal + tolerance;
    assert_near(shcd_norm(shcd_sub(at, got->point_m)), 0.0, allowed);
    assert_at_most(tools_core_distance(t, inner), t->def.radius_m + ROUNDING * s->diagonal);
    assert_near(shcd_norm(got->normal), 1.0, 1e-12);
    if (got->gap_m > 0.0) {
        assert_near(shcd_norm(shcd_sub(got->point_m, got->tool_point_m)), got->gap_m, allowed);
    }
}

static void check_case(const scene *s, const test_tool *t, shcd_pose pose, check_random *r,
                       const shcd_query_options *options, tally *y) {
    shcd_tool_proximity got;
    const double slack = ROUNDING * s->diagonal;
    assert_int_equal(shcd_tool_closest(s->rest, s->shape, t->geometry, pose, options, &got),
                     SHCD_OK);
    const int truncated = (got.flags & SHCD_PROXIMITY_TRUNCATED) != 0;
    const int unsure = (got.flags & SHCD_PROXIMITY_SIGN_UNSURE) != 0;
    const double allowed =
        (options->tolerance > 0.0 ? options->tolerance : 1e-6) * fmax(s->diagonal, got.gap_m);
    assert_true(got.lower_m <= got.gap_m && got.gap_m <= got.upper_m);
    if (!truncated) {
        assert_at_most(got.upper_m - got.lower_m, allowed);
    }
    check_points(s, t, pose, allowed, &got);

    /* the gap is min over the core of the signed distance, - radius; where the core keeps clear of
     * the body that is the distance from core to surface */
    const double clear = brute_core_distance(s, t, pose) - t->def.radius_m;
    const double found = got.gap_m > -t->def.radius_m + allowed
                             ? clear
                             : fmin(clear, brute_depth(s, t, pose, r) - t->def.radius_m);
    if (got.lower_m > found + slack) {
        fail_msg("lower end %.17g above %.17g, which a point attains: kind %d, flags %u",
                 got.lower_m, found, (int)t->def.kind, got.flags);
    }
    const double beaten = got.upper_m - found;
    const int is_depth = got.gap_m <= -t->def.radius_m + allowed;
    if (!truncated && !(beaten <= allowed + slack)) {
        fail_msg("upper end %.17g, but %.17g is attained: kind %d, flags %u", got.upper_m, found,
                 (int)t->def.kind, got.flags);
    }
    y->n++;
    y->separated += got.lower_m > 0.0;
    y->overlapping += got.upper_m < 0.0;
    y->unsure += (size_t)unsure;
    y->truncated += truncated && !is_depth;
    y->depth_truncated += truncated && is_depth;
    y->worst = fmax(y->worst, truncated ? 0.0 : beaten / s->diagonal);
    if (!is_depth) {
        y->evaluations += got.n_evaluations;
        y->patches += got.n_patches;
        y->evaluations_max =
            got.n_evaluations > y->evaluations_max ? got.n_evaluations : y->evaluations_max;
        y->patches_max = got.n_patches > y->patches_max ? got.n_patches : y->patches_max;
    }
}

/* The tool's origin anywhere from the body's middle to twice its radius, near the surface often. */
static shcd_pose random_pose(const scene *s, const test_tool *t, check_random *r) {
    shcd_pose pose = {s->centre, tools_random_rotation(r)};
    const shcd_vec3 x = surface(s, bodies_random_direction(r));
    const double kind = check_uniform(r, 0.0, 1.0);
    if (kind < 0.6) {
        const double reach = t->def.half_length_m + t->def.radius_m + 0.05;
        pose.position_m = shcd_add(x, tools_random_point(0.0, reach, r));
    } else {
        pose.position_m = shcd_add(s->centre, tools_random_point(0.0, 2.0 * s->radius, r));
    }
    return pose;
}

static void report(const char *name, const tally *y) {
    print_message(
        "%s: %zu cases, %zu separated, %zu overlapping, %zu unsure; truncated %zu, of the "
        "depths %zu; upper end above brute force by <= %.2g of the diagonal; evaluations "
        "mean %.1f max %u, bounds mean %.0f max %u\n",
        name, y->n, y->separated, y->overlapping, y->unsure, y->truncated, y->depth_truncated,
        y->worst, y->evaluations / (double)y->n, y->evaluations_max, y->patches / (double)y->n,
        y->patches_max);
}

/* Depths may take any number of point queries, each of them hundreds of bounds: what is left of
 * these tests is that the interval stays true. */
static void run(const char *name, int degree, double amount, int follow, size_t n_cases,
                uint64_t seed) {
    static const int kinds[4] = {SHCD_TOOL_SPHERE, SHCD_TOOL_CAPSULE, SHCD_TOOL_BOX,
                                 SHCD_TOOL_HULL};
    check_random random = {seed};
    scene s;
    tally y = {.n = 0};
    open_scene(&s, degree, amount, follow, &random);
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    options.evaluations_max = 2000;
    options.patches_max = 100000;
    for (size_t i = 0; i < n_cases; i++) {
        test_tool t;
        tools_make_random(&t, kinds[i % 4], 0.6, &random);
        const shcd_pose pose = random_pose(&s, &t, &random);
        options.tolerance = i % 5 == 0 ? 1e-4 : 0.0;
        check_case(&s, &t, pose, &random, &options, &y);
        shcd_tool_geometry_free(t.geometry);
    }
    report(name, &y);
    assert_true(y.overlapping > n_cases / 5 && (n_cases < 20 || y.separated > n_cases / 20));
    /* searches for a distance end by themselves; sharp pockets may hold a depth search up */
    assert_at_most((double)y.truncated, 0.01 * (double)y.n);
    assert_at_most((double)y.unsure, 0.05 * (double)y.n);
    close_scene(&s);
}

static void test_rest_shape_of_degree_1(void **state) {
    (void)state;
    run("degree 1", 1, 0.0, SHCD_FOLLOW_AUTO, check_scaled(200), 101);
}
static void test_degree_6_inflated(void **state) {
    (void)state;
    run("degree 6, inflated", 6, 0.003, SHCD_FOLLOW_INFLATE, check_scaled(400), 102);
}
static void test_degree_6_refreshed(void **state) {
    (void)state;
    run("degree 6, refreshed", 6, 0.05, SHCD_FOLLOW_REFRESH, check_scaled(400), 103);
}
static void test_degree_15_deformed(void **state) {
    (void)state;
    run("degree 15, deformed", 15, 0.02, SHCD_FOLLOW_AUTO, check_scaled(400), 104);
}
static void test_degree_15_at_rest(void **state) {
    (void)state;
    run("degree 15, at rest", 15, 0.0, SHCD_FOLLOW_AUTO, check_scaled(400), 105);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rest_shape_of_degree_1), cmocka_unit_test(test_degree_6_inflated),
        cmocka_unit_test(test_degree_6_refreshed),     cmocka_unit_test(test_degree_15_deformed),
        cmocka_unit_test(test_degree_15_at_rest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
