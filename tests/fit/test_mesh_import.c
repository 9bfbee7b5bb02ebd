/* SPDX-License-Identifier: BSD-3-Clause */
/* The four formats, good files and bad. The bad ones include what the importer would pass over in
 * silence or die of (mesh_scan.h lists it); each must end in one line that names the reason and the
 * place. */
#define _POSIX_C_SOURCE 200809L /* mkdtemp */

#include "mesh_files.h"

static void test_import_obj_in_its_varieties_is_read(void **state) {
    (void)state;
    accept_text("plain.obj", OBJ_VERTICES "f 1 3 2\n" OBJ_REST);
    accept_text("upper.OBJ", OBJ_VERTICES "f 1 3 2\n" OBJ_REST);
    accept_text("no_end_of_line.obj", OBJ_VERTICES OBJ_REST "f 1 3 2");
    accept_text("crlf.obj", "v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nv 0 0 1\r\nf 1 3 2\r\nf 1 2 4\r\n"
                            "f 2 3 4\r\nf 1 4 3\r\n");
    accept_text("backward.obj", OBJ_VERTICES "f -4 -2 -3\n" OBJ_REST);
    accept_text("faces_first.obj", "f 1 3 2\n" OBJ_REST OBJ_VERTICES);
    accept_text("continued.obj", OBJ_VERTICES "f 1 \\\n 3 2\n" OBJ_REST);
    accept_text("comments.obj", "# v 9 9 9\n" OBJ_VERTICES "f 1 3 2 # 4\n" OBJ_REST);
    accept_text("bare_points.obj", "v .0 0. 0\nv 1.e0 -.0 +0\nv 0 1E+0 0\nv 0 0 .1e1\n"
                                   "f 1 3 2\n" OBJ_REST);
    accept_text("textured.obj", "mtllib /dev/zero\nvt 0 0\nvn 0 0 1\n" OBJ_VERTICES
                                "usemtl a\nf 1/1 3/1/1 2//1\ns off\n" OBJ_REST "l 1 2\np 1\n");
    accept_text("groups.obj", OBJ_VERTICES "o one\ng a\nf 1 3 2\nf 1 2 4\no two\nusemtl m\n"
                                           "f 2 3 4\nf 1 4 3\n");
    accept_text("colours.obj", "v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\nv 0 0 1 1 0 0\n"
                               "f 1 3 2\n" OBJ_REST);
    accept_text("homogeneous.obj",
                "v 0 0 0 2\nv 2 0 0 2\nv 0 2 0 2\nv 0 0 1 1\nf 1 3 2\n" OBJ_REST);
}

static void test_import_obj_bad_structure_names_the_line(void **state) {
    (void)state;
    refuse_text("index.obj", OBJ_VERTICES "f 1 3 2\nf 1 2 5\n", SHCD_ERR_FORMAT,
                "line 6: '5' is not one of the 4 vertices");
    refuse_text("zero.obj", OBJ_VERTICES "f 0 3 2\n", SHCD_ERR_FORMAT,
                "line 5: '0' is not one of the 4 vertices");
    refuse_text("backward.obj", OBJ_VERTICES "f -5 3 2\n", SHCD_ERR_FORMAT,
                "line 5: '-5' is not one of the 4 vertices");
    refuse_text("fraction.obj", OBJ_VERTICES "f 1.7 3 2\n", SHCD_ERR_FORMAT,
                "line 5: '1.7' is not one of the 4 vertices");
    refuse_text("huge.obj", OBJ_VERTICES "f 1 3 18446744073709551618\n", SHCD_ERR_FORMAT,
                "line 5: '18446744073709551618' is not one of the 4 vertices");
    refuse_text("two_corners.obj", OBJ_VERTICES "f 1 2\n", SHCD_ERR_FORMAT,
                "line 5: a face needs three corners or more");
    refuse_text("comma.obj", "v 0 0 1,5\n" OBJ_VERTICES OBJ_REST, SHCD_ERR_FORMAT,
                "line 1: a vertex needs numbers");
    refuse_text("short.obj", OBJ_VERTICES "v 0 0\n", SHCD_ERR_FORMAT,
                "line 5: a vertex needs three numbers");
    refuse_text("twenty_digits.obj", "v 12345678901234567890 0 0\n", SHCD_ERR_FORMAT,
                "line 1: a vertex needs numbers");
    refuse_text("continued.obj", "v 0 0 \\\n0\nv 0 0\n", SHCD_ERR_FORMAT,
                "line 3: a vertex needs three numbers");
    refuse_text("no_text.obj", OBJ_VERTICES "f 1 \033[31m\300 2\n", SHCD_ERR_FORMAT,
                "line 5: '?[31m?' is not one of the 4 vertices");
}

