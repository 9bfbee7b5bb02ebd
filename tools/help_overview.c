/* SPDX-License-Identifier: BSD-3-Clause */
/* `shcd --help`: what the subcommands have in common. */
#include "help.h"

#include <stddef.h>
#include <string.h>

const command_help *help_find(const char *name) {
    for (const command_help *command = help_commands; command->name != NULL; command++) {
        if (strcmp(command->name, name) == 0) {
            return command;
        }
    }
    return NULL;
}

void help_print_overview(FILE *file) {
    fprintf(file, "usage: shcd COMMAND ...\n\nshcd - %s\n\n", help_summary);
    help_print_text(file, help_introduction);
    fputs("\ncommands:\n", file);
    for (const command_help *command = help_commands; command->name != NULL; command++) {
        fprintf(file, "  %-14s%s\n", command->name, command->summary);
    }
    fputs("\n'shcd COMMAND --help' tells more; 'shcd --version' prints the version.\n\n"
          "exit status:\n",
          file);
    help_print_text(file, help_exit_status);
    fputs("\nexamples:\n", file);
    help_print_text(file, help_examples);
}
