/* SPDX-License-Identifier: BSD-3-Clause */
/* The constant scene and the state of a tick, as the files of this folder see them. */
#ifndef SHCDI_SCENE_PRIVATE_H
#define SHCDI_SCENE_PRIVATE_H

#include "base/internal.h"
#include "response/effects.h"

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
    const shcdi_active_effect *effects; /**< dense, in table order; inside the scene's block */
    size_t n_effects;
    size_t memory_offset; /**< of this body's effects, in the effect memory of one tool */
    size_t memory_bytes;
} shcdi_body;

typedef struct shcdi_tool {
    char name[SHCDI_NAME_BYTES];
    double radius_m; /**< 0: a point */
} shcdi_tool;

/** One block of memory: this header, then the bodies, the tools and the active effects. */
struct shcd_scene {
    shcd_allocator allocator;
    uint64_t fingerprint; /**< of the definition: a state is accepted by equal scenes only */
    size_t state_size;
    size_t tool_memory_bytes; /**< effect memory of one tool */
    size_t n_bodies;
    size_t n_tools;
    shcdi_body *bodies;
    shcdi_tool *tools;
};

/** Memory of the contact between one tool and one body. Body frame throughout. */
typedef struct shcdi_contact {
    shcd_vec3 tool_m;    /**< tool centre at the last query */
    shcd_vec3 foot_m;    /**< the foot found then: the proxy while in contact */
    shcd_vec3 normal;    /**< outward normal there */
    shcd_vec3 parameter; /**< its parameter */
    double lower_m;      /**< certified lower bound of the signed distance of tool_m, or -inf */
    double still_s;      /**< time since tool_m last changed, at most 50 ms */
    uint32_t is_known;   /**< 0: nothing above is valid */
    uint32_t is_touching;
} shcdi_contact;

/** One block without pointers: this header, the contacts [tool][body], the effects' memory [tool].
 *  All zero bytes after the header mean: nothing known, nothing touched. */
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
    uint32_t flags; /**< shcd_tool_output_flag */
    uint32_t n_evaluations;
    uint32_t n_patches;
} shcdi_gap;

/** Certified lower bound of the body's signed distance at p, from the enclosing ball and from the
 *  last query; costs no evaluation of the surface. */
double shcdi_contact_lower_bound(const shcdi_body *body, const shcdi_contact *contact, shcd_vec3 p);

/** Finds the contact of a tool of radius radius_m, centre p (body frame), dt_s after the last tick,
 *  and remembers it. */
void shcdi_contact_update(const shcdi_body *body, double radius_m, shcd_vec3 p, double dt_s,
                          shcdi_contact *contact, shcdi_gap *out);

/** |q|^2 within SHCDI_QUATERNION_TOLERANCE of 1; false for NaN. */
bool shcdi_is_rotation(shcd_quat q);

/** Each coordinate finite and at most SHCDI_MAGNITUDE_MAX. */
bool shcdi_is_moderate(shcd_vec3 v);

#endif
