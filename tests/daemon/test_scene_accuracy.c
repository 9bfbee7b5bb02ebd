/* SPDX-License-Identifier: BSD-3-Clause */
/* The key `accuracy` of a body: what follows from the cost table in its file, from that of another
 * machine, and from none; and what a refusal says. */
#include "cost_quick.h"
#include "scene_support.h"
#include "support/bodies.h"
#include "support/soft.h"

#define DEGREE 6
#define BODY_FILE "body.shcd"
#define SCENE(accuracy)                                                                            \
    "bodies:\n  - name: egg\n    model: " BODY_FILE "\n    accuracy: " accuracy "\n" SCENE_TOOLS
#define TWO_TOOLS                                                                                  \
    "tools: [{id: 0, name: probe, shape: point}, {id: 1, name: needle, shape: point}]\n"

static shcd_cost_row row_of(int degree, int tier, double error_m, double ns) {
    shcd_cost_row row;
    memset(&row, 0, sizeof row);
    row.degree = degree;
    row.tier = tier;
    row.map_resolution = tier == SHCD_TIER_MAP ? 16 : 0;
    row.error_max_m = error_m;
    row.ns_p50 = 0.5 * ns;
    row.ns_p99 = ns;
    row.evaluations_mean = 10.0;
    row.patches_mean = 320.0;
    return row;
}

/* A body with a table: degree 6 exact in 12 us, degree 3 fast in 3 us, degree 2 map in 0.2 us; and
 * a tracker of degree 4 that looks better than all of them. */
static void write_body(const char *machine, const shcd_fit_record *fit) {
    const shcd_cost_row rows[] = {
        row_of(DEGREE, SHCD_TIER_EXACT, 1e-6, 12000.0),
        row_of(DEGREE, SHCD_TIER_FAST, 5e-5, 8000.0), row_of(4, SHCD_TIER_TRACK, 1e-6, 100.0),
        row_of(3, SHCD_TIER_FAST, 4e-4, 3000.0), row_of(2, SHCD_TIER_MAP, 9e-3, 200.0)};
    double coefficients[3 * SHCD_COUNT(DEGREE)];
    char path[SCENE_PATH_SIZE];
    check_random random = {0xacc};
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    bodies_random_coefficients(&random, DEGREE, 0.02, coefficients);
    def.degree = DEGREE;
    def.coefficients = coefficients;
    def.fit = fit;
    def.cost_rows = machine != NULL ? rows : NULL;
    def.n_cost_rows = machine != NULL ? sizeof rows / sizeof rows[0] : 0;
    def.cost_machine = machine;
    assert_int_equal(shcd_model_create(&def, NULL, &model, &error), SHCD_OK);
    scene_path(BODY_FILE, path);
    assert_int_equal(shcd_model_save(model, path, NULL), SHCD_OK);
    shcd_model_free(model);
}

static void write_body_of_this_machine(const shcd_fit_record *fit) {
    char machine[SHCD_COST_MACHINE_SIZE];
    cost_quick_machine(machine);
    write_body(machine, fit);
}

static void expect_degree(const char *text, int degree, int source_degree, int has_map) {
    daemon_config config = scene_load_good(text);
    assert_int_equal(config.n_models, 1);
    assert_int_equal(shcd_model_degree(config.models[0]), degree);
    assert_int_equal(shcd_model_degree(config.sources[0]), source_degree);
    assert_int_equal(config.maps[0] != NULL, has_map);
    config_free(&config);
}

