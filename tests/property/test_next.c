/* SPDX-License-Identifier: BSD-3-Clause */
/* Certificates that last: shcd_closest_next() along paths, on shapes at rest and deforming, always
 * agrees with a search of the same point and shape, whatever certificate of the same pair it is
 * given; and follows the foot through focal points, where a margin to other feet would not help. */
#include "shcd/shape.h"
#include "support/bodies.h"
#include "support/ellipsoid.h"

#define SEED 20261123u
#define KEPT 8 /* old certificates */
#define DEGREE_MAX 15

typedef struct tally {
    size_t n, truncated, unsure;
    size_t searched; /* calls that looked at the tree */
    double evaluations;
} tally;

typedef struct body {
    shcd_model *model;
    shcd_model_info info;
    shcd_shape *shape; /* NULL: at rest */
    double tolerance;
    size_t n;
    double current[3 * SHCD_COUNT(DEGREE_MAX)], velocity[3 * SHCD_COUNT(DEGREE_MAX)];
    shcd_certificate certificate, old[KEPT];
    check_random random;
} body;

static double width_of(const shcd_proximity *p) {
    return p->upper_m - p->lower_m;
}

/* Every fourth body is so rough that its surface may cut itself: winding numbers decide its sign.
 */
static void body_open(body *b, uint64_t seed, int degree, int deforms) {
    memset(b, 0, sizeof *b);
    b->random.state = seed;
    b->model = bodies_create_random(&b->random, degree, seed % 4 == 0 ? 0.3 : 0.05);
    b->info = bodies_info(b->model);
    b->n = 3 * SHCD_COUNT(degree);
    b->tolerance = 1e-9;
    memcpy(b->current, shcd_model_coefficients(b->model), b->n * sizeof(double));
    if (deforms) {
        const size_t size = shcd_shape_size(b->model);
        void *memory = aligned_alloc(16, (size + 15) / 16 * 16);
        assert_non_null(memory);
        assert_int_equal(shcd_shape_init(b->model, memory, size, &b->shape), SHCD_OK);
    }
}

static void body_close(body *b) {
    free(b->shape);
    shcd_model_free(b->model);
}

static void forget(body *b) {
    memset(&b->certificate, 0, sizeof b->certificate);
    memset(b->old, 0, sizeof b->old);
}

/* One tick of a swinging body: coefficients of every degree, `size` diagonals at most in all. */
static void swing(body *b, double size, int follow) {
    const double *rest = shcd_model_coefficients(b->model);
    for (size_t i = 0; i < b->n; i++) {
        const double l = sqrt((double)(i / 3));
        b->velocity[i] += size * b->info.diagonal_m * check_normal(&b->random) / (1.0 + l * l);
        b->velocity[i] *= 0.9;
        b->current[i] += b->velocity[i] - 0.05 * (b->current[i] - rest[i]);
    }
    assert_int_equal(shcd_shape_set(b->model, b->shape, b->current, follow), SHCD_OK);
}

/* What a search and a continuation prove about one point cannot contradict each other. */
static void assert_agree(const body *b, shcd_vec3 p, const shcd_proximity *next,
                         const shcd_proximity *full, const char *what) {
    const double scale = fmax(b->info.diagonal_m, fabs(full->distance_m));
    const uint32_t unsure = (next->flags | full->flags) & SHCD_PROXIMITY_SIGN_UNSURE;
    const uint32_t truncated = (next->flags | full->flags) & SHCD_PROXIMITY_TRUNCATED;
    const double apart = fabs(fabs(next->distance_m) - fabs(full->distance_m));
    const double widths =
        unsure || truncated ? width_of(next) + width_of(full) : 2.0 * b->tolerance * scale;
    const int ordered = next->lower_m <= next->distance_m && next->distance_m <= next->upper_m;
    const int overlap = next->lower_m <= full->upper_m && full->lower_m <= next->upper_m;
    const int same_side = unsure || fabs(full->distance_m) <= 2.0 * b->tolerance * scale ||
                          (next->distance_m < 0.0) == (full->distance_m < 0.0);
    const int narrow = (next->flags & (SHCD_PROXIMITY_TRUNCATED | SHCD_PROXIMITY_SIGN_UNSURE)) ||
                       width_of(next) <= b->tolerance * scale;
    if (!ordered || !overlap || !same_side || !narrow || apart > widths) {
        fail_msg("%s at (%.17g, %.17g, %.17g): next %.17g in [%.17g, %.17g] flags %u, search %.17g "
                 "in [%.17g, %.17g] flags %u",
                 what, p.x, p.y, p.z, next->distance_m, next->lower_m, next->upper_m, next->flags,
                 full->distance_m, full->lower_m, full->upper_m, full->flags);
    }
    /* and the answer is of the current surface, up to its last step (newton.c) */
    shcd_vec3 at;
    if (b->shape != NULL) {
        assert_int_equal(shcd_shape_surface(b->model, b->shape, next->parameter, &at, NULL, NULL),
                         SHCD_OK);
    } else {
        assert_int_equal(shcd_model_surface(b->model, -1, next->parameter, &at, NULL, NULL),
                         SHCD_OK);
    }
    assert_near(shcd_norm(shcd_sub(at, next->point_m)), 0.0,
                0.25 * b->tolerance * scale + 1e-13 * scale);
}

