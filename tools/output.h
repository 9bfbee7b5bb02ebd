/* SPDX-License-Identifier: BSD-3-Clause */
/* Files that appear whole or not at all: written under a temporary name in the same folder and
 * renamed when complete; a failure or a signal removes the temporary file. */
#ifndef SHCD_TOOLS_OUTPUT_H
#define SHCD_TOOLS_OUTPUT_H

#include <limits.h>
#include <stdbool.h>
#include <stdio.h>

/** One file under way; at most one at a time in a process, since the signal handler knows one. */
typedef struct output_file {
    FILE *file;
    const char *path; /**< borrowed; "-": standard output */
    char temporary[PATH_MAX];
} output_file;

/** Refuses, with a line on stderr, a path that cannot become an output file: so that long work is
 *  not done in vain, and a device or folder is never replaced. */
bool output_check(const char *path);

/** True if both paths name one file, links included; a missing file equals only the same text. */
bool output_same(const char *a, const char *b);

/** Opens the temporary file, or standard output for "-". Prints the reason if it fails. */
bool output_open(output_file *output, const char *path);

/** Writes out and closes; the file still has its temporary name. On failure nothing is left. */
bool output_finish(output_file *output);

/** Gives a finished file its name. On failure nothing is left. */
bool output_publish(output_file *output);

/** Removes what was written so far; harmless after any of the calls above. */
void output_abandon(output_file *output);

#endif
