/* SPDX-License-Identifier: BSD-3-Clause */
/* What the reader sees. Times in ns; a ratio above 1 says how many times longer than libshcd's
 * exact tier a method takes on the same points. */
#include "report.h"
#include "bars.h"

#include <math.h>
#include <string.h>

const char *report_simd_name(int simd) {
    static const char *const name[4] = {"auto", "portable", "avx2", "avx512"};
    return simd >= 0 && simd < 4 ? name[simd] : "?";
}

static const run_result *result_at(const report_body *body, size_t m, int workload) {
    return &body->outcome->results[m * BENCH_N_WORKLOADS + (size_t)workload];
}

/* The yardstick on a workload: the best exact method, which on a path is the one with certificates.
 */
static double yardstick_ns(const report_body *body, int workload) {
    double best = 0.0;
    for (size_t m = 0; m < body->list->n_methods; m++) {
        const char *name = body->list->methods[m].name;
        const run_result *r = result_at(body, m, workload);
        if (r->is_measured && (strcmp(name, "exact") == 0 || strcmp(name, "next") == 0)) {
            best = best == 0.0 || r->p50_ns < best ? r->p50_ns : best;
        }
    }
    return best;
}

static void print_times(FILE *out, const report_body *body, int workload) {
    const double yardstick = yardstick_ns(body, workload);
    const int has_chain = workload == BENCH_RANDOM || workload == BENCH_PATH;
    fprintf(out, "\n%s\n", run_workload_name(workload));
    fprintf(out, "  %-14s %9s %9s %8s %9s %9s\n", "method", "p50 ns", "p99 ns", "p99/p50",
            has_chain ? "chain ns" : "", "x exact");
    for (size_t m = 0; m < body->list->n_methods; m++) {
        const bench_method *method = &body->list->methods[m];
        const run_result *r = result_at(body, m, workload);
        if (!r->is_measured) {
            continue;
        }
        if (m == 0) { /* the harness: subtracted from the others */
            fprintf(out, "  %-14s %9.0f %9s %8s", method->name, body->outcome->harness_ns, "", "");
        } else {
            fprintf(out, "  %-14s %9.0f %9.0f %8.1f", method->name, r->p50_ns, r->p99_ns,
                    r->p50_ns > 0.0 ? r->p99_ns / r->p50_ns : 0.0);
        }
        if (has_chain) {
            fprintf(out, " %9.1f", r->chain_ns);
        } else {
            fprintf(out, " %9s", "");
        }
        if (m > 0 && yardstick > 0.0) {
            fprintf(out, " %9.2f", r->p50_ns / yardstick);
        }
        fprintf(out, "   %s\n", method->what);
    }
}

static void print_counts(FILE *out, const report_body *body, int workload) {
    fprintf(out, "\n%s: mean / p99 per query; shares of the queries\n",
            run_workload_name(workload));
    fprintf(out, "  %-14s %15s %15s %13s %8s %9s %8s %8s\n", "method", "evaluations", "patches",
            "newton", "searched", "truncated", "no sign", "off");
    for (size_t m = 1; m < body->list->n_methods; m++) {
        const bench_method *method = &body->list->methods[m];
        const run_result *r = result_at(body, m, workload);
        if (method->explain == NULL || method->is_peer || r->n_compared == 0) {
            continue;
        }
        fprintf(out,
                "  %-14s %8.2f / %4.0f %8.2f / %4.0f %6.2f / %4.0f %7.1f%% %8.2f%% %7.1f%% "
                "%7.2f%%\n",
                method->name, r->evaluations_mean, r->evaluations_p99, r->patches_mean,
                r->patches_p99, r->newton_mean, r->newton_p99, 100.0 * r->global_share,
                100.0 * r->truncated_share, 100.0 * r->unsure_share, 100.0 * r->off_share);
    }
}

static void print_updates(FILE *out, const report_body *body) {
    if (body->list->n_updates == 0) {
        return;
    }
    fprintf(out, "\nchange of the whole shape\n  %-14s %9s %9s\n", "", "p50 us", "p90 us");
    for (size_t u = 0; u < body->list->n_updates; u++) {
        const run_update *r = &body->outcome->updates[u];
        fprintf(out, "  %-14s %9.2f %9.2f   %s\n", body->list->updates[u].name, 1e-3 * r->p50_ns,
                1e-3 * r->p90_ns, body->list->updates[u].what);
    }
}

