/* SPDX-License-Identifier: BSD-3-Clause */
#include "point_file.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#define VALUES_MAX 6

typedef struct reading {
    yaml_tree *tree;
    const yaml_node *node;
    const char *name;
    FILE *stream;
    bool is_obj;
    size_t n_max, n, capacity;
    size_t n_values; /* of every row; 0: no row yet */
    unsigned long line;
    double *values; /* n rows of n_values */
} reading;

static bool fail(const reading *r, const char *what) {
    return yaml_fail(r->tree, r->node, "%s:%lu: %s", r->name, r->line, what);
}

/* ---- lines ---------------------------------------------------------------------------------- */

static bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

static const char *skip_blanks(const char *text) {
    while (is_blank(*text)) {
        text++;
    }
    return text;
}

/* Takes a line apart. @return the number of values, or -1 after a complaint */
static int parse(const reading *r, const char *text, double values[VALUES_MAX]) {
    int n = 0;
    for (text = skip_blanks(text); *text != '\0';) {
        char *end;
        char what[100];
        const double value = strtod(text, &end);
        const size_t length = strcspn(text, ", \t\r\n");
        if (end != text + length || length == 0 || !isfinite(value) ||
            strspn(text, "+-.0123456789eE") != length) {
            (void)snprintf(what, sizeof what, "'%.*s' is not a number",
                           (int)(length < 40 ? length : 40), text);
            (void)fail(r, what);
            return -1;
        }
        if (n == VALUES_MAX) {
            (void)fail(r, "holds more than 6 values; must be x,y,z or x,y,z,nx,ny,nz");
            return -1;
        }
        values[n++] = value;
        text = skip_blanks(end);
        if (*text == ',') {
            text = skip_blanks(text + 1);
            if (*text == '\0') {
                (void)fail(r, "ends with a comma");
                return -1;
            }
        }
    }
    return n;
}

static bool append(reading *r, const double *values, size_t n_values) {
    if (r->n == r->n_max) {
        char what[100];
        (void)snprintf(what, sizeof what, "one too many; at most %zu points fit", r->n_max);
        return fail(r, what);
    }
    if (r->n == r->capacity) {
        const size_t capacity = r->capacity > 0 ? 2 * r->capacity : 256;
        double *larger = realloc(r->values, capacity * VALUES_MAX * sizeof *larger);
        if (larger == NULL) {
            return yaml_fail(r->tree, r->node, "out of memory");
        }
        r->values = larger;
        r->capacity = capacity;
    }
    memcpy(r->values + r->n * VALUES_MAX, values, n_values * sizeof *values);
    r->n++;
    return true;
}

static bool is_header(const char *text) {
    return strcmp(text, "x,y,z") == 0 || strcmp(text, "x,y,z,nx,ny,nz") == 0;
}

static bool take_line(reading *r, char *text) {
    double values[VALUES_MAX];
    text[strcspn(text, "\r\n")] = '\0';
    text += strspn(text, " \t");
    if (r->is_obj) {
        if (text[0] != 'v' || !is_blank(text[1])) {
            return true;
        }
        text++;
    } else if (text[0] == '\0' || text[0] == '#' || (r->n == 0 && is_header(text))) {
        return true;
    }
    int n = parse(r, text, values);
    if (n < 0) {
        return false;
    }
    n = r->is_obj && n > 3 ? 3 : n; /* a weight or a colour may follow */
    if (n != 3 && (n != VALUES_MAX || r->is_obj)) {
        char what[100];
        (void)snprintf(what, sizeof what, "holds %d values; must be x,y,z%s", n,
                       r->is_obj ? "" : " or x,y,z,nx,ny,nz");
        return fail(r, what);
    }
    if (r->n_values != 0 && r->n_values != (size_t)n) {
        return fail(r, "holds normals where the rows before do not, or the other way round");
    }
    r->n_values = (size_t)n;
    return append(r, values, (size_t)n);
}

static bool read_lines(reading *r) {
    char text[POINT_FILE_LINE_MAX];
    size_t length = 0;
    for (r->line = 1;;) {
        const int c = getc(r->stream);
        if (c == '\0' || length + 1 == sizeof text) {
            return fail(r, c == '\0' ? "a zero byte: this is not text" : "the line is too long");
        }
        if (c != EOF && c != '\n') {
            text[length++] = (char)c;
            continue;
        }
        text[length] = '\0';
        if (!take_line(r, text)) {
            return false;
        }
        if (c == EOF) {
            break;
        }
        r->line++;
        length = 0;
    }
    if (ferror(r->stream)) {
        return yaml_fail(r->tree, r->node, "%s: cannot be read: %s", r->name, strerror(errno));
    }
    return r->n > 0 || yaml_fail(r->tree, r->node, "%s: holds no points", r->name);
}

/* ---- the file ------------------------------------------------------------------------------- */

static bool open_file(reading *r) {
    const char *path = yaml_resolve_path(r->tree, r->name);
    struct stat about;
    if (path == NULL) {
        return false;
    }
    if (stat(path, &about) != 0) {
        return yaml_fail(r->tree, r->node, "%s: cannot be opened: %s", r->name, strerror(errno));
    }
    if (!S_ISREG(about.st_mode)) {
        return yaml_fail(r->tree, r->node, "%s: is not a regular file", r->name);
    }
    if ((size_t)about.st_size > POINT_FILE_BYTES_MAX) {
        return yaml_fail(r->tree, r->node, "%s: is larger than 16 MiB", r->name);
    }
    r->stream = fopen(path, "rb");
    return r->stream != NULL ||
           yaml_fail(r->tree, r->node, "%s: cannot be opened: %s", r->name, strerror(errno));
}

static bool deliver(const reading *r, point_file *file) {
    point_file made = {r->n, yaml_allocate(r->tree, r->n * sizeof *made.points), NULL};
    if (r->n_values == VALUES_MAX) {
        made.normals = yaml_allocate(r->tree, r->n * sizeof *made.normals);
    }
    if (made.points == NULL || (r->n_values == VALUES_MAX && made.normals == NULL)) {
        return false;
    }
    for (size_t i = 0; i < r->n; i++) {
        const double *v = r->values + i * VALUES_MAX;
        made.points[i] = (shcd_vec3){v[0], v[1], v[2]};
        if (made.normals != NULL) {
            made.normals[i] = (shcd_vec3){v[3], v[4], v[5]};
        }
    }
    *file = made;
    return true;
}

bool point_file_read(yaml_tree *tree, const yaml_node *node, const char *name, size_t n_max,
                     point_file *file) {
    const size_t length = strlen(name);
    reading r = {.tree = tree, .node = node, .name = name, .n_max = n_max};
    r.is_obj = length > 4 && strcmp(name + length - 4, ".obj") == 0;
    if (!open_file(&r)) {
        return false;
    }
    const bool good = read_lines(&r) && deliver(&r, file);
    (void)fclose(r.stream);
    free(r.values);
    return good;
}
