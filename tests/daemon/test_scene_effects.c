/* SPDX-License-Identifier: BSD-3-Clause */
/* The effects of a scene file: every parameter of the library's table within its range and not
 * beyond, tables, parameters that do not go together, laws that a device does not render; each
 * complaint with its place. */
#include "scene_support.h"
#include "support/network.h"
#include "support/soft.h"

/* What has to stand before a parameter so that it, alone and at the ends of its range, makes sense.
 */
static const char *before(const char *effect, const char *parameter) {
    static const struct {
        const char *effect, *parameter, *text;
    } needs[] = {
        {"stiffness", "poisson_ratio", "youngs_modulus_pa: 1000, "},
        {"stiffness", "tool_radius_m", "youngs_modulus_pa: 1000, "},
        {"stiffness", "thickness_m", "stress_strain: [[1, 1]], "},
        {"stiffness", "contact_radius_m", "stress_strain: [[1, 1]], "},
        {"friction", "static_ratio", "kinetic_ratio: 0, "},
        {"friction", "kinetic_ratio", "static_ratio: 10, "},
        {"relaxation", "g_1", "g_2: 0, "},
        {"relaxation", "g_2", "g_1: 0, "},
        {"relaxation", "g_3", "g_1: 0, g_2: 0, "},
        {"texture", "amplitude_m", "wavelength_m: 0.04, "},
        {"texture", "wavelength_m", "amplitude_m: 3e-7, "}, /* else too stiff at the shortest */
    };
    for (size_t i = 0; i < sizeof needs / sizeof needs[0]; i++) {
        if (strcmp(needs[i].effect, effect) == 0 && strcmp(needs[i].parameter, parameter) == 0) {
            return needs[i].text;
        }
    }
    return "";
}

static void write_effect_scene(char *text, size_t size, const char *effect, const char *parameter,
                               double value) {
    (void)snprintf(text, size, SCENE_EGG "    effects:\n      %s: {%s%s: %.17g}\n" SCENE_TOOLS,
                   effect, before(effect, parameter), parameter, value);
}

/* The largest value that the device renders, too. */
static double largest(const char *effect, const shcd_parameter_info *p) {
    const double limit = device_profiles[0].stiffness_max_n_per_m;
    if (strcmp(effect, "stiffness") == 0 && strcmp(p->name, "k_n_per_m") == 0) {
        return fmin(limit, p->max_value);
    }
    if (strcmp(effect, "stiffness") == 0 && strcmp(p->name, "youngs_modulus_pa") == 0) {
        /* (6 R F E*^2)^(1/3) = limit, R = 1 mm of a point, E* = E/(1 - 0.45^2); rounded down */
        return 0.999 * 0.7975 * sqrt(limit * limit * limit / (6.0 * 0.001 * 5.0));
    }
    if (strcmp(effect, "friction") == 0 && strcmp(p->name, "stiffness_n_per_m") == 0) {
        return fmin(limit, p->max_value);
    }
    if (strcmp(effect, "viscosity") == 0 && strcmp(p->name, "length_m") != 0) {
        /* one tick late at 1 kHz: m/T; by Stokes' law over 6 pi times the 1 mm of a point */
        const double drag = device_profiles[0].mass_kg * CONFIG_RATE_DEFAULT_HZ;
        const bool is_drag = strcmp(p->name, "damping_n_s_per_m") == 0;
        return fmin(p->max_value, is_drag ? drag : 0.999999 * drag / (6.0 * SOFT_PI * 0.001));
    }
    return p->max_value;
}

/* Effects whose bodies must carry data: an ellipsoid does not. */
static bool needs_a_model(const char *effect) {
    return strcmp(effect, "wave") == 0 || strcmp(effect, "pulse") == 0 ||
           strcmp(effect, "learned") == 0;
}

