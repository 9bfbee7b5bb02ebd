/* SPDX-License-Identifier: BSD-3-Clause */
/* Certified closest points on deformed bodies against brute force on the current surface: a body
 * read from a .shcd file, or with `random` bodies of random coefficients.
 *
 * Each body is deformed by displacements of several spectra up to a sampled sup |d| of 10 % of the
 * diagonal; each shape is queried at points within 10 % of the diagonal of its surface, among them
 * focal points and points where two feet are equally far. What brute force finds is the distance of
 * a point of the surface, hence an upper bound of the truth: `lower` may never exceed it, nor may
 * it be nearer than `upper` less the tolerance. */
#include "property/usual.h"
#include "shcd/shape.h"
#include "support/bodies.h"
#include "support/brute.h"

#define SEED 20261122u
#define TOLERANCE 1e-9
#define AMPLITUDE 0.1 /* [diagonals] of displacements and of points' distances */
#define DEFORMATIONS 64
#define POINTS 50
#define RANDOM_BODIES_MIN 4 /* however few deformations there are, as long as there are so many */
#define PER_RANDOM_BODY_MAX 16 /* deformations */
#define CHECKED_DIRECTIONS 400
#define DENSE 96
#define COARSE 40

enum place { PLACE_NEAR, PLACE_FOCAL, PLACE_MEDIAL, PLACES };

typedef struct tally {
    size_t n[PLACES], truncated[PLACES], unsure[PLACES];
    size_t beaten, signs_checked, inflated;
    double worst_below, worst_above; /* brute force against the interval's ends, of the scale */
    double evaluations, patches;
    uint32_t evaluations_max, patches_max;
} tally;

typedef struct body {
    const char *name;
    shcd_model *model;
    shcd_model_info info;
    shcd_shape *shape;
    size_t n; /* coefficients, with their three coordinates */
    size_t n_shapes, n_bodies;
    double *current, *change;
    brute *dense, *coarse;
    double dense_deviation, coarse_deviation;
    check_random random;
    tally tally;
} body;

/* ---- deformations ---- */

static void add_degrees(body *b, int from, int to, double fall) {
    for (int l = from; l <= to; l++) {
        for (size_t i = 3 * SHCD_INDEX(l, -l); i < 3 * SHCD_INDEX(l, l) + 3; i++) {
            b->change[i] += check_normal(&b->random) * pow(l + 1.0, -fall);
        }
    }
}

/* S -> t + (1 + e) R S, R a turn by an angle of order 0.1. */
static void add_motion(body *b) {
    const double *rest = shcd_model_coefficients(b->model);
    const shcd_vec3 axis = bodies_random_direction(&b->random);
    const double half = check_uniform(&b->random, 0.01, 0.1);
    const double grow = 1.0 + check_uniform(&b->random, -0.02, 0.02);
    const shcd_quat q = {cos(half), sin(half) * axis.x, sin(half) * axis.y, sin(half) * axis.z};
    for (size_t i = 0; i < b->n; i += 3) {
        const shcd_vec3 c = {rest[i], rest[i + 1], rest[i + 2]};
        const shcd_vec3 d = shcd_sub(shcd_scale(grow, shcd_rotate(q, c)), c);
        b->change[i] += d.x;
        b->change[i + 1] += d.y;
        b->change[i + 2] += d.z;
    }
    for (size_t k = 0; k < 3; k++) {
        b->change[k] += 0.1 * b->info.diagonal_m * check_normal(&b->random);
    }
}

/* Largest |d| at random directions. */
static double size_of_change(body *b) {
    double y[SHCD_COUNT(20)], largest = 0.0;
    const int degree = shcd_model_degree(b->model);
    assert_true(degree <= 20);
    for (int k = 0; k < CHECKED_DIRECTIONS; k++) {
        shcd_vec3 d = {0.0, 0.0, 0.0};
        const shcd_vec3 w = bodies_random_direction(&b->random);
        assert_int_equal(shcd_harmonics(degree, w, y, NULL, NULL), SHCD_OK);
        for (size_t i = 0; i < b->n; i += 3) {
            d = shcd_mul_add(d, y[i / 3],
                             shcd_vec3_make(b->change[i], b->change[i + 1], b->change[i + 2]));
        }
        largest = fmax(largest, shcd_norm(d));
    }
    return largest;
}

