/* SPDX-License-Identifier: BSD-3-Clause */
/* Golden tables: text files with one case a line, fields between '|', '#' for comments. Anyone may
 * add a line; a line that cannot be read fails with its number. */
#ifndef SHCD_TESTS_TABLE_H
#define SHCD_TESTS_TABLE_H

#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TABLE_FIELDS_MAX 6

typedef struct table {
    FILE *file;
    const char *path;
    int line;
    int n_rows, n_failed;
    double worst; /* largest residual over its tolerance */
    size_t n_fields;
    char text[1024];
    char *fields[TABLE_FIELDS_MAX];
} table;

static inline void table_complain(table *t, const char *format, ...)
    __attribute__((format(printf, 2, 3)));
static inline void table_complain(table *t, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    fprintf(stderr, "%s:%d: ", t->path, t->line);
    vfprintf(stderr, format, arguments);
    fprintf(stderr, "\n");
    va_end(arguments);
    t->n_failed++;
}

/** @return 0, or 1 after a message. */
static inline int table_open(table *t, const char *path) {
    memset(t, 0, sizeof *t);
    t->path = path;
    t->file = fopen(path, "r");
    if (t->file == NULL) {
        fprintf(stderr, "cannot read %s\n", path);
    }
    return t->file == NULL;
}

/** Moves to the next case of n_fields <= TABLE_FIELDS_MAX fields. @return 0 at the end. */
static inline int table_next(table *t, size_t n_fields) {
    while (fgets(t->text, sizeof t->text, t->file) != NULL) {
        t->line++;
        if (strchr(t->text, '\n') == NULL && !feof(t->file)) {
            table_complain(t, "longer than %zu bytes", sizeof t->text - 2);
            return 0;
        }
        t->text[strcspn(t->text, "#\n")] = '\0';
        if (strspn(t->text, " \t\r") == strlen(t->text)) {
            continue;
        }
        t->n_rows++;
        t->n_fields = 0;
        for (char *rest = t->text; rest != NULL && t->n_fields < n_fields;) {
            /* the last field, the source, may contain bars */
            char *bar = t->n_fields + 1 < n_fields ? strchr(rest, '|') : NULL;
            t->fields[t->n_fields++] = rest;
            if (bar != NULL) {
                *bar = '\0';
            }
            rest = bar != NULL ? bar + 1 : NULL;
        }
        if (t->n_fields == n_fields) {
            return 1;
        }
        table_complain(t, "%zu fields between bars, not %zu", t->n_fields, n_fields);
    }
    return 0;
}

/** Takes the next word off a field; NULL if there is none. */
static inline char *table_word(char **rest) {
    char *word = *rest + strspn(*rest, " \t");
    const size_t n = strcspn(word, " \t");
    if (n == 0) {
        return NULL;
    }
    *rest = word + n + (word[n] != '\0');
    word[n] = '\0';
    return word;
}

/** Takes n numbers off a field. @return 0, or 1 after a complaint. */
static inline int table_numbers(table *t, char **rest, size_t n, double *numbers) {
    for (size_t i = 0; i < n; i++) {
        char *word = table_word(rest), *end = NULL;
        numbers[i] = word != NULL ? strtod(word, &end) : 0.0;
        if (word == NULL || *end != '\0') {
            table_complain(t, "'%s' is no number", word != NULL ? word : "(nothing)");
            return 1;
        }
    }
    return 0;
}

/** n numbers and then this unit, or nothing if unit is NULL; and nothing more. */
static inline int table_quantity(table *t, size_t field, size_t n, double *numbers,
                                 const char *unit) {
    char *rest = t->fields[field];
    if (table_numbers(t, &rest, n, numbers) != 0) {
        return 1;
    }
    const char *found = table_word(&rest);
    const char *more = found != NULL ? table_word(&rest) : NULL;
    if (more != NULL || (unit == NULL) != (found == NULL) ||
        (unit != NULL && strcmp(unit, found) != 0)) {
        table_complain(t, "field %zu should end with %s", field + 1,
                       unit != NULL ? unit : "its last number");
        return 1;
    }
    return 0;
}

/** Compares; a tolerance that is not positive allows equality only. */
static inline void table_check(table *t, double found, double expected, double tolerance) {
    const double off = found < expected ? expected - found : found - expected;
    if (!(off <= tolerance)) {
        table_complain(t, "found %.17g, expected %.17g, off by %.3g, tolerance %.3g", found,
                       expected, off, tolerance);
    } else if (tolerance > 0.0 && off > t->worst * tolerance) {
        t->worst = off / tolerance;
    }
}

/** Prints the sum. @return the exit status: 0 if there were enough rows and none failed. */
static inline int table_close(table *t, int rows_min) {
    fclose(t->file);
    printf("%s: %d rows, %d failures, worst residual %.3g of its tolerance\n", t->path, t->n_rows,
           t->n_failed, t->worst);
    if (t->n_rows < rows_min) {
        fprintf(stderr, "%s: %d rows, not %d or more\n", t->path, t->n_rows, rows_min);
    }
    return t->n_failed != 0 || t->n_rows < rows_min;
}

#endif
