/* SPDX-License-Identifier: BSD-3-Clause */
/* Effects and their parameters, walked by the library's table; and how stiff and how viscous they
 * make a body. What an output chain behind the scene would cut off is refused here instead: a
 * surface that feels softer than the file says teaches nothing. */
#include "scene_effects.h"

#include "config.h"
#include "yaml_value.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define PI 3.14159265358979324
/* Radius that the library takes for a sharp tool [m]. */
#define SHARP_RADIUS_M 0.001

/* ---- stiffness ------------------------------------------------------------------------------- */

static size_t find_parameter(const shcd_effect_info *info, const char *name) {
    size_t i = 0;
    while (i < info->n_parameters && strcmp(info->parameters[i].name, name) != 0) {
        i++;
    }
    return i;
}

/* The value given, or the default; NULL for a table that is not given. */
static shcd_parameter_value value_of(const shcd_effect_info *info, const shcd_effect_def *def,
                                     const char *name) {
    const size_t i = find_parameter(info, name);
    shcd_parameter_value value = {name,
                                  i < info->n_parameters ? info->parameters[i].default_value : 0.0};
    for (size_t k = 0; k < def->n_parameters; k++) {
        if (strcmp(def->parameters[k].name, name) == 0) {
            value = def->parameters[k];
        }
    }
    return value;
}

static double steepest(const shcd_parameter_value *table) {
    double slope = 0.0, x = 0.0, y = 0.0;
    for (size_t i = 0; i < table->n_rows; i++) {
        const double *row = table->table + 2 * i;
        slope = row[0] > x ? fmax(slope, (row[1] - y) / (row[0] - x)) : slope;
        x = row[0];
        y = row[1];
    }
    return slope;
}

/* Where a complaint about a parameter goes: its value, or the effect if the default is meant. */
static const yaml_node *place_of(const shcd_effect_info *info, const yaml_field *fields,
                                 const char *name, const yaml_node *effect) {
    const size_t i = find_parameter(info, name);
    return i < info->n_parameters && fields[i].node != NULL ? fields[i].node : effect;
}

static bool read_law(const yaml_tree *tree, const yaml_node *effect, const shcd_effect_info *info,
                     const yaml_field *fields, const shcd_effect_def *def,
                     const scene_device *device, scene_law *law) {
    const shcd_parameter_value young = value_of(info, def, "youngs_modulus_pa");
    const shcd_parameter_value table = value_of(info, def, "stress_strain");
    const char *name = "k_n_per_m";
    if (table.table != NULL) {
        name = "stress_strain";
        law->pressure_slope_pa_per_m = steepest(&table) / value_of(info, def, "thickness_m").value;
        law->radius_m = value_of(info, def, "contact_radius_m").value;
    } else if (young.value > 0.0) {
        const double nu = value_of(info, def, "poisson_ratio").value;
        name = "youngs_modulus_pa";
        law->modulus_pa = young.value / (1.0 - nu * nu);
        law->radius_m = value_of(info, def, "tool_radius_m").value;
    } else {
        law->stiffness_n_per_m = value_of(info, def, name).value;
    }
    law->node = place_of(info, fields, name, effect);
    return law->stiffness_n_per_m == 0.0 ||
           scene_device_check(tree, law->node, device, law->stiffness_n_per_m);
}

/* ---- along the surface ----------------------------------------------------------------------- */

static bool check_friction(const yaml_tree *tree, const yaml_node *effect,
                           const shcd_effect_info *info, const yaml_field *fields,
                           const shcd_effect_def *def, const scene_device *device) {
    const char *name = "stiffness_n_per_m";
    return scene_device_check(tree, place_of(info, fields, name, effect), device,
                              value_of(info, def, name).value);
}

/* The force along a relief h is N grad h, so N times the curvature of h is a stiffness: that of a
 * sine A sin kx is A k^2, that of the bumps' three sines of A/3 along one axis a third of it. */
static bool check_texture(const yaml_tree *tree, const yaml_node *effect,
                          const shcd_effect_info *info, const yaml_field *fields,
                          const shcd_effect_def *def, const scene_device *device) {
    const double number = 2.0 * PI / value_of(info, def, "wavelength_m").value;
    const double share = value_of(info, def, "pattern").value == 0.0 ? 1.0 / 3.0 : 1.0;
    const double curvature = share * value_of(info, def, "amplitude_m").value * number * number;
    const double force_n = device->profile->force_max_n;
    const double limit = device->stiffness_limit_n_per_m;
    if (force_n * curvature <= limit) {
        return true;
    }
    return yaml_fail(tree, place_of(info, fields, "amplitude_m", effect),
                     "the relief is %.4g N/m along the surface at the %.9g N of device %s, which "
                     "renders %.6g N/m at most; lower it to about %.2g m, or lengthen the wave",
                     force_n * curvature, force_n, device->profile->name, limit,
                     limit / (force_n * share * number * number));
}

