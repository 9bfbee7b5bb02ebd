/* SPDX-License-Identifier: BSD-3-Clause */
/* The distance map as an object: both grids, closed forms about any centre, proven bounds and
 * counts, memory. (References and refusals: test_map_reference.c; what SHCD_TIER_MAP gives:
 * test_map.c.) */
#include "model/map_cast.h"
#include "realtime/sanitized.h"
#include "support/maps.h"

static size_t n_allocations;

void *__real_malloc(size_t size);
void *__wrap_malloc(size_t size);

void *__wrap_malloc(size_t size) {
    n_allocations++;
    return __real_malloc(size);
}

static shcd_vec3 at_angles(double theta, double phi) {
    return shcd_vec3_make(sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta));
}

/* ---- grids ---- */

/* shcdi_angle states 2e-15; libm's atan2 is within an ulp of 2 pi, 9e-16 */
static void test_angles_need_no_libm(void **state) {
    check_random random = {201};
    double worst = 0.0;
    (void)state;
    for (size_t i = 0; i < check_scaled(200000); i++) {
        const double scale = exp(check_uniform(&random, -20.0, 20.0));
        const double y = i % 7 == 0 ? 0.0 : check_normal(&random) * scale;
        const double x = i % 11 == 0 ? 0.0 : check_normal(&random);
        const double a = atan2(y, x), expected = a < 0.0 ? a + 2.0 * BODIES_PI : a;
        const double off = fabs(shcdi_angle(y, x) - expected);
        worst = fmax(worst, fmin(off, fabs(2.0 * BODIES_PI - off)));
        assert_true(shcdi_angle(y, x) >= 0.0 && shcdi_angle(y, x) < 2.0 * BODIES_PI);
    }
    print_message("largest difference from atan2: %.2g\n", worst);
    assert_at_most(worst, 2e-15 + 9e-16);
    assert_true(shcdi_angle(0.0, 0.0) == 0.0 && shcdi_angle(-0.0, 1.0) == 0.0);
}

typedef struct node_check {
    const shcd_map *map;
    size_t n;
} node_check;

static int check_node(void *user, size_t slot, shcd_vec3 d) {
    node_check *check = user;
    const shcdi_map *m = &check->map->map;
    for (int k = 0; k < 3; k++) {
        const shcd_map_ray ray = maps_look(check->map,
                                           shcd_scale(k == 0   ? 1.0
                                                      : k == 1 ? 3e-7
                                                               : 7e9,
                                                      d),
                                           SHCD_MAP_LINEAR);
        assert_int_equal(ray.count, m->count[slot]);
        for (int c = 0; c < ray.count; c++) {
            const shcdi_crossing *stored = &m->crossing[m->first[slot] + (uint32_t)c];
            /* the direction is rounded by 2e-16, which moves the radius by the slope times it */
            const double slope = shcd_norm(shcdi_from_floats(stored->slope));
            assert_near(ray.crossing[c].radius_m, (double)stored->radius,
                        1e-14 * ((double)stored->radius + m->resolution * slope));
        }
    }
    check->n++;
    return 1;
}

static void test_every_node_gives_its_own_crossings(void **state) {
    static const int resolutions[4] = {2, 3, 7, 32};
    shcd_model *model = bodies_create_bent(0.5, 0.6, 1.2, 1.0);
    (void)state;
    for (int grid = 0; grid < 2; grid++) {
        for (int i = 0; i < 4; i++) {
            shcd_map_options options = maps_on_grid(grid, resolutions[i]);
            options.without_bounds = 1;
            shcd_map *map = maps_create(model, &options);
            node_check check = {map, 0};
            (void)shcdi_grid_visit_nodes(grid, resolutions[i], check_node, &check);
            assert_int_equal(check.n, maps_describe(map).n_nodes);
            shcd_map_free(map);
        }
    }
    shcd_model_free(model);
}

typedef struct cell_check {
    int grid, n;
    size_t count;
} cell_check;

