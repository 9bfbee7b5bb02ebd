/* SPDX-License-Identifier: BSD-3-Clause */
/* One query at a time, each between two fences, as in a loop that needs the answer before it can go
 * on. The contenders take turns within a round, and every round brings new points: what the machine
 * does meanwhile (its clock rate, other programs) meets all of them, and caches hold what they hold
 * after points elsewhere. Of the rounds' medians and 99th percentiles the median counts. */
#include "cost_row.h"

#include "report.h"

#include "shcd/vec.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Untimed queries in front of each run: code and tables come into the caches, as they do in a loop
 * that runs all the time. */
#define N_WARM 50

static shcd_status ask_model(cost_contender *self, shcd_vec3 point, shcd_proximity *out) {
    return shcd_closest(self->subject, point, &self->options, out);
}

/* As a scene does it: the last answer's certificate goes along. */
static shcd_status ask_exact_next(cost_contender *self, shcd_vec3 point, shcd_proximity *out) {
    return shcd_closest_next(self->subject, NULL, point, &self->options, &self->certificate, out);
}

static shcd_status start_exact(cost_contender *self, shcd_vec3 point) {
    (void)point;
    memset(&self->certificate, 0, sizeof self->certificate);
    return SHCD_OK;
}

static shcd_status ask_track(cost_contender *self, shcd_vec3 point, shcd_proximity *out) {
    const shcd_status status = shcd_track(self->subject, point, self->parameter, out);
    self->parameter = out->parameter;
    return status;
}

static shcd_status start_track(cost_contender *self, shcd_vec3 point) {
    shcd_proximity foot;
    const shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    const shcd_status status = shcd_closest(self->subject, point, &options, &foot);
    self->parameter = foot.parameter;
    return status;
}

void cost_contender_model(const shcd_model *model, const char *tier, cost_contender *contender) {
    *contender = (cost_contender){.ask = ask_model,
                                  .subject = model,
                                  .options = SHCD_QUERY_OPTIONS_INIT,
                                  .row = {.degree = shcd_model_degree(model), .tier = tier}};
    if (strcmp(tier, "exact") == 0) {
        contender->ask_next = ask_exact_next;
        contender->start = start_exact;
    } else if (strcmp(tier, "fast") == 0) {
        contender->options.tier = SHCD_TIER_FAST;
    } else if (strcmp(tier, "track") == 0) {
        contender->ask = ask_track;
        contender->start = start_track;
        contender->needs_start = true;
    }
}

bool cost_contender_reserve(size_t n_points, cost_contender *contender) {
    for (int set = COST_RANDOM; set <= COST_PATH; set++) {
        cost_answers *answers = &contender->answers[set];
        answers->distance_m = malloc(n_points * sizeof *answers->distance_m);
        answers->normal = malloc(n_points * sizeof *answers->normal);
        answers->n_evaluations = malloc(n_points * sizeof *answers->n_evaluations);
        answers->n_patches = malloc(n_points * sizeof *answers->n_patches);
        if (answers->distance_m == NULL || answers->normal == NULL ||
            answers->n_evaluations == NULL || answers->n_patches == NULL) {
            return false;
        }
    }
    return true;
}

void cost_contender_release(cost_contender *contender) {
    for (int set = COST_RANDOM; set <= COST_PATH; set++) {
        cost_answers *answers = &contender->answers[set];
        free(answers->distance_m);
        free(answers->normal);
        free(answers->n_evaluations);
        free(answers->n_patches);
        memset(answers, 0, sizeof *answers);
    }
}

static shcd_status ask_on_path(cost_contender *contender, shcd_vec3 point, shcd_proximity *out) {
    return contender->ask_next != NULL ? contender->ask_next(contender, point, out)
                                       : contender->ask(contender, point, out);
}

/* Up to N_WARM queries in front of point `first`; on the path its way goes on from there. */
static shcd_status warm_up(const cost_points *points, enum cost_set set, size_t first,
                           cost_contender *contender) {
    shcd_proximity answer;
    const size_t n_before = first < N_WARM ? first : N_WARM;
    shcd_status status = SHCD_OK;
    if (contender->start != NULL && (set == COST_PATH || contender->needs_start)) {
        status = contender->start(contender, points->before[first - n_before]);
    }
    for (size_t i = first - n_before; status == SHCD_OK && i < first; i++) {
        status = set == COST_PATH ? ask_on_path(contender, points->point[i], &answer)
                                  : contender->ask(contender, points->point[i], &answer);
    }
    return status;
}

