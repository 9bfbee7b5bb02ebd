/* SPDX-License-Identifier: BSD-3-Clause */
/* From a tolerance and a budget to a degree, a tier and prices.
 *
 * A table in the body file that names this machine decides. Else the model's own degree is
 * measured, and only if that cannot do what is asked for are lower degrees made and measured, too,
 * the highest first: a body of a lower degree is a body cut off after that degree. */
#include "scene_accuracy.h"

#include "cost_quick.h"
#include "yaml_value.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define TOLERANCE_MIN_M 1e-9
#define TOLERANCE_MAX_M 1.0
#define BUDGET_MIN_US 0.01
#define BUDGET_MAX_US 10000.0

#define MEASURE_SECONDS 1.0 /* no further degree is begun after this */
#define COUNT(array) (sizeof(array) / sizeof(array)[0])

static const int lower_degrees[] = {10, 7, 5, 3};

/* ---- the key ---- */

/* A tracker's error is that of the path it was measured on, and another path may lose the closest
 * point: it is chosen where the scene names it, and not because its figures look good. */
#define TIERS_DEFAULT                                                                              \
    (SHCD_TIER_BIT(SHCD_TIER_EXACT) | SHCD_TIER_BIT(SHCD_TIER_FAST) | SHCD_TIER_BIT(SHCD_TIER_MAP))

static bool read_tier(const yaml_tree *tree, const yaml_node *node, unsigned *tiers) {
    static const struct {
        const char *name;
        int tier;
    } known[] = {{"exact", SHCD_TIER_EXACT},
                 {"fast", SHCD_TIER_FAST},
                 {"track", SHCD_TIER_TRACK},
                 {"map", SHCD_TIER_MAP}};
    for (size_t i = 0; i < COUNT(known); i++) {
        if (node->kind == YAML_SCALAR && yaml_equals(node, known[i].name)) {
            *tiers = SHCD_TIER_BIT(known[i].tier);
            return true;
        }
    }
    return yaml_fail(tree, node, "must be exact, fast, track or map");
}

bool scene_accuracy_read(const yaml_tree *tree, const yaml_node *node, scene_accuracy *asked) {
    enum { TOLERANCE, BUDGET, AGAINST, TIER };
    yaml_field fields[] = {[TOLERANCE] = {"tolerance_m", NULL, NULL},
                           [BUDGET] = {"budget_us", NULL, NULL},
                           [AGAINST] = {"against", NULL, NULL},
                           [TIER] = {"tier", NULL, NULL}};
    memset(asked, 0, sizeof *asked);
    asked->node = node;
    if (!yaml_fields(tree, node, "key", fields, COUNT(fields))) {
        return false;
    }
    if (fields[TOLERANCE].node == NULL && fields[BUDGET].node == NULL &&
        fields[TIER].node == NULL) {
        return yaml_fail(tree, node, "states nothing, must hold tolerance_m, budget_us or tier");
    }
    asked->tiers = TIERS_DEFAULT;
    if (fields[TIER].node != NULL && !read_tier(tree, fields[TIER].node, &asked->tiers)) {
        return false;
    }
    const yaml_node *against = fields[AGAINST].node;
    if (against != NULL && (against->kind != YAML_SCALAR ||
                            (!yaml_equals(against, "surface") && !yaml_equals(against, "mesh")))) {
        return yaml_fail(tree, against, "must be surface or mesh");
    }
    asked->against = against;
    asked->is_against_mesh = against != NULL && yaml_equals(against, "mesh");
    return (fields[TOLERANCE].node == NULL ||
            yaml_number(tree, fields[TOLERANCE].node, TOLERANCE_MIN_M, TOLERANCE_MAX_M, "m",
                        &asked->tolerance_m)) &&
           (fields[BUDGET].node == NULL || yaml_number(tree, fields[BUDGET].node, BUDGET_MIN_US,
                                                       BUDGET_MAX_US, "us", &asked->budget_us));
}

/* ---- the table ---- */

typedef struct table {
    const shcd_cost_row *rows;
    size_t n;
    shcd_cost_row *own; /* those of the model's own degree, if no other will do */
    shcd_cost_row measured[COST_QUICK_ROWS * (1 + COUNT(lower_degrees))];
    shcd_model *lower[COUNT(lower_degrees)]; /* those that were made */
} table;

static shcd_model *cut_off(const shcd_model *model, int degree, shcd_error *problem) {
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_model *lower = NULL;
    def.degree = degree;
    def.coefficients = shcd_model_coefficients(model); /* by degree: the first ones are its own */
    return shcd_model_create(&def, NULL, &lower, problem) == SHCD_OK ? lower : NULL;
}

static bool has_table(const shcd_model *model, table *t) {
    char here[SHCD_COST_MACHINE_SIZE];
    cost_quick_machine(here);
    t->rows = shcd_model_cost_rows(model, &t->n);
    return t->n > 0 && strcmp(shcd_model_cost_machine(model), here) == 0;
}

/* Leaves out the rows of lower degrees. */
static bool keep_own(const shcd_model *model, table *t) {
    size_t n = 0;
    t->own = malloc((t->n + 1) * sizeof *t->own);
    for (size_t i = 0; i < t->n && t->own != NULL; i++) {
        if (t->rows[i].degree == shcd_model_degree(model)) {
            t->own[n++] = t->rows[i];
        }
    }
    t->rows = t->own;
    t->n = n;
    return t->own != NULL;
}

static double seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void table_free(table *t) {
    free(t->own);
    for (size_t i = 0; i < COUNT(lower_degrees); i++) {
        shcd_model_free(t->lower[i]);
        t->lower[i] = NULL;
    }
}

