/* SPDX-License-Identifier: BSD-3-Clause */
/* The report for programs. JSON knows neither NaN nor infinity: those become null. */
#include "bars.h"
#include "report.h"

#include <math.h>

static void string(FILE *out, const char *key, const char *value) {
    fprintf(out, "\"%s\": \"", key);
    for (const char *c = value; *c != '\0'; c++) {
        if (*c == '"' || *c == '\\') {
            fputc('\\', out);
        }
        if ((unsigned char)*c >= 0x20) {
            fputc(*c, out);
        }
    }
    fputc('"', out);
}

static void number(FILE *out, const char *key, double value) {
    if (isfinite(value)) {
        fprintf(out, ", \"%s\": %.9g", key, value);
    } else {
        fprintf(out, ", \"%s\": null", key);
    }
}

static void result(FILE *out, const bench_method *method, int workload, const run_result *r) {
    fputs("    {", out);
    string(out, "method", method->name);
    fputs(", ", out);
    string(out, "workload", run_workload_name(workload));
    number(out, "p50_ns", r->p50_ns);
    number(out, "p99_ns", r->p99_ns);
    if (workload == BENCH_RANDOM || workload == BENCH_PATH) {
        number(out, "chain_ns", r->chain_ns);
    }
    if (r->n_compared > 0) {
        number(out, "evaluations_mean", r->evaluations_mean);
        number(out, "evaluations_p99", r->evaluations_p99);
        number(out, "patches_mean", r->patches_mean);
        number(out, "patches_p99", r->patches_p99);
        number(out, "newton_mean", r->newton_mean);
        number(out, "newton_p99", r->newton_p99);
        number(out, "global_share", r->global_share);
        number(out, "truncated_share", r->truncated_share);
        number(out, "unsure_share", r->unsure_share);
        number(out, "off_share", r->off_share);
        number(out, "compared", (double)r->n_compared);
        number(out, "checked", (double)r->n_checked);
        number(out, "wrong", (double)r->n_wrong);
        number(out, "worst_m", r->worst_m);
        number(out, "tolerance_m", method->tolerance_m);
    }
    if (method->bytes > 0.0) {
        number(out, "bytes", method->bytes);
    }
    fprintf(out, ", \"peer\": %s}", method->is_peer ? "true" : "false");
}

static void bars(FILE *out, const report_body *body) {
    bars_line lines[BARS_MAX];
    const size_t n = bars_list(body, lines);
    fputs("   \"bars\": [", out);
    for (size_t i = 0; i < n; i++) {
        fputs(i > 0 ? ",\n    {" : "\n    {", out);
        string(out, "name", lines[i].name);
        fputs(", ", out);
        string(out, "unit", lines[i].unit);
        number(out, "limit", lines[i].limit);
        number(out, "value", lines[i].is_known ? lines[i].value : HUGE_VAL);
        number(out, "embree", lines[i].has_peer ? lines[i].peer_value : HUGE_VAL);
        fprintf(out, ", \"met\": %s}",
                !lines[i].is_known                 ? "null"
                : lines[i].value <= lines[i].limit ? "true"
                                                   : "false");
    }
    fputs("]\n", out);
}

void report_json(FILE *out, const report_body *body) {
    const char *comma = "\n";
    fputs("  {", out);
    string(out, "body", body->path);
    fputs(", ", out);
    string(out, "simd", report_simd_name(body->info.simd));
    number(out, "degree", body->info.degree);
    number(out, "leaves", (double)body->info.n_leaves);
    number(out, "diagonal_m", body->info.diagonal_m);
    number(out, "run_time_bytes", (double)body->info.run_time_bytes);
    number(out, "body_bytes", (double)body->info.body_bytes);
    number(out, "table_bytes", (double)body->info.table_bytes);
    number(out, "map_seed_bytes", (double)body->info.map_seed_bytes);
    number(out, "map_bytes", (double)body->map.bytes);
    number(out, "triangles", (double)body->mesh->n_triangles);
    number(out, "triangles_deviation_m", body->mesh->deviation_m);
    number(out, "core_ghz", body->outcome->core_ghz);
    number(out, "harness_ns", body->outcome->harness_ns);
    fputs(",\n   \"results\": [", out);
    for (size_t m = 1; m < body->list->n_methods; m++) {
        for (int w = 0; w < BENCH_N_WORKLOADS; w++) {
            const run_result *r = &body->outcome->results[m * BENCH_N_WORKLOADS + (size_t)w];
            if (r->is_measured) {
                fputs(comma, out);
                result(out, &body->list->methods[m], w, r);
                comma = ",\n";
            }
        }
    }
    fputs("],\n   \"updates\": [", out);
    for (size_t u = 0; u < body->list->n_updates; u++) {
        fputs(u > 0 ? ",\n    {" : "\n    {", out);
        string(out, "update", body->list->updates[u].name);
        number(out, "p50_us", 1e-3 * body->outcome->updates[u].p50_ns);
        number(out, "p90_us", 1e-3 * body->outcome->updates[u].p90_ns);
        fprintf(out, ", \"peer\": %s}", body->list->updates[u].is_peer ? "true" : "false");
    }
    fputs("],\n", out);
    bars(out, body);
    fputs("  }", out);
}
