/* SPDX-License-Identifier: BSD-3-Clause */
/* Checks a tool's definition and builds its constant geometry.
 *
 * A shell is ordered by farthest-point sampling: each next point is the one farthest from all
 * before it, so that the first n cover the tool within covering_m[n - 1], at most twice the best
 * that n of its points could (Gonzalez, Clustering to minimize the maximum intercluster distance,
 * TCS 38, 1985). */
#include "query/tool_geometry.h"

#include "query/hull.h"

#include <string.h>

#define SIZE_MAX_M 1e6
#define UNIT_TOLERANCE 1e-6
#define WHO "tool_geometry_create: "

static shcd_status check_length(double value, const char *name, shcd_error *error) {
    if (!shcdi_is_finite(value)) {
        return shcdi_fail(error, SHCD_ERR_NOT_FINITE, WHO "%s is not finite", name);
    }
    if (value < 0.0 || value > SIZE_MAX_M) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, WHO "%s is %g, expected 0 to %g m", name, value,
                          SIZE_MAX_M);
    }
    return SHCD_OK;
}

static shcd_status check_lengths(const shcd_tool_geometry_def *def, shcd_error *error) {
    const struct {
        double value;
        const char *name;
        int matters;
    } lengths[5] = {
        {def->radius_m, "radius_m", def->kind != SHCD_TOOL_POINT && def->kind != SHCD_TOOL_SHELL},
        {def->half_length_m, "half_length_m", def->kind == SHCD_TOOL_CAPSULE},
        {def->half_extents_m.x, "half_extents_m.x", def->kind == SHCD_TOOL_BOX},
        {def->half_extents_m.y, "half_extents_m.y", def->kind == SHCD_TOOL_BOX},
        {def->half_extents_m.z, "half_extents_m.z", def->kind == SHCD_TOOL_BOX}};
    for (int i = 0; i < 5; i++) {
        const shcd_status status =
            lengths[i].matters ? check_length(lengths[i].value, lengths[i].name, error) : SHCD_OK;
        if (status != SHCD_OK) {
            return status;
        }
    }
    return SHCD_OK;
}

static shcd_status check_points(const shcd_tool_geometry_def *def, size_t n_min, size_t n_max,
                                shcd_error *error) {
    if (def->points == NULL || def->n_points < n_min || def->n_points > n_max) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, WHO "%zu points, expected %zu to %zu",
                          def->points != NULL ? def->n_points : 0, n_min, n_max);
    }
    for (size_t i = 0; i < def->n_points; i++) {
        if (!shcd_vec3_is_finite(def->points[i])) {
            return shcdi_fail(error, SHCD_ERR_NOT_FINITE, WHO "point %zu is not finite", i);
        }
        if (!(shcd_norm(def->points[i]) <= SIZE_MAX_M)) {
            return shcdi_fail(error, SHCD_ERR_ARGUMENT, WHO "point %zu is farther than %g m away",
                              i, SIZE_MAX_M);
        }
    }
    return SHCD_OK;
}

static shcd_status check_normals(const shcd_tool_geometry_def *def, shcd_error *error) {
    if (def->normals == NULL) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, WHO "a shell needs normals");
    }
    for (size_t i = 0; i < def->n_points; i++) {
        if (!shcd_vec3_is_finite(def->normals[i])) {
            return shcdi_fail(error, SHCD_ERR_NOT_FINITE, WHO "normal %zu is not finite", i);
        }
        if (!(fabs(shcd_norm(def->normals[i]) - 1.0) <= UNIT_TOLERANCE)) {
            return shcdi_fail(error, SHCD_ERR_ARGUMENT, WHO "normal %zu is not a unit vector", i);
        }
    }
    return SHCD_OK;
}

static shcd_status check(const shcd_tool_geometry_def *given, shcd_tool_geometry_def *def,
                         shcd_error *error) {
    if (given == NULL || given->struct_size < offsetof(shcd_tool_geometry_def, radius_m)) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, WHO "no definition, or struct_size not set");
    }
    memset(def, 0, sizeof *def);
    memcpy(def, given, given->struct_size < sizeof *def ? given->struct_size : sizeof *def);
    if (def->kind < SHCD_TOOL_POINT || def->kind > SHCD_TOOL_SHELL || def->reserved0 != 0) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, WHO "kind %d is unknown", (int)def->kind);
    }
    shcd_status status = check_lengths(def, error);
    if (status == SHCD_OK && def->kind == SHCD_TOOL_HULL) {
        status = check_points(def, 4, SHCD_HULL_POINTS_MAX, error);
    }
    if (status == SHCD_OK && def->kind == SHCD_TOOL_SHELL) {
        status = check_points(def, 1, SHCD_SHELL_POINTS_MAX, error);
        status = status == SHCD_OK ? check_normals(def, error) : status;
    }
    return status;
}

