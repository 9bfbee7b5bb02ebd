/* SPDX-License-Identifier: BSD-3-Clause */
/* The goals of the queries at degree 15. Queries are judged by the median over points of the
 * stamped time; what takes less than about 200 ns by the dependent chain, where stamps would drown
 * it and the harness itself is included. */
#include "bars.h"

#include <string.h>

static const run_result *result_of(const report_body *body, const char *name, int workload) {
    for (size_t m = 0; m < body->list->n_methods; m++) {
        if (strcmp(body->list->methods[m].name, name) == 0) {
            const run_result *r = &body->outcome->results[m * BENCH_N_WORKLOADS + (size_t)workload];
            return r->is_measured ? r : NULL;
        }
    }
    return NULL;
}

static const run_update *update_of(const report_body *body, const char *name) {
    for (size_t u = 0; u < body->list->n_updates; u++) {
        if (strcmp(body->list->updates[u].name, name) == 0) {
            return &body->outcome->updates[u];
        }
    }
    return NULL;
}

typedef struct bars {
    const report_body *body;
    bars_line *lines;
    size_t n;
} bars;

static bars_line *add(bars *b, const char *name, const char *unit, double limit) {
    bars_line *line = &b->lines[b->n++];
    memset(line, 0, sizeof *line);
    line->name = name;
    line->unit = unit;
    line->limit = limit;
    return line;
}

typedef double (*reading)(const run_result *result);

static double p50_ns(const run_result *result) {
    return result->p50_ns;
}

static double spread(const run_result *result) {
    return result->p50_ns > 0.0 ? result->p99_ns / result->p50_ns : 0.0;
}

static double chain_ns(const run_result *result) {
    return result->chain_ns;
}

/* `peer`: the method of Embree's on the same surface, or NULL. */
static void add_query(bars *b, const char *name, const char *unit, double limit, const char *method,
                      int workload, reading read, const char *peer) {
    bars_line *line = add(b, name, unit, limit);
    const run_result *ours = result_of(b->body, method, workload);
    const run_result *other = peer != NULL ? result_of(b->body, peer, workload) : NULL;
    line->is_known = ours != NULL;
    line->value = ours != NULL ? read(ours) : 0.0;
    line->has_peer = other != NULL;
    line->peer_value = other != NULL ? read(other) : 0.0;
}

static void add_update(bars *b, const char *name, double limit, const char *update) {
    bars_line *line = add(b, name, "us", limit);
    const run_update *ours = update_of(b->body, update);
    const run_update *other = update_of(b->body, "embree-refit");
    line->is_known = ours != NULL;
    line->value = ours != NULL ? 1e-3 * ours->p50_ns : 0.0;
    line->has_peer = other != NULL;
    line->peer_value = other != NULL ? 1e-3 * other->p50_ns : 0.0;
}

static void add_bytes(bars *b) {
    bars_line *line = add(b, "bytes of the body at run time", "KB", 256.0);
    line->is_known = 1;
    line->value = (double)b->body->info.body_bytes / 1024.0;
    for (size_t m = 0; m < b->body->list->n_methods; m++) {
        const bench_method *method = &b->body->list->methods[m];
        if (strcmp(method->name, "embree") == 0) {
            line->has_peer = 1;
            line->peer_value = method->bytes / 1024.0;
        }
    }
}

size_t bars_list(const report_body *body, bars_line *lines) {
    bars b = {body, lines, 0};
    add_query(&b, "exact with certificates, path, p50", "ns", 400.0, "next", BENCH_PATH, p50_ns,
              "embree");
    add_query(&b, "the same on the deformed shape", "ns", 400.0, "moved-next", BENCH_PATH, p50_ns,
              "moved-embree");
    add_query(&b, "exact, random, p50", "ns", 1200.0, "exact", BENCH_RANDOM, p50_ns, "embree");
    add_query(&b, "exact, random, p99/p50", "1", 5.0, "exact", BENCH_RANDOM, spread, "embree");
    add_query(&b, "fast, random, p50", "ns", 600.0, "fast", BENCH_RANDOM, p50_ns, "embree");
    add_query(&b, "map look-up, path, chain", "ns", 50.0, "map", BENCH_PATH, chain_ns, NULL);
    add_query(&b, "surface point, chain", "ns", 100.0, "point", BENCH_RANDOM, chain_ns, NULL);
    add_query(&b, "surface point and Jacobian, chain", "ns", 200.0, "jacobian", BENCH_RANDOM,
              chain_ns, NULL);
    add_update(&b, "new shape by inflation, p50", 2.0, "inflate");
    add_update(&b, "new shape by refresh, p50", 100.0, "refresh");
    add_bytes(&b);
    return b.n;
}