/* A degree at which the series is no body (inside out, or without volume) is left out. */
static shcd_status measure_and_choose(const shcd_model *model, const char *body, bool is_whole,
                                      const shcd_accuracy_request *request, table *t,
                                      shcd_accuracy_pair *choice, shcd_error *problem) {
    const double start = seconds();
    fprintf(stderr, "shcdd: body '%s': no cost table of this machine; measuring (see shcd cost)\n",
            body);
    t->rows = t->measured;
    t->n = cost_quick(model, model, t->measured) ? COST_QUICK_ROWS : 0;
    shcd_status status = shcd_accuracy_choose(t->rows, t->n, request, choice, NULL, problem);
    for (size_t i = 0; !is_whole && i < COUNT(lower_degrees) && status == SHCD_ERR_UNSUPPORTED &&
                       seconds() - start < MEASURE_SECONDS;
         i++) {
        if (lower_degrees[i] >= shcd_model_degree(model)) {
            continue;
        }
        t->lower[i] = cut_off(model, lower_degrees[i], NULL);
        if (t->lower[i] != NULL && cost_quick(model, t->lower[i], t->measured + t->n)) {
            t->n += COST_QUICK_ROWS;
            status = shcd_accuracy_choose(t->rows, t->n, request, choice, NULL, problem);
        }
    }
    return status;
}

/* ---- what follows ---- */

/* One line at the start: a table that decides should not do so in silence. */
static void tell(const char *body, const shcd_cost_row *row, const shcd_accuracy_pair *choice,
                 const char *source) {
    static const char *const tiers[] = {"exact", "fast", "map", "track"};
    char map[48] = "";
    if (row->tier == SHCD_TIER_MAP) {
        snprintf(map, sizeof map, " of resolution %d, %s", (int)row->map_resolution,
                 row->interpolation == SHCD_MAP_HERMITE ? "hermite" : "linear");
    }
    const bool is_below = choice->error_m < TOLERANCE_MIN_M;
    fprintf(stderr, "shcdd: body '%s': degree %d, %s%s: %s%.3g mm in %.3g us, by %s\n", body,
            (int)row->degree, tiers[row->tier], map, is_below ? "below " : "",
            1e3 * (is_below ? TOLERANCE_MIN_M : choice->error_m), choice->time_us, source);
}

static bool make_answer(const shcd_model *model, table *t, const shcd_accuracy_pair *choice,
                        double budget_us, scene_answer *answer, shcd_error *problem) {
    const shcd_cost_row *row = &t->rows[choice->row];
    for (size_t i = 0; i < COUNT(lower_degrees); i++) {
        if (row->degree == lower_degrees[i] && row->degree < shcd_model_degree(model)) {
            answer->model = t->lower[i];
            t->lower[i] = NULL;
        }
    }
    if (answer->model == NULL && row->degree < shcd_model_degree(model)) {
        answer->model = cut_off(model, row->degree, problem);
        if (answer->model == NULL) {
            return false;
        }
    }
    const shcd_model *used = answer->model != NULL ? answer->model : model;
    shcd_model_info info = SHCD_MODEL_INFO_INIT;
    if (shcd_model_describe(used, &info) != SHCD_OK ||
        shcd_body_accuracy_of(t->rows, t->n, choice->row, budget_us, &answer->accuracy) !=
            SHCD_OK) {
        return false;
    }
    if (row->tier == SHCD_TIER_MAP && row->map_resolution != info.map_resolution) {
        shcd_map_options options = SHCD_MAP_OPTIONS_INIT;
        options.resolution = row->map_resolution;
        if (shcd_map_create(used, &options, NULL, &answer->map, problem) != SHCD_OK) {
            return false;
        }
        answer->accuracy.map = answer->map;
    }
    return true;
}

bool scene_accuracy_resolve(const yaml_tree *tree, const scene_accuracy *asked,
                            const shcd_model *model, const char *body, bool is_whole,
                            size_t n_tools, scene_answer *answer) {
    table t;
    shcd_accuracy_pair choice = {0, 0.0, 0.0};
    shcd_accuracy_request request = SHCD_ACCURACY_REQUEST_INIT;
    shcd_error problem = {SHCD_OK, ""};
    shcd_model_info info = SHCD_MODEL_INFO_INIT;
    memset(&t, 0, sizeof t);
    memset(answer, 0, sizeof *answer);
    request.tolerance_m = asked->tolerance_m;
    request.budget_us = asked->budget_us;
    request.n_queries = (uint32_t)n_tools;
    request.tiers = asked->tiers;
    if (asked->is_against_mesh) {
        if (shcd_model_describe(model, &info) != SHCD_OK || info.fit.n_triangles == 0) {
            return yaml_fail(tree, asked->against,
                             "the body was not fitted to a mesh; must be surface");
        }
        request.extra_error_m = info.fit.hausdorff_error_m;
    }
    const bool is_known = has_table(model, &t);
    if (is_known && is_whole && !keep_own(model, &t)) {
        return yaml_fail(tree, NULL, "out of memory");
    }
    const shcd_status status =
        is_known ? shcd_accuracy_choose(t.rows, t.n, &request, &choice, NULL, &problem)
                 : measure_and_choose(model, body, is_whole, &request, &t, &choice, &problem);
    const bool good =
        status == SHCD_OK && make_answer(model, &t, &choice, asked->budget_us, answer, &problem);
    if (good) {
        tell(body, &t.rows[choice.row], &choice, is_known ? "its cost table" : "measurement");
    }
    table_free(&t);
    if (!good) {
        shcd_map_free(answer->map);
        shcd_model_free(answer->model);
        memset(answer, 0, sizeof *answer);
        return yaml_fail(tree, asked->node, "%s", problem.message);
    }
    return true;
}
