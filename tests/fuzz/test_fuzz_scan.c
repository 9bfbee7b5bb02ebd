/* SPDX-License-Identifier: BSD-3-Clause */
/* The scanners that stand in front of the mesh importer, fed with mutations of the files in
 * tests/fit/meshes. What they accept must be consistent, no larger than the file allows, and as
 * plain as it gets: scanned once more it comes out the same. (With -fsanitize=address the exact
 * size of the buffers makes every byte read too far a failure.) */
#define _POSIX_C_SOURCE 200809L /* scandir */

#include "mutate.h"

#include "mesh_scan.h"

#include <dirent.h>

enum { N_FORMATS = 4, N_SEEDS_MAX = 256, CAPACITY = 1 << 14, N_CASES = 2000000 };

typedef struct format {
    const char *extension;
    shcdi_mesh_scan scan;
} format;

static const format formats[N_FORMATS] = {{".obj", shcdi_scan_obj},
                                          {".ply", shcdi_scan_ply},
                                          {".stl", shcdi_scan_stl},
                                          {".off", shcdi_scan_off}};

typedef struct seed {
    unsigned char *bytes;
    size_t size;
} seed;

static seed seeds[N_FORMATS][N_SEEDS_MAX]; /* those that pass the scan come first */
static size_t n_seeds[N_FORMATS], n_good[N_FORMATS];

static const char *const pieces[] = {"nan",
                                     "-inf",
                                     "1e999",
                                     "1e-99999",
                                     ".5",
                                     "1.",
                                     "1e",
                                     "0x1",
                                     "0",
                                     "-1",
                                     "3",
                                     "4",
                                     "1001",
                                     "2147483648",
                                     "4294967296",
                                     "18446744073709551616",
                                     "\n",
                                     "\r\n",
                                     " ",
                                     "\t\v\f",
                                     "#",
                                     "\\\n",
                                     "\xff",
                                     "v ",
                                     "f ",
                                     "1/1/1",
                                     "//",
                                     "vertex ",
                                     "facet ",
                                     "endfacet\n",
                                     "outer loop\n",
                                     "endloop\n",
                                     "solid\n",
                                     "endsolid\n",
                                     "element vertex 4\n",
                                     "element face 1\n",
                                     "element e 9\n",
                                     "property uchar q\n",
                                     "property list uchar int vertex_indices\n",
                                     "property double x\n",
                                     "end_header\n",
                                     "binary_little_endian",
                                     "list",
                                     "uchar",
                                     "OFF\n",
                                     "COFF\n",
                                     "3 0 1 2\n",
                                     "10 0 0 0\n"};
static const mutate_tokens tokens = {pieces, sizeof pieces / sizeof pieces[0]};

static shcdi_mesh_file file_of(const void *bytes, size_t size, shcd_error *error) {
    shcdi_mesh_file file = {"mesh", malloc(size + (size == 0)), size, 0, 0, 0, NULL, 0, 0, error};
    assert_non_null(file.bytes);
    if (size > 0) {
        memcpy(file.bytes, bytes, size);
    }
    return file;
}

static void file_free(shcdi_mesh_file *file) {
    free(file->bytes);
    free(file->faces);
}

static void read_seed(size_t f, const char *name) {
    char path[1024];
    FILE *file = NULL;
    seed *s = &seeds[f][n_seeds[f]++];
    shcdi_mesh_file scanned;
    assert_true(n_seeds[f] <= N_SEEDS_MAX);
    (void)snprintf(path, sizeof path, "%s/%s", SHCD_BAD_MESHES, name);
    file = fopen(path, "rb");
    assert_non_null(file);
    s->bytes = malloc(CAPACITY);
    assert_non_null(s->bytes);
    s->size = fread(s->bytes, 1, CAPACITY, file);
    assert_true(s->size < CAPACITY);
    (void)fclose(file);
    scanned = file_of(s->bytes, s->size, NULL);
    if (formats[f].scan(&scanned) == SHCD_OK) {
        const seed bad = seeds[f][n_good[f]];
        seeds[f][n_good[f]++] = *s;
        *s = bad;
    }
    file_free(&scanned);
}

static int read_seeds(void **state) {
    struct dirent **names = NULL;
    const int n = scandir(SHCD_BAD_MESHES, &names, NULL, alphasort);
    (void)state;
    assert_true(n > 0);
    for (int i = 0; i < n; ++i) {
        const char *dot = strrchr(names[i]->d_name, '.');
        for (size_t f = 0; dot != NULL && f < N_FORMATS; ++f) {
            if (strcmp(dot, formats[f].extension) == 0) {
                read_seed(f, names[i]->d_name);
            }
        }
        free(names[i]);
    }
    free(names);
    return 0;
}

