/* SPDX-License-Identifier: BSD-3-Clause */
/* Models in files: what is saved is loaded, a load that fails names its path, and a save that fails
 * changes nothing and leaves nothing behind. */
#define _POSIX_C_SOURCE 200809L

#include "shcd/shcd.h"
#include "support/bodies.h"
#include "support/check.h"

#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

static char folder[] = "test_model_path_XXXXXX";

static int folder_make(void **state) {
    (void)state;
    return mkdtemp(folder) == NULL;
}

static int folder_remove(void **state) {
    (void)state;
    return rmdir(folder); /* fails, and the group with it, if a test left something behind */
}

static void in_folder(char *out, size_t size, const char *name) {
    assert_true((size_t)snprintf(out, size, "%s/%s", folder, name) < size);
}

static void test_save_and_load_round_trip(void **state) {
    check_random random = {72};
    shcd_model *a = bodies_create_random(&random, 8, 0.05), *b = NULL;
    shcd_error error = {SHCD_OK, ""};
    char path[256];
    (void)state;
    in_folder(path, sizeof path, "a.shcd");
    assert_int_equal(shcd_model_save(a, path, &error), SHCD_OK);
    assert_int_equal(shcd_model_save(a, path, &error), SHCD_OK); /* over an old one */
    assert_int_equal(shcd_model_load(path, NULL, &b, &error), SHCD_OK);
    const shcd_model_info x = bodies_info(a), y = bodies_info(b);
    assert_memory_equal(&x, &y, sizeof x);
    assert_int_equal(unlink(path), 0);
    shcd_model_free(a);
    shcd_model_free(b);
}

static void assert_not_loaded(const char *path, shcd_status status) {
    shcd_error error = {SHCD_OK, ""};
    shcd_model *const untouched = (shcd_model *)(void *)&error;
    shcd_model *model = untouched;
    assert_int_equal(shcd_model_load(path, NULL, &model, &error), status);
    assert_int_equal(error.status, status);
    assert_ptr_equal(model, untouched);
    assert_true(strncmp(error.message, path, strlen(path)) == 0);
}

static void test_load_refuses_what_is_no_model_and_names_the_path(void **state) {
    static const char text[] = "solid not a model";
    char path[256];
    shcd_model *model = NULL;
    (void)state;
    in_folder(path, sizeof path, "absent.shcd");
    assert_not_loaded(path, SHCD_ERR_IO);
    assert_not_loaded(folder, SHCD_ERR_IO);
    FILE *out = fopen(path, "wb");
    assert_non_null(out);
    assert_int_equal(fclose(out), 0);
    assert_not_loaded(path, SHCD_ERR_FORMAT); /* empty */
    out = fopen(path, "wb");
    assert_non_null(out);
    assert_true(fputs(text, out) >= 0);
    assert_int_equal(fclose(out), 0);
    assert_not_loaded(path, SHCD_ERR_FORMAT);
    assert_int_equal(unlink(path), 0);
    assert_not_loaded("/dev/zero", SHCD_ERR_FORMAT); /* without an end: capped */
    assert_int_equal(shcd_model_load(NULL, NULL, &model, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_model_load(path, NULL, NULL, NULL), SHCD_ERR_ARGUMENT);
}

static void test_save_that_cannot_open_leaves_nothing_behind(void **state) {
    shcd_model *model = bodies_create_ellipsoid(1.0, 2.0, 3.0);
    char path[256], inner[300];
    struct stat status;
    shcd_error error = {SHCD_OK, ""};
    (void)state;
    in_folder(path, sizeof path, "absent");
    snprintf(inner, sizeof inner, "%s/a.shcd", path);
    assert_int_equal(shcd_model_save(model, inner, &error), SHCD_ERR_IO); /* no such folder */
    assert_non_null(strstr(error.message, inner));
    assert_int_equal(stat(path, &status), -1);
    assert_int_equal(mkdir(path, 0700), 0); /* a folder stands where the file should be */
    assert_int_equal(shcd_model_save(model, path, &error), SHCD_ERR_IO);
    assert_int_equal(stat(path, &status), 0);
    assert_true(S_ISDIR(status.st_mode));
    assert_int_equal(rmdir(path), 0);
    assert_int_equal(shcd_model_save(model, path, NULL), SHCD_OK);
    assert_int_equal(shcd_model_save(model, inner, NULL), SHCD_ERR_IO); /* and the other way */
    assert_int_equal(unlink(path), 0);
    assert_int_equal(shcd_model_save(NULL, path, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_model_save(model, NULL, NULL), SHCD_ERR_ARGUMENT);
    char *longest = malloc(8192);
    assert_non_null(longest);
    memset(longest, 'a', 8191);
    longest[8191] = '\0';
    assert_true(shcd_model_save(model, longest, &error) != SHCD_OK);
    free(longest);
    shcd_model_free(model);
}

static shcd_status save_with_room_for(size_t bytes, const shcd_model *model, const char *path) {
    struct rlimit before, limit;
    void (*const handler)(int) = signal(SIGXFSZ, SIG_IGN);
    assert_int_equal(getrlimit(RLIMIT_FSIZE, &before), 0);
    limit = before;
    limit.rlim_cur = bytes;
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &limit), 0);
    const shcd_status status = shcd_model_save(model, path, NULL);
    assert_int_equal(setrlimit(RLIMIT_FSIZE, &before), 0);
    signal(SIGXFSZ, handler);
    return status;
}

static void test_save_without_room_keeps_the_old_file(void **state) {
    shcd_model *old = bodies_create_ellipsoid(1.0, 2.0, 3.0), *back = NULL;
    shcd_model *larger = bodies_create_bent(1.0, 1.0, 1.0, 0.5);
    char path[256], beside[300];
    (void)state;
    in_folder(path, sizeof path, "a.shcd");
    assert_int_equal(save_with_room_for(100, larger, path), SHCD_ERR_IO);
    assert_int_equal(access(path, F_OK), -1);
    assert_int_equal(shcd_model_save(old, path, NULL), SHCD_OK);
    assert_int_equal(save_with_room_for(100, larger, path), SHCD_ERR_IO);
    assert_int_equal(shcd_model_load(path, NULL, &back, NULL), SHCD_OK);
    assert_int_equal(shcd_model_degree(back), 1);
    shcd_model_free(back);
    /* somebody's file with the name of the temporary one is not ours to overwrite */
    snprintf(beside, sizeof beside, "%s.part0", path);
    FILE *out = fopen(beside, "wb");
    assert_non_null(out);
    assert_int_equal(fclose(out), 0);
    assert_int_equal(shcd_model_save(larger, path, NULL), SHCD_OK);
    struct stat status;
    assert_int_equal(stat(beside, &status), 0);
    assert_int_equal(status.st_size, 0);
    assert_int_equal(unlink(beside), 0);
    assert_int_equal(unlink(path), 0);
    shcd_model_free(old);
    shcd_model_free(larger);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_save_and_load_round_trip),
        cmocka_unit_test(test_load_refuses_what_is_no_model_and_names_the_path),
        cmocka_unit_test(test_save_that_cannot_open_leaves_nothing_behind),
        cmocka_unit_test(test_save_without_room_keeps_the_old_file)};
    return cmocka_run_group_tests(tests, folder_make, folder_remove);
}
