/* SPDX-License-Identifier: BSD-3-Clause */
/* What each command takes and does, in one table: option parsing, --help, the man pages and the
 * completion of shells all read it, so they cannot disagree. shcdd has its own entry, in daemon/.
 */
#ifndef SHCD_TOOLS_HELP_H
#define SHCD_TOOLS_HELP_H

#include <stdio.h>

#define HELP_OPTIONS_MAX 16

/** Values of getopt_long(): a letter is a short option, too. */
enum option_key {
    OPTION_HELP = 'h',
    OPTION_OUTPUT = 'o',
    OPTION_QUIET = 'q',
    OPTION_DEGREE = 'd',
    OPTION_TOLERANCE = 't',
    OPTION_UNIT = 'u',
    OPTION_SUBDIVIDE = 'n',
    OPTION_DEGREE_MAX = 256,
    OPTION_AREA_WEIGHT,
    OPTION_JSON,
    OPTION_TIER,
    OPTION_COMPLEX,
    OPTION_IMPORT_MEMORY,
    OPTION_IMPORT_TIME,
    OPTION_GRID,
    OPTION_RESOLUTION,
    OPTION_INTERPOLATION,
    OPTION_MESH,
    OPTION_PLOT,
    OPTION_POINTS,
    OPTION_SEED,
    OPTION_STIFFNESS,
    OPTION_QUICK,
    OPTION_MODES,
    OPTION_ANCHOR,
    OPTION_SAMPLES,
    OPTION_YOUNG,
    OPTION_POISSON,
    OPTION_BETA,
    OPTION_PATCH,
    OPTION_SUPPORT,
    OPTION_DEPTH_MAX,
    OPTION_N_SAMPLES,
    OPTION_BODY,
    OPTION_MARKDOWN
};

typedef struct option_help {
    const char *name;
    int key;              /**< an option_key */
    const char *argument; /**< NULL: takes none */
    const char *text;
} option_help;

/** Texts are paragraphs separated by an empty line; lines that start with two blanks are shown as
 *  they are. */
typedef struct command_help {
    const char *name;
    const char *synopsis; /**< behind the name */
    const char *summary;  /**< one line */
    const char *text;
    option_help options[HELP_OPTIONS_MAX]; /**< ended by a null name; --help is added to all */
} command_help;

extern const option_help help_option_help;
extern const char help_exit_status[];

/** Paragraphs, filled to the width of a terminal. */
void help_print_text(FILE *file, const char *text);

/** The answer to --help; `prefix` stands before the command's name: "shcd " or "". */
void help_print_command(FILE *file, const char *prefix, const command_help *command);

/* ---- `shcd` itself ---- */

/** All subcommands, ended by a null name. */
extern const command_help help_commands[];

extern const char help_summary[];
extern const char help_introduction[];
extern const char help_examples[];

/** NULL if there is no such subcommand. */
const command_help *help_find(const char *name);

/** `shcd --help`. */
void help_print_overview(FILE *file);

#endif
