/* SPDX-License-Identifier: BSD-3-Clause */
/* Materials that a body of a scene may be made of: `material: liver`. A material gives defaults to
 * those parameters of effects that describe tissue, with the source of its figures. */
#ifndef SHCDD_MATERIALS_H
#define SHCDD_MATERIALS_H

#include "yaml_value.h"

typedef struct material {
    const char *name;
    double youngs_modulus_pa;
    double poisson_ratio;
    double density_kg_per_m3; /* 0: its source does not say */
    const char *source;
} material;

/** Ended by a null name. */
extern const material materials[];

/** Looks up a name; complains with the known ones. */
bool material_read(const yaml_tree *tree, const yaml_node *node, const material **out);

/** What a material says about a parameter of an effect. @return false: nothing */
bool material_value(const material *of, const char *parameter, double *value);

#endif
