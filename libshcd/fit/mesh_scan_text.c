/* SPDX-License-Identifier: BSD-3-Clause */
/* OBJ, OFF and STL: a text is read completely and rewritten in the plainest form of its format, so
 * that nothing but positions and faces reaches the importer. */
#include "mesh_scan.h"

#include "fail.h"

#include <string.h>

/* The importer skips OFF faces of more corners without a word. */
enum { OFF_CORNERS_MAX = 9 };

/* "v x y z", "v x y z w" (homogeneous) or "v x y z r g b". */
static shcd_status obj_vertex(shcdi_mesh_file *file, size_t line_number, shcdi_word line,
                              shcdi_plain *text) {
    shcdi_word words[7];
    size_t n = 0;
    while (n < 7 && shcdi_next_word(&line, &words[n])) {
        if (!shcdi_word_is_number(words[n])) {
            return shcdi_scan_fail(file, line_number, "a vertex needs numbers");
        }
        ++n;
    }
    if (n < 3) {
        return shcdi_scan_fail(file, line_number, "a vertex needs three numbers");
    }
    n = n == 4 ? 4 : 3;
    shcdi_plain_bytes(text, "v ", 2);
    for (size_t k = 0; k < n; ++k) {
        shcdi_plain_number(text, words[k], k + 1 < n ? ' ' : '\n');
    }
    return SHCD_OK;
}

/* A corner is "v", "v/vt", "v//vn" or "v/vt/vn"; v counts from 1, or backward from the latest. */
static shcd_status obj_corner(shcdi_mesh_file *file, size_t line_number, shcdi_word word,
                              size_t n_so_far, shcdi_plain *text) {
    const char *slash = memchr(word.begin, '/', (size_t)(word.end - word.begin));
    int64_t index = 0;
    if (slash != NULL) {
        word.end = slash;
    }
    if (!shcdi_word_integer(word, -(int64_t)n_so_far, (int64_t)file->n_vertices, &index) ||
        index == 0) {
        return shcdi_scan_fail(file, line_number, "'%.*s' is not one of the %zu vertices",
                               (int)(word.end - word.begin < 24 ? word.end - word.begin : 24),
                               word.begin, file->n_vertices);
    }
    index += index > 0 ? -1 : (int64_t)n_so_far;
    shcdi_plain_integer(text, (size_t)index + 1, ' ');
    return shcdi_append(file, (uint32_t)index) ? SHCD_OK : shcdi_scan_out_of_memory(file);
}

static shcd_status obj_face(shcdi_mesh_file *file, size_t line_number, shcdi_word line,
                            size_t n_so_far, shcdi_plain *text) {
    const size_t start = file->faces_length;
    shcdi_word word = {NULL, NULL};
    size_t n = 0;
    if (!shcdi_append(file, 0)) {
        return shcdi_scan_out_of_memory(file);
    }
    shcdi_plain_bytes(text, "f ", 2);
    while (shcdi_next_word(&line, &word)) {
        const shcd_status status = obj_corner(file, line_number, word, n_so_far, text);
        if (status != SHCD_OK) {
            return status;
        }
        ++n;
    }
    shcdi_plain_bytes(text, "\n", 1);
    if (n < 3) {
        return shcdi_scan_fail(file, line_number, "a face needs three corners or more");
    }
    if (n > SHCDI_CORNERS_MAX) {
        return shcdi_scan_many_corners(file, line_number);
    }
    file->faces[start] = (uint32_t)n;
    file->n_corners += n;
    ++file->n_faces;
    return SHCD_OK;
}

/* Faces may come before their vertices, so vertices are counted first. */
static size_t obj_count_vertices(const shcdi_mesh_file *file) {
    shcdi_cursor cursor = shcdi_cursor_at(file);
    shcdi_word line = {NULL, NULL}, word = {NULL, NULL};
    size_t n = 0;
    cursor.joins = 1;
    while (shcdi_next_line(&cursor, &line)) {
        n += shcdi_next_word(&line, &word) && shcdi_word_is(word, "v");
    }
    return n;
}

shcd_status shcdi_scan_obj(shcdi_mesh_file *file) {
    shcdi_cursor cursor = shcdi_cursor_at(file);
    shcdi_word line = {NULL, NULL}, word = {NULL, NULL};
    shcdi_plain text = {NULL, 0, 0, 0};
    shcd_status status = SHCD_OK;
    size_t n_so_far = 0;
    cursor.joins = 1;
    file->n_vertices = obj_count_vertices(file);
    while (status == SHCD_OK && shcdi_next_line(&cursor, &line)) {
        if (!shcdi_next_word(&line, &word)) {
            continue;
        }
        if (shcdi_word_is(word, "v")) {
            status = obj_vertex(file, cursor.line, line, &text);
            ++n_so_far;
        } else if (shcdi_word_is(word, "f")) {
            status = obj_face(file, cursor.line, line, n_so_far, &text);
        }
    }
    return shcdi_plain_end(&text, file, status);
}

