/* SPDX-License-Identifier: BSD-3-Clause */
/* The words and the options of shcdd, for options.c and for the programs that write man pages and
 * completions. */
#ifndef SHCDD_OPTIONS_HELP_H
#define SHCDD_OPTIONS_HELP_H

#include "tools/help.h"

/* Keys of the options; beyond 255: none has a short form. */
enum {
    OPTIONS_PREFIX = 256,
    OPTIONS_URL,
    OPTIONS_DURATION,
    OPTIONS_PRIORITY,
    OPTIONS_CPU,
    OPTIONS_REQUIRE_RT,
    OPTIONS_QUIET,
    OPTIONS_VERSION
};

extern const command_help options_help;

#endif
