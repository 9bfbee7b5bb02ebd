/* SPDX-License-Identifier: BSD-3-Clause */
/* Two fitted bodies at random poses: the interval against samples of both surfaces, the same gap
 * with the bodies swapped, and what it costs against two spheres of the bodies' sizes at the same
 * poses, the cheapest pair there is. */
#include "shcd/pair.h"
#include "support/bodies.h"
#include "support/check.h"

#define SAMPLES 1500
#define TOLERANCE 1e-6

typedef struct cost {
    size_t n;
    double evaluations, patches;
    uint32_t evaluations_max, patches_max;
} cost;

static void count(cost *c, const shcd_pair_proximity *p) {
    c->n++;
    c->evaluations += p->n_evaluations;
    c->patches += p->n_patches;
    c->evaluations_max =
        p->n_evaluations > c->evaluations_max ? p->n_evaluations : c->evaluations_max;
    c->patches_max = p->n_patches > c->patches_max ? p->n_patches : c->patches_max;
}

static void report(const char *name, const cost *c) {
    print_message("%s: %zu pairs, evaluations mean %.0f max %u, patches mean %.0f max %u\n", name,
                  c->n, c->evaluations / (double)c->n, c->evaluations_max,
                  c->patches / (double)c->n, c->patches_max);
}