static void make_change(body *b, double amplitude) {
    const int degree = shcd_model_degree(b->model);
    const int one = 1 + (int)check_uniform(&b->random, 0.5 * degree, (double)degree);
    memset(b->change, 0, b->n * sizeof *b->change);
    switch ((int)check_uniform(&b->random, 0.0, 5.0)) {
    case 0:
        add_degrees(b, 0, degree < 3 ? degree : 3, 0.0);
        break;
    case 1:
        add_degrees(b, 0, degree, 0.0);
        break;
    case 2:
        add_degrees(b, 0, degree, 2.0);
        break;
    case 3:
        add_degrees(b, one > degree ? degree : one, one > degree ? degree : one, 0.0);
        break;
    default:
        add_motion(b);
        break;
    }
    const double scale = amplitude * b->info.diagonal_m / size_of_change(b);
    for (size_t i = 0; i < b->n; i++) {
        b->change[i] *= scale;
    }
}

static void set_shape(body *b, double amplitude, int from_rest, int follow) {
    make_change(b, amplitude);
    const double *from = from_rest ? shcd_model_coefficients(b->model) : b->current;
    for (size_t i = 0; i < b->n; i++) {
        b->current[i] = from[i] + b->change[i];
    }
    assert_int_equal(shcd_shape_set(b->model, b->shape, b->current, follow), SHCD_OK);
}

/* Small ones inflate the rest shape, or one that was refreshed far from it; large ones refresh or
 * leave it to AUTO. */
static void deform(body *b) {
    const double large = check_uniform(&b->random, 0.0, 1.0) < 0.4
                             ? AMPLITUDE
                             : AMPLITUDE * pow(10.0, check_uniform(&b->random, -3.0, 0.0));
    const double small = AMPLITUDE * pow(10.0, check_uniform(&b->random, -4.0, -2.0));
    switch (b->n_shapes++ % 5) {
    case 0:
        assert_int_equal(shcd_shape_init(b->model, b->shape, shcd_shape_size(b->model), &b->shape),
                         SHCD_OK);
        set_shape(b, small, 1, SHCD_FOLLOW_INFLATE);
        break;
    case 1:
        set_shape(b, large, 1, SHCD_FOLLOW_REFRESH);
        set_shape(b, small, 0, SHCD_FOLLOW_INFLATE);
        break;
    case 2:
        set_shape(b, large, 1, SHCD_FOLLOW_AUTO);
        set_shape(b, small, 0, SHCD_FOLLOW_AUTO);
        break;
    case 3:
        set_shape(b, large, 1, SHCD_FOLLOW_AUTO);
        break;
    default:
        set_shape(b, large, 1, SHCD_FOLLOW_REFRESH);
        break;
    }
    shcd_shape_info info = SHCD_SHAPE_INFO_INIT;
    assert_int_equal(shcd_shape_describe(b->model, b->shape, &info), SHCD_OK);
    b->tally.inflated += info.inflation_m > 0.0;
    brute_free(b->dense);
    brute_free(b->coarse);
    b->dense = brute_create_shape(b->model, b->shape, DENSE);
    b->coarse = brute_create_shape(b->model, b->shape, COARSE);
    assert_non_null(b->dense);
    assert_non_null(b->coarse);
    /* sampled, so doubled */
    b->dense_deviation = 2.0 * brute_deviation(b->dense);
    b->coarse_deviation = 2.0 * brute_deviation(b->coarse);
}

/* ---- points ---- */

static void surface_at(const body *b, shcd_vec3 w, shcd_vec3 *s, shcd_vec3 *n) {
    assert_int_equal(shcd_shape_surface(b->model, b->shape, w, s, n, NULL), SHCD_OK);
}

/* The principal curvature of larger size at w, positive where the surface is convex, by differences
 * of points and normals. */
