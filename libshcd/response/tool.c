/* SPDX-License-Identifier: BSD-3-Clause */
/* The tools of a scene: from a definition and a geometry to what a tick needs. */
#include "response/scene_private.h"

/* Contacts that a shell can have with one body at a time. Each costs an evaluation or more, so that
 * the cap of a tick, 400 by default, comes first. */
#define SLOTS_MIN 512u

/* ---- checks --------------------------------------------------------------------------------- */

static shcd_status check_radius(const shcd_tool_def *tool, shcd_error *error) {
    if (!shcdi_is_finite(tool->radius_m)) {
        return shcdi_fail(error, SHCD_ERR_NOT_FINITE,
                          "scene_create: tool '%s': radius_m is not finite", tool->name);
    }
    if (tool->kind == SHCD_TOOL_POINT && tool->radius_m != 0.0) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: tool '%s': a point has radius_m 0, not %g m", tool->name,
                          tool->radius_m);
    }
    if (tool->kind == SHCD_TOOL_SPHERE &&
        !(tool->radius_m > 0.0 && tool->radius_m <= SHCDI_MAGNITUDE_MAX)) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: tool '%s': radius_m is %g, must lie above 0, up to %g m",
                          tool->name, tool->radius_m, SHCDI_MAGNITUDE_MAX);
    }
    return SHCD_OK;
}

static shcd_status check_geometry(const shcd_tool_def *tool, shcd_error *error) {
    const shcd_tool_geometry *geometry = tool->geometry;
    if (geometry == NULL) {
        return tool->kind == SHCD_TOOL_POINT || tool->kind == SHCD_TOOL_SPHERE
                   ? check_radius(tool, error)
                   : shcdi_fail(error, SHCD_ERR_ARGUMENT,
                                "scene_create: tool '%s': kind %d needs a geometry", tool->name,
                                (int)tool->kind);
    }
    if (shcdi_tool_kind(geometry) != tool->kind) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: tool '%s': kind is %d, that of its geometry %d",
                          tool->name, (int)tool->kind, shcdi_tool_kind(geometry));
    }
    if (!(shcdi_tool_bounding_radius(geometry) <= SHCDI_MAGNITUDE_MAX)) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: tool '%s': its geometry reaches beyond %g m from its "
                          "origin",
                          tool->name, SHCDI_MAGNITUDE_MAX);
    }
    return SHCD_OK;
}

shcd_status shcdi_tool_check(const shcd_tool_def *tool, shcd_error *error) {
    if (tool->kind < SHCD_TOOL_POINT || tool->kind > SHCD_TOOL_SHELL) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, "scene_create: tool '%s': unknown kind %d",
                          tool->name, (int)tool->kind);
    }
    if (!shcdi_is_finite(tool->contact_share)) {
        return shcdi_fail(error, SHCD_ERR_NOT_FINITE,
                          "scene_create: tool '%s': contact_share is not finite", tool->name);
    }
    if (tool->contact_share < 0.0 || tool->contact_share > 1.0) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: tool '%s': contact_share is %g, must lie above 0, up to 1",
                          tool->name, tool->contact_share);
    }
    return check_geometry(tool, error);
}

/* ---- building ------------------------------------------------------------------------------- */

size_t shcdi_tool_bytes(const shcd_tool_def *tool) {
    return tool->kind == SHCD_TOOL_SHELL ? shcdi_shell_bytes(shcdi_tool_point_count(tool->geometry))
                                         : 0;
}

/* About the middle of the box that holds the core, or of the points of a shell. */
static void set_ball(shcdi_tool *tool) {
    const shcd_tool_geometry *geometry = tool->geometry;
    const shcd_vec3 *point = shcdi_tool_points(geometry);
    const size_t n = shcdi_tool_point_count(geometry);
    double radius_m = 0.0;
    if (n == 0) {
        tool->ball_centre_m = geometry->middle_m;
        radius_m = shcd_norm(geometry->half_m);
    } else {
        shcd_vec3 low = point[0], high = point[0];
        for (size_t i = 1; i < n; i++) {
            low.x = shcdi_min(low.x, point[i].x);
            low.y = shcdi_min(low.y, point[i].y);
            low.z = shcdi_min(low.z, point[i].z);
            high.x = shcdi_max(high.x, point[i].x);
            high.y = shcdi_max(high.y, point[i].y);
            high.z = shcdi_max(high.z, point[i].z);
        }
        tool->ball_centre_m = shcd_scale(0.5, shcd_add(low, high));
        for (size_t i = 0; i < n; i++) {
            radius_m = shcdi_max(radius_m, shcd_norm(shcd_sub(point[i], tool->ball_centre_m)));
        }
    }
    /* rounding of coordinates and norm, outward */
    tool->ball_radius_m = (radius_m + shcdi_tool_radius(geometry)) * (1.0 + 0x1p-48) +
                          0x1p-48 * shcdi_tool_bounding_radius(geometry);
}

void shcdi_tool_fill(const shcd_tool_def *definition, unsigned char *memory, shcdi_tool *tool) {
    const bool is_round =
        definition->kind == SHCD_TOOL_POINT || definition->kind == SHCD_TOOL_SPHERE;
    const double share = definition->contact_share > 0.0 ? definition->contact_share : 1.0;
    tool->kind = definition->kind;
    tool->evaluations_max = definition->evaluations_max;
    tool->contact_share = share;
    if (is_round) {
        tool->radius_m = definition->geometry != NULL ? shcdi_tool_radius(definition->geometry)
                                                      : definition->radius_m;
        tool->ball_radius_m = tool->radius_m;
        return;
    }
    tool->geometry = definition->geometry;
    tool->radius_m = shcdi_tool_radius(tool->geometry);
    set_ball(tool);
    if (tool->kind == SHCD_TOOL_SHELL) {
        shcdi_shell *shell = &tool->shell;
        shcdi_shell_build(tool->geometry, memory, shell);
        const uint32_t wanted =
            tool->evaluations_max > SLOTS_MIN ? tool->evaluations_max : SLOTS_MIN;
        shell->n_slots = shell->n_points < wanted ? shell->n_points : wanted;
        shell->point_share = 1.0 / (share * (double)shell->n_points);
        shell->body_bytes = shcdi_shell_state_bytes(shell);
    }
}
