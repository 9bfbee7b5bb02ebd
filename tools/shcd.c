/* SPDX-License-Identifier: BSD-3-Clause */
/* The command `shcd`: finds the subcommand and makes sure that what it printed has arrived. */
#include "commands.h"
#include "help.h"
#include "report.h"

#include "shcd/base.h"

#include <errno.h>
#include <stddef.h>
#include <string.h>

typedef struct command {
    const char *name;
    int (*run)(int argc, char **argv);
} command;

static const command commands[] = {
    {"fit", command_fit},       {"info", command_info},
    {"query", command_query},   {"surface", command_surface},
    {"create", command_create}, {"coefficients", command_coefficients},
    {"cost", command_cost},     {"modes", command_modes},
    {"train", command_train},   {"effects", command_effects},
};

static void print_version(void) {
    const uint32_t version = shcd_version();
    printf("shcd %d.%d.%d (libshcd %u.%u.%u)\n%s\n", SHCD_VERSION_MAJOR, SHCD_VERSION_MINOR,
           SHCD_VERSION_PATCH, (unsigned)(version / 10000u), (unsigned)(version / 100u % 100u),
           (unsigned)(version % 100u), command_fit_build);
}

static int run(int argc, char **argv) {
    if (argc < 2) {
        return report_usage("no command is given");
    }
    if (strcmp(argv[1], "--help") == 0 || strcmp(argv[1], "-h") == 0) {
        help_print_overview(stdout);
        return STATUS_DONE;
    }
    if (strcmp(argv[1], "--version") == 0) {
        print_version();
        return STATUS_DONE;
    }
    for (size_t i = 0; i < sizeof commands / sizeof commands[0]; i++) {
        if (strcmp(argv[1], commands[i].name) == 0) {
            report_begin(commands[i].name);
            return commands[i].run(argc - 1, argv + 1);
        }
    }
    return report_usage("unknown command '%s'", argv[1]);
}

int main(int argc, char **argv) {
    const int status = run(argc, argv);
    if (status == STATUS_DONE && (fflush(stdout) != 0 || ferror(stdout))) {
        return report_failure("standard output: cannot write: %s", strerror(errno));
    }
    return status;
}
