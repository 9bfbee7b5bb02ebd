/* SPDX-License-Identifier: BSD-3-Clause */
/* The map tier: radii along true directions against closed forms, continuity of the Hermite
 * look-up, inside and outside by parity, and an interval that stays true. */
#include "shcd/shcd.h"
#include "support/bodies.h"
#include "support/brute.h"
#include "support/check.h"
#include "support/ellipsoid.h"

#define RADIAL SHCD_PROXIMITY_RADIAL
#define EDGE SHCD_PROXIMITY_MAP_EDGE
#define UNSURE SHCD_PROXIMITY_SIGN_UNSURE

static shcd_proximity look(const shcd_model *model, shcd_vec3 p, int hermite) {
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    shcd_proximity got;
    options.tier = SHCD_TIER_MAP;
    options.map_hermite = hermite;
    assert_int_equal(shcd_closest(model, p, &options, &got), SHCD_OK);
    assert_true((got.flags & RADIAL) != 0);
    return got;
}

/* Radius along a unit direction that the map gives, seen from a point on the ray. */
static double radius_along(const shcd_model *model, const shcd_model_info *info, shcd_vec3 d,
                           int hermite) {
    const double rho = 2.0 * info->radius_m;
    const shcd_proximity got = look(model, shcd_mul_add(info->star_centre_m, rho, d), hermite);
    assert_int_equal(got.flags & EDGE, 0);
    return rho - got.distance_m;
}

/* Of an ellipsoid, from a centre inside: the positive root of |A^-1 (c + r d)| = 1. */
static double ellipsoid_radius(const double axes[3], shcd_vec3 c, shcd_vec3 d) {
    const shcd_vec3 u = {d.x / axes[0], d.y / axes[1], d.z / axes[2]};
    const shcd_vec3 v = {c.x / axes[0], c.y / axes[1], c.z / axes[2]};
    const double uu = shcd_dot(u, u), uv = shcd_dot(u, v), vv = shcd_dot(v, v);
    return (-uv + sqrt(uv * uv + uu * (1.0 - vv))) / uu;
}

/* Lattice node of the octahedron, resolution n. */
static shcd_vec3 random_node(int n, check_random *random) {
    const int i = (int)check_uniform(random, 0.0, n + 1.0);
    const int j = (int)check_uniform(random, 0.0, n - i + 1.0);
    const uint64_t sign = check_random_bits(random);
    return shcd_unit(
        shcd_vec3_make(sign & 1 ? -i : i, sign & 2 ? -j : j, sign & 4 ? -(n - i - j) : n - i - j));
}

/* ---- radii ---- */

static void test_radii_of_ellipsoids_are_exact_at_nodes_and_close_between(void **state) {
    static const double axes[3][3] = {{1.0, 1.0, 1.0}, {1.0, 1.5, 2.0}, {0.02, 0.01, 0.03}};
    check_random random = {131};
    (void)state;
    for (int b = 0; b < 3; b++) {
        shcd_model *model =
            bodies_create_ellipsoid_turned(axes[b][0], axes[b][1], axes[b][2], &random);
        const shcd_model_info info = bodies_info(model);
        double worst[2] = {0.0, 0.0};
        for (size_t n = 0; n < check_scaled(4000); n++) {
            const shcd_vec3 node = random_node(info.map_resolution, &random);
            const shcd_vec3 d = bodies_random_direction(&random);
            for (int hermite = 0; hermite < 2; hermite++) {
                /* float storage rounds to 6e-8; Newton stops at 1e-13; the interpolants carry a
                 * direction off the node by 1e-16 times the slope */
                const double r = ellipsoid_radius(axes[b], info.star_centre_m, node);
                assert_near(radius_along(model, &info, node, hermite), r, 1.2e-7 * r);
                const double off = fabs(radius_along(model, &info, d, hermite) -
                                        ellipsoid_radius(axes[b], info.star_centre_m, d));
                worst[hermite] = fmax(worst[hermite], off);
            }
        }
        print_message("linear: worst %.3g, measured %.3g, proven %.3g; Hermite: %.3g, %.3g, %.3g\n",
                      worst[0], info.map_bilinear_error_m, info.map_bilinear_bound_m, worst[1],
                      info.map_hermite_error_m, info.map_hermite_bound_m);
        /* proven where it is bounded, and a smooth star-shaped body is bounded everywhere */
        assert_true(info.map_bounded_share == 1.0);
        assert_at_most(worst[0], info.map_bilinear_bound_m);
        assert_at_most(worst[1], info.map_hermite_bound_m);
        /* what the model measured is a sample of the same errors: of about a thousand places, so
         * that the worst of four times as many is a little larger. Both samples see the cells'
         * middles, where a smooth radius errs most; 1.5 leaves room for where those fall. */
        assert_at_most(worst[0], 1.5 * info.map_bilinear_error_m + 1.2e-7 * info.radius_m);
        assert_at_most(worst[1], 1.5 * info.map_hermite_error_m + 1.2e-7 * info.radius_m);
        assert_true(info.map_hermite_error_m < info.map_bilinear_error_m || b == 0);
        shcd_model_free(model);
    }
}

