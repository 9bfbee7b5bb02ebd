/* SPDX-License-Identifier: BSD-3-Clause */
/* Line by line reading of comma-separated numbers. Blank lines and lines that start with '#' are
 * passed over; blanks around a field, a carriage return at the end of a line and a byte order mark
 * at the start of the file are ignored. There is no quoting: no field needs it. */
#ifndef SHCD_TOOLS_CSV_H
#define SHCD_TOOLS_CSV_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#define CSV_LINE_MAX 4096 /**< bytes of one line, its end included */
#define CSV_FIELDS_MAX 16

typedef struct csv_reader {
    FILE *file;         /**< borrowed */
    const char *name;   /**< stands before the line number in messages */
    unsigned long line; /**< number of the line that was read last, from 1 */
    size_t n_fields;
    char *fields[CSV_FIELDS_MAX]; /**< into text, blanks removed */
    char text[CSV_LINE_MAX];
} csv_reader;

typedef enum csv_status { CSV_ROW, CSV_END, CSV_BAD } csv_status;

void csv_begin(csv_reader *reader, FILE *file, const char *name);

/** Reads the next line with fields. CSV_BAD: the reason has been printed with NAME:LINE. */
csv_status csv_next(csv_reader *reader);

/** True if the row consists of exactly these comma-separated names. */
bool csv_is_header(const csv_reader *reader, const char *names);

/** Takes n finite numbers from fields first .. first + n - 1; prints NAME:LINE and the field that
 *  is none. */
bool csv_numbers(const csv_reader *reader, size_t first, size_t n, double *values);

#endif