static shcd_model *load(const char *path) {
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    if (shcd_model_load(path, NULL, &model, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    return model;
}

static void sample(const shcd_model *model, check_random *random, shcd_vec3 *x) {
    for (size_t i = 0; i < SAMPLES; i++) {
        const shcd_vec3 w = bodies_random_direction(random);
        assert_int_equal(shcd_model_surface(model, -1, w, &x[i], NULL, NULL), SHCD_OK);
    }
}

static double sampled_distance(const shcd_vec3 *a, const shcd_vec3 *b, shcd_pose b_in_a) {
    double least = HUGE_VAL;
    for (size_t k = 0; k < SAMPLES; k++) {
        const shcd_vec3 p = shcd_transform(b_in_a, b[k]);
        for (size_t i = 0; i < SAMPLES; i++) {
            const shcd_vec3 r = shcd_sub(a[i], p);
            least = fmin(least, shcd_dot(r, r));
        }
    }
    return sqrt(least);
}

static shcd_pose random_pose(check_random *r, const shcd_model_info *a, const shcd_model_info *b,
                             double share) {
    const double w = check_normal(r), x = check_normal(r), y = check_normal(r), z = check_normal(r);
    const double n = sqrt(w * w + x * x + y * y + z * z);
    const shcd_quat q = {w / n, x / n, y / n, z / n};
    const shcd_vec3 to =
        shcd_mul_add(a->centre_m, share * (a->radius_m + b->radius_m), bodies_random_direction(r));
    const shcd_pose pose = {shcd_sub(to, shcd_rotate(q, b->centre_m)), q};
    return pose;
}

static shcd_pose inverse(shcd_pose a) {
    shcd_pose b;
    b.orientation = shcd_conjugate(a.orientation);
    b.position_m = shcd_scale(-1.0, shcd_rotate(b.orientation, a.position_m));
    return b;
}

/* Two spheres with a given gap. */
static void count_spheres(const shcd_model *a, const shcd_model *b, double gap,
                          check_random *random, cost *c) {
    const shcd_model_info info_a = bodies_info(a), info_b = bodies_info(b);
    shcd_pose pose = random_pose(random, &info_a, &info_b, 1.0);
    /* half axes, not the certified radii */
    const double between = info_a.box_max_m.z + info_b.box_max_m.z + gap;
    pose.position_m = shcd_scale(between, shcd_unit(pose.position_m));
    shcd_pair_proximity out;
    assert_int_equal(shcd_pair_closest(a, NULL, b, NULL, pose, NULL, &out), SHCD_OK);
    assert_int_equal(out.flags, 0);
    assert_true(out.lower_m <= gap + 1e-14 && gap <= out.upper_m + 1e-14);
    count(c, &out);
}

static void test_pair_of_fitted_bodies(void **state) {
    char **path = *(char ***)*state;
    shcd_model *a = load(path[0]), *b = load(path[1]);
    const shcd_model_info info_a = bodies_info(a), info_b = bodies_info(b);
    shcd_model *ball_a = bodies_create_ellipsoid(info_a.radius_m, info_a.radius_m, info_a.radius_m);
    shcd_model *ball_b = bodies_create_ellipsoid(info_b.radius_m, info_b.radius_m, info_b.radius_m);
    const double diagonal = fmax(info_a.diagonal_m, info_b.diagonal_m);
    check_random random = {20261208};
    static shcd_vec3 x_a[SAMPLES], x_b[SAMPLES];
    cost bodies = {0, 0.0, 0.0, 0, 0}, spheres = {0, 0.0, 0.0, 0, 0};
    size_t n_overlapping = 0, n_unsure = 0, n_truncated = 0;
    sample(a, &random, x_a);
    sample(b, &random, x_b);
    const size_t n = check_scaled(200);
    for (size_t i = 0; i < n; i++) {
        const shcd_pose pose =
            random_pose(&random, &info_a, &info_b, check_uniform(&random, 0.6, 1.3));
        shcd_pair_proximity out, swapped;
        assert_int_equal(shcd_pair_closest(a, NULL, b, NULL, pose, NULL, &out), SHCD_OK);
        assert_true(out.lower_m <= out.gap_m && out.gap_m <= out.upper_m);
        if ((out.flags & (uint32_t)SHCD_PAIR_OVERLAP) != 0) {
            n_overlapping++;
            assert_true(out.upper_m < 0.0);
            continue;
        }
        const double found = sampled_distance(x_a, x_b, pose);
        const int truncated = (out.flags & SHCD_PROXIMITY_TRUNCATED) != 0;
        n_unsure += (out.flags & SHCD_PROXIMITY_SIGN_UNSURE) != 0;
        n_truncated += (size_t)truncated;
        assert_true(out.lower_m <= found);
        if ((out.flags & SHCD_PROXIMITY_SIGN_UNSURE) != 0) {
            continue;
        }
        if (!truncated) {
            /* samples are farther apart than the closest pair */
            assert_true(out.upper_m <= found + TOLERANCE * diagonal);
            assert_at_most(out.upper_m - out.lower_m, TOLERANCE * diagonal);
        }
        assert_int_equal(shcd_pair_closest(b, NULL, a, NULL, inverse(pose), NULL, &swapped),
                         SHCD_OK);
        /* both intervals hold the truth */
        assert_true(out.lower_m <= swapped.upper_m && swapped.lower_m <= out.upper_m);
        count(&bodies, &out);
        count_spheres(ball_a, ball_b, out.gap_m, &random, &spheres);
    }
    report("bodies", &bodies);
    report("spheres", &spheres);
    print_message("seed 20261208: %zu overlapping, %zu unsure, %zu truncated\n", n_overlapping,
                  n_unsure, n_truncated);
    assert_true(bodies.n >= n / 2);
    assert_true(n_unsure + n_truncated <= n / 20);
    assert_true(3.0 * spheres.evaluations < bodies.evaluations);
    assert_true(spheres.patches < bodies.patches);
    assert_true(spheres.evaluations_max <= 600);
    shcd_model_free(ball_b);
    shcd_model_free(ball_a);
    shcd_model_free(b);
    shcd_model_free(a);
}

int main(int argc, char **argv) {
    if (argc != 3) {
        fprintf(stderr, "usage: test_pair_bodies BODY.shcd BODY.shcd\n");
        return 2;
    }
    char **path = argv + 1;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_prestate(test_pair_of_fitted_bodies, &path),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