static void keep(const shcd_proximity *answer, size_t i, cost_answers *answers) {
    answers->distance_m[i] = answer->distance_m;
    answers->normal[i] = answer->normal;
    answers->n_evaluations[i] = answer->n_evaluations;
    answers->n_patches[i] = answer->n_patches;
}

/* A clock that moves in steps of ten nanoseconds would give quantiles in such steps. Each time is
 * somewhere in its step: spread evenly, in an order that has nothing to do with the times. */
static void spread_steps(double resolution_ns, double *ns, size_t n) {
    const double golden = 0.61803398874989485;
    for (size_t i = 0; i < n; i++) {
        const double share = golden * (double)i - floor(golden * (double)i);
        ns[i] += resolution_ns * (share - 0.5);
    }
}

/* One round on one set of points. What needs a last answer gets one for each random point, untimed;
 * on the path it has its own. */
static shcd_status run(const cost_task *task, enum cost_set set, int round,
                       cost_contender *contender, double *ns) {
    const cost_points *points = set == COST_PATH ? task->path : task->random;
    const bool start_each = set == COST_RANDOM && contender->needs_start;
    const bool next = set == COST_PATH && contender->ask_next != NULL;
    const size_t n = points->n / COST_ROUNDS;
    const size_t first = n * (size_t)round;
    cost_answers *answers = &contender->answers[set];
    shcd_proximity answer = {.n_evaluations = 0};
    shcd_status status = warm_up(points, set, first, contender);
    for (size_t i = first; status == SHCD_OK && i < first + n; i++) {
        const shcd_vec3 point = points->point[i];
        if (start_each) {
            status = contender->start(contender, points->before[i]);
        }
        const uint64_t start = cost_clock_read(task->clock);
        const shcd_status asked = next ? contender->ask_next(contender, point, &answer)
                                       : contender->ask(contender, point, &answer);
        const uint64_t end = cost_clock_read(task->clock);
        ns[i - first] = cost_clock_between(task->clock, start, end);
        keep(&answer, i, answers);
        status = status == SHCD_OK ? asked : status;
    }
    spread_steps(task->clock->resolution_ns, ns, n);
    answers->p50[round] = cost_quantile(ns, n, 0.5);
    answers->p99[round] = cost_quantile(ns, n, 0.99);
    return status;
}

bool cost_measure(const cost_task *task, int round, cost_contender *contender, double *scratch) {
    shcd_status status = run(task, COST_RANDOM, round, contender, scratch);
    if (status == SHCD_OK) {
        status = run(task, COST_PATH, round, contender, scratch);
    }
    if (status != SHCD_OK) {
        report_failure("tier %s failed: %s", contender->row.tier, shcd_status_string(status));
    }
    return status == SHCD_OK;
}

/* Good for small angles, where acos(a . b) is not. */
static double angle_between(shcd_vec3 a, shcd_vec3 b) {
    return atan2(shcd_norm(shcd_cross(a, b)), shcd_dot(a, b));
}

enum quantity { DISTANCE, NORMAL, FORCE, MESH_DISTANCE };

/* |answer - truth| of point i */
static double error_at(const cost_points *points, const cost_answers *answers,
                       enum quantity quantity, size_t i) {
    const double d = answers->distance_m[i];
    const double truth = points->distance_m[i];
    switch (quantity) {
    case DISTANCE:
        return fabs(d - truth);
    case NORMAL:
        return angle_between(answers->normal[i], points->normal[i]);
    case FORCE: /* for a stiffness of 1 */
        return fabs(fmax(0.0, -d) - fmax(0.0, -truth));
    default:
        return fabs(d - points->mesh_m[i]);
    }
}

