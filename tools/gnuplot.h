/* SPDX-License-Identifier: BSD-3-Clause */
/* Pictures by gnuplot, which need not be there when the command is built. */
#ifndef SHCD_TOOLS_GNUPLOT_H
#define SHCD_TOOLS_GNUPLOT_H

#include <stdbool.h>
#include <stdio.h>

enum gnuplot_format { GNUPLOT_SVG, GNUPLOT_PNG, GNUPLOT_UNKNOWN };

/** By the end of the name: .svg or .png. */
enum gnuplot_format gnuplot_format_of(const char *path);

/** False: gnuplot is not in the PATH; reported. */
bool gnuplot_check(void);

/** Writes a program of gnuplot, data included. */
typedef void gnuplot_writer(FILE *program, const void *user);

/** Runs the program; its picture goes into the file. False: reported. */
bool gnuplot_draw(FILE *picture, gnuplot_writer *write, const void *user);

/** A line that sets a variable to a text; characters that gnuplot could take for markup become
 *  blanks. */
void gnuplot_write_text(FILE *program, const char *name, const char *text);

#endif
