/* SPDX-License-Identifier: BSD-3-Clause */
/* A writer of JSON, one member a line. A number is written with 17 digits, so that it reads back
 * as the same double; one that is not finite becomes null, since JSON has no word for it. */
#ifndef SHCD_TOOLS_JSON_H
#define SHCD_TOOLS_JSON_H

#include "shcd/base.h"

#include <stdbool.h>
#include <stdio.h>

typedef struct json_writer {
    FILE *file; /**< borrowed; its error flag tells whether everything was written */
    int depth;
    bool first; /**< nothing was written yet in the innermost object or array */
} json_writer;

void json_begin(json_writer *json, FILE *file);
/** Closes the outermost object and ends the line. */
void json_end(json_writer *json);

/** The key is NULL inside an array. */
void json_open_object(json_writer *json, const char *key);
void json_close_object(json_writer *json);
void json_open_array(json_writer *json, const char *key);
void json_close_array(json_writer *json);

void json_null(json_writer *json, const char *key);
void json_bool(json_writer *json, const char *key, bool value);
void json_integer(json_writer *json, const char *key, int value);
void json_count(json_writer *json, const char *key, uint64_t value);
void json_number(json_writer *json, const char *key, double value);
/** Bytes that are not UTF-8 become U+FFFD, one each. */
void json_string(json_writer *json, const char *key, const char *text);
void json_vec3(json_writer *json, const char *key, shcd_vec3 value);

#endif
