/* SPDX-License-Identifier: BSD-3-Clause */
/* `shcd effects`: the library's table of effects, with what each of them costs here. */
#include "arguments.h"
#include "body.h"
#include "commands.h"
#include "effect_cost.h"
#include "report.h"

#include <stdio.h>
#include <string.h>

#define EFFECTS_MAX 32

/* ---- for people -------------------------------------------------------------------------------
 */

static void print_range(const shcd_parameter_info *p) {
    const char *unit = strcmp(p->unit, "1") == 0 ? "" : p->unit;
    if (p->columns == NULL) {
        printf("  %-26s %g, %g .. %g%s%s\n", p->name, p->default_value, p->min_value, p->max_value,
               unit[0] != '\0' ? " " : "", unit);
        return;
    }
    printf("  %-26s %zu .. %zu rows:", p->name, p->n_rows_min, p->n_rows_max);
    for (size_t c = 0; c < p->n_columns; c++) {
        printf("%s %s, %g .. %g", c > 0 ? ";" : "", p->columns[c].name, p->columns[c].min_value,
               p->columns[c].max_value);
    }
    printf("\n");
}

static void print_text(const shcd_effect_info *info, const effect_cost *cost) {
    printf("%s\n", info->name);
    help_print_text(stdout, info->description);
    for (size_t i = 0; i < info->n_parameters; i++) {
        print_range(&info->parameters[i]);
        printf("  %26s %s\n", "", info->parameters[i].description);
    }
    if (cost->is_known) {
        printf("  takes %.0f ns a tick (99 %%: %.0f ns) and %zu bytes of state\n\n", cost->mean_ns,
               cost->p99_ns, cost->state_bytes);
    } else {
        printf("  was not measured: the body does not carry what it needs\n\n");
    }
}

/* ---- Markdown ---------------------------------------------------------------------------------
 */

/* A bar would end the cell. */
static void print_cell(const char *text) {
    for (; *text != '\0'; text++) {
        printf("%s%c", *text == '|' ? "\\" : "", *text);
    }
}

static void print_effect_row(const shcd_effect_info *info, const effect_cost *cost) {
    printf("| `%s` | ", info->name);
    print_cell(info->description);
    printf(" | ");
    print_cell(info->source);
    if (cost->is_known) {
        printf(" | %zu | %.0f | %.0f |\n", cost->state_bytes, cost->mean_ns, cost->p99_ns);
    } else {
        printf(" | - | - | - |\n");
    }
}

/* Of a table, each column stands for itself. */
static void print_parameter_row(const char *effect, const shcd_parameter_info *p) {
    if (p->columns == NULL) {
        printf("| `%s` | `%s` | %s | %g | %g | %g | ", effect, p->name, p->unit, p->default_value,
               p->min_value, p->max_value);
    } else {
        printf("| `%s` | `%s` | rows of", effect, p->name);
        for (size_t c = 0; c < p->n_columns; c++) {
            printf("%s %s", c > 0 ? "," : "", p->columns[c].name);
        }
        printf(" | none | %zu row%s |", p->n_rows_min, p->n_rows_min == 1 ? "" : "s");
        printf(" %zu rows | ", p->n_rows_max);
    }
    print_cell(p->description);
    printf(" |\n");
}

static void print_markdown(const effect_cost *costs, size_t n) {
    printf("| effect | what it does | source | bytes of state | ns a tick | 99 %% |\n"
           "|---|---|---|---|---|---|\n");
    for (size_t e = 0; e < n; e++) {
        print_effect_row(shcd_effect_at(e), &costs[e]);
    }
    printf("\n| effect | parameter | unit | default | smallest | largest | meaning |\n"
           "|---|---|---|---|---|---|---|\n");
    for (size_t e = 0; e < n; e++) {
        const shcd_effect_info *info = shcd_effect_at(e);
        for (size_t i = 0; i < info->n_parameters; i++) {
            print_parameter_row(info->name, &info->parameters[i]);
        }
    }
}

/* ---- the command ------------------------------------------------------------------------------
 */

static bool measure(const shcd_model *model, effect_cost *costs, size_t *n) {
    cost_clock clock;
    cost_clock_begin(&clock);
    for (*n = 0; *n < EFFECTS_MAX && shcd_effect_at(*n) != NULL; (*n)++) {
        if (!effect_cost_measure(model, shcd_effect_at(*n)->name, &clock, &costs[*n])) {
            return false;
        }
    }
    return true;
}

int command_effects(int argc, char **argv) {
    arguments a;
    effect_cost costs[EFFECTS_MAX];
    const char *path = NULL;
    bool as_markdown = false;
    size_t n = 0;
    int key;
    arguments_begin(&a, argc, argv);
    while ((key = arguments_next(&a)) > 0) {
        as_markdown = as_markdown || key == OPTION_MARKDOWN;
        path = key == OPTION_BODY ? a.value : path;
    }
    if (key != ARGUMENTS_END) {
        return arguments_status(key);
    }
    if (optind < argc) {
        return report_usage("it takes no operand, but '%s' is given", argv[optind]);
    }
    shcd_model *model = path != NULL ? body_load(path) : effect_cost_body();
    const bool good = model != NULL && measure(model, costs, &n);
    shcd_model_free(model);
    if (!good) {
        return STATUS_FAILED;
    }
    if (as_markdown) {
        print_markdown(costs, n);
    } else {
        for (size_t e = 0; e < n; e++) {
            print_text(shcd_effect_at(e), &costs[e]);
        }
    }
    return STATUS_DONE;
}