/* The next line that holds a word; what is left of it after that word stays in `line`. */
static int next_filled_line(shcdi_cursor *cursor, shcdi_word *line, shcdi_word *word) {
    while (shcdi_next_line(cursor, line)) {
        if (shcdi_next_word(line, word)) {
            return 1;
        }
    }
    return 0;
}

/* "[ST][C][N]OFF", then the numbers of vertices, faces and edges, in the same line or the next. */
static shcd_status off_header(shcdi_mesh_file *file, shcdi_cursor *cursor, size_t *n_faces,
                              shcdi_plain *text) {
    static const char *const known[] = {"OFF",   "COFF",   "NOFF",   "CNOFF",
                                        "STOFF", "STCOFF", "STNOFF", "STCNOFF"};
    shcdi_word line = {NULL, NULL}, word = {NULL, NULL};
    int64_t count[2] = {0, 0};
    int is_known = 0;
    if (next_filled_line(cursor, &line, &word)) {
        for (size_t i = 0; i < sizeof known / sizeof known[0]; ++i) {
            is_known = is_known || shcdi_word_is(word, known[i]);
        }
    }
    if (!is_known) {
        return shcdi_scan_fail(file, cursor->line,
                               "an OFF file starts with OFF (or with COFF, NOFF, STOFF; other "
                               "kinds are not read)");
    }
    if (!shcdi_next_word(&line, &word) && !next_filled_line(cursor, &line, &word)) {
        return shcdi_scan_fail(file, cursor->line, "the file ends before its counts");
    }
    shcdi_plain_bytes(text, "OFF\n", 4);
    for (int k = 0; k < 2; ++k) {
        /* each vertex and each face takes a line */
        if ((k > 0 && !shcdi_next_word(&line, &word)) ||
            !shcdi_word_integer(word, 0, (int64_t)file->size, &count[k])) {
            return shcdi_scan_fail(file, cursor->line,
                                   "the numbers of vertices and faces are missing, or more than "
                                   "the file can hold");
        }
        shcdi_plain_integer(text, (size_t)count[k], ' ');
    }
    shcdi_plain_bytes(text, "0\n", 2);
    file->n_vertices = (size_t)count[0];
    *n_faces = (size_t)count[1];
    return SHCD_OK;
}

static shcd_status off_vertex(shcdi_mesh_file *file, shcdi_cursor *cursor, shcdi_plain *text) {
    shcdi_word line = {NULL, NULL}, word = {NULL, NULL};
    if (!next_filled_line(cursor, &line, &word)) {
        return shcdi_scan_fail(file, cursor->line, "the file ends before its %zu vertices",
                               file->n_vertices);
    }
    for (int k = 0; k < 3; ++k) {
        if ((k > 0 && !shcdi_next_word(&line, &word)) || !shcdi_word_is_number(word)) {
            return shcdi_scan_fail(file, cursor->line, "a vertex needs three numbers");
        }
        shcdi_plain_number(text, word, k < 2 ? ' ' : '\n');
    }
    return SHCD_OK;
}

static shcd_status off_face(shcdi_mesh_file *file, shcdi_cursor *cursor, size_t n_faces,
                            shcdi_plain *text) {
    shcdi_word line = {NULL, NULL}, word = {NULL, NULL};
    int64_t n = 0;
    shcd_status status = SHCD_OK;
    if (!next_filled_line(cursor, &line, &word)) {
        return shcdi_scan_fail(file, cursor->line, "the file ends before its %zu faces", n_faces);
    }
    if (!shcdi_word_integer(word, 3, OFF_CORNERS_MAX, &n)) {
        return shcdi_scan_fail(file, cursor->line, "a face needs 3 to %d corners", OFF_CORNERS_MAX);
    }
    status = shcdi_scan_face(file, cursor->line, &line, n);
    if (status == SHCD_OK) {
        shcdi_plain_face(text, file, (size_t)n);
    }
    return status;
}

shcd_status shcdi_scan_off(shcdi_mesh_file *file) {
    shcdi_cursor cursor = shcdi_cursor_at(file);
    shcdi_plain text = {NULL, 0, 0, 0};
    size_t n_faces = 0;
    shcd_status status = SHCD_OK;
    status = off_header(file, &cursor, &n_faces, &text);
    for (size_t v = 0; status == SHCD_OK && v < file->n_vertices; ++v) {
        status = off_vertex(file, &cursor, &text);
    }
    for (size_t i = 0; status == SHCD_OK && i < n_faces; ++i) {
        status = off_face(file, &cursor, n_faces, &text);
    }
    return shcdi_plain_end(&text, file, status);
}

