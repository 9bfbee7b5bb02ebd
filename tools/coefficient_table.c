/* SPDX-License-Identifier: BSD-3-Clause */
/* Rows may come in any order, so they go to their place in a table of the largest degree that the
 * library takes, beside the line that brought them; what is missing shows at the end. */
#include "coefficient_table.h"

#include "csv.h"
#include "number.h"
#include "report.h"

#include "shcd/base.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define N_MAX SHCD_COUNT(SHCD_DEGREE_MAX)
#define COLUMNS_REAL 3
#define COLUMNS_COMPLEX 6

/* A table written in single precision has a_lm and its conjugate partner rounded apart by at most
 * 2^-23 of their size each; ten times that leaves room for partners that were computed apart. */
#define CONJUGATE_TOLERANCE 1e-6

static const char header_real[] = "l,m,x,y,z";
static const char header_complex[] = "l,m,x_re,x_im,y_re,y_im,z_re,z_im";

typedef struct raw_table {
    int degree;                          /* largest l so far, -1: none */
    size_t columns;                      /* numbers in a row */
    unsigned long lines[N_MAX];          /* 0: not given */
    double rows[N_MAX][COLUMNS_COMPLEX]; /* as read */
} raw_table;

static bool read_header(csv_reader *reader, raw_table *raw) {
    const csv_status status = csv_next(reader);
    if (status == CSV_BAD) {
        return false;
    }
    if (status == CSV_ROW && csv_is_header(reader, header_real)) {
        raw->columns = COLUMNS_REAL;
        return true;
    }
    if (status == CSV_ROW && csv_is_header(reader, header_complex)) {
        raw->columns = COLUMNS_COMPLEX;
        return true;
    }
    if (status == CSV_END) {
        report_failure("%s: empty: the header '%s' or '%s' must come first", reader->name,
                       header_real, header_complex);
    } else {
        report_failure("%s:%lu: the header must be '%s' or '%s'", reader->name, reader->line,
                       header_real, header_complex);
    }
    return false;
}

static bool read_row(const csv_reader *reader, raw_table *raw) {
    int l;
    int m;
    if (reader->n_fields != 2 + raw->columns) {
        report_failure("%s:%lu: %zu fields instead of %zu", reader->name, reader->line,
                       reader->n_fields, 2 + raw->columns);
        return false;
    }
    if (!number_parse_integer(reader->fields[0], 0, SHCD_DEGREE_MAX, &l)) {
        report_failure("%s:%lu: l = '%.40s' is not a whole number from 0 to %d", reader->name,
                       reader->line, reader->fields[0], SHCD_DEGREE_MAX);
        return false;
    }
    if (!number_parse_integer(reader->fields[1], -l, l, &m)) {
        report_failure("%s:%lu: m = '%.40s' is not a whole number from %d to %d", reader->name,
                       reader->line, reader->fields[1], -l, l);
        return false;
    }
    const size_t i = SHCD_INDEX(l, m);
    if (raw->lines[i] != 0) {
        report_failure("%s:%lu: l=%d, m=%d was given already on line %lu", reader->name,
                       reader->line, l, m, raw->lines[i]);
        return false;
    }
    raw->lines[i] = reader->line;
    raw->degree = l > raw->degree ? l : raw->degree;
    return csv_numbers(reader, 2, raw->columns, raw->rows[i]);
}

static bool check_complete(const char *name, const raw_table *raw) {
    if (raw->degree < 0) {
        report_failure("%s: there are no rows behind the header", name);
        return false;
    }
    for (int l = 0; l <= raw->degree; l++) {
        for (int m = -l; m <= l; m++) {
            if (raw->lines[SHCD_INDEX(l, m)] == 0) {
                report_failure("%s: l=%d, m=%d is missing (the largest l is %d)", name, l, m,
                               raw->degree);
                return false;
            }
        }
    }
    return true;
}

/* A real function has a_l,-m = (-1)^m conj(a_lm); anything else is not three real coordinates. */
static bool check_conjugates(const char *name, const raw_table *raw) {
    double largest = 0.0;
    for (size_t i = 0; i < SHCD_COUNT(raw->degree); i++) {
        for (size_t k = 0; k < COLUMNS_COMPLEX; k++) {
            largest = fmax(largest, fabs(raw->rows[i][k]));
        }
    }
    for (int l = 0; l <= raw->degree; l++) {
        for (int m = 0; m <= l; m++) {
            const double sign = m % 2 == 0 ? 1.0 : -1.0;
            const double *a = raw->rows[SHCD_INDEX(l, m)];
            const double *b = raw->rows[SHCD_INDEX(l, -m)];
            for (size_t k = 0; k < COLUMNS_COMPLEX; k++) {
                const double partner = k % 2 == 0 ? sign * b[k] : -sign * b[k];
                if (!(fabs(a[k] - partner) <= CONJUGATE_TOLERANCE * largest)) {
                    report_failure("%s:%lu: l=%d, m=%d is not (-1)^m times the conjugate of m=%d: "
                                   "not a real surface",
                                   name, raw->lines[SHCD_INDEX(l, -m)], l, -m, m);
                    return false;
                }
            }
        }
    }
    return true;
}

static bool convert(const char *name, const raw_table *raw, coefficient_table *table) {
    const size_t n = SHCD_COUNT(raw->degree);
    double *c = malloc(3 * n * sizeof *c);
    double *a = malloc(2 * n * sizeof *a);
    bool good = c != NULL && a != NULL;
    for (size_t k = 0; good && k < 3; k++) {
        for (size_t i = 0; i < n; i++) {
            c[3 * i + k] = raw->rows[i][k];
            a[2 * i] = raw->rows[i][2 * k];
            a[2 * i + 1] = raw->rows[i][2 * k + 1];
        }
        good = raw->columns == COLUMNS_REAL ||
               shcd_coefficients_from_complex(raw->degree, a, c + k, 3) == SHCD_OK;
    }
    free(a);
    if (!good) {
        report_failure("%s: %s", name, shcd_status_string(SHCD_ERR_MEMORY));
        free(c);
        return false;
    }
    table->degree = raw->degree;
    table->coefficients = c;
    return true;
}

bool coefficient_table_read(FILE *file, const char *name, coefficient_table *table) {
    csv_reader reader;
    csv_status status = CSV_ROW;
    raw_table *raw = calloc(1, sizeof *raw);
    if (raw == NULL) {
        report_failure("%s: %s", name, shcd_status_string(SHCD_ERR_MEMORY));
        return false;
    }
    raw->degree = -1;
    csv_begin(&reader, file, name);
    bool good = read_header(&reader, raw);
    while (good && (status = csv_next(&reader)) == CSV_ROW) {
        good = read_row(&reader, raw);
    }
    good = good && status == CSV_END && check_complete(name, raw) &&
           (raw->columns == COLUMNS_REAL || check_conjugates(name, raw)) &&
           convert(name, raw, table);
    free(raw);
    return good;
}

void coefficient_table_free(coefficient_table *table) {
    free(table->coefficients);
    table->coefficients = NULL;
}