static shcd_proximity visit(body *b, shcd_vec3 p, tally *t) {
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    shcd_proximity next, full, again;
    options.tolerance = b->tolerance;
    assert_int_equal(shcd_closest_next(b->model, b->shape, p, &options, &b->certificate, &next),
                     SHCD_OK);
    assert_int_equal(shcd_shape_closest(b->model, b->shape, p, &options, &full), SHCD_OK);
    assert_agree(b, p, &next, &full, "continued");
    /* an earlier tick's certificate is as good */
    const size_t which = (size_t)(check_random_bits(&b->random) % KEPT);
    shcd_certificate copy = b->old[which];
    assert_int_equal(shcd_closest_next(b->model, b->shape, p, &options, &copy, &again), SHCD_OK);
    assert_agree(b, p, &again, &full, "old certificate");
    if (check_uniform(&b->random, 0.0, 1.0) < 0.2) {
        b->old[check_random_bits(&b->random) % KEPT] =
            check_uniform(&b->random, 0.0, 1.0) < 0.5 ? copy : b->certificate;
    }
    t->n++;
    t->truncated += (next.flags & SHCD_PROXIMITY_TRUNCATED) != 0;
    t->unsure += (next.flags & SHCD_PROXIMITY_SIGN_UNSURE) != 0;
    t->searched += next.n_patches > 0;
    t->evaluations += next.n_evaluations;
    return next;
}

static void report(const char *what, const tally *t) {
    print_message(
        "%s: %zu calls (seed %u), evaluations mean %.2f, searched %.1f %%, truncated %zu, sign "
        "unsure %zu\n",
        what, t->n, SEED, t->evaluations / (double)t->n, 100.0 * (double)t->searched / (double)t->n,
        t->truncated, t->unsure);
}

static void surface_at(const body *b, shcd_vec3 w, shcd_vec3 *s, shcd_vec3 *n) {
    if (b->shape != NULL) {
        assert_int_equal(shcd_shape_surface(b->model, b->shape, w, s, n, NULL), SHCD_OK);
    } else {
        assert_int_equal(shcd_model_surface(b->model, -1, w, s, n, NULL), SHCD_OK);
    }
}

/* ---- paths ---- */

/* Along the surface at a slowly changing height, `step` diagonals a tick. */
static void path_along(body *b, double step, double height, size_t n, tally *t) {
    shcd_vec3 w = bodies_random_direction(&b->random), s, normal;
    shcd_vec3 axis = bodies_random_direction(&b->random);
    double phase = 0.0;
    forget(b);
    surface_at(b, w, &s, &normal);
    for (size_t i = 0; i < n; i++) {
        const double h = height * b->info.diagonal_m * sin(phase);
        (void)visit(b, shcd_mul_add(s, h, normal), t);
        /* as far on the parameter sphere as makes one step in space */
        const shcd_vec3 tangent = shcd_unit(shcd_cross(axis, w));
        shcd_vec3 ahead, unused;
        surface_at(b, shcd_mul_add(w, 1e-4, tangent), &ahead, &unused);
        const double speed = shcd_norm(shcd_sub(ahead, s)) / 1e-4;
        w = shcd_unit(shcd_mul_add(w, step * b->info.diagonal_m / fmax(speed, 1e-3), tangent));
        axis = shcd_unit(shcd_mul_add(axis, 0.02, bodies_random_direction(&b->random)));
        phase += height > 0.0 ? step / height : 0.0;
        surface_at(b, w, &s, &normal);
    }
}