static void print_bytes(FILE *out, const report_body *body) {
    const shcd_model_info *info = &body->info;
    fprintf(out, "\nbytes in memory\n  %-14s %10.0f KB\n", "model",
            (double)info->run_time_bytes / 1024.0);
    fprintf(out, "  %-14s %10.0f KB   of it: coefficients, bounds, positions, map radii\n", "body",
            (double)info->body_bytes / 1024.0);
    fprintf(out, "  %-14s %10.0f KB   of it: what all bodies of this degree have in common\n",
            "tables", (double)info->table_bytes / 1024.0);
    fprintf(out, "  %-14s %10.0f KB   of it: starting parameters in the map\n", "map seeds",
            (double)info->map_seed_bytes / 1024.0);
    fprintf(out, "  %-14s %10.0f KB   a map of its own, resolution %d\n", "map",
            (double)body->map.bytes / 1024.0, (int)body->map.resolution);
    for (size_t m = 0; m < body->list->n_methods; m++) {
        const bench_method *method = &body->list->methods[m];
        if (method->bytes > 0.0) {
            fprintf(out, "  %-14s %10.0f KB\n", method->name, method->bytes / 1024.0);
        }
    }
}

static void print_agreement(FILE *out, const report_body *body) {
    size_t n_compared = 0, n_checked = 0, n_wrong = 0;
    for (size_t m = 0; m < body->list->n_methods; m++) {
        for (int w = 0; w < BENCH_N_WORKLOADS; w++) {
            const run_result *r = result_at(body, m, w);
            n_compared += r->n_compared;
            n_checked += r->n_checked;
            n_wrong += r->n_wrong;
            if (r->n_wrong > 0) {
                fprintf(out, "  WRONG: %s, %s: %zu of %zu claims, by up to %.3g m\n",
                        body->list->methods[m].name, run_workload_name(w), r->n_wrong,
                        r->n_compared, r->worst_m);
            }
        }
    }
    fprintf(out,
            "\nagreement: %zu answers compared with the exact tier, %zu of them with all %zu "
            "triangles: %zu wrong\n",
            n_compared, n_checked, body->mesh->n_triangles, n_wrong);
}

void report_tables(FILE *out, const report_body *body) {
    const shcd_model_info *info = &body->info;
    fprintf(out,
            "== %s: degree %d, %llu leaves, evaluated by %s; %zu triangles, off by at most "
            "%.3g %% diag\n",
            body->path, (int)info->degree, (unsigned long long)info->n_leaves,
            report_simd_name(info->simd), body->mesh->n_triangles,
            100.0 * body->mesh->deviation_m / body->mesh->diagonal_m);
    fprintf(out, "core clock %.2f GHz (5 %% of the blocks below %.2f)\n", body->outcome->core_ghz,
            body->outcome->core_low_ghz);
    for (int w = 0; w < BENCH_N_WORKLOADS; w++) {
        print_times(out, body, w);
    }
    print_counts(out, body, BENCH_RANDOM);
    print_counts(out, body, BENCH_PATH);
    print_updates(out, body);
    print_bytes(out, body);
    print_agreement(out, body);
}

/* Four digits, without exponents. */
static void print_value(FILE *out, double value, const char *unit) {
    fprintf(out, "%9.*f %-2s", value < 10.0 ? 3 : value < 1000.0 ? 1 : 0, value, unit);
}

void report_bars(FILE *out, const report_body *body) {
    bars_line lines[BARS_MAX];
    const size_t n = bars_list(body, lines);
    fprintf(out, "\nbars, %s\n", body->path);
    for (size_t i = 0; i < n; i++) {
        const bars_line *line = &lines[i];
        const char *unit = strcmp(line->unit, "1") == 0 ? "" : line->unit;
        fprintf(out, "  %-36s <= %5.5g %-2s", line->name, line->limit, unit);
        if (!line->is_known) {
            fputs("  not measured\n", out);
            continue;
        }
        print_value(out, line->value, unit);
        if (line->value <= line->limit) {
            fputs("  met         ", out);
        } else {
            fprintf(out, "  missed %4.1f x", line->value / line->limit);
        }
        if (line->has_peer) {
            fputs("  Embree ", out);
            print_value(out, line->peer_value, unit);
            fprintf(out, " = %.3g x ours", line->peer_value / line->value);
        }
        fputs("\n", out);
    }
}
