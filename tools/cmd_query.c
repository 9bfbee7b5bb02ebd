/* SPDX-License-Identifier: BSD-3-Clause */
/* `shcd query`: points in, signed distances out, row by row in constant memory. */
#include "arguments.h"
#include "body.h"
#include "commands.h"
#include "csv.h"
#include "number.h"
#include "report.h"

#include "shcd/map.h"
#include "shcd/vec.h"

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

typedef struct flag_name {
    uint32_t flag;
    const char *name;
} flag_name;

static const flag_name flag_names[] = {{SHCD_PROXIMITY_TRUNCATED, "truncated"},
                                       {SHCD_PROXIMITY_SIGN_UNSURE, "sign_unsure"},
                                       {SHCD_PROXIMITY_NOT_STATIONARY, "not_stationary"},
                                       {SHCD_PROXIMITY_MAP_EDGE, "map_edge"},
                                       {SHCD_PROXIMITY_RADIAL, "radial"}};

typedef struct query_request {
    const char *path;
    int tier;
    double tolerance_m;     /**< 0: the library's default */
    const char *map_option; /**< the first option given that only the map tier knows, or NULL */
    int interpolation;
    int grid, resolution; /**< resolution 0: the library's default */
    bool own_map;         /**< a map other than the body's is asked for */
} query_request;

/* One of two words; false: reported. */
static bool parse_choice(const char *option, const char *text, const char *zero, const char *one,
                         int *value) {
    *value = strcmp(text, one) == 0;
    if (*value == 0 && strcmp(text, zero) != 0) {
        report_usage("--%s %s: must be %s or %s", option, text, zero, one);
        return false;
    }
    return true;
}

static bool parse_tier(const char *text, int *tier) {
    if (strcmp(text, "exact") == 0) {
        *tier = SHCD_TIER_EXACT;
    } else if (strcmp(text, "fast") == 0) {
        *tier = SHCD_TIER_FAST;
    } else if (strcmp(text, "map") == 0) {
        *tier = SHCD_TIER_MAP;
    } else {
        report_usage("--tier %s: must be map, fast or exact", text);
        return false;
    }
    return true;
}

/* False: reported. */
static bool take_option(void *user, int key, const char *value) {
    query_request *request = user;
    switch (key) {
    case OPTION_TOLERANCE:
        if (!number_parse_length(value, &request->tolerance_m)) {
            report_usage("--tolerance %s: is not a positive length", value);
            return false;
        }
        return true;
    case OPTION_INTERPOLATION:
        request->map_option = "interpolation";
        return parse_choice("interpolation", value, "linear", "hermite", &request->interpolation);
    case OPTION_GRID:
        request->map_option = "grid";
        request->own_map = true;
        return parse_choice("grid", value, "octahedral", "latlong", &request->grid);
    case OPTION_RESOLUTION:
        request->map_option = "resolution";
        request->own_map = true;
        if (!number_parse_integer(value, 2, SHCD_MAP_RESOLUTION_MAX, &request->resolution)) {
            report_usage("--resolution %s: must be a whole number from 2 to %d", value,
                         SHCD_MAP_RESOLUTION_MAX);
            return false;
        }
        return true;
    default:
        return parse_tier(value, &request->tier);
    }
}

/* Returns an exit status, or -1 if the command is to go on. */
static int parse_request(int argc, char **argv, query_request *request) {
    arguments a;
    const int status = arguments_take(&a, argc, argv, take_option, request);
    if (status >= 0) {
        return status;
    }
    if (request->tier == SHCD_TIER_MAP && request->tolerance_m > 0.0) {
        return report_usage("--tolerance has no meaning with --tier map");
    }
    if (request->tier != SHCD_TIER_MAP && request->map_option != NULL) {
        return report_usage("--%s has a meaning with --tier map only", request->map_option);
    }
    if (request->interpolation == SHCD_MAP_HERMITE &&
        request->grid == SHCD_MAP_LATITUDE_LONGITUDE) {
        return report_usage("--interpolation hermite needs --grid octahedral");
    }
    request->path = arguments_operand(&a, "BODY.shcd");
    return request->path != NULL ? -1 : STATUS_USAGE;
}

/* The library wants upper - lower <= t max(diagonal, |d|). |d| is not known yet, but the surface
 * lies in the enclosing ball, so |d| <= |p - centre| + radius, and with this bound in the place of
 * |d| the width stays below the metres asked for. */
