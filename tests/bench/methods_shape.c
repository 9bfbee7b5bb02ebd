/* SPDX-License-Identifier: BSD-3-Clause */
/* Queries on the current, deformed shape, with certificates that last from query to query, and what
 * a change of shape costs until the next answer is certified again. */
#include "methods.h"
#include "points.h"
#include "shcd/shape.h"
#include "shcd/vec.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define ROUNDING 1e-12 /* of the diagonal, as in methods.c */
#define SHAPE_ALIGNMENT 16u

typedef struct shape_state {
    const shcd_model *model;
    shcd_shape *shape; /* NULL: the rest shape */
    void *memory;
    shcd_certificate certificate;
    shcd_proximity near;
    /* updates only: the coefficients to go to in turn, and how */
    double *target[2];
    const double *next;
    int follow;
    int with_query;       /* 1: exact query, 2: with the certificate */
    const double *points; /* a path */
    size_t n_points;
    shcd_vec3 point;
} shape_state;

static shcd_vec3 vec(const double p[3]) {
    return shcd_vec3_make(p[0], p[1], p[2]);
}

static void release(void *self) {
    shape_state *s = self;
    free(s->memory);
    free(s->target[0]);
    free(s->target[1]);
    free(s);
}

static shape_state *create(const methods_body *body) {
    shape_state *s = points_memory(sizeof *s);
    memset(s, 0, sizeof *s);
    s->model = body->model;
    return s;
}

static void demand(shcd_status status) {
    if (status != SHCD_OK) {
        fprintf(stderr, "bench: a shape failed: %s\n", shcd_status_string(status));
        exit(1);
    }
}

/* A shape in the library's terms, at the given coefficients with fresh bounds. */
static void deform(shape_state *s, const double *coefficients) {
    const size_t size = shcd_shape_size(s->model);
    s->memory = aligned_alloc(SHAPE_ALIGNMENT,
                              (size + SHAPE_ALIGNMENT - 1) / SHAPE_ALIGNMENT * SHAPE_ALIGNMENT);
    if (s->memory == NULL) {
        fputs("bench: out of memory\n", stderr);
        exit(1);
    }
    demand(shcd_shape_init(s->model, s->memory, size, &s->shape));
    demand(shcd_shape_set(s->model, s->shape, coefficients, SHCD_FOLLOW_REFRESH));
}

/* ---- methods ---- */

static double ask_exact(void *self, const double point[3]) {
    shape_state *s = self;
    const shcd_status status = shcd_shape_closest(s->model, s->shape, vec(point), NULL, &s->near);
    return status == SHCD_OK ? s->near.distance_m : 0.0;
}

static void start_next(void *self, const double point[3]) {
    shape_state *s = self;
    (void)point;
    memset(&s->certificate, 0, sizeof s->certificate);
}

static double ask_next(void *self, const double point[3]) {
    shape_state *s = self;
    const shcd_status status =
        shcd_closest_next(s->model, s->shape, vec(point), NULL, &s->certificate, &s->near);
    return status == SHCD_OK ? s->near.distance_m : 0.0;
}

static void explain(void *self, bench_answer *answer) {
    const shape_state *s = self;
    methods_explain(&s->near, answer);
    answer->is_global = s->near.n_patches > 0;
}

static bench_method method_of(const methods_body *body, shape_state *s, const char *name,
                              const char *what) {
    const bench_method method = {.name = name,
                                 .what = what,
                                 .self = s,
                                 .workloads = BENCH_EVERYWHERE,
                                 .is_moved = s->shape != NULL,
                                 .tolerance_m = ROUNDING * body->diagonal_m,
                                 .query = ask_exact,
                                 .explain = explain,
                                 .release = release};
    return method;
}

