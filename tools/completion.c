/* SPDX-License-Identifier: BSD-3-Clause */
/* Build-time program: writes the completion of `shcd` or `shcdd` for bash, from the tables that
 * --help prints. It knows commands and options; everything else is left to bash's file names. */
#include "help.h"

#include "daemon/options_help.h"

#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void put_options(const command_help *command) {
    for (const option_help *option = command->options; option->name != NULL; option++) {
        printf("--%s ", option->name);
    }
    printf("--%s", help_option_help.name);
}

static void put_shcd(void) {
    puts("    if [ \"$COMP_CWORD\" -eq 1 ]; then");
    fputs("        words='", stdout);
    for (const command_help *command = help_commands; command->name != NULL; command++) {
        printf("%s ", command->name);
    }
    puts("--help --version'");
    puts("    elif [[ $word == -* ]]; then\n"
         "        case ${COMP_WORDS[1]} in");
    for (const command_help *command = help_commands; command->name != NULL; command++) {
        printf("        %s) words='", command->name);
        put_options(command);
        puts("' ;;");
    }
    puts("        esac\n"
         "    fi");
}

static void put_shcdd(void) {
    fputs("    if [[ $word == -* ]]; then\n"
          "        words='",
          stdout);
    put_options(&options_help);
    puts("'\n    fi");
}

int main(int argc, char **argv) {
    const char *name = argc == 2 ? argv[1] : "";
    const int is_shcd = strcmp(name, "shcd") == 0;
    if (!is_shcd && strcmp(name, "shcdd") != 0) {
        fputs("usage: shcd_completion shcd|shcdd\n", stderr);
        return 2;
    }
    printf("# bash completion for %s -*- shell-script -*-\n"
           "_%s() {\n"
           "    local word=${COMP_WORDS[COMP_CWORD]} words=\n",
           name, name);
    if (is_shcd) {
        put_shcd();
    } else {
        put_shcdd();
    }
    printf("    COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n"
           "}\n"
           "complete -o default -F _%s %s\n",
           name, name);
    return fflush(stdout) == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