/* One block for the geometry and its arrays: doubles first to last, so that all are aligned. */
static shcd_tool_geometry *allocate(const shcd_allocator *allocator, size_t n_points,
                                    size_t n_normals, size_t n_covering, size_t n_faces) {
    const size_t size = sizeof(shcd_tool_geometry) + (n_points + n_normals) * sizeof(shcd_vec3) +
                        n_covering * sizeof(double) + n_faces * sizeof(shcdi_hull_face);
    shcd_tool_geometry *tool = allocator->allocate(size, allocator->user);
    if (tool != NULL) {
        memset(tool, 0, size);
        tool->allocator = *allocator;
        tool->n_points = n_points;
        tool->n_faces = n_faces;
        tool->point_m = (shcd_vec3 *)(tool + 1);
        tool->normal = tool->point_m + n_points;
        tool->covering_m = (double *)(tool->normal + n_normals);
        tool->face = (shcdi_hull_face *)(tool->covering_m + n_covering);
    }
    return tool;
}

/* Box around the points, and the farthest of them from the origin. */
static void measure_points(shcd_tool_geometry *tool) {
    shcd_vec3 low = tool->point_m[0], high = low;
    for (size_t i = 0; i < tool->n_points; i++) {
        const shcd_vec3 p = tool->point_m[i];
        low = shcd_vec3_make(shcdi_min(low.x, p.x), shcdi_min(low.y, p.y), shcdi_min(low.z, p.z));
        high =
            shcd_vec3_make(shcdi_max(high.x, p.x), shcdi_max(high.y, p.y), shcdi_max(high.z, p.z));
        tool->bounding_m = shcdi_max(tool->bounding_m, shcd_norm(p));
    }
    tool->middle_m = shcd_scale(0.5, shcd_add(low, high));
    /* half of a rounded difference about a rounded middle: the box must still hold the points */
    tool->half_m = shcd_scale(0.5 + 1e-15, shcd_sub(high, low));
    tool->half_m.x += 4.5e-16 * fabs(tool->middle_m.x);
    tool->half_m.y += 4.5e-16 * fabs(tool->middle_m.y);
    tool->half_m.z += 4.5e-16 * fabs(tool->middle_m.z);
}

static void fill_hull(const shcd_tool_geometry_def *def, const shcdi_hull *hull,
                      const unsigned char *used, shcd_tool_geometry *tool) {
    size_t n = 0;
    for (size_t i = 0; i < def->n_points; i++) {
        if (used[i]) {
            tool->point_m[n++] = def->points[i];
        }
    }
    /* every face outward of every vertex, whatever rounding made of its plane */
    for (size_t k = 0; k < hull->n; k++) {
        shcdi_hull_face *face = &tool->face[k];
        face->normal = hull->triangle[k].normal;
        face->offset_m = -HUGE_VAL;
        for (size_t i = 0; i < n; i++) {
            face->offset_m = shcdi_max(face->offset_m, shcd_dot(face->normal, tool->point_m[i]));
        }
    }
}

static shcd_status create_hull(const shcd_tool_geometry_def *def, const shcd_allocator *allocator,
                               shcd_tool_geometry **geometry, shcd_error *error) {
    unsigned char used[SHCD_HULL_POINTS_MAX] = {0};
    size_t n_used = 0;
    shcdi_hull *hull = allocator->allocate(sizeof *hull, allocator->user);
    if (hull == NULL) {
        return shcdi_fail(error, SHCD_ERR_MEMORY, WHO "out of memory");
    }
    if (!shcdi_hull_of(def->points, def->n_points, hull)) {
        allocator->release(hull, allocator->user);
        return shcdi_fail(error, SHCD_ERR_GEOMETRY, WHO "the points of the hull lie in a plane");
    }
    for (size_t k = 0; k < hull->n; k++) {
        for (int i = 0; i < 3; i++) {
            used[hull->triangle[k].v[i]] = 1;
        }
    }
    for (size_t i = 0; i < def->n_points; i++) {
        n_used += used[i];
    }
    *geometry = allocate(allocator, n_used, 0, 0, hull->n);
    if (*geometry != NULL) {
        fill_hull(def, hull, used, *geometry);
        measure_points(*geometry);
    }
    allocator->release(hull, allocator->user);
    return *geometry != NULL ? SHCD_OK : shcdi_fail(error, SHCD_ERR_MEMORY, WHO "out of memory");
}

/* ---- shells ---- */

