/* SPDX-License-Identifier: BSD-3-Clause */
/* The exact tier against brute force on fitted bodies: for each .shcd file named as an argument, 10
 * 000 points within 5 % of the diagonal of the surface and 1 000 over a box three times the body
 * (times SHCD_TEST_SCALE). Never a wrong basin, distance within 1e-9 of max(diagonal, distance),
 * interval true, sign right. */
#include "property/usual.h"
#include "shcd/shcd.h"
#include "support/brute.h"
#include "support/check.h"

#include <string.h>

#define TOLERANCE 1e-9

typedef struct tally {
    size_t n, truncated, unsure, beaten, signs_checked, map_sure;
    double worst, evaluations, patches;
    uint32_t evaluations_max, patches_max;
} tally;

typedef struct body {
    const char *path;
    shcd_model *model;
    shcd_model_info info;
    brute *dense, *coarse;
    double deviation;
    check_random random;
} body;

static shcd_vec3 random_direction(check_random *r) {
    const double x = check_normal(r), y = check_normal(r), z = check_normal(r);
    return shcd_unit(shcd_vec3_make(x, y, z));
}

/* expected sign of a point at a small offset from its base point: known if that base is its foot */
static int sign_of(const body *b, shcd_vec3 p, double offset, double distance) {
    if (distance > b->deviation) {
        return brute_winding(b->coarse, p) > 0.5 ? -1 : 1;
    }
    if (fabs(fabs(offset) - distance) <= 1e-9 * b->info.diagonal_m && offset != 0.0) {
        return offset < 0.0 ? -1 : 1;
    }
    return 0;
}

/* Newton stops where the interval meets the tolerance. Asked for rounding, it goes on to a point of
 * the surface at that distance, which the first interval holds; what can be proven is not asked
 * here. */
static void check_sharp(const body *b, shcd_vec3 p, const shcd_proximity *first) {
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    shcd_proximity got;
    shcd_vec3 at;
    options.tolerance = 1e-15;
    options.patches_max = 3000;
    assert_int_equal(shcd_closest(b->model, p, &options, &got), SHCD_OK);
    const double distance = fabs(got.distance_m), scale = fmax(b->info.diagonal_m, distance);
    assert_int_equal(shcd_model_surface(b->model, -1, got.parameter, &at, NULL, NULL), SHCD_OK);
    assert_near(shcd_norm(shcd_sub(at, p)), distance, 1e-13 * scale);
    assert_near(shcd_norm(shcd_sub(at, got.point_m)), 0.0, 1e-13 * b->info.diagonal_m);
    if ((first->flags & (SHCD_PROXIMITY_SIGN_UNSURE | SHCD_PROXIMITY_TRUNCATED)) == 0) {
        assert_true(distance >= fmin(fabs(first->lower_m), fabs(first->upper_m)));
    }
}

static void check_point(const body *b, shcd_vec3 p, double offset, tally *t) {
    shcd_proximity got;
    assert_int_equal(shcd_closest(b->model, p, NULL, &got), SHCD_OK);
    const double distance = fabs(got.distance_m);
    const double scale = fmax(b->info.diagonal_m, distance);

    /* the answer is at that distance, and a point of the surface within the tolerance */
    shcd_vec3 at;
    assert_int_equal(shcd_model_surface(b->model, -1, got.parameter, &at, NULL, NULL), SHCD_OK);
    assert_near(shcd_norm(shcd_sub(got.point_m, p)), distance, 1e-13 * scale);
    assert_near(shcd_norm(shcd_sub(at, got.point_m)), 0.0, TOLERANCE * scale);
    check_sharp(b, p, &got);

    /* nothing nearer exists; brute force may itself miss the basin, so only "nearer" is an error */
    shcd_vec3 w;
    const double found = brute_distance(b->dense, p, &w);
    if (distance - found > TOLERANCE * scale) {
        fail_msg("%s: wrong basin at (%.17g, %.17g, %.17g): %.17g, brute force %.17g, flags %u",
                 b->path, p.x, p.y, p.z, distance, found, got.flags);
    }
    t->beaten += found - distance > TOLERANCE * scale;
    t->worst = fmax(t->worst, fabs(distance - found) / scale);

    /* the interval holds the truth and is as narrow as promised, or says that it is not */
    const int truncated = (got.flags & SHCD_PROXIMITY_TRUNCATED) != 0;
    const int unsure = (got.flags & SHCD_PROXIMITY_SIGN_UNSURE) != 0;
    const double low = unsure ? 0.0 : fmin(fabs(got.lower_m), fabs(got.upper_m));
    assert_true(got.lower_m <= got.distance_m && got.distance_m <= got.upper_m);
    assert_true(low <= found);
    if (!truncated && !unsure) {
        assert_at_most(got.upper_m - got.lower_m, TOLERANCE * scale);
    }
    t->truncated += (size_t)truncated;
    t->unsure += (size_t)unsure;

    const int sign = sign_of(b, p, offset, distance);
    if (sign != 0 && distance > TOLERANCE * scale) {
        if ((got.distance_m < 0.0) != (sign < 0)) {
            fail_msg("%s: wrong sign at (%.17g, %.17g, %.17g): %.17g, flags %u", b->path, p.x, p.y,
                     p.z, got.distance_m, got.flags);
        }
        t->signs_checked++;
    }
    t->n++;
    t->evaluations += got.n_evaluations;
    t->patches += got.n_patches;
    t->evaluations_max =
        got.n_evaluations > t->evaluations_max ? got.n_evaluations : t->evaluations_max;
    t->patches_max = got.n_patches > t->patches_max ? got.n_patches : t->patches_max;
}

