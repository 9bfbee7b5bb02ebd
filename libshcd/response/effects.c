/* SPDX-License-Identifier: BSD-3-Clause */
/* The static table of effects, and the resolution of a body's effects by name. */
#include "response/effects.h"

#include "response/scene_private.h"

#include <string.h>

/* In the order of application: damping scales what the elastic effects before it gave. */
static const shcdi_effect *const effect_table[] = {
    &shcdi_effect_stiffness,
    &shcdi_effect_damping,
};
#define N_EFFECTS (sizeof effect_table / sizeof effect_table[0])
#define PARAMETERS_MAX 8

_Static_assert(N_EFFECTS <= SHCDI_EFFECTS_MAX, "the dense arrays hold the whole table");

const shcd_effect_info *shcd_effect_at(size_t index) {
    return index < N_EFFECTS ? &effect_table[index]->info : NULL;
}

static size_t find_effect(const char *name) {
    size_t e = 0;
    while (e < N_EFFECTS && strcmp(effect_table[e]->info.name, name) != 0) {
        e++;
    }
    return e;
}

static size_t find_parameter(const shcd_effect_info *info, const char *name) {
    size_t i = 0;
    while (i < info->n_parameters && strcmp(info->parameters[i].name, name) != 0) {
        i++;
    }
    return i;
}

static shcd_status check_range(const char *body, const shcd_effect_info *info,
                               const shcd_parameter_info *parameter, double value,
                               shcd_error *error) {
    const bool has_unit = strcmp(parameter->unit, "1") != 0;
    if (!shcdi_is_finite(value)) {
        return shcdi_fail(error, SHCD_ERR_NOT_FINITE,
                          "scene_create: body '%s': effect '%s': parameter '%s' is not finite",
                          body, info->name, parameter->name);
    }
    if (value < parameter->min_value || value > parameter->max_value) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: body '%s': effect '%s': parameter '%s' is %g, must lie "
                          "in %g .. %g%s%s",
                          body, info->name, parameter->name, value, parameter->min_value,
                          parameter->max_value, has_unit ? " " : "",
                          has_unit ? parameter->unit : "");
    }
    return SHCD_OK;
}

/* Values of all parameters of one effect: the defaults, then what the definition names. */
static shcd_status read_values(const char *body, const shcd_effect_info *info,
                               const shcd_effect_def *definition, double *values,
                               shcd_error *error) {
    bool given[PARAMETERS_MAX] = {false};
    shcd_status status;
    for (size_t i = 0; i < info->n_parameters; i++) {
        values[i] = info->parameters[i].default_value;
    }
    if (definition->n_parameters > 0 && definition->parameters == NULL) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: body '%s': effect '%s': parameters is null", body,
                          info->name);
    }
    for (size_t k = 0; k < definition->n_parameters; k++) {
        const shcd_parameter_value *p = &definition->parameters[k];
        const size_t i = p->name != NULL ? find_parameter(info, p->name) : info->n_parameters;
        if (i == info->n_parameters) {
            return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                              "scene_create: body '%s': effect '%s': unknown parameter '%.40s'",
                              body, info->name, p->name != NULL ? p->name : "(null)");
        }
        if (given[i]) {
            return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                              "scene_create: body '%s': effect '%s': parameter '%s' is given twice",
                              body, info->name, p->name);
        }
        status = check_range(body, info, &info->parameters[i], p->value, error);
        if (status != SHCD_OK) {
            return status;
        }
        given[i] = true;
        values[i] = p->value;
    }
    return SHCD_OK;
}

shcd_status shcdi_effects_resolve(const char *body, const shcd_effect_def *definitions,
                                  size_t n_definitions, shcdi_active_effect *active,
                                  size_t *n_active, size_t *state_bytes, shcd_error *error) {
    const shcd_effect_def *named[SHCDI_EFFECTS_MAX] = {NULL};
    size_t n = 0;
    size_t bytes = 0;
    if (n_definitions > 0 && definitions == NULL) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, "scene_create: body '%s': effects is null",
                          body);
    }
    for (size_t k = 0; k < n_definitions; k++) {
        const char *name = definitions[k].name;
        const size_t e = name != NULL ? find_effect(name) : N_EFFECTS;
        if (e == N_EFFECTS) {
            return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                              "scene_create: body '%s': unknown effect '%.40s'", body,
                              name != NULL ? name : "(null)");
        }
        if (named[e] != NULL) {
            return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                              "scene_create: body '%s': effect '%s' is given twice", body, name);
        }
        named[e] = &definitions[k];
    }
    for (size_t e = 0; e < N_EFFECTS; e++) {
        const shcdi_effect *effect = effect_table[e];
        double values[PARAMETERS_MAX];
        shcd_status status;
        if (named[e] == NULL) {
            continue;
        }
        status = read_values(body, &effect->info, named[e], values, error);
        if (status != SHCD_OK) {
            return status;
        }
        memset(&active[n], 0, sizeof active[n]);
        active[n].effect = effect;
        active[n].state_offset = bytes;
        effect->prepare(values, active[n].constants);
        bytes += (effect->state_bytes + 7) / 8 * 8;
        n++;
    }
    *n_active = n;
    *state_bytes = bytes;
    return SHCD_OK;
}
