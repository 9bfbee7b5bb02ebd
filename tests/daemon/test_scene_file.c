/* SPDX-License-Identifier: BSD-3-Clause */
/* What the scene reader refuses: each file of the corpus with its line, column, key and reason, and
 * what is too large or too odd to be kept as a file. A refusal leaves the config as it was, is one
 * line long and prints nothing. */
#include "scene_support.h"

#include <dirent.h>
#include <fcntl.h>

#define EXPECTED SHCD_TEST_SCENES "/expected.txt"

/* ---- the corpus ------------------------------------------------------------------------------ */

/* Calls with "NAME.yaml" and the whole line of each case. */
static size_t for_each_case(void (*visit)(const char *name, const char *line, void *user),
                            void *user) {
    char line[1024];
    size_t n = 0;
    FILE *file = fopen(EXPECTED, "r");
    assert_non_null(file);
    while (fgets(line, sizeof line, file) != NULL) {
        char name[256];
        line[strcspn(line, "\n")] = '\0';
        if (line[0] != '#') {
            assert_int_equal(sscanf(line, "%255[^:]:", name), 1);
            visit(name, line, user);
            n++;
        }
    }
    assert_int_equal(fclose(file), 0);
    return n;
}

static void check_case(const char *name, const char *line, void *user) {
    char path[SCENE_PATH_SIZE];
    char expected[SCENE_PATH_SIZE];
    (void)user;
    (void)snprintf(path, sizeof path, "%s/%s", SHCD_TEST_SCENES, name);
    (void)snprintf(expected, sizeof expected, "%s/%s", SHCD_TEST_SCENES, line);
    scene_expect_refusal(path, expected);
}

static void test_load_corpus_gives_expected_lines(void **state) {
    (void)state;
    assert_true(for_each_case(check_case, NULL) > 0);
}

static void mark_case(const char *name, const char *line, void *user) {
    const char **wanted = user;
    (void)line;
    if (*wanted != NULL && strcmp(name, *wanted) == 0) {
        *wanted = NULL;
    }
}

static void test_corpus_every_file_has_a_line(void **state) {
    DIR *folder = opendir(SHCD_TEST_SCENES);
    (void)state;
    assert_non_null(folder);
    for (const struct dirent *entry; (entry = readdir(folder)) != NULL;) {
        const size_t length = strlen(entry->d_name);
        const char *wanted = entry->d_name;
        if (length < 5 || strcmp(entry->d_name + length - 5, ".yaml") != 0) {
            continue;
        }
        (void)for_each_case(mark_case, &wanted);
        if (wanted != NULL) {
            fail_msg("%s has no line in expected.txt", wanted);
        }
    }
    assert_int_equal(closedir(folder), 0);
}

static void test_load_corpus_prints_nothing(void **state) {
    char path[SCENE_PATH_SIZE];
    struct stat size;
    (void)state;
    scene_path("stderr", path);
    (void)fflush(stderr);
    const int saved = dup(STDERR_FILENO);
    const int caught = open(path, O_RDWR | O_CREAT | O_TRUNC, 0600);
    assert_true(saved >= 0 && caught >= 0);
    assert_true(dup2(caught, STDERR_FILENO) >= 0);
    (void)for_each_case(check_case, NULL);
    (void)fflush(stderr);
    assert_true(dup2(saved, STDERR_FILENO) >= 0);
    assert_int_equal(fstat(caught, &size), 0);
    (void)close(caught);
    (void)close(saved);
    scene_remove("stderr");
    assert_int_equal(size.st_size, 0);
}

/* The reason that the library gives for a model must reach the user. */
static void test_load_bad_model_carries_the_librarys_reason(void **state) {
    static const char model[] = "not a model at all, but forty-odd bytes of text";
    static const char text[] = "bodies: [{name: a, model: bad.shcd}]\n" SCENE_TOOLS;
    char path[SCENE_PATH_SIZE];
    char expected[512];
    shcd_error reason = {SHCD_OK, ""};
    shcd_model *none = NULL;
    (void)state;
    scene_write("bad.shcd", model, sizeof model);
    scene_path("bad.shcd", path);
    assert_int_not_equal(shcd_model_load(path, NULL, &none, &reason), SHCD_OK);
    assert_true(reason.message[0] != '\0');
    (void)snprintf(expected, sizeof expected,
                   "1:27: bodies[0].model: no body can be made from it: %s", reason.message);
    scene_expect_text_refused(text, expected);
    scene_remove("bad.shcd");
}

