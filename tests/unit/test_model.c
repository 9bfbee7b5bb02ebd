/* SPDX-License-Identifier: BSD-3-Clause */
/* Creation and inspection of models: refusals, struct sizes, shapes with closed forms, and an
 * allocator that fails. */
#include "shcd/shcd.h"
#include "support/bodies.h"
#include "support/check.h"
#include "support/some_modes.h"

#define PI BODIES_PI

/* ---- refusals ---- */

typedef struct definition {
    shcd_model_def def;
    shcd_fit_record fit;
    double coefficients[48]; /* degree 3 */
} definition;

static void definition_init(definition *d) {
    const shcd_model_def empty = SHCD_MODEL_DEF_INIT;
    memset(d, 0, sizeof *d);
    d->def = empty;
    d->def.degree = 3;
    d->def.coefficients = d->coefficients;
    bodies_ellipsoid_coefficients(1.0, 0.9, 1.1, d->coefficients);
}

static void assert_refused(const shcd_model_def *def, shcd_status status, const char *text) {
    shcd_error error = {SHCD_OK, ""};
    shcd_model *const untouched = (shcd_model *)(void *)&error;
    shcd_model *model = untouched;
    assert_int_equal(shcd_model_create(def, NULL, &model, &error), status);
    assert_ptr_equal(model, untouched);
    assert_int_equal(error.status, status);
    if (strstr(error.message, text) == NULL) {
        fail_msg("\"%s\" does not say \"%s\"", error.message, text);
    }
    assert_int_equal(shcd_model_create(def, NULL, &model, NULL), status);
    assert_ptr_equal(model, untouched);
}

static void test_create_refuses_missing_pieces(void **state) {
    definition d;
    shcd_error error = {SHCD_OK, ""};
    (void)state;
    definition_init(&d);
    assert_int_equal(shcd_model_create(&d.def, NULL, NULL, &error), SHCD_ERR_ARGUMENT);
    assert_true(error.status == SHCD_ERR_ARGUMENT && error.message[0] != '\0');
    assert_refused(NULL, SHCD_ERR_ARGUMENT, "definition");
    d.def.coefficients = NULL;
    assert_refused(&d.def, SHCD_ERR_ARGUMENT, "coefficients");
    definition_init(&d);
    for (size_t size = 0; size < sizeof size; size++) {
        d.def.struct_size = size;
        assert_refused(&d.def, SHCD_ERR_ARGUMENT, "struct_size");
    }
    d.def.struct_size = offsetof(shcd_model_def, coefficients); /* cut off before them */
    assert_refused(&d.def, SHCD_ERR_ARGUMENT, "coefficients");
}

static void test_create_reads_no_more_than_an_older_header_has(void **state) {
    definition d;
    shcd_model *model = NULL;
    (void)state;
    definition_init(&d);
    d.def.struct_size = offsetof(shcd_model_def, fit);
    d.def.fit = (const shcd_fit_record *)(const void *)1; /* beyond the caller's structure */
    assert_int_equal(shcd_model_create(&d.def, NULL, &model, NULL), SHCD_OK);
    assert_int_equal(bodies_info(model).fit.n_triangles, 0);
    shcd_model_free(model);
}

static void test_create_refuses_degrees_out_of_range(void **state) {
    static const int bad[5] = {0, -1, SHCD_DEGREE_MAX + 1, INT32_MAX, INT32_MIN};
    definition d;
    (void)state;
    for (int i = 0; i < 5; i++) {
        char text[64];
        definition_init(&d);
        d.def.degree = bad[i];
        snprintf(text, sizeof text, "degree %d", bad[i]);
        assert_refused(&d.def, SHCD_ERR_ARGUMENT, text);
    }
}

