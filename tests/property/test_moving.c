/* SPDX-License-Identifier: BSD-3-Clause */
/* A body that deforms in every tick, its query tree refreshed a share at a time, against brute
 * force on the current surface: a dent that travels and rings, or coefficients that oscillate at
 * random.
 *
 * What brute force finds is the distance of a point of the surface, hence an upper bound of the
 * truth: `lower` may never exceed it, nor may it be nearer than `upper` less the tolerance. A copy
 * of the shape made in mid-pass has to go on with the same bits. */
#include "property/usual.h"
#include "shcd/shape.h"
#include "support/bodies.h"
#include "support/brute.h"

#include <string.h>

#define SEED 20261123u
#define TOLERANCE 1e-9
#define TICKS 200
#define POINTS 6
#define DENSE 80
#define DEGREE_MAX 20

typedef struct body {
    const char *name;
    shcd_model *model;
    shcd_model_info info;
    shcd_shape *shape, *copy;
    size_t size, n; /* of a shape; of coefficients */
    double *current, *rate;
    check_random random;
    shcd_certificate certificate;
    shcd_vec3 at; /* parameter that the lasting query follows */
    size_t n_asked, n_unsure, n_signs, n_truncated, n_next_unsure, n_mixed;
    double evaluations, patches;
    uint32_t patches_max, evaluations_max;
} body;

/* A dent of `depth` along the normal at w, of the heat kernel's shape and scaled to its peak. */
static void add_dent(body *b, shcd_vec3 w, double depth) {
    double y[SHCD_COUNT(DEGREE_MAX)], peak = 0.0;
    shcd_vec3 s, n;
    assert_int_equal(shcd_harmonics(b->info.degree, w, y, NULL, NULL), SHCD_OK);
    assert_int_equal(shcd_model_surface(b->model, -1, w, &s, &n, NULL), SHCD_OK);
    for (int l = 0; l <= b->info.degree; l++) {
        for (size_t i = SHCD_INDEX(l, -l); i <= SHCD_INDEX(l, l); i++) {
            peak += exp(-0.02 * l * (l + 1)) * y[i] * y[i];
        }
    }
    for (int l = 0; l <= b->info.degree; l++) {
        for (size_t i = SHCD_INDEX(l, -l); i <= SHCD_INDEX(l, l); i++) {
            const double share = -depth / peak * exp(-0.02 * l * (l + 1)) * y[i];
            b->current[3 * i] += share * n.x;
            b->current[3 * i + 1] += share * n.y;
            b->current[3 * i + 2] += share * n.z;
        }
    }
}

/* First half of the ticks: a dent of up to 3 % of the diagonal; then all coefficients. */
static void deform(body *b, int tick) {
    memcpy(b->current, shcd_model_coefficients(b->model), b->n * sizeof *b->current);
    if (tick < TICKS / 2) {
        const double angle = 0.01 * tick, depth = 0.015 * (1.0 - cos(0.1 * tick));
        b->at = shcd_unit(shcd_vec3_make(cos(angle), sin(angle), 0.3));
        add_dent(b, b->at, depth * b->info.diagonal_m);
    } else {
        for (size_t i = 0; i < b->n; i++) {
            b->current[i] += b->rate[i] * sin(0.02 * tick + (double)(i % 17));
        }
    }
    assert_int_equal(shcd_shape_set(b->model, b->shape, b->current, SHCD_FOLLOW_PROGRESSIVE),
                     SHCD_OK);
}

static void fail_at(const body *b, int tick, const char *what, const shcd_proximity *got,
                    double found) {
    fail_msg("%s, tick %d: %s: distance %.17g in [%.17g, %.17g], brute force %.17g, flags %u",
             b->name, tick, what, got->distance_m, got->lower_m, got->upper_m, found, got->flags);
}

