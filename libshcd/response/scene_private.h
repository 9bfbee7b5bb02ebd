/* SPDX-License-Identifier: BSD-3-Clause */
/* The constant scene and the state of a tick, as the files of this folder see them. */
#ifndef SHCDI_SCENE_PRIVATE_H
#define SHCDI_SCENE_PRIVATE_H

#include "base/internal.h"
#include "query/shape.h"
#include "query/tool_geometry.h"
#include "response/account.h"
#include "response/effects.h"
#include "response/soft.h"

#include <stdbool.h>

#define SHCDI_NAME_BYTES 64

/** Largest coordinate of a pose [m], speed of a tool [m/s] and radius of a tool [m]: the size of
 *  the largest model, and small enough that no square or product in a tick can overflow. */
#define SHCDI_MAGNITUDE_MAX 1e9

/** Largest | |q|^2 - 1 | of a quaternion that passes as a rotation. */
#define SHCDI_QUATERNION_TOLERANCE 1e-6

typedef struct shcdi_body {
    char name[SHCDI_NAME_BYTES];
    const shcd_model *model; /**< borrowed */
    shcd_pose body_in_world;
    shcd_vec3 ball_centre_m; /**< certified enclosing ball, body frame */
    double ball_radius_m;
    double diagonal_m;
    double deviation_m; /**< of the surface from its leaf triangles, at most */
    uint32_t n_leaves;
    uint32_t n_harmonics;
    shcd_body_accuracy accuracy;
    const shcdi_active_effect *effects; /**< dense, in table order; inside the scene's block */
    size_t n_effects;
    size_t first_effect;    /**< of the scene's effects, counted over all bodies */
    const shcdi_soft *soft; /**< inside the scene's block; NULL: a rigid body */
    size_t soft_offset;     /**< of its memory, from the start of the state */
    size_t memory_offset;   /**< of this body's effects, in the effect memory of one tool */
    size_t memory_bytes;
} shcdi_body;

/** The points of a shell as a tree: a point's children are those of the next level to which it is
 *  the nearest of its own and all coarser levels. Arrays of n_points, inside the scene's block. */
typedef struct shcdi_shell {
    uint32_t n_points;
    uint32_t n_slots;       /**< contacts that a state can hold for each body */
    const shcd_vec3 *point; /**< tool frame, coarse first; the geometry's */
    double *reach_m;        /**< no point below this one is farther from it */
    double *link_m;         /**< distance to the parent; 0 of the root */
    uint32_t *parent;       /**< the root, point 0, is its own */
    uint32_t *first_child;  /**< n_points + 1 entries: index into child */
    uint32_t *child;        /**< n_points - 1 entries */
    uint32_t *n_below;      /**< points of the subtree, this one included */
    double point_share;     /**< of a body's response that one point gives */
    size_t body_bytes;      /**< of state for each body, without the effects' memory */
} shcdi_shell;

typedef struct shcdi_tool {
    char name[SHCDI_NAME_BYTES];
    int kind;                           /**< a shcd_tool_kind */
    uint32_t evaluations_max;           /**< for each body and tick; 0: by the body's degree */
    double radius_m;                    /**< rounding of the core: of a sphere its radius */
    const shcd_tool_geometry *geometry; /**< borrowed; NULL for point and sphere */
    shcd_vec3 ball_centre_m;            /**< enclosing ball, tool frame */
    double ball_radius_m;
    double contact_share;
    shcdi_shell shell;   /**< zero unless the kind is shell */
    size_t state_offset; /**< of a shell's memory, from the start of the state */
} shcdi_tool;

/** One block of memory: this header, then the bodies, the active effects, the tools and the trees
 *  of shells. */
struct shcd_scene {
    shcd_allocator allocator;
    uint64_t fingerprint; /**< of the definition: a state is accepted by equal scenes only */
    size_t state_size;
    size_t tool_memory_bytes; /**< effect memory of one tool */
    size_t n_bodies;
    size_t n_tools;
    size_t n_effects;    /**< of all bodies */
    size_t gains_offset; /**< of the effects' gains, from the start of the state */
    shcdi_body *bodies;
    shcdi_tool *tools;
};

