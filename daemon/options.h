/* SPDX-License-Identifier: BSD-3-Clause */
/* The command line of shcdd. */
#ifndef SHCDD_OPTIONS_H
#define SHCDD_OPTIONS_H

#include <stdbool.h>

typedef struct options {
    const char *scene;  /* NULL: the built-in one */
    const char *prefix; /* of the channels */
    const char *url;    /* NULL: LCM's default */
    double duration_s;  /* 0: until a signal */
    int priority;       /* of SCHED_FIFO */
    int cpu;            /* PRIVILEGES_CPU_ANY, or the only one for the loop */
    bool require_rt;
    bool quiet;
} options;

typedef enum options_result {
    OPTIONS_RUN,  /* go on */
    OPTIONS_DONE, /* help or version was printed: exit 0 */
    OPTIONS_BAD   /* one line was printed: exit 2 */
} options_result;

options_result options_parse(int argc, char **argv, options *out);

#endif