static void check_answer(body *b, const brute *truth, double deviation, int tick, shcd_vec3 p,
                         const shcd_proximity *got, double found) {
    const double scale = fmax(b->info.diagonal_m, found);
    const int unsure = (got->flags & SHCD_PROXIMITY_SIGN_UNSURE) != 0;
    const int truncated = (got->flags & SHCD_PROXIMITY_TRUNCATED) != 0;
    const double upper = fmax(fabs(got->lower_m), fabs(got->upper_m));
    const double lower = unsure ? 0.0 : fmin(fabs(got->lower_m), fabs(got->upper_m));
    if (lower > found) {
        fail_at(b, tick, "lower is above the truth", got, found);
    }
    if (!truncated && upper - found > TOLERANCE * scale) {
        fail_at(b, tick, "upper is above the truth by more than the tolerance", got, found);
    }
    if (!truncated && !unsure && !(got->upper_m - got->lower_m <= TOLERANCE * scale)) {
        fail_at(b, tick, "interval is too wide", got, found);
    }
    if (!unsure && found > deviation) {
        if ((got->distance_m < 0.0) != (brute_winding(truth, p) > 0.5)) {
            fail_at(b, tick, "wrong sign", got, found);
        }
        b->n_signs++;
    }
    b->n_truncated += (size_t)truncated;
    b->n_asked++;
    b->n_unsure += (size_t)unsure;
    b->evaluations += got->n_evaluations;
    b->patches += got->n_patches;
    b->patches_max = got->n_patches > b->patches_max ? got->n_patches : b->patches_max;
    b->evaluations_max =
        got->n_evaluations > b->evaluations_max ? got->n_evaluations : b->evaluations_max;
}

static shcd_vec3 off_surface(const body *b, shcd_vec3 w, double offset) {
    shcd_vec3 s, n;
    assert_int_equal(shcd_shape_surface(b->model, b->shape, w, &s, &n, NULL), SHCD_OK);
    return shcd_mul_add(s, offset * b->info.diagonal_m, n);
}

/* Near the dent and elsewhere; and a point that rides with the dent, as a tool's would. */
static void check_tick(body *b, int tick) {
    brute *truth = brute_create_shape(b->model, b->shape, DENSE);
    assert_non_null(truth);
    const double deviation = 2.0 * brute_deviation(truth);
    shcd_proximity got;
    shcd_vec3 w;
    for (int k = 0; k < POINTS; k++) {
        const shcd_vec3 aside = shcd_scale(k % 2 ? 0.2 : 2.0, bodies_random_direction(&b->random));
        const shcd_vec3 p = off_surface(b, shcd_unit(shcd_add(b->at, aside)),
                                        check_uniform(&b->random, -0.04, 0.04));
        assert_int_equal(shcd_shape_closest(b->model, b->shape, p, NULL, &got), SHCD_OK);
        check_answer(b, truth, deviation, tick, p, &got, brute_distance(truth, p, &w));
    }
    const shcd_vec3 p = off_surface(b, b->at, 0.012 + 0.002 * sin(0.05 * tick));
    assert_int_equal(shcd_closest_next(b->model, b->shape, p, NULL, &b->certificate, &got),
                     SHCD_OK);
    check_answer(b, truth, deviation, tick, p, &got, brute_distance(truth, p, &w));
    b->n_next_unsure += (got.flags & SHCD_PROXIMITY_SIGN_UNSURE) != 0;
    brute_free(truth);
}

/* The copy sees the same coefficients from mid-pass on. */
static void check_copy(body *b, int tick) {
    if (tick % 50 == 2) {
        memcpy(b->copy, b->shape, b->size);
    } else if (tick % 50 > 2 && tick % 50 < 30) {
        assert_int_equal(shcd_shape_set(b->model, b->copy, b->current, SHCD_FOLLOW_PROGRESSIVE),
                         SHCD_OK);
        assert_memory_equal(b->copy, b->shape, b->size);
    }
}

static void *lines(size_t size) {
    void *memory = aligned_alloc(16, (size + 15) / 16 * 16);
    assert_non_null(memory);
    return memory;
}

