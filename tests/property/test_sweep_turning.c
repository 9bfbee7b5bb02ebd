/* SPDX-License-Identifier: BSD-3-Clause */
/* Sweeps of capsules, boxes and hulls that turn while they move, past random bodies that deform
 * meanwhile: at no time before the one reported does dense sampling of the surface find a point of
 * it in the tool, and a contact that is reported is one. A tool that starts outside cannot come in
 * without the surface passing through it. The surface comes from sums of shcd_harmonics(), the
 * distance to the tool from support/tools.h: neither shares a bound with the sweep. */
#include "shcd/shcd.h"
#include "shcd/sweep.h"
#include "support/sweep_path.h"
#include "support/tools.h"

#include <string.h>

#define DIRECTIONS 2000
#define TIMES 48
#define DEGREE_MAX 8
#define VALUES (3 * SHCD_COUNT(DEGREE_MAX))
#define TOLERANCE_M 1e-5
#define TOOL_M 0.3

/* The surface at both ends of the tick, sampled; between them points move straight. */
typedef struct swarm {
    double *y; /* DIRECTIONS x SHCD_COUNT(DEGREE_MAX) */
    shcd_vec3 from[DIRECTIONS], to[DIRECTIONS];
} swarm;

typedef struct tally {
    size_t n, n_contacts, n_overlaps, n_truncated, n_near;
    uint32_t steps, queries;
    double evaluations;
} tally;

static swarm s;

static shcd_vec3 sum(int degree, const double *coefficients, const double *y) {
    shcd_vec3 x = {0.0, 0.0, 0.0};
    for (size_t i = 0; i < SHCD_COUNT(degree); i++) {
        x.x += coefficients[3 * i] * y[i];
        x.y += coefficients[3 * i + 1] * y[i];
        x.z += coefficients[3 * i + 2] * y[i];
    }
    return x;
}

static shcd_vec3 between(shcd_vec3 a, shcd_vec3 b, double t) {
    return shcd_add(shcd_scale(1.0 - t, a), shcd_scale(t, b));
}

static int make_swarm(void **state) {
    check_random random = {20261208};
    (void)state;
    s.y = calloc(DIRECTIONS * SHCD_COUNT(DEGREE_MAX), sizeof *s.y);
    for (size_t i = 0; s.y != NULL && i < DIRECTIONS; i++) {
        if (shcd_harmonics(DEGREE_MAX, bodies_random_direction(&random),
                           s.y + i * SHCD_COUNT(DEGREE_MAX), NULL, NULL) != SHCD_OK) {
            return 1;
        }
    }
    return s.y == NULL;
}

static int free_swarm(void **state) {
    (void)state;
    free(s.y);
    return 0;
}

/* No point of the tool is farther from its origin. */
static double reach_m(const test_tool *t) {
    const double h =
        t->def.kind == SHCD_TOOL_CAPSULE ? t->def.half_length_m : shcd_norm(t->def.half_extents_m);
    return t->def.radius_m + (t->def.kind == SHCD_TOOL_HULL ? TOOL_M : h);
}

/* Smallest sampled gap at time t; a point out of reach counts as out of reach. */
static double sampled_gap(const test_tool *tool, const shcd_sweep_def *def, double t) {
    const shcd_pose pose = sweep_path_pose(def, t);
    const double reach = reach_m(tool);
    double least = HUGE_VAL;
    for (size_t i = 0; i < DIRECTIONS; i++) {
        const shcd_vec3 x = shcd_transform_inverse(pose, between(s.from[i], s.to[i], t));
        if (shcd_dot(x, x) <= (reach + 0.01) * (reach + 0.01)) {
            least = fmin(least, tools_core_distance(tool, x) - tool->def.radius_m);
        }
    }
    return least;
}

static void check_contact(const test_tool *tool, const shcd_sweep_def *def, int degree,
                          const double *from, const double *to, const shcd_sweep_result *out) {
    double y[SHCD_COUNT(DEGREE_MAX)];
    const shcd_pose pose = sweep_path_pose(def, out->time);
    assert_int_equal(shcd_harmonics(degree, out->parameter, y, NULL, NULL), SHCD_OK);
    const shcd_vec3 x = between(sum(degree, from, y), sum(degree, to, y), out->time);
    const double gap =
        tools_core_distance(tool, shcd_transform_inverse(pose, x)) - tool->def.radius_m;
    /* the parameter is that of a foot to 1e-9 of the diagonal, about 3 m */
    assert_true(gap > 0.0 && gap <= def->tolerance_m + 1e-8);
    assert_near(shcd_norm(shcd_sub(x, out->point_m)), 0.0, 1e-8);
    /* the tool's own point lies on the tool, and as far from the surface's */
    const shcd_vec3 on = shcd_transform_inverse(pose, out->tool_point_m);
    assert_near(tools_core_distance(tool, on), tool->def.radius_m, 1e-8);
    assert_near(shcd_norm(shcd_sub(out->tool_point_m, x)), gap, def->tolerance_m);
    assert_true(out->upper_m <= def->tolerance_m);
}

static void check_sweep(const test_tool *tool, const shcd_sweep_def *def,
                        const shcd_sweep_result *out, tally *t) {
    double least = HUGE_VAL;
    for (int k = 0; k <= TIMES; k++) {
        const double gap = sampled_gap(tool, def, out->time * k / TIMES);
        assert_true(gap > 0.0);
        least = fmin(least, gap);
    }
    t->n_near += least < 0.05;
    assert_true(out->lower_m > 0.0);
}