void methods_add_shapes(bench_list *list, const methods_body *body) {
    shape_state *s = create(body);
    bench_method method = method_of(body, s, "next", "shcd_closest_next: exact, with certificates");
    method.start = start_next;
    method.query = ask_next;
    method.workloads = BENCH_ON_PATHS;
    bench_add_method(list, &method);

    s = create(body);
    deform(s, body->moved_coefficients);
    method = method_of(body, s, "moved-exact", "shcd_shape_closest, deformed by 2 %, refreshed");
    bench_add_method(list, &method);

    s = create(body);
    deform(s, body->almost_coefficients);
    demand(shcd_shape_set(s->model, s->shape, body->moved_coefficients, SHCD_FOLLOW_INFLATE));
    method =
        method_of(body, s, "moved-inflated", "the same, refreshed 0.1 % before, then inflated");
    bench_add_method(list, &method);

    s = create(body);
    deform(s, body->moved_coefficients);
    method = method_of(body, s, "moved-next", "shcd_closest_next on the deformed shape");
    method.start = start_next;
    method.query = ask_next;
    method.workloads = BENCH_ON_PATHS;
    bench_add_method(list, &method);
}

/* ---- updates ---- */

static void prepare(void *self, size_t k) {
    shape_state *s = self;
    const size_t i = k % s->n_points;
    s->next = s->target[k % 2];
    s->point = vec(s->points + 3 * i);
}

static double apply(void *self) {
    shape_state *s = self;
    shcd_status status = shcd_shape_set(s->model, s->shape, s->next, s->follow);
    if (status == SHCD_OK && s->with_query == 1) {
        status = shcd_shape_closest(s->model, s->shape, s->point, NULL, &s->near);
    } else if (status == SHCD_OK && s->with_query == 2) {
        status = shcd_closest_next(s->model, s->shape, s->point, NULL, &s->certificate, &s->near);
    }
    return status == SHCD_OK ? s->near.distance_m : 0.0;
}

/* Between moved - share (moved - almost) and moved + share (moved - almost). */
static void set_targets(shape_state *s, const methods_body *body, double share) {
    const size_t n = 3 * SHCD_COUNT(shcd_model_degree(body->model));
    for (int t = 0; t < 2; t++) {
        const double factor = t == 0 ? -share : share;
        s->target[t] = points_memory(n * sizeof *s->target[t]);
        for (size_t i = 0; i < n; i++) {
            const double way = body->moved_coefficients[i] - body->almost_coefficients[i];
            s->target[t][i] = body->moved_coefficients[i] + factor * way;
        }
    }
}

static void add_update(bench_list *list, const methods_body *body, const double *path, size_t n,
                       const bench_update *how, int follow, int with_query, double share) {
    bench_update update = *how;
    shape_state *s = create(body);
    deform(s, body->moved_coefficients);
    set_targets(s, body, share);
    s->follow = follow;
    s->with_query = with_query;
    s->points = path;
    s->n_points = n;
    update.self = s;
    update.prepare = prepare;
    update.apply = apply;
    update.release = release;
    bench_add_update(list, &update);
}

void methods_add_updates(bench_list *list, const methods_body *body, const double *path, size_t n) {
    static const bench_update how[6] = {
        {.name = "inflate", .what = "shcd_shape_set by 0.1 %, inflating"},
        {.name = "inflate-exact", .what = "the same and the next exact query"},
        {.name = "refresh", .what = "shcd_shape_set by 0.1 %, refreshing"},
        {.name = "refresh-exact", .what = "the same and the next exact query"},
        {.name = "progressive", .what = "shcd_shape_set by 0.1 %, a share of the tree refreshed"},
        {.name = "tick", .what = "shcd_shape_set by 0.01 %, then shcd_closest_next a step on"}};
    add_update(list, body, path, n, &how[0], SHCD_FOLLOW_INFLATE, 0, 1.0);
    add_update(list, body, path, n, &how[1], SHCD_FOLLOW_INFLATE, 1, 1.0);
    add_update(list, body, path, n, &how[2], SHCD_FOLLOW_REFRESH, 0, 1.0);
    add_update(list, body, path, n, &how[3], SHCD_FOLLOW_REFRESH, 1, 1.0);
    add_update(list, body, path, n, &how[4], SHCD_FOLLOW_PROGRESSIVE, 0, 1.0);
    add_update(list, body, path, n, &how[5], SHCD_FOLLOW_AUTO, 2, 0.1);
}
