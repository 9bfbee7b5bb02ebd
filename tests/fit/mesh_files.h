/* SPDX-License-Identifier: BSD-3-Clause */
/* Mesh files written by a test into a folder of its own and imported from there. The including file
 * asks for POSIX (mkdtemp). */
#ifndef SHCD_TESTS_MESH_FILES_H
#define SHCD_TESTS_MESH_FILES_H

#include "fit_support.h"

#include <float.h>
#include <sys/stat.h>
#include <unistd.h>

#define COUNT(array) (sizeof(array) / sizeof *(array))

static char folder[64];

static inline int make_folder(void **state) {
    (void)state;
    (void)snprintf(folder, sizeof folder, "%s", "/tmp/shcd_mesh_import_XXXXXX");
    return mkdtemp(folder) == NULL;
}

static inline int remove_folder(void **state) {
    (void)state;
    return rmdir(folder);
}

/* A file in the folder, named after its content's kind; imported, then removed. */
static inline shcd_status import_bytes(const char *file_name, const void *bytes, size_t size,
                                       shcd_mesh **mesh, shcd_mesh_report *report,
                                       shcd_error *error) {
    char path[128];
    FILE *file = NULL;
    shcd_status status = SHCD_OK;
    (void)snprintf(path, sizeof path, "%s/%s", folder, file_name);
    file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
    memset(report, 0, sizeof *report);
    report->struct_size = sizeof *report;
    status = shcd_mesh_import(path, 0.001, mesh, report, error);
    assert_int_equal(remove(path), 0);
    return status;
}

/* The tetrahedron with legs of 1 (file unit mm), whatever way the file says it. */
static inline void accept_bytes(const char *file_name, const void *bytes, size_t size,
                                size_t n_read) {
    shcd_mesh *mesh = NULL;
    shcd_mesh_report report;
    shcd_error error = {SHCD_OK, ""};
    if (import_bytes(file_name, bytes, size, &mesh, &report, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    assert_int_equal(report.n_vertices_read, n_read);
    assert_int_equal(report.n_triangles_read, 4);
    assert_int_equal(report.n_vertices, 4);
    assert_int_equal(report.n_triangles, 4);
    assert_int_equal(report.turned_inside_out, 0);
    assert_int_equal(report.n_triangles_flipped, 0);
    assert_near(report.volume_m3, 1e-9 / 6.0, 8.0 * DBL_EPSILON * 1e-9);
    shcd_mesh_free(mesh);
}

static inline void accept_text(const char *file_name, const char *text) {
    accept_bytes(file_name, text, strlen(text), 4);
}

/* The message is the path, then `reason`. */
static inline void refuse_bytes(const char *file_name, const void *bytes, size_t size,
                                shcd_status status, const char *reason) {
    char expected[256];
    shcd_mesh *mesh = NULL;
    shcd_mesh_report report;
    shcd_error error = {SHCD_OK, ""};
    const shcd_status got = import_bytes(file_name, bytes, size, &mesh, &report, &error);
    (void)snprintf(expected, sizeof expected, "%s/%s: %s", folder, file_name, reason);
    assert_string_equal(error.message, expected);
    assert_int_equal(got, status);
    assert_null(mesh);
}

static inline void refuse_text(const char *file_name, const char *text, shcd_status status,
                               const char *reason) {
    refuse_bytes(file_name, text, strlen(text), status, reason);
}

#define OBJ_VERTICES "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
#define OBJ_REST "f 1 2 4\nf 2 3 4\nf 1 4 3\n"
#define INDEXED_VERTICES "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"
#define INDEXED_REST "3 0 1 3\n3 1 2 3\n3 0 3 2\n"
#define PLY_HEAD(format, vertices, faces)                                                          \
    "ply\nformat " format " 1.0\ncomment made by a test\nelement vertex " vertices                 \
    "\nproperty float x\nproperty float y\nproperty float z\nelement face " faces                  \
    "\nproperty list uchar int vertex_indices\nend_header\n"

#endif
