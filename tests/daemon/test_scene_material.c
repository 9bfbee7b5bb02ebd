/* SPDX-License-Identifier: BSD-3-Clause */
/* `material:` of a body: what it gives to which effect, and what stands beside it. Two scenes are
 * compared by their states: one is taken by equal scenes only, all parameters included. */
#include "materials.h"
#include "scene_support.h"
#include "support/soft.h"

#include <stdlib.h>

#define DOCUMENT SHCD_SOURCE_DIR "/docs/scene-file.md"
#define BALL "  - name: ball\n    model: ball.shcd\n"

static void write_ball(void) {
    shcd_model *model = soft_sphere(0.05, 7);
    char path[SCENE_PATH_SIZE];
    scene_path("ball.shcd", path);
    assert_int_equal(shcd_model_save(model, path, NULL), SHCD_OK);
    shcd_model_free(model);
}

/* What follows the shape of the body in a scene with one point. */
static daemon_config load(const char *body) {
    char text[2048];
    (void)snprintf(text, sizeof text, "bodies:\n" BALL "%s" SCENE_TOOLS, body);
    return scene_load_good(text);
}

static bool are_equal(const char *body, const char *other) {
    daemon_config a = load(body), b = load(other);
    const size_t size = (shcd_state_size(a.scene) + 63) / 64 * 64;
    void *memory = aligned_alloc(64, size);
    shcd_state *state = NULL;
    shcd_tool_input in = {{{0.0, 0.0, 1.0}, {1.0, 0.0, 0.0, 0.0}}};
    shcd_tool_output out;
    const shcd_input input = {0.001, &in, 1};
    shcd_output output = {&out, 1};
    assert_int_equal(shcd_state_init(a.scene, memory, size, &state), SHCD_OK);
    const bool equal = shcd_step(b.scene, state, &input, &output) == SHCD_OK;
    free(memory);
    config_free(&a);
    config_free(&b);
    return equal;
}

/* E = 2 (1 + nu) G of the source's shear moduli. */
static void test_figures_are_the_source_s(void **state) {
    static const struct {
        const char *name;
        double shear_pa, density_kg_per_m3;
    } source[] = {{"liver", 1800.0, 1060.0},         {"diseased_liver", 19800.0, 0.0},
                  {"liver_carcinoma", 23400.0, 0.0}, {"stomach", 640.0, 0.0},
                  {"gallbladder", 85000.0, 0.0},     {"bile_duct", 166000.0, 0.0},
                  {"hepatic_artery", 210000.0, 0.0}};
    size_t n = 0;
    (void)state;
    for (const material *m = materials; m->name != NULL; m++, n++) {
        assert_string_equal(m->name, source[n].name);
        assert_near(m->youngs_modulus_pa / (2.0 * (1.0 + m->poisson_ratio)), source[n].shear_pa,
                    1e-9);
        assert_near(m->density_kg_per_m3, source[n].density_kg_per_m3, 0.0);
        assert_near(m->poisson_ratio, 0.45, 0.0);
        assert_true(strlen(m->source) > 0);
    }
    assert_int_equal(n, sizeof source / sizeof source[0]);
}

static void test_wave_takes_all_that_is_known(void **state) {
    (void)state;
    write_ball();
    assert_true(are_equal("    material: liver\n    effects: {wave: {}}\n",
                          "    effects: {wave: {youngs_modulus_pa: 5220, poisson_ratio: 0.45, "
                          "density_kg_per_m3: 1060}}\n"));
    assert_false(
        are_equal("    material: liver\n    effects: {wave: {}}\n", "    effects: {wave: {}}\n"));
    assert_true(are_equal("    material: stomach\n    effects: {wave: {}}\n",
                          "    effects: {wave: {youngs_modulus_pa: 1856}}\n"));
    scene_remove("ball.shcd");
}

static void test_what_the_scene_gives_counts(void **state) {
    (void)state;
    write_ball();
    assert_true(are_equal("    effects: {wave: {youngs_modulus_pa: 7000, poisson_ratio: 0.3}}\n"
                          "    material: stomach\n",
                          "    effects: {wave: {youngs_modulus_pa: 7000, poisson_ratio: 0.3}}\n"));
    scene_remove("ball.shcd");
}

/* The linear law stays linear; the Hertz law takes E where it says so, and nu. */
static void test_stiffness_takes_it_by_the_hertz_law_only(void **state) {
    (void)state;
    write_ball();
    assert_true(are_equal("    material: liver\n    effects: {stiffness: {}, wave: {}}\n",
                          "    effects: {stiffness: {k_n_per_m: 300}, wave: {youngs_modulus_pa: "
                          "5220}}\n"));
    assert_true(are_equal("    material: diseased_liver\n"
                          "    effects: {stiffness: {youngs_modulus_pa: material}}\n",
                          "    effects: {stiffness: {youngs_modulus_pa: 57420, poisson_ratio: "
                          "0.45}}\n"));
    assert_true(are_equal("    material: liver\n"
                          "    effects: {stiffness: {youngs_modulus_pa: 9000, poisson_ratio: "
                          "0.3}, wave: {}}\n",
                          "    effects: {stiffness: {youngs_modulus_pa: 9000, poisson_ratio: "
                          "0.3}, wave: {youngs_modulus_pa: 5220}}\n"));
    scene_remove("ball.shcd");
}

static void test_document_lists_every_material(void **state) {
    (void)state;
    for (const material *m = materials; m->name != NULL; m++) {
        char row[512], line[1024], density[64] = "not stated";
        bool found = false;
        FILE *file = fopen(DOCUMENT, "r");
        assert_non_null(file);
        if (m->density_kg_per_m3 > 0.0) {
            (void)snprintf(density, sizeof density, "%g kg/m^3", m->density_kg_per_m3);
        }
        (void)snprintf(row, sizeof row, "| `%s` | %g Pa | %g | %s | %s |", m->name,
                       m->youngs_modulus_pa, m->poisson_ratio, density, m->source);
        while (!found && fgets(line, sizeof line, file) != NULL) {
            line[strcspn(line, "\n")] = '\0';
            found = strcmp(line, row) == 0;
        }
        assert_int_equal(fclose(file), 0);
        if (!found) {
            fail_msg("docs/scene-file.md lacks this row:\n%s", row);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_figures_are_the_source_s),
        cmocka_unit_test(test_wave_takes_all_that_is_known),
        cmocka_unit_test(test_what_the_scene_gives_counts),
        cmocka_unit_test(test_stiffness_takes_it_by_the_hertz_law_only),
        cmocka_unit_test(test_document_lists_every_material),
    };
    return cmocka_run_group_tests(tests, scene_folder_make, scene_folder_remove);
}
