/* SPDX-License-Identifier: BSD-3-Clause */
/* PLY: a header that declares elements and their properties, then the elements in that order, as
 * text (one to a line) or binary. Everything is walked, needed or not: only so is it known where
 * the faces are, and that the file holds what it declares. What is needed, positions and corners,
 * is copied in the file's own format below a header of our own. */
#include "mesh_scan.h"

#include "fail.h"

#include <stdio.h>
#include <string.h>

enum { ELEMENTS_MAX = 16, PROPERTIES_MAX = 128 };

typedef enum ply_role {
    ROLE_OTHER,
    ROLE_VERTEX,
    ROLE_FACE,
    ROLE_COORDINATE,
    ROLE_CORNERS
} ply_role;
typedef enum ply_format { FORMAT_NONE, FORMAT_TEXT, FORMAT_LITTLE, FORMAT_BIG } ply_format;

typedef struct ply_type {
    unsigned char bytes, is_float, is_signed;
} ply_type;

typedef struct ply_property {
    ply_type count_type; /* of a list; 0 bytes: no list */
    ply_type type;
    ply_role role;
    char axis; /* of a coordinate */
} ply_property;

typedef struct ply_element {
    ply_role role;
    size_t count;
    size_t first, n_properties; /* in ply_header.properties */
} ply_element;

typedef struct ply_header {
    ply_format format;
    size_t n_elements, n_properties;
    ply_element elements[ELEMENTS_MAX];
    ply_property properties[PROPERTIES_MAX];
    unsigned n_axis[3], n_vertex, n_face, n_corners; /* declarations seen of each */
} ply_header;

static int parse_type(shcdi_word word, ply_type *type) {
    static const struct {
        const char *name;
        ply_type type;
    } known[] = {{"char", {1, 0, 1}},   {"int8", {1, 0, 1}},    {"uchar", {1, 0, 0}},
                 {"uint8", {1, 0, 0}},  {"short", {2, 0, 1}},   {"int16", {2, 0, 1}},
                 {"ushort", {2, 0, 0}}, {"uint16", {2, 0, 0}},  {"int", {4, 0, 1}},
                 {"int32", {4, 0, 1}},  {"uint", {4, 0, 0}},    {"uint32", {4, 0, 0}},
                 {"float", {4, 1, 1}},  {"float32", {4, 1, 1}}, {"double", {8, 1, 1}},
                 {"float64", {8, 1, 1}}};
    for (size_t i = 0; i < sizeof known / sizeof known[0]; ++i) {
        if (shcdi_word_is(word, known[i].name)) {
            *type = known[i].type;
            return 1;
        }
    }
    return 0;
}

static const char *type_name(ply_type type) {
    static const char *const integers[2][5] = {{"", "uchar", "ushort", "", "uint"},
                                               {"", "char", "short", "", "int"}};
    return type.is_float ? (type.bytes == 4 ? "float" : "double")
                         : integers[type.is_signed][type.bytes];
}

static int parse_format(shcdi_word line, ply_header *header) {
    shcdi_word word = {NULL, NULL};
    if (!shcdi_next_word(&line, &word)) {
        return 0;
    }
    if (shcdi_word_is(word, "ascii")) {
        header->format = FORMAT_TEXT;
    } else if (shcdi_word_is(word, "binary_little_endian")) {
        header->format = FORMAT_LITTLE;
    } else if (shcdi_word_is(word, "binary_big_endian")) {
        header->format = FORMAT_BIG;
    }
    return header->format != FORMAT_NONE;
}

/* An element takes a byte at least, so the size of the file limits what can be declared. */
static int parse_element(shcdi_word line, size_t size, ply_header *header) {
    shcdi_word name = {NULL, NULL}, word = {NULL, NULL};
    int64_t count = 0;
    ply_element *element = NULL;
    if (header->n_elements == ELEMENTS_MAX || !shcdi_next_word(&line, &name) ||
        !shcdi_next_word(&line, &word) || !shcdi_word_integer(word, 0, (int64_t)size, &count)) {
        return 0;
    }
    element = &header->elements[header->n_elements];
    ++header->n_elements;
    element->role = ROLE_OTHER;
    element->count = (size_t)count;
    element->first = header->n_properties;
    element->n_properties = 0;
    if (shcdi_word_is(name, "vertex")) {
        element->role = ROLE_VERTEX;
        ++header->n_vertex;
    } else if (shcdi_word_is(name, "face")) {
        element->role = ROLE_FACE;
        ++header->n_face;
        return header->n_vertex == 1; /* faces can only be checked after their vertices */
    }
    return 1;
}