/* ---- files that are no text ------------------------------------------------------------------ */

static void test_load_missing_file_names_it(void **state) {
    char path[SCENE_PATH_SIZE];
    char expected[SCENE_PATH_SIZE + 100];
    (void)state;
    scene_path("absent.yaml", path);
    (void)snprintf(expected, sizeof expected, "%s: cannot be opened: No such file or directory",
                   path);
    scene_expect_refusal(path, expected);
}

static void test_load_folder_and_pipe_are_refused(void **state) {
    char path[SCENE_PATH_SIZE];
    char expected[SCENE_PATH_SIZE + 100];
    (void)state;
    (void)snprintf(expected, sizeof expected, "%s: is a directory", scene_folder);
    scene_expect_refusal(scene_folder, expected);
    scene_path("pipe", path);
    assert_int_equal(mkfifo(path, 0600), 0);
    (void)snprintf(expected, sizeof expected, "%s: is not a regular file", path);
    scene_expect_refusal(path, expected); /* returns at once, though nobody writes */
    scene_remove("pipe");
}

static void test_load_binary_is_refused(void **state) {
    unsigned char bytes[4096];
    check_random random = {1};
    (void)state;
    for (size_t i = 0; i < sizeof bytes; i++) {
        bytes[i] = (unsigned char)check_random_bits(&random);
    }
    bytes[0] = 0x7f;
    scene_expect_bytes_refused(bytes, sizeof bytes, "1:1: scene: control character U+007F");
}

/* libfyaml itself stops silently at the first such byte, as if the file ended there. */
static void test_load_bytes_that_are_not_text_are_placed(void **state) {
    static const struct {
        const char *bytes;
        size_t size;
        const char *expected;
    } cases[] = {
        {"rate_hz: 1000\0\n", 15, "1:14: scene: control character U+0000"},
        {"a: 1\nb: \x1b[31m\n", 13, "2:4: scene: control character U+001B"},
        {"# b\xe4r\n", 6, "1:4: scene: byte 0xe4 is not UTF-8"},
        {"# \xc3\xa4\xc3", 5, "1:4: scene: byte 0xc3 is not UTF-8"},
        {"\n# \xc0\xaf\n", 6, "2:3: scene: byte 0xc0 is not UTF-8"},
        {"# \xed\xa0\x80\n", 6, "1:3: scene: byte 0xed is not UTF-8"},
        {"# \xf8\x88\x80\x80\x80\n", 8, "1:3: scene: byte 0xf8 is not UTF-8"},
        {"# \xf4\x90\x80\x80\n", 7, "1:3: scene: byte 0xf4 is not UTF-8"},
        {"\xff\xfe#\0\n\0", 6, "1:1: scene: byte 0xff is not UTF-8"},
        {"# \xc2\x85 b\n", 7, "1:3: scene: control character U+0085"},
    };
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        scene_expect_bytes_refused(cases[i].bytes, cases[i].size, cases[i].expected);
    }
}

/* A message quotes the file: escapes in it must not reach the terminal, nor break the line. */
static void test_load_escapes_in_messages_are_defused(void **state) {
    (void)state;
    scene_expect_text_refused("\"a\\e[31m\\n\\x9b\": 1\n", "1:1: a?[31m???: unknown key");
    scene_expect_text_refused("device: \"\\e]0;x\\a\"\n" SCENE_EGG SCENE_TOOLS,
                              "1:9: device: holds the control character 0x1b");
}

/* ---- sizes ----------------------------------------------------------------------------------- */

static char *make_text(size_t size) {
    char *text = malloc(size);
    assert_non_null(text);
    return text;
}

static void test_load_size_limit_is_one_mebibyte(void **state) {
    static const char scene[] = "bodies: []\n" SCENE_TOOLS;
    const size_t size = ((size_t)1 << 20) + 1;
    char *text = make_text(size);
    daemon_config config = {0};
    char error[CONFIG_ERROR_SIZE] = "";
    (void)state;
    memset(text, '#', size);
    memcpy(text, scene, sizeof scene - 1);
    scene_expect_bytes_refused(text, size, "1:1: scene: the file is larger than 1 MiB");
    assert_true(scene_load_bytes(text, size - 1, &config, error, sizeof error));
    config_free(&config);
    free(text);
}

