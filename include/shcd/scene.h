/* SPDX-License-Identifier: BSD-3-Clause */
/** @file
 *  Scene (constant), state (mutable, one relocatable block) and the tick.
 *
 *  scene = bodies, tools, the effects each body calls for, and all capacities. state = what changes
 *  from tick to tick, without pointers: a snapshot is a memcpy, a replay is bit-exact.
 *  shcd_step(scene, state, input, output) is the tick.
 */
#ifndef SHCD_SCENE_H
#define SHCD_SCENE_H

#include "shcd/map.h"
#include "shcd/tool.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SHCD_BODIES_MAX 64
#define SHCD_TOOLS_MAX 16

/** What is there, and how much of it; constant, shared by threads. */
typedef struct shcd_scene shcd_scene;
/** What changes from tick to tick; lies in the caller's memory. */
typedef struct shcd_state shcd_state;

/* ---- effects: the static table ------------------------------------------------------------- */

/** A column of a parameter that is a table. Frozen layout. */
typedef struct shcd_column_info {
    const char *name; /**< with its unit as suffix, e.g. "stress_pa" */
    const char *unit; /**< as in shcd_parameter_info */
    double min_value; /**< inclusive */
    double max_value; /**< inclusive */
} shcd_column_info;

/** One parameter of an effect and the values it may take: a number, or a table if it has columns.
 *  A table need not be given; the values of its first column rise from row to row. */
typedef struct shcd_parameter_info {
    const char *name; /**< with its unit as suffix, e.g. "k_n_per_m" */
    const char *unit; /**< SI, e.g. "N/m"; "1" if dimensionless */
    double default_value;
    double min_value; /**< inclusive */
    double max_value; /**< inclusive */
    const char *description;
    const shcd_column_info *columns; /**< NULL: a number; else the values above are 0 */
    size_t n_columns;
    size_t n_rows_min;
    size_t n_rows_max;
} shcd_parameter_info;

/** One entry of the table of effects. */
typedef struct shcd_effect_info {
    const char *name; /**< the key in a scene file, e.g. "stiffness" */
    const char *description;
    const char *source; /**< of its formula */
    size_t n_parameters;
    const shcd_parameter_info *parameters;
} shcd_effect_info;

/** The effects that this library knows, in the order in which a tick applies them; NULL past the
 *  end. Static data. RT safe. */
SHCD_API SHCD_RT const shcd_effect_info *shcd_effect_at(size_t index);

/* ---- definition ----------------------------------------------------------------------------- */

/** A parameter that does not take its default. */
typedef struct shcd_parameter_value {
    const char *name;
    double value;        /**< of a number */
    const double *table; /**< of a table: n_rows times its n_columns, row by row; else not read */
    size_t n_rows;       /**< of a table; else not read */
} shcd_parameter_value;
/** A number. */
#define SHCD_PARAMETER(name, value)                                                                \
    { (name), (value), NULL, 0 }

/** One effect that a body calls for; parameters not named take their defaults. */
typedef struct shcd_effect_def {
    const char *name;
    const shcd_parameter_value *parameters;
    size_t n_parameters;
} shcd_effect_def;

/** How accurately the tools of a scene ask a body, and for how much. All zero: the exact tier with
 * its default tolerance, and no budget. Usually filled by shcd_body_accuracy_of(). Frozen layout.
 */
typedef struct shcd_body_accuracy {
    int32_t tier; /**< a shcd_tier. track and map are local or radial: the force of a foot that
                       follows the tool, never one of "the distance" */
    int32_t map_hermite; /**< map tier: 1: cubic, 0: linear */
    const shcd_map *map; /**< map tier: borrowed, of the same model; NULL: the model's own */
    double tolerance;    /**< as in shcd_query_options */
    /** What the queries of all tools against this body may cost in one tick [us]; 0: no budget. A
     *  tick counts, it never reads a clock: the prices below turn the budget into evaluations and
     *  bounds, so that the same input gives the same bits on every machine. */
    double budget_us;
    double evaluation_ns; /**< price of one evaluation of the surface; above 0 with a budget [ns] */
    double patch_ns;      /**< price of one bound [ns] */
    double exact_ns;      /**< price of a usual exact query: with less the fast tier answers [ns] */
    double fast_ns;       /**< price of a usual fast query: with less the track tier answers [ns] */
    /** Share of a budget that goes into evaluations, the rest into bounds; 0: one half. */
    double evaluation_share;
    double reserved; /**< zero */
} shcd_body_accuracy;