/* Straight through the body and out: over its medial axis. */
static void path_through(body *b, double step, size_t n, tally *t) {
    shcd_vec3 from, normal;
    surface_at(b, bodies_random_direction(&b->random), &from, &normal);
    from = shcd_mul_add(from, 0.05 * b->info.diagonal_m, normal);
    const shcd_vec3 aim = shcd_mul_add(b->info.star_centre_m, 0.1 * b->info.diagonal_m,
                                       bodies_random_direction(&b->random));
    const shcd_vec3 way = shcd_unit(shcd_sub(aim, from));
    forget(b);
    for (size_t i = 0; i < n; i++) {
        (void)visit(b, shcd_mul_add(from, step * (double)i * b->info.diagonal_m, way), t);
    }
}

/* Pressing in and out at one place. */
static void path_press(body *b, double depth, size_t n, tally *t) {
    shcd_vec3 s, normal;
    surface_at(b, bodies_random_direction(&b->random), &s, &normal);
    forget(b);
    for (size_t i = 0; i < n; i++) {
        const double h = depth * b->info.diagonal_m * cos(0.05 * (double)i);
        (void)visit(b, shcd_mul_add(s, h, normal), t);
    }
}

static void path_jumps(body *b, size_t n, tally *t) {
    forget(b);
    for (size_t i = 0; i < n; i++) {
        const shcd_vec3 d = bodies_random_direction(&b->random);
        const double r = check_uniform(&b->random, 0.0, 1.5) * b->info.radius_m;
        (void)visit(b, shcd_mul_add(b->info.centre_m, r, d), t);
    }
}

static void path_standing(body *b, size_t n, tally *t) {
    shcd_vec3 s, normal;
    surface_at(b, bodies_random_direction(&b->random), &s, &normal);
    const shcd_vec3 p = shcd_mul_add(s, 0.01 * b->info.diagonal_m, normal);
    forget(b);
    for (size_t i = 0; i < n; i++) {
        (void)visit(b, p, t);
    }
}

static void test_next_agrees_with_a_search_at_rest(void **state) {
    (void)state;
    static const double tolerance[] = {1e-9, 1e-6, 1e-4};
    tally along = {0}, fast = {0}, through = {0}, press = {0}, jumps = {0}, standing = {0};
    const size_t bodies = check_scaled(12);
    for (size_t i = 0; i < bodies; i++) {
        body b;
        body_open(&b, SEED + i, i % 3 == 0 ? DEGREE_MAX : 2 + (int)(i % 9), 0);
        b.tolerance = tolerance[i % 3 == 0 ? 0 : i / 3 % 3];
        path_along(&b, 0.001, 0.03, 400, &along);
        path_along(&b, 0.01, 0.05, 200, &fast);
        path_through(&b, 0.001, 600, &through);
        path_through(&b, 0.01, 100, &through);
        path_press(&b, 0.02, 200, &press);
        path_jumps(&b, 100, &jumps);
        path_standing(&b, 20, &standing);
        body_close(&b);
    }
    report("rest, along the surface, 0.1 %", &along);
    report("rest, along the surface, 1 %", &fast);
    report("rest, through the body", &through);
    report("rest, pressing", &press);
    report("rest, jumps", &jumps);
    report("rest, standing", &standing);
    /* an evaluation while the certificate holds, searches now and then included; a path of 0.1 %
     * needs one for 38 % of its calls at the smallest test scale, 28 % at full scale */
    assert_at_most(along.evaluations / (double)along.n, 2.0);
    assert_at_most((double)along.searched / (double)along.n, 0.55);
    assert_at_most((double)press.searched / (double)press.n, 0.15);
    assert_at_most((double)standing.searched / (double)standing.n, 0.1);
}

/* ---- deforming bodies ---- */