static int parse_property(shcdi_word line, ply_header *header) {
    shcdi_word word = {NULL, NULL};
    ply_element *element = NULL;
    ply_property *property = NULL;
    const ply_type none = {0, 0, 0};
    if (header->n_elements == 0 || header->n_properties == PROPERTIES_MAX ||
        !shcdi_next_word(&line, &word)) {
        return 0;
    }
    element = &header->elements[header->n_elements - 1];
    property = &header->properties[header->n_properties];
    property->role = ROLE_OTHER;
    property->count_type = none;
    if (shcdi_word_is(word, "list") &&
        (!shcdi_next_word(&line, &word) || !parse_type(word, &property->count_type) ||
         property->count_type.is_float || !shcdi_next_word(&line, &word))) {
        return 0;
    }
    if (!parse_type(word, &property->type) || !shcdi_next_word(&line, &word)) {
        return 0;
    }
    ++header->n_properties;
    ++element->n_properties;
    if (element->role == ROLE_VERTEX && property->count_type.bytes == 0 &&
        word.end - word.begin == 1 && *word.begin >= 'x' && *word.begin <= 'z') {
        property->role = ROLE_COORDINATE;
        property->axis = *word.begin;
        ++header->n_axis[property->axis - 'x'];
    } else if (element->role == ROLE_FACE && property->count_type.bytes != 0 &&
               !property->type.is_float &&
               (shcdi_word_is(word, "vertex_indices") || shcdi_word_is(word, "vertex_index"))) {
        property->role = ROLE_CORNERS;
        ++header->n_corners;
    }
    return 1;
}

/* Faces can only be checked after their vertices; what stands before both is not worth reading. */
static int is_complete(const ply_header *header) {
    return header->format != FORMAT_NONE && header->n_vertex == 1 && header->n_face == 1 &&
           header->n_axis[0] == 1 && header->n_axis[1] == 1 && header->n_axis[2] == 1 &&
           header->n_corners == 1 && header->elements[0].role == ROLE_VERTEX &&
           header->elements[1].role == ROLE_FACE;
}

static shcd_status scan_header(shcdi_mesh_file *file, shcdi_cursor *cursor, ply_header *header) {
    shcdi_word line = {NULL, NULL}, word = {NULL, NULL};
    if (!shcdi_next_line(cursor, &line) || !shcdi_next_word(&line, &word) ||
        !shcdi_word_is(word, "ply")) {
        return shcdi_scan_fail(file, 1, "a PLY file starts with ply");
    }
    while (shcdi_next_line(cursor, &line)) {
        int is_good = 1;
        if (!shcdi_next_word(&line, &word) || shcdi_word_is(word, "comment") ||
            shcdi_word_is(word, "obj_info")) {
            continue;
        }
        if (shcdi_word_is(word, "end_header")) {
            if (!is_complete(header)) {
                return shcdi_scan_fail(file, cursor->line,
                                       "the header must declare a format, first one element vertex "
                                       "with x, y, z and next one element face with a list "
                                       "vertex_indices");
            }
            return SHCD_OK;
        }
        if (shcdi_word_is(word, "format")) {
            is_good = parse_format(line, header);
        } else if (shcdi_word_is(word, "element")) {
            is_good = parse_element(line, file->size, header);
        } else {
            is_good = shcdi_word_is(word, "property") && parse_property(line, header);
        }
        if (!is_good) {
            return shcdi_scan_fail(file, cursor->line,
                                   "a header line that is not understood, out of place, or "
                                   "declares more than the file can hold");
        }
    }
    return shcdi_scan_fail(file, cursor->line, "the file ends within its header");
}

static void plain_count(shcdi_plain *plain, const char *before, size_t count) {
    char line[48];
    (void)snprintf(line, sizeof line, "%s%zu\n", before, count);
    shcdi_plain_string(plain, line);
}

