/* SPDX-License-Identifier: BSD-3-Clause */
/* Paths are bytes, JSON text must be UTF-8: strings are checked sequence by sequence. */
#include "json.h"

#include <inttypes.h>
#include <math.h>

/* Bytes of the UTF-8 sequence at s (shortest form, no surrogates, at most U+10FFFF); 0: none. */
static int utf8_length(const unsigned char *s) {
    const int length = s[0] < 0x80                   ? 1
                       : s[0] >= 0xc2 && s[0] < 0xe0 ? 2
                       : s[0] >= 0xe0 && s[0] < 0xf0 ? 3
                       : s[0] >= 0xf0 && s[0] < 0xf5 ? 4
                                                     : 0;
    for (int i = 1; i < length; i++) {
        if ((s[i] & 0xc0) != 0x80) {
            return 0;
        }
    }
    const bool overlong = (s[0] == 0xe0 && s[1] < 0xa0) || (s[0] == 0xf0 && s[1] < 0x90);
    const bool outside = (s[0] == 0xed && s[1] >= 0xa0) || (s[0] == 0xf4 && s[1] >= 0x90);
    return overlong || outside ? 0 : length;
}

static void write_string(FILE *file, const char *text) {
    fputc('"', file);
    for (const unsigned char *s = (const unsigned char *)text; *s != '\0';) {
        const int length = utf8_length(s);
        if (length == 0) {
            fputs("\\ufffd", file);
            s++;
            continue;
        }
        if (*s == '"' || *s == '\\') {
            fprintf(file, "\\%c", *s);
        } else if (*s < 0x20) {
            fprintf(file, "\\u%04x", *s);
        } else {
            fwrite(s, 1, (size_t)length, file);
        }
        s += length;
    }
    fputc('"', file);
}

static void start_member(json_writer *json, const char *key) {
    fprintf(json->file, "%s\n%*s", json->first ? "" : ",", 2 * json->depth, "");
    json->first = false;
    if (key != NULL) {
        write_string(json->file, key);
        fputs(": ", json->file);
    }
}

static void open_bracket(json_writer *json, char bracket) {
    fputc(bracket, json->file);
    json->depth++;
    json->first = true;
}

static void close_bracket(json_writer *json, char bracket) {
    json->depth--;
    if (!json->first) {
        fprintf(json->file, "\n%*s", 2 * json->depth, "");
    }
    fputc(bracket, json->file);
    json->first = false;
}

void json_begin(json_writer *json, FILE *file) {
    json->file = file;
    json->depth = 0;
    open_bracket(json, '{');
}

void json_end(json_writer *json) {
    close_bracket(json, '}');
    fputc('\n', json->file);
}

void json_open_object(json_writer *json, const char *key) {
    start_member(json, key);
    open_bracket(json, '{');
}

void json_close_object(json_writer *json) {
    close_bracket(json, '}');
}

void json_open_array(json_writer *json, const char *key) {
    start_member(json, key);
    open_bracket(json, '[');
}

void json_close_array(json_writer *json) {
    close_bracket(json, ']');
}

void json_null(json_writer *json, const char *key) {
    start_member(json, key);
    fputs("null", json->file);
}

void json_bool(json_writer *json, const char *key, bool value) {
    start_member(json, key);
    fputs(value ? "true" : "false", json->file);
}

void json_integer(json_writer *json, const char *key, int value) {
    start_member(json, key);
    fprintf(json->file, "%d", value);
}

void json_count(json_writer *json, const char *key, uint64_t value) {
    start_member(json, key);
    fprintf(json->file, "%" PRIu64, value);
}

static void write_number(FILE *file, double value) {
    if (isfinite(value)) {
        fprintf(file, "%.17g", value);
    } else {
        fputs("null", file);
    }
}

void json_number(json_writer *json, const char *key, double value) {
    start_member(json, key);
    write_number(json->file, value);
}

void json_string(json_writer *json, const char *key, const char *text) {
    start_member(json, key);
    write_string(json->file, text);
}

void json_vec3(json_writer *json, const char *key, shcd_vec3 value) {
    start_member(json, key);
    fputc('[', json->file);
    write_number(json->file, value.x);
    fputs(", ", json->file);
    write_number(json->file, value.y);
    fputs(", ", json->file);
    write_number(json->file, value.z);
    fputc(']', json->file);
}