/* Over both sets; the scratch holds a value for each point of both. */
static cost_spread spread_in_band(const cost_task *task, const cost_contender *contender,
                                  enum quantity quantity, double band, double *scratch) {
    size_t n = 0;
    for (int set = COST_RANDOM; set <= COST_PATH; set++) {
        const cost_points *points = set == COST_PATH ? task->path : task->random;
        const double *truth = quantity == MESH_DISTANCE ? points->mesh_m : points->distance_m;
        for (size_t i = 0; truth != NULL && i < points->n; i++) {
            if (fabs(truth[i]) <= band * task->diagonal_m) { /* false for NaN */
                scratch[n++] = error_at(points, &contender->answers[set], quantity, i);
            }
        }
    }
    return cost_spread_of(scratch, n);
}

static double mean(const uint32_t *counts, size_t n) {
    double sum = 0.0;
    for (size_t i = 0; i < n; i++) {
        sum += (double)counts[i];
    }
    return sum / (double)n;
}

static void finish_counts(size_t n, const cost_contender *contender, cost_row *row,
                          double *scratch) {
    const cost_answers *answers = &contender->answers[COST_RANDOM];
    for (size_t i = 0; i < n; i++) {
        scratch[i] = (double)answers->n_evaluations[i];
    }
    row->evaluations_mean = mean(answers->n_evaluations, n);
    row->evaluations_p99 = cost_quantile(scratch, n, 0.99);
    row->patches_mean = mean(answers->n_patches, n);
    row->path_evaluations_mean = mean(contender->answers[COST_PATH].n_evaluations, n);
}

/* Median of the rounds; what the clock cannot tell from nothing counts as a step of it. */
static double time_of(const cost_clock *clock, double rounds[COST_ROUNDS]) {
    return fmax(cost_quantile(rounds, COST_ROUNDS, 0.5), clock->resolution_ns);
}

void cost_finish(const cost_task *task, cost_contender *contender, double *scratch) {
    const double contact = COST_CONTACT_BAND, near = COST_NEAR_BAND;
    cost_answers *times = &contender->answers[contender->needs_start ? COST_PATH : COST_RANDOM];
    cost_answers *path = &contender->answers[COST_PATH];
    cost_row *row = &contender->row;
    row->error_m = spread_in_band(task, contender, DISTANCE, contact, scratch);
    row->near_error_m = spread_in_band(task, contender, DISTANCE, near, scratch);
    row->normal_rad = spread_in_band(task, contender, NORMAL, contact, scratch);
    row->near_normal_rad = spread_in_band(task, contender, NORMAL, near, scratch);
    row->force_error_n = spread_in_band(task, contender, FORCE, contact, scratch);
    row->force_error_n.max *= task->stiffness_n_per_m;
    row->force_error_n.p99 *= task->stiffness_n_per_m;
    row->force_error_n.rms *= task->stiffness_n_per_m;
    row->mesh_error_m = spread_in_band(task, contender, MESH_DISTANCE, contact, scratch);
    finish_counts(task->random->n, contender, row, scratch);
    row->ns_p50 = time_of(task->clock, times->p50);
    row->ns_p99 = time_of(task->clock, times->p99);
    row->path_ns_p50 = time_of(task->clock, path->p50);
    row->path_ns_p99 = time_of(task->clock, path->p99);
}

/* Better in both, or equal in one and better in the other. Errors that differ by no more than the
 * truth is known to are equal. */
static bool beats(double error_a, double cost_a, double error_b, double cost_b, double floor_m) {
    return error_a <= error_b + floor_m && cost_a <= cost_b &&
           (error_a < error_b - floor_m || cost_a < cost_b);
}

void cost_mark_fronts(cost_contender *contenders, size_t n, double floor_m) {
    for (size_t i = 0; i < n; i++) {
        cost_row *row = &contenders[i].row;
        const double error = row->error_m.max;
        row->on_time_front = true;
        row->on_bytes_front = true;
        for (size_t k = 0; k < n; k++) {
            const cost_row *other = &contenders[k].row;
            if (other->degree < 0) {
                continue;
            }
            if (beats(other->error_m.max, other->path_ns_p50, error, row->path_ns_p50, floor_m)) {
                row->on_time_front = false;
            }
            if (beats(other->error_m.max, (double)other->bytes, error, (double)row->bytes,
                      floor_m)) {
                row->on_bytes_front = false;
            }
        }
    }
}
