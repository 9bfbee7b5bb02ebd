/* SPDX-License-Identifier: BSD-3-Clause */
#include "materials.h"

#include <stdio.h>
#include <string.h>

#define NAME_BYTES_MAX 63

/* Soft tissue is nearly incompressible, nu 0.45 to 0.499; wave takes the lower end by default, and
 * so does this table. The source states shear moduli: E = 2 (1 + nu) G. They spread: liver's by a
 * fifth within the source, from 5 to 20 kPa in E between methods; in life and in a dish they
 * differ. */
#define NU 0.45
#define TISSUE(name, shear_pa, density)                                                            \
    { (name), 2.0 * (1.0 + NU) * (shear_pa), NU, (density), "PMC6925591, table 1" }

const material materials[] = {
    TISSUE("liver", 1800.0, 1060.0),         TISSUE("diseased_liver", 19800.0, 0.0),
    TISSUE("liver_carcinoma", 23400.0, 0.0), TISSUE("stomach", 640.0, 0.0),
    TISSUE("gallbladder", 85000.0, 0.0),     TISSUE("bile_duct", 166000.0, 0.0),
    TISSUE("hepatic_artery", 210000.0, 0.0), {NULL, 0.0, 0.0, 0.0, NULL},
};

bool material_read(const yaml_tree *tree, const yaml_node *node, const material **out) {
    const char *name = NULL;
    char known[512] = "";
    size_t used = 0;
    if (!yaml_text(tree, node, NAME_BYTES_MAX, &name)) {
        return false;
    }
    for (const material *m = materials; m->name != NULL; m++) {
        if (strcmp(m->name, name) == 0) {
            *out = m;
            return true;
        }
        if (used < sizeof known) {
            const int n = snprintf(known + used, sizeof known - used, "%s%s",
                                   m == materials ? "" : ", ", m->name);
            used += n > 0 ? (size_t)n : 0;
        }
    }
    return yaml_fail(tree, node, "unknown material '%s'; known: %s", name, known);
}

bool material_value(const material *of, const char *parameter, double *value) {
    if (of == NULL) {
        return false;
    }
    const struct {
        const char *name;
        double value;
    } known[] = {{"youngs_modulus_pa", of->youngs_modulus_pa},
                 {"poisson_ratio", of->poisson_ratio},
                 {"density_kg_per_m3", of->density_kg_per_m3}};
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        if (strcmp(known[i].name, parameter) == 0 && known[i].value > 0.0) {
            *value = known[i].value;
            return true;
        }
    }
    return false;
}
