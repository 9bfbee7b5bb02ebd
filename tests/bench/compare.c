/* SPDX-License-Identifier: BSD-3-Clause */
/* Whether all methods tell the truth about the points they are timed on, and what each costs.
 *
 * Truth comes from two sides. All triangles of the surface, one after the other: shares no code
 * with any query, and brackets the distance to within the triangles' proven deviation; their
 * winding number gives the sign beyond it. And the exact tier of a model made from the same
 * coefficients, which is far sharper, and is itself compared with the triangles. A claim is wrong
 * if its interval, widened by the method's tolerance, does not meet the interval of the truth. */
#include "compare.h"
#include "clock.h"
#include "points.h"
#include "shcd/vec.h"

#include <stdlib.h>

/* Half a turn of doubt: the winding number of a closed mesh is an integer off the mesh. */
#define WINDING_INSIDE 0.5
#define CLOSE 1e-6 /* of the diagonal: an answer that a hand cannot tell from the truth */

typedef struct truth {
    double *lower_m, *upper_m; /* from the exact tier */
    int *sign;
    double *mesh_m; /* of the first n_checked points */
    int *mesh_sign; /* 0 within the deviation */
    double deviation_m;
} truth;

static truth find_truth(const shcd_model *model, const bench_mesh *mesh, int moved,
                        const double *points, size_t n, size_t n_checked) {
    const double *vertices_m = moved ? mesh->moved_m : mesh->vertices_m;
    truth t = {points_memory(n * sizeof(double)),
               points_memory(n * sizeof(double)),
               points_memory(n * sizeof(int)),
               points_memory(n_checked * sizeof(double)),
               points_memory(n_checked * sizeof(int)),
               moved ? mesh->moved_deviation_m : mesh->deviation_m};
    for (size_t i = 0; i < n; i++) {
        const shcd_vec3 p = shcd_vec3_make(points[3 * i], points[3 * i + 1], points[3 * i + 2]);
        shcd_proximity near;
        bench_answer answer = {0};
        if (shcd_closest(model, p, NULL, &near) == SHCD_OK) {
            methods_explain(&near, &answer);
        }
        t.lower_m[i] = answer.lower_m;
        t.upper_m[i] = answer.upper_m;
        t.sign[i] = answer.sign;
    }
    for (size_t i = 0; i < n_checked; i++) {
        t.mesh_m[i] = points_mesh_distance(mesh, vertices_m, points + 3 * i);
        t.mesh_sign[i] = 0;
        if (t.mesh_m[i] > t.deviation_m) {
            const double winding = points_mesh_winding(mesh, vertices_m, points + 3 * i);
            t.mesh_sign[i] = winding > WINDING_INSIDE ? -1 : 1;
        }
    }
    return t;
}

static void free_truth(truth *t) {
    free(t->lower_m);
    free(t->upper_m);
    free(t->sign);
    free(t->mesh_m);
    free(t->mesh_sign);
}

/* How far two intervals are apart. */
static double miss(double low_a, double high_a, double low_b, double high_b) {
    return fmax(0.0, fmax(low_a - high_b, low_b - high_a));
}

static void judge(const truth *t, size_t i, int on_mesh, double tolerance_m,
                  const bench_answer *answer, run_result *result) {
    double missed = miss(answer->lower_m, answer->upper_m, t->lower_m[i], t->upper_m[i]);
    int wrong = answer->sign * t->sign[i] < 0;
    result->n_compared++;
    if (on_mesh) {
        const double off = miss(answer->lower_m, answer->upper_m, t->mesh_m[i] - t->deviation_m,
                                t->mesh_m[i] + t->deviation_m);
        missed = fmax(missed, off);
        wrong |= answer->sign * t->mesh_sign[i] < 0;
        result->n_checked++;
    }
    result->worst_m = fmax(result->worst_m, missed);
    wrong |= !(missed <= tolerance_m); /* a NaN is wrong, too */
    result->n_wrong += (size_t)wrong;
}

static void ask(const bench_method *method, const double *points, size_t n, const truth *t,
                size_t n_checked, double close_m, run_result *result) {
    double *counts[3];
    for (int k = 0; k < 3; k++) {
        counts[k] = points_memory(n * sizeof(double));
    }
    double *mean[3] = {&result->evaluations_mean, &result->patches_mean, &result->newton_mean};
    double *p99[3] = {&result->evaluations_p99, &result->patches_p99, &result->newton_p99};
    if (method->start != NULL) {
        method->start(method->self, points);
    }
    for (size_t i = 0; i < n; i++) {
        bench_answer answer = {0};
        (void)method->query(method->self, points + 3 * i);
        method->explain(method->self, &answer);
        counts[0][i] = answer.n_evaluations;
        counts[1][i] = answer.n_patches;
        counts[2][i] = answer.n_newton;
        result->global_share += answer.is_global / (double)n;
        result->truncated_share +=
            (answer.flags & SHCD_PROXIMITY_TRUNCATED ? 1.0 : 0.0) / (double)n;
        result->unsure_share += (answer.sign == 0 ? 1.0 : 0.0) / (double)n;
        result->off_share += (answer.upper_m > t->upper_m[i] + close_m ? 1.0 : 0.0) / (double)n;
        judge(t, i, i < n_checked, method->tolerance_m, &answer, result);
    }
    for (int k = 0; k < 3; k++) {
        for (size_t i = 0; i < n; i++) {
            *mean[k] += counts[k][i] / (double)n;
        }
        *p99[k] = clock_quantile(counts[k], n, 0.99);
        free(counts[k]);
    }
}

void compare_all(const bench_list *list, const methods_body *body, const bench_mesh *mesh,
                 const run_points *points, const run_options *options, run_result *results) {
    const double *sets[2] = {points->random, points->path};
    for (int w = 0; w < 2; w++) {
        for (int moved = 0; moved < 2; moved++) {
            const shcd_model *model = moved ? body->moved : body->model;
            truth t =
                find_truth(model, mesh, moved, sets[w], options->n_points, options->n_checked);
            for (size_t m = 0; m < list->n_methods; m++) {
                const bench_method *method = &list->methods[m];
                if (method->explain != NULL && method->is_moved == moved &&
                    method->workloads & BENCH_BIT(w)) {
                    ask(method, sets[w], options->n_points, &t, options->n_checked,
                        CLOSE * body->diagonal_m, &results[m * BENCH_N_WORKLOADS + (size_t)w]);
                }
            }
            free_truth(&t);
        }
    }
}