static void test_create_names_the_number_that_is_not_finite(void **state) {
    static const double bad[3] = {NAN, INFINITY, -INFINITY};
    definition d;
    (void)state;
    for (int i = 0; i < 3; i++) {
        definition_init(&d);
        d.coefficients[3 * SHCD_INDEX(3, -2) + 1] = bad[i];
        assert_refused(&d.def, SHCD_ERR_NOT_FINITE, "(l=3, m=-2) of y");
        /* what could be saved but not loaded again must not get in either */
        definition_init(&d);
        d.fit.n_triangles = 12;
        d.fit.local_thickness_m = bad[i];
        d.def.fit = &d.fit;
        assert_refused(&d.def, SHCD_ERR_NOT_FINITE, "fit");
    }
}

static void test_create_refuses_shapes_that_are_no_bodies(void **state) {
    definition d;
    (void)state;
    definition_init(&d);
    memset(d.coefficients, 0, sizeof d.coefficients);
    assert_refused(&d.def, SHCD_ERR_GEOMETRY, "diagonal");
    d.coefficients[0] = 3.0; /* a point */
    assert_refused(&d.def, SHCD_ERR_GEOMETRY, "diagonal");
    definition_init(&d);
    d.coefficients[3 * SHCD_INDEX(1, 0) + 2] = 0.0; /* a disc, twice covered */
    assert_refused(&d.def, SHCD_ERR_GEOMETRY, "no volume");
    definition_init(&d);
    d.coefficients[3 * SHCD_INDEX(1, -1) + 1] *= -1.0; /* mirrored */
    assert_refused(&d.def, SHCD_ERR_GEOMETRY, "inside out");
    for (int i = 0; i < 3; i++) {
        static const double scale[3] = {2e-10, 3e8, 1e11};
        definition_init(&d);
        for (size_t k = 0; k < 48; k++) {
            d.coefficients[k] *= scale[i];
        }
        assert_refused(&d.def, SHCD_ERR_GEOMETRY,
                       i == 0   ? "not in 1e-9"
                       : i == 1 ? "not in 1e-9"
                                : "a coefficient of size");
    }
}

/* ---- struct sizes ---- */

static void test_create_accepts_a_definition_from_a_newer_header(void **state) {
    struct {
        definition d;
        unsigned char later[64];
    } newer;
    shcd_model *model = NULL;
    (void)state;
    memset(&newer, 0xff, sizeof newer);
    definition_init(&newer.d);
    newer.d.def.struct_size = sizeof newer.d.def + 64;
    assert_int_equal(shcd_model_create(&newer.d.def, NULL, &model, NULL), SHCD_OK);
    newer.d.coefficients[5] = 4.0; /* the model has its own copy */
    assert_int_equal(shcd_model_degree(model), 3);
    assert_true(shcd_model_coefficients(model)[5] == 0.0);
    shcd_model_free(model);
}