static void test_table_of_this_machine_decides(void **state) {
    (void)state;
    write_body_of_this_machine(NULL);
    expect_degree(SCENE("{tolerance_m: 1.0e-5}"), DEGREE, -1, 0);
    expect_degree(SCENE("{tolerance_m: 1.0e-3}"), 3, DEGREE, 0);
    expect_degree(SCENE("{budget_us: 5}"), 3, DEGREE, 0);
    expect_degree(SCENE("{tolerance_m: 0.01, budget_us: 1}"), 2, DEGREE, 1);
    expect_degree(SCENE("{budget_us: 20}"), DEGREE, -1, 0);
    expect_degree(SCENE("{tier: track}"), 4, DEGREE, 0);
    expect_degree(SCENE("{tier: map}"), 2, DEGREE, 1);
    expect_degree(SCENE("{tier: fast, tolerance_m: 1.0e-4}"), DEGREE, -1, 0);
    scene_remove(BODY_FILE);
}

/* What is chosen acts: the first coefficients are those of the whole body. */
static void test_lower_degree_is_the_series_cut_off(void **state) {
    (void)state;
    write_body_of_this_machine(NULL);
    daemon_config config = scene_load_good(SCENE("{budget_us: 5}"));
    assert_memory_equal(shcd_model_coefficients(config.models[0]),
                        shcd_model_coefficients(config.sources[0]),
                        3 * SHCD_COUNT(3) * sizeof(double));
    config_free(&config);
    scene_remove(BODY_FILE);
}

/* Bodies from one file share what was loaded, not what was cut off. */
static void test_bodies_of_one_file_may_differ_in_accuracy(void **state) {
    (void)state;
    write_body_of_this_machine(NULL);
    daemon_config config = scene_load_good(
        "bodies:\n"
        "  - {name: a, model: " BODY_FILE ", accuracy: {budget_us: 5}}\n"
        "  - {name: b, model: " BODY_FILE "}\n"
        "  - {name: c, model: " BODY_FILE ", accuracy: {tolerance_m: 1.0e-3}}\n" SCENE_TOOLS);
    assert_int_equal(shcd_model_degree(config.models[0]), 3);
    assert_int_equal(shcd_model_degree(config.models[1]), DEGREE);
    assert_int_equal(shcd_model_degree(config.models[2]), 3);
    assert_ptr_equal(config.sources[0], config.models[1]);
    assert_ptr_equal(config.sources[2], config.models[1]);
    assert_null(config.sources[1]);
    config_free(&config);
    scene_remove(BODY_FILE);
}

/* A body with modes, and a table by which degree 3 is faster. */
static void write_soft_body(void) {
    const shcd_cost_row rows[] = {row_of(DEGREE, SHCD_TIER_FAST, 5e-5, 8000.0),
                                  row_of(3, SHCD_TIER_FAST, 4e-4, 3000.0)};
    shcd_model *organ = soft_sphere(0.05, DEGREE), *model = NULL;
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    char machine[SHCD_COST_MACHINE_SIZE], path[SCENE_PATH_SIZE];
    cost_quick_machine(machine);
    def.degree = DEGREE;
    def.coefficients = shcd_model_coefficients(organ);
    def.modes = shcd_model_modes(organ);
    def.cost_rows = rows;
    def.n_cost_rows = sizeof rows / sizeof rows[0];
    def.cost_machine = machine;
    assert_int_equal(shcd_model_create(&def, NULL, &model, NULL), SHCD_OK);
    scene_path(BODY_FILE, path);
    assert_int_equal(shcd_model_save(model, path, NULL), SHCD_OK);
    shcd_model_free(model);
    shcd_model_free(organ);
}

/* A series that is cut off has no modes: a body that calls for them keeps its own degree. */
static void test_effects_that_the_model_carries_keep_its_degree(void **state) {
#define SOFT(accuracy)                                                                             \
    "bodies:\n  - name: egg\n    model: " BODY_FILE "\n    accuracy: " accuracy                    \
    "\n    effects: {wave: {modes: 16, youngs_modulus_pa: 5000}}\n" SCENE_TOOLS
    (void)state;
    write_soft_body();
    expect_degree(SCENE("{tolerance_m: 1.0e-3}"), 3, DEGREE, 0);
    expect_degree(SOFT("{tolerance_m: 1.0e-3}"), DEGREE, -1, 0);
    scene_expect_text_refused(SOFT("{budget_us: 5}"),
                              "4:15: bodies[0].accuracy: an answer in 5 us is not feasible: "
                              "nearest is 0.0503 mm in 8.04 us (degree 6, fast)");
    scene_remove(BODY_FILE);
}