static void check_body(body *b, shcd_model *model) {
    shcd_shape_info before = SHCD_SHAPE_INFO_INIT, after = before;
    b->model = model;
    b->info = bodies_info(model);
    assert_true(b->info.degree <= DEGREE_MAX);
    b->n = 3 * SHCD_COUNT(b->info.degree);
    b->size = shcd_shape_size(model);
    b->current = lines(b->n * sizeof *b->current);
    b->rate = lines(b->n * sizeof *b->rate);
    for (int l = 0; l <= b->info.degree; l++) {
        for (size_t i = 3 * SHCD_INDEX(l, -l); i < 3 * SHCD_INDEX(l, l) + 3; i++) {
            b->rate[i] = 0.01 * b->info.diagonal_m * check_normal(&b->random) / ((l + 1) * (l + 1));
        }
    }
    void *memory = lines(b->size);
    b->copy = lines(b->size);
    assert_int_equal(shcd_shape_init(model, memory, b->size, &b->shape), SHCD_OK);
    memset(&b->certificate, 0, sizeof b->certificate);
    for (int tick = 0; tick < TICKS; tick++) {
        deform(b, tick);
        assert_int_equal(shcd_shape_describe(model, b->shape, &after), SHCD_OK);
        assert_true(after.n_blocks_evaluated - before.n_blocks_evaluated <= after.blocks_per_call);
        b->n_mixed += after.inflation_m > 0.0;
        before = after;
        check_tick(b, tick);
        check_copy(b, tick);
    }
    assert_true(after.n_blocks_evaluated > 10 * after.n_blocks && after.n_refreshes == 0);
    free(b->shape);
    free(b->copy);
    free(b->current);
    free(b->rate);
    shcd_model_free(model);
}

static void test_closest_on_a_body_in_motion(void **state) {
    body b;
    memset(&b, 0, sizeof b);
    b.name = *(const char **)*state;
    b.random.state = SEED;
    for (size_t i = 0; i < check_scaled(1); i++) {
        shcd_model *model = NULL;
        shcd_error error = {SHCD_OK, ""};
        if (strcmp(b.name, "random") == 0) {
            model =
                bodies_create_random(&b.random, 3 + (int)check_uniform(&b.random, 0.0, 13.0), 0.05);
        } else if (shcd_model_load(b.name, NULL, &model, &error) != SHCD_OK) {
            fail_msg("%s", error.message);
        }
        check_body(&b, model);
    }
    print_message(
        "%s: seed %u, %zu answers, %zu signs checked, unsure %zu (of a riding point %zu), "
        "truncated %zu; evaluations mean %.1f max %u, patches mean %.0f max %u\n",
        b.name, SEED, b.n_asked, b.n_signs, b.n_unsure, b.n_next_unsure, b.n_truncated,
        b.evaluations / (double)b.n_asked, b.evaluations_max, b.patches / (double)b.n_asked,
        b.patches_max);
    assert_at_most((double)b.n_truncated, 0.002 * (double)b.n_asked);
    assert_true(b.n_signs > b.n_asked / 2 && b.n_mixed > TICKS / 2);
    /* A point that rides keeps its side, once it has one: the body starts deformed, and before the
     * first pass over the four sectors has come round there may be none. */
    assert_at_most((double)b.n_next_unsure,
                   4.0 * (double)check_scaled(1) + 0.01 * (double)b.n_asked / (POINTS + 1));
    if (strcmp(b.name, "random") != 0) {
        usual_check(USUAL_MOVING, b.name, b.n_asked, b.evaluations, b.patches);
    }
}

int main(int argc, char **argv) {
    if (argc != 2) {
        fprintf(stderr, "usage: test_moving BODY.shcd|random\n");
        return 2;
    }
    const char *name = argv[1];
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_prestate(test_closest_on_a_body_in_motion, &name),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