static void check_range(const shcd_effect_info *info, const shcd_parameter_info *p) {
    char text[1024], expected[512];
    const double good[] = {p->min_value, p->default_value, largest(info->name, p)};
    const double bad[] = {nextafter(p->min_value, -HUGE_VAL), nextafter(p->max_value, HUGE_VAL)};
    for (size_t k = 0; k < 3 && !needs_a_model(info->name); k++) {
        write_effect_scene(text, sizeof text, info->name, p->name, good[k]);
        daemon_config config = scene_load_good(text);
        config_free(&config);
    }
    (void)snprintf(expected, sizeof expected, "5:%zu: bodies[0].effects.%s.%s: ",
                   6 + strlen(info->name) + 3 + strlen(before(info->name, p->name)) +
                       strlen(p->name) + 3,
                   info->name, p->name);
    for (size_t k = 0; k < 2; k++) {
        write_effect_scene(text, sizeof text, info->name, p->name, bad[k]);
        scene_expect_text_refused(text, expected);
    }
}

/* Whatever stands in the table is a key, its limits are allowed, and beyond them is not. */
static void test_load_every_parameter_keeps_its_range(void **state) {
    const shcd_effect_info *info = NULL;
    (void)state;
    for (size_t e = 0; (info = shcd_effect_at(e)) != NULL; e++) {
        for (size_t i = 0; i < info->n_parameters; i++) {
            if (info->parameters[i].columns == NULL) {
                check_range(info, &info->parameters[i]);
            }
        }
    }
}

#define TABLE_SCENE(rows)                                                                          \
    SCENE_EGG "    effects:\n      stiffness:\n        stress_strain: " rows "\n" SCENE_TOOLS

static void test_load_table_gives_the_law_of_its_rows(void **state) {
    daemon_config config = scene_load_good(TABLE_SCENE("[[0.1, 1000], [0.5, 9000]]"));
    shcd_tool_input in = {{{0.0, 0.0, 0.05 - 0.003}, {1.0, 0.0, 0.0, 0.0}}};
    shcd_tool_output out;
    const shcd_input input = {0.001, &in, 1};
    shcd_output output = {&out, 1};
    const size_t size = (shcd_state_size(config.scene) + 15) / 16 * 16;
    void *memory = aligned_alloc(16, size);
    shcd_state *scene_state = NULL;
    (void)state;
    in.flags = SHCD_TOOL_INPUT_ACTIVE;
    assert_int_equal(shcd_state_init(config.scene, memory, size, &scene_state), SHCD_OK);
    assert_int_equal(shcd_step(config.scene, scene_state, &input, &output), SHCD_OK);
    /* strain 0.3 of 10 mm: 5 kPa on a point's circle of 1 mm; depth to 1e-9 of the diagonal */
    assert_near(out.wrench.force_n.z, 5000.0 * 3.14159265358979324e-6, 1e-8);
    free(memory);
    config_free(&config);
}

static void test_load_bad_table_is_placed(void **state) {
    (void)state;
    scene_expect_text_refused(TABLE_SCENE("7"),
                              "6:24: bodies[0].effects.stiffness.stress_strain: is a single value, "
                              "must be a list of rows");
    scene_expect_text_refused(TABLE_SCENE("[]"),
                              "6:24: bodies[0].effects.stiffness.stress_strain: holds 0 rows, must "
                              "hold at least 1");
    scene_expect_text_refused(TABLE_SCENE("[[0.1, 5], [0.2]]"),
                              "6:35: bodies[0].effects.stiffness.stress_strain[1]: holds 1 values, "
                              "must hold at least 2");
    scene_expect_text_refused(TABLE_SCENE("[[0.1, 5], [0.2, -3]]"),
                              "6:41: bodies[0].effects.stiffness.stress_strain[1][1]: -3 is out of "
                              "range, must lie in 0 .. 1e+09 Pa");
    scene_expect_text_refused(TABLE_SCENE("[[0.1, 5], [0.1, 6]]"),
                              "6:36: bodies[0].effects.stiffness.stress_strain[1][0]: strain must "
                              "be above that of the row before, 0.1");
    scene_expect_text_refused(TABLE_SCENE("[[0.1, 5], [0.2, 4]]"),
                              "6:24: bodies[0].effects.stiffness.stress_strain: row 1: "
                              "the stress must not fall");
}