static int check_cell(void *user, const shcdi_cell *cell) {
    cell_check *check = user;
    double u[3] = {0.0, 0.0, 0.0};
    for (int i = 0; i < cell->n; i++) {
        for (int k = 0; k < 3; k++) {
            u[k] += cell->u[i][k] / cell->n;
        }
    }
    shcdi_stencil at;
    shcdi_grid_locate(check->grid, check->n, shcdi_grid_direction(check->grid, u), &at);
    assert_int_equal(at.cell, cell->index);
    assert_int_equal(at.n, cell->n);
    for (int i = 0; i < cell->n; i++) {
        assert_int_equal(at.slot[i], cell->slot[i]);
        assert_near(at.weight[i], 1.0 / cell->n, 1e-12);
    }
    check->count++;
    return 1;
}

static void test_look_up_and_building_number_cells_alike(void **state) {
    (void)state;
    for (int grid = 0; grid < 2; grid++) {
        for (int n = 2; n <= 33; n += n < 6 ? 1 : 9) {
            cell_check check = {grid, n, 0};
            (void)shcdi_grid_visit_cells(grid, n, check_cell, &check);
            assert_int_equal(check.count, shcdi_grid_cells(grid, n));
        }
    }
}

/* Bilinear in (theta, phi), the wrap of phi and the poles, against libm's angles. */
static void test_latitude_longitude_is_bilinear_up_to_poles_and_seam(void **state) {
    check_random random = {202};
    shcd_model *model = bodies_create_random(&random, 5, 0.08);
    const shcd_map_options options = maps_on_grid(SHCD_MAP_LATITUDE_LONGITUDE, 24);
    shcd_model *tree = maps_with_tree(model);
    shcd_map *map = maps_create(model, &options);
    const shcdi_map *m = &map->map;
    const double step = BODIES_PI / 24.0;
    (void)state;
    assert_true(m->one_crossing_share == 1.0);
    for (size_t i = 0; i < check_scaled(3000); i++) {
        const double theta = i % 3 == 0   ? check_uniform(&random, 0.0, step)
                             : i % 3 == 1 ? BODIES_PI - check_uniform(&random, 0.0, step)
                                          : check_uniform(&random, 0.0, BODIES_PI);
        const double phi = i % 2 == 0 ? check_uniform(&random, -step, step)
                                      : check_uniform(&random, 0.0, 2.0 * BODIES_PI);
        const double u = theta / step, v = (phi < 0.0 ? phi + 2.0 * BODIES_PI : phi) / step;
        const size_t j = (size_t)fmin(u, 23.0), k = (size_t)fmin(v, 47.0), k1 = (k + 1) % 48;
        const double s = u - (double)j, t = v - (double)k;
        double corner[4];
        const size_t slot[4] = {48 * j + k, 48 * j + k1, 48 * (j + 1) + k, 48 * (j + 1) + k1};
        for (int c = 0; c < 4; c++) {
            corner[c] = (double)m->crossing[m->first[slot[c]]].radius;
        }
        const double expected = (1.0 - s) * ((1.0 - t) * corner[0] + t * corner[1]) +
                                s * ((1.0 - t) * corner[2] + t * corner[3]);
        const shcd_map_ray ray = maps_look(map, at_angles(theta, phi), SHCD_MAP_LINEAR);
        /* near a pole phi is known to 1e-16/sin(theta) only, but corners then agree to as much */
        assert_near(ray.crossing[0].radius_m, expected, 1e-12);
    }
    for (int pole = 0; pole < 2; pole++) {
        const shcd_vec3 z = {0.0, 0.0, pole == 0 ? 1.0 : -1.0};
        const double r = maps_look(map, z, SHCD_MAP_LINEAR).crossing[0].radius_m;
        shcdi_hit hits[SHCDI_MAP_CROSSINGS_MAX + 1];
        assert_int_equal(shcdi_cast(tree, m->centre, z, hits), 1);
        assert_near(r, hits[0].radius, MAPS_STORED * r);
        for (int k = 0; k < 48; k++) { /* one value whichever way the pole is approached */
            const double theta = pole == 0 ? 1e-9 : BODIES_PI - 1e-9;
            assert_near(maps_look(map, at_angles(theta, k * step + 0.01), SHCD_MAP_LINEAR)
                            .crossing[0]
                            .radius_m,
                        r, 1e-8);
        }
    }
    shcd_map_free(map);
    shcd_model_free(tree);
    shcd_model_free(model);
}