static void swap_points(shcd_tool_geometry *tool, size_t i, size_t k) {
    const shcd_vec3 p = tool->point_m[i], n = tool->normal[i];
    tool->point_m[i] = tool->point_m[k];
    tool->normal[i] = tool->normal[k];
    tool->point_m[k] = p;
    tool->normal[k] = n;
}

/* Starts from the point nearest to the box's middle. d2: squared distances to the prefix, n. */
static void order_shell(shcd_tool_geometry *tool, double *d2) {
    const size_t n = tool->n_points;
    size_t next = 0;
    double least = HUGE_VAL;
    for (size_t i = 0; i < n; i++) {
        const shcd_vec3 d = shcd_sub(tool->point_m[i], tool->middle_m);
        d2[i] = HUGE_VAL;
        if (shcd_dot(d, d) < least) {
            least = shcd_dot(d, d);
            next = i;
        }
    }
    for (size_t done = 0; done < n; done++) {
        swap_points(tool, done, next);
        d2[next] = d2[done];
        const shcd_vec3 p = tool->point_m[done];
        double most = 0.0;
        next = done + 1;
        for (size_t i = done + 1; i < n; i++) {
            const shcd_vec3 d = shcd_sub(tool->point_m[i], p);
            d2[i] = shcdi_min(d2[i], shcd_dot(d, d));
            if (d2[i] > most) {
                most = d2[i];
                next = i;
            }
        }
        tool->covering_m[done] = sqrt(most) * (1.0 + 1e-15);
    }
}

static shcd_status create_shell(const shcd_tool_geometry_def *def, const shcd_allocator *allocator,
                                shcd_tool_geometry **geometry, shcd_error *error) {
    const size_t n = def->n_points;
    double *d2 = allocator->allocate(n * sizeof *d2, allocator->user);
    shcd_tool_geometry *tool = d2 != NULL ? allocate(allocator, n, n, n, 0) : NULL;
    if (tool != NULL) {
        memcpy(tool->point_m, def->points, n * sizeof *def->points);
        for (size_t i = 0; i < n; i++) {
            tool->normal[i] = shcd_unit(def->normals[i]);
        }
        measure_points(tool);
        order_shell(tool, d2);
        *geometry = tool;
    }
    if (d2 != NULL) {
        allocator->release(d2, allocator->user);
    }
    return tool != NULL ? SHCD_OK : shcdi_fail(error, SHCD_ERR_MEMORY, WHO "out of memory");
}

/* ---- public ---- */

static shcd_status create_box(const shcd_tool_geometry_def *def, const shcd_allocator *allocator,
                              shcd_tool_geometry **geometry, shcd_error *error) {
    shcd_tool_geometry *tool = allocate(allocator, 0, 0, 0, 0);
    if (tool == NULL) {
        return shcdi_fail(error, SHCD_ERR_MEMORY, WHO "out of memory");
    }
    if (def->kind == SHCD_TOOL_CAPSULE) {
        tool->half_m.z = def->half_length_m;
    } else if (def->kind == SHCD_TOOL_BOX) {
        tool->half_m = def->half_extents_m;
    }
    tool->bounding_m = shcd_norm(tool->half_m);
    *geometry = tool;
    return SHCD_OK;
}

shcd_status shcd_tool_geometry_create(const shcd_tool_geometry_def *definition,
                                      const shcd_allocator *allocator,
                                      shcd_tool_geometry **geometry, shcd_error *error) {
    shcd_tool_geometry_def def;
    shcd_tool_geometry *made = NULL;
    if (geometry == NULL) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, WHO "geometry is null");
    }
    shcd_status status = check(definition, &def, error);
    if (status != SHCD_OK) {
        return status;
    }
    const shcd_allocator from = shcdi_allocator(allocator);
    if (def.kind == SHCD_TOOL_HULL) {
        status = create_hull(&def, &from, &made, error);
    } else if (def.kind == SHCD_TOOL_SHELL) {
        status = create_shell(&def, &from, &made, error);
    } else {
        status = create_box(&def, &from, &made, error);
    }
    if (status == SHCD_OK) {
        made->kind = def.kind;
        made->radius_m =
            def.kind == SHCD_TOOL_POINT || def.kind == SHCD_TOOL_SHELL ? 0.0 : def.radius_m;
        made->bounding_m = (made->bounding_m + made->radius_m) * (1.0 + 1e-15);
        *geometry = made;
    }
    return status;
}

void shcd_tool_geometry_free(shcd_tool_geometry *geometry) {
    if (geometry != NULL) {
        const shcd_allocator allocator = geometry->allocator;
        allocator.release(geometry, allocator.user);
    }
}
