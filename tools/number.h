/* SPDX-License-Identifier: BSD-3-Clause */
/* Numbers from the command line and from CSV files: decimal, consumed to the last character,
 * finite. The program never calls setlocale(), so the decimal sign is always a point. */
#ifndef SHCD_TOOLS_NUMBER_H
#define SHCD_TOOLS_NUMBER_H

#include <stdbool.h>

bool number_parse(const char *text, double *value);

/** A whole number in low .. high. */
bool number_parse_integer(const char *text, int low, int high, int *value);

/** A positive length: a number of metres, or a number directly followed by m, cm, mm, um or in. */
bool number_parse_length(const char *text, double *metres);

/** A unit of length: m, cm, mm, um, in, or a positive number of metres. */
bool number_parse_unit(const char *text, double *metres);

#endif