/* What the library says about parameters that do not go together gets the place of the effect. */
static void test_load_laws_that_exclude_each_other_are_placed(void **state) {
    (void)state;
    scene_expect_text_refused(
        SCENE_EGG
        "    effects:\n      stiffness: {k_n_per_m: 300, youngs_modulus_pa: 5000}\n" SCENE_TOOLS,
        "5:18: bodies[0].effects.stiffness: 'k_n_per_m' and 'youngs_modulus_pa' are two laws; give "
        "one of them");
    scene_expect_text_refused(
        SCENE_EGG
        "    effects:\n      stiffness: {}\n      friction: {static_ratio: 0.1}\n" SCENE_TOOLS,
        "6:17: bodies[0].effects.friction: 'kinetic_ratio' is 0.2, must not be above");
}

/* A law without a constant stiffness is held against the device with the tools of the scene. */
static void test_load_law_that_is_too_stiff_for_a_tool_is_refused(void **state) {
    static const char *const laws[] = {"{youngs_modulus_pa: 1e6}",
                                       "{stress_strain: [[1, 1e6]], thickness_m: 0.001}"};
    static const char *const keys[] = {"youngs_modulus_pa", "stress_strain"};
    (void)state;
    for (int i = 0; i < 2; i++) {
        char text[1024], expected[512];
        const char *const ball = "tools: [{id: 0, name: b, shape: {sphere: {radius_m: 0.02}}}]\n";
        (void)snprintf(text, sizeof text, SCENE_EGG "    effects:\n      stiffness: %s\n%s",
                       laws[i], ball);
        (void)snprintf(expected, sizeof expected, "5:%zu: bodies[0].effects.stiffness.%s: is ",
                       20 + strlen(keys[i]) + 1, keys[i]);
        scene_expect_text_refused(text, expected);
    }
}

/* ---- by what the model carries --------------------------------------------------------------- */

/* A body "ball.shcd" with modes, and a network whose record says so much. */
static void write_ball(double recorded_n_per_m) {
    static double numbers[NETWORK_NUMBERS];
    shcd_learned learned = network_by_hand(numbers);
    shcd_model *plain = soft_sphere(0.05, 7), *ball = NULL;
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    char path[SCENE_PATH_SIZE];
    learned.record.stiffness_max_n_per_m = recorded_n_per_m;
    def.degree = 7;
    def.coefficients = shcd_model_coefficients(plain);
    def.modes = shcd_model_modes(plain);
    def.learned = &learned;
    assert_int_equal(shcd_model_create(&def, NULL, &ball, NULL), SHCD_OK);
    scene_path("ball.shcd", path);
    assert_int_equal(shcd_model_save(ball, path, NULL), SHCD_OK);
    shcd_model_free(plain);
    shcd_model_free(ball);
}

#define BALL_SCENE(effects)                                                                        \
    "bodies:\n  - name: ball\n    model: ball.shcd\n    effects:\n" effects SCENE_TOOLS

static void test_load_trained_body_beyond_the_device_is_refused(void **state) {
    (void)state;
    write_ball(2000.0); /* the limit itself is allowed */
    daemon_config config = scene_load_good(BALL_SCENE("      learned: {}\n"));
    config_free(&config);
    scene_expect_text_refused(
        BALL_SCENE("      learned: {scale: 2}\n"),
        "5:24: bodies[0].effects.learned.scale: its model was trained to be up to 2000 N/m stiff, "
        "times 2, and device generic renders 2000 N/m at most; give a scale of at most 1, or "
        "train with a softer tissue");
    config = scene_load_good(BALL_SCENE("      learned: {scale: 1}\n"));
    config_free(&config);
    write_ball(2001.0);
    scene_expect_text_refused(BALL_SCENE("      learned: {}\n"),
                              "5:16: bodies[0].effects.learned: its model was trained to be up to "
                              "2001 N/m stiff, times 1, ");
    config = scene_load_good(BALL_SCENE("      stiffness: {}\n")); /* it is not called for */
    config_free(&config);
    scene_remove("ball.shcd");
}

