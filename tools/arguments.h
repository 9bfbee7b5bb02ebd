/* SPDX-License-Identifier: BSD-3-Clause */
/* The command line of a subcommand, read with getopt_long() by the help table. */
#ifndef SHCD_TOOLS_ARGUMENTS_H
#define SHCD_TOOLS_ARGUMENTS_H

#include "help.h"

#include <getopt.h>
#include <stdbool.h>

typedef struct arguments {
    const command_help *help;
    int argc;
    char **argv;
    const char *value; /**< argument of the option that was read last */
    struct option long_options[HELP_OPTIONS_MAX + 1];
    char short_options[2 * HELP_OPTIONS_MAX + 4];
} arguments;

/** What arguments_next() returns besides an option_key. */
enum { ARGUMENTS_END = 0, ARGUMENTS_HELPED = -1, ARGUMENTS_BAD = -2 };

/** Starts at argv[1]; argv[0] is the subcommand, which must be in the help table. */
void arguments_begin(arguments *a, int argc, char **argv);

/** The key of the next option. --help has been answered (ARGUMENTS_HELPED), a bad option has been
 *  reported (ARGUMENTS_BAD). */
int arguments_next(arguments *a);

/** Takes one option into the request; false: reported. */
typedef bool arguments_taker(void *request, int key, const char *value);

/** Starts as arguments_begin() and takes all options. Returns an exit status, or -1 if the command
 *  is to go on. */
int arguments_take(arguments *a, int argc, char **argv, arguments_taker *take, void *request);

/** Exit status for a negative result of arguments_next(). */
int arguments_status(int key);

/** The one operand, called `name` in messages; NULL: reported. */
const char *arguments_operand(const arguments *a, const char *name);

#endif