static void test_import_obj_keeps_the_numbers_of_the_file(void **state) {
    shcd_mesh *mesh = NULL;
    shcd_mesh_report report;
    (void)state;
    /* triangle 1 is the second of the file although a group starts in between */
    refuse_text("nan.obj",
                "v 7 7 7\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 nan 1\ng a\nf 2 4 3\ng b\n"
                "f 2 3 5\nf 3 4 5\nf 2 5 4\n",
                SHCD_ERR_NOT_FINITE, "vertex 4 (0, nan, 0.001) is not finite; triangle 1 uses it");
    refuse_text("inf.obj", "v 1e999 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\n" OBJ_REST,
                SHCD_ERR_NOT_FINITE, "vertex 0 (inf, 0, 0) is not finite; triangle 0 uses it");
    assert_int_equal(import_bytes("unused.obj",
                                  "v nan inf 0\n" OBJ_VERTICES
                                  "f 2 4 3\nf 2 3 5\nf 3 4 5\nf 2 5 4\nv 8 8 8\n",
                                  12 + 32 + 32 + 8, &mesh, &report, NULL),
                     SHCD_OK);
    assert_int_equal(report.n_vertices_read, 6);
    assert_int_equal(report.n_vertices_unused, 2);
    assert_int_equal(report.n_vertices_merged, 0);
    shcd_mesh_free(mesh);
}

static void test_import_off_in_its_varieties_is_read(void **state) {
    (void)state;
    accept_text("plain.off", "OFF\n4 4 6\n" INDEXED_VERTICES "3 0 2 1\n" INDEXED_REST);
    accept_text("one_line.off", "OFF 4 4 6\n" INDEXED_VERTICES "3 0 2 1\n" INDEXED_REST);
    accept_text("no_edges.off", "OFF\n4 4\n" INDEXED_VERTICES "3 0 2 1\n" INDEXED_REST);
    accept_text("comments.off", "OFF # 1\n# 2\n\n4 4 6\n\n" INDEXED_VERTICES
                                "# 3\n\n3 0 2 1 # 4\n# 5\n" INDEXED_REST);
    accept_text("face_colours.off",
                "OFF\n4 4 6\n" INDEXED_VERTICES "3 0 2 1 255 0 0\n" INDEXED_REST);
    accept_text("colours.off", "COFF\n4 4 6\n0 0 0 9 9 9 9\n1 0 0 9 9 9 9\n0 1 0 9 9 9 9\n"
                               "0 0 1 9 9 9 9\n3 0 2 1\n" INDEXED_REST);
    accept_text("normals.off", "NOFF\n4 4 6\n0 0 0 1 0 0\n1 0 0 1 0 0\n0 1 0 1 0 0\n0 0 1 1 0 0\n"
                               "3 0 2 1\n" INDEXED_REST);
}