static double curvature_at(const body *b, shcd_vec3 w, check_random *random) {
    const double h = 1e-4;
    const shcd_vec3 t1 = shcd_unit(shcd_cross(w, bodies_random_direction(random)));
    const shcd_vec3 t[2] = {t1, shcd_cross(w, t1)};
    shcd_vec3 ds[2], dn[2];
    for (int k = 0; k < 2; k++) {
        shcd_vec3 s[2], n[2];
        surface_at(b, shcd_mul_add(w, h, t[k]), &s[0], &n[0]);
        surface_at(b, shcd_mul_add(w, -h, t[k]), &s[1], &n[1]);
        ds[k] = shcd_sub(s[0], s[1]);
        dn[k] = shcd_sub(n[0], n[1]);
    }
    const double e = shcd_dot(ds[0], ds[0]), f = shcd_dot(ds[0], ds[1]), g = shcd_dot(ds[1], ds[1]);
    const double l = shcd_dot(ds[0], dn[0]), m = shcd_dot(ds[0], dn[1]), n = shcd_dot(ds[1], dn[1]);
    const double area2 = e * g - f * f;
    const double mean = 0.5 * (e * n + g * l - 2.0 * f * m) / area2;
    const double gauss = (l * n - m * m) / area2;
    const double root = sqrt(fmax(0.0, mean * mean - gauss));
    return mean < 0.0 ? mean - root : mean + root;
}

/* Where the way along the normal ceases to be the shortest. A query may choose points; brute force
 * judges them. */
static double medial_offset(const body *b, shcd_vec3 s, shcd_vec3 n) {
    double near = 0.0, far = AMPLITUDE * b->info.diagonal_m;
    for (int i = 0; i < 40; i++) {
        const double t = 0.5 * (near + far);
        shcd_proximity out;
        assert_int_equal(shcd_shape_closest(b->model, b->shape, shcd_mul_add(s, t, n), NULL, &out),
                         SHCD_OK);
        if (t - fabs(out.distance_m) <= 1e-9 * b->info.diagonal_m) {
            near = t;
        } else {
            far = t;
        }
    }
    return near;
}

static shcd_vec3 make_point(body *b, enum place *place, double *offset) {
    static const double beside[] = {0.0, 1e-3, -1e-3, 1e-6, -1e-6};
    check_random *r = &b->random;
    const double kind = check_uniform(r, 0.0, 1.0), limit = AMPLITUDE * b->info.diagonal_m;
    const double factor = 1.0 + beside[(int)check_uniform(r, 0.0, 5.0)];
    const shcd_vec3 w = bodies_random_direction(r);
    shcd_vec3 s, n;
    surface_at(b, w, &s, &n);
    *place = PLACE_NEAR;
    *offset = check_uniform(r, -limit, limit);
    if (kind < 0.1) {
        const double radius = -1.0 / curvature_at(b, w, r);
        if (fabs(radius) < limit) {
            *place = PLACE_FOCAL;
            *offset = radius * factor;
        }
    } else if (kind < 0.2) {
        const double side = check_uniform(r, 0.0, 1.0) < 0.8 ? -1.0 : 1.0;
        *place = PLACE_MEDIAL;
        *offset = side * medial_offset(b, s, shcd_scale(side, n)) * factor;
    } else if (kind < 0.3) {
        *offset *= pow(10.0, check_uniform(r, -8.0, -1.0));
    }
    return shcd_mul_add(s, *offset, n);
}

/* ---- checks ---- */

/* Far from the flat triangles their winding number decides; near them the side of the foot, if the
 * point was made from it. 0: not known. */
static int sign_of(const body *b, shcd_vec3 p, double offset, double distance) {
    if (distance > b->coarse_deviation) {
        return brute_winding(b->coarse, p) > 0.5 ? -1 : 1;
    }
    if (distance > b->dense_deviation) {
        return brute_winding(b->dense, p) > 0.5 ? -1 : 1;
    }
    if (fabs(fabs(offset) - distance) <= TOLERANCE * b->info.diagonal_m) {
        return offset < 0.0 ? -1 : 1;
    }
    return 0;
}

static void fail_at(const body *b, const char *what, shcd_vec3 p, const shcd_proximity *got,
                    double found) {
    const tally *t = &b->tally;
    fail_msg("%s: %s at (%.17g, %.17g, %.17g), case %zu: distance %.17g in [%.17g, %.17g], brute "
             "force %.17g, flags %u",
             b->name, what, p.x, p.y, p.z, t->n[0] + t->n[1] + t->n[2], got->distance_m,
             got->lower_m, got->upper_m, found, got->flags);
}

