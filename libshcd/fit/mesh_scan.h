/* SPDX-License-Identifier: BSD-3-Clause */
/* What a mesh file says, read by our own scanner before the importer sees it.
 *
 * The importer clamps indices (OFF), repeats the last face of a truncated file (PLY), aborts the
 * process on faces without corners, counts comments as faces (OFF), skips vertices whose first
 * number starts with a point (OBJ), reads integers of twenty digits as zero, and reserves what a
 * header claims before it looks at the size of the file. It takes 4 GB for each MB of a PLY element
 * that no mesh needs, and the time to split a polygon grows with the square of its corners. So the
 * structure of each file is checked first, nothing but positions and faces reaches the importer,
 * and the faces found here are what it must deliver. */
#ifndef SHCD_FIT_MESH_SCAN_H
#define SHCD_FIT_MESH_SCAN_H

#include "shcd/base.h"

/** Most corners of one face. Splitting costs up to 2 s of processor time for each MB of such faces,
 *  and 4 s at three times as many. */
enum { SHCDI_CORNERS_MAX = 1000 };

typedef struct shcdi_mesh_file {
    const char *name; /* starts every message */
    char *bytes;      /* the content; a scan may replace it by a plainer text */
    size_t size;
    size_t n_vertices; /* as the file says; 3 per facet in STL */
    size_t n_faces;
    size_t n_corners;      /* of all faces */
    uint32_t *faces;       /* per face: number of corners, then 0-based indices; not for STL */
    size_t faces_length;   /* in use */
    size_t faces_capacity; /* allocated */
    shcd_error *error;
} shcdi_mesh_file;

typedef shcd_status (*shcdi_mesh_scan)(shcdi_mesh_file *file);

/** OBJ: rewritten to `v` and `f` lines with position indices only; groups, materials (and with them
 *  any file they name), texture coordinates, normals, lines, points and curves are left out. */
shcd_status shcdi_scan_obj(shcdi_mesh_file *file);
/** OFF: rewritten to positions and faces only, without comments, colours and normals. */
shcd_status shcdi_scan_off(shcdi_mesh_file *file);
/** STL, binary or text; a truncated one is refused. Text is rewritten to facets only. */
shcd_status shcdi_scan_stl(shcdi_mesh_file *file);
/** PLY, text or binary of either byte order: rewritten to vertices with x, y, z and faces with
 * their corners, without any other property or element. */
shcd_status shcdi_scan_ply(shcdi_mesh_file *file);

/** A word of a text: [begin, end). */
typedef struct shcdi_word {
    const char *begin, *end;
} shcdi_word;

/** Reading position in a text. */
typedef struct shcdi_cursor {
    const char *at, *end;
    size_t line; /* 1-based number of the line that was returned last */
    int joins;   /* a backslash at the end of a line continues it */
} shcdi_cursor;

shcdi_cursor shcdi_cursor_at(const shcdi_mesh_file *file);
/** The next line without its end; 0 at the end of the text. */
int shcdi_next_line(shcdi_cursor *cursor, shcdi_word *line);
/** Takes the next word off a line; 0 if none is left. A # ends the line. */
int shcdi_next_word(shcdi_word *line, shcdi_word *word);
int shcdi_word_is(shcdi_word word, const char *text);
/** A whole decimal integer in [low, high], at most 18 digits. */
int shcdi_word_integer(shcdi_word word, int64_t low, int64_t high, int64_t *value);
/** A whole decimal number that the importer can read, or nan or inf (the mesh checks refuse those
 *  where a face uses them). */
int shcdi_word_is_number(shcdi_word word);

/** Refuses with "NAME: line N: ...". */
shcd_status shcdi_scan_fail(shcdi_mesh_file *file, size_t line, const char *format, ...)
#if defined(__GNUC__) || defined(__clang__)
    __attribute__((format(printf, 3, 4)))
#endif
    ;
/** Text taken from a file must not end a message's line or steer a terminal. */
void shcdi_make_printable(char *text);
shcd_status shcdi_scan_out_of_memory(shcdi_mesh_file *file);
/** Refuses a face of more than SHCDI_CORNERS_MAX corners. */
shcd_status shcdi_scan_many_corners(shcdi_mesh_file *file, size_t line);
/** Takes the corners of a face, `n` of them, 0-based and below n_vertices, off a line. */
shcd_status shcdi_scan_face(shcdi_mesh_file *file, size_t line_number, shcdi_word *line, int64_t n);
/** Appends to `faces`; 0: out of memory. */
int shcdi_append(shcdi_mesh_file *file, uint32_t value);

/** The content that replaces the file's. Running out of memory is remembered until the end. */
typedef struct shcdi_plain {
    char *bytes;
    size_t size, capacity;
    int failed;
} shcdi_plain;

void shcdi_plain_bytes(shcdi_plain *text, const char *begin, size_t n);
void shcdi_plain_string(shcdi_plain *text, const char *string);
/** In the plainest form: the importer takes 08 for octal in OBJ, and ends a number in OFF and PLY
 * at the blanks it knows. */
void shcdi_plain_integer(shcdi_plain *text, size_t value, char separator);
/** The last face, as "n i1 ... in" and the end of the line. */
void shcdi_plain_face(shcdi_plain *text, const shcdi_mesh_file *file, size_t n);
/** The importer drops an OBJ vertex that starts with a bare point: .5 becomes 0.5. */
void shcdi_plain_number(shcdi_plain *text, shcdi_word word, char separator);
/** Puts the text in the file's place if all went well; releases what is not needed. */
shcd_status shcdi_plain_end(shcdi_plain *text, shcdi_mesh_file *file, shcd_status status);

#endif
