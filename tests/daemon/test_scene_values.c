/* SPDX-License-Identifier: BSD-3-Clause */
/* What the scene reader makes of good files: every value arrives where it belongs, defaults fill
 * what is left out, the effects table rules the effects' keys, and docs/scene-file.md tells the
 * same. */
#include "scene_support.h"

#include <locale.h>

#define SCENES SHCD_SOURCE_DIR "/scenes"
#define DOCUMENT SHCD_SOURCE_DIR "/docs/scene-file.md"

/* The library promises its harmonics to 1e-13; no axis here is longer than 0.1 m. */
#define SURFACE_TOLERANCE_M (1e-13 * 0.1)

/* One tick, from rest, of the tool at a point; the force on it. */
static shcd_vec3 press(const daemon_config *config, size_t tool, shcd_vec3 at_m) {
    const size_t size = shcd_state_size(config->scene);
    void *memory = aligned_alloc(16, (size + 15) / 16 * 16);
    shcd_tool_input tools[SHCD_TOOLS_MAX] = {0};
    shcd_tool_output outputs[SHCD_TOOLS_MAX] = {0};
    const size_t n = shcd_scene_tool_count(config->scene);
    const shcd_input input = {1e-3, tools, n};
    shcd_output output = {outputs, n};
    shcd_state *state = NULL;
    assert_non_null(memory);
    tools[tool].tool_in_world.position_m = at_m;
    tools[tool].tool_in_world.orientation.w = 1.0;
    tools[tool].flags = SHCD_TOOL_INPUT_ACTIVE;
    assert_int_equal(shcd_state_init(config->scene, memory, size, &state), SHCD_OK);
    assert_int_equal(shcd_step(config->scene, state, &input, &output), SHCD_OK);
    free(memory);
    return outputs[tool].wrench.force_n;
}

/* The surface point of a body at a parameter direction, body frame. */
static shcd_vec3 surface_point(const shcd_model *model, double x, double y, double z) {
    shcd_vec3 point;
    assert_int_equal(shcd_model_surface(model, -1, shcd_vec3_make(x, y, z), &point, NULL, NULL),
                     SHCD_OK);
    return point;
}

static const shcd_parameter_info *find_parameter(const char *effect, const char *name) {
    const shcd_effect_info *info = NULL;
    for (size_t e = 0; (info = shcd_effect_at(e)) != NULL; e++) {
        for (size_t i = 0; strcmp(info->name, effect) == 0 && i < info->n_parameters; i++) {
            if (strcmp(info->parameters[i].name, name) == 0) {
                return &info->parameters[i];
            }
        }
    }
    fail_msg("the effects table has no %s.%s", effect, name);
    return NULL;
}

/* ---- the scenes that come with the project --------------------------------------------------- */

static void test_load_ellipsoid_scene_gives_its_values(void **state) {
    daemon_config config = {0};
    char error[CONFIG_ERROR_SIZE] = "";
    (void)state;
    if (!config_load(SCENES "/ellipsoid.yaml", &config, error, sizeof error)) {
        fail_msg("%s", error);
    }
    assert_near(config.rate_hz, 1000.0, 0.0);
    assert_string_equal(config.device->name, "generic");
    assert_int_equal(config.n_models, 1);
    assert_int_equal(shcd_scene_body_count(config.scene), 1);
    assert_string_equal(shcd_scene_body_name(config.scene, 0), "ellipsoid");
    assert_int_equal(shcd_scene_tool_count(config.scene), 2);
    assert_string_equal(shcd_scene_tool_name(config.scene, 0), "needle");
    assert_string_equal(shcd_scene_tool_name(config.scene, 1), "ball");
    assert_int_equal(config.tool_ids[0], 0);
    assert_int_equal(config.tool_ids[1], 1);
    const shcd_pose pose = config.body_in_world[0];
    assert_near(pose.position_m.z, 0.05, 0.0);
    /* the file gives six decimals, so the turn is 30 degrees to 2 * 0.5e-6 / sin(15 deg) rad */
    assert_near(2.0 * atan2(pose.orientation.z, pose.orientation.w), acos(-1.0) / 6.0, 4e-6);
    assert_near(hypot(pose.orientation.w, pose.orientation.z), 1.0, 4e-16);
    assert_near(surface_point(config.models[0], 1, 0, 0).x, 0.08, SURFACE_TOLERANCE_M);
    assert_near(surface_point(config.models[0], 0, 1, 0).y, 0.06, SURFACE_TOLERANCE_M);
    assert_near(surface_point(config.models[0], 0, 0, 1).z, 0.05, SURFACE_TOLERANCE_M);
    config_free(&config);
}