/** A foot on the surface that follows a point of the tool from tick to tick. Body frame. */
typedef struct shcdi_proxy {
    shcd_vec3 tool_m;    /**< that point at the last query: centre, core point, point of a shell */
    shcd_vec3 foot_m;    /**< the foot found then */
    shcd_vec3 normal;    /**< outward normal there */
    shcd_vec3 parameter; /**< its parameter */
} shcdi_proxy;

/** Most walls that a ball touches at once. */
#define SHCDI_WALLS_MAX 3

/** One of them. Body frame. */
typedef struct shcdi_wall {
    shcd_vec3 foot_m, normal, parameter;
    double depth_m;      /**< that counts */
    double short_m;      /**< what this is less than the ball's depth in it: it fades in */
    double share;        /**< of the force of the contact's law */
    double energy_share; /**< of its energy */
    double way_m;        /**< what it moves the ball by, along its normal */
    shcd_vec3 slope;     /**< rigid bodies: its force acts along normal + slope */
    uint32_t is_touching;
    uint32_t is_new; /**< its effects start from zero memory */
} shcdi_wall;

/** Memory of the contact between one tool and one body. Body frame throughout. */
typedef struct shcdi_contact {
    shcdi_proxy proxy;
    shcd_pose ball;   /**< centre of the tool's ball and the tool's orientation at the last query */
    shcd_vec3 core_m; /**< the core point in the tool frame; 0 for point and sphere */
    double lower_m;   /**< certified lower bound of the gap plus the ball's radius then, or -inf */
    double
        surface_way_m; /**< way of the surface by then: bound of its motion since, by difference */
    double still_s;    /**< time since the tool last moved, at most 50 ms */
    shcd_vec3 last_m;  /**< point, sphere: the centre in the last tick, asked for or not */
    double apart_m;    /**< gap then, or a lower bound of it */
    uint32_t is_known; /**< 0: nothing above is valid */
    uint32_t is_touching;
    uint32_t is_behind; /**< convex tools: the core point is inside, behind the proxy */
    uint32_t deepest;   /**< sphere: the wall that the proxy is on */
    shcdi_wall wall[SHCDI_WALLS_MAX]; /**< sphere */
    double pressed_m;                 /**< depth that the elastic law gets of all walls together */
    double yielded;                   /**< share of its stiffness that this contact has given up */
    shcdi_account account;            /**< sphere on a rigid body */
    shcd_vec3 held_at_m;              /**< sphere: the centre when ... */
    shcd_vec3 held_n;                 /**< ... the law's force of the last tick began to be held */
    shcd_vec3 rubbing_n;              /**< on a body that drives: what rubs, held likewise */
    shcd_certificate certificate;     /**< point, sphere: valid or void, but never wrong */
} shcdi_contact;

/** One block without pointers: this header, the contacts [tool][body], the effects' memory
 * [tool][walls of the contact], the gains [effect], the shells' memory [tool][body], the soft
 * bodies' memory [body]. All zero bytes after the header mean: nothing known, nothing touched. */
struct shcd_state {
    uint64_t fingerprint;
    uint64_t size;
    uint64_t tick;
    double time_s;
    shcdi_contact contacts[];
};

/** What one query of a tool against a body gave. Body frame. */
typedef struct shcdi_gap {
    double gap_m; /**< signed gap between tool surface and body; negative in contact */
    shcd_vec3 foot_m;
    shcd_vec3 normal;
    shcd_vec3 tool_point_m; /**< convex tools: where the force acts */
    uint32_t flags;         /**< shcd_tool_output_flag */
    uint32_t n_evaluations;
    uint32_t n_patches;
    uint32_t n_points_visited; /**< shells */
    uint32_t n_points_left;
    int32_t tier;            /**< the least certain that answered */
    double allowance_ns;     /**< given: what the query may cost, at the prices of the body */
    const shcd_shape *shape; /**< given: the body's current shape; NULL: rest */
} shcdi_gap;

/** Nothing found yet; what was given stays. */
static inline void shcdi_gap_begin(shcdi_gap *gap) {
    const shcdi_gap nothing = {.allowance_ns = gap->allowance_ns, .shape = gap->shape};
    *gap = nothing;
}

/** A sum of the gains of a body's effects that changes when one of them does. */
static inline double shcdi_gain_sum(const shcdi_body *body, const shcdi_gain *gains) {
    double sum = 0.0;
    for (size_t e = 0; e < body->n_effects; e++) {
        sum += (double)(e + 1) * gains[e].now;
    }
    return sum;
}