static void test_proven_bounds_hold_on_random_bodies(void **state) {
    check_random random = {132};
    (void)state;
    for (int b = 0; b < 3; b++) {
        shcd_model *model = b == 2 ? bodies_create_bent(0.5, 0.6, 1.2, 3.0)
                                   : bodies_create_random(&random, b == 0 ? 6 : 12, 0.1);
        shcd_map *map = NULL;
        size_t n_bounded = 0, n_edge = 0, n = check_scaled(3000);
        assert_int_equal(shcd_map_create(model, NULL, NULL, &map, NULL), SHCD_OK);
        shcd_map_info info = SHCD_MAP_INFO_INIT;
        assert_int_equal(shcd_map_describe(map, &info), SHCD_OK);
        for (size_t i = 0; i < n; i++) {
            const shcd_vec3 d = bodies_random_direction(&random);
            for (int hermite = 0; hermite < 2; hermite++) {
                shcd_map_ray ray;
                assert_int_equal(shcd_map_look_up(map, d, hermite, &ray), SHCD_OK);
                n_edge += hermite == 0 && (ray.flags & SHCD_MAP_EDGE) != 0;
                if ((ray.flags & SHCD_MAP_BOUNDED) == 0) {
                    continue;
                }
                n_bounded += hermite == 0;
                for (int k = 0; k < ray.count; k++) {
                    /* a true crossing within the bound of the looked-up radius: the distance to
                     * the surface there is at most the bound */
                    const shcd_vec3 p = shcd_mul_add(info.centre_m, ray.crossing[k].radius_m, d);
                    shcd_proximity got;
                    assert_int_equal(shcd_closest(model, p, NULL, &got), SHCD_OK);
                    assert_true(fabs(got.distance_m) <= ray.bound_m);
                    assert_true(k == 0 || ray.crossing[k].radius_m >= ray.crossing[k - 1].radius_m);
                }
            }
        }
        print_message("body %d: bounded %zu, edge %zu of %zu directions\n", b, n_bounded, n_edge,
                      n);
        /* everywhere on a star-shaped body; else not near silhouettes */
        assert_true(b == 2 ? n_bounded > 0 : n_bounded == n);
        shcd_map_free(map);
        shcd_model_free(model);
    }
}

/* ---- continuity ---- */

/* A great circle that crosses an edge of the octahedron (where a coordinate vanishes), an edge of
 * a lattice triangle, or a node, at right angles or not. */
