/* SPDX-License-Identifier: BSD-3-Clause */
/* Device profiles, the scene that needs no file, and the end of a configuration. */
#include "config.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define PI 3.14159265358979324

double device_stiffness_max(const device_profile *device, double rate_hz) {
    const double stable = device->damping_n_s_per_m / (0.5 / rate_hz + device->delay_s);
    return stable < device->stiffness_max_n_per_m ? stable : device->stiffness_max_n_per_m;
}

int device_delays(const device_profile *device, double rate_hz) {
    return (int)ceil(device->delay_s * rate_hz * (1.0 - 1e-9));
}

double device_drag_max(const device_profile *device, double rate_hz) {
    const double turn = PI / (2.0 * device_delays(device, rate_hz) + 1.0);
    return 2.0 * sin(0.5 * turn) * device->mass_kg * rate_hz;
}

double device_reserve_j(const device_profile *device, double rate_hz) {
    return 2.0 * (1.0 + device_delays(device, rate_hz)) *
           (device->force_max_n * device->speed_max_m_per_s +
            device->torque_max_n_m * device->turn_max_rad_per_s) /
           rate_hz;
}

/* generic: for a device of which nothing is known, so each cap is one that a small desktop device
 * stands and a hand takes without harm.
 *   force      5 N, within the peak of common desktop devices (3 to 12 N)
 *   torque     0.1 N m: that force on a lever of 2 cm, half a stylus
 *   slew       500 N/s, 0.5 N a tick at 1 kHz: the full force takes 10 ms, so that a step is a push
 *              and not a blow; the stiffest surface allowed, struck at 0.25 m/s, needs just that
 *   stiffness  2000 N/m, what damping and delay allow at 1 kHz: device_stiffness_max()
 *   damping    3 N s/m, a light grip on a small device; an assumption to be checked on yours
 *   delay      1 ms: poses wait for the tick (half of it on average, all of it at most), and
 *              messages take about 0.1 ms each way
 *   speed      2 m/s and 20 rad/s: a hand that strikes; a hand that feels moves at a tenth of it
 *   mass       45 g, what data sheets state for the apparent mass at the tip of a small desktop
 *              device (SensAble PHANTOM Omni, now 3D Systems Touch); a hand only adds to it */
const device_profile device_profiles[] = {
    {"generic", 5.0, 0.1, 500.0, 2000.0, 3.0, 1e-3, 2.0, 20.0, 0.045},
    {NULL, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0},
};

shcd_status config_ellipsoid(const double semi_axes_m[3], shcd_model **model, shcd_error *error) {
    /* Y_11, Y_1,-1 and Y_10 are sqrt(3/(4 pi)) times x, y and z */
    static const double sqrt_4pi_3 = 2.0466534158929770;
    double coefficients[3 * SHCD_COUNT(1)] = {0.0};
    coefficients[3 * SHCD_INDEX(1, 1) + 0] = sqrt_4pi_3 * semi_axes_m[0];
    coefficients[3 * SHCD_INDEX(1, -1) + 1] = sqrt_4pi_3 * semi_axes_m[1];
    coefficients[3 * SHCD_INDEX(1, 0) + 2] = sqrt_4pi_3 * semi_axes_m[2];
    shcd_model_def definition = SHCD_MODEL_DEF_INIT;
    definition.degree = 1;
    definition.coefficients = coefficients;
    return shcd_model_create(&definition, NULL, model, error);
}

/* Stated in docs/scene-file.md: keep both alike. */
bool config_built_in(daemon_config *config, char *error, size_t error_size) {
    static const double semi_axes_m[3] = {0.08, 0.06, 0.05};
    const shcd_effect_def effects[] = {{"stiffness", NULL, 0}, {"damping", NULL, 0}};
    shcd_error problem = {SHCD_OK, ""};
    daemon_config made = {.rate_hz = CONFIG_RATE_DEFAULT_HZ, .device = &device_profiles[0]};
    made.reserve_j = device_reserve_j(made.device, made.rate_hz);
    const shcd_pose here = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}};

    shcd_status status = config_ellipsoid(semi_axes_m, &made.models[0], &problem);
    if (status == SHCD_OK) {
        made.n_models = 1;
        made.body_in_world[0] = here;
        made.tool_ids[0] = 0;
        made.tool_ids[1] = 1;
        shcd_body_def body = SHCD_BODY_DEF_INIT;
        body.name = "ellipsoid";
        body.model = made.models[0];
        body.effects = effects;
        body.n_effects = sizeof effects / sizeof effects[0];
        shcd_tool_def tools[2] = {SHCD_TOOL_DEF_INIT, SHCD_TOOL_DEF_INIT};
        tools[0].name = "point";
        tools[1].name = "sphere";
        tools[1].kind = SHCD_TOOL_SPHERE;
        tools[1].radius_m = 0.003;
        shcd_scene_def scene = SHCD_SCENE_DEF_INIT;
        scene.bodies = &body;
        scene.n_bodies = 1;
        scene.tools = tools;
        scene.n_tools = 2;
        status = shcd_scene_create(&scene, NULL, &made.scene, &problem);
    }
    if (status != SHCD_OK) {
        if (error != NULL && error_size > 0) {
            (void)snprintf(error, error_size, "built-in scene: %s", problem.message);
        }
        config_free(&made);
        return false;
    }
    *config = made;
    return true;
}

/* Whether no body before this one, nor this one before its source, holds the model. */
static bool is_first(const daemon_config *config, size_t i, const shcd_model *model) {
    for (size_t k = 0; k < i; k++) {
        if (config->models[k] == model || config->sources[k] == model) {
            return false;
        }
    }
    return true;
}

void config_free(daemon_config *config) {
    if (config == NULL) {
        return;
    }
    shcd_scene_free(config->scene); /* before the models, maps and geometries it borrows */
    for (size_t i = 0; i < SHCD_TOOLS_MAX; i++) {
        shcd_tool_geometry_free(config->geometries[i]);
    }
    for (size_t i = 0; i < config->n_models; i++) {
        shcd_map_free(config->maps[i]); /* before the model it is one of */
        if (is_first(config, i, config->models[i])) {
            shcd_model_free(config->models[i]);
        }
        if (config->sources[i] != NULL && is_first(config, i, config->sources[i])) {
            shcd_model_free(config->sources[i]);
        }
    }
    memset(config, 0, sizeof *config);
}