/* What the refusal of a scale suggests is accepted. */
static void check_suggestion(const char *scale) {
    static const char words[] = "at most ";
    char text[1024], error[CONFIG_ERROR_SIZE] = "", path[SCENE_PATH_SIZE];
    daemon_config config;
    (void)snprintf(text, sizeof text, BALL_SCENE("      learned: {scale: %s}\n"), scale);
    scene_write("suggest.yaml", text, strlen(text));
    scene_path("suggest.yaml", path);
    assert_false(config_load(path, &config, error, sizeof error));
    const char *at = strstr(error, "a scale of at most ");
    assert_non_null(at);
    const double suggested = strtod(strstr(at, words) + sizeof words - 1, NULL);
    print_message("%s\n", error);
    assert_true(suggested > 0.0);
    (void)snprintf(text, sizeof text, BALL_SCENE("      learned: {scale: %.17g}\n"), suggested);
    config = scene_load_good(text);
    config_free(&config);
    scene_remove("suggest.yaml");
}

/* A record without a figure, as of a network made elsewhere: what the network itself says. About
 * 150 N/m, rising with the depth; beyond 5 N it does not count. */
static void test_load_trained_body_is_held_by_its_network_too(void **state) {
    (void)state;
    write_ball(0.0);
    daemon_config config = scene_load_good(BALL_SCENE("      learned: {scale: 4}\n"));
    config_free(&config);
    scene_expect_text_refused(BALL_SCENE("      learned: {scale: 30}\n"),
                              "5:24: bodies[0].effects.learned.scale: its model was trained to be "
                              "up to ");
    check_suggestion("30");
    check_suggestion("99.9");
    scene_remove("ball.shcd");
}

/* 2 E* a is 1254 N/m, but within a tick its inertia and the modes left out hardly give way. */
static void test_load_wave_that_is_too_stiff_within_a_tick_is_refused(void **state) {
    (void)state;
    write_ball(0.0);
    scene_expect_text_refused(BALL_SCENE("      wave: {youngs_modulus_pa: 1.0e5}\n"),
                              "5:33: bodies[0].effects.wave.youngs_modulus_pa: is ");
    daemon_config config = scene_load_good(
        BALL_SCENE("      wave: {youngs_modulus_pa: 1.0e5}\n      stiffness: {}\n"));
    config_free(&config);
    config = scene_load_good(BALL_SCENE("      wave: {youngs_modulus_pa: 5.0e4}\n"));
    config_free(&config);
    scene_remove("ball.shcd");
}

/* A Hertz law alone, 2 E* a = 1781 N/m at 5 N for a ball of 12 mm, is rendered; but beyond the
 * patch's radius it is rigid beside the wave, and the ball is left with what a tick makes of that.
 * The sharp tool's contact stays within the patch. */
static void test_load_hertz_beside_a_wave_that_is_too_stiff_is_refused(void **state) {
#define BALL_AND(effects, radius)                                                                  \
    "bodies:\n  - name: ball\n    model: ball.shcd\n    effects:\n" effects                        \
    "tools: [{id: 0, name: b, shape: {sphere: {radius_m: " radius "}}}]\n"
#define HERTZ "      stiffness: {youngs_modulus_pa: 1.0e5}\n"
#define WAVE "      wave: {youngs_modulus_pa: 1.0e5}\n"
    (void)state;
    write_ball(0.0);
    daemon_config config = scene_load_good(BALL_AND(HERTZ, "0.012"));
    config_free(&config);
    scene_expect_text_refused(BALL_AND(HERTZ WAVE, "0.012"),
                              "6:33: bodies[0].effects.wave.youngs_modulus_pa: is ");
    config = scene_load_good(BALL_AND(HERTZ WAVE, "0.001"));
    config_free(&config);
    scene_remove("ball.shcd");
}