/* The fast tier's interval is wider, but no less true. */
static void check_fast(const body *b, shcd_vec3 p, double found, double lower) {
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    shcd_proximity got;
    options.tier = SHCD_TIER_FAST;
    assert_int_equal(shcd_shape_closest(b->model, b->shape, p, &options, &got), SHCD_OK);
    const double low = (got.flags & SHCD_PROXIMITY_SIGN_UNSURE) != 0
                           ? 0.0
                           : fmin(fabs(got.lower_m), fabs(got.upper_m));
    if (low > found || fmax(fabs(got.lower_m), fabs(got.upper_m)) < lower) {
        fail_at(b, "fast tier: wrong interval", p, &got, found);
    }
}

static void check_point(body *b, shcd_vec3 p, enum place place, double offset, int check_sign) {
    tally *t = &b->tally;
    shcd_proximity got;
    shcd_vec3 at, w;
    assert_int_equal(shcd_shape_closest(b->model, b->shape, p, NULL, &got), SHCD_OK);
    const double distance = fabs(got.distance_m), scale = fmax(b->info.diagonal_m, distance);
    const int truncated = (got.flags & SHCD_PROXIMITY_TRUNCATED) != 0;
    const int unsure = (got.flags & SHCD_PROXIMITY_SIGN_UNSURE) != 0;
    const double upper = fmax(fabs(got.lower_m), fabs(got.upper_m));
    const double lower = unsure ? 0.0 : fmin(fabs(got.lower_m), fabs(got.upper_m));

    /* the answer is a point of the current surface, up to the quarter of the tolerance by which its
     * last step may be off without another evaluation (newton.c); that point is an upper bound */
    surface_at(b, got.parameter, &at, NULL);
    const double reached = shcd_norm(shcd_sub(at, p)), rounding = 1e-13 * scale;
    if (shcd_norm(shcd_sub(at, got.point_m)) > 0.25 * TOLERANCE * scale + rounding ||
        fabs(shcd_norm(shcd_sub(got.point_m, p)) - distance) > rounding || reached > upper ||
        !(got.lower_m <= got.distance_m && got.distance_m <= got.upper_m) ||
        (!unsure && got.lower_m < 0.0 && got.upper_m > 0.0)) {
        fail_at(b, "answer contradicts itself", p, &got, reached);
    }
    const double found = brute_distance(b->dense, p, &w);
    if (lower > found) {
        fail_at(b, "lower is above the truth", p, &got, found);
    }
    if (!truncated && upper - found > TOLERANCE * scale) {
        fail_at(b, "upper is above the truth by more than the tolerance", p, &got, found);
    }
    if (!truncated && !unsure && !(got.upper_m - got.lower_m <= TOLERANCE * scale)) {
        fail_at(b, "interval is too wide", p, &got, found);
    }
    check_fast(b, p, found, lower);
    t->worst_below = fmax(t->worst_below, unsure ? -1.0 : (lower - found) / scale);
    t->worst_above = fmax(t->worst_above, truncated ? 0.0 : (upper - found) / scale);
    t->beaten += found - distance > TOLERANCE * scale;

    if (check_sign && !unsure && distance > TOLERANCE * scale) {
        const int sign = sign_of(b, p, offset, distance);
        if (sign != 0 && (got.distance_m < 0.0) != (sign < 0)) {
            fail_at(b, "wrong sign", p, &got, found);
        }
        t->signs_checked += sign != 0;
    }
    t->n[place]++;
    t->truncated[place] += (size_t)truncated;
    t->unsure[place] += (size_t)unsure;
    t->evaluations += got.n_evaluations;
    t->patches += got.n_patches;
    t->evaluations_max =
        got.n_evaluations > t->evaluations_max ? got.n_evaluations : t->evaluations_max;
    t->patches_max = got.n_patches > t->patches_max ? got.n_patches : t->patches_max;
}

static void body_open(body *b, shcd_model *model) {
    b->model = model;
    b->info = bodies_info(model);
    b->n = 3 * SHCD_COUNT(b->info.degree);
    b->current = malloc(2 * b->n * sizeof *b->current);
    void *memory = aligned_alloc(16, (shcd_shape_size(model) + 15) / 16 * 16);
    assert_true(b->current != NULL && memory != NULL);
    b->change = b->current + b->n;
    memcpy(b->current, shcd_model_coefficients(model), b->n * sizeof *b->current);
    assert_int_equal(shcd_shape_init(model, memory, shcd_shape_size(model), &b->shape), SHCD_OK);
}