static void test_hermite_radius_is_continuous_with_its_slope_across_edges(void **state) {
    check_random random = {133};
    shcd_model *model = bodies_create_random(&random, 8, 0.1);
    const shcd_model_info info = bodies_info(model);
    const double h = 1e-4;
    double jump[2] = {0.0, 0.0}, kink[2] = {0.0, 0.0};
    (void)state;
    assert_true(info.map_one_crossing_share == 1.0);
    for (size_t n = 0; n < check_scaled(1500); n++) {
        shcd_vec3 d = bodies_random_direction(&random);
        if (n % 3 == 0) {
            d = shcd_unit(n % 2 ? shcd_vec3_make(0.0, d.y, d.z) : shcd_vec3_make(d.x, d.y, 0.0));
        } else if (n % 3 == 1) { /* on a line i = const of the lattice */
            const double size = fabs(d.x) + fabs(d.y) + fabs(d.z);
            const double x = floor(fabs(d.x) / size * info.map_resolution) / info.map_resolution;
            const double rest = (1.0 - x) / (fabs(d.y) + fabs(d.z));
            d = shcd_unit(shcd_vec3_make(x, d.y * rest, d.z * rest));
        } else if (n % 6 == 2) {
            d = random_node(info.map_resolution, &random);
        }
        const shcd_vec3 v = shcd_unit(shcd_cross(d, bodies_random_direction(&random)));
        for (int hermite = 0; hermite < 2; hermite++) {
            double r[5];
            for (int k = -2; k <= 2; k++) {
                r[k + 2] =
                    radius_along(model, &info, shcd_unit(shcd_mul_add(d, k * h, v)), hermite);
            }
            /* one-sided slopes, second order, so that their difference is the kink and O(h^2) */
            const double left = (3.0 * r[2] - 4.0 * r[1] + r[0]) / (2.0 * h);
            const double right = -(3.0 * r[2] - 4.0 * r[3] + r[4]) / (2.0 * h);
            jump[hermite] = fmax(jump[hermite], fmax(fabs(r[3] - r[2]), fabs(r[2] - r[1])));
            kink[hermite] = fmax(kink[hermite], fabs(right - left));
        }
    }
    print_message("largest step over %g rad: %.2g, %.2g m; kink of the slope: linear %.2g, Hermite "
                  "%.2g m/rad\n",
                  h, jump[0], jump[1], kink[0], kink[1]);
    /* slopes of r are below 2 m/rad here, |r'| = r |tan| of the incidence; nodes are continuous */
    assert_at_most(jump[0], 3.0 * h);
    assert_at_most(jump[1], 3.0 * h);
    /* The third derivative of one cubic is at most 6 of its data's differences over the cell's
     * 0.05 rad, some 1e4 here, so O(h^2) is 1e4 h^2 = 1e-4; rounding 1e-15/h. The linear look-up
     * kinks by second differences, |r''| times a cell: a hundred times more. */
    assert_at_most(kink[1], 1e-4 + 1e-4);
    assert_true(kink[0] > 0.01);
    shcd_model_free(model);
}

/* ---- inside and outside ---- */

static shcd_vec3 point_about(const shcd_model_info *info, check_random *random) {
    return shcd_mul_add(info->centre_m, check_uniform(random, 0.0, 1.2) * info->radius_m,
                        bodies_random_direction(random));
}

static void check_parity(shcd_model *model, uint64_t seed, size_t *wrong, size_t *sure) {
    check_random random = {seed};
    const shcd_model_info info = bodies_info(model);
    brute *b = brute_create(model, 60);
    assert_non_null(b);
    const double deviation = 2.0 * brute_deviation(b);
    size_t n = 0, edge = 0;
    for (size_t i = 0; i < check_scaled(2500); i++) {
        const shcd_vec3 p = point_about(&info, &random);
        shcd_proximity exact;
        assert_int_equal(shcd_closest(model, p, NULL, &exact), SHCD_OK);
        if (fabs(exact.distance_m) <= deviation) {
            continue;
        }
        const int inside = brute_winding(b, p) > 0.5;
        for (int hermite = 0; hermite < 2; hermite++) {
            const shcd_proximity got = look(model, p, hermite);
            n++;
            edge += (got.flags & EDGE) != 0;
            if ((got.flags & UNSURE) == 0) { /* proven: no exception */
                ++*sure;
                assert_int_equal(got.distance_m < 0.0, inside);
                assert_true(inside ? got.upper_m <= 0.0 : got.lower_m >= 0.0);
            } else if ((got.flags & EDGE) == 0 && (got.distance_m < 0.0) != inside) {
                ++*wrong;
            }
            /* the truth, which the exact tier knows to 1e-9 */
            assert_true(got.lower_m <= exact.upper_m && exact.lower_m <= got.upper_m);
            assert_near(shcd_norm(got.normal), 1.0, 1e-15);
            assert_near(shcd_norm(got.parameter), 1.0, 1e-15);
        }
    }
    print_message("star %d: %zu look-ups, %zu at edges, %zu proven, %zu of the rest wrong\n",
                  info.is_star_shaped, n, edge, *sure, *wrong);
    assert_true(*sure > (info.is_star_shaped ? n / 2 : 0));
    brute_free(b);
}