static void test_load_organ_scene_finds_the_model_beside_it(void **state) {
    static const double semi_axes_m[3] = {0.09, 0.06, 0.04};
    char path[SCENE_PATH_SIZE];
    char text[8192];
    daemon_config config = {0};
    char error[CONFIG_ERROR_SIZE] = "";
    shcd_model *stand_in = NULL;
    (void)state;
    FILE *file = fopen(SCENES "/organ.yaml", "rb");
    assert_non_null(file);
    const size_t size = fread(text, 1, sizeof text, file);
    assert_int_equal(fclose(file), 0);
    assert_true(size > 0 && size < sizeof text);
    scene_path("organ.shcd", path);
    assert_int_equal(config_ellipsoid(semi_axes_m, &stand_in, NULL), SHCD_OK);
    assert_int_equal(shcd_model_save(stand_in, path, NULL), SHCD_OK);
    shcd_model_free(stand_in);

    if (!scene_load_bytes(text, size, &config, error, sizeof error)) {
        fail_msg("%s", error);
    }
    scene_remove("organ.shcd");
    assert_string_equal(shcd_scene_body_name(config.scene, 0), "organ");
    assert_near(surface_point(config.models[0], 1, 0, 0).x, 0.09, SURFACE_TOLERANCE_M);
    assert_near(config.body_in_world[0].orientation.w, 1.0, 0.0);
    assert_near(config.body_in_world[0].position_m.x, 0.0, 0.0);
    config_free(&config);
}

static void test_built_in_is_what_the_document_says(void **state) {
    daemon_config config = {0};
    char error[CONFIG_ERROR_SIZE] = "";
    (void)state;
    assert_true(config_built_in(&config, error, sizeof error));
    assert_near(config.rate_hz, CONFIG_RATE_DEFAULT_HZ, 0.0);
    assert_ptr_equal(config.device, &device_profiles[0]);
    assert_string_equal(shcd_scene_body_name(config.scene, 0), "ellipsoid");
    assert_string_equal(shcd_scene_tool_name(config.scene, 0), "point");
    assert_string_equal(shcd_scene_tool_name(config.scene, 1), "sphere");
    assert_int_equal(config.tool_ids[0], 0);
    assert_int_equal(config.tool_ids[1], 1);
    assert_near(surface_point(config.models[0], 1, 0, 0).x, 0.08, SURFACE_TOLERANCE_M);
    assert_near(surface_point(config.models[0], 0, 1, 0).y, 0.06, SURFACE_TOLERANCE_M);
    assert_near(surface_point(config.models[0], 0, 0, 1).z, 0.05, SURFACE_TOLERANCE_M);
    config_free(&config);
    assert_null(config.scene);
    config_free(&config);
    config_free(NULL);
}

/* Every shape presses the top of the ellipsoid, 400 N/m, with its lowest point 1 mm deep: 0.4 N,
 * off by the tolerance of a convex tool's query, 1e-6 of the diagonal, 0.22 m. The blade is a
 * shell, of which only the lowest points touch. */
static void test_load_tools_scene_gives_every_shape(void **state) {
    const double lowest_m[6] = {0.0, 0.005, 0.023, 0.003, 0.01, 0.002};
    static const char *const names[6] = {"needle", "ball", "probe", "box", "wedge", "blade"};
    daemon_config config = {0};
    char error[CONFIG_ERROR_SIZE] = "";
    (void)state;
    if (!config_load(SCENES "/tools.yaml", &config, error, sizeof error)) {
        fail_msg("%s", error);
    }
    assert_int_equal(shcd_scene_tool_count(config.scene), 6);
    for (size_t i = 0; i < 6; i++) {
        const shcd_vec3 force = press(&config, i, shcd_vec3_make(0, 0, 0.05 + lowest_m[i] - 0.001));
        assert_string_equal(shcd_scene_tool_name(config.scene, i), names[i]);
        if (i < 5) {
            assert_near(force.z, 0.4, 400.0 * 0.22e-6);
        } else {
            assert_true(force.z > 0.01 && force.z < 0.4);
        }
    }
    config_free(&config);
}

