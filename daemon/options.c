/* SPDX-License-Identifier: BSD-3-Clause */
#include "options.h"

#include "options_help.h"
#include "privileges.h"
#include "transport.h"

#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DURATION_MAX_S 1e9

static bool parse_number(const char *name, const char *text, double min, double max,
                         double *value) {
    char *end;
    errno = 0;
    const double v = strtod(text, &end);
    if (end == text || *end != '\0' || errno != 0 || !(v >= min && v <= max)) {
        fprintf(stderr, "shcdd: --%s: '%s' is not a number from %g to %g\n", name, text, min, max);
        return false;
    }
    *value = v;
    return true;
}

static bool parse_integer(const char *name, const char *text, int min, int max, int *value) {
    char *end;
    errno = 0;
    const long v = strtol(text, &end, 10);
    if (end == text || *end != '\0' || errno != 0 || v < min || v > max) {
        fprintf(stderr, "shcdd: --%s: '%s' is not an integer from %d to %d\n", name, text, min,
                max);
        return false;
    }
    *value = (int)v;
    return true;
}

static bool take_option(int option, const char *text, options *out) {
    switch (option) {
    case OPTIONS_PREFIX:
        out->prefix = text;
        if (!transport_prefix_is_valid(text)) {
            fprintf(stderr,
                    "shcdd: --channel-prefix: '%s' is not 1 to %d letters, digits or underscores\n",
                    text, TRANSPORT_PREFIX_MAX);
            return false;
        }
        return true;
    case OPTIONS_URL:
        out->url = text;
        return true;
    case OPTIONS_DURATION:
        return parse_number("duration", text, 1e-3, DURATION_MAX_S, &out->duration_s);
    case OPTIONS_PRIORITY:
        return parse_integer("priority", text, 1, 99, &out->priority);
    case OPTIONS_CPU:
        return parse_integer("cpu", text, 0, 1023, &out->cpu);
    case OPTIONS_REQUIRE_RT:
        out->require_rt = true;
        return true;
    case OPTIONS_QUIET:
        out->quiet = true;
        return true;
    default: /* getopt_long has said what is wrong */
        return false;
    }
}

/* getopt_long's own table; `table` has a place for --help and for the zeros at the end, since the
 * help's one ends with a null name, too. */
static void fill_table(struct option table[HELP_OPTIONS_MAX + 1]) {
    memset(table, 0, (HELP_OPTIONS_MAX + 1) * sizeof *table);
    table[0] = (struct option){help_option_help.name, no_argument, NULL, help_option_help.key};
    for (int i = 0; options_help.options[i].name != NULL; i++) {
        const option_help *option = &options_help.options[i];
        table[i + 1] = (struct option){option->name,
                                       option->argument != NULL ? required_argument : no_argument,
                                       NULL, option->key};
    }
}

options_result options_parse(int argc, char **argv, options *out) {
    struct option table[HELP_OPTIONS_MAX + 1];
    fill_table(table);
    *out = (options){NULL, "SHCD", NULL, 0.0, 80, PRIVILEGES_CPU_ANY, false, false};
    int option;
    while ((option = getopt_long(argc, argv, "h", table, NULL)) != -1) {
        if (option == OPTION_HELP) {
            help_print_command(stdout, "", &options_help);
            return OPTIONS_DONE;
        }
        if (option == OPTIONS_VERSION) {
            printf("shcdd %d.%d.%d\n", SHCD_VERSION_MAJOR, SHCD_VERSION_MINOR, SHCD_VERSION_PATCH);
            return OPTIONS_DONE;
        }
        if (!take_option(option, optarg, out)) {
            return OPTIONS_BAD;
        }
    }
    if (argc - optind > 1) {
        fprintf(stderr, "shcdd: one scene file at most, '%s' is too much\n", argv[optind + 1]);
        return OPTIONS_BAD;
    }
    out->scene = optind < argc ? argv[optind] : NULL;
    return OPTIONS_RUN;
}