static void test_next_agrees_with_a_search_on_deforming_bodies(void **state) {
    (void)state;
    tally resting = {0}, both = {0}, rough = {0};
    const size_t bodies = check_scaled(12);
    for (size_t i = 0; i < bodies; i++) {
        body b;
        shcd_vec3 s, normal;
        body_open(&b, SEED + 100 + i, i % 3 == 0 ? DEGREE_MAX : 2 + (int)(i % 9), 1);
        const int follow = (int)(i % 3);
        /* a point at rest while the body swings */
        surface_at(&b, bodies_random_direction(&b.random), &s, &normal);
        const double height = check_uniform(&b.random, -0.05, 0.05) * b.info.diagonal_m;
        const shcd_vec3 p = shcd_mul_add(s, height, normal);
        forget(&b);
        for (int tick = 0; tick < 200; tick++) {
            swing(&b, 1e-5, follow);
            (void)visit(&b, p, &resting);
        }
        /* both move; not every tick deforms, so that sets are missed and repeated */
        shcd_vec3 q = p;
        const shcd_vec3 way = bodies_random_direction(&b.random);
        for (int tick = 0; tick < 300; tick++) {
            if (tick % 3 != 0) {
                swing(&b, 3e-5, follow);
            }
            q = shcd_mul_add(q, 0.001 * b.info.diagonal_m * (tick < 150 ? 1.0 : -1.0), way);
            (void)visit(&b, q, &both);
        }
        for (int tick = 0; tick < 60; tick++) {
            swing(&b, 1e-3, SHCD_FOLLOW_AUTO);
            q = shcd_mul_add(q, 0.01 * b.info.diagonal_m, bodies_random_direction(&b.random));
            (void)visit(&b, q, &rough);
        }
        body_close(&b);
    }
    report("deforming, point at rest", &resting);
    report("deforming, both move", &both);
    report("deforming roughly", &rough);
}

/* ---- focal points ---- */

static void assert_true_distance(const shcd_proximity *got, double truth, double scale,
                                 size_t *truncated, double x) {
    const double rounding = 1e-14 * scale;
    *truncated += (got->flags & SHCD_PROXIMITY_TRUNCATED) != 0;
    if (got->lower_m - rounding > truth || got->upper_m + rounding < truth ||
        (!(got->flags & SHCD_PROXIMITY_TRUNCATED) &&
         fabs(got->distance_m - truth) > 1e-9 * scale)) {
        fail_msg("x = %.17g: %.17g in [%.17g, %.17g] flags %u, truth %.17g", x, got->distance_m,
                 got->lower_m, got->upper_m, got->flags, truth);
    }
}

/* From (1.6, 0, 0) to (1.3, 0, 0) in an ellipsoid of half axes 2, 1, c: at 2 - 1/2 = 1.5 the foot
 * (2, 0, 0) ceases to be one, although no other foot is anywhere near. With c = 1 it splits into a
 * whole circle of feet. */
static void test_next_follows_a_foot_that_splits(void **state) {
    (void)state;
    static const double third[] = {0.8, 1.2, 0.999, 1.0};
    static const double aside[] = {0.0, 1e-9, 1e-5, 1e-3};
    static const int steps[] = {1, 3, 30, 300, 1000};
    size_t n = 0, truncated = 0;
    for (size_t c = 0; c < 4; c++) {
        const double axes[3] = {2.0, 1.0, third[c]};
        shcd_model *model = bodies_searched(bodies_create_ellipsoid(axes[0], axes[1], axes[2]));
        const double scale = bodies_info(model).diagonal_m;
        for (size_t a = 0; a < 4; a++) {
            for (size_t k = 0; k < 5; k++) {
                shcd_certificate certificate = {{0.0}, {0}};
                const int count = third[c] == 1.0 && steps[k] > 30 ? 30 : steps[k];
                for (int i = 0; i <= 2 * count; i++) {
                    const double share = (double)(i <= count ? i : 2 * count - i) / count;
                    const shcd_vec3 p = {1.6 - 0.3 * share, aside[a], 0.5 * aside[a]};
                    shcd_proximity got;
                    assert_int_equal(shcd_closest_next(model, NULL, p, NULL, &certificate, &got),
                                     SHCD_OK);
                    assert_true_distance(&got, ellipsoid_distance(axes, p), scale, &truncated, p.x);
                    n++;
                }
            }
        }
        shcd_model_free(model);
    }
    print_message("splitting feet: %zu calls, truncated %zu\n", n, truncated);
    assert_at_most((double)truncated, 0.001 * (double)n);
}