static void test_describe_fills_what_the_caller_has_room_for(void **state) {
    shcd_model *model = bodies_create_ellipsoid(1.0, 2.0, 3.0);
    const shcd_model_info whole = bodies_info(model);
    union {
        shcd_model_info info;
        unsigned char bytes[sizeof(shcd_model_info) + 32];
    } u;
    (void)state;
    assert_true(whole.struct_size == sizeof whole);
    for (size_t size = sizeof(size_t); size <= sizeof u; size += 4) {
        const size_t known = size < sizeof whole ? size : sizeof whole;
        memset(&u, 0xa5, sizeof u);
        u.info.struct_size = size;
        assert_int_equal(shcd_model_describe(model, &u.info), SHCD_OK);
        assert_true(u.info.struct_size == size);
        assert_memory_equal(u.bytes + sizeof size, (const unsigned char *)&whole + sizeof size,
                            known - sizeof size);
        for (size_t i = known; i < sizeof u; i++) {
            assert_int_equal(u.bytes[i], 0xa5);
        }
    }
    u.info.struct_size = 0;
    assert_int_equal(shcd_model_describe(model, &u.info), SHCD_ERR_ARGUMENT);
    u.info.struct_size = sizeof(size_t) - 1;
    assert_int_equal(shcd_model_describe(model, &u.info), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_model_describe(model, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_model_describe(NULL, &u.info), SHCD_ERR_ARGUMENT);
    shcd_model_free(model);
}

static void test_functions_of_no_model_are_harmless(void **state) {
    (void)state;
    shcd_model_free(NULL);
    assert_int_equal(shcd_model_degree(NULL), -1);
    assert_null(shcd_model_coefficients(NULL));
    assert_int_equal(shcd_model_write_size(NULL), 0);
}

/* ---- shapes ---- */

/* Area of an ellipsoid with half axes a, b, c by quadrature of |S_theta x S_phi|. */
static double ellipsoid_area(double a, double b, double c) {
    enum { N = 200 };
    double z[N], weight[N], area = 0.0;
    bodies_gauss_legendre(N, z, weight);
    for (int j = 0; j < N; j++) {
        for (int k = 0; k < N; k++) {
            const double phi = 2.0 * PI * k / N, s2 = 1.0 - z[j] * z[j];
            const double x = cos(phi) * b * c, y = sin(phi) * a * c, w = a * b;
            area += weight[j] * (2.0 * PI / N) * sqrt(s2 * (x * x + y * y) + z[j] * z[j] * w * w);
        }
    }
    return area;
}

static void test_ellipsoids_have_their_closed_forms(void **state) {
    static const double axes[5][3] = {{1.0, 1.0, 1.0},
                                      {1.0, 2.0, 3.0},
                                      {0.03, 0.02, 0.05},
                                      {5e-10, 7e-10, 6e-10},
                                      {2e8, 1e8, 3e8}};
    (void)state;
    for (int i = 0; i < 5; i++) {
        const double a = axes[i][0], b = axes[i][1], c = axes[i][2];
        const double longest = fmax(a, fmax(b, c)), shortest = fmin(a, fmin(b, c));
        shcd_model *model = bodies_create_ellipsoid(a, b, c);
        const shcd_model_info info = bodies_info(model);
        const double d = info.max_deviation_m, area = ellipsoid_area(a, b, c);
        /* The tessellation P is inscribed and convex, the body K lies within d of it: K - P fits
         * into a shell of thickness d on K, and K into P + d B (Steiner's formula, the mean
         * curvature of P is at most that of a ball of the longest half axis). */
        assert_near(info.volume_m3, 4.0 / 3.0 * PI * a * b * c, d * area);
        assert_true(info.volume_m3 <= 4.0 / 3.0 * PI * a * b * c);
        assert_near(info.area_m2, area, 8.0 * PI * d * longest + 4.0 * PI * d * d);
        assert_true(info.area_m2 <= area);
        /* S is evaluated at the ends of the axes themselves */
        assert_near(info.box_max_m.x, a, 4e-16 * longest);
        assert_near(info.box_max_m.y, b, 4e-16 * longest);
        assert_near(info.box_min_m.z, -c, 4e-16 * longest);
        assert_near(info.diagonal_m, 2.0 * sqrt(a * a + b * b + c * c), 4e-15 * longest);
        assert_true(info.radius_m >= longest);
        /* the iteration comes within 1/sqrt(400) of the smallest ball */
        assert_at_most(info.radius_m, longest * 1.05 + d);
        assert_int_equal(info.is_embedded, 1);
        assert_int_equal(info.is_star_shaped, 1);
        /* the widest kernel point is the centre; tau log n = 1e-4 diag log(1026) = 7e-4 diag of the
         * soft minimum, and the sampled normals */
        assert_near(info.star_margin_m, shortest, 7e-4 * info.diagonal_m);
        assert_true(info.max_first_derivative_m >= longest);
        assert_true(info.max_second_derivative_m >= longest);
        assert_int_equal(info.map_crossings_max, 1);
        assert_true(info.map_one_crossing_share == 1.0);
        assert_true(info.run_time_bytes > info.n_leaves * 32);
        shcd_model_free(model);
    }
}

static void test_bent_bodies_keep_their_volume_and_lose_their_kernel(void **state) {
    static const double bend[4] = {0.1, 0.4, 3.0, 4.0};
    (void)state;
    for (int i = 0; i < 4; i++) {
        shcd_model *model = bodies_create_bent(0.5, 0.6, 1.2, bend[i]);
        const shcd_model_info info = bodies_info(model);
        /* |V - V'| of two closed surfaces that map to each other within d is at most d times the
         * area swept between them, itself at most (sqrt(A) + sqrt(A'))^2/2 and a term in d^2 */
        assert_near(info.volume_m3, 4.0 / 3.0 * PI * 0.5 * 0.6 * 1.2,
                    2.2 * info.max_deviation_m * info.area_m2);
        assert_int_equal(info.is_embedded, 1); /* the image of a ball under a diffeomorphism */
        /* By symmetry and since a kernel is convex it holds a point (x, 0, 0) of the body, if any.
         * Halfway to the tip (bend, 0, c) the body ends at bend/4 + a sqrt(3/4), the segment is
         * at bend/2 + x/2 >= bend/2 - a/2: none if bend > 5.47 a = 2.73. Nearly straight bodies
         * are convex. */
        assert_int_equal(info.is_star_shaped, bend[i] < 1.0);
        assert_true((info.star_margin_m > 0.0) == (bend[i] < 1.0));
        shcd_model_free(model);
    }
}

/* A tube along the curve (z^2, 0.7 z - z^3), which crosses itself at z = +-sqrt(0.7). */
static shcd_vec3 looped(shcd_vec3 w, const double *p) {
    return shcd_vec3_make(p[0] * w.x + w.z * w.z, p[0] * w.y, 0.7 * w.z - w.z * w.z * w.z);
}

/* An ellipsoid pinched beyond its middle by its degree 3: (x, y, z) -> (x, y) (1 - p z), with p
 * above 1 turned through itself behind z = 1/p; bent, so that no symmetry keeps sheets apart. */
static shcd_vec3 pinched(shcd_vec3 w, const double *p) {
    const double r = 1.0 - p[0] * w.z;
    return shcd_vec3_make(w.x * r + 0.1 * w.z * w.z, w.y * r, 2.0 * w.z);
}

static void test_self_intersection_is_seen(void **state) {
    const double thin = 0.15, pinch = 1.6;
    double coefficients[48];
    (void)state;
    bodies_project(3, looped, &thin, coefficients);
    shcd_model *model = bodies_create(3, coefficients);
    assert_int_equal(bodies_info(model).is_embedded, 0);
    assert_int_equal(bodies_info(model).is_star_shaped, 0);
    shcd_model_free(model);
    bodies_project(3, pinched, &pinch, coefficients);
    model = bodies_create(3, coefficients);
    assert_int_equal(bodies_info(model).is_star_shaped, 0);
    shcd_model_free(model);
}

static void test_creation_repeats_bit_by_bit(void **state) {
    (void)state;
    check_random one = {61}, two = {61};
    shcd_model *a = bodies_create_random(&one, 6, 0.1), *b = bodies_create_random(&two, 6, 0.1);
    const shcd_model_info x = bodies_info(a), y = bodies_info(b);
    assert_memory_equal(&x, &y, sizeof x);
    shcd_model_free(a);
    shcd_model_free(b);
}

/* ---- memory ---- */

typedef struct ledger {
    size_t calls, fail_at; /* 0: never */
    size_t live;
} ledger;

static void *ledger_allocate(size_t size, void *user) {
    ledger *l = user;
    l->calls++;
    if (l->calls == l->fail_at) {
        return NULL;
    }
    void *memory = malloc(size);
    if (memory != NULL) {
        memset(memory, 0xcd, size); /* nothing may be assumed of it */
        l->live++;
    }
    return memory;
}

static void ledger_release(void *memory, void *user) {
    ledger *l = user;
    assert_non_null(memory);
    l->live--;
    free(memory);
}

static void test_each_failing_allocation_is_survived(void **state) {
    definition d;
    unsigned char bytes[4096];
    double numbers[SOME_MODES_SIZE(3, 4)];
    const shcd_modes modes = some_modes(3, 4, numbers);
    size_t size = 0;
    (void)state;
    definition_init(&d);
    d.def.modes = &modes;
    for (int reads = 0; reads < 2; reads++) {
        size_t failures = 0;
        for (size_t k = 1;; k++) {
            ledger l = {0, k, 0};
            const shcd_allocator memory = {ledger_allocate, ledger_release, &l};
            shcd_model *const untouched = (shcd_model *)(void *)&l;
            shcd_model *model = untouched;
            shcd_error error = {SHCD_OK, ""};
            const shcd_status status = reads ? shcd_model_read(bytes, size, &memory, &model, &error)
                                             : shcd_model_create(&d.def, &memory, &model, &error);
            if (status == SHCD_OK) {
                assert_true(l.calls < k);
                if (!reads) {
                    size = shcd_model_write_size(model);
                    assert_int_equal(shcd_model_write(model, bytes, sizeof bytes), SHCD_OK);
                }
                shcd_model_free(model);
                assert_int_equal(l.live, 0);
                break;
            }
            assert_int_equal(status, SHCD_ERR_MEMORY);
            assert_int_equal(error.status, SHCD_ERR_MEMORY);
            assert_non_null(strstr(error.message, "memory"));
            assert_ptr_equal(model, untouched);
            assert_int_equal(l.live, 0);
            failures++;
        }
        print_message("%s: %zu allocations\n", reads ? "read" : "create", failures);
        assert_true(failures > 10);
    }
}

static void test_memory_does_not_change_the_model(void **state) {
    /* 0xcd everywhere against what malloc happens to hold */
    definition d;
    ledger l = {0, 0, 0};
    const shcd_allocator memory = {ledger_allocate, ledger_release, &l};
    shcd_model *a = NULL, *b = NULL;
    (void)state;
    definition_init(&d);
    d.coefficients[3 * SHCD_INDEX(2, 1) + 2] = 0.3;
    assert_int_equal(shcd_model_create(&d.def, &memory, &a, NULL), SHCD_OK);
    assert_int_equal(shcd_model_create(&d.def, NULL, &b, NULL), SHCD_OK);
    const shcd_model_info x = bodies_info(a), y = bodies_info(b);
    assert_memory_equal(&x, &y, sizeof x);
    shcd_model_free(a);
    shcd_model_free(b);
    assert_int_equal(l.live, 0);
}

/* An argument is a pattern of tests: under valgrind all would take minutes. */
int main(int argc, char **argv) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_create_refuses_missing_pieces),
        cmocka_unit_test(test_create_reads_no_more_than_an_older_header_has),
        cmocka_unit_test(test_create_refuses_degrees_out_of_range),
        cmocka_unit_test(test_create_names_the_number_that_is_not_finite),
        cmocka_unit_test(test_create_refuses_shapes_that_are_no_bodies),
        cmocka_unit_test(test_create_accepts_a_definition_from_a_newer_header),
        cmocka_unit_test(test_describe_fills_what_the_caller_has_room_for),
        cmocka_unit_test(test_functions_of_no_model_are_harmless),
        cmocka_unit_test(test_ellipsoids_have_their_closed_forms),
        cmocka_unit_test(test_bent_bodies_keep_their_volume_and_lose_their_kernel),
        cmocka_unit_test(test_self_intersection_is_seen),
        cmocka_unit_test(test_creation_repeats_bit_by_bit),
        cmocka_unit_test(test_each_failing_allocation_is_survived),
        cmocka_unit_test(test_memory_does_not_change_the_model)};
    if (argc > 1) {
        cmocka_set_test_filter(argv[1]);
    }
    return cmocka_run_group_tests(tests, NULL, NULL);
}
