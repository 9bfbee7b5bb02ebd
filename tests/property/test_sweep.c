/* SPDX-License-Identifier: BSD-3-Clause */
/* Sweeps over random bodies that deform at random while a ball passes: dense sampling of the
 * surface and of time never finds an overlap before the reported time, and the contact that is
 * reported is a point of the surface within the tolerance. The surface is sampled from sums of
 * shcd_harmonics() here, which shares no bound and no search with the sweep. */
#include "shcd/shcd.h"
#include "shcd/sweep.h"
#include "support/bodies.h"
#include "support/check.h"

#include <string.h>

#define DIRECTIONS 3000
#define TIMES 48
#define DEGREE_MAX 8
#define VALUES (3 * SHCD_COUNT(DEGREE_MAX))

typedef struct swarm {
    double *y;            /* DIRECTIONS x SHCD_COUNT(DEGREE_MAX) */
    shcd_vec3 *from, *to; /* S at both ends of the tick */
} swarm;

static shcd_vec3 sum(int degree, const double *coefficients, const double *y) {
    shcd_vec3 x = {0.0, 0.0, 0.0};
    for (size_t i = 0; i < SHCD_COUNT(degree); i++) {
        x.x += coefficients[3 * i] * y[i];
        x.y += coefficients[3 * i + 1] * y[i];
        x.z += coefficients[3 * i + 2] * y[i];
    }
    return x;
}

static void swarm_create(swarm *s, check_random *random) {
    s->y = calloc(DIRECTIONS * SHCD_COUNT(DEGREE_MAX), sizeof *s->y);
    s->from = calloc(DIRECTIONS, sizeof *s->from);
    s->to = calloc(DIRECTIONS, sizeof *s->to);
    assert_true(s->y != NULL && s->from != NULL && s->to != NULL);
    for (size_t i = 0; i < DIRECTIONS; i++) {
        assert_int_equal(shcd_harmonics(DEGREE_MAX, bodies_random_direction(random),
                                        s->y + i * SHCD_COUNT(DEGREE_MAX), NULL, NULL),
                         SHCD_OK);
    }
}

static void swarm_free(swarm *s) {
    free(s->y);
    free(s->from);
    free(s->to);
}

/* Smallest sampled distance from p to the surface at time t. */
static double swarm_distance(const swarm *s, shcd_vec3 p, double t) {
    double least = HUGE_VAL;
    for (size_t i = 0; i < DIRECTIONS; i++) {
        const shcd_vec3 x = shcd_add(shcd_scale(1.0 - t, s->from[i]), shcd_scale(t, s->to[i]));
        const shcd_vec3 d = shcd_sub(x, p);
        least = fmin(least, shcd_dot(d, d));
    }
    return sqrt(least);
}

typedef struct tally {
    size_t n, n_contacts, n_overlaps, n_truncated;
    uint32_t steps, evaluations;
} tally;

static void check_sweep(const swarm *s, const shcd_sweep_def *def, int degree, const double *from,
                        const double *to, const shcd_sweep_result *out) {
    const shcd_vec3 p = def->from.position_m, v = shcd_sub(def->to.position_m, p);
    for (int k = 0; k <= TIMES; k++) {
        const double t = out->time * k / TIMES;
        assert_true(swarm_distance(s, shcd_mul_add(p, t, v), t) > def->radius_m);
    }
    assert_true(out->lower_m > 0.0);
    if (out->outcome == SHCD_SWEEP_CONTACT) {
        double y[SHCD_COUNT(DEGREE_MAX)];
        assert_int_equal(shcd_harmonics(degree, out->parameter, y, NULL, NULL), SHCD_OK);
        const shcd_vec3 x = shcd_add(shcd_scale(1.0 - out->time, sum(degree, from, y)),
                                     shcd_scale(out->time, sum(degree, to, y)));
        const shcd_vec3 at = shcd_mul_add(p, out->time, v);
        const double gap = shcd_norm(shcd_sub(x, at)) - def->radius_m;
        /* the parameter is that of a foot to 1e-9 of the diagonal */
        assert_true(gap > 0.0 && gap <= def->tolerance_m + 1e-8);
        /* the query's own tolerance, of a body of 3 m */
        assert_near(shcd_norm(shcd_sub(x, out->point_m)), 0.0, 1e-8);
        assert_true(out->upper_m <= def->tolerance_m);
        assert_near(shcd_norm(shcd_sub(out->tool_point_m, at)), def->radius_m, 1e-14);
    }
}