/* The coordinates keep their order. Numbers in text have no type, and any of them is a double. */
static void plain_header(shcdi_plain *plain, const ply_header *header) {
    static const char *const format[] = {"", "ascii", "binary_little_endian", "binary_big_endian"};
    const int is_text = header->format == FORMAT_TEXT;
    shcdi_plain_string(plain, "ply\nformat ");
    shcdi_plain_string(plain, format[header->format]);
    plain_count(plain, " 1.0\nelement vertex ", header->elements[0].count);
    for (size_t i = 0; i < header->n_properties; ++i) {
        const ply_property *property = &header->properties[i];
        const char name[] = {' ', property->axis, '\n'};
        if (property->role == ROLE_COORDINATE) {
            shcdi_plain_string(plain, "property ");
            shcdi_plain_string(plain, is_text ? "double" : type_name(property->type));
            shcdi_plain_bytes(plain, name, sizeof name);
        } else if (property->role == ROLE_CORNERS) {
            plain_count(plain, "element face ", header->elements[1].count);
            shcdi_plain_string(plain, "property list ");
            shcdi_plain_string(plain, is_text ? "uint" : type_name(property->count_type));
            shcdi_plain_string(plain, " ");
            shcdi_plain_string(plain, is_text ? "uint" : type_name(property->type));
        }
    }
    shcdi_plain_string(plain, " vertex_indices\nend_header\n");
}

static shcd_status text_face(shcdi_mesh_file *file, size_t line_number, shcdi_word *line, int64_t n,
                             shcdi_plain *plain) {
    shcd_status status = SHCD_OK;
    if (n > SHCDI_CORNERS_MAX) {
        return shcdi_scan_many_corners(file, line_number);
    }
    status = shcdi_scan_face(file, line_number, line, n);
    if (status == SHCD_OK) {
        shcdi_plain_face(plain, file, (size_t)n);
    }
    return status;
}

/* One property of one element of a text file. */
static shcd_status text_property(shcdi_mesh_file *file, size_t line_number, shcdi_word *line,
                                 const ply_property *property, shcdi_plain *plain) {
    shcdi_word word = {NULL, NULL};
    int64_t n = 1;
    if (property->count_type.bytes != 0) {
        if (!shcdi_next_word(line, &word) ||
            !shcdi_word_integer(word, property->role == ROLE_CORNERS ? 3 : 0, INT64_MAX, &n)) {
            return shcdi_scan_fail(file, line_number,
                                   property->role == ROLE_CORNERS
                                       ? "a face needs three corners or more"
                                       : "a list needs its length");
        }
        if (property->role == ROLE_CORNERS) {
            return text_face(file, line_number, line, n, plain);
        }
    }
    for (; n > 0; --n) {
        if (!shcdi_next_word(line, &word) || !shcdi_word_is_number(word)) {
            return shcdi_scan_fail(file, line_number, "a number is missing");
        }
        if (property->role == ROLE_COORDINATE) {
            shcdi_plain_number(plain, word, ' ');
        }
    }
    return SHCD_OK;
}

static shcd_status scan_text_element(shcdi_mesh_file *file, shcdi_cursor *cursor,
                                     const ply_header *header, const ply_element *element,
                                     shcdi_plain *plain) {
    for (size_t i = 0; i < element->count; ++i) {
        shcdi_word line = {NULL, NULL};
        if (!shcdi_next_line(cursor, &line)) {
            return shcdi_scan_fail(file, cursor->line,
                                   "the file ends before all that its header declares");
        }
        for (size_t k = 0; k < element->n_properties; ++k) {
            const shcd_status status = text_property(
                file, cursor->line, &line, &header->properties[element->first + k], plain);
            if (status != SHCD_OK) {
                return status;
            }
        }
        if (element->role == ROLE_VERTEX) {
            shcdi_plain_string(plain, "\n");
        }
    }
    return SHCD_OK;
}

/* Reads an integer and moves on; 0 at the end of the file. */
static int take_integer(shcdi_cursor *cursor, ply_type type, ply_format format, int64_t *value) {
    uint64_t bits = 0;
    if ((size_t)(cursor->end - cursor->at) < type.bytes) {
        return 0;
    }
    for (unsigned k = 0; k < type.bytes; ++k) {
        const unsigned from = format == FORMAT_LITTLE ? type.bytes - 1 - k : k;
        bits = bits << 8 | (unsigned char)cursor->at[from];
    }
    cursor->at += type.bytes;
    *value = (int64_t)bits;
    if (type.is_signed && bits >> (8 * type.bytes - 1)) {
        *value -= (int64_t)1 << (8 * type.bytes);
    }
    return 1;
}

