/* SPDX-License-Identifier: BSD-3-Clause */
/* Lines, words and numbers of the text formats.
 *
 * Numbers are recognised by hand: strtod follows the caller's locale, and a file must not mean
 * something else under another one. */
#include "mesh_scan.h"

#include "fail.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DIGITS_MAX = 18 }; /* any such integer fits into 64 bits */

shcdi_cursor shcdi_cursor_at(const shcdi_mesh_file *file) {
    const shcdi_cursor cursor = {file->bytes, file->bytes + file->size, 0, 0};
    return cursor;
}

static const char *line_end(const char *at, const char *end) {
    const char *found = memchr(at, '\n', (size_t)(end - at));
    return found != NULL ? found : end;
}

/* Does the text before `end` (exclusive) close with a backslash, carriage return aside? */
static int continues(const char *begin, const char *end) {
    if (end > begin && end[-1] == '\r') {
        --end;
    }
    return end > begin && end[-1] == '\\';
}

int shcdi_next_line(shcdi_cursor *cursor, shcdi_word *line) {
    if (cursor->at == cursor->end) {
        return 0;
    }
    line->begin = cursor->at;
    line->end = line_end(cursor->at, cursor->end);
    ++cursor->line;
    while (cursor->joins && line->end < cursor->end && continues(line->begin, line->end)) {
        line->end = line_end(line->end + 1, cursor->end);
        ++cursor->line;
    }
    cursor->at = line->end < cursor->end ? line->end + 1 : cursor->end;
    return 1;
}

static int is_blank(const char *at, const char *end) {
    if (*at == '\\') { /* a joined line; elsewhere a backslash is part of a word */
        ++at;
        if (at < end && *at == '\r') {
            ++at;
        }
        return at < end && *at == '\n';
    }
    return *at == ' ' || (*at >= '\t' && *at <= '\r');
}

int shcdi_next_word(shcdi_word *line, shcdi_word *word) {
    const char *at = line->begin;
    while (at < line->end && is_blank(at, line->end)) {
        ++at;
    }
    if (at == line->end || *at == '#') {
        line->begin = line->end;
        return 0;
    }
    word->begin = at;
    while (at < line->end && !is_blank(at, line->end)) {
        ++at;
    }
    word->end = at;
    line->begin = at;
    return 1;
}

int shcdi_word_is(shcdi_word word, const char *text) {
    const size_t n = strlen(text);
    return (size_t)(word.end - word.begin) == n && memcmp(word.begin, text, n) == 0;
}

static int is_digit(char c) {
    return c >= '0' && c <= '9';
}

static const char *skip_sign(shcdi_word word) {
    return word.begin < word.end && (*word.begin == '-' || *word.begin == '+') ? word.begin + 1
                                                                               : word.begin;
}

static const char *skip_digits(const char *at, const char *end) {
    while (at < end && is_digit(*at)) {
        ++at;
    }
    return at;
}

int shcdi_word_integer(shcdi_word word, int64_t low, int64_t high, int64_t *value) {
    const char *at = skip_sign(word);
    int64_t magnitude = 0;
    if (at == word.end || word.end - at > DIGITS_MAX || skip_digits(at, word.end) != word.end) {
        return 0;
    }
    for (; at < word.end; ++at) {
        magnitude = 10 * magnitude + (*at - '0');
    }
    *value = *word.begin == '-' ? -magnitude : magnitude;
    return *value >= low && *value <= high;
}

static int equals_ignoring_case(const char *at, const char *end, const char *lower) {
    for (; at < end && *lower != '\0'; ++at, ++lower) {
        const char c = *at >= 'A' && *at <= 'Z' ? (char)(*at - 'A' + 'a') : *at;
        if (c != *lower) {
            return 0;
        }
    }
    return at == end && *lower == '\0';
}

int shcdi_word_is_number(shcdi_word word) {
    const char *const begin = skip_sign(word);
    const char *at = skip_digits(begin, word.end);
    ptrdiff_t n_digits = at - begin;
    if (n_digits > DIGITS_MAX) {
        return 0;
    }
    if (at < word.end && *at == '.') {
        const char *const fraction = at + 1;
        at = skip_digits(fraction, word.end);
        n_digits += at - fraction;
    }
    if (n_digits == 0) {
        return equals_ignoring_case(begin, word.end, "nan") ||
               equals_ignoring_case(begin, word.end, "inf") ||
               equals_ignoring_case(begin, word.end, "infinity");
    }
    if (at < word.end && (*at == 'e' || *at == 'E')) {
        shcdi_word exponent = {at + 1, word.end};
        int64_t ignored;
        return shcdi_word_integer(exponent, -99999, 99999, &ignored);
    }
    return at == word.end;
}

