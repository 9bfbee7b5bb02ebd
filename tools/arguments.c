/* SPDX-License-Identifier: BSD-3-Clause */
/* getopt_long() is kept silent (opterr = 0) and its complaints are worded here, so that they are
 * one line with the name of the subcommand. */
#include "arguments.h"

#include "report.h"

#include <stddef.h>
#include <string.h>

static size_t add_option(arguments *a, size_t n, size_t n_short, const option_help *option) {
    struct option *entry = &a->long_options[n];
    entry->name = option->name;
    entry->has_arg = option->argument != NULL ? required_argument : no_argument;
    entry->flag = NULL;
    entry->val = option->key;
    if (option->key < 256) {
        a->short_options[n_short++] = (char)option->key;
        if (option->argument != NULL) {
            a->short_options[n_short++] = ':';
        }
    }
    return n_short;
}

void arguments_begin(arguments *a, int argc, char **argv) {
    memset(a, 0, sizeof *a);
    a->help = help_find(argv[0]);
    a->argc = argc;
    a->argv = argv;
    size_t n = 0;
    a->short_options[0] = ':'; /* tells a missing argument from an unknown option */
    size_t n_short = 1;
    for (; a->help->options[n].name != NULL; n++) {
        n_short = add_option(a, n, n_short, &a->help->options[n]);
    }
    add_option(a, n, n_short, &help_option_help);
    opterr = 0;
    optind = 0; /* glibc: start anew, the command line of main() was not read by getopt */
}

static const option_help *find_key(const arguments *a, int key) {
    for (const option_help *option = a->help->options; option->name != NULL; option++) {
        if (option->key == key) {
            return option;
        }
    }
    return key == OPTION_HELP ? &help_option_help : NULL;
}

static int report_bad_option(const arguments *a, int result) {
    const char *text = a->argv[optind - 1];
    const option_help *option = optopt != 0 ? find_key(a, optopt) : NULL;
    if (result == ':') {
        report_usage("option --%s needs an argument", option != NULL ? option->name : text);
    } else if (option != NULL) {
        report_usage("option --%s takes no argument", option->name);
    } else if (optopt != 0) {
        report_usage("unknown option -%c", optopt);
    } else {
        report_usage("unknown or ambiguous option %s", text);
    }
    return ARGUMENTS_BAD;
}

int arguments_next(arguments *a) {
    const int result = getopt_long(a->argc, a->argv, a->short_options, a->long_options, NULL);
    a->value = optarg;
    if (result == -1) {
        return ARGUMENTS_END;
    }
    if (result == ':' || result == '?') {
        return report_bad_option(a, result);
    }
    if (result == OPTION_HELP) {
        help_print_command(stdout, "shcd ", a->help);
        return ARGUMENTS_HELPED;
    }
    return result;
}

int arguments_status(int key) {
    return key == ARGUMENTS_HELPED ? STATUS_DONE : STATUS_USAGE;
}

int arguments_take(arguments *a, int argc, char **argv, arguments_taker *take, void *request) {
    int key;
    arguments_begin(a, argc, argv);
    while ((key = arguments_next(a)) > 0) {
        if (!take(request, key, a->value)) {
            return STATUS_USAGE;
        }
    }
    return key == ARGUMENTS_END ? -1 : arguments_status(key);
}

const char *arguments_operand(const arguments *a, const char *name) {
    if (optind >= a->argc) {
        report_usage("%s is missing", name);
        return NULL;
    }
    if (optind + 1 < a->argc) {
        report_usage("unexpected operand '%s'", a->argv[optind + 1]);
        return NULL;
    }
    return a->argv[optind];
}