static void test_infeasible_is_refused_with_the_nearest_pairs(void **state) {
    (void)state;
    write_body_of_this_machine(NULL);
    scene_expect_text_refused(SCENE("{tolerance_m: 1.0e-5, budget_us: 3.1}"),
                              "4:15: bodies[0].accuracy: 0.01 mm in 3.1 us is not feasible: "
                              "nearest are 0.01 mm in 12.1 us "
                              "(degree 6, exact) or 0.402 mm in 3.1 us (degree 3, fast)");
    /* each of two tools asks the body once in a tick */
    scene_expect_text_refused("bodies:\n  - name: egg\n    model: " BODY_FILE
                              "\n    accuracy: {budget_us: 0.3}\n" TWO_TOOLS,
                              "4:15: bodies[0].accuracy: an answer in 0.3 us is not feasible: "
                              "nearest is 9.05 mm in 0.402 "
                              "us (degree 2, map)");
    scene_remove(BODY_FILE);
}

static void test_against_mesh_adds_the_error_of_the_fit(void **state) {
    shcd_fit_record fit;
    (void)state;
    memset(&fit, 0, sizeof fit);
    fit.n_triangles = 8;
    fit.hausdorff_error_m = 1e-3;
    write_body_of_this_machine(&fit);
    expect_degree(SCENE("{tolerance_m: 1.3e-3}"), 3, DEGREE, 0);
    expect_degree(SCENE("{tolerance_m: 1.3e-3, against: surface}"), 3, DEGREE, 0);
    expect_degree(SCENE("{tolerance_m: 1.3e-3, against: mesh}"), DEGREE, -1, 0);
    scene_expect_text_refused(SCENE("{tolerance_m: 0.9e-3, against: mesh}"),
                              "4:15: bodies[0].accuracy: 0.9 mm is not feasible: nearest is 1.01 "
                              "mm in 12.1 us (degree 6, exact)");
    scene_remove(BODY_FILE);
}

/* What loading this scene says on stderr. */
static void load_and_listen(const char *text, char *said, size_t size) {
    FILE *file = tmpfile();
    assert_non_null(file);
    const int saved = dup(STDERR_FILENO);
    assert_true(fflush(stderr) == 0 && saved >= 0 && dup2(fileno(file), STDERR_FILENO) >= 0);
    daemon_config config = scene_load_good(text);
    assert_true(fflush(stderr) == 0 && dup2(saved, STDERR_FILENO) >= 0 && close(saved) == 0);
    config_free(&config);
    rewind(file);
    said[fread(said, 1, size - 1, file)] = '\0';
    assert_int_equal(fclose(file), 0);
}

static void test_choice_is_told_in_one_line(void **state) {
    char said[512];
    (void)state;
    write_body_of_this_machine(NULL);
    load_and_listen(SCENE("{budget_us: 5}"), said, sizeof said);
    assert_string_equal(said,
                        "shcdd: body 'egg': degree 3, fast: 0.4 mm in 3 us, by its cost table\n");
    load_and_listen(SCENE("{tolerance_m: 0.01, budget_us: 1}"), said, sizeof said);
    assert_string_equal(said, "shcdd: body 'egg': degree 2, map of resolution 16, linear: 9 mm in "
                              "0.2 us, by its cost table\n");
    load_and_listen("bodies:\n  - {name: a, model: " BODY_FILE "}\n" SCENE_TOOLS, said,
                    sizeof said);
    assert_string_equal(said, ""); /* nothing was asked for, nothing chosen */
    write_body(NULL, NULL);
    load_and_listen(SCENE("{tolerance_m: 1.0e-3, budget_us: 10000}"), said, sizeof said);
    const char *second = strchr(said, '\n') + 1;
    assert_non_null(strstr(said, "no cost table of this machine; measuring"));
    assert_int_equal(strncmp(second, "shcdd: body 'egg': degree 6, ", 29), 0);
    assert_non_null(strstr(second, " us, by measurement\n"));
    scene_remove(BODY_FILE);
}

