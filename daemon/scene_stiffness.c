/* SPDX-License-Identifier: BSD-3-Clause */
#include "scene_stiffness.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define DEPTHS 16
#define SUGGESTIONS_MAX 100

/* The child of a map under that key; NULL: none. */
static const yaml_node *child(const yaml_node *map, const char *name) {
    const yaml_node *node = map != NULL ? map->first : NULL;
    while (node != NULL && strcmp(node->key->text, name) != 0) {
        node = node->next;
    }
    return node;
}

/* Where a complaint about a parameter goes: its value, or the effect if the default is meant. */
static const yaml_node *place_of(const yaml_node *effect, const char *name) {
    const yaml_node *parameter = child(effect, name);
    return parameter != NULL ? parameter : effect;
}

/* A parameter of one of the body's effects: as given, or the library's default. */
static double value_of(const shcd_body_def *body, const char *effect, const char *name) {
    const shcd_effect_info *info = NULL;
    double value = 0.0;
    for (size_t e = 0; (info = shcd_effect_at(e)) != NULL; e++) {
        for (size_t i = 0; i < info->n_parameters && strcmp(info->name, effect) == 0; i++) {
            if (strcmp(info->parameters[i].name, name) == 0) {
                value = info->parameters[i].default_value;
            }
        }
    }
    for (size_t e = 0; e < body->n_effects; e++) {
        const shcd_effect_def *def = &body->effects[e];
        for (size_t k = 0; k < def->n_parameters && strcmp(def->name, effect) == 0; k++) {
            if (strcmp(def->parameters[k].name, name) == 0) {
                value = def->parameters[k].value;
            }
        }
    }
    return value;
}

/* ---- learned --------------------------------------------------------------------------------- */

/* At one centre, as far as the network's own force of that size. */
static double stiffest_at(const shcd_learned *l, const double *centre_m, double force_n) {
    const shcd_vec3 x = {centre_m[0], centre_m[1], centre_m[2]};
    double k = 0.0;
    for (int i = 0; i <= DEPTHS; i++) {
        shcd_learned_output out;
        const double depth_m = l->depth_max_m * fmax(i, 1e-3) / DEPTHS;
        if (shcd_learned_evaluate(l, x, depth_m, &out) != SHCD_OK) {
            return HUGE_VAL; /* no number: nothing that a device could render */
        }
        k = fmax(k, out.stiffness_n_per_m);
        if (out.force_n > force_n) {
            return k;
        }
    }
    return fmax(k, l->direct_n_per_m);
}

/* Wherever the training looked, and at the centres as far as the device's force at that scale. */
static double stiffest_of(const shcd_learned *l, double scale, double force_max_n) {
    double k = l->record.stiffness_max_n_per_m;
    for (size_t j = 0; j < l->n_centres; j++) {
        k = fmax(k, stiffest_at(l, l->centre_m + 3 * j, force_max_n / scale));
    }
    return k;
}

/* A scale of three digits that is accepted, as text. The less the scale, the deeper the device's
 * force reaches and the stiffer it finds the network: the scales that follow from each other only
 * fall. */
static void suggest(const shcd_learned *l, double scale, const scene_device *device,
                    char text[32]) {
    const double limit = device->stiffness_limit_n_per_m, force_n = device->profile->force_max_n;
    bool is_good = false;
    for (int n = 0; n < SUGGESTIONS_MAX && !is_good && scale > 0.0; n++) {
        const double most = fmin(scale, limit / stiffest_of(l, scale, force_n));
        const double unit = pow(10.0, floor(log10(most)) - 2.0);
        /* what is three digits already stays, but for its rounding */
        (void)snprintf(text, 32, "%.3g", floor(most / unit * (1.0 + 1e-12)) * unit);
        scale = strtod(text, NULL);
        is_good = scale > 0.0 && scale * stiffest_of(l, scale, force_n) <= limit;
        scale *= is_good ? 1.0 : 0.999;
    }
}

