/* SPDX-License-Identifier: BSD-3-Clause */
#include "options.h"

#include "privileges.h"
#include "transport.h"

#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define DURATION_MAX_S 1e9

static const char help_text[] =
    "Usage: shcdd [OPTION]... [SCENE.yaml]\n"
    "Serves the forces of soft bodies to haptic tools over LCM, by default 1000 times a second.\n"
    "Without a scene file: an ellipsoid (semi-axes 8, 6, 5 cm), a point tool 0 and a sphere tool "
    "1\n"
    "of 3 mm.\n"
    "\n"
    "  --channel-prefix=P  channels P_TOOL, P_FORCE, P_STATUS, P_DEFORM, P_COMMAND, P_ACK\n"
    "                      (default SHCD; letters, digits and _)\n"
    "  --lcm-url=URL       LCM network (default $LCM_DEFAULT_URL, else LCM's own default)\n"
    "  --duration=S        end after S seconds (default: run until SIGTERM or SIGINT)\n"
    "  --priority=N        SCHED_FIFO priority of the loop, 1 to 99 (default 80)\n"
    "  --cpu=N             bind the loop to CPU N (default: any)\n"
    "  --require-rt        fail unless SCHED_FIFO, locked memory and the CPU asked for are "
    "granted\n"
    "  --quiet             no start-up and no end line\n"
    "  --help, --version\n"
    "\n"
    "SIGTERM, SIGINT and SIGHUP let all forces ramp to zero, publish the zero, and end.\n"
    "Exit status: 0 done, 1 failed, 2 bad usage.\n";

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
    case 'p':
        out->prefix = text;
        if (!transport_prefix_is_valid(text)) {
            fprintf(stderr,
                    "shcdd: --channel-prefix: '%s' is not 1 to %d letters, digits or underscores\n",
                    text, TRANSPORT_PREFIX_MAX);
            return false;
        }
        return true;
    case 'u':
        out->url = text;
        return true;
    case 'd':
        return parse_number("duration", text, 1e-3, DURATION_MAX_S, &out->duration_s);
    case 'r':
        return parse_integer("priority", text, 1, 99, &out->priority);
    case 'c':
        return parse_integer("cpu", text, 0, 1023, &out->cpu);
    case 'R':
        out->require_rt = true;
        return true;
    case 'q':
        out->quiet = true;
        return true;
    default: /* getopt_long has said what is wrong */
        return false;
    }
}

options_result options_parse(int argc, char **argv, options *out) {
    static const struct option table[] = {
        {"channel-prefix", required_argument, NULL, 'p'},
        {"lcm-url", required_argument, NULL, 'u'},
        {"duration", required_argument, NULL, 'd'},
        {"priority", required_argument, NULL, 'r'},
        {"cpu", required_argument, NULL, 'c'},
        {"require-rt", no_argument, NULL, 'R'},
        {"quiet", no_argument, NULL, 'q'},
        {"help", no_argument, NULL, 'h'},
        {"version", no_argument, NULL, 'v'},
        {NULL, 0, NULL, 0},
    };
    *out = (options){NULL, "SHCD", NULL, 0.0, 80, PRIVILEGES_CPU_ANY, false, false};
    int option;
    while ((option = getopt_long(argc, argv, "", table, NULL)) != -1) {
        if (option == 'h') {
            fputs(help_text, stdout);
            return OPTIONS_DONE;
        }
        if (option == 'v') {
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
