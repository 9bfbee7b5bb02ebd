/* SPDX-License-Identifier: BSD-3-Clause */
/* `shcd coefficients`: the series as a table, in the library's real basis or in the complex one
 * that SPHARM papers use. */
#include "arguments.h"
#include "body.h"
#include "commands.h"
#include "output.h"
#include "report.h"

#include <stddef.h>
#include <stdlib.h>

static void write_real(FILE *file, int degree, const double *c) {
    fputs("l,m,x,y,z\n", file);
    for (int l = 0; l <= degree; l++) {
        for (int m = -l; m <= l; m++) {
            const double *v = c + 3 * SHCD_INDEX(l, m);
            fprintf(file, "%d,%d,%.17g,%.17g,%.17g\n", l, m, v[0], v[1], v[2]);
        }
    }
}

/* False: no memory. */
static bool write_complex(FILE *file, int degree, const double *c) {
    const size_t n = SHCD_COUNT(degree);
    double *a = malloc(3 * 2 * n * sizeof *a);
    bool good = a != NULL;
    for (size_t k = 0; good && k < 3; k++) {
        good = shcd_coefficients_to_complex(degree, c + k, 3, a + 2 * n * k) == SHCD_OK;
    }
    if (good) {
        fputs("l,m,x_re,x_im,y_re,y_im,z_re,z_im\n", file);
        for (int l = 0; l <= degree; l++) {
            for (int m = -l; m <= l; m++) {
                const double *v = a + 2 * SHCD_INDEX(l, m);
                fprintf(file, "%d,%d,%.17g,%.17g,%.17g,%.17g,%.17g,%.17g\n", l, m, v[0], v[1],
                        v[2 * n], v[2 * n + 1], v[4 * n], v[4 * n + 1]);
            }
        }
    }
    free(a);
    return good;
}

static bool write_table(const shcd_model *model, const char *path, bool as_complex) {
    output_file output;
    if (!output_open(&output, path)) {
        return false;
    }
    const int degree = shcd_model_degree(model);
    const double *c = shcd_model_coefficients(model);
    if (!as_complex) {
        write_real(output.file, degree, c);
    } else if (!write_complex(output.file, degree, c)) {
        output_abandon(&output);
        report_failure("%s", shcd_status_string(SHCD_ERR_MEMORY));
        return false;
    }
    return output_finish(&output) && output_publish(&output);
}

int command_coefficients(int argc, char **argv) {
    arguments a;
    const char *path = "-";
    bool as_complex = false;
    int key;
    arguments_begin(&a, argc, argv);
    while ((key = arguments_next(&a)) > 0) {
        if (key == OPTION_OUTPUT) {
            path = a.value;
        } else {
            as_complex = true;
        }
    }
    if (key != ARGUMENTS_END) {
        return arguments_status(key);
    }
    const char *body = arguments_operand(&a, "BODY.shcd");
    if (body == NULL) {
        return STATUS_USAGE;
    }
    if (output_same(body, path)) {
        return report_failure("%s: the output would overwrite the input", path);
    }
    shcd_model *model = body_load(body);
    if (model == NULL) {
        return STATUS_FAILED;
    }
    const bool written = write_table(model, path, as_complex);
    shcd_model_free(model);
    return written ? STATUS_DONE : STATUS_FAILED;
}