/* ---- examples -------------------------------------------------------------------------------- */

/* What the examples expect beside their folder: a body with modes, and one with a learned response.
 */
static void write_models(void) {
    static double numbers[NETWORK_NUMBERS];
    const shcd_learned learned = network_by_hand(numbers);
    shcd_model *organ = soft_sphere(0.05, 7), *trained = NULL;
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    char path[SCENE_PATH_SIZE];
    def.degree = 7;
    def.coefficients = shcd_model_coefficients(organ);
    def.modes = shcd_model_modes(organ);
    def.learned = &learned;
    assert_int_equal(shcd_model_create(&def, NULL, &trained, NULL), SHCD_OK);
    scene_path("organ.shcd", path);
    assert_int_equal(shcd_model_save(organ, path, NULL), SHCD_OK);
    scene_path("trained.shcd", path);
    assert_int_equal(shcd_model_save(trained, path, NULL), SHCD_OK);
    shcd_model_free(organ);
    shcd_model_free(trained);
}

static void copy_example(const char *name, const char *effect) {
    char path[SCENE_PATH_SIZE], text[8192];
    (void)snprintf(path, sizeof path, "%s/scenes/effects/%s.yaml", SHCD_SOURCE_DIR, effect);
    FILE *file = fopen(path, "rb");
    if (file == NULL) {
        fail_msg("%s is missing", path);
    }
    const size_t size = fread(text, 1, sizeof text, file);
    assert_in_range(size, 1, sizeof text - 1);
    assert_int_equal(fclose(file), 0);
    scene_write(name, text, size);
}

/* Each effect has an example of its own, which calls for it. */
static void test_every_effect_has_a_scene(void **state) {
    const shcd_effect_info *info = NULL;
    char folder[SCENE_PATH_SIZE], path[SCENE_PATH_SIZE];
    (void)state;
    write_models();
    scene_path("effects", folder);
    assert_int_equal(mkdir(folder, 0700), 0);
    for (size_t e = 0; (info = shcd_effect_at(e)) != NULL; e++) {
        char error[CONFIG_ERROR_SIZE] = "";
        daemon_config config;
        bool is_called_for = false;
        copy_example("effects/example.yaml", info->name);
        scene_path("effects/example.yaml", path);
        if (!config_load(path, &config, error, sizeof error)) {
            fail_msg("%s: %s", info->name, error);
        }
        for (size_t i = 0; i < shcd_scene_effect_count(config.scene); i++) {
            is_called_for |= strcmp(shcd_scene_effect_name(config.scene, i), info->name) == 0;
        }
        assert_true(is_called_for);
        config_free(&config);
        scene_remove("effects/example.yaml");
    }
    assert_int_equal(rmdir(folder), 0);
    scene_remove("organ.shcd");
    scene_remove("trained.shcd");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_load_every_parameter_keeps_its_range),
        cmocka_unit_test(test_load_table_gives_the_law_of_its_rows),
        cmocka_unit_test(test_load_bad_table_is_placed),
        cmocka_unit_test(test_load_laws_that_exclude_each_other_are_placed),
        cmocka_unit_test(test_load_law_that_is_too_stiff_for_a_tool_is_refused),
        cmocka_unit_test(test_load_trained_body_beyond_the_device_is_refused),
        cmocka_unit_test(test_load_trained_body_is_held_by_its_network_too),
        cmocka_unit_test(test_load_wave_that_is_too_stiff_within_a_tick_is_refused),
        cmocka_unit_test(test_load_hertz_beside_a_wave_that_is_too_stiff_is_refused),
        cmocka_unit_test(test_every_effect_has_a_scene),
    };
    return cmocka_run_group_tests(tests, scene_folder_make, scene_folder_remove);
}