/** Bound of all the surface's motion since the state was initialised: the difference of two such
 *  values bounds what any of its points has moved in between. */
static inline double shcdi_surface_way(const shcd_shape *shape) {
    return shape != NULL ? shape->path[0] : 0.0;
}

/** How far no point of the tool has moved since `before`, at most: rotation about the ball's centre
 *  and motion of that centre, rounding included. */
double shcdi_motion_bound(const shcdi_tool *tool, const shcd_pose *before, const shcd_pose *now);

/** The ball's centre and the orientation, from the pose of the tool's frame. */
shcd_pose shcdi_ball_pose(const shcdi_tool *tool, shcd_pose tool_in_body);

/** Certified lower bound of the gap, from the enclosing balls and from the last query; costs no
 *  evaluation of the surface.
 *  @param[in] ball  from shcdi_ball_pose() */
double shcdi_contact_lower_bound(const shcdi_body *body, const shcd_shape *shape,
                                 const shcdi_tool *tool, const shcdi_contact *contact,
                                 const shcd_pose *ball);

/** Finds the contact of a point or sphere dt_s after the last tick, and remembers it. */
void shcdi_contact_update(const shcdi_body *body, const shcdi_tool *tool, const shcd_pose *ball,
                          double dt_s, shcdi_contact *contact, shcdi_gap *out);

/** Finds the contact of a capsule, box or hull. */
void shcdi_convex_update(const shcdi_body *body, const shcdi_tool *tool, shcd_pose tool_in_body,
                         double dt_s, shcdi_contact *contact, shcdi_gap *out);

/** Bytes of the tree of a shell of n points. */
size_t shcdi_shell_bytes(size_t n_points);

/** Builds it in that many bytes of zeroed memory, aligned to 8. */
void shcdi_shell_build(const shcd_tool_geometry *geometry, unsigned char *memory,
                       shcdi_shell *shell);

/** State of a shell for one body, without the effects' memory; a multiple of 8. */
size_t shcdi_shell_state_bytes(const shcdi_shell *shell);

/** Finds the contacts of a shell, in its memory for this body (body_bytes, then the effects'
 *  memory of n_slots contacts). */
void shcdi_shell_update(const shcdi_body *body, const shcdi_tool *tool, shcd_pose tool_in_body,
                        double dt_s, shcdi_contact *contact, unsigned char *memory, shcdi_gap *out);

/** One contact of a point of a shell. Body frame. */
typedef struct shcdi_slot {
    shcdi_proxy proxy;
    double depth_m;
    uint32_t point;
    uint32_t weight; /**< points that it stands for, itself included */
    uint32_t stamp;  /**< of the tick that saw it last */
    uint32_t is_new; /**< its effects start from zero memory */
} shcdi_slot;

/** The contacts that the last update found. Effects' memory of contact i: body_bytes and i times
 *  the body's memory_bytes from the start. */
shcdi_slot *shcdi_shell_contacts(const shcdi_shell *shell, unsigned char *memory, uint32_t *count);

/** Lets go of all contacts; what is known about distances stays true. */
void shcdi_shell_release(const shcdi_shell *shell, unsigned char *memory);

/** Checks a tool's kind, radius and geometry. */
shcd_status shcdi_tool_check(const shcd_tool_def *tool, shcd_error *error);
/** Bytes of the scene's block that it needs beside its shcdi_tool. */
size_t shcdi_tool_bytes(const shcd_tool_def *tool);
/** Fills a zeroed tool but for its name and state_offset. */
void shcdi_tool_fill(const shcd_tool_def *definition, unsigned char *memory, shcdi_tool *tool);

/** Scaled to length 1. */
static inline shcd_quat shcdi_unit_quaternion(shcd_quat q) {
    const double n = sqrt(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z);
    q.w /= n;
    q.x /= n;
    q.y /= n;
    q.z /= n;
    return q;
}

/** |q|^2 within SHCDI_QUATERNION_TOLERANCE of 1; false for NaN. */
bool shcdi_is_rotation(shcd_quat q);

/** Each coordinate finite and at most SHCDI_MAGNITUDE_MAX. */
bool shcdi_is_moderate(shcd_vec3 v);

#endif