/* ---- without a table ---- */

static void expect_measured(const char *text) {
    daemon_config config = scene_load_good(text);
    assert_int_equal(shcd_model_degree(config.models[0]), DEGREE);
    config_free(&config);
}

/* Neither other machine's times nor none decide: then even 1 mm takes the full degree, which is
 * measured first and does it in far less than 10 ms. */
static void test_without_a_table_of_this_machine_it_is_measured(void **state) {
    (void)state;
    write_body("Another machine", NULL);
    expect_measured(SCENE("{tolerance_m: 1.0e-3, budget_us: 10000}"));
    write_body(NULL, NULL);
    expect_measured(SCENE("{tolerance_m: 1.0e-3, budget_us: 10000}"));
    scene_remove(BODY_FILE);
}

/* 10 ns is less than any machine needs; the refusal names pairs from lower degrees, too. */
static void test_measured_and_infeasible_is_refused(void **state) {
    (void)state;
    write_body(NULL, NULL);
    scene_expect_text_refused(
        SCENE("{tolerance_m: 1.0e-5, budget_us: 0.01}"),
        "4:15: bodies[0].accuracy: 0.01 mm in 0.01 us is not feasible: nearest are 0.01 mm in ");
    scene_remove(BODY_FILE);
}

/* The truth of the measurement is the body's own: exact is exact, every tier answers. */
static void test_quick_measurement_is_sound(void **state) {
    shcd_cost_row rows[COST_QUICK_ROWS];
    check_random random = {0x90};
    (void)state;
    shcd_model *model = bodies_create_random(&random, DEGREE, 0.02);
    const shcd_model_info info = bodies_info(model);
    assert_true(cost_quick(model, model, rows));
    for (size_t i = 0; i < COST_QUICK_ROWS; i++) {
        assert_int_equal(rows[i].degree, DEGREE);
        assert_true(rows[i].ns_p50 > 0.0 && rows[i].ns_p99 >= rows[i].ns_p50);
        assert_true(rows[i].error_max_m >= rows[i].error_p99_m);
        assert_true(rows[i].error_max_m >= rows[i].error_rms_m && rows[i].evaluations_mean > 0.0);
    }
    assert_int_equal(rows[0].tier, SHCD_TIER_EXACT);
    assert_true(rows[0].error_max_m <= 1e-9 * info.diagonal_m);
    assert_int_equal(rows[4].tier, SHCD_TIER_MAP);
    assert_int_equal(rows[4].map_resolution, info.map_resolution);
    assert_true(rows[4].error_max_m > rows[0].error_max_m);
    shcd_model_free(model);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_table_of_this_machine_decides),
        cmocka_unit_test(test_lower_degree_is_the_series_cut_off),
        cmocka_unit_test(test_bodies_of_one_file_may_differ_in_accuracy),
        cmocka_unit_test(test_effects_that_the_model_carries_keep_its_degree),
        cmocka_unit_test(test_infeasible_is_refused_with_the_nearest_pairs),
        cmocka_unit_test(test_against_mesh_adds_the_error_of_the_fit),
        cmocka_unit_test(test_choice_is_told_in_one_line),
        cmocka_unit_test(test_without_a_table_of_this_machine_it_is_measured),
        cmocka_unit_test(test_measured_and_infeasible_is_refused),
        cmocka_unit_test(test_quick_measurement_is_sound),
    };
    return cmocka_run_group_tests(tests, scene_folder_make, scene_folder_remove);
}