static int free_seeds(void **state) {
    (void)state;
    for (size_t f = 0; f < N_FORMATS; ++f) {
        for (size_t i = 0; i < n_seeds[f]; ++i) {
            free(seeds[f][i].bytes);
        }
    }
    return 0;
}

static void check_refusal(shcd_status status, const shcd_error *error) {
    assert_int_equal(status, SHCD_ERR_FORMAT);
    assert_int_equal(error->status, SHCD_ERR_FORMAT);
    assert_memory_equal(error->message, "mesh: ", 6);
    for (const char *c = error->message; *c != '\0'; ++c) {
        assert_in_range((unsigned char)*c, ' ', '~');
    }
}

static void check_faces(const shcdi_mesh_file *file) {
    size_t at = 0, n_faces = 0, n_corners = 0;
    for (; at < file->faces_length; ++n_faces) {
        const size_t n = file->faces[at++];
        assert_in_range(n, 3, SHCDI_CORNERS_MAX);
        assert_true(n <= file->faces_length - at);
        for (size_t k = 0; k < n; ++k) {
            assert_true(file->faces[at++] < file->n_vertices);
        }
        n_corners += n;
    }
    assert_int_equal(n_faces, file->n_faces);
    assert_int_equal(n_corners, file->n_corners);
}

/* A vertex and a face take a byte of the file at least. The plain text is longer by a 0 before a
 * point, by a header, and where an index counted backward takes more digits forward. */
static void check_accepted(const shcdi_mesh_file *file, size_t size) {
    assert_true(file->n_vertices <= 3 * size);
    assert_true(file->n_faces <= size);
    assert_true(file->size <= 6 * size + 256);
}

/* 1 if the case was accepted. */
static unsigned check_case(size_t number) {
    const size_t f = number % N_FORMATS;
    check_random r = {0x5ca11ab1e0000000u + number};
    const size_t n_choices = mutate_below(&r, 4) == 0 ? n_seeds[f] : n_good[f];
    const seed *from = &seeds[f][mutate_below(&r, n_choices)];
    unsigned char *bytes = malloc(2 * CAPACITY);
    mutant m = {bytes, from->size, 2 * CAPACITY};
    shcd_error error = {SHCD_OK, ""}, again_error = {SHCD_OK, ""};
    shcdi_mesh_file file, again;
    shcd_status status = SHCD_OK;
    assert_non_null(bytes);
    memcpy(m.bytes, from->bytes, from->size);
    mutate(&r, &m, &tokens);
    file = file_of(m.bytes, m.size, &error);
    status = formats[f].scan(&file);
    if (status != SHCD_OK) {
        check_refusal(status, &error);
    } else {
        check_accepted(&file, m.size);
        if (formats[f].scan != shcdi_scan_stl) {
            check_faces(&file);
        }
        again = file_of(file.bytes, file.size, &again_error);
        if (formats[f].scan(&again) != SHCD_OK) {
            fail_msg("the plain text is refused: %s", again_error.message);
        }
        assert_int_equal(again.n_vertices, file.n_vertices);
        assert_int_equal(again.n_faces, file.n_faces);
        assert_int_equal(again.n_corners, file.n_corners);
        assert_int_equal(again.faces_length, file.faces_length);
        if (file.faces_length > 0) {
            assert_memory_equal(again.faces, file.faces, file.faces_length * sizeof *file.faces);
        }
        assert_int_equal(again.size, file.size);
        if (file.size > 0) {
            assert_memory_equal(again.bytes, file.bytes, file.size);
        }
        file_free(&again);
    }
    file_free(&file);
    free(bytes);
    return status == SHCD_OK;
}

static void test_scan_mutated_files_are_refused_or_consistent(void **state) {
    const size_t n = check_scaled(N_CASES);
    size_t n_accepted[N_FORMATS] = {0};
    (void)state;
    for (size_t i = 0; i < n; ++i) {
        n_accepted[i % N_FORMATS] += check_case(i);
    }
    for (size_t f = 0; f < N_FORMATS; ++f) {
        print_message("%s: %zu of %zu mutations accepted\n", formats[f].extension, n_accepted[f],
                      (n + N_FORMATS - 1 - f) / N_FORMATS);
        /* else the mutations are too wild to reach what lies behind the first checks */
        assert_true(n < 4000 || n_accepted[f] > n / N_FORMATS / 50);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_scan_mutated_files_are_refused_or_consistent),
    };
    return cmocka_run_group_tests(tests, read_seeds, free_seeds);
}