/** What a row of a cost table means for a tick.
 *
 *  @param[in]  rows       the table; prices of other tiers come from rows of the same degree
 *  @param[in]  row        index, e.g. from shcd_accuracy_choose()
 *  @param[in]  budget_us  0: none
 *  @param[out] accuracy   map is NULL; untouched on failure
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT, SHCD_ERR_NOT_FINITE. RT safe. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_body_accuracy_of(const shcd_cost_row *rows,
                                                                  size_t n_rows, size_t row,
                                                                  double budget_us,
                                                                  shcd_body_accuracy *accuracy);

/** Start from SHCD_BODY_DEF_INIT. In an array the stride is the first element's struct_size. */
typedef struct shcd_body_def {
    size_t struct_size;
    const char *name;        /**< unique among its kind, 1 to 63 bytes, no control characters */
    const shcd_model *model; /**< borrowed: it must outlive the scene */
    shcd_pose body_in_world;
    const shcd_effect_def *effects;
    size_t n_effects;
    shcd_body_accuracy accuracy;
} shcd_body_def;
#define SHCD_BODY_ACCURACY_DEFAULT                                                                 \
    { 0, 0, NULL, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0 }
#define SHCD_BODY_DEF_INIT                                                                         \
    {                                                                                              \
        sizeof(shcd_body_def), NULL, NULL, {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0, 0.0}}, NULL, 0,       \
            SHCD_BODY_ACCURACY_DEFAULT                                                             \
    }

/** Start from SHCD_TOOL_DEF_INIT. In an array the stride is the first element's struct_size. */
typedef struct shcd_tool_def {
    size_t struct_size;
    const char *name; /**< unique among its kind, 1 to 63 bytes, no control characters */
    int32_t kind;     /**< a shcd_tool_kind; that of the geometry, if there is one */
    int32_t reserved0;
    double radius_m; /**< sphere: > 0; point: 0; not read if there is a geometry */
    /** Borrowed: it must outlive the scene. NULL: the point or sphere that kind and radius_m say.
     *  Capsules, boxes, hulls and shells need one (shcd/tool.h). */
    const shcd_tool_geometry *geometry;
    /** Shell: share of its points that together feel a body's full stiffness, (0, 1]; 0 means 1.
     *  See shcd_step(). */
    double contact_share;
    /** Cap of surface evaluations that this tool costs a body in a tick, above which the tick
     *  degrades; 0: 400 up to degree 15, above it in inverse proportion to the harmonics, and four
     *  times that for a shell. What is
     *  begun below the cap is finished. */
    uint32_t evaluations_max;
    uint32_t reserved1; /**< zero */
} shcd_tool_def;
#define SHCD_TOOL_DEF_INIT                                                                         \
    { sizeof(shcd_tool_def), NULL, 0, 0, 0.0, NULL, 0.0, 0, 0 }

/** Start from SHCD_SCENE_DEF_INIT. */
typedef struct shcd_scene_def {
    size_t struct_size;
    const shcd_body_def *bodies;
    size_t n_bodies; /**< 0 .. SHCD_BODIES_MAX */
    const shcd_tool_def *tools;
    size_t n_tools; /**< 1 .. SHCD_TOOLS_MAX */
} shcd_scene_def;
#define SHCD_SCENE_DEF_INIT                                                                        \
    { sizeof(shcd_scene_def), NULL, 0, NULL, 0 }

/** Checks a definition and builds the constant scene; names, parameters and effects are copied,
 *  models and tool geometries are borrowed.
 *  @param[out] scene  untouched on failure
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT (the message names the body, effect or parameter),
 *  SHCD_ERR_NOT_FINITE, SHCD_ERR_MEMORY. Not RT safe. */
SHCD_API SHCD_NODISCARD shcd_status shcd_scene_create(const shcd_scene_def *definition,
                                                      const shcd_allocator *allocator,
                                                      shcd_scene **scene, shcd_error *error);
/** Accepts NULL; the models stay. */
SHCD_API void shcd_scene_free(shcd_scene *scene);

/** RT safe. */
SHCD_API SHCD_RT size_t shcd_scene_body_count(const shcd_scene *scene);
/** RT safe. */
SHCD_API SHCD_RT size_t shcd_scene_tool_count(const shcd_scene *scene);
/** NULL if the index is out of range. RT safe. */
SHCD_API SHCD_RT const char *shcd_scene_body_name(const shcd_scene *scene, size_t body);
/** NULL if the index is out of range. RT safe. */
SHCD_API SHCD_RT const char *shcd_scene_tool_name(const shcd_scene *scene, size_t tool);