/* A hull from an OBJ and a shell from blanks and without normals. */
static void test_load_point_files_in_other_forms(void **state) {
    static const char obj[] = "# a tetrahedron\no tip\nv 0.01 0 0.01 1.0\nv -0.01 0.01 0.01\r\n"
                              "v -0.01 -0.01 0.01\nv 0 0 0\nvn 0 0 1\nf 1 2 3\n";
    static const char xyz[] = "\n  0 0 -1e-3\n\t0.01 , 0\t0\n#\n-0.01 0 0";
    (void)state;
    scene_write("tip.obj", obj, sizeof obj - 1);
    scene_write("three.xyz", xyz, sizeof xyz - 1);
    daemon_config config =
        scene_load_good("bodies:\n- name: ball\n  ellipsoid: {semi_axes_m: [0.1, 0.1, 0.1]}\n"
                        "  effects: {stiffness: {k_n_per_m: 300}}\n"
                        "tools:\n"
                        "- {id: 0, name: tip, shape: {hull: {file: tip.obj, radius_m: 0.001}}}\n"
                        "- {id: 1, name: three, shape: {shell: {file: three.xyz}}}\n");
    scene_remove("tip.obj");
    scene_remove("three.xyz");
    assert_near(press(&config, 0, shcd_vec3_make(0, 0, 0.1)).z, 0.3, 300.0 * 0.35e-6);
    /* one of three points is inside, by 1 mm */
    assert_near(press(&config, 1, shcd_vec3_make(0, 0, 0.1)).z, 0.1, 300.0 * 0.35e-9);
    config_free(&config);
}

/* ---- values and defaults --------------------------------------------------------------------- */

static void test_load_left_out_keys_take_defaults(void **state) {
    daemon_config config = scene_load_good(SCENE_EGG SCENE_TOOLS);
    (void)state;
    assert_near(config.rate_hz, 1000.0, 0.0);
    assert_ptr_equal(config.device, &device_profiles[0]);
    assert_near(config.body_in_world[0].orientation.w, 1.0, 0.0);
    assert_near(shcd_norm(config.body_in_world[0].position_m), 0.0, 0.0);
    /* no effect is called for: none acts */
    assert_near(shcd_norm(press(&config, 0, shcd_vec3_make(0.079, 0, 0))), 0.0, 0.0);
    config_free(&config);
}

static void test_load_scene_without_bodies_is_good(void **state) {
    daemon_config config = scene_load_good("bodies: []\n" SCENE_TOOLS);
    (void)state;
    assert_int_equal(shcd_scene_body_count(config.scene), 0);
    assert_int_equal(config.n_models, 0);
    config_free(&config);
}

static void test_load_every_key_arrives(void **state) {
    daemon_config config =
        scene_load_good("rate_hz: 250.5\n"
                        "device: 'generic'\n"
                        "bodies:\n"
                        "- name: \"left kidney\"\n"
                        "  ellipsoid: {semi_axes_m: [0.05, .05, 5.0e-2]}\n"
                        "  pose:\n"
                        "    orientation_wxyz: [0.707, 0.707, 0, 0]   # three decimals\n"
                        "    position_m: [1, -2, +0.5]\n"
                        "- {name: \xc3\x9c"
                        "ber, ellipsoid: {semi_axes_m: [1E-1, 1.e-1, 0.1]}}\n"
                        "tools:\n"
                        "- {shape: {sphere: {radius_m: 0.0025}}, name: ball, id: 255}\n"
                        "- id: 3\n"
                        "  name: tip\n"
                        "  shape: point\n");
    (void)state;
    assert_near(config.rate_hz, 250.5, 0.0);
    assert_int_equal(config.n_models, 2);
    assert_string_equal(shcd_scene_body_name(config.scene, 0), "left kidney");
    assert_string_equal(shcd_scene_body_name(config.scene, 1), "\xc3\x9c"
                                                               "ber");
    assert_string_equal(shcd_scene_tool_name(config.scene, 0), "ball");
    assert_string_equal(shcd_scene_tool_name(config.scene, 1), "tip");
    assert_int_equal(config.tool_ids[0], 255);
    assert_int_equal(config.tool_ids[1], 3);
    const shcd_pose pose = config.body_in_world[0];
    assert_near(pose.position_m.x, 1.0, 0.0);
    assert_near(pose.position_m.y, -2.0, 0.0);
    assert_near(pose.position_m.z, 0.5, 0.0);
    assert_near(pose.orientation.w, sqrt(0.5), 2e-16);
    assert_near(pose.orientation.x, sqrt(0.5), 2e-16);
    assert_near(surface_point(config.models[0], 0, 0, 1).z, 0.05, SURFACE_TOLERANCE_M);
    assert_near(surface_point(config.models[1], 1, 0, 0).x, 0.1, SURFACE_TOLERANCE_M);
    config_free(&config);
}

