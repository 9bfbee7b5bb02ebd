/* SPDX-License-Identifier: BSD-3-Clause */
/* Build-time program: writes one man page, shcd(1), shcd-COMMAND(1) or shcdd(1), from the tables
 * that --help prints. */
#include "help.h"

#include "daemon/options_help.h"

#include "shcd/base.h"

#include <ctype.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
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

static void put_title(const char *prefix, const char *name, const char *summary) {
    printf(".\\\" SPDX-License-Identifier: BSD-3-Clause\n.TH ");
    for (const char *part = prefix; *part != '\0'; part++) {
        putchar(toupper((unsigned char)*part));
    }
    for (const char *part = name; *part != '\0'; part++) {
        putchar(toupper((unsigned char)*part));
    }
    printf(" 1 \"\" \"shcd %d.%d.%d\" \"User Commands\"\n.SH NAME\n%s%s \\- ", SHCD_VERSION_MAJOR,
           SHCD_VERSION_MINOR, SHCD_VERSION_PATCH, prefix, name);
    put_line(summary);
}

/* The examples that start with these words; without any, no section. */
static void put_examples(const char *words) {
    bool any = false;
    for (const char *line = help_examples; *line != '\0';) {
        const size_t length = strcspn(line, "\n");
        if (strncmp(line + 2, words, strlen(words)) == 0) {
            puts(any ? ".br" : ".SH EXAMPLES\n.nf");
            any = true;
            put_escaped(line + 2, length - 2);
            putchar('\n');
        }
        line += length + (line[length] == '\n' ? 1 : 0);
    }
    if (any) {
        puts(".fi");
    }
}

static void put_exit_status(void) {
    puts(".SH EXIT STATUS");
    put_text(help_exit_status);
}

/* "shcd fit" is what is typed, shcd-fit is what its page is called. */
static void put_command(const char *typed_prefix, const char *page_prefix,
                        const command_help *command, const char *see_also) {
    put_title(page_prefix, command->name, command->summary);
    printf(".SH SYNOPSIS\n.B %s%s\n", typed_prefix, command->name);
    put_line(command->synopsis);
    puts(".SH DESCRIPTION");
    put_text(command->text);
    puts(".SH OPTIONS");
    for (const option_help *option = command->options; option->name != NULL; option++) {
        put_option(option);
    }
    put_option(&help_option_help);
    put_exit_status();
    if (*typed_prefix != '\0') {
        char words[64];
        snprintf(words, sizeof words, "%s%s ", typed_prefix, command->name);
        put_examples(words);
    }
    printf(".SH SEE ALSO\n.BR %s (1)\n", see_also);
}

static void put_overview(void) {
    put_title("", "shcd", help_summary);
    puts(".SH SYNOPSIS\n.B shcd\n.I COMMAND\n[\\fIoptions\\fR]\n.br\n"
         ".B shcd\n[\\fICOMMAND\\fR] \\-\\-help\n.br\n.B shcd\n\\-\\-version\n.SH DESCRIPTION");
    put_text(help_introduction);
    puts(".SH COMMANDS");
    for (const command_help *command = help_commands; command->name != NULL; command++) {
        printf(".TP\n.BR shcd\\-%s (1)\n", command->name);
        put_line(command->summary);
    }
    put_exit_status();
    put_examples("shcd ");
    puts(".SH SEE ALSO\n.BR shcdd (1)");
}

int main(int argc, char **argv) {
    const char *page = argc == 2 ? argv[1] : "";
    const command_help *command = strncmp(page, "shcd-", 5) == 0 ? help_find(page + 5) : NULL;
    if (strcmp(page, "shcd") == 0) {
        put_overview();
    } else if (strcmp(page, "shcdd") == 0) {
        put_command("", "", &options_help, "shcd");
    } else if (command != NULL) {
        put_command("shcd ", "shcd-", command, "shcd");
    } else {
        fputs("usage: shcd_man_page shcd|shcd-COMMAND|shcdd\n", stderr);
        return 2;
    }
    return fflush(stdout) == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