void shcdi_make_printable(char *text) {
    for (; *text != '\0'; ++text) {
        if (*text < ' ' || *text > '~') {
            *text = '?';
        }
    }
}

shcd_status shcdi_scan_fail(shcdi_mesh_file *file, size_t line, const char *format, ...) {
    char text[160];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    shcdi_make_printable(text);
    return shcdi_fit_fail(file->error, SHCD_ERR_FORMAT, "%s: line %zu: %s", file->name, line, text);
}

shcd_status shcdi_scan_out_of_memory(shcdi_mesh_file *file) {
    return shcdi_fit_fail(file->error, SHCD_ERR_MEMORY, "%s: out of memory", file->name);
}

shcd_status shcdi_scan_many_corners(shcdi_mesh_file *file, size_t line) {
    return shcdi_scan_fail(file, line,
                           "a face of more than %d corners is not read; triangulate the mesh first",
                           SHCDI_CORNERS_MAX);
}

int shcdi_append(shcdi_mesh_file *file, uint32_t value) {
    if (file->faces_length == file->faces_capacity) {
        const size_t capacity = file->faces_capacity > 0 ? 2 * file->faces_capacity : 1024;
        uint32_t *grown = realloc(file->faces, capacity * sizeof *grown);
        if (grown == NULL) {
            return 0;
        }
        file->faces = grown;
        file->faces_capacity = capacity;
    }
    file->faces[file->faces_length++] = value;
    return 1;
}

shcd_status shcdi_scan_face(shcdi_mesh_file *file, size_t line_number, shcdi_word *line,
                            int64_t n) {
    shcdi_word word = {NULL, NULL};
    if (!shcdi_append(file, (uint32_t)n)) {
        return shcdi_scan_out_of_memory(file);
    }
    for (int64_t k = 0; k < n; ++k) {
        int64_t index = 0;
        if (!shcdi_next_word(line, &word)) {
            return shcdi_scan_fail(file, line_number, "a face of %lld corners lists %lld",
                                   (long long)n, (long long)k);
        }
        if (!shcdi_word_integer(word, 0, (int64_t)file->n_vertices - 1, &index)) {
            return shcdi_scan_fail(file, line_number,
                                   "'%.*s' is not one of the %zu vertices (the first is 0)",
                                   (int)(word.end - word.begin < 24 ? word.end - word.begin : 24),
                                   word.begin, file->n_vertices);
        }
        if (!shcdi_append(file, (uint32_t)index)) {
            return shcdi_scan_out_of_memory(file);
        }
    }
    file->n_corners += (size_t)n;
    ++file->n_faces;
    return SHCD_OK;
}

void shcdi_plain_bytes(shcdi_plain *text, const char *begin, size_t n) {
    if (text->failed) {
        return;
    }
    if (text->capacity - text->size < n) {
        const size_t capacity = 2 * text->capacity + n + 1024;
        char *grown = realloc(text->bytes, capacity);
        if (grown == NULL) {
            text->failed = 1;
            return;
        }
        text->bytes = grown;
        text->capacity = capacity;
    }
    memcpy(text->bytes + text->size, begin, n);
    text->size += n;
}

void shcdi_plain_string(shcdi_plain *text, const char *string) {
    shcdi_plain_bytes(text, string, strlen(string));
}

void shcdi_plain_integer(shcdi_plain *text, size_t value, char separator) {
    char digits[32];
    const int n = snprintf(digits, sizeof digits, "%zu%c", value, separator);
    shcdi_plain_bytes(text, digits, (size_t)n);
}

void shcdi_plain_face(shcdi_plain *text, const shcdi_mesh_file *file, size_t n) {
    shcdi_plain_integer(text, n, ' ');
    for (size_t i = file->faces_length - n; i < file->faces_length; ++i) {
        shcdi_plain_integer(text, file->faces[i], i + 1 < file->faces_length ? ' ' : '\n');
    }
}

void shcdi_plain_number(shcdi_plain *text, shcdi_word word, char separator) {
    if (*word.begin == '-' || *word.begin == '+') {
        shcdi_plain_bytes(text, word.begin, 1);
        ++word.begin;
    }
    if (*word.begin == '.') {
        shcdi_plain_bytes(text, "0", 1);
    }
    shcdi_plain_bytes(text, word.begin, (size_t)(word.end - word.begin));
    shcdi_plain_bytes(text, &separator, 1);
}

shcd_status shcdi_plain_end(shcdi_plain *text, shcdi_mesh_file *file, shcd_status status) {
    if (status == SHCD_OK && text->failed) {
        status = shcdi_scan_out_of_memory(file);
    }
    if (status != SHCD_OK) {
        free(text->bytes);
        return status;
    }
    free(file->bytes);
    file->bytes = text->bytes;
    file->size = text->size;
    return SHCD_OK;
}
