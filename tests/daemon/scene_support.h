/* SPDX-License-Identifier: BSD-3-Clause */
/* Scene files made on the fly in a folder of their own, for the tests of the scene reader. */
#ifndef SHCD_TESTS_SCENE_SUPPORT_H
#define SHCD_TESTS_SCENE_SUPPORT_H

#include "config.h"
#include "support/check.h"

#include <stdbool.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#define SCENE_PATH_SIZE 4300
#define SCENE_TOOLS "tools: [{id: 0, name: probe, shape: point}]\n"
#define SCENE_EGG "bodies:\n  - name: egg\n    ellipsoid: {semi_axes_m: [0.08, 0.06, 0.05]}\n"

static char scene_folder[1024];

static inline int scene_folder_make(void **state) {
    const char *base = getenv("TMPDIR");
    (void)state;
    (void)snprintf(scene_folder, sizeof scene_folder, "%s/shcd-scene-XXXXXX",
                   base != NULL && base[0] != '\0' ? base : "/tmp");
    return mkdtemp(scene_folder) != NULL ? 0 : -1;
}

static inline int scene_folder_remove(void **state) {
    (void)state;
    return rmdir(scene_folder); /* fails if a test left something behind */
}

static inline void scene_path(const char *name, char *path) {
    (void)snprintf(path, SCENE_PATH_SIZE, "%s/%s", scene_folder, name);
}

static inline void scene_write(const char *name, const void *bytes, size_t size) {
    char path[SCENE_PATH_SIZE];
    scene_path(name, path);
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

static inline void scene_remove(const char *name) {
    char path[SCENE_PATH_SIZE];
    scene_path(name, path);
    assert_int_equal(remove(path), 0);
}

/* Loads a scene of these bytes; the file is gone afterwards. */
static inline bool scene_load_bytes(const void *bytes, size_t size, daemon_config *config,
                                    char *error, size_t error_size) {
    char path[SCENE_PATH_SIZE];
    scene_write("scene.yaml", bytes, size);
    scene_path("scene.yaml", path);
    const bool good = config_load(path, config, error, error_size);
    scene_remove("scene.yaml");
    return good;
}

/* The text must load. */
static inline daemon_config scene_load_good(const char *text) {
    daemon_config config = {0};
    char error[CONFIG_ERROR_SIZE] = "";
    if (!scene_load_bytes(text, strlen(text), &config, error, sizeof error)) {
        fail_msg("refused: %s", error);
    }
    return config;
}

/* The path must be refused without a trace in the config, with a line that starts like this. */
static inline void scene_expect_refusal(const char *path, const char *expected) {
    daemon_config config;
    daemon_config before;
    char error[CONFIG_ERROR_SIZE] = "";
    memset(&config, 0x5a, sizeof config);
    memset(&before, 0x5a, sizeof before);
    if (config_load(path, &config, error, sizeof error)) {
        config_free(&config);
        fail_msg("%s was accepted, expected: %s", path, expected);
    }
    if (strncmp(error, expected, strlen(expected)) != 0) {
        fail_msg("wrong refusal\n  said:     %s\n  expected: %s", error, expected);
    }
    assert_memory_equal(&config, &before, sizeof config);
    assert_null(strchr(error, '\n'));
}

/* The same for bytes; `expected` is what stands behind "FILE:". */
static inline void scene_expect_bytes_refused(const void *bytes, size_t size,
                                              const char *expected) {
    char path[SCENE_PATH_SIZE];
    char whole[SCENE_PATH_SIZE + 512];
    scene_write("scene.yaml", bytes, size);
    scene_path("scene.yaml", path);
    (void)snprintf(whole, sizeof whole, "%s:%s", path, expected);
    scene_expect_refusal(path, whole);
    scene_remove("scene.yaml");
}

static inline void scene_expect_text_refused(const char *text, const char *expected) {
    scene_expect_bytes_refused(text, strlen(text), expected);
}

#endif