static void test_import_off_bad_structure_names_the_line(void **state) {
    (void)state;
    refuse_text("index.off", "OFF\n4 4 6\n" INDEXED_VERTICES "3 0 2 4\n" INDEXED_REST,
                SHCD_ERR_FORMAT, "line 7: '4' is not one of the 4 vertices (the first is 0)");
    refuse_text("negative.off", "OFF\n4 4 6\n" INDEXED_VERTICES "3 0 2 -1\n" INDEXED_REST,
                SHCD_ERR_FORMAT, "line 7: '-1' is not one of the 4 vertices (the first is 0)");
    refuse_text("cut.off", "OFF\n4 4 6\n" INDEXED_VERTICES INDEXED_REST, SHCD_ERR_FORMAT,
                "line 9: the file ends before its 4 faces");
    refuse_text("cut_vertices.off", "OFF\n4 4 6\n0 0 0\n", SHCD_ERR_FORMAT,
                "line 3: the file ends before its 4 vertices");
    refuse_text("corners.off", "OFF\n4 4 6\n" INDEXED_VERTICES "3 0 2\n" INDEXED_REST,
                SHCD_ERR_FORMAT, "line 7: a face of 3 corners lists 2");
    refuse_text("no_corners.off", "OFF\n4 4 6\n" INDEXED_VERTICES "0\n" INDEXED_REST,
                SHCD_ERR_FORMAT, "line 7: a face needs 3 to 9 corners");
    refuse_text("claims.off", "OFF\n400000000 4 6\n" INDEXED_VERTICES, SHCD_ERR_FORMAT,
                "line 2: the numbers of vertices and faces are missing, or more than the file can "
                "hold");
    refuse_text("head.off", "4 4 6\n" INDEXED_VERTICES, SHCD_ERR_FORMAT,
                "line 1: an OFF file starts with OFF (or with COFF, NOFF, STOFF; other kinds are "
                "not read)");
    refuse_text("junk.off", "OFF\n4 4 6\n0 0 x\n", SHCD_ERR_FORMAT,
                "line 3: a vertex needs three numbers");
    refuse_text("nan.off", "OFF\n4 4 6\n0 0 nan\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n" INDEXED_REST,
                SHCD_ERR_NOT_FINITE, "vertex 0 (0, 0, nan) is not finite; triangle 0 uses it");
}

static void test_import_ply_text_is_read(void **state) {
    (void)state;
    accept_text("plain.ply", PLY_HEAD("ascii", "4", "4") INDEXED_VERTICES "3 0 2 1\n" INDEXED_REST);
    accept_text("more.ply",
                "ply\nformat ascii 1.0\nobj_info x\nelement vertex 4\nproperty double x\n"
                "property double y\nproperty double z\nproperty uchar red\nelement face 4\n"
                "property uchar flag\nproperty list uchar uint vertex_index\nelement camera 1\n"
                "property float f\nend_header\n0 0 0 9\n1 0 0 9\n0 1 0 9\n0 0 1 9\n"
                "7 3 0 2 1\n7 3 0 1 3\n7 3 1 2 3\n7 3 0 3 2\n35.5\n");
}

static void test_import_ply_bad_structure_is_named(void **state) {
    (void)state;
    refuse_text("index.ply", PLY_HEAD("ascii", "4", "4") INDEXED_VERTICES "3 0 2 4\n" INDEXED_REST,
                SHCD_ERR_FORMAT, "line 15: '4' is not one of the 4 vertices (the first is 0)");
    refuse_text("negative.ply",
                PLY_HEAD("ascii", "4", "4") INDEXED_VERTICES "3 0 2 -1\n" INDEXED_REST,
                SHCD_ERR_FORMAT, "line 15: '-1' is not one of the 4 vertices (the first is 0)");
    refuse_text("cut.ply", PLY_HEAD("ascii", "4", "4") INDEXED_VERTICES INDEXED_REST,
                SHCD_ERR_FORMAT, "line 17: the file ends before all that its header declares");
    refuse_text("no_corners.ply", PLY_HEAD("ascii", "4", "4") INDEXED_VERTICES "0\n" INDEXED_REST,
                SHCD_ERR_FORMAT, "line 15: a face needs three corners or more");
    refuse_text("one_more.ply",
                PLY_HEAD("ascii", "5", "4") INDEXED_VERTICES "3 0 2 1\n" INDEXED_REST,
                SHCD_ERR_FORMAT, "line 18: the file ends before all that its header declares");
    refuse_text("junk.ply", PLY_HEAD("ascii", "4", "4") "0 0 x\n", SHCD_ERR_FORMAT,
                "line 11: a number is missing");
    refuse_text("claims.ply", PLY_HEAD("ascii", "4", "2000000000") INDEXED_VERTICES,
                SHCD_ERR_FORMAT,
                "line 8: a header line that is not understood, out of place, or declares more than "
                "the file can hold");
    refuse_text("no_faces.ply",
                "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                "property float z\nend_header\n0 0 0\n",
                SHCD_ERR_FORMAT,
                "line 7: the header must declare a format, first one element vertex with x, y, z "
                "and next one element face with a list vertex_indices");
    refuse_text("camera_first.ply",
                "ply\nformat ascii 1.0\nelement camera 1\nproperty float f\nelement vertex "
                "1\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty "
                "list uchar int vertex_indices\nend_header\n",
                SHCD_ERR_FORMAT,
                "line 11: the header must declare a format, first one element vertex with x, y, z "
                "and next one element face with a list vertex_indices");
    refuse_text("property_first.ply", "ply\nformat ascii 1.0\nproperty float x\n", SHCD_ERR_FORMAT,
                "line 3: a header line that is not understood, out of place, or declares more than "
                "the file can hold");
    refuse_text("head.ply", "hello\n", SHCD_ERR_FORMAT, "line 1: a PLY file starts with ply");
    refuse_text("head_only.ply", "ply\nformat ascii 1.0\n", SHCD_ERR_FORMAT,
                "line 2: the file ends within its header");
}

