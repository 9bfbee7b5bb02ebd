/* SPDX-License-Identifier: BSD-3-Clause */
/* Effects: how a contact turns into a force. Each effect is one file with one constant entry; the
 * table in effects.c lists the entries in the order in which a tick applies them. A scene resolves
 * the names once into a dense array, so an effect that a body does not name has no cost at all.
 *
 * An effect has one or more hooks, each called for every contact in the order of the table:
 *   bend    changes the depth that the elastic law will see (a relief on the surface);
 *   press   is an elastic law: the force at a depth, given how far the body itself gives way;
 *   apply   changes or adds to what the elastic laws left (damping, friction, ...).
 * An effect of a whole body (`wave`, `pulse`) has none of them: soft.h. */
#ifndef SHCDI_EFFECTS_H
#define SHCDI_EFFECTS_H

#include "shcd/scene.h"

#include <stdbool.h>

/** Most effects the table may hold, most parameters of one, and most constants one may derive. */
#define SHCDI_EFFECTS_MAX 16
#define SHCDI_EFFECT_PARAMETERS_MAX 12
#define SHCDI_EFFECT_CONSTANTS_MAX 64

/** Radius of the ball that a sharp point counts as, where a law needs one [m]. */
#define SHCDI_SHARP_RADIUS_M 0.001

/** What an effect sees of a contact between one tool and one body. Body frame, which is fixed in
 *  the world; the surface is the current one. */
typedef struct shcdi_touch {
    const shcd_model *model;
    double depth_m;            /**< penetration, > 0; of all walls of a rigid body together */
    double foot_depth_m;       /**< of the ball at this foot: its radius less its distance */
    double depth_rate_m_per_s; /**< of the tool, > 0 while going in; against the rest shape */
    double dt_s;
    double tool_radius_m; /**< radius of the ball that the tool is there; 0: a sharp point */
    double wave_share;    /**< how much of the effect wave gives way there; 0: rigid */
    /** Of springs and dampers along the surface: the part that acts here, all walls of a ball
     * having at most one's together; and that part times the contact's share of the force. Else 1.
     */
    double along_part, along_weight;
    shcd_pose tool_in_body;
    shcd_vec3 normal;           /**< outward unit normal at the foot */
    shcd_vec3 foot_m;           /**< on the surface */
    shcd_vec3 parameter;        /**< of the foot */
    shcd_vec3 tool_point_m;     /**< point fixed in the tool whose motion friction resists */
    shcd_vec3 velocity_m_per_s; /**< of that point */
    /** Of the surface at the foot of a body that is driven (`pulse`); else 0: respond_soft.c says
     * why */
    shcd_vec3 surface_velocity_m_per_s;
} shcdi_touch;

/** What the effects of one contact build up, each from what those before it left. Body frame. */
typedef struct shcdi_response {
    double depth_m;          /**< that the elastic law sees */
    double normal_force_n;   /**< along the outward normal, on the tool */
    shcd_vec3 slope;         /**< of a relief: the normal force acts along normal + slope */
    shcd_vec3 other_force_n; /**< on the tool: friction, drag */
    double stored_j;         /**< energy that springs along the normal hold */
    double anchored_j;       /**< energy that springs along the surface hold */
    uint32_t flags;          /**< shcd_tool_output_flag */
} shcdi_response;

/** What a scene gives for the parameters of one effect, in the order of its table. */
typedef struct shcdi_settings {
    double value[SHCDI_EFFECT_PARAMETERS_MAX]; /**< of a number; the default if it is not given */
    bool is_given[SHCDI_EFFECT_PARAMETERS_MAX];
    const double *table[SHCDI_EFFECT_PARAMETERS_MAX]; /**< of a table, row by row; else NULL */
    size_t n_rows[SHCDI_EFFECT_PARAMETERS_MAX];
} shcdi_settings;

typedef struct shcdi_effect {
    shcd_effect_info info;
    /** Memory of one contact of one tool; all zero when the contact begins. */
    size_t state_bytes;
    /** Derives the constants of a tick from the parameters' values, in the order of the table. */
    void (*prepare)(const double *values, double *constants);
    /** NULL, or lowers or raises response->depth_m, and sets the slope that follows. */
    void (*bend)(const double *constants, const shcdi_touch *touch, void *memory,
                 shcdi_response *response);
    /** NULL, or the law's force F >= 0 [N] at F compliance + indentation(F) = depth_m, where
     *  compliance_m_per_n >= 0 is that of the body under this contact; 0 for a rigid body. At least
     *  the law or the compliance stops a depth: F is finite. Also the energy in the law itself. */
    double (*press)(const double *constants, const shcdi_touch *touch, double depth_m,
                    double compliance_m_per_n, double *stored_j);
    /** NULL, or changes the response. */
    void (*apply)(const double *constants, const shcdi_touch *touch, void *memory,
                  shcdi_response *response);
    /** NULL, or tells an elastic law that a membrane with this patch radius gives way under it. */
    void (*couple)(double *constants, double patch_radius_m);
} shcdi_effect;

/** Checks the parameters of an effect against each other, after prepare(), and derives constants
 * from tables and from what was given. Not among the hooks: what a tick can reach writes no
 * messages. */
typedef shcd_status shcdi_settle(const char *body, const shcdi_settings *settings,
                                 double *constants, shcd_error *error);

shcdi_settle shcdi_settle_texture, shcdi_settle_stiffness, shcdi_settle_relaxation,
    shcdi_settle_friction, shcdi_settle_viscosity;

extern const shcdi_effect shcdi_effect_texture;
extern const shcdi_effect shcdi_effect_stiffness;
extern const shcdi_effect shcdi_effect_learned;
extern const shcdi_effect shcdi_effect_wave;
extern const shcdi_effect shcdi_effect_pulse;
extern const shcdi_effect shcdi_effect_damping;
extern const shcdi_effect shcdi_effect_relaxation;
extern const shcdi_effect shcdi_effect_friction;
extern const shcdi_effect shcdi_effect_viscosity;

/** An effect that a body calls for, ready for the tick. */
typedef struct shcdi_active_effect {
    const shcdi_effect *effect;
    size_t state_offset; /**< in the memory of one (tool, body) pair */
    double constants[SHCDI_EFFECT_CONSTANTS_MAX];
} shcdi_active_effect;

/** Checks the effects of one body and resolves them in table order.
 *  @param[in]  body         name, for the messages
 *  @param[out] active       room for n_definitions or SHCDI_EFFECTS_MAX entries
 *  @param[out] n_active     how many of them are used
 *  @param[out] state_bytes  memory of one (tool, body) pair, a multiple of 8 */
shcd_status shcdi_effects_resolve(const char *body, const shcd_effect_def *definitions,
                                  size_t n_definitions, shcdi_active_effect *active,
                                  size_t *n_active, size_t *state_bytes, shcd_error *error);

/** Factor s of an active `learned`. */
double shcdi_learned_scale(const shcdi_active_effect *active);

/** Refuses `learned` on a body whose model carries no learned response, or beside `wave`. */
shcd_status shcdi_learned_effect_check(const char *body, const shcd_model *model,
                                       const shcdi_active_effect *active, size_t n_active,
                                       shcd_error *error);

#endif
