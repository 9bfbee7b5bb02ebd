/* SPDX-License-Identifier: BSD-3-Clause */
/* golden_harmonics FILE: shcd_harmonics against harmonics.txt. */
#include "table.h"

#include "shcd/shcd.h"

#define ROWS_MIN 30

static double values[10 * SHCD_COUNT(SHCD_DEGREE_MAX)];

/* Y, G and an axis, or H and two; -1 if it is none of them. */
static int component_of(const char *quantity, size_t *n_parts) {
    static const char *const names[] = {"Y",   "Gx",  "Gy",  "Gz",  "Hxx",
                                        "Hxy", "Hxz", "Hyy", "Hyz", "Hzz"};
    for (int i = 0; i < 10; i++) {
        if (strcmp(names[i], quantity) == 0) {
            *n_parts = strlen(quantity);
            return i == 0 ? 0 : i < 4 ? i - 1 : i - 4;
        }
    }
    return -1;
}

static void check_row(table *t) {
    double lm[2], direction[3], expected, tolerance;
    size_t order = 0;
    char *rest = t->fields[0];
    const char *quantity = table_word(&rest);
    const int component = quantity != NULL ? component_of(quantity, &order) : -1;
    if (component < 0) {
        table_complain(t, "the first word is Y, Gx .. Gz or Hxx .. Hzz");
        return;
    }
    const char *unit = order == 1 ? "K" : order == 2 ? "K*l" : "K*l*l";
    if (table_numbers(t, &rest, 2, lm) != 0 || table_quantity(t, 1, 3, direction, NULL) != 0 ||
        table_quantity(t, 2, 1, &expected, NULL) != 0 ||
        table_quantity(t, 3, 1, &tolerance, unit) != 0) {
        return;
    }
    const int l = (int)lm[0], m = (int)lm[1];
    const shcd_vec3 w = {direction[0], direction[1], direction[2]};
    double *gradient = values + SHCD_COUNT(SHCD_DEGREE_MAX);
    double *hessian = gradient + 3 * SHCD_COUNT(SHCD_DEGREE_MAX);
    if (l < 0 || m > l || m < -l || shcd_harmonics(l, w, values, gradient, hessian) != SHCD_OK) {
        table_complain(t, "refused: degree %d, order %d", l, m);
        return;
    }
    const size_t i = SHCD_INDEX(l, m), k = (size_t)component;
    const double found = order == 1   ? values[i]
                         : order == 2 ? gradient[3 * i + k]
                                      : hessian[6 * i + k];
    double scale = sqrt((2.0 * l + 1.0) / 12.566370614359172);
    for (size_t n = 1; n < order; n++) {
        scale *= l;
    }
    table_check(t, found, expected, tolerance * scale);
}

int main(int argc, char **argv) {
    table t;
    if (argc != 2 || table_open(&t, argv[1]) != 0) {
        fprintf(stderr, "usage: golden_harmonics FILE\n");
        return 2;
    }
    while (table_next(&t, 5)) {
        check_row(&t);
    }
    return table_close(&t, ROWS_MIN);
}