static shcd_pose random_pose(double low, double high, const shcd_pose *near, check_random *random) {
    shcd_pose pose = tools_random_pose(low, high, random);
    if (near != NULL) { /* a turn of up to some 40 degrees */
        const shcd_quat a = near->orientation, b = pose.orientation;
        pose.orientation =
            sweep_path_unit(a.w + 0.35 * b.w, a.x + 0.35 * b.x, a.y + 0.35 * b.y, a.z + 0.35 * b.z);
    }
    return pose;
}

/* By some 10 % of the body, less in fine harmonics: what cuts itself has no inside to stay out of.
 */
static void deform(int degree, const double *from, double *to, check_random *random) {
    for (int l = 0; l <= degree; l++) {
        for (size_t k = 3 * SHCD_INDEX(l, -l); k < 3 * SHCD_INDEX(l, l) + 3; k++) {
            to[k] = from[k] + 0.1 * check_normal(random) / ((l + 1) * (l + 1));
        }
    }
}

static void sweep_body(int kind, int degree, size_t n_sweeps, check_random *random, tally *t) {
    double from[VALUES], to[VALUES];
    bodies_random_coefficients(random, degree, 0.05, from);
    from[0] = from[1] = from[2] = 0.0;
    shcd_model *model = bodies_create(degree, from);
    const size_t size = (shcd_sweep_scratch_size(model) + 15) / 16 * 16;
    void *scratch = aligned_alloc(16, size);
    assert_non_null(scratch);
    for (size_t i = 0; i < n_sweeps; i++) {
        test_tool tool;
        shcd_sweep_def def = SHCD_SWEEP_DEF_INIT;
        shcd_sweep_result out;
        tools_make_random(&tool, kind, TOOL_M, random);
        deform(degree, from, to, random);
        for (size_t k = 0; k < DIRECTIONS; k++) {
            s.from[k] = sum(degree, from, s.y + k * SHCD_COUNT(DEGREE_MAX));
            s.to[k] = sum(degree, to, s.y + k * SHCD_COUNT(DEGREE_MAX));
        }
        def.tool = tool.geometry;
        def.tolerance_m = TOLERANCE_M;
        def.from = random_pose(1.5, 1.9, NULL, random);
        def.to = random_pose(0.2, 1.7, i % 3 == 0 ? NULL : &def.from, random);
        def.coefficients_to = to;
        assert_int_equal(shcd_sweep(model, &def, scratch, size, &out), SHCD_OK);
        t->n++;
        t->n_contacts += out.outcome == SHCD_SWEEP_CONTACT;
        t->n_truncated += out.outcome == SHCD_SWEEP_TRUNCATED;
        t->n_overlaps += out.outcome == SHCD_SWEEP_OVERLAP_AT_START;
        t->steps = out.n_steps > t->steps ? out.n_steps : t->steps;
        t->queries = out.n_queries > t->queries ? out.n_queries : t->queries;
        t->evaluations += out.n_evaluations;
        if (out.outcome != SHCD_SWEEP_OVERLAP_AT_START) {
            check_sweep(&tool, &def, &out, t);
        }
        if (out.outcome == SHCD_SWEEP_CONTACT) {
            check_contact(&tool, &def, degree, from, to, &out);
        } else if (out.outcome == SHCD_SWEEP_SEPARATED) {
            assert_true(out.time == 1.0);
        }
        shcd_tool_geometry_free(tool.geometry);
    }
    free(scratch);
    shcd_model_free(model);
}

static void run(int kind, uint64_t seed) {
    check_random random = {seed};
    tally t;
    memset(&t, 0, sizeof t);
    const size_t n_bodies = check_scaled(21);
    for (size_t i = 0; i < n_bodies; i++) {
        sweep_body(kind, 2 + (int)(i % (DEGREE_MAX - 1)), 15, &random, &t);
    }
    print_message("seed %llu: %zu sweeps, %zu contacts, %zu overlaps at the start, %zu truncated, "
                  "%zu nearer than 5 cm, at most %u steps, %u queries, %.0f evaluations each\n",
                  (unsigned long long)seed, t.n, t.n_contacts, t.n_overlaps, t.n_truncated,
                  t.n_near, t.steps, t.queries, t.evaluations / (double)t.n);
    assert_true(t.n_contacts > t.n / 5);
    assert_true(t.n_contacts <= t.n - t.n / 20);
    assert_true(t.n_overlaps < t.n / 10);
    /* the samples, 8 cm from each other, see what comes close */
    assert_true(t.n_near > t.n_contacts / 2);
    /* rare: what is claimed up to their time was checked like the others */
    assert_true(t.n_truncated <= 1 + t.n / 100);
}

static void test_sweep_turning_capsules_past_deforming_bodies(void **state) {
    (void)state;
    run(SHCD_TOOL_CAPSULE, 20261209);
}

static void test_sweep_turning_boxes_past_deforming_bodies(void **state) {
    (void)state;
    run(SHCD_TOOL_BOX, 20261210);
}

static void test_sweep_turning_hulls_past_deforming_bodies(void **state) {
    (void)state;
    run(SHCD_TOOL_HULL, 20261211);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sweep_turning_capsules_past_deforming_bodies),
        cmocka_unit_test(test_sweep_turning_boxes_past_deforming_bodies),
        cmocka_unit_test(test_sweep_turning_hulls_past_deforming_bodies),
    };
    return cmocka_run_group_tests(tests, make_swarm, free_swarm);
}
