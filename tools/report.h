/* SPDX-License-Identifier: BSD-3-Clause */
/* What the command says to its user when something is wrong: always one line on stderr, starting
 * with the command that failed, and an exit status that a script can rely on. */
#ifndef SHCD_TOOLS_REPORT_H
#define SHCD_TOOLS_REPORT_H

#include "shcd/base.h"

enum exit_status { STATUS_DONE = 0, STATUS_FAILED = 1, STATUS_USAGE = 2 };

/** Names the subcommand that every later line starts with; NULL: none. */
void report_begin(const char *command);

/** One line on stderr; returns STATUS_FAILED. */
__attribute__((format(printf, 1, 2))) int report_failure(const char *format, ...);

/** One line on stderr that points to --help; returns STATUS_USAGE. */
__attribute__((format(printf, 1, 2))) int report_usage(const char *format, ...);

/** One line on stderr; the command goes on. */
__attribute__((format(printf, 1, 2))) void report_warning(const char *format, ...);

/** What a library call that failed has to say: its message, else the text of its status. */
const char *report_reason(shcd_status status, const shcd_error *error);

#endif