static bool check_viscosity(const yaml_tree *tree, const yaml_node *effect,
                            const shcd_effect_info *info, const yaml_field *fields,
                            const shcd_effect_def *def, const scene_device *device,
                            scene_law *law) {
    const char *name = "damping_n_s_per_m";
    law->viscosity_pa_s = value_of(info, def, "viscosity_pa_s").value;
    law->drag_node =
        place_of(info, fields, law->viscosity_pa_s > 0.0 ? "viscosity_pa_s" : name, effect);
    return law->viscosity_pa_s > 0.0 || scene_device_check_drag(tree, law->drag_node, device, NULL,
                                                                value_of(info, def, name).value);
}

/* Stiffness of the membrane under its patch [N/m]. By its default thickness it is the half-space's,
 * 2 E* a. By one of its own it is 4 pi G h/(e^x E1(x)), x = (a/(2 l))^2, and e^x E1(x) > ln(1 +
 * 2/x)/2 (Abramowitz and Stegun, 5.1.20) makes that at most 8 pi G h/ln(1 + 2/x). Anchors that
 * replace the foundation, l = 0, count as none: the bound is 0. */
static double wave_stiffness(const shcd_effect_info *info, const shcd_effect_def *def) {
    const double nu = value_of(info, def, "poisson_ratio").value;
    const double young_pa = value_of(info, def, "youngs_modulus_pa").value;
    const double patch_m = value_of(info, def, "patch_radius_m").value;
    const double thickness_m = value_of(info, def, "thickness_m").value;
    const double reach = 2.0 * value_of(info, def, "support_length_m").value / patch_m;
    if (thickness_m == 0.0) {
        return 2.0 * young_pa / (1.0 - nu * nu) * patch_m;
    }
    return reach > 0.0
               ? 8.0 * PI * young_pa / (2.0 * (1.0 + nu)) * thickness_m / log1p(2.0 * reach * reach)
               : 0.0;
}

/* A linear or tabulated law is in series with the membrane, and has been held against the device by
 * itself; a Hertz law takes tools and modes to be held together with it (scene_stiffness.c). */
static bool check_wave(const yaml_tree *tree, const yaml_node *effect, const shcd_effect_info *info,
                       const yaml_field *fields, const shcd_effect_def *def,
                       const scene_device *device, const scene_law *law) {
    const double k = wave_stiffness(info, def);
    if (law->node != NULL || k <= device->stiffness_limit_n_per_m) {
        return true;
    }
    return yaml_fail(tree, place_of(info, fields, "youngs_modulus_pa", effect),
                     "is %.4g N/m under a press, and device %s renders %.6g N/m at most; put a "
                     "linear stiffness beside it, or make the patch smaller",
                     k, device->profile->name, device->stiffness_limit_n_per_m);
}

/* What the device has to say about an effect. */
static bool check_effect(const yaml_tree *tree, const yaml_node *node, const shcd_effect_info *info,
                         const yaml_field *fields, const shcd_effect_def *def,
                         const scene_device *device, scene_law *law) {
    if (strcmp(info->name, "stiffness") == 0) {
        return read_law(tree, node, info, fields, def, device, law);
    }
    if (strcmp(info->name, "friction") == 0) {
        return check_friction(tree, node, info, fields, def, device);
    }
    if (strcmp(info->name, "texture") == 0) {
        return check_texture(tree, node, info, fields, def, device);
    }
    if (strcmp(info->name, "wave") == 0) {
        return check_wave(tree, node, info, fields, def, device, law);
    }
    return strcmp(info->name, "viscosity") != 0 ||
           check_viscosity(tree, node, info, fields, def, device, law);
}

/* ---- with a tool ------------------------------------------------------------------------------
 */