bool scene_stiffness_check_learned(const yaml_tree *tree, const yaml_node *effects,
                                   const shcd_body_def *body, const scene_device *device) {
    const yaml_node *effect = child(effects, "learned");
    const shcd_learned *l = shcd_model_learned(body->model);
    const double scale = value_of(body, "learned", "scale");
    const double limit = device->stiffness_limit_n_per_m;
    char text[32] = "0";
    if (effect == NULL || l == NULL || !(scale > 0.0)) {
        return true; /* a body without a network is refused by shcd_scene_create() */
    }
    const double k = stiffest_of(l, scale, device->profile->force_max_n);
    if (scale * k <= limit) {
        return true;
    }
    suggest(l, scale, device, text);
    return yaml_fail(tree, place_of(effect, "scale"),
                     "its model was trained to be up to %.4g N/m stiff, times %.4g, and device %s "
                     "renders %.6g N/m at most; give a scale of at most %s, or train with a "
                     "softer tissue",
                     k, scale, device->profile->name, limit, text);
}

/* ---- wave ------------------------------------------------------------------------------------ */

/* A Hertz contact takes for itself only what it gives way more than the membrane's patch p does,
 * 1/k - 1/(2 E* p), and is rigid from the force on at which k = 2 E* p (effects/stiffness.c): the
 * wave lies in series with that and comes to be alone. k rises with the force, so that the device's
 * largest is where the contact is stiffest. Its own k without the wave is held by itself. */
static double beside_hertz(const scene_law *law, double tool_radius_m, double force_n,
                           double patch_m, double wave_n_per_m) {
    const double own = scene_law_stiffness(law, tool_radius_m, force_n);
    const double rest = fmax(0.0, 1.0 / own - 1.0 / (2.0 * law->modulus_pa * patch_m));
    return 1.0 / (rest + 1.0 / wave_n_per_m);
}

bool scene_stiffness_check_wave(const yaml_tree *tree, const yaml_node *effects,
                                const shcd_scene *scene, size_t body, const shcd_body_def *def,
                                const scene_law *law, double tool_radius_m,
                                const scene_device *device) {
    const yaml_node *effect = child(effects, "wave");
    const double limit = device->stiffness_limit_n_per_m, dt_s = 1.0 / device->rate_hz;
    const double force_n = device->profile->force_max_n;
    const bool is_hertz = law->modulus_pa > 0.0;
    double tick = 0.0, held = 0.0;
    if (effect == NULL || (law->node != NULL && !is_hertz) ||
        shcd_scene_wave_stiffness(scene, body, dt_s, &tick, &held) != SHCD_OK ||
        fmax(tick, held) <= limit) {
        return true;
    }
    if (!is_hertz) {
        return yaml_fail(tree, place_of(effect, "youngs_modulus_pa"),
                         "is %.4g N/m to a motion within a tick of %.4g ms, by inertia and the "
                         "modes left out (%.4g N/m held), and device %s renders %.6g N/m at most; "
                         "put a linear stiffness beside it, or make the patch smaller",
                         tick, 1e3 * dt_s, held, device->profile->name, limit);
    }
    const double k = beside_hertz(law, tool_radius_m, force_n,
                                  value_of(def, "wave", "patch_radius_m"), fmax(tick, held));
    return k <= limit ||
           yaml_fail(tree, place_of(effect, "youngs_modulus_pa"),
                     "is %.4g N/m beside the Hertz law of stiffness, to a motion within a tick of "
                     "%.4g ms at %.9g N, and device %s renders %.6g N/m at most; make it softer, "
                     "or the patch larger than the contact",
                     k, 1e3 * dt_s, force_n, device->profile->name, limit);
}

double scene_stiffness_of(const yaml_node *effects, const shcd_scene *scene, size_t body,
                          const shcd_body_def *def, const scene_law *law, double tool_radius_m,
                          const scene_device *device) {
    const shcd_learned *l = shcd_model_learned(def->model);
    const double scale = value_of(def, "learned", "scale");
    double sum = 0.0, tick, held;
    if (law->node != NULL) {
        sum += scene_law_stiffness(law, tool_radius_m, device->profile->force_max_n);
    }
    if (child(effects, "learned") != NULL && l != NULL && scale > 0.0) {
        sum += scale * stiffest_of(l, scale, device->profile->force_max_n);
    }
    if (sum == 0.0 &&
        shcd_scene_wave_stiffness(scene, body, 1.0 / device->rate_hz, &tick, &held) == SHCD_OK) {
        sum = fmax(tick, held);
    }
    return sum;
}