static void body_open(body *b, const char *path) {
    shcd_error error = {SHCD_OK, ""};
    memset(b, 0, sizeof *b);
    b->path = path;
    if (shcd_model_load(path, NULL, &b->model, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    b->info.struct_size = sizeof b->info;
    assert_int_equal(shcd_model_describe(b->model, &b->info), SHCD_OK);
    b->dense = brute_create(b->model, 160);
    b->coarse = brute_create(b->model, 40);
    assert_non_null(b->dense);
    assert_non_null(b->coarse);
    /* sampled, so doubled */
    b->deviation = 2.0 * brute_deviation(b->coarse);
    b->random.state = 20261121;
}

static void body_close(body *b) {
    brute_free(b->coarse);
    brute_free(b->dense);
    shcd_model_free(b->model);
}

static void report(const body *b, const tally *t) {
    const double n = (double)t->n;
    print_message(
        "%s: %zu points (seed 20261121), |exact - brute| <= %.2g, brute force beaten %zu, "
        "truncated %zu, sign unsure %zu, signs checked %zu; evaluations mean %.1f max %u, "
        "patches mean %.0f max %u\n",
        b->path, t->n, t->worst, t->beaten, t->truncated, t->unsure, t->signs_checked,
        t->evaluations / n, t->evaluations_max, t->patches / n, t->patches_max);
}

static void test_closest_against_brute_force(void **state) {
    body b;
    body_open(&b, *(const char **)*state);
    tally t;
    memset(&t, 0, sizeof t);
    const size_t n_near = check_scaled(10000), n_far = check_scaled(1000);
    for (size_t i = 0; i < n_near; i++) {
        shcd_vec3 s, n;
        const shcd_vec3 w = random_direction(&b.random);
        assert_int_equal(shcd_model_surface(b.model, -1, w, &s, &n, NULL), SHCD_OK);
        const double offset = check_uniform(&b.random, -0.05, 0.05) * b.info.diagonal_m;
        check_point(&b, shcd_mul_add(s, offset, n), offset, &t);
    }
    const shcd_vec3 middle = shcd_scale(0.5, shcd_add(b.info.box_min_m, b.info.box_max_m));
    const shcd_vec3 half = shcd_scale(1.5, shcd_sub(b.info.box_max_m, b.info.box_min_m));
    for (size_t i = 0; i < n_far; i++) {
        const double x = check_uniform(&b.random, -1.0, 1.0);
        const double y = check_uniform(&b.random, -1.0, 1.0);
        const double z = check_uniform(&b.random, -1.0, 1.0);
        const shcd_vec3 p = {middle.x + x * half.x, middle.y + y * half.y, middle.z + z * half.z};
        check_point(&b, p, 0.0, &t);
    }
    report(&b, &t);
    /* every point is settled within the default caps; near ties and focal points stay rare */
    assert_at_most((double)t.truncated, 0.001 * (double)t.n);
    assert_true(t.signs_checked >= t.n / 2);
    usual_check(USUAL_CLOSEST, b.path, t.n, t.evaluations, t.patches);
    body_close(&b);
}

int main(int argc, char **argv) {
    if (argc != 2) {
        fprintf(stderr, "usage: test_closest BODY.shcd\n");
        return 2;
    }
    const char *path = argv[1];
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_prestate(test_closest_against_brute_force, &path),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