/* Hertz: dF/ddepth = 2 E* a with F = 4 E* a^3/(3 R), so (6 R F E*^2)^(1/3). */
double scene_law_stiffness(const scene_law *law, double tool_radius_m, double force_n) {
    const double own = tool_radius_m > 0.0 ? tool_radius_m : SHARP_RADIUS_M;
    const double radius = law->radius_m > 0.0 ? law->radius_m : own;
    if (law->pressure_slope_pa_per_m > 0.0) {
        return law->pressure_slope_pa_per_m * PI * radius * radius;
    }
    return law->modulus_pa > 0.0 ? cbrt(6.0 * radius * force_n * law->modulus_pa * law->modulus_pa)
                                 : law->stiffness_n_per_m;
}

bool scene_law_check(const yaml_tree *tree, const scene_law *law, const scene_device *device,
                     const char *tool, double tool_radius_m) {
    const double force_n = device->profile->force_max_n;
    const double k = scene_law_stiffness(law, tool_radius_m, force_n);
    const double radius_m = tool_radius_m > 0.0 ? tool_radius_m : SHARP_RADIUS_M;
    if (!scene_device_check_drag(tree, law->drag_node, device, tool,
                                 6.0 * PI * law->viscosity_pa_s * radius_m)) {
        return false;
    }
    if (k <= device->stiffness_limit_n_per_m) {
        return true;
    }
    return yaml_fail(tree, law->node,
                     "is %.4g N/m for tool '%s' at the %.9g N of device %s, which renders %.9g N/m "
                     "at most",
                     k, tool, force_n, device->profile->name, device->stiffness_limit_n_per_m);
}

/* ---- tables ---------------------------------------------------------------------------------- */

static bool read_table(yaml_tree *tree, const yaml_node *node, const shcd_parameter_info *p,
                       shcd_parameter_value *value) {
    if (!yaml_list(tree, node, "rows", p->n_rows_min, p->n_rows_max)) {
        return false;
    }
    double *table = yaml_allocate(tree, node->count * p->n_columns * sizeof *table);
    if (table == NULL) {
        return false;
    }
    for (const yaml_node *row = node->first; row != NULL; row = row->next) {
        if (!yaml_list(tree, row, "values", p->n_columns, p->n_columns)) {
            return false;
        }
        for (const yaml_node *item = row->first; item != NULL; item = item->next) {
            const shcd_column_info *column = &p->columns[item->index];
            if (!yaml_number(tree, item, column->min_value, column->max_value, column->unit,
                             &table[row->index * p->n_columns + item->index])) {
                return false;
            }
        }
        const double *now = table + row->index * p->n_columns;
        if (row->index > 0 && now[0] <= *(now - p->n_columns)) {
            return yaml_fail(tree, row->first, "%s must be above that of the row before, %.9g",
                             p->columns[0].name, *(now - p->n_columns));
        }
    }
    value->table = table;
    value->n_rows = node->count;
    return true;
}

/* ---- materials ------------------------------------------------------------------------------- */

/* What a body is made of, and whether it has an effect that asks. */
typedef struct substance {
    const material *tissue; /* NULL: the file does not say */
    bool is_used;
} substance;

static bool read_number(const yaml_tree *tree, const yaml_node *node, const shcd_parameter_info *p,
                        const substance *of, double *value) {
    if (node->kind == YAML_SCALAR && yaml_equals(node, "material") && of->tissue != NULL &&
        material_value(of->tissue, p->name, value)) {
        return true;
    }
    return yaml_number(tree, node, p->min_value, p->max_value, p->unit, value);
}

/* `wave` is tissue in any case, `stiffness` by the Hertz law only. */
static bool is_tissue(const shcd_effect_info *info, const shcd_effect_def *def) {
    return strcmp(info->name, "wave") == 0 ||
           (strcmp(info->name, "stiffness") == 0 &&
            value_of(info, def, "youngs_modulus_pa").value > 0.0);
}

static void fill_in(const shcd_effect_info *info, const yaml_field *fields, substance *of,
                    shcd_parameter_value *values, shcd_effect_def *def) {
    if (!is_tissue(info, def)) {
        return;
    }
    of->is_used = true;
    for (size_t i = 0; i < info->n_parameters; i++) {
        const char *name = info->parameters[i].name;
        shcd_parameter_value value = {.name = name};
        if (fields[i].node == NULL && material_value(of->tissue, name, &value.value)) {
            values[def->n_parameters++] = value;
        }
    }
}

/* ---- the map --------------------------------------------------------------------------------- */

