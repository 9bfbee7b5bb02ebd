/* SPDX-License-Identifier: BSD-3-Clause */
/* golden_closest FILE: shcd_closest against closest.txt, and its interval. */
#include "table.h"

#include "shcd/shcd.h"

#define ROWS_MIN 30
#define LUMP_DEGREE_MAX 30
#define UNIT 2.0466534158929770 /* sqrt(4 pi / 3) */

/* The recipe that closest.txt states. */
static void lump(int degree, uint64_t seed, double *c) {
    c[3 * SHCD_INDEX(1, 1)] = 0.05 * UNIT;
    c[3 * SHCD_INDEX(1, -1) + 1] = 0.045 * UNIT;
    c[3 * SHCD_INDEX(1, 0) + 2] = 0.04 * UNIT;
    for (int l = 2; l <= degree; l++) {
        const double size = 0.012 / (double)(1000 * l * l * l);
        for (size_t i = 3 * SHCD_INDEX(l, -l); i < 3 * SHCD_INDEX(l, l) + 3; i++) {
            seed = seed * 6364136223846793005u + 1442695040888963407u;
            c[i] = size * (double)((int64_t)((seed >> 33) % 2001u) - 1000);
        }
    }
}

/* The degree, or 0 after a complaint. */
static int read_body(table *t, double *c) {
    char *rest = t->fields[0];
    const char *kind = table_word(&rest);
    double a[3];
    if (kind != NULL && strcmp(kind, "lump") == 0) {
        if (table_numbers(t, &rest, 2, a) != 0) {
            return 0;
        }
        if (!(a[0] >= 2.0 && a[0] <= LUMP_DEGREE_MAX && a[1] >= 0.0)) {
            table_complain(t, "a lump has a degree of 2 to %d and a seed", LUMP_DEGREE_MAX);
            return 0;
        }
        lump((int)a[0], (uint64_t)a[1], c);
        return (int)a[0];
    }
    const int is_sphere = kind != NULL && strcmp(kind, "sphere") == 0;
    if (kind == NULL || (!is_sphere && strcmp(kind, "ellipsoid") != 0)) {
        table_complain(t, "a body is a sphere, an ellipsoid or a lump");
        return 0;
    }
    if (table_numbers(t, &rest, is_sphere ? 1 : 3, a) != 0) {
        return 0;
    }
    c[3 * SHCD_INDEX(1, 1)] = a[0] * UNIT;
    c[3 * SHCD_INDEX(1, -1) + 1] = a[is_sphere ? 0 : 1] * UNIT;
    c[3 * SHCD_INDEX(1, 0) + 2] = a[is_sphere ? 0 : 2] * UNIT;
    return 1;
}

/* Rows of one body follow each other as a rule: the last model is kept. */
static shcd_model *model_of(const char *body, int degree, const double *c) {
    static char last[128];
    static shcd_model *model;
    if (body == NULL || strcmp(last, body) != 0) {
        shcd_model_def def = SHCD_MODEL_DEF_INIT;
        shcd_error error = {SHCD_OK, ""};
        shcd_model_free(model);
        model = NULL;
        last[0] = '\0';
        def.degree = degree;
        def.coefficients = c;
        if (body != NULL && shcd_model_create(&def, NULL, &model, &error) != SHCD_OK) {
            fprintf(stderr, "%s: %s\n", body, error.message);
        }
        if (model != NULL) {
            snprintf(last, sizeof last, "%s", body);
        }
    }
    return model;
}

static void check_row(table *t) {
    double coefficients[3 * SHCD_COUNT(LUMP_DEGREE_MAX)] = {0.0};
    double p[3], expected, tolerance;
    char body[128];
    shcd_proximity found;
    snprintf(body, sizeof body, "%s", t->fields[0]);
    const int degree = read_body(t, coefficients);
    if (degree == 0 || table_quantity(t, 1, 3, p, NULL) != 0 ||
        table_quantity(t, 2, 1, &expected, NULL) != 0 ||
        table_quantity(t, 3, 1, &tolerance, "m") != 0) {
        return;
    }
    const shcd_model *model = model_of(body, degree, coefficients);
    if (model == NULL ||
        shcd_closest(model, shcd_vec3_make(p[0], p[1], p[2]), NULL, &found) != SHCD_OK) {
        table_complain(t, "refused");
        return;
    }
    table_check(t, found.distance_m, expected, tolerance);
    /* the expected value has 17 digits or more: as much slack as a double needs to hold it */
    const double slack = 2.3e-16 * (expected < 0.0 ? -expected : expected);
    if (!(found.lower_m <= expected + slack && expected - slack <= found.upper_m)) {
        table_complain(t, "the interval %.17g .. %.17g misses %.17g", found.lower_m, found.upper_m,
                       expected);
    }
}

int main(int argc, char **argv) {
    table t;
    if (argc != 2 || table_open(&t, argv[1]) != 0) {
        fprintf(stderr, "usage: golden_closest FILE\n");
        return 2;
    }
    while (table_next(&t, 5)) {
        check_row(&t);
    }
    model_of(NULL, 0, NULL);
    return table_close(&t, ROWS_MIN);
}
