/* SPDX-License-Identifier: BSD-3-Clause */
/* --help of one command, filled to the width of a terminal. */
#include "help.h"

#include <stddef.h>
#include <string.h>

#define WIDTH 80
#define OPTION_INDENT 8

const option_help help_option_help = {"help", OPTION_HELP, NULL, "print this text"};

const char help_exit_status[] =
    "0: done. 1: failed; one line on standard error says why. 2: bad usage.";

/* Fills one paragraph, indented; ends with a newline. */
static void print_filled(FILE *file, const char *text, size_t length, int indent) {
    int column = 0;
    const char *end = text + length;
    while (text < end) {
        const size_t left = (size_t)(end - text);
        const char *space = memchr(text, ' ', left);
        const size_t word = space != NULL ? (size_t)(space - text) : left;
        if (column > 0 && column + 1 + (int)word > WIDTH) {
            fputc('\n', file);
            column = 0;
        }
        fprintf(file, "%*s%.*s", column > 0 ? 1 : indent, "", (int)word, text);
        column += (column > 0 ? 1 : indent) + (int)word;
        text += word + (space != NULL ? 1 : 0);
    }
    fputc('\n', file);
}

void help_print_text(FILE *file, const char *text) {
    while (*text != '\0') {
        const size_t length = strcspn(text, "\n");
        if (length == 0) {
            fputc('\n', file);
        } else if (strncmp(text, "  ", 2) == 0) {
            fprintf(file, "%.*s\n", (int)length, text);
        } else {
            print_filled(file, text, length, 0);
        }
        text += length + (text[length] == '\n' ? 1 : 0);
    }
}

static void print_option(FILE *file, const option_help *option) {
    fputs("  ", file);
    if (option->key < 256) {
        fprintf(file, "-%c, ", option->key);
    }
    fprintf(file, "--%s", option->name);
    if (option->argument != NULL) {
        fprintf(file, " %s", option->argument);
    }
    fputc('\n', file);
    print_filled(file, option->text, strlen(option->text), OPTION_INDENT);
}

void help_print_command(FILE *file, const char *prefix, const command_help *command) {
    fprintf(file, "usage: %s%s %s\n\n", prefix, command->name, command->synopsis);
    help_print_text(file, command->text);
    fputs("\noptions:\n", file);
    for (const option_help *option = command->options; option->name != NULL; option++) {
        print_option(file, option);
    }
    print_option(file, &help_option_help);
    fputs("\nexit status:\n", file);
    help_print_text(file, help_exit_status);
}
