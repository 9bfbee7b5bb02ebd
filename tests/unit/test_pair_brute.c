/* SPDX-License-Identifier: BSD-3-Clause */
/* Random bodies at rest and deformed, at random poses, against brute force: all pairs of samples,
 * the nearest of them polished. Surfaces are sums of shcd_harmonics() here; nothing is shared with
 * the search. */
#include "shcd/pair.h"
#include "support/bodies.h"
#include "support/check.h"

#include <string.h>

#define TOLERANCE 1e-6 /* the default, of the larger diagonal */

static shcd_quat random_turn(check_random *r) {
    const double w = check_normal(r), x = check_normal(r), y = check_normal(r), z = check_normal(r);
    const double n = sqrt(w * w + x * x + y * y + z * z);
    const shcd_quat q = {w / n, x / n, y / n, z / n};
    return q;
}

static shcd_pose inverse(shcd_pose a) {
    shcd_pose b;
    b.orientation = shcd_conjugate(a.orientation);
    b.position_m = shcd_scale(-1.0, shcd_rotate(b.orientation, a.position_m));
    return b;
}

static int overlaps(const shcd_pair_proximity *p) {
    return (p->flags & (uint32_t)SHCD_PAIR_OVERLAP) != 0;
}

#define SAMPLES 1200
#define DEGREE_MAX 6
#define STARTS 4

typedef struct cloud {
    int degree;
    double coefficients[3 * SHCD_COUNT(DEGREE_MAX)];
    shcd_vec3 w[SAMPLES], x[SAMPLES]; /* the latter in the first body's frame */
    shcd_pose pose;
} cloud;

static shcd_vec3 cloud_point(const cloud *c, shcd_vec3 w) {
    double y[SHCD_COUNT(DEGREE_MAX)];
    shcd_vec3 x = {0.0, 0.0, 0.0};
    assert_int_equal(shcd_harmonics(c->degree, w, y, NULL, NULL), SHCD_OK);
    for (size_t i = 0; i < SHCD_COUNT(c->degree); i++) {
        const double *k = c->coefficients + 3 * i;
        x = shcd_mul_add(x, y[i], shcd_vec3_make(k[0], k[1], k[2]));
    }
    return shcd_transform(c->pose, x);
}

/* Compass search: each of the two parameters along two tangents, halving. */
static double polish(const cloud *a, const cloud *b, shcd_vec3 wa, shcd_vec3 wb, double best) {
    shcd_vec3 w[2] = {wa, wb}, x[2] = {cloud_point(a, wa), cloud_point(b, wb)};
    for (double step = 0.05; step > 1e-8;) {
        int better = 0;
        for (int which = 0; which < 2; which++) {
            const shcd_vec3 axis = fabs(w[which].x) < 0.6 ? shcd_vec3_make(1.0, 0.0, 0.0)
                                                          : shcd_vec3_make(0.0, 1.0, 0.0);
            const shcd_vec3 t = shcd_unit(shcd_cross(axis, w[which]));
            const shcd_vec3 u = shcd_cross(w[which], t);
            for (int k = 0; k < 8; k++) {
                const double angle = BODIES_PI / 4.0 * k;
                const shcd_vec3 by = shcd_add(shcd_scale(cos(angle), t), shcd_scale(sin(angle), u));
                const shcd_vec3 tried = shcd_unit(shcd_mul_add(w[which], step, by));
                const shcd_vec3 at = cloud_point(which == 0 ? a : b, tried);
                const double d = shcd_norm(shcd_sub(at, x[1 - which]));
                if (d < best) {
                    best = d;
                    w[which] = tried;
                    x[which] = at;
                    better = 1;
                    break;
                }
            }
        }
        step = better ? step : 0.5 * step;
    }
    return best;
}