/** Effects of all bodies, in the order of the bodies and of shcd_effect_at(). RT safe. */
SHCD_API SHCD_RT size_t shcd_scene_effect_count(const shcd_scene *scene);
/** Name of one of them; NULL if the index is out of range. RT safe. */
SHCD_API SHCD_RT const char *shcd_scene_effect_name(const shcd_scene *scene, size_t effect);
/** Index of its body; SIZE_MAX if the index is out of range. RT safe. */
SHCD_API SHCD_RT size_t shcd_scene_effect_body(const shcd_scene *scene, size_t effect);

/* ---- state ---------------------------------------------------------------------------------- */

/** Bytes of state that this scene needs. RT safe. */
SHCD_API SHCD_RT size_t shcd_state_size(const shcd_scene *scene);

/** Initialises a state in the caller's memory (aligned to 16, at least shcd_state_size() bytes):
 *  no contact, time zero. Also resets an old one. @return SHCD_OK, SHCD_ERR_ARGUMENT. RT safe. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_state_init(const shcd_scene *scene, void *memory,
                                                            size_t size, shcd_state **state);

/** Switches an effect of the scene on or off, from the next tick on. How much of it acts goes
 *  linearly from what it is now to 1 or 0 within the ramp, so that no force jumps; all are on at
 *  first.
 *  @param[in] ramp_s  [0, 60]; 0: at once
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT. RT safe. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_state_switch(const shcd_scene *scene,
                                                              shcd_state *state, size_t effect,
                                                              int is_on, double ramp_s);

/** The surface of a body at the end of the last tick: 3 (degree+1)^2 coefficients, the model's
 *  order, body frame [m]. Those of the model for a rigid body. A body with `learned` shows the dent
 *  of its deepest contact (shcd_learned_dent(); contacts of shells show none), of the network's
 *  force: what other effects of the body make of it is not in it, and tools meet the rest shape.
 *  @param[out] coefficients  room for `count` values
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT (also if count is not 3 (degree+1)^2). RT safe. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_state_coefficients(const shcd_scene *scene,
                                                                    const shcd_state *state,
                                                                    size_t body,
                                                                    double *coefficients,
                                                                    size_t count);

/** 1 if what shcd_state_coefficients() gives of a body can differ from its rest shape (`wave`, or
 *  `learned` with dents), else 0. RT safe. */
SHCD_API SHCD_RT int shcd_scene_body_is_soft(const shcd_scene *scene, size_t body);

/** How stiff a body with `wave` is, at the stiffest place of its surface, to one contact without an
 *  elastic law between them, wherever the scene's other tools press beside it; a law is a spring in
 *  series and makes it softer.
 *
 *  Both are bounds from above. With one tool 1/(W_res + min over w of sum_k a_k (b_k phi_k(w))^2),
 *  the minimum bounded from a grid (libshcd/response/soft_stiffness.c): above the stiffest place by
 *  at most 0.15 of what the compliance varies over the surface. Tools that are held make the body
 *  stiffer for each other: with n of them, one contact each, at most what n at one place make:
 *  infinite where the modes leave nothing out.
 *  @param[in]  dt_s          length of a tick, (0, 0.1]
 *  @param[out] tick_n_per_m  change of force for a motion within one tick: inertia makes the body
 *                            stiffer than it is when it is held, the more the shorter the tick
 *  @param[out] held_n_per_m  force for a depth that is held for good; 0: it gives way for ever
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT, SHCD_ERR_UNSUPPORTED (a body without `wave`). Evaluates all
 *  modes on 8 (degree)^2 directions or more, tenths of a second: not RT safe. Thread safe. */
SHCD_API SHCD_NODISCARD shcd_status shcd_scene_wave_stiffness(const shcd_scene *scene, size_t body,
                                                              double dt_s, double *tick_n_per_m,
                                                              double *held_n_per_m);

/* ---- the tick ------------------------------------------------------------------------------- */

/** Bits of shcd_tool_input::flags. */
typedef enum shcd_tool_input_flag {
    SHCD_TOOL_INPUT_ACTIVE =
        1u << 0 /**< without it the tool touches nothing and loses its contacts */
} shcd_tool_input_flag;