/* "vertex x y z" within a facet. */
static shcd_status stl_vertex(shcdi_mesh_file *file, size_t line_number, shcdi_word line,
                              shcdi_plain *text) {
    shcdi_word word = {NULL, NULL};
    shcdi_plain_string(text, "vertex ");
    for (int k = 0; k < 3; ++k) {
        if (!shcdi_next_word(&line, &word) || !shcdi_word_is_number(word)) {
            return shcdi_scan_fail(file, line_number, "a vertex needs three numbers");
        }
        shcdi_plain_number(text, word, k < 2 ? ' ' : '\n');
    }
    return SHCD_OK;
}

/* One line that starts with `word`; `n_in_facet` is the number of vertices, or -1 outside. */
static shcd_status stl_line(shcdi_mesh_file *file, size_t line_number, shcdi_word word,
                            shcdi_word rest, int *n_in_facet, shcdi_plain *text) {
    if (shcdi_word_is(word, "facet") && *n_in_facet < 0) {
        shcdi_plain_string(text, "facet normal 0 0 0\nouter loop\n");
        *n_in_facet = 0;
        return SHCD_OK;
    }
    if (shcdi_word_is(word, "vertex") && *n_in_facet >= 0 && *n_in_facet < 3) {
        ++*n_in_facet;
        return stl_vertex(file, line_number, rest, text);
    }
    if (shcdi_word_is(word, "endfacet") && *n_in_facet == 3) {
        shcdi_plain_string(text, "endloop\nendfacet\n");
        *n_in_facet = -1;
        ++file->n_faces;
        return SHCD_OK;
    }
    if (shcdi_word_is(word, "outer") || shcdi_word_is(word, "endloop")) {
        return SHCD_OK;
    }
    return shcdi_scan_fail(file, line_number, "'%.*s' is out of place (a facet has 3 vertices)",
                           (int)(word.end - word.begin < 24 ? word.end - word.begin : 24),
                           word.begin);
}

/* Solids of facets; several may follow each other, and all are joined. */
static shcd_status scan_stl_text(shcdi_mesh_file *file, shcdi_plain *text) {
    shcdi_cursor cursor = shcdi_cursor_at(file);
    shcdi_word line = {NULL, NULL}, word = {NULL, NULL};
    shcd_status status = SHCD_OK;
    int is_open = 0, n_in_facet = -1;
    shcdi_plain_string(text, "solid s\n");
    while (status == SHCD_OK && shcdi_next_line(&cursor, &line)) {
        if (!shcdi_next_word(&line, &word)) {
            continue;
        }
        if (n_in_facet < 0 && (shcdi_word_is(word, "solid") || shcdi_word_is(word, "endsolid"))) {
            is_open = shcdi_word_is(word, "solid");
        } else {
            status = stl_line(file, cursor.line, word, line, &n_in_facet, text);
        }
    }
    shcdi_plain_string(text, "endsolid s\n");
    if (status == SHCD_OK && (is_open || n_in_facet >= 0)) {
        return shcdi_scan_fail(file, cursor.line, "the file ends before %s",
                               is_open ? "endsolid" : "endfacet");
    }
    return status;
}

static shcd_status rewrite_stl(shcdi_mesh_file *file) {
    shcdi_plain text = {NULL, 0, 0, 0};
    shcd_status status = SHCD_OK;
    status = scan_stl_text(file, &text);
    return shcdi_plain_end(&text, file, status);
}

shcd_status shcdi_scan_stl(shcdi_mesh_file *file) {
    enum { HEADER = 84, FACET = 50 };
    shcd_status status = SHCD_OK;
    uint64_t n = 0;
    if (file->size >= HEADER) {
        for (size_t k = 0; k < 4; ++k) {
            n |= (uint64_t)(unsigned char)file->bytes[HEADER - 4 + k] << (8 * k);
        }
    }
    /* Binary files may start with "solid" too: their size tells. */
    if (file->size >= HEADER && HEADER + FACET * n == file->size) {
        file->n_faces = (size_t)n;
    } else if (file->size >= 5 && memcmp(file->bytes, "solid", 5) == 0) {
        status = rewrite_stl(file);
    } else if (file->size >= HEADER) {
        status = shcdi_fit_fail(file->error, SHCD_ERR_FORMAT,
                                "%s: not an STL file, or cut: %llu facets would take %llu bytes, "
                                "but there are %zu",
                                file->name, (unsigned long long)n,
                                (unsigned long long)(HEADER + FACET * n), file->size);
    } else {
        status = shcdi_fit_fail(file->error, SHCD_ERR_FORMAT,
                                "%s: not an STL file: neither 'solid' nor a binary header of %d "
                                "bytes",
                                file->name, HEADER);
    }
    file->n_vertices = file->n_corners = 3 * file->n_faces;
    return status;
}