/* The nearest pairs of samples that are not neighbours of each other, polished. */
static double brute_distance(const cloud *a, const cloud *b) {
    size_t start[STARTS][2], n = 0;
    double least[STARTS], best = HUGE_VAL;
    for (size_t i = 0; i < SAMPLES; i++) {
        for (size_t k = 0; k < SAMPLES; k++) {
            const shcd_vec3 r = shcd_sub(a->x[i], b->x[k]);
            const double d = shcd_dot(r, r);
            if (n == STARTS && d >= least[n - 1]) {
                continue;
            }
            size_t same = n;
            for (size_t m = 0; m < n; m++) {
                if (shcd_dot(a->w[start[m][0]], a->w[i]) > 0.95 &&
                    shcd_dot(b->w[start[m][1]], b->w[k]) > 0.95) {
                    same = m;
                }
            }
            if (same < n && d >= least[same]) {
                continue;
            }
            size_t at = same < n ? same : n < STARTS ? n++ : n - 1;
            for (; at > 0 && least[at - 1] > d; at--) {
                least[at] = least[at - 1];
                memcpy(start[at], start[at - 1], sizeof start[at]);
            }
            least[at] = d;
            start[at][0] = i;
            start[at][1] = k;
        }
    }
    for (size_t m = 0; m < n; m++) {
        best = fmin(best, polish(a, b, a->w[start[m][0]], b->w[start[m][1]], sqrt(least[m])));
    }
    return best;
}

typedef struct pair_tally {
    size_t n_apart, n_overlapping, n_unsure, n_truncated;
    uint32_t evaluations;
    double worst; /* brute force above upper, in diagonals */
} pair_tally;

static void check_pair(const shcd_model *model[2], const shcd_shape *shape[2], cloud c[2],
                       pair_tally *t) {
    shcd_pair_proximity out, swapped;
    assert_int_equal(
        shcd_pair_closest(model[0], shape[0], model[1], shape[1], c[1].pose, NULL, &out), SHCD_OK);
    assert_int_equal(shcd_pair_closest(model[1], shape[1], model[0], shape[0], inverse(c[1].pose),
                                       NULL, &swapped),
                     SHCD_OK);
    const double diagonal =
        fmax(bodies_info(model[0]).diagonal_m, bodies_info(model[1]).diagonal_m);
    t->evaluations = out.n_evaluations > t->evaluations ? out.n_evaluations : t->evaluations;
    if (overlaps(&out)) {
        t->n_overlapping++;
        assert_true(overlaps(&swapped));
        /* the depth is the ascent's, from other starts */
        assert_true(out.upper_m < 0.0 && swapped.upper_m < 0.0);
        return;
    }
    if ((out.flags & SHCD_PROXIMITY_SIGN_UNSURE) != 0) {
        t->n_unsure++;
        return;
    }
    for (int which = 0; which < 2; which++) {
        for (size_t i = 0; i < SAMPLES; i++) {
            c[which].x[i] = cloud_point(&c[which], c[which].w[i]);
        }
    }
    const double found = brute_distance(&c[0], &c[1]);
    t->n_apart++;
    t->n_truncated += (out.flags & SHCD_PROXIMITY_TRUNCATED) != 0;
    t->worst = fmax(t->worst, fabs(found - out.upper_m) / diagonal);
    assert_true(out.lower_m <= found);
    assert_at_most(out.upper_m - found, TOLERANCE * diagonal);
    assert_at_most(fabs(out.gap_m - swapped.gap_m), TOLERANCE * diagonal);
    if ((out.flags & SHCD_PROXIMITY_TRUNCATED) == 0) {
        assert_at_most(out.upper_m - out.lower_m, TOLERANCE * diagonal);
    }
    /* the points are those of the surfaces at the parameters, and as far apart as said */
    const shcd_vec3 a = cloud_point(&c[0], out.parameter_a),
                    b = cloud_point(&c[1], out.parameter_b);
    assert_near(shcd_norm(shcd_sub(a, out.point_a_m)), 0.0, 1e-12);
    assert_near(shcd_norm(shcd_sub(b, out.point_b_m)), 0.0, 1e-12);
    assert_near(shcd_norm(shcd_sub(a, b)), out.gap_m, 1e-12);
}