/* Repeats a piece to fill 1 MiB; nothing of that kind may take long or much. */
static void expect_repeated_refused(const char *piece, const char *expected) {
    const size_t size = (size_t)1 << 20;
    const size_t length = strlen(piece);
    char *text = make_text(size);
    for (size_t i = 0; i < size; i++) {
        text[i] = piece[i % length];
    }
    scene_expect_bytes_refused(text, size, expected);
    free(text);
}

static void test_load_repetitions_are_refused(void **state) {
    (void)state;
    expect_repeated_refused("[", "1:65537: scene: more than 65536 values");
    expect_repeated_refused("{", "1:65537: scene: more than 65536 values");
    expect_repeated_refused("- ", "1:33: [0][0]");
    expect_repeated_refused("a: [", "1:262148: scene: more than 65536 values");
    expect_repeated_refused("x: 1\n", "32768:4: x: more than 65536 values");
    expect_repeated_refused("[                               ", "1:513: [0][0]");
    expect_repeated_refused("- a\n", "65536:3: scene: more than 65536 values");
    expect_repeated_refused("---\n", "2:1: scene: a second document");
    expect_repeated_refused("%TAG !a! b\n", "1:1: scene: YAML directives");
    expect_repeated_refused("&ab ", "1:1: scene: anchors");
    expect_repeated_refused("\n", "1:1: scene: the file holds no scene");
}

/* n items of a list, each with its number in it twice. */
static void expect_many_refused(const char *before, const char *item, int n, const char *after,
                                const char *expected) {
    char *text = make_text(65536);
    size_t used = (size_t)snprintf(text, 65536, "%s", before);
    for (int i = 0; i < n; i++) {
        char number[16];
        (void)snprintf(number, sizeof number, "%d", i);
        for (const char *c = item; *c != '\0'; c++) {
            used += (size_t)snprintf(text + used, 65536 - used, "%s%s", *c == '@' ? number : "",
                                     *c == '@' ? "" : (char[]){*c, '\0'});
        }
    }
    (void)snprintf(text + used, 65536 - used, "%s", after);
    scene_expect_text_refused(text, expected);
    free(text);
}

static void test_load_too_many_bodies_or_tools_are_refused(void **state) {
    (void)state;
    expect_many_refused("bodies:\n", " - {name: b@, ellipsoid: {semi_axes_m: [1, 1, 1]}}\n", 65,
                        SCENE_TOOLS,
                        "66:4: bodies[64]: one too many; the list holds 65 bodies, at most 64 fit");
    expect_many_refused("bodies: []\ntools:\n", " - {id: @, name: t@, shape: point}\n", 17, "",
                        "19:4: tools[16]: one too many; the list holds 17 tools, at most 16 fit");
}

static void test_load_error_buffer_of_any_size_is_respected(void **state) {
    static const char text[] = "rate: 1\n";
    (void)state;
    for (size_t size = 0; size < 64; size++) {
        daemon_config config = {0};
        char error[65];
        memset(error, 'x', sizeof error);
        assert_false(scene_load_bytes(text, sizeof text - 1, &config, error, size));
        assert_int_equal(error[size], 'x');
        assert_true(size == 0 || memchr(error, '\0', size) != NULL);
    }
    daemon_config config = {0};
    assert_false(scene_load_bytes(text, sizeof text - 1, &config, NULL, 0));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_load_corpus_gives_expected_lines),
        cmocka_unit_test(test_corpus_every_file_has_a_line),
        cmocka_unit_test(test_load_corpus_prints_nothing),
        cmocka_unit_test(test_load_bad_model_carries_the_librarys_reason),
        cmocka_unit_test(test_load_missing_file_names_it),
        cmocka_unit_test(test_load_folder_and_pipe_are_refused),
        cmocka_unit_test(test_load_binary_is_refused),
        cmocka_unit_test(test_load_bytes_that_are_not_text_are_placed),
        cmocka_unit_test(test_load_escapes_in_messages_are_defused),
        cmocka_unit_test(test_load_size_limit_is_one_mebibyte),
        cmocka_unit_test(test_load_repetitions_are_refused),
        cmocka_unit_test(test_load_too_many_bodies_or_tools_are_refused),
        cmocka_unit_test(test_load_error_buffer_of_any_size_is_respected),
    };
    return cmocka_run_group_tests(tests, scene_folder_make, scene_folder_remove);
}
