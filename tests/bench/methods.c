/* SPDX-License-Identifier: BSD-3-Clause */
/* libshcd's tiers as methods of the benchmark. Each keeps its last result, so that what it claims
 * can be read after the clock has stopped. */
#include "methods.h"
#include "points.h"
#include "shcd/vec.h"

#include <stdlib.h>
#include <string.h>

/* Distances are sums of a few hundred terms of the size of the body: their rounding stays far below
 * this, relative to the diagonal. */
#define ROUNDING 1e-12

typedef struct query_state {
    const shcd_model *model;
    const shcd_map *map;
    shcd_vec3 centre;
    shcd_query_options options;
    shcd_proximity near;
    shcd_map_ray ray;
    shcd_vec3 last; /* the point asked for, where explaining needs it */
} query_state;

static shcd_vec3 vec(const double p[3]) {
    return shcd_vec3_make(p[0], p[1], p[2]);
}

void methods_explain(const shcd_proximity *near, bench_answer *answer) {
    memset(answer, 0, sizeof *answer);
    answer->lower_m = fmax(0.0, fmax(near->lower_m, -near->upper_m));
    answer->upper_m = fmax(fabs(near->lower_m), fabs(near->upper_m));
    answer->sign = near->flags & SHCD_PROXIMITY_SIGN_UNSURE ? 0 : near->distance_m < 0.0 ? -1 : 1;
    answer->flags = near->flags;
    answer->n_evaluations = near->n_evaluations;
    answer->n_patches = near->n_patches;
    answer->n_newton = near->n_newton;
    answer->is_global = 1;
}

static double ask_nothing(void *self, const double point[3]) {
    (void)self;
    return point[0];
}

void methods_add_nothing(bench_list *list) {
    const bench_method method = {.name = "harness",
                                 .what = "no query: the clock and the call",
                                 .workloads = BENCH_EVERYWHERE,
                                 .query = ask_nothing};
    bench_add_method(list, &method);
}

/* exact and fast */

static double ask_closest(void *self, const double point[3]) {
    query_state *s = self;
    const shcd_status status = shcd_closest(s->model, vec(point), &s->options, &s->near);
    return status == SHCD_OK ? s->near.distance_m : 0.0;
}

static void explain_closest(void *self, bench_answer *answer) {
    methods_explain(&((const query_state *)self)->near, answer);
}

/* track: from the last foot; the first one is the exact tier's */

static void start_track(void *self, const double point[3]) {
    (void)ask_closest(self, point);
}

static double ask_track(void *self, const double point[3]) {
    query_state *s = self;
    s->last = vec(point);
    const shcd_status status = shcd_track(s->model, s->last, s->near.parameter, &s->near);
    return status == SHCD_OK ? s->near.distance_m : 0.0;
}

/* A point of the surface at that distance exists, so the true distance is no larger. */
static void explain_track(void *self, bench_answer *answer) {
    const query_state *s = self;
    methods_explain(&s->near, answer);
    answer->lower_m = 0.0;
    answer->upper_m = shcd_norm(shcd_sub(s->last, s->near.point_m));
    answer->sign = 0;
    answer->is_global = 0;
}

/* map: radius and slopes along the ray through the point */

static double ask_map(void *self, const double point[3]) {
    query_state *s = self;
    s->last = shcd_sub(vec(point), s->centre);
    const shcd_status status = shcd_map_look_up(s->map, s->last, s->options.map_hermite, &s->ray);
    if (status != SHCD_OK || s->ray.count == 0) {
        return 0.0;
    }
    return s->ray.crossing[0].radius_m + s->ray.crossing[0].slope_m.x;
}

/* Where the look-up has a proven error there is a point of the surface on the ray, so the distance
 * is at most the depth along it plus that error; else nothing is claimed. */
static void explain_map(void *self, bench_answer *answer) {
    const query_state *s = self;
    memset(answer, 0, sizeof *answer);
    answer->upper_m = HUGE_VAL;
    answer->is_global = 1;
    if (s->ray.flags & SHCD_MAP_BOUNDED && s->ray.count > 0) {
        answer->upper_m = fabs(shcd_norm(s->last) - s->ray.crossing[0].radius_m) + s->ray.bound_m;
    }
}

static double ask_map_tier(void *self, const double point[3]) {
    query_state *s = self;
    const shcd_status status = shcd_closest(s->model, vec(point), &s->options, &s->near);
    return status == SHCD_OK ? s->near.distance_m : 0.0;
}

/* surface: the point (and Jacobian) at the parameter p/|p - centre| */

static double ask_point(void *self, const double point[3]) {
    query_state *s = self;
    shcd_vec3 x;
    const shcd_status status =
        shcd_model_surface(s->model, -1, shcd_sub(vec(point), s->centre), &x, NULL, NULL);
    return status == SHCD_OK ? x.x + x.y + x.z : 0.0;
}

static double ask_jacobian(void *self, const double point[3]) {
    query_state *s = self;
    shcd_vec3 x;
    double j[9];
    const shcd_status status =
        shcd_model_surface(s->model, -1, shcd_sub(vec(point), s->centre), &x, NULL, j);
    return status == SHCD_OK ? x.x + j[0] + j[4] + j[8] : 0.0;
}

static bench_method tier(const methods_body *body, const char *name, const char *what,
                         double (*query)(void *, const double *)) {
    bench_method method = {.name = name, .what = what, .workloads = BENCH_EVERYWHERE};
    query_state *s = points_memory(sizeof *s);
    shcd_map_info map = SHCD_MAP_INFO_INIT;
    memset(s, 0, sizeof *s);
    s->model = body->model;
    s->map = body->map;
    s->options = (shcd_query_options)SHCD_QUERY_OPTIONS_INIT;
    if (shcd_map_describe(body->map, &map) == SHCD_OK) {
        s->centre = map.centre_m;
    }
    method.self = s;
    method.query = query;
    method.release = free;
    method.tolerance_m = ROUNDING * body->diagonal_m;
    return method;
}

void methods_add_tiers(bench_list *list, const methods_body *body) {
    bench_method method = tier(body, "exact", "shcd_closest, exact, tolerance 1e-9", ask_closest);
    method.explain = explain_closest;
    bench_add_method(list, &method);

    method = tier(body, "fast", "shcd_closest, fast", ask_closest);
    ((query_state *)method.self)->options.tier = SHCD_TIER_FAST;
    method.explain = explain_closest;
    bench_add_method(list, &method);

    method = tier(body, "track", "shcd_track from the last foot (local)", ask_track);
    method.start = start_track;
    method.explain = explain_track;
    method.workloads = BENCH_ON_PATHS;
    bench_add_method(list, &method);

    method = tier(body, "map", "shcd_map_look_up, linear: radius and slopes", ask_map);
    method.explain = explain_map;
    bench_add_method(list, &method);

    method = tier(body, "map-hermite", "shcd_map_look_up, Hermite", ask_map);
    method.explain = explain_map;
    ((query_state *)method.self)->options.map_hermite = 1;
    bench_add_method(list, &method);

    method = tier(body, "map-tier", "shcd_closest, map: depth along the ray", ask_map_tier);
    ((query_state *)method.self)->options.tier = SHCD_TIER_MAP;
    method.explain = explain_closest;
    bench_add_method(list, &method);

    method = tier(body, "point", "shcd_model_surface: S(w)", ask_point);
    bench_add_method(list, &method);

    method = tier(body, "jacobian", "shcd_model_surface: S(w) and its Jacobian", ask_jacobian);
    bench_add_method(list, &method);
}