/* Gives the shape a random displacement that falls with the degree. */
static shcd_shape *deform(const shcd_model *model, cloud *c, check_random *random, double size,
                          void **memory) {
    shcd_shape *shape = NULL;
    const size_t bytes = (shcd_shape_size(model) + 15) / 16 * 16;
    *memory = aligned_alloc(16, bytes);
    assert_non_null(*memory);
    assert_int_equal(shcd_shape_init(model, *memory, bytes, &shape), SHCD_OK);
    for (int l = 0; l <= c->degree; l++) {
        for (size_t i = 3 * SHCD_INDEX(l, -l); i < 3 * SHCD_INDEX(l, l) + 3; i++) {
            c->coefficients[i] += size * check_normal(random) / ((1.0 + l) * (1.0 + l));
        }
    }
    assert_int_equal(shcd_shape_set(model, shape, c->coefficients, SHCD_FOLLOW_AUTO), SHCD_OK);
    return shape;
}

static void run_any(uint64_t seed, double deformation) {
    check_random random = {seed};
    static cloud c[2];
    pair_tally t = {0, 0, 0, 0, 0, 0.0};
    const size_t n_bodies = check_scaled(10);
    for (size_t i = 0; i < n_bodies; i++) {
        shcd_model *model[2];
        for (size_t which = 0; which < 2; which++) {
            cloud *of = &c[which];
            of->degree = 2 + (int)((i + 3 * which) % (DEGREE_MAX - 1));
            if (i % 3 == which) {
                const double bent[4] = {0.5, 0.6, 1.0, 0.9};
                of->degree = 2;
                bodies_project(2, bodies_bent, bent, of->coefficients);
            } else {
                bodies_random_coefficients(&random, of->degree, 0.06, of->coefficients);
            }
            model[which] = bodies_create(of->degree, of->coefficients);
            for (size_t k = 0; k < SAMPLES; k++) {
                of->w[k] = bodies_random_direction(&random);
            }
        }
        for (int k = 0; k < 8; k++) {
            const cloud rest[2] = {c[0], c[1]};
            void *memory[2] = {NULL, NULL};
            shcd_shape *shape[2] = {NULL, NULL};
            for (int which = 0; which < 2 && deformation > 0.0; which++) {
                shape[which] =
                    deform(model[which], &c[which], &random, deformation, &memory[which]);
            }
            const shcd_model_info a = bodies_info(model[0]), b = bodies_info(model[1]);
            const shcd_pose none = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}};
            c[0].pose = none;
            c[1].pose.orientation = random_turn(&random);
            c[1].pose.position_m =
                shcd_sub(shcd_mul_add(a.centre_m,
                                      check_uniform(&random, 0.5, 1.1) * (a.radius_m + b.radius_m),
                                      bodies_random_direction(&random)),
                         shcd_rotate(c[1].pose.orientation, b.centre_m));
            check_pair((const shcd_model *[2]){model[0], model[1]},
                       (const shcd_shape *[2]){shape[0], shape[1]}, c, &t);
            free(memory[0]);
            free(memory[1]);
            c[0] = rest[0];
            c[1] = rest[1];
        }
        shcd_model_free(model[0]);
        shcd_model_free(model[1]);
    }
    print_message("seed %llu: %zu apart, %zu overlapping, %zu unsure, %zu truncated, at most %u "
                  "evaluations, |brute - upper| <= %.2g diagonals\n",
                  (unsigned long long)seed, t.n_apart, t.n_overlapping, t.n_unsure, t.n_truncated,
                  t.evaluations, t.worst);
    assert_true(t.n_apart >= 8 * n_bodies / 4);
    assert_true(t.n_unsure <= 8 * n_bodies / 20);
    assert_int_equal(t.n_truncated, 0);
}

static void test_pair_of_random_bodies_matches_brute_force(void **state) {
    (void)state;
    run_any(20261204, 0.0);
}

static void test_pair_of_deformed_bodies_matches_brute_force(void **state) {
    (void)state;
    run_any(20261205, 0.1);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pair_of_random_bodies_matches_brute_force),
        cmocka_unit_test(test_pair_of_deformed_bodies_matches_brute_force),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