/** Frozen layout. */
typedef struct shcd_tool_input {
    shcd_pose tool_in_world;
    shcd_vec3 velocity_m_per_s;           /**< of the tool's origin, world frame */
    uint32_t flags;                       /**< shcd_tool_input_flag */
    uint32_t reserved0;                   /**< zero */
    shcd_vec3 angular_velocity_rad_per_s; /**< world frame; a sphere about its origin ignores it */
    uint64_t reserved[2];                 /**< zero */
} shcd_tool_input;

/** Frozen layout. */
typedef struct shcd_input {
    double dt_s;                  /**< time since the last tick, (0, 0.1] */
    const shcd_tool_input *tools; /**< one for each tool of the scene, in its order */
    size_t n_tools;
    /** NULL, or a clock [ns] by which shcd_effect_output::time_ns is measured; it must be RT safe
     *  itself. The tick's results never depend on it. */
    uint64_t (*clock_ns)(void *user);
    void *clock_user;
} shcd_input;

/** Bits of shcd_tool_output::flags. */
typedef enum shcd_tool_output_flag {
    SHCD_TOOL_OUTPUT_CONTACT = 1u << 0,   /**< touches at least one body */
    SHCD_TOOL_OUTPUT_TRUNCATED = 1u << 1, /**< a query reached its cap; its interval is not tight */
    /** A value not finite, a coordinate or speed above 1e9, or not a rotation: no force; contacts
     * are kept. */
    SHCD_TOOL_OUTPUT_BAD_INPUT = 1u << 2,
    SHCD_TOOL_OUTPUT_SIGN_UNSURE = 1u << 3, /**< inside or outside unknown: treated as outside */
    /** The tick's budget or cap was reached. Shell: before all points were accounted for; coarser
     *  points stand for the n_points_left others. Other tools: a lower tier answered than that of
     *  the body, see shcd_tool_output::tier and shcd_step(). */
    SHCD_TOOL_OUTPUT_DEGRADED = 1u << 4,
    /** A contact outside of what `learned` was trained on: see shcd_learned_flag. */
    SHCD_TOOL_OUTPUT_EXTRAPOLATED = 1u << 5,
    /** A ball that gets less than 0.99 of its law: the several walls of a contact were stiffer than
     *  one, or would have given what they had not been given (docs/stability.md). Of a soft body
     *  all its balls share that; with `texture` a single wall may come to it. */
    SHCD_TOOL_OUTPUT_YIELDING = 1u << 6
} shcd_tool_output_flag;

/** Frozen layout. */
typedef struct shcd_tool_output {
    shcd_wrench wrench; /**< on the tool, world frame; torque about the tool's origin */
    shcd_vec3 proxy_m;  /**< contact point on the surface of the deepest contact, world; without
                             contact the closest point of the nearest body */
    shcd_vec3 normal;   /**< outward unit normal there, world */
    /** Of the deepest contact, >= 0; 0 without contact [m]. In contact with a soft body this,
     *  distance_m, proxy_m and displacement_m are those at the end of the tick: what the forces of
     *  the tick itself moved the surface is taken off, at the same point of the surface. */
    double penetration_m;
    double distance_m;      /**< signed gap between tool surface and nearest body; negative in
                                 contact [m]; infinite without a body, or for an inactive or bad tool;
                                 of a degraded shell that of the visited points */
    int32_t body;           /**< index of that body; -1: none, or an inactive or bad tool */
    uint32_t flags;         /**< shcd_tool_output_flag */
    uint32_t n_evaluations; /**< surface evaluations that this tool cost */
    uint32_t n_patches;     /**< bounds that this tool cost */
    uint32_t n_contacts;    /**< contacts with a force: one to three for each body, or one for each
                                 point of a shell */
    /** Shell: points that were looked up or queried, summed over the bodies; points proven clear by
     *  those and by earlier ticks are not among them. */
    uint32_t n_points_visited;
    uint32_t n_points_left; /**< shell: points that are neither visited nor proven clear */
    /** The least certain shcd_tier (map < track < fast < exact) that answered for a body; exact if
     *  bounds alone sufficed. A proxy that is followed into a body does not count. Shell: exact. */
    int32_t tier;
    double displacement_m; /**< how far proxy_m has been moved from its place on the rest shape; 0
                              for a rigid body or a shell [m] */
    uint64_t reserved[1];  /**< zero */
} shcd_tool_output;

/** Without a clock. */
#define SHCD_INPUT(dt_s, tools, n_tools)                                                           \
    { (dt_s), (tools), (n_tools), NULL, NULL }

