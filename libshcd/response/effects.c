/* SPDX-License-Identifier: BSD-3-Clause */
/* The static table of effects, and the resolution of a body's effects by name. */
#include "response/effects.h"

#include "response/scene_private.h"

#include <stdio.h>
#include <string.h>

/* A build may leave effects out of the table (CMake: SHCD_EFFECTS), to prove that those a scene
 * does not call for cost it nothing. */
#ifdef SHCD_EFFECTS_CHOSEN
#else
#define SHCD_EFFECT_TEXTURE
#define SHCD_EFFECT_STIFFNESS
#define SHCD_EFFECT_LEARNED
#define SHCD_EFFECT_WAVE
#define SHCD_EFFECT_PULSE
#define SHCD_EFFECT_DAMPING
#define SHCD_EFFECT_RELAXATION
#define SHCD_EFFECT_FRICTION
#define SHCD_EFFECT_VISCOSITY
#endif

/* In the order of application: each works on what those before it left. Friction takes its share of
 * what damping and relaxation have left of the normal force. */
static const shcdi_effect *const effect_table[] = {
#ifdef SHCD_EFFECT_TEXTURE
    &shcdi_effect_texture,
#endif
#ifdef SHCD_EFFECT_STIFFNESS
    &shcdi_effect_stiffness,
#endif
#ifdef SHCD_EFFECT_LEARNED
    &shcdi_effect_learned,
#endif
#ifdef SHCD_EFFECT_WAVE
    &shcdi_effect_wave,
#endif
#ifdef SHCD_EFFECT_PULSE
    &shcdi_effect_pulse,
#endif
#ifdef SHCD_EFFECT_DAMPING
    &shcdi_effect_damping,
#endif
#ifdef SHCD_EFFECT_RELAXATION
    &shcdi_effect_relaxation,
#endif
#ifdef SHCD_EFFECT_FRICTION
    &shcdi_effect_friction,
#endif
#ifdef SHCD_EFFECT_VISCOSITY
    &shcdi_effect_viscosity,
#endif
};
#define N_EFFECTS (sizeof effect_table / sizeof effect_table[0])

_Static_assert(N_EFFECTS <= SHCDI_EFFECTS_MAX, "the dense arrays hold the whole table");

static const struct {
    const shcdi_effect *effect;
    shcdi_settle *settle;
} settlers[] = {
    {&shcdi_effect_texture, shcdi_settle_texture},
    {&shcdi_effect_stiffness, shcdi_settle_stiffness},
    {&shcdi_effect_relaxation, shcdi_settle_relaxation},
    {&shcdi_effect_friction, shcdi_settle_friction},
    {&shcdi_effect_viscosity, shcdi_settle_viscosity},
};

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

/* ---- values --------------------------------------------------------------------------------- */

/* Where a value stands, for the messages. */
typedef struct place {
    const char *body;
    const shcd_effect_info *info;
    const shcd_parameter_info *parameter;
    const shcd_column_info *column; /* of a table; else NULL */
    size_t row;
} place;

static shcd_status check_range(const place *at, double value, double min, double max,
                               const char *unit, shcd_error *error) {
    const bool has_unit = strcmp(unit, "1") != 0;
    char where[96] = "";
    if (at->column != NULL) {
        (void)snprintf(where, sizeof where, ": row %zu: %s", at->row, at->column->name);
    }
    if (!shcdi_is_finite(value)) {
        return shcdi_fail(error, SHCD_ERR_NOT_FINITE,
                          "scene_create: body '%s': effect '%s': parameter '%s'%s is not finite",
                          at->body, at->info->name, at->parameter->name, where);
    }
    if (value < min || value > max) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: body '%s': effect '%s': parameter '%s'%s is %g, must lie "
                          "in %g .. %g%s%s",
                          at->body, at->info->name, at->parameter->name, where, value, min, max,
                          has_unit ? " " : "", has_unit ? unit : "");
    }
    return SHCD_OK;
}

static shcd_status check_table(place *at, const shcd_parameter_value *given, shcd_error *error) {
    const shcd_parameter_info *p = at->parameter;
    if (given->table == NULL || given->n_rows < p->n_rows_min || given->n_rows > p->n_rows_max) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: body '%s': effect '%s': parameter '%s' is a table of %zu "
                          ".. %zu rows; %zu are given",
                          at->body, at->info->name, p->name, p->n_rows_min, p->n_rows_max,
                          given->table != NULL ? given->n_rows : (size_t)0);
    }
    for (at->row = 0; at->row < given->n_rows; at->row++) {
        const double *row = given->table + at->row * p->n_columns;
        for (size_t c = 0; c < p->n_columns; c++) {
            at->column = &p->columns[c];
            const shcd_status status = check_range(at, row[c], at->column->min_value,
                                                   at->column->max_value, at->column->unit, error);
            if (status != SHCD_OK) {
                return status;
            }
        }
        if (at->row > 0 && row[0] <= row[0 - (ptrdiff_t)p->n_columns]) {
            return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                              "scene_create: body '%s': effect '%s': parameter '%s': row %zu: %s "
                              "must be above that of the row before",
                              at->body, at->info->name, p->name, at->row, p->columns[0].name);
        }
    }
    return SHCD_OK;
}