/* Windows line ends, a byte order mark, a document marker and quoted keys change nothing. */
static void test_load_harmless_forms_are_accepted(void **state) {
    daemon_config config =
        scene_load_good("\xef\xbb\xbf# \xe5\x99\xa8\xe5\xae\x98\r\n---\r\n"
                        "\"rate_hz\": 500\r\nbodies: []\r\n"
                        "tools:\r\n  - {id: 0, name: a, shape: point}\r\n...\r\n");
    (void)state;
    assert_near(config.rate_hz, 500.0, 0.0);
    config_free(&config);
}

static void test_load_bodies_of_one_file_share_one_model(void **state) {
    static const double semi_axes_m[3] = {0.05, 0.04, 0.03};
    char path[SCENE_PATH_SIZE];
    char text[SCENE_PATH_SIZE + 500];
    shcd_model *model = NULL;
    (void)state;
    scene_path("egg.shcd", path);
    assert_int_equal(config_ellipsoid(semi_axes_m, &model, NULL), SHCD_OK);
    assert_int_equal(shcd_model_save(model, path, NULL), SHCD_OK);
    shcd_model_free(model);
    (void)snprintf(text, sizeof text,
                   "bodies:\n- {name: a, model: egg.shcd}\n- {name: b, model: egg.shcd}\n"
                   "- {name: c, model: %s}\n" SCENE_TOOLS,
                   path); /* an absolute path is taken as it is */
    daemon_config config = scene_load_good(text);
    scene_remove("egg.shcd");
    assert_int_equal(config.n_models, 3);
    assert_ptr_equal(config.models[0], config.models[1]);
    assert_near(surface_point(config.models[2], 0, 0, 1).z, 0.03, SURFACE_TOLERANCE_M);
    config_free(&config);
}

/* ---- effects --------------------------------------------------------------------------------- */

/* A sphere of 0.1 m pressed by 1 mm: the force is k times that, off by k times the tolerance of the
 * distance query, 1e-9 of the body's diagonal (0.35 m). */
static void test_load_stiffness_acts_with_the_given_value(void **state) {
    static const char scene[] =
        "bodies:\n- name: ball\n  ellipsoid: {semi_axes_m: [0.1, 0.1, 0.1]}\n"
        "  effects: {stiffness: %s, damping: {}}\n" SCENE_TOOLS;
    const struct {
        const char *text;
        double k_n_per_m;
    } cases[] = {
        {"{k_n_per_m: 123.5}", 123.5},
        {"{k_n_per_m: 2e3}", 2000.0},
        {"{}", find_parameter("stiffness", "k_n_per_m")->default_value},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char text[sizeof scene + 64];
        (void)snprintf(text, sizeof text, scene, cases[i].text);
        daemon_config config = scene_load_good(text);
        const shcd_vec3 force = press(&config, 0, shcd_vec3_make(0, 0, 0.099));
        const double k = cases[i].k_n_per_m;
        assert_near(force.z, k * 1e-3, k * 0.35e-9);
        config_free(&config);
    }
}

/* ---- locale ---------------------------------------------------------------------------------- */

/* Debian's minimal image has no locale with a decimal comma, so the test makes one, from a
 * character map of its own. localedef complains about the categories left out, and writes it all
 * the same. */