/** What one effect of one body did in a tick. Frozen layout. */
typedef struct shcd_effect_output {
    double stored_j; /**< energy that it holds: springs of contacts, a body's modes [J] */
    double work_j;   /**< energy that it has brought in since the start (pulse): into the body, and
                          into what its surface carries along [J] */
    double time_ns;  /**< what it took, by shcd_input::clock_ns; 0 without [ns] */
    double gain;     /**< how much of it acts, 0 .. 1 */
} shcd_effect_output;

/** Frozen layout. */
typedef struct shcd_output {
    shcd_tool_output *tools; /**< caller's array, one for each tool of the scene */
    size_t n_tools;
    shcd_effect_output *effects; /**< caller's array of shcd_scene_effect_count(), or NULL */
    size_t n_effects;            /**< 0 if NULL */
    /** Caller's array, or NULL: [tool * n_effects + effect], the share of
     * tools[tool].wrench.force_n that the effect has given: what the force changed by while it
     * acted [N]. */
    shcd_vec3 *effect_forces_n;
} shcd_output;
/** Without the effects' accounts. */
#define SHCD_OUTPUT(tools, n_tools)                                                                \
    { (tools), (n_tools), NULL, 0, NULL }

/** One tick: for each active tool and body find the contact, let the body's effects act, sum the
 *  wrench.
 *
 *  Contact: outside, the certified closest point decides. A tool whose centre has gone in keeps a
 * proxy on the surface, followed by Newton from tick to tick, until it separates there: a tool
 * pressed past the medial axis is not thrown out on the far side but has to come back the way it
 * went in. Where the proxy's minimum of distance ends (at a focal point) it slides to the next one
 * with a bounded speed, so that the force turns instead of jumping. A point or ball outside at both
 * ends of a tick whose way may have led through the body is swept (shcd_sweep()) and held where it
 * went in; other tools are not.
 *
 *  Point, sphere: one contact for each tool and body, whose force passes through the centre; a ball
 *  whose centre is outside feels up to two more walls, in a groove or a corner. A wall is one whose
 *  normal differs by more than 26 degrees from the others'; up to 45 degrees it counts in part.
 *  All three are contacts of their own, with memories of their own (friction), and on a soft body
 *  their forces are solved for together.
 *
 *  Capsule, box, hull: one contact for each tool and body, at the tool's deepest point
 * (shcd_tool_closest()), along the body's normal; torque (tool point - origin) x force. Where the
 * deepest point moves along the tool the force stays continuous, the torque turns with it; where
 * two separate points of a tool are equally deep, the contact jumps from one to the other: the
 * force's size does not, its direction by less than 26 degrees on one side of the body and by more
 * only onto another wall, its torque by the lever between them.
 *
 *  Shell: every point p_i of it that is inside is a contact of its own, and gives
 * F_i = effects(depth_i, rate_i) n_i w_i at p_i, where w_i = 1/(contact_share n_points). With
 * stiffness k [N/m] alone this is a conservative foundation of k/contact_share for all points
 * together: pressed in with all of them at contact_share 1, the force is k times their mean depth.
 * Points are visited coarse first; at the cap of the tick a coarser point stands for those below it
 * that were not visited, with their weight added to its own, and the output says so.
 *
 *  Budget: a body with a budget_us gives each active tool, in the order of the scene, an equal
 * share of what is left of it; what a tool does not use flows on. A query against the body then has
 * caps that its share pays for, evaluation_share of it in evaluations and the rest in bounds. It
 * degrades in this order, and says so: the exact tier with a wider interval
 * (SHCD_TOOL_OUTPUT_TRUNCATED); below exact_ns the fast tier, below fast_ns the track tier
 * (SHCD_TOOL_OUTPUT_DEGRADED, and `tier`). Where there is no foot to follow the fast tier answers
 * instead of the track tier. A proxy inside the body is followed in any case: at most five times 16
 * Newton steps. So a tick exceeds the budget by no more than that for each tool, or by one fast
 * query's smallest caps.
 *
 *  Rates of depth are those of the contact point of the tool, v + omega x (point - origin).
 *
 *  @return SHCD_OK, or SHCD_ERR_ARGUMENT (null, wrong counts, dt_s out of range; then nothing is
 *  written). Bad tool values are flagged per tool and give no force. RT safe. Deterministic: the
 *  same scene, state and input give the same bits. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_step(const shcd_scene *scene, shcd_state *state,
                                                      const shcd_input *input, shcd_output *output);

#ifdef __cplusplus
}
#endif
#endif
