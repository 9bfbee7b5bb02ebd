/* SPDX-License-Identifier: BSD-3-Clause */
/* Build-time program: writes the man page shcd(1) from the table that --help prints. */
#include "help.h"

#include "shcd/base.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

/* Escapes what troff reads as a command: a backslash, and a point or quote at the start of a line.
 * A hyphen-minus must be written \- to stay one when the page is copied from. */
static void put_escaped(const char *text, size_t length) {
    for (size_t i = 0; i < length; i++) {
        if (i == 0 && (text[i] == '.' || text[i] == '\'')) {
            fputs("\\&", stdout);
        }
        if (text[i] == '\\') {
            fputs("\\e", stdout);
        } else if (text[i] == '-') {
            fputs("\\-", stdout);
        } else if (text[i] == '\'') {
            fputs("\\(aq", stdout);
        } else if (text[i] == '^') {
            fputs("\\(ha", stdout);
        } else {
            putchar(text[i]);
        }
    }
}

static void put_line(const char *text) {
    put_escaped(text, strlen(text));
    putchar('\n');
}

/* Lines that start with two blanks stay as they are, set in a fixed-width block. */
static void put_text(const char *text) {
    bool literal = false;
    while (*text != '\0') {
        const size_t length = strcspn(text, "\n");
        const bool wants_literal = strncmp(text, "  ", 2) == 0;
        if (literal && !wants_literal) {
            puts(".EE\n.RE");
        } else if (!literal && wants_literal) {
            puts(".PP\n.RS 4\n.EX");
        }
        literal = wants_literal;
        if (length == 0) {
            puts(".PP");
        } else {
            const size_t skip = literal ? 2 : 0;
            put_escaped(text + skip, length - skip);
            putchar('\n');
        }
        text += length + (text[length] == '\n' ? 1 : 0);
    }
    if (literal) {
        puts(".EE\n.RE");
    }
}

static void put_option(const option_help *option) {
    puts(".TP");
    if (option->key < 256) {
        printf("\\fB\\-%c\\fR, ", option->key);
    }
    fputs("\\fB\\-\\-", stdout);
    put_escaped(option->name, strlen(option->name));
    fputs("\\fR", stdout);
    if (option->argument != NULL) {
        printf(" \\fI%s\\fR", option->argument);
    }
    putchar('\n');
    put_line(option->text);
}

static void put_command(const command_help *command) {
    printf(".SS shcd %s\n", command->name);
    printf(".B shcd %s\n", command->name);
    put_line(command->synopsis);
    puts(".PP");
    put_text(command->text);
    for (const option_help *option = command->options; option->name != NULL; option++) {
        put_option(option);
    }
}

int main(void) {
    printf(".\\\" SPDX-License-Identifier: BSD-3-Clause\n"
           ".TH SHCD 1 \"\" \"shcd %d.%d.%d\" \"User Commands\"\n"
           ".SH NAME\nshcd \\- %s\n.SH SYNOPSIS\n",
           SHCD_VERSION_MAJOR, SHCD_VERSION_MINOR, SHCD_VERSION_PATCH, help_summary);
    for (const command_help *command = help_commands; command->name != NULL; command++) {
        printf(".B shcd %s\n", command->name);
        put_line(command->synopsis);
        puts(".br");
    }
    puts(".B shcd\n[\\fICOMMAND\\fR] \\-\\-help | \\-\\-version\n.SH DESCRIPTION");
    put_text(help_introduction);
    puts(".SH COMMANDS");
    for (const command_help *command = help_commands; command->name != NULL; command++) {
        put_command(command);
    }
    puts(".SH EXIT STATUS");
    put_text(help_exit_status);
    puts(".SH EXAMPLES");
    put_text(help_examples);
    return fflush(stdout) == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
