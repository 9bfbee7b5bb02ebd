/* SPDX-License-Identifier: BSD-3-Clause */
#include "scene_stiffness.h"

#include <math.h>
#include <string.h>

#define DEPTHS 16

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

/* ---- learned --------------------------------------------------------------------------------- */

static double scale_of(const shcd_body_def *body) {
    for (size_t e = 0; e < body->n_effects; e++) {
        const shcd_effect_def *effect = &body->effects[e];
        for (size_t k = 0; k < effect->n_parameters && strcmp(effect->name, "learned") == 0; k++) {
            if (strcmp(effect->parameters[k].name, "scale") == 0) {
                return effect->parameters[k].value;
            }
        }
    }
    return 1.0;
}

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

bool scene_stiffness_check_learned(const yaml_tree *tree, const yaml_node *effects,
                                   const shcd_body_def *body, const scene_device *device) {
    const yaml_node *effect = child(effects, "learned");
    const shcd_learned *l = shcd_model_learned(body->model);
    const double scale = scale_of(body), limit = device->stiffness_limit_n_per_m;
    if (effect == NULL || l == NULL || !(scale > 0.0)) {
        return true; /* a body without a network is refused by shcd_scene_create() */
    }
    double k = l->record.stiffness_max_n_per_m;
    for (size_t j = 0; j < l->n_centres; j++) {
        k = fmax(k, stiffest_at(l, l->centre_m + 3 * j, device->profile->force_max_n / scale));
    }
    if (scale * k <= limit) {
        return true;
    }
    return yaml_fail(tree, place_of(effect, "scale"),
                     "its model was trained to be up to %.4g N/m stiff, times %.4g, and device %s "
                     "renders %.6g N/m at most; give a scale of at most %.3g, or train with a "
                     "softer tissue",
                     k, scale, device->profile->name, limit, 0.999 * limit / k);
}

/* ---- wave ------------------------------------------------------------------------------------ */

bool scene_stiffness_check_wave(const yaml_tree *tree, const yaml_node *effects,
                                const shcd_scene *scene, size_t body, const scene_device *device) {
    const yaml_node *effect = child(effects, "wave");
    const double limit = device->stiffness_limit_n_per_m, dt_s = 1.0 / device->rate_hz;
    double tick = 0.0, held = 0.0;
    if (effect == NULL || child(effects, "stiffness") != NULL ||
        shcd_scene_wave_stiffness(scene, body, dt_s, &tick, &held) != SHCD_OK ||
        fmax(tick, held) <= limit) {
        return true;
    }
    return yaml_fail(tree, place_of(effect, "youngs_modulus_pa"),
                     "is %.4g N/m to a motion within a tick of %.4g ms, by inertia and the modes "
                     "left out (%.4g N/m held), and device %s renders %.6g N/m at most; put a "
                     "stiffness beside it, or make the patch smaller",
                     tick, 1e3 * dt_s, held, device->profile->name, limit);
}
