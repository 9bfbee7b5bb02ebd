/* SPDX-License-Identifier: BSD-3-Clause */
/* strtod() alone would take "0x1p3", "nan", "inf", leading blanks and the 3 of "3mm": the set of
 * characters is checked first, the end afterwards. */
#include "number.h"

#include <errno.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

typedef struct length_unit {
    const char *name;
    double metres;
} length_unit;

static const length_unit length_units[] = {
    {"m", 1.0}, {"cm", 1e-2}, {"mm", 1e-3}, {"um", 1e-6}, {"in", 0.0254}};

static bool unit_find(const char *name, double *metres) {
    for (size_t i = 0; i < sizeof length_units / sizeof length_units[0]; i++) {
        if (strcmp(name, length_units[i].name) == 0) {
            *metres = length_units[i].metres;
            return true;
        }
    }
    return false;
}

/* Parses the longest decimal number at the start; *end is the first character behind it. */
static bool parse_prefix(const char *text, double *value, const char **end) {
    const size_t decimal = strspn(text, "+-.0123456789");
    if (decimal == 0 || text[0] == '\0' || strpbrk(text, "xX") != NULL) {
        return false;
    }
    char *stop;
    const double parsed = strtod(text, &stop);
    if (stop == text || !isfinite(parsed)) {
        return false;
    }
    *value = parsed;
    *end = stop;
    return true;
}

bool number_parse(const char *text, double *value) {
    double parsed;
    const char *end;
    if (!parse_prefix(text, &parsed, &end) || *end != '\0') {
        return false;
    }
    *value = parsed;
    return true;
}

bool number_parse_integer(const char *text, int low, int high, int *value) {
    const char *digits = text[0] == '+' || text[0] == '-' ? text + 1 : text;
    if (digits[0] == '\0' || digits[strspn(digits, "0123456789")] != '\0') {
        return false;
    }
    errno = 0;
    const long parsed = strtol(text, NULL, 10);
    if (errno != 0 || parsed < low || parsed > high) {
        return false;
    }
    *value = (int)parsed;
    return true;
}

bool number_parse_length(const char *text, double *metres) {
    double value;
    double unit_m = 1.0;
    const char *end;
    if (!parse_prefix(text, &value, &end) || (*end != '\0' && !unit_find(end, &unit_m))) {
        return false;
    }
    const double length_m = value * unit_m;
    if (!(length_m > 0.0) || !isfinite(length_m)) {
        return false;
    }
    *metres = length_m;
    return true;
}

bool number_parse_unit(const char *text, double *metres) {
    double value;
    if (unit_find(text, metres)) {
        return true;
    }
    if (!number_parse(text, &value) || !(value > 0.0)) {
        return false;
    }
    *metres = value;
    return true;
}