static shcd_vec3 outside(check_random *random, double least, double most) {
    return shcd_scale(check_uniform(random, least, most), bodies_random_direction(random));
}

static void sweep_body(swarm *s, check_random *random, int degree, int deforms, size_t n_sweeps,
                       tally *t) {
    double from[VALUES], to[VALUES];
    bodies_random_coefficients(random, degree, 0.08, from);
    from[0] = from[1] = from[2] = 0.0;
    shcd_model *model = bodies_create(degree, from);
    void *scratch = aligned_alloc(16, (shcd_sweep_scratch_size(model) + 15) / 16 * 16);
    assert_non_null(scratch);
    for (size_t i = 0; i < n_sweeps; i++) {
        memcpy(to, from, sizeof to);
        for (size_t k = 0; deforms && k < 3 * SHCD_COUNT(degree); k++) {
            to[k] += 0.03 * check_normal(random);
        }
        for (size_t k = 0; k < DIRECTIONS; k++) {
            s->from[k] = sum(degree, from, s->y + k * SHCD_COUNT(DEGREE_MAX));
            s->to[k] = sum(degree, to, s->y + k * SHCD_COUNT(DEGREE_MAX));
        }
        shcd_sweep_def def = SHCD_SWEEP_DEF_INIT;
        def.from.orientation.w = def.to.orientation.w = 1.0;
        def.radius_m = i % 3 == 0 ? 0.0 : check_uniform(random, 0.0, 0.1);
        def.tolerance_m = 1e-5;
        def.from.position_m = outside(random, 1.3, 1.9);
        def.to.position_m = outside(random, 0.0, 1.6);
        def.coefficients_to = deforms ? to : NULL;
        shcd_sweep_result out;
        assert_int_equal(shcd_sweep(model, &def, scratch, shcd_sweep_scratch_size(model), &out),
                         SHCD_OK);
        t->n++;
        t->n_contacts += out.outcome == SHCD_SWEEP_CONTACT;
        t->n_truncated += out.outcome == SHCD_SWEEP_TRUNCATED;
        t->n_overlaps += out.outcome == SHCD_SWEEP_OVERLAP_AT_START;
        t->steps = out.n_steps > t->steps ? out.n_steps : t->steps;
        t->evaluations = out.n_evaluations > t->evaluations ? out.n_evaluations : t->evaluations;
        if (out.outcome != SHCD_SWEEP_OVERLAP_AT_START) {
            check_sweep(s, &def, degree, from, to, &out);
        }
    }
    free(scratch);
    shcd_model_free(model);
}

static void run(uint64_t seed, int deforms) {
    check_random random = {seed};
    tally t = {0, 0, 0, 0, 0, 0};
    swarm s;
    swarm_create(&s, &random);
    const size_t n_bodies = check_scaled(24);
    for (size_t i = 0; i < n_bodies; i++) {
        sweep_body(&s, &random, 2 + (int)(i % (DEGREE_MAX - 1)), deforms, 50, &t);
    }
    print_message(
        "seed %llu: %zu sweeps, %zu contacts, %zu overlaps at the start, %zu truncated, at "
        "most %u steps, %u evaluations\n",
        (unsigned long long)seed, t.n, t.n_contacts, t.n_overlaps, t.n_truncated, t.steps,
        t.evaluations);
    assert_true(t.n_contacts > t.n / 5);
    assert_true(t.n_overlaps < t.n / 10);
    assert_int_equal(t.n_truncated, 0);
    swarm_free(&s);
}

static void test_sweep_past_rigid_bodies_finds_first_contact(void **state) {
    (void)state;
    run(20261126, 0);
}

static void test_sweep_past_deforming_bodies_finds_first_contact(void **state) {
    (void)state;
    run(20261127, 1);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_sweep_past_rigid_bodies_finds_first_contact),
        cmocka_unit_test(test_sweep_past_deforming_bodies_finds_first_contact),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
