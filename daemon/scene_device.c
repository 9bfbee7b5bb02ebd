/* SPDX-License-Identifier: BSD-3-Clause */
#include "scene_device.h"

#include "passivity.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define NAME_BYTES_MAX 63
#define RESERVE_MAX_J 10.0

static bool read_profile(yaml_tree *tree, const yaml_node *node, scene_device *out) {
    const char *name = NULL;
    char known[256] = "";
    size_t used = 0;
    if (!yaml_text(tree, node, NAME_BYTES_MAX, &name)) {
        return false;
    }
    for (const device_profile *p = device_profiles; p->name != NULL; p++) {
        if (strcmp(p->name, name) == 0) {
            out->profile = p;
            return true;
        }
        if (used < sizeof known) {
            const int n = snprintf(known + used, sizeof known - used, "%s%s",
                                   p == device_profiles ? "" : ", ", p->name);
            used += n > 0 ? (size_t)n : 0;
        }
    }
    return yaml_fail(tree, node, "unknown device '%s'; known: %s", name, known);
}

/* `off`, or a reserve; below half of the default even a full one would shorten the device's full
 * wrench (passivity_reserve_min()). */
static bool read_passivity(yaml_tree *tree, const yaml_node *node, scene_device *out) {
    yaml_field fields[] = {{"reserve_j", NULL, NULL}};
    if (yaml_equals(node, "off")) {
        out->reserve_j = HUGE_VAL;
        return true;
    }
    if (node->kind == YAML_SCALAR) {
        return yaml_fail(tree, node, "must be off, or a map like {reserve_j: 0.05}");
    }
    return yaml_fields(tree, node, "key", fields, 1) &&
           (fields[0].node == NULL || yaml_number(tree, fields[0].node, 0.5 * out->reserve_j,
                                                  RESERVE_MAX_J, "J", &out->reserve_j));
}

/* Up to as many ticks as the controller keeps balances for; never less than the device's own. */
static bool read_delay(const yaml_tree *tree, const yaml_node *node, scene_device *out) {
    const double longest_s = PASSIVITY_DELAYS_MAX / out->rate_hz;
    return yaml_number(tree, node, out->profile->delay_s, fmax(longest_s, out->profile->delay_s),
                       "s", &out->stated.delay_s);
}

bool scene_device_read(yaml_tree *tree, const yaml_node *rate, const yaml_node *device,
                       const yaml_node *delay, const yaml_node *passivity, scene_device *out) {
    out->rate_hz = CONFIG_RATE_DEFAULT_HZ;
    out->profile = &device_profiles[0];
    if ((rate != NULL &&
         !yaml_number(tree, rate, CONFIG_RATE_MIN_HZ, CONFIG_RATE_MAX_HZ, "Hz", &out->rate_hz)) ||
        (device != NULL && !read_profile(tree, device, out))) {
        return false;
    }
    out->stated = *out->profile;
    if (delay != NULL && !read_delay(tree, delay, out)) {
        return false;
    }
    /* written down in decimal, the limit itself must be allowed */
    out->stiffness_limit_n_per_m = (1.0 + 1e-9) * device_stiffness_max(&out->stated, out->rate_hz);
    out->drag_limit_n_s_per_m = (1.0 + 1e-9) * device_drag_max(&out->stated, out->rate_hz);
    out->reserve_j = device_reserve_j(&out->stated, out->rate_hz);
    return passivity == NULL || read_passivity(tree, passivity, out);
}

bool scene_device_check(const yaml_tree *tree, const yaml_node *at, const scene_device *device,
                        double k_n_per_m) {
    const device_profile *p = &device->stated;
    const double limit = device->stiffness_limit_n_per_m;
    if (k_n_per_m <= limit) {
        return true;
    }
    if (limit >= p->stiffness_max_n_per_m) {
        return yaml_fail(tree, at,
                         "%.9g N/m is more than device %s renders, must be at most %.9g N/m",
                         k_n_per_m, p->name, p->stiffness_max_n_per_m);
    }
    return yaml_fail(tree, at,
                     "%.9g N/m is not stable on device %s at %.9g Hz, must be at most %.6g N/m: "
                     "its damping of %.9g N s/m over half a tick and a delay of %.9g ms",
                     k_n_per_m, p->name, device->rate_hz, limit, p->damping_n_s_per_m,
                     1e3 * p->delay_s);
}

bool scene_device_check_drag(const yaml_tree *tree, const yaml_node *at, const scene_device *device,
                             const char *tool, double c_n_s_per_m) {
    const device_profile *p = &device->stated;
    if (c_n_s_per_m <= device->drag_limit_n_s_per_m) {
        return true;
    }
    const int late = device_delays(p, device->rate_hz);
    return yaml_fail(tree, at,
                     "%s%s%s%.6g N s/m is not stable on device %s at %.9g Hz, must be at most "
                     "%.6g N s/m: its mass of %.9g kg, and a force that comes %d tick%s late",
                     tool != NULL ? "for tool '" : "", tool != NULL ? tool : "",
                     tool != NULL ? "' " : "", c_n_s_per_m, p->name, device->rate_hz,
                     device->drag_limit_n_s_per_m, p->mass_kg, late, late == 1 ? "" : "s");
}