/* ---- closed forms ---- */

static double sphere_radius(shcd_vec3 centre, shcd_vec3 d, int far) {
    const double along = shcd_dot(centre, d);
    const double root = sqrt(along * along + 1.0 - shcd_dot(centre, centre));
    return far ? root - along : -root - along;
}

static void test_sphere_from_an_off_centre_point(void **state) {
    check_random random = {203};
    shcd_model *model = bodies_create_ellipsoid_turned(1.0, 1.0, 1.0, &random);
    (void)state;
    for (int grid = 0; grid < 2; grid++) {
        shcd_map_options options = maps_on_grid(grid, 0);
        options.has_centre = 1;
        options.centre_m = shcd_vec3_make(0.3, -0.2, 0.4);
        shcd_map *map = maps_create(model, &options);
        const shcd_map_info info = maps_describe(map);
        double worst[2] = {0.0, 0.0};
        assert_int_equal(info.centre_inside, 1);
        assert_int_equal(info.crossings_max, 1);
        assert_true(info.bounded_share == 1.0 && info.equal_count_share == 1.0);
        /* (S - C).n is least where n points along C: 1 - |C| */
        const double margin = 1.0 - shcd_norm(options.centre_m);
        assert_true(info.star_margin_m <= margin && info.star_margin_m > 0.5 * margin);
        for (size_t i = 0; i < check_scaled(4000); i++) {
            const shcd_vec3 d = bodies_random_direction(&random);
            const double truth = sphere_radius(options.centre_m, d, 1);
            for (int hermite = 0; hermite <= (grid == SHCD_MAP_OCTAHEDRAL); hermite++) {
                const shcd_map_ray ray = maps_look(map, d, hermite);
                const double off = fabs(ray.crossing[0].radius_m - truth);
                assert_int_equal(ray.flags, SHCD_MAP_BOUNDED);
                assert_true(off <= ray.bound_m);
                worst[hermite] = fmax(worst[hermite], off);
                /* slope: n.d' + n.(grad r) = 0 with n = C + r d */
                const shcd_vec3 n = shcd_mul_add(options.centre_m, truth, d);
                const double nd = shcd_dot(n, d);
                const shcd_vec3 slope = shcd_scale(-truth / nd, shcd_mul_add(n, -nd, d));
                /* linear in between: as far off as its own second derivative makes it, like r */
                assert_near(shcd_norm(shcd_sub(ray.crossing[0].slope_m, slope)), 0.0,
                            4.0 * ray.bound_m + 1e-6);
            }
        }
        print_message("grid %d: linear %.3g of bound %.3g, Hermite %.3g of %.3g\n", grid, worst[0],
                      info.linear_bound_m, worst[1], info.hermite_bound_m);
        shcd_map_free(map);
    }
    shcd_model_free(model);
}