static shcd_status read_value(const char *body, const shcd_effect_info *info, size_t i,
                              const shcd_parameter_value *given, shcdi_settings *settings,
                              shcd_error *error) {
    const shcd_parameter_info *p = &info->parameters[i];
    place at = {body, info, p, NULL, 0};
    const shcd_status status = p->columns != NULL ? check_table(&at, given, error)
                                                  : check_range(&at, given->value, p->min_value,
                                                                p->max_value, p->unit, error);
    if (status == SHCD_OK) {
        settings->is_given[i] = true;
        settings->value[i] = p->columns != NULL ? 0.0 : given->value;
        settings->table[i] = p->columns != NULL ? given->table : NULL;
        settings->n_rows[i] = p->columns != NULL ? given->n_rows : 0;
    }
    return status;
}

/* Values of all parameters of one effect: the defaults, then what the definition names. */
static shcd_status read_values(const char *body, const shcd_effect_info *info,
                               const shcd_effect_def *definition, shcdi_settings *settings,
                               shcd_error *error) {
    memset(settings, 0, sizeof *settings);
    for (size_t i = 0; i < info->n_parameters; i++) {
        settings->value[i] = info->parameters[i].default_value;
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
        if (settings->is_given[i]) {
            return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                              "scene_create: body '%s': effect '%s': parameter '%s' is given twice",
                              body, info->name, p->name);
        }
        const shcd_status status = read_value(body, info, i, p, settings, error);
        if (status != SHCD_OK) {
            return status;
        }
    }
    return SHCD_OK;
}

static shcd_status settle(const char *body, const shcdi_effect *effect,
                          const shcdi_settings *settings, double *constants, shcd_error *error) {
    for (size_t i = 0; i < sizeof settlers / sizeof settlers[0]; i++) {
        if (settlers[i].effect == effect) {
            return settlers[i].settle(body, settings, constants, error);
        }
    }
    return SHCD_OK;
}

/* ---- a body's effects ------------------------------------------------------------------------ */

/* Finds the definition of each effect of the table that the body names. */
static shcd_status find_named(const char *body, const shcd_effect_def *definitions,
                              size_t n_definitions, const shcd_effect_def **named,
                              shcd_error *error) {
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
    return SHCD_OK;
}

/* Radius of the patch on which the membrane of `wave` takes a force up; 0: a rigid body. */
static double patch_radius(const shcdi_active_effect *active, size_t n) {
    for (size_t e = 0; e < n; e++) {
        if (active[e].effect == &shcdi_effect_wave) {
            return active[e].constants[SHCDI_WAVE_PATCH];
        }
    }
    return 0.0;
}

shcd_status shcdi_effects_resolve(const char *body, const shcd_effect_def *definitions,
                                  size_t n_definitions, shcdi_active_effect *active,
                                  size_t *n_active, size_t *state_bytes, shcd_error *error) {
    const shcd_effect_def *named[SHCDI_EFFECTS_MAX] = {NULL};
    size_t n = 0;
    size_t bytes = 0;
    shcd_status status = find_named(body, definitions, n_definitions, named, error);
    for (size_t e = 0; status == SHCD_OK && e < N_EFFECTS; e++) {
        const shcdi_effect *effect = effect_table[e];
        shcdi_settings settings;
        if (named[e] == NULL) {
            continue;
        }
        status = read_values(body, &effect->info, named[e], &settings, error);
        if (status != SHCD_OK) {
            break;
        }
        memset(&active[n], 0, sizeof active[n]);
        active[n].effect = effect;
        active[n].state_offset = bytes;
        effect->prepare(settings.value, active[n].constants);
        status = settle(body, effect, &settings, active[n].constants, error);
        bytes += (effect->state_bytes + 7) / 8 * 8;
        n++;
    }
    if (status != SHCD_OK) {
        return status;
    }
    for (size_t e = 0; e < n; e++) {
        if (active[e].effect->couple != NULL) {
            active[e].effect->couple(active[e].constants, patch_radius(active, n));
        }
    }
    *n_active = n;
    *state_bytes = bytes;
    return SHCD_OK;
}
