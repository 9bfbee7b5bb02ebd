/* SPDX-License-Identifier: BSD-3-Clause */
/* Messages quote paths and pieces of input files, so control characters in them are masked: a
 * message stays one line whatever a file holds. */
#include "report.h"

#include <stdarg.h>
#include <stdio.h>

static const char *command_name = NULL;

void report_begin(const char *command) {
    command_name = command;
}

__attribute__((format(printf, 3, 0))) static void print_line(const char *kind, const char *hint,
                                                             const char *format, va_list list) {
    char text[1024];
    vsnprintf(text, sizeof text, format, list);
    for (char *c = text; *c != '\0'; c++) {
        const unsigned char byte = (unsigned char)*c;
        if (byte < 0x20 || byte == 0x7f) {
            *c = '?';
        }
    }
    const char *space = command_name != NULL ? " " : "";
    const char *name = command_name != NULL ? command_name : "";
    fflush(stdout);
    if (hint != NULL) {
        fprintf(stderr, "shcd%s%s: %s (see '%s%s%s --help')\n", space, name, text, hint, space,
                name);
    } else {
        fprintf(stderr, "shcd%s%s: %s%s\n", space, name, kind, text);
    }
}

int report_failure(const char *format, ...) {
    va_list list;
    va_start(list, format);
    print_line("", NULL, format, list);
    va_end(list);
    return STATUS_FAILED;
}

int report_usage(const char *format, ...) {
    va_list list;
    va_start(list, format);
    print_line("", "shcd", format, list);
    va_end(list);
    return STATUS_USAGE;
}

void report_warning(const char *format, ...) {
    va_list list;
    va_start(list, format);
    print_line("warning: ", NULL, format, list);
    va_end(list);
}

const char *report_reason(shcd_status status, const shcd_error *error) {
    return error->message[0] != '\0' ? error->message : shcd_status_string(status);
}