/* The same focal point passes a point that stands still, while the body deforms. */
static void test_next_follows_a_split_by_deformation(void **state) {
    (void)state;
    shcd_model *model = bodies_searched(bodies_create_ellipsoid(2.0, 1.0, 0.8));
    const double scale = bodies_info(model).diagonal_m;
    void *memory = aligned_alloc(16, (shcd_shape_size(model) + 15) / 16 * 16);
    shcd_shape *shape = NULL;
    size_t truncated = 0;
    assert_int_equal(shcd_shape_init(model, memory, shcd_shape_size(model), &shape), SHCD_OK);
    for (int follow = SHCD_FOLLOW_AUTO; follow <= SHCD_FOLLOW_REFRESH; follow++) {
        shcd_certificate certificate = {{0.0}, {0}};
        /* 2 - c^2/2 from 1.68 to 1.3 and back */
        for (int i = 0; i <= 800; i++) {
            const double share = (double)(i <= 400 ? i : 800 - i) / 400.0;
            const double axes[3] = {2.0, 1.2, 0.8 + 0.38 * share};
            const shcd_vec3 p = {1.5, 0.0, 0.0};
            double c[27] = {0.0};
            shcd_proximity got;
            bodies_ellipsoid_coefficients(axes[0], axes[1], axes[2], c);
            assert_int_equal(shcd_shape_set(model, shape, c, follow), SHCD_OK);
            assert_int_equal(shcd_closest_next(model, shape, p, NULL, &certificate, &got), SHCD_OK);
            assert_true_distance(&got, ellipsoid_distance(axes, p), scale, &truncated, share);
        }
    }
    print_message("splits by deformation: truncated %zu of 2403\n", truncated);
    assert_at_most((double)truncated, 24.0);
    free(memory);
    shcd_model_free(model);
}

/* ---- certificates that nobody made ---- */

/* Contents are private: nothing is promised about the answer, but it comes, within the caps. */
static void test_next_survives_any_bytes(void **state) {
    (void)state;
    body b;
    const size_t n = check_scaled(3000);
    body_open(&b, SEED + 200, 8, 1);
    swing(&b, 1e-4, SHCD_FOLLOW_AUTO);
    shcd_certificate real = {{0.0}, {0}};
    for (size_t i = 0; i < n; i++) {
        shcd_certificate c;
        shcd_proximity out;
        unsigned char *byte = (unsigned char *)&c;
        const shcd_vec3 p =
            shcd_mul_add(b.info.centre_m, check_uniform(&b.random, 0.0, 1.2) * b.info.radius_m,
                         bodies_random_direction(&b.random));
        assert_int_equal(shcd_closest_next(b.model, b.shape, p, NULL, &real, &out), SHCD_OK);
        c = real;
        if (i % 2 == 0) {
            for (size_t k = 0; k < sizeof c; k++) {
                byte[k] = (unsigned char)check_random_bits(&b.random);
            }
            c.word[check_random_bits(&b.random) % 4] = check_random_bits(&b.random) % 3000;
        }
        /* a few bits of a real one, or numbers of any size with indices that exist */
        for (int k = 0; k < 4; k++) {
            byte[check_random_bits(&b.random) % sizeof c] ^=
                (unsigned char)(1u << check_random_bits(&b.random) % 8);
        }
        if (i % 4 == 0) {
            for (size_t k = 0; k < 32; k++) {
                c.value[k] = check_normal(&b.random) *
                             pow(10.0, check_uniform(&b.random, -9.0, i % 8 == 0 ? 300.0 : 3.0));
            }
            c.word[0] = c.word[1] = c.word[2] = c.word[3] = 1 + check_random_bits(&b.random) % 300;
        }
        assert_int_equal(shcd_closest_next(b.model, b.shape, p, NULL, &c, &out), SHCD_OK);
        assert_true(out.n_evaluations <= SHCD_QUERY_EVALUATIONS_DEFAULT + 100u);
    }
    body_close(&b);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_next_agrees_with_a_search_at_rest),
        cmocka_unit_test(test_next_agrees_with_a_search_on_deforming_bodies),
        cmocka_unit_test(test_next_follows_a_foot_that_splits),
        cmocka_unit_test(test_next_follows_a_split_by_deformation),
        cmocka_unit_test(test_next_survives_any_bytes),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
