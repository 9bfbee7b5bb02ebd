/* SPDX-License-Identifier: BSD-3-Clause */
/* Memory is bounded by one line, so that a stream of any length, or a device that never ends a
 * line, can be read. */
#include "csv.h"

#include "number.h"
#include "report.h"

#include <errno.h>
#include <string.h>

void csv_begin(csv_reader *reader, FILE *file, const char *name) {
    reader->file = file;
    reader->name = name;
    reader->line = 0;
    reader->n_fields = 0;
}

/* getc() rather than fgets(): a zero byte must be seen as what it is, not as the end of the line.
 */
static csv_status read_line(csv_reader *reader) {
    size_t length = 0;
    int c;
    while ((c = getc(reader->file)) != EOF && c != '\n') {
        if (length == 0) {
            reader->line++;
        }
        if (c == '\0' || length + 1 == CSV_LINE_MAX) {
            report_failure("%s:%lu: %s", reader->name, reader->line,
                           c == '\0' ? "a zero byte: this is not text"
                                     : "the line is longer than 4095 bytes");
            return CSV_BAD;
        }
        reader->text[length++] = (char)c;
    }
    if (ferror(reader->file)) {
        report_failure("%s: cannot read: %s", reader->name, strerror(errno));
        return CSV_BAD;
    }
    if (c == EOF && length == 0) {
        return CSV_END;
    }
    if (length == 0) {
        reader->line++;
    }
    reader->text[length] = '\0';
    return CSV_ROW;
}

static char *trim(char *text) {
    static const char blanks[] = " \t\r";
    text += strspn(text, blanks);
    size_t length = strlen(text);
    while (length > 0 && strchr(blanks, text[length - 1]) != NULL) {
        length--;
    }
    text[length] = '\0';
    return text;
}

csv_status csv_next(csv_reader *reader) {
    static const char byte_order_mark[] = "\xef\xbb\xbf";
    char *rest;
    do {
        const csv_status status = read_line(reader);
        if (status != CSV_ROW) {
            return status;
        }
        rest = reader->text;
        if (reader->line == 1 && strncmp(rest, byte_order_mark, 3) == 0) {
            rest += 3;
        }
        rest = trim(rest);
    } while (rest[0] == '\0' || rest[0] == '#');

    reader->n_fields = 0;
    while (rest != NULL) {
        if (reader->n_fields == CSV_FIELDS_MAX) {
            report_failure("%s:%lu: more than %d fields", reader->name, reader->line,
                           CSV_FIELDS_MAX);
            return CSV_BAD;
        }
        char *comma = strchr(rest, ',');
        if (comma != NULL) {
            *comma = '\0';
        }
        reader->fields[reader->n_fields++] = trim(rest);
        rest = comma != NULL ? comma + 1 : NULL;
    }
    return CSV_ROW;
}

bool csv_is_header(const csv_reader *reader, const char *names) {
    for (size_t i = 0; i < reader->n_fields; i++) {
        const size_t length = strlen(reader->fields[i]);
        const char end = i + 1 < reader->n_fields ? ',' : '\0';
        if (strncmp(names, reader->fields[i], length) != 0 || names[length] != end) {
            return false;
        }
        names += length + 1;
    }
    return reader->n_fields > 0;
}

bool csv_numbers(const csv_reader *reader, size_t first, size_t n, double *values) {
    for (size_t i = 0; i < n; i++) {
        if (!number_parse(reader->fields[first + i], &values[i])) {
            report_failure("%s:%lu: field %zu, '%.40s', is not a finite number", reader->name,
                           reader->line, first + i + 1, reader->fields[first + i]);
            return false;
        }
    }
    return true;
}
