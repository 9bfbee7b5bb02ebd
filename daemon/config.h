/* SPDX-License-Identifier: BSD-3-Clause */
/* What a scene file becomes: the constant scene, its models, and what only the daemon needs to know
 * (rate, device profile, tool ids on the wire). */
#ifndef SHCDD_CONFIG_H
#define SHCDD_CONFIG_H

#include "shcd/shcd.h"

#include <stdbool.h>

#define CONFIG_RATE_MIN_HZ 100.0
#define CONFIG_RATE_MAX_HZ 4000.0
#define CONFIG_RATE_DEFAULT_HZ 1000.0
#define CONFIG_TOOL_ID_MAX 255
/** Holds every complaint whole for paths of ordinary length. */
#define CONFIG_ERROR_SIZE 1024

/** Caps of a haptic device; the output chain obeys them, and a scene that asks for more stiffness
 *  than the device renders is refused. */
typedef struct device_profile {
    const char *name;
    double force_max_n;
    double torque_max_n_m;
    double slew_max_n_per_s;
    double stiffness_max_n_per_m; /**< that it renders at any rate */
    double damping_n_s_per_m;     /**< of the device with a hand on it, the least to be relied on */
    double delay_s;               /**< from a pose to its force in the hand, beside the tick */
    double speed_max_m_per_s;     /**< of a hand, for the passivity controller */
    double turn_max_rad_per_s;    /**< likewise */
    double mass_kg;               /**< apparent at the tip, without a hand */
} device_profile;

/** Known devices, ended by a null name; the first is the default. */
extern const device_profile device_profiles[];

/** Largest stiffness that is stable on a device when sampled and held at this rate: the spring
 *  yields like a damping of -k (T/2 + delay), which hand and device must make up for (Colgate and
 *  Schenkel 1997; docs/stability.md). Never above what it renders. */
double device_stiffness_max(const device_profile *device, double rate_hz);

/** Largest drag that is stable on a device when sampled and held at this rate, without help from
 *  its damping. With m the device's mass, T the tick and d the ticks of delay
 *      v' = v - (c T/m) v(d ticks ago),   z^(d+1) - z^d + c T/m = 0;
 *  on the unit circle, z = e^(i t), the first such t is pi/(2d + 1), where c T/m = |1 - z| =
 *  2 sin(t/2): below that all roots lie inside. 2 m/T without a delay, m/T with one tick. */
double device_drag_max(const device_profile *device, double rate_hz);

/** Ticks by which poses and forces may be late on this device, rounded up. */
int device_delays(const device_profile *device, double rate_hz);

/** The reserve of the passivity controller where a scene does not state one: twice the least, what
 *  the device's full wrench can give at the largest speeds in a tick and in those of the delay. */
double device_reserve_j(const device_profile *device, double rate_hz);

typedef struct daemon_config {
    double rate_hz;
    const device_profile *device;
    double reserve_j; /**< of the passivity controller; HUGE_VAL: off */
    double delay_s;   /**< longest that the scene states; the device's counts if that is longer */
    size_t n_models;
    shcd_model *models[SHCD_BODIES_MAX]; /**< owned, in body order; bodies from one file share one
                                              model, so a pointer may stand here more than once */
    /** owned: what was loaded for a body, where models[] holds one of a lower degree instead, for
     *  its accuracy; else NULL. Shared between bodies like models[]. */
    shcd_model *sources[SHCD_BODIES_MAX];
    shcd_map *maps[SHCD_BODIES_MAX]; /**< owned, for its accuracy; NULL: none */
    shcd_pose body_in_world[SHCD_BODIES_MAX];
    int32_t tool_ids[SHCD_TOOLS_MAX]; /**< wire id of each tool of the scene, 0 .. 255, unique */
    shcd_tool_geometry *geometries[SHCD_TOOLS_MAX]; /**< owned; NULL: a point or sphere */
    shcd_scene *scene;                              /**< owned; knows names and counts */
} daemon_config;

/** Reads a scene file (YAML, at most 1 MiB, docs/scene-file.md) and loads its models. On failure
 *  `config` is untouched and `error` holds one line, "FILE:LINE:COLUMN: KEY: what is wrong and what
 *  would be right"; without the place if the file cannot be read at all. Relative model paths start
 *  at the scene file's folder. Numbers are read the same in every locale. Prints nothing, but for a
 *  line on stderr where the accuracy of a body has to be measured first. */
bool config_load(const char *path, daemon_config *config, char *error, size_t error_size);

/** The scene used without an argument: an ellipsoid made from coefficients, one point tool (id 0)
 *  and one sphere tool (id 1). */
bool config_built_in(daemon_config *config, char *error, size_t error_size);

/** Releases scene and models, and zeroes the config; NULL is allowed. */
void config_free(daemon_config *config);

/** A degree-1 body: the ellipsoid with these semi-axes along x, y and z, centred. */
shcd_status config_ellipsoid(const double semi_axes_m[3], shcd_model **model, shcd_error *error);

#endif