static void make_comma_locale(void) {
    char command[SCENE_PATH_SIZE * 2];
    char map[8192];
    size_t used = (size_t)snprintf(map, sizeof map,
                                   "<code_set_name> TINY\n<mb_cur_min> 1\n"
                                   "<mb_cur_max> 1\nCHARMAP\n");
    for (int c = 0; c < 128; c++) {
        used += (size_t)snprintf(map + used, sizeof map - used, "<U%04X> /x%02x c\n", c, c);
    }
    used += (size_t)snprintf(map + used, sizeof map - used, "END CHARMAP\n");
    static const char source[] = "LC_NUMERIC\ndecimal_point \",\"\nthousands_sep \"\"\n"
                                 "grouping -1\nEND LC_NUMERIC\n";
    scene_write("map", map, used);
    scene_write("source", source, sizeof source - 1);
    (void)snprintf(command, sizeof command,
                   "cd '%s' && localedef -c --no-archive -f ./map -i ./source ./comma "
                   ">/dev/null 2>&1; test -f comma/LC_NUMERIC",
                   scene_folder);
    assert_int_equal(system(command), 0);
}

static void test_load_numbers_do_not_depend_on_the_locale(void **state) {
    char command[SCENE_PATH_SIZE];
    (void)state;
    make_comma_locale();
    assert_int_equal(setenv("LOCPATH", scene_folder, 1), 0);
    assert_non_null(setlocale(LC_NUMERIC, "comma"));
    assert_near(strtod("0,5", NULL), 0.5, 0.0); /* the locale is what it claims to be */

    daemon_config config = scene_load_good("rate_hz: 250.5\nbodies: []\n" SCENE_TOOLS);
    scene_expect_text_refused("rate_hz: 1000,5\nbodies: []\n" SCENE_TOOLS,
                              "1:10: rate_hz: '1000,5' is not a number; write it like 0.25");
    scene_expect_text_refused("rate_hz: 99.5\nbodies: []\n" SCENE_TOOLS,
                              "1:10: rate_hz: 99.5 is out of range, must lie in 100 .. 4000 Hz");
    assert_near(strtod("0,5", NULL), 0.5, 0.0); /* and the caller's locale is left alone */
    assert_non_null(setlocale(LC_NUMERIC, "C"));
    assert_near(config.rate_hz, 250.5, 0.0);
    config_free(&config);
    (void)snprintf(command, sizeof command, "rm -r '%s/comma'", scene_folder);
    assert_int_equal(system(command), 0);
    scene_remove("map");
    scene_remove("source");
    assert_int_equal(unsetenv("LOCPATH"), 0);
}

/* ---- the document ---------------------------------------------------------------------------- */

static bool document_has(const char *row) {
    char line[1024];
    bool found = false;
    FILE *file = fopen(DOCUMENT, "r");
    assert_non_null(file);
    while (!found && fgets(line, sizeof line, file) != NULL) {
        line[strcspn(line, "\n")] = '\0';
        found = strcmp(line, row) == 0;
    }
    assert_int_equal(fclose(file), 0);
    return found;
}

static void test_document_lists_every_device(void **state) {
    char row[1024];
    (void)state;
    for (const device_profile *p = device_profiles; p->name != NULL; p++) {
        (void)snprintf(row, sizeof row, "| `%s` | %g N | %g N m | %g N/s | %g N/m |", p->name,
                       p->force_max_n, p->torque_max_n_m, p->slew_max_n_per_s,
                       p->stiffness_max_n_per_m);
        if (!document_has(row)) {
            fail_msg("docs/scene-file.md lacks this row:\n%s", row);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_load_ellipsoid_scene_gives_its_values),
        cmocka_unit_test(test_load_organ_scene_finds_the_model_beside_it),
        cmocka_unit_test(test_built_in_is_what_the_document_says),
        cmocka_unit_test(test_load_tools_scene_gives_every_shape),
        cmocka_unit_test(test_load_point_files_in_other_forms),
        cmocka_unit_test(test_load_left_out_keys_take_defaults),
        cmocka_unit_test(test_load_scene_without_bodies_is_good),
        cmocka_unit_test(test_load_every_key_arrives),
        cmocka_unit_test(test_load_harmless_forms_are_accepted),
        cmocka_unit_test(test_load_bodies_of_one_file_share_one_model),
        cmocka_unit_test(test_load_stiffness_acts_with_the_given_value),
        cmocka_unit_test(test_load_numbers_do_not_depend_on_the_locale),
        cmocka_unit_test(test_document_lists_every_device),
    };
    return cmocka_run_group_tests(tests, scene_folder_make, scene_folder_remove);
}