/* Seen from outside: no crossing or two, edges between, and every proven count is right. */
static void test_sphere_from_outside(void **state) {
    check_random random = {204};
    shcd_model *model = bodies_create_ellipsoid_turned(1.0, 1.0, 1.0, &random);
    shcd_map_options options = maps_on_grid(SHCD_MAP_OCTAHEDRAL, 24);
    options.has_centre = 1;
    options.centre_m = shcd_vec3_make(1.2, 0.9, -0.5);
    shcd_map *map = maps_create(model, &options);
    const shcd_map_info info = maps_describe(map);
    size_t n_bounded = 0, n_twice = 0, n_edge = 0;
    const size_t n = 1000 + check_scaled(3000); /* enough to meet all three */
    (void)state;
    assert_int_equal(info.centre_inside, 0);
    assert_int_equal(info.crossings_max, 2);
    assert_true(info.star_margin_m == 0.0 && info.bounded_share > 0.5);
    for (size_t i = 0; i < n; i++) {
        const shcd_vec3 d = bodies_random_direction(&random);
        const double along = shcd_dot(options.centre_m, d);
        const double square = along * along + 1.0 - shcd_dot(options.centre_m, options.centre_m);
        const shcd_map_ray ray = maps_look(map, d, (int)(i % 2));
        n_edge += (ray.flags & SHCD_MAP_EDGE) != 0;
        if ((ray.flags & SHCD_MAP_BOUNDED) != 0) {
            n_bounded++;
            assert_int_equal(ray.count, square > 0.0 && along < 0.0 ? 2 : 0);
            n_twice += ray.count == 2;
            for (int k = 0; k < ray.count; k++) {
                const double truth = sphere_radius(options.centre_m, d, k);
                assert_true(fabs(ray.crossing[k].radius_m - truth) <= ray.bound_m);
            }
        }
        /* the query's interval holds, whatever is known along the ray */
        const shcd_vec3 p = shcd_mul_add(options.centre_m, check_uniform(&random, 0.0, 3.0), d);
        const double distance = shcd_norm(p) - 1.0;
        shcd_proximity got;
        assert_int_equal(shcd_map_query(map, p, (int)(i % 2), &got), SHCD_OK);
        assert_true(got.lower_m <= distance && distance <= got.upper_m);
        assert_true((got.flags & SHCD_PROXIMITY_SIGN_UNSURE) != 0 || got.lower_m >= 0.0 ||
                    got.upper_m <= 0.0);
        assert_near(shcd_norm(got.normal), 1.0, 1e-15);
    }
    print_message("%zu directions bounded, %zu of them with two crossings, %zu at edges\n",
                  n_bounded, n_twice, n_edge);
    assert_true(n_bounded > n_twice && n_twice > 0 && n_edge > 0);
    shcd_map_free(map);
    shcd_model_free(model);
}

/* ---- proven counts ---- */

/* Every node's ray misses the body, which lies inside one cell: no count is proven there. */
static void test_a_body_between_the_nodes_is_not_overlooked(void **state) {
    shcd_model *model = bodies_create_ellipsoid(1.0, 1.0, 1.0);
    shcd_map_options options = maps_on_grid(SHCD_MAP_OCTAHEDRAL, 4);
    shcd_proximity got;
    (void)state;
    options.has_centre = 1;
    options.centre_m = shcd_vec3_make(-56.0, -32.0, -8.0);
    shcd_map *map = maps_create(model, &options);
    const shcd_map_info info = maps_describe(map);
    assert_int_equal(info.crossings_max, 0);
    assert_true(info.equal_count_share == 1.0);
    assert_near(info.bounded_share, 1.0 - 1.0 / (double)info.n_cells, 1e-12);
    const shcd_map_ray ray = maps_look(map, shcd_scale(-1.0, options.centre_m), SHCD_MAP_LINEAR);
    assert_int_equal(ray.count, 0);
    assert_int_equal(ray.flags & SHCD_MAP_BOUNDED, 0);
    /* at the body's centre: nothing is known, and that is said */
    assert_int_equal(shcd_map_query(map, shcd_vec3_make(0.0, 0.0, 0.0), 0, &got), SHCD_OK);
    assert_true((got.flags & SHCD_PROXIMITY_SIGN_UNSURE) != 0);
    assert_true(got.lower_m <= -1.0 && got.upper_m >= 1.0);
    /* behind the map's centre: proven to be outside */
    assert_int_equal(shcd_map_query(map, shcd_vec3_make(-112.0, -64.0, -16.0), 0, &got), SHCD_OK);
    assert_int_equal(got.flags & SHCD_PROXIMITY_SIGN_UNSURE, 0);
    assert_true(got.lower_m > 0.0 && got.upper_m >= shcd_norm(got.point_m) - 1.0);
    shcd_map_free(map);
    shcd_model_free(model);
}