static bool read_effect(yaml_tree *tree, const yaml_node *node, const shcd_effect_info *info,
                        const scene_device *device, substance *of, shcd_effect_def *def,
                        scene_law *law) {
    const size_t n = info->n_parameters;
    yaml_field *fields = yaml_allocate(tree, (n + 1) * sizeof *fields);
    shcd_parameter_value *values = yaml_allocate(tree, (n + 1) * sizeof *values);
    if (fields == NULL || values == NULL) {
        return false;
    }
    for (size_t i = 0; i < n; i++) {
        fields[i].name = info->parameters[i].name;
    }
    if (!yaml_fields(tree, node, "parameter", fields, n)) {
        return false;
    }
    def->name = info->name;
    def->parameters = values;
    for (size_t i = 0; i < n; i++) {
        const shcd_parameter_info *p = &info->parameters[i];
        shcd_parameter_value *value = &values[def->n_parameters];
        if (fields[i].node == NULL) {
            continue;
        }
        if (p->columns != NULL ? !read_table(tree, fields[i].node, p, value)
                               : !read_number(tree, fields[i].node, p, of, &value->value)) {
            return false;
        }
        value->name = p->name;
        def->n_parameters++;
    }
    fill_in(info, fields, of, values, def);
    return check_effect(tree, node, info, fields, def, device, law);
}

bool scene_effects_read(yaml_tree *tree, const yaml_node *node, const yaml_node *made_of,
                        const material *tissue, const scene_device *device, shcd_body_def *body,
                        scene_law *law) {
    size_t n = 0;
    substance of = {tissue, false};
    while (shcd_effect_at(n) != NULL) {
        n++;
    }
    yaml_field *fields = yaml_allocate(tree, (n + 1) * sizeof *fields);
    shcd_effect_def *effects = yaml_allocate(tree, (n + 1) * sizeof *effects);
    if (fields == NULL || effects == NULL) {
        return false;
    }
    for (size_t i = 0; i < n; i++) {
        fields[i].name = shcd_effect_at(i)->name;
    }
    if (node != NULL && !yaml_fields(tree, node, "effect", fields, n)) {
        return false;
    }
    body->effects = effects;
    for (size_t i = 0; i < n; i++) {
        if (fields[i].node == NULL) {
            continue;
        }
        if (!read_effect(tree, fields[i].node, shcd_effect_at(i), device, &of,
                         &effects[body->n_effects], law)) {
            return false;
        }
        body->n_effects++;
    }
    return tissue == NULL || of.is_used ||
           yaml_fail(tree, made_of,
                     "no effect of the body takes anything from it; wave does, and stiffness with "
                     "youngs_modulus_pa");
}

/* Points at the parameter that the message is about, if it is given: the one with whose name it
 * begins. */
static bool fail_at(const yaml_tree *tree, const yaml_node *effect, const char *message) {
    static const char word[] = "parameter ";
    const char *name =
        strncmp(message, word, sizeof word - 1) == 0 ? message + sizeof word - 1 : message;
    for (const yaml_node *p = effect->kind == YAML_MAP ? effect->first : NULL; p != NULL;
         p = p->next) {
        const size_t n = strlen(p->key->text);
        if (name[0] == '\'' && strncmp(name + 1, p->key->text, n) == 0 && name[n + 1] == '\'') {
            const char *rest = name + n + 2;
            const bool is_alone = strncmp(rest, " is ", 4) == 0 || rest[0] == ':';
            if (is_alone) {
                return yaml_fail(tree, p, "%s", rest + strspn(rest, ": "));
            }
        }
    }
    return yaml_fail(tree, effect, "%s", message);
}

/* What parameters have to do with each other only the library knows, and it names body and effect.
 */
bool scene_effects_fail(const yaml_tree *tree, const yaml_node *const *effects,
                        const shcd_body_def *bodies, size_t n_bodies, const char *message) {
    for (size_t b = 0; b < n_bodies; b++) {
        const yaml_node *node = effects[b] != NULL ? effects[b]->first : NULL;
        for (; node != NULL; node = node->next) {
            char prefix[160];
            const int n =
                snprintf(prefix, sizeof prefix,
                         "scene_create: body '%s': effect '%s': ", bodies[b].name, node->key->text);
            if (n > 0 && (size_t)n < sizeof prefix && strncmp(message, prefix, (size_t)n) == 0) {
                return fail_at(tree, node, message + n);
            }
        }
    }
    return yaml_fail(tree, NULL, "%s", message);
}
