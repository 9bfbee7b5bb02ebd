/* SPDX-License-Identifier: BSD-3-Clause */
/* How time is measured here.
 *
 * One process, one thread, one query at a time. All methods take turns in short blocks over the
 * same points, so that a change of clock or a busy neighbour hits them alike. Each point is asked
 * n_repetitions times, in different rounds, and its median counts: what p99 then shows is the
 * spread between *points*, not the machine's interruptions. Each query stands between two fenced
 * stamps, whose own cost (median of the method `harness` in the same workload) is subtracted.
 * Beside that, `chain`: the next point depends on the last answer, with stamps only around CHAIN of
 * them, and the median of such chains per query; nothing is subtracted there.
 *
 * Core frequency is sampled by a chain of multiplications before every block. */
#include "run.h"
#include "clock.h"
#include "compare.h"
#include "points.h"
#include "shcd/vec.h"

#include <stdlib.h>
#include <string.h>

#define BLOCK 250
#define CHAIN 25 /* divides BLOCK */
#define RUN_IN 25
#define PEERS_EVERY 5

typedef struct job {
    const bench_list *list;
    const run_options *options;
    double *times[BENCH_N_WORKLOADS]; /* [(method * n + point) * n_repetitions + repetition] */
    double *chains[2];                /* [(method * chains + chain) * n_repetitions + repetition] */
    size_t n[BENCH_N_WORKLOADS];
    const double *points[BENCH_N_WORKLOADS];
    double *ghz;
    size_t n_ghz, ghz_max;
    volatile double *sink; /* where answers go, so that they are needed */
} job;

const char *run_workload_name(int workload) {
    static const char *const name[BENCH_N_WORKLOADS] = {"random", "path", "cold random",
                                                        "cold path"};
    return name[workload];
}

void run_make_points(const methods_body *body, const run_options *options, run_points *points) {
    points->random = points_memory(3 * options->n_points * sizeof(double));
    points->path = points_memory(3 * options->n_points * sizeof(double));
    points_random(body->model, options->seed, options->n_points, points->random);
    points_path(body->model, options->seed + 1, options->n_points, points->path);
}

void run_free_points(run_points *points) {
    free(points->random);
    free(points->path);
}

static size_t blocks_of(size_t n) {
    return (n + BLOCK - 1) / BLOCK;
}

static size_t chains_of(size_t n) {
    return (n + CHAIN - 1) / CHAIN;
}

/* One block of one method, each query stamped. */
static void timed_block(job *j, const bench_method *method, int workload, size_t first, size_t last,
                        double *times, size_t repetition) {
    const int cold = workload == BENCH_COLD_RANDOM || workload == BENCH_COLD_PATH;
    for (size_t i = first; i < last; i++) {
        double p[3];
        memcpy(p, j->points[workload] + 3 * i, sizeof p);
        if (cold) {
            clock_sweep();
        }
        const uint64_t start = clock_stamp();
        const double answer = method->query(method->self, p);
        const uint64_t end = clock_stamp();
        times[i * j->options->n_repetitions + repetition] = (double)(end - start) * clock_tick_ns();
        *j->sink = answer;
    }
}

/* A dependent chain; 0 * answer is 0 for any finite answer, which the compiler may not assume. It
 * is short, so that few of them are interrupted by other processes. */
static double one_chain(job *j, const bench_method *method, int workload, size_t first,
                        size_t last) {
    double answer = 0.0;
    const uint64_t start = clock_stamp();
    for (size_t i = first; i < last; i++) {
        const double *q = j->points[workload] + 3 * i, zero = 0.0 * answer;
        const double p[3] = {q[0] + zero, q[1] + zero, q[2] + zero};
        answer = method->query(method->self, p);
    }
    *j->sink = answer;
    return (double)(clock_stamp() - start) * clock_tick_ns() / (double)(last - first);
}

/* Some points before the block are asked without the clock: a method that follows a path is put
 * where it would be, had it come along, and the others find their code and data as warm as their
 * own earlier queries leave them. */
static void run_in(const job *j, const bench_method *method, int workload, size_t first) {
    const size_t n = j->n[workload], n_before = first == 0 && method->start != NULL ? 0 : RUN_IN;
    const double *points = j->points[workload];
    size_t i = (first + n - n_before % n) % n;
    if (method->start != NULL) {
        method->start(method->self, points + 3 * i);
    }
    for (size_t k = 0; k < n_before; k++, i = (i + 1) % n) {
        *j->sink = method->query(method->self, points + 3 * i);
    }
}

static void one_block(job *j, int workload, size_t m, size_t b, size_t repetition) {
    const bench_method *method = &j->list->methods[m];
    const size_t n = j->n[workload], reps = j->options->n_repetitions, n_blocks = blocks_of(n);
    const int is_cold = workload == BENCH_COLD_RANDOM || workload == BENCH_COLD_PATH;
    const size_t first = b * BLOCK, last = first + BLOCK < n ? first + BLOCK : n;
    if (j->n_ghz < j->ghz_max) {
        j->ghz[j->n_ghz++] = clock_core_ghz();
    }
    run_in(j, method, workload, first);
    timed_block(j, method, workload, first, last, j->times[workload] + m * n * reps, repetition);
    if (!is_cold) {
        /* other points than those just asked: their data must not be at hand */
        const size_t c = (b + n_blocks / 2) % n_blocks, from = c * BLOCK;
        run_in(j, method, workload, from);
        for (size_t i = from; i < n && i < from + BLOCK; i += CHAIN) {
            j->chains[workload][(m * chains_of(n) + i / CHAIN) * reps + repetition] =
                one_chain(j, method, workload, i, i + CHAIN < n ? i + CHAIN : n);
        }
    }
}

