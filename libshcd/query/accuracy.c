/* SPDX-License-Identifier: BSD-3-Clause */
/* A tolerance and a budget become a row of the cost table: one pass keeps the best row for each of
 * the questions that may have to be answered, so that a refusal can name what is within reach. */
#include "shcd/accuracy.h"

#include "base/internal.h"

#include <stdio.h>
#include <string.h>

typedef struct candidate {
    size_t row;
    double error_m, time_us;
    int is_there;
} candidate;

/* Best first by `a`, then by `b`; what comes first stays. */
static void keep(candidate *best, const candidate *c, double best_a, double a, double best_b,
                 double b) {
    if (!best->is_there || a < best_a || (!(a > best_a) && b < best_b)) {
        *best = *c;
    }
}
static void keep_fastest(candidate *best, const candidate *c) {
    keep(best, c, best->time_us, c->time_us, best->error_m, c->error_m);
}
static void keep_nearest(candidate *best, const candidate *c) {
    keep(best, c, best->error_m, c->error_m, best->time_us, c->time_us);
}

/* ---- the request ---- */

static shcd_status check_request(const shcd_accuracy_request *given, shcd_accuracy_request *request,
                                 shcd_error *error) {
    const shcd_accuracy_request defaults = SHCD_ACCURACY_REQUEST_INIT;
    *request = defaults;
    if (given == NULL || given->struct_size < sizeof given->struct_size) {
        return shcdi_fail(
            error, SHCD_ERR_ARGUMENT,
            "accuracy_choose: no request, or struct_size not set; use SHCD_ACCURACY_REQUEST_INIT");
    }
    memcpy(request, given,
           given->struct_size < sizeof *request ? given->struct_size : sizeof *request);
    const double values[] = {request->tolerance_m, request->budget_us, request->extra_error_m,
                             request->normal_max_rad};
    static const char *const names[] = {"tolerance_m", "budget_us", "extra_error_m",
                                        "normal_max_rad"};
    for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) {
        if (!shcdi_is_finite(values[i])) {
            return shcdi_fail(error, SHCD_ERR_NOT_FINITE, "accuracy_choose: %s is not finite",
                              names[i]);
        }
        if (values[i] < 0.0) {
            return shcdi_fail(error, SHCD_ERR_ARGUMENT, "accuracy_choose: %s is %g, below 0",
                              names[i], values[i]);
        }
    }
    request->n_queries = request->n_queries > 0 ? request->n_queries : 1;
    request->tiers = request->tiers != 0 ? request->tiers : UINT32_MAX;
    if (!(request->normal_max_rad > 0.0)) {
        request->normal_max_rad = SHCD_ACCURACY_NORMAL_DEFAULT_RAD;
    }
    return SHCD_OK;
}

/* ---- words ---- */

/* Lengths of one message stand in one unit, that of the smallest, so that they compare at a glance;
 * times always in us, like the key of a scene. */
typedef struct length_unit {
    double metres, least_m;
    const char *name;
} length_unit;

static const length_unit *unit_of(double smallest_m) {
    static const length_unit units[] = {{1e-3, 1e-5, "mm"}, {1e-6, 1e-7, "um"}, {1e-9, 0.0, "nm"}};
    const length_unit *unit = units;
    while (unit->least_m > 0.0 && smallest_m < unit->least_m) {
        unit++;
    }
    return unit;
}

/* A measured figure is raised by half a percent first, more than three digits can lose: whoever
 * asks for what is printed is not refused for the digits that were left out. */
static void print_figure(char text[32], double value, int is_measured) {
    const double raised = 1.0051 * value;
    if (is_measured) {
        (void)snprintf(text, 32, raised < 999.5 ? "%.3g" : "%.0f", raised);
    } else {
        (void)snprintf(text, 32, "%.6g", value);
    }
}

static double length_of(const candidate *c, const shcd_accuracy_request *asked) {
    const int meets = asked->tolerance_m > 0.0 && c->error_m <= asked->tolerance_m;
    return meets ? asked->tolerance_m : c->error_m;
}

static void print_pair(char text[160], const shcd_cost_row *rows, const candidate *c,
                       const shcd_accuracy_request *asked, const length_unit *unit) {
    static const char *const tiers[] = {"exact", "fast", "map", "track"};
    const int meets = asked->tolerance_m > 0.0 && c->error_m <= asked->tolerance_m;
    const int fits = asked->budget_us > 0.0 && c->time_us <= asked->budget_us;
    char length[32], time[32];
    print_figure(length, length_of(c, asked) / unit->metres, !meets);
    print_figure(time, fits ? asked->budget_us : c->time_us, !fits);
    const int tier = rows[c->row].tier;
    (void)snprintf(text, 160, "%s %s in %s us (degree %d, %s)", length, unit->name, time,
                   (int)rows[c->row].degree,
                   tier >= SHCD_TIER_EXACT && tier <= SHCD_TIER_TRACK ? tiers[tier] : "unknown");
}