/* Appends a number of `n` bytes in the given byte order. */
static size_t put_bits(unsigned char *to, uint64_t bits, size_t n, int is_big) {
    for (size_t k = 0; k < n; ++k) {
        to[is_big ? n - 1 - k : k] = (unsigned char)(bits >> (8 * k));
    }
    return n;
}

static size_t put_float(unsigned char *to, float value, int is_big) {
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return put_bits(to, bits, sizeof bits, is_big);
}

static const float corner_of[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
static const uint32_t face_of[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};

static size_t binary_ply(unsigned char *bytes, int is_big, uint32_t first_index) {
    static const char head[2][256] = {PLY_HEAD("binary_little_endian", "4", "4"),
                                      PLY_HEAD("binary_big_endian", "4", "4")};
    size_t n = strlen(head[is_big]);
    memcpy(bytes, head[is_big], n);
    for (size_t i = 0; i < 12; ++i) {
        n += put_float(bytes + n, corner_of[i / 3][i % 3], is_big);
    }
    for (size_t i = 0; i < 12; ++i) {
        if (i % 3 == 0) {
            bytes[n++] = 3;
        }
        n += put_bits(bytes + n, i == 0 ? first_index : face_of[i / 3][i % 3], 4, is_big);
    }
    return n;
}

static void test_import_ply_binary_is_read_in_both_byte_orders(void **state) {
    unsigned char bytes[512];
    (void)state;
    for (int is_big = 0; is_big < 2; ++is_big) {
        size_t n = binary_ply(bytes, is_big, 0);
        accept_bytes("binary.ply", bytes, n, 4);
        refuse_bytes("cut.ply", bytes, n - 7, SHCD_ERR_FORMAT,
                     "the file ends before all that its header declares");
        n = binary_ply(bytes, is_big, 4);
        refuse_bytes("index.ply", bytes, n, SHCD_ERR_FORMAT,
                     "face 0 refers to vertex 4, but there are only 4");
        n = binary_ply(bytes, is_big, UINT32_MAX);
        refuse_bytes("negative.ply", bytes, n, SHCD_ERR_FORMAT,
                     "face 0 refers to vertex -1, but there are only 4");
    }
}

#define FACET(a, b, c)                                                                             \
    "facet normal 0 0 0\n outer loop\n  vertex " a "\n  vertex " b "\n  vertex " c                 \
    "\n endloop\nendfacet\n"
#define STL_HALF FACET("0 0 0", "0 1 0", "1 0 0") FACET("0 0 0", "1 0 0", "0 0 1")
#define STL_REST FACET("1 0 0", "0 1 0", "0 0 1") FACET("0 0 0", "0 0 1", "0 1 0")

static void test_import_stl_text_joins_solids(void **state) {
    static const char one[] = "solid t\n" STL_HALF STL_REST "endsolid t\n";
    static const char two[] =
        "solid a b\n" STL_HALF "endsolid a b\nsolid b\n" STL_REST "endsolid\n";
    (void)state;
    accept_bytes("one.stl", one, sizeof one - 1, 12);
    accept_bytes("two.stl", two, sizeof two - 1, 12);
}

static void test_import_stl_text_bad_structure_names_the_line(void **state) {
    (void)state;
    refuse_text("cut.stl", "solid t\n" STL_HALF, SHCD_ERR_FORMAT,
                "line 15: the file ends before endsolid");
    refuse_text("cut_facet.stl", "solid t\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\n",
                SHCD_ERR_FORMAT, "line 4: the file ends before endsolid");
    refuse_text("junk.stl", "solid t\n" FACET("0 0 0", "0 x 0", "1 0 0"), SHCD_ERR_FORMAT,
                "line 5: a vertex needs three numbers");
    refuse_text("two.stl", "solid t\nfacet\nvertex 0 0 0\nvertex 0 0 0\nendfacet\n",
                SHCD_ERR_FORMAT, "line 5: 'endfacet' is out of place (a facet has 3 vertices)");
    refuse_text("nested.stl", "solid t\nfacet\nfacet\n", SHCD_ERR_FORMAT,
                "line 3: 'facet' is out of place (a facet has 3 vertices)");
    refuse_text("nan.stl", "solid t\n" FACET("0 0 0", "0 nan 0", "1 0 0") "endsolid t\n",
                SHCD_ERR_NOT_FINITE, "vertex 1 (0, nan, 0) is not finite; triangle 0 uses it");
    refuse_text("head.stl", "hello\n", SHCD_ERR_FORMAT,
                "not an STL file: neither 'solid' nor a binary header of 84 bytes");
}

static void test_import_stl_binary_is_read_and_its_size_checked(void **state) {
    unsigned char bytes[84 + 4 * 50] = "solid, says the header of a binary file";
    size_t n = 80;
    (void)state;
    n += put_bits(bytes + n, 4, 4, 0);
    for (size_t i = 0; i < 4; ++i) {
        n += 12; /* the normal stays zero */
        for (size_t k = 0; k < 9; ++k) {
            n += put_float(bytes + n, corner_of[face_of[i][k / 3]][k % 3], 0);
        }
        n += 2;
    }
    assert_int_equal(n, sizeof bytes);
    accept_bytes("binary.stl", bytes, n, 12);
    bytes[0] = 'x';
    accept_bytes("other_header.stl", bytes, n, 12);
    refuse_bytes("cut.stl", bytes, n - 1, SHCD_ERR_FORMAT,
                 "not an STL file, or cut: 4 facets would take 284 bytes, but there are 283");
    bytes[80] = 255;
    bytes[83] = 255;
    refuse_bytes("claims.stl", bytes, n, SHCD_ERR_FORMAT,
                 "not an STL file, or cut: 4278190335 facets would take 213909516834 bytes, but "
                 "there are 284");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_import_obj_in_its_varieties_is_read),
        cmocka_unit_test(test_import_obj_bad_structure_names_the_line),
        cmocka_unit_test(test_import_obj_keeps_the_numbers_of_the_file),
        cmocka_unit_test(test_import_off_in_its_varieties_is_read),
        cmocka_unit_test(test_import_off_bad_structure_names_the_line),
        cmocka_unit_test(test_import_ply_text_is_read),
        cmocka_unit_test(test_import_ply_bad_structure_is_named),
        cmocka_unit_test(test_import_ply_binary_is_read_in_both_byte_orders),
        cmocka_unit_test(test_import_stl_text_joins_solids),
        cmocka_unit_test(test_import_stl_text_bad_structure_names_the_line),
        cmocka_unit_test(test_import_stl_binary_is_read_and_its_size_checked),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