static double relative_tolerance(const shcd_model_info *info, shcd_vec3 p, double tolerance_m) {
    const double farthest_m = shcd_norm(shcd_sub(p, info->centre_m)) + info->radius_m;
    const double relative = tolerance_m / fmax(info->diagonal_m, farthest_m);
    return fmin(relative, 1.0);
}

static void print_flags(uint32_t flags) {
    const char *separator = "";
    for (size_t i = 0; i < sizeof flag_names / sizeof flag_names[0]; i++) {
        if ((flags & flag_names[i].flag) != 0) {
            printf("%s%s", separator, flag_names[i].name);
            separator = "|";
        }
    }
}

static void print_row(shcd_vec3 p, const shcd_proximity *r) {
    printf("%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,", p.x, p.y, p.z, r->distance_m, r->lower_m,
           r->upper_m);
    printf("%.17g,%.17g,%.17g,%.17g,%.17g,%.17g,", r->point_m.x, r->point_m.y, r->point_m.z,
           r->normal.x, r->normal.y, r->normal.z);
    print_flags(r->flags);
    putchar('\n');
}

/* One row of input; false: reported. */
static bool answer(const shcd_model *model, const shcd_map *map, const shcd_model_info *info,
                   const query_request *request, const csv_reader *reader) {
    double v[3];
    if (reader->n_fields != 3) {
        report_failure("%s:%lu: %zu fields instead of x,y,z", reader->name, reader->line,
                       reader->n_fields);
        return false;
    }
    if (!csv_numbers(reader, 0, 3, v)) {
        return false;
    }
    const shcd_vec3 p = shcd_vec3_make(v[0], v[1], v[2]);
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    options.tier = request->tier;
    options.map_hermite = request->interpolation;
    if (request->tolerance_m > 0.0) {
        options.tolerance = relative_tolerance(info, p, request->tolerance_m);
    }
    shcd_proximity result;
    const shcd_status status = map != NULL ? shcd_map_query(map, p, request->interpolation, &result)
                                           : shcd_closest(model, p, &options, &result);
    if (status != SHCD_OK) {
        report_failure("%s:%lu: %s", reader->name, reader->line, shcd_status_string(status));
        return false;
    }
    print_row(p, &result);
    return true;
}

static int answer_all(const shcd_model *model, const shcd_map *map, const query_request *request) {
    shcd_model_info info;
    if (!body_describe(model, &info)) {
        return STATUS_FAILED;
    }
    struct stat status;
    if (fstat(STDIN_FILENO, &status) != 0 || !S_ISREG(status.st_mode)) {
        setvbuf(stdout, NULL, _IOLBF, BUFSIZ);
    }
    csv_reader reader;
    csv_begin(&reader, stdin, "stdin");
    bool first = true;
    puts("x,y,z,distance,lower,upper,cx,cy,cz,nx,ny,nz,flags");
    csv_status row;
    while ((row = csv_next(&reader)) == CSV_ROW) {
        const bool header = first && csv_is_header(&reader, "x,y,z");
        first = false;
        if (!header && !answer(model, map, &info, request, &reader)) {
            return STATUS_FAILED;
        }
        if (ferror(stdout)) {
            break; /* main() says why */
        }
    }
    return row == CSV_BAD ? STATUS_FAILED : STATUS_DONE;
}

/* False: reported. */
static bool make_map(const shcd_model *model, const query_request *request, shcd_map **map) {
    shcd_map_options options = SHCD_MAP_OPTIONS_INIT;
    shcd_error error = {SHCD_OK, ""};
    options.grid = request->grid;
    options.resolution = request->resolution;
    if (shcd_map_create(model, &options, NULL, map, &error) != SHCD_OK) {
        report_failure("%s: %s", request->path, error.message);
        return false;
    }
    return true;
}

int command_query(int argc, char **argv) {
    query_request request = {
        NULL, SHCD_TIER_EXACT, 0.0, NULL, SHCD_MAP_LINEAR, SHCD_MAP_OCTAHEDRAL, 0, false};
    const int status = parse_request(argc, argv, &request);
    if (status >= 0) {
        return status;
    }
    shcd_model *model = body_load(request.path);
    if (model == NULL) {
        return STATUS_FAILED;
    }
    shcd_map *map = NULL;
    int result = STATUS_FAILED;
    if (!request.own_map || make_map(model, &request, &map)) {
        result = answer_all(model, map, &request);
    }
    shcd_map_free(map);
    shcd_model_free(model);
    return result;
}