static void test_proven_counts_and_radii_agree_with_all_rays_cast(void **state) {
    check_random random = {205};
    (void)state;
    for (int b = 0; b < 3; b++) {
        shcd_model *model = b == 0   ? bodies_create_bent(0.5, 0.6, 1.2, 3.0)
                            : b == 1 ? bodies_create_bent(0.3, 0.5, 1.0, 0.8)
                                     : bodies_create_random(&random, 9, 0.25);
        shcd_model *tree = maps_with_tree(model);
        for (int grid = 0; grid < 2; grid++) {
            const shcd_map_options options = maps_on_grid(grid, b == 0 ? 40 : 24);
            shcd_map *map = maps_create(model, &options);
            const shcd_map_info info = maps_describe(map);
            size_t several = 0, n_bounded = 0;
            double ratio = 0.0;
            for (size_t i = 0; i < check_scaled(6000); i++) {
                const shcd_vec3 d = bodies_random_direction(&random);
                const shcd_map_ray ray = maps_look(map, d, grid == 0 ? (int)(i % 2) : 0);
                if ((ray.flags & SHCD_MAP_BOUNDED) == 0) {
                    continue;
                }
                shcdi_hit hits[SHCDI_MAP_CROSSINGS_MAX + 1];
                assert_int_equal(shcdi_cast(tree, info.centre_m, d, hits), ray.count);
                n_bounded++;
                several += ray.count > 1;
                for (int k = 0; k < ray.count; k++) {
                    const double off = fabs(ray.crossing[k].radius_m - hits[k].radius);
                    assert_true(off <= ray.bound_m);
                    ratio = fmax(ratio, off / ray.bound_m);
                }
            }
            print_message("body %d grid %d: %.3f of the cells bounded, %zu directions, %zu with "
                          "several crossings; error up to %.2f of its bound\n",
                          b, grid, info.bounded_share, n_bounded, several, ratio);
            assert_true(n_bounded > 0);
            shcd_map_free(map);
        }
        shcd_model_free(tree);
        shcd_model_free(model);
    }
}

/* ---- memory ---- */

typedef struct counted {
    size_t n, fail_at, live;
} counted;

static void *counted_allocate(size_t size, void *user) {
    counted *c = user;
    if (c->n++ == c->fail_at) {
        return NULL;
    }
    c->live++;
    return malloc(size);
}

static void counted_release(void *memory, void *user) {
    ((counted *)user)->live--;
    free(memory);
}

static void test_each_failing_allocation_is_survived(void **state) {
    check_random random = {210};
    shcd_model *model = bodies_create_random(&random, 4, 0.1);
    (void)state;
    for (int reference = 0; reference < 4; reference++) {
        shcd_map_options options = maps_on_grid(SHCD_MAP_OCTAHEDRAL, 4);
        options.reference = reference;
        size_t n_failed = 0;
        for (size_t at = 0;; at++) {
            counted c = {0, at, 0};
            const shcd_allocator allocator = {counted_allocate, counted_release, &c};
            shcd_map *map = NULL;
            const shcd_status status = shcd_map_create(model, &options, &allocator, &map, NULL);
            if (status == SHCD_OK) {
                shcd_map_free(map);
                assert_int_equal(c.live, 0);
                break;
            }
            assert_int_equal(status, SHCD_ERR_MEMORY);
            assert_null(map);
            assert_int_equal(c.live, 0);
            n_failed++;
        }
        assert_true(n_failed >= 6);
    }
    shcd_model_free(model);
}

static void test_look_ups_repeat_bit_by_bit_and_never_allocate(void **state) {
    check_random random = {211};
    shcd_model *model = bodies_create_bent(0.5, 0.6, 1.2, 3.0);
    (void)state;
    for (int grid = 0; grid < 2; grid++) {
        shcd_map_options options = maps_on_grid(grid, 16);
        options.reference = SHCD_MAP_REFERENCE_BALL;
        shcd_map *map = maps_create(model, &options);
        const size_t before = n_allocations;
        for (size_t i = 0; i < check_scaled(2000); i++) {
            const shcd_vec3 d = bodies_random_direction(&random);
            const int hermite = grid == 0 ? (int)(i % 2) : 0;
            const shcd_map_ray a = maps_look(map, d, hermite), b = maps_look(map, d, hermite);
            assert_memory_equal(&a, &b, sizeof a);
            shcd_proximity p, q;
            assert_int_equal(shcd_map_query(map, d, hermite, &p), SHCD_OK);
            assert_int_equal(shcd_map_query(map, d, hermite, &q), SHCD_OK);
            assert_memory_equal(&p, &q, sizeof p);
        }
        assert_int_equal(n_allocations, before);
        assert_true(n_allocations > 0);
        shcd_map_free(map);
    }
    shcd_model_free(model);
}