static void body_close(body *b) {
    brute_free(b->dense);
    brute_free(b->coarse);
    b->dense = b->coarse = NULL;
    free(b->current);
    free(b->shape);
    shcd_model_free(b->model);
}

static void check_deformations(body *b, size_t n) {
    for (size_t i = 0; i < n; i++) {
        deform(b);
        for (int k = 0; k < POINTS; k++) {
            double offset;
            enum place place;
            const shcd_vec3 p = make_point(b, &place, &offset);
            check_point(b, p, place, offset, k % 4 == 0);
        }
    }
}

static void report(const body *b) {
    const tally *t = &b->tally;
    const size_t n = t->n[0] + t->n[1] + t->n[2];
    print_message(
        "%s: %zu points (seed %u): near %zu, focal %zu, medial %zu; truncated %zu %zu %zu, "
        "sign unsure %zu %zu %zu, signs checked %zu, inflated shapes %zu, brute force "
        "beaten %zu\n",
        b->name, n, SEED, t->n[0], t->n[1], t->n[2], t->truncated[0], t->truncated[1],
        t->truncated[2], t->unsure[0], t->unsure[1], t->unsure[2], t->signs_checked, t->inflated,
        t->beaten);
    print_message("%s: lower - brute <= %.2g, upper - brute <= %.2g of the scale; evaluations mean "
                  "%.1f max %u, patches mean %.0f max %u\n",
                  b->name, t->worst_below, t->worst_above, t->evaluations / (double)n,
                  t->evaluations_max, t->patches / (double)n, t->patches_max);
}

static void test_closest_on_deformed_shapes(void **state) {
    body b;
    const size_t n = check_scaled(DEFORMATIONS);
    memset(&b, 0, sizeof b);
    b.name = *(const char **)*state;
    b.random.state = SEED;
    if (strcmp(b.name, "random") == 0) {
        const size_t fair = n / RANDOM_BODIES_MIN > 1 ? n / RANDOM_BODIES_MIN : 1;
        const size_t each = fair < PER_RANDOM_BODY_MAX ? fair : PER_RANDOM_BODY_MAX;
        for (size_t i = 0; i < n; i += each) {
            const int degree = 1 + (int)check_uniform(&b.random, 0.0, 15.0);
            const double rough = check_uniform(&b.random, 0.0, 1.0) < 0.7 ? 0.05 : 0.3;
            body_open(&b, bodies_create_random(&b.random, degree, rough));
            check_deformations(&b, n - i < each ? n - i : each);
            body_close(&b);
            b.n_bodies++;
        }
    } else {
        shcd_model *model = NULL;
        shcd_error error = {SHCD_OK, ""};
        if (shcd_model_load(b.name, NULL, &model, &error) != SHCD_OK) {
            fail_msg("%s", error.message);
        }
        body_open(&b, model);
        check_deformations(&b, n);
        body_close(&b);
    }
    report(&b);
    const tally *t = &b.tally;
    const size_t total = t->n[0] + t->n[1] + t->n[2];
    /* caps are for focal points only, and rarely reached there */
    assert_int_equal(t->truncated[PLACE_NEAR], 0);
    assert_at_most((double)(t->truncated[PLACE_FOCAL] + t->truncated[PLACE_MEDIAL]),
                   0.002 * (double)total + 1.0);
    /* a quarter is looked at; of rough shapes that cut themselves half the signs are not sure */
    assert_true(t->signs_checked >= total / 16);
    assert_true(t->inflated > 0);
    if (strcmp(b.name, "random") == 0) {
        assert_true(n < RANDOM_BODIES_MIN || b.n_bodies >= RANDOM_BODIES_MIN);
    } else {
        usual_check(USUAL_DEFORMED, b.name, total, t->evaluations, t->patches);
    }
}

int main(int argc, char **argv) {
    if (argc != 2) {
        fprintf(stderr, "usage: test_deformed BODY.shcd|random\n");
        return 2;
    }
    const char *name = argv[1];
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_prestate(test_closest_on_deformed_shapes, &name),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