static void one_round(job *j, int workload, size_t repetition) {
    for (size_t b = 0; b < blocks_of(j->n[workload]); b++) {
        for (size_t m = 0; m < j->list->n_methods; m++) {
            if (j->list->methods[m].workloads & BENCH_BIT(workload)) {
                one_block(j, workload, m, b, repetition);
            }
        }
    }
}

static void conclude(job *j, int workload, double harness_ns, size_t m, run_result *result) {
    const size_t n = j->n[workload], reps = j->options->n_repetitions;
    double *median = points_memory(n * sizeof *median);
    for (size_t i = 0; i < n; i++) {
        const double t = clock_quantile(j->times[workload] + (m * n + i) * reps, reps, 0.5);
        median[i] = fmax(0.0, t - harness_ns);
    }
    result->is_measured = 1;
    result->p50_ns = clock_quantile(median, n, 0.5);
    result->p99_ns = clock_quantile(median, n, 0.99);
    if (workload == BENCH_RANDOM || workload == BENCH_PATH) {
        result->chain_ns =
            clock_quantile(j->chains[workload] + m * chains_of(n) * reps, chains_of(n) * reps, 0.5);
    }
    free(median);
}

static void open_job(job *j, const run_points *points) {
    const run_options *o = j->options;
    const size_t n_methods = j->list->n_methods;
    size_t blocks = 0;
    for (int w = 0; w < BENCH_N_WORKLOADS; w++) {
        const int is_path = w == BENCH_PATH || w == BENCH_COLD_PATH;
        j->points[w] = is_path ? points->path : points->random;
        j->n[w] = w == BENCH_RANDOM || w == BENCH_PATH ? o->n_points : o->n_cold;
        j->times[w] = points_memory(n_methods * j->n[w] * o->n_repetitions * sizeof(double));
        blocks += n_methods * blocks_of(j->n[w]) * o->n_repetitions;
    }
    for (int w = 0; w < 2; w++) {
        j->chains[w] =
            points_memory(n_methods * chains_of(j->n[w]) * o->n_repetitions * sizeof(double));
    }
    j->ghz = points_memory(blocks * sizeof(double));
    j->ghz_max = blocks;
}

static void close_job(job *j) {
    for (int w = 0; w < BENCH_N_WORKLOADS; w++) {
        free(j->times[w]);
    }
    free(j->chains[0]);
    free(j->chains[1]);
    free(j->ghz);
}

/* The updates take turns, too. Each is done twice and its second time counts, so that what the
 * others left in the caches does not; k goes back and forth, so that each one changes something.
 * The peers' take milliseconds and are repeated less often. */
static void time_updates(job *j, run_update *updates) {
    const size_t n = j->options->n_updates, n_updates = j->list->n_updates;
    double *times = points_memory(n * n_updates * sizeof *times);
    size_t *n_times = points_memory(n_updates * sizeof *n_times);
    memset(n_times, 0, n_updates * sizeof *n_times);
    for (size_t i = 0; i < n * n_updates; i++) {
        const size_t k = i / n_updates, u = i % n_updates;
        const bench_update *update = &j->list->updates[u];
        if (update->is_peer && k % PEERS_EVERY != 0) {
            continue;
        }
        update->prepare(update->self, 2 * k);
        *j->sink = update->apply(update->self);
        update->prepare(update->self, 2 * k + 1);
        const uint64_t start = clock_stamp();
        *j->sink = update->apply(update->self);
        times[u * n + n_times[u]++] = (double)(clock_stamp() - start) * clock_tick_ns();
    }
    for (size_t u = 0; u < n_updates; u++) {
        updates[u].p50_ns = clock_quantile(times + u * n, n_times[u], 0.5);
        updates[u].p90_ns = clock_quantile(times + u * n, n_times[u], 0.9);
    }
    free(times);
    free(n_times);
}

void run_all(const bench_list *list, const methods_body *body, const bench_mesh *mesh,
             const run_points *points, const run_options *options, run_outcome *outcome) {
    volatile double sink = 0.0;
    job j = {.list = list, .options = options, .sink = &sink};
    const size_t n_results = list->n_methods * BENCH_N_WORKLOADS;
    outcome->results = points_memory(n_results * sizeof *outcome->results);
    memset(outcome->results, 0, n_results * sizeof *outcome->results);
    outcome->updates = points_memory(list->n_updates * sizeof *outcome->updates);
    open_job(&j, points);
    compare_all(list, body, mesh, points, options, outcome->results);
    for (int w = 0; w < BENCH_N_WORKLOADS; w++) {
        for (size_t r = 0; r < options->n_repetitions; r++) {
            one_round(&j, w, r);
        }
        double harness_ns = 0.0;
        for (size_t m = 0; m < list->n_methods; m++) {
            run_result *result = &outcome->results[m * BENCH_N_WORKLOADS + (size_t)w];
            if (list->methods[m].workloads & BENCH_BIT(w)) {
                conclude(&j, w, harness_ns, m, result);
            }
            if (m == 0) { /* the harness itself, always first */
                harness_ns = result->p50_ns;
                outcome->harness_ns = w == BENCH_RANDOM ? harness_ns : outcome->harness_ns;
            }
        }
    }
    time_updates(&j, outcome->updates);
    outcome->core_ghz = clock_quantile(j.ghz, j.n_ghz, 0.5);
    outcome->core_low_ghz = clock_quantile(j.ghz, j.n_ghz, 0.05);
    close_job(&j);
}

void run_free(run_outcome *outcome) {
    free(outcome->results);
    free(outcome->updates);
}