static void test_parity_on_a_star_shaped_body(void **state) {
    check_random random = {134};
    shcd_model *model = bodies_create_random(&random, 10, 0.08);
    const shcd_model_info info = bodies_info(model);
    size_t wrong = 0, sure = 0;
    (void)state;
    assert_int_equal(info.is_star_shaped, 1);
    check_parity(model, 135, &wrong, &sure);
    /* a point is on the wrong side only within the look-up's error of the surface, far below the
     * distance from it that the comparison asks for */
    assert_int_equal(wrong, 0);
    shcd_model_free(model);
}

static void test_parity_on_bodies_that_are_not_star_shaped(void **state) {
    (void)state;
    for (int b = 0; b < 2; b++) {
        shcd_model *model = b == 0 ? bodies_create_bent(0.5, 0.6, 1.2, 3.0)
                                   : bodies_create_bent(0.15, 0.2, 1.0, 1.0);
        size_t wrong = 0, sure = 0;
        assert_int_equal(bodies_info(model).is_star_shaped, 0);
        check_parity(model, 136, &wrong, &sure);
        /* Cells at silhouettes have equal counts at their nodes and other counts inside now and
         * then; the radius errs most there. The unproven rest may be wrong, but is flagged. */
        assert_at_most((double)wrong, 0.01 * 5000.0);
        shcd_model_free(model);
    }
}

/* ---- corners ---- */

static void test_centre_and_odd_directions_are_answered(void **state) {
    static const double tiny[5] = {0.0, 1e-308, 1e-200, 1e-160, 1e-17};
    shcd_model *model = bodies_create_ellipsoid(1.0, 2.0, 3.0);
    const shcd_model_info info = bodies_info(model);
    const double axes[3] = {1.0, 2.0, 3.0};
    (void)state;
    for (int i = 0; i < 5; i++) {
        for (int hermite = 0; hermite < 2; hermite++) {
            const shcd_vec3 p =
                shcd_add(info.star_centre_m, shcd_vec3_make(tiny[i], -tiny[i], 2.0 * tiny[i]));
            const shcd_proximity got = look(model, p, hermite);
            const double truth = ellipsoid_distance(axes, p);
            assert_true(got.lower_m <= truth && truth <= got.upper_m);
            assert_true(got.distance_m < 0.0);
            assert_at_most(fabs(got.distance_m), 3.0 * (1.0 + 1e-3));
            /* the point is on the surface up to the look-up's error */
            shcd_proximity at;
            assert_int_equal(shcd_closest(model, got.point_m, NULL, &at), SHCD_OK);
            assert_at_most(fabs(at.distance_m), info.map_bilinear_bound_m);
        }
    }
    for (int i = 0; i < 27; i++) { /* axes, planes and diagonals, negative zeros among them */
        const shcd_vec3 d = {i % 3 - 1.0, i / 3 % 3 - 1.0, i < 9 ? -0.0 : i < 18 ? 1.0 : -1.0};
        if (shcd_norm(d) > 0.0) {
            for (int hermite = 0; hermite < 2; hermite++) {
                const shcd_vec3 u = shcd_unit(d);
                assert_near(radius_along(model, &info, u, hermite),
                            ellipsoid_radius(axes, info.star_centre_m, u),
                            info.map_bilinear_bound_m);
            }
        }
    }
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_radii_of_ellipsoids_are_exact_at_nodes_and_close_between),
        cmocka_unit_test(test_proven_bounds_hold_on_random_bodies),
        cmocka_unit_test(test_hermite_radius_is_continuous_with_its_slope_across_edges),
        cmocka_unit_test(test_parity_on_a_star_shaped_body),
        cmocka_unit_test(test_parity_on_bodies_that_are_not_star_shaped),
        cmocka_unit_test(test_centre_and_odd_directions_are_answered)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