static shcd_status binary_cut(shcdi_mesh_file *file) {
    return shcdi_fit_fail(file->error, SHCD_ERR_FORMAT,
                          "%s: the file ends before all that its header declares", file->name);
}

static shcd_status binary_face(shcdi_mesh_file *file, shcdi_cursor *cursor, ply_format format,
                               ply_type type, int64_t n) {
    if (n < 3) {
        return shcdi_fit_fail(file->error, SHCD_ERR_FORMAT,
                              "%s: face %zu needs three corners or more, it has %lld", file->name,
                              file->n_faces, (long long)n);
    }
    if (n > SHCDI_CORNERS_MAX) {
        return shcdi_fit_fail(file->error, SHCD_ERR_FORMAT,
                              "%s: face %zu has %lld corners, more than %d; triangulate the mesh "
                              "first",
                              file->name, file->n_faces, (long long)n, SHCDI_CORNERS_MAX);
    }
    if (!shcdi_append(file, (uint32_t)n)) {
        return shcdi_scan_out_of_memory(file);
    }
    for (int64_t k = 0; k < n; ++k) {
        int64_t index = 0;
        if (!take_integer(cursor, type, format, &index)) {
            return binary_cut(file);
        }
        if (index < 0 || index >= (int64_t)file->n_vertices) {
            return shcdi_fit_fail(file->error, SHCD_ERR_FORMAT,
                                  "%s: face %zu refers to vertex %lld, but there are only %zu",
                                  file->name, file->n_faces, (long long)index, file->n_vertices);
        }
        if (!shcdi_append(file, (uint32_t)index)) {
            return shcdi_scan_out_of_memory(file);
        }
    }
    file->n_corners += (size_t)n;
    ++file->n_faces;
    return SHCD_OK;
}

static shcd_status binary_property(shcdi_mesh_file *file, shcdi_cursor *cursor, ply_format format,
                                   const ply_property *property, shcdi_plain *plain) {
    const char *const begin = cursor->at;
    int64_t n = 1;
    if (property->count_type.bytes != 0 &&
        !take_integer(cursor, property->count_type, format, &n)) {
        return binary_cut(file);
    }
    if (property->role == ROLE_CORNERS) {
        const shcd_status status = binary_face(file, cursor, format, property->type, n);
        shcdi_plain_bytes(plain, begin, (size_t)(cursor->at - begin));
        return status;
    }
    if (n < 0 || n > (cursor->end - cursor->at) / property->type.bytes) {
        return binary_cut(file);
    }
    cursor->at += n * property->type.bytes;
    if (property->role == ROLE_COORDINATE) {
        shcdi_plain_bytes(plain, begin, property->type.bytes);
    }
    return SHCD_OK;
}

static shcd_status scan_binary_element(shcdi_mesh_file *file, shcdi_cursor *cursor,
                                       const ply_header *header, const ply_element *element,
                                       shcdi_plain *plain) {
    for (size_t i = 0; i < element->count; ++i) {
        for (size_t k = 0; k < element->n_properties; ++k) {
            const shcd_status status = binary_property(
                file, cursor, header->format, &header->properties[element->first + k], plain);
            if (status != SHCD_OK) {
                return status;
            }
        }
    }
    return SHCD_OK;
}

shcd_status shcdi_scan_ply(shcdi_mesh_file *file) {
    ply_header header;
    shcdi_cursor cursor = shcdi_cursor_at(file);
    shcdi_plain plain = {NULL, 0, 0, 0};
    shcd_status status = SHCD_OK;
    memset(&header, 0, sizeof header);
    status = scan_header(file, &cursor, &header);
    if (status == SHCD_OK) {
        plain_header(&plain, &header);
    }
    for (size_t i = 0; status == SHCD_OK && i < header.n_elements; ++i) {
        const ply_element *element = &header.elements[i];
        if (element->role == ROLE_VERTEX) {
            file->n_vertices = element->count;
        }
        status = header.format == FORMAT_TEXT
                     ? scan_text_element(file, &cursor, &header, element, &plain)
                     : scan_binary_element(file, &cursor, &header, element, &plain);
    }
    return shcdi_plain_end(&plain, file, status);
}