/* ---- work ---- */

/* What map_build.c and map_bound.c allow: 400 steps of Newton's method for each of the 4098 nodes
 * and of the 1021 directions whose error is measured, 100 for each of the 8192 cells. */
static const size_t nodes_max = 400 * 4098, steps_max = 400 * (4098 + 1021) + 100 * 8192;

static void test_a_knot_takes_a_capped_number_of_steps(void **state) {
    check_random random = {9};
    size_t n_unsure = 0;
    (void)state;
    LEAVE_TO_THE_PLAIN_BUILD(); /* the knot takes it half a minute, ordinary bodies the same code */
    shcd_model *knot = bodies_create_random(&random, 20, 4.0);
    for (size_t i = 0; i < knot->map.n_slots; i++) {
        n_unsure += knot->map.count[i] == SHCDI_MAP_UNSURE;
    }
    print_message("%zu steps of %zu, %zu of %zu nodes without a count\n", knot->map.n_steps,
                  steps_max, n_unsure, knot->map.n_slots);
    assert_in_range(knot->map.n_steps, nodes_max, steps_max); /* without a cap: 2.7 million */
    assert_true(n_unsure > 0);
    shcd_model_free(knot);
}

static void test_bodies_stay_far_below_the_cap_of_steps(void **state) {
    check_random random = {210};
    shcd_model *model[2] = {bodies_create_bent(0.5, 0.6, 1.2, 1.0),
                            bodies_create_random(&random, 15, 0.3)};
    (void)state;
    for (int i = 0; i < 2; i++) {
        print_message("%zu steps of %zu\n", model[i]->map.n_steps, steps_max);
        assert_true(model[i]->map.n_steps > 0);
        assert_in_range(4 * model[i]->map.n_steps, 4, steps_max);
        shcd_model_free(model[i]);
    }
}

static void test_a_ray_stops_when_no_steps_are_left(void **state) {
    shcd_model *model = bodies_create_bent(0.5, 0.6, 1.2, 0.3);
    shcd_model *tree = maps_with_tree(model);
    const shcd_vec3 centre = bodies_info(model).star_centre_m, d = {0.6, 0.0, 0.8};
    const size_t plenty = 100000;
    shcdi_hit hits[SHCDI_MAP_CROSSINGS_MAX + 1];
    size_t left = plenty;
    (void)state;
    const int n = shcdi_cast_within(tree, centre, d, &left, hits);
    assert_int_equal(n, shcdi_cast(tree, centre, d, hits));
    const size_t taken = plenty - left;
    assert_in_range(taken, 1, 1920);
    for (size_t k = 0; k <= taken; k++) {
        left = k;
        assert_int_equal(shcdi_cast_within(tree, centre, d, &left, hits),
                         SHCDI_MAP_CROSSINGS_MAX + 1);
        assert_int_equal(left, 0);
    }
    left = taken + 1;
    assert_int_equal(shcdi_cast_within(tree, centre, d, &left, hits), n);
    shcd_model_free(tree);
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_angles_need_no_libm),
        cmocka_unit_test(test_every_node_gives_its_own_crossings),
        cmocka_unit_test(test_look_up_and_building_number_cells_alike),
        cmocka_unit_test(test_latitude_longitude_is_bilinear_up_to_poles_and_seam),
        cmocka_unit_test(test_sphere_from_an_off_centre_point),
        cmocka_unit_test(test_sphere_from_outside),
        cmocka_unit_test(test_a_body_between_the_nodes_is_not_overlooked),
        cmocka_unit_test(test_proven_counts_and_radii_agree_with_all_rays_cast),
        cmocka_unit_test(test_a_knot_takes_a_capped_number_of_steps),
        cmocka_unit_test(test_bodies_stay_far_below_the_cap_of_steps),
        cmocka_unit_test(test_a_ray_stops_when_no_steps_are_left),
        cmocka_unit_test(test_each_failing_allocation_is_survived),
        cmocka_unit_test(test_look_ups_repeat_bit_by_bit_and_never_allocate)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