static shcd_status refuse(const shcd_cost_row *rows, const shcd_accuracy_request *asked,
                          const candidate *meeting, const candidate *fitting, shcd_error *error) {
    char first[160], second[160];
    if (error == NULL) {
        return SHCD_ERR_UNSUPPORTED;
    }
    const double asked_m = asked->tolerance_m, us = asked->budget_us;
    double smallest_m = length_of(fitting, asked);
    if (asked_m > 0.0) {
        const double meeting_m = length_of(meeting, asked);
        smallest_m = meeting_m < smallest_m ? meeting_m : smallest_m;
        smallest_m = asked_m < smallest_m ? asked_m : smallest_m;
    }
    const length_unit *unit = unit_of(smallest_m);
    print_pair(first, rows, meeting, asked, unit);
    print_pair(second, rows, fitting, asked, unit);
    char wanted[96] = "";
    const double length = asked_m / unit->metres;
    if (asked_m > 0.0 && us > 0.0) {
        (void)snprintf(wanted, sizeof wanted, "%.6g %s in %.6g us", length, unit->name, us);
    } else if (asked_m > 0.0) {
        (void)snprintf(wanted, sizeof wanted, "%.6g %s", length, unit->name);
    } else {
        (void)snprintf(wanted, sizeof wanted, "an answer in %.6g us", us);
    }
    if (meeting->row == fitting->row || !(asked_m > 0.0) || !(us > 0.0)) {
        return shcdi_fail(error, SHCD_ERR_UNSUPPORTED, "%s is not feasible: nearest is %s", wanted,
                          us > 0.0 ? second : first);
    }
    return shcdi_fail(error, SHCD_ERR_UNSUPPORTED, "%s is not feasible: nearest are %s or %s",
                      wanted, first, second);
}

/* ---- the choice ---- */

typedef struct selection {
    candidate both;              /* what is asked for */
    candidate meets, fits;       /* one half of it */
    candidate accurate, fastest; /* neither */
} selection;

static void consider(selection *s, const shcd_accuracy_request *asked, const candidate *c) {
    const int meets = !(asked->tolerance_m > 0.0) || c->error_m <= asked->tolerance_m;
    const int fits = !(asked->budget_us > 0.0) || c->time_us <= asked->budget_us;
    keep_nearest(&s->accurate, c);
    keep_fastest(&s->fastest, c);
    if (asked->tolerance_m > 0.0 && meets) {
        keep_fastest(&s->meets, c);
    }
    if (asked->budget_us > 0.0 && fits) {
        keep_nearest(&s->fits, c);
    }
    if (meets && fits) {
        (asked->tolerance_m > 0.0 ? keep_fastest : keep_nearest)(&s->both, c);
    }
}

static shcd_accuracy_pair pair_of(const candidate *c) {
    const shcd_accuracy_pair pair = {c->row, c->error_m, c->time_us};
    return pair;
}

shcd_status shcd_accuracy_choose(const shcd_cost_row *rows, size_t n_rows,
                                 const shcd_accuracy_request *request, shcd_accuracy_pair *choice,
                                 shcd_accuracy_pair nearest[2], shcd_error *error) {
    shcd_accuracy_request asked;
    const shcd_status status = check_request(request, &asked, error);
    if (status != SHCD_OK) {
        return status;
    }
    if (rows == NULL || n_rows == 0 || choice == NULL) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "accuracy_choose: no cost table, or no place for the choice");
    }
    selection s;
    memset(&s, 0, sizeof s);
    for (size_t i = 0; i < n_rows; i++) {
        const candidate c = {i, rows[i].error_max_m + asked.extra_error_m,
                             1e-3 * rows[i].ns_p99 * (double)asked.n_queries, 1};
        const int is_known = rows[i].tier >= SHCD_TIER_EXACT && rows[i].tier <= SHCD_TIER_TRACK &&
                             shcdi_is_finite(c.error_m) && shcdi_is_finite(c.time_us);
        if (is_known && (asked.tiers & SHCD_TIER_BIT(rows[i].tier)) != 0 &&
            rows[i].normal_p99_rad <= asked.normal_max_rad) {
            consider(&s, &asked, &c);
        }
    }
    if (!s.accurate.is_there) {
        return shcdi_fail(
            error, SHCD_ERR_UNSUPPORTED,
            "accuracy_choose: no row of the cost table has a tier that is allowed and "
            "normals within %g rad",
            asked.normal_max_rad);
    }
    const candidate *meeting = s.meets.is_there ? &s.meets : &s.accurate;
    const candidate *fitting = s.fits.is_there ? &s.fits : &s.fastest;
    if (nearest != NULL) {
        nearest[0] = pair_of(meeting);
        nearest[1] = pair_of(fitting);
    }
    if (!s.both.is_there) {
        return refuse(rows, &asked, meeting, fitting, error);
    }
    *choice = pair_of(&s.both);
    return SHCD_OK;
}
