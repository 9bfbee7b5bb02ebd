/* SPDX-License-Identifier: BSD-3-Clause */
/* The grammar of tool shapes. Lengths have limits that no tool in a hand reaches, so that a value
 * in the wrong unit is told. */
#include "tool_shape.h"

#include "point_file.h"
#include "yaml_value.h"

#include <string.h>

#define LENGTH_MIN_M 1e-5
#define LENGTH_MAX_M 1.0
#define SHARE_MIN 1e-3
#define PATH_BYTES_MAX 4095

#define COUNT(array) (sizeof(array) / sizeof(array)[0])
#define RADIUS_HINT "a length, like 0.003"

static bool read_length(const yaml_tree *tree, const yaml_node *node, double *length_m) {
    return yaml_number(tree, node, LENGTH_MIN_M, LENGTH_MAX_M, "m", length_m);
}

/* The rounding of a box or hull: 0 unless it is given. */
static bool read_rounding(const yaml_tree *tree, const yaml_node *node, double *radius_m) {
    return node == NULL || yaml_number(tree, node, 0.0, LENGTH_MAX_M, "m", radius_m);
}

static bool read_sphere(yaml_tree *tree, const yaml_node *node, tool_shape *shape) {
    yaml_field fields[] = {{"radius_m", RADIUS_HINT, NULL}};
    return yaml_fields(tree, node, "key", fields, COUNT(fields)) &&
           read_length(tree, fields[0].node, &shape->geometry.radius_m);
}

static bool read_capsule(yaml_tree *tree, const yaml_node *node, tool_shape *shape) {
    yaml_field fields[] = {{"radius_m", RADIUS_HINT, NULL},
                           {"half_length_m", "a length, like 0.02", NULL}};
    return yaml_fields(tree, node, "key", fields, COUNT(fields)) &&
           read_length(tree, fields[0].node, &shape->geometry.radius_m) &&
           read_length(tree, fields[1].node, &shape->geometry.half_length_m);
}

static bool read_box(yaml_tree *tree, const yaml_node *node, tool_shape *shape) {
    yaml_field fields[] = {{"half_extents_m", "three lengths, like [0.01, 0.005, 0.002]", NULL},
                           {"radius_m", NULL, NULL}};
    double v[3] = {0.0, 0.0, 0.0};
    if (!yaml_fields(tree, node, "key", fields, COUNT(fields)) ||
        !yaml_numbers(tree, fields[0].node, 3, LENGTH_MIN_M, LENGTH_MAX_M, "m", v) ||
        !read_rounding(tree, fields[1].node, &shape->geometry.radius_m)) {
        return false;
    }
    shape->geometry.half_extents_m = shcd_vec3_make(v[0], v[1], v[2]);
    return true;
}

static bool read_points(yaml_tree *tree, const yaml_node *list, tool_shape *shape) {
    if (!yaml_list(tree, list, "points", 4, SHCD_HULL_POINTS_MAX)) {
        return false;
    }
    shcd_vec3 *points = yaml_allocate(tree, list->count * sizeof *points);
    if (points == NULL) {
        return false;
    }
    for (const yaml_node *node = list->first; node != NULL; node = node->next) {
        double v[3] = {0.0, 0.0, 0.0};
        if (!yaml_numbers(tree, node, 3, -LENGTH_MAX_M, LENGTH_MAX_M, "m", v)) {
            return false;
        }
        points[node->index] = shcd_vec3_make(v[0], v[1], v[2]);
    }
    shape->geometry.points = points;
    shape->geometry.n_points = list->count;
    return true;
}

static bool read_path(yaml_tree *tree, const yaml_node *node, tool_shape *shape) {
    shape->file_node = node;
    return yaml_text(tree, node, PATH_BYTES_MAX, &shape->path);
}

static bool read_hull(yaml_tree *tree, const yaml_node *node, tool_shape *shape) {
    enum { POINTS, FILE_NAME, RADIUS };
    yaml_field fields[] = {[POINTS] = {"points_m", NULL, NULL},
                           [FILE_NAME] = {"file", NULL, NULL},
                           [RADIUS] = {"radius_m", NULL, NULL}};
    if (!yaml_fields(tree, node, "key", fields, COUNT(fields)) ||
        !read_rounding(tree, fields[RADIUS].node, &shape->geometry.radius_m)) {
        return false;
    }
    const yaml_node *points = fields[POINTS].node, *file = fields[FILE_NAME].node;
    if (points != NULL && file != NULL) {
        return yaml_fail_at_key(tree, points->index > file->index ? points : file,
                                "a hull has its points here or in a file; remove one");
    }
    if (points == NULL && file == NULL) {
        return yaml_fail_missing(tree, node, "points_m",
                                 "missing; must be a list of points [x, y, z], unless they stand "
                                 "in a file: name");
    }
    return points != NULL ? read_points(tree, points, shape) : read_path(tree, file, shape);
}

static bool read_shell(yaml_tree *tree, const yaml_node *node, tool_shape *shape) {
    yaml_field fields[] = {{"file", "the path of a file with lines x,y,z,nx,ny,nz", NULL},
                           {"contact_share", NULL, NULL}};
    shape->share_node = NULL;
    if (!yaml_fields(tree, node, "key", fields, COUNT(fields)) ||
        !read_path(tree, fields[0].node, shape)) {
        return false;
    }
    shape->share_node = fields[1].node;
    return fields[1].node == NULL ||
           yaml_number(tree, fields[1].node, SHARE_MIN, 1.0, NULL, &shape->contact_share);
}

bool tool_shape_read(yaml_tree *tree, const yaml_node *node, tool_shape *shape) {
    static const struct {
        const char *name;
        int32_t kind;
        bool (*read)(yaml_tree *tree, const yaml_node *node, tool_shape *shape);
    } kinds[] = {{"sphere", SHCD_TOOL_SPHERE, read_sphere},
                 {"capsule", SHCD_TOOL_CAPSULE, read_capsule},
                 {"box", SHCD_TOOL_BOX, read_box},
                 {"hull", SHCD_TOOL_HULL, read_hull},
                 {"shell", SHCD_TOOL_SHELL, read_shell}};
    const shcd_tool_geometry_def blank = SHCD_TOOL_GEOMETRY_DEF_INIT;
    char excerpt[YAML_EXCERPT_SIZE];
    yaml_field fields[COUNT(kinds)] = {{NULL, NULL, NULL}};
    shape->node = node;
    shape->geometry = blank;
    if (node->kind == YAML_SCALAR && node->length > 0) {
        return yaml_equals(node, "point") ||
               yaml_fail(tree, node, "unknown shape '%s'; known: " TOOL_SHAPE_HINT,
                         yaml_excerpt(node, excerpt));
    }
    if (node->kind != YAML_MAP || node->count == 0) {
        return yaml_fail(tree, node, "holds no shape, must be " TOOL_SHAPE_HINT);
    }
    for (size_t i = 0; i < COUNT(kinds); i++) {
        fields[i].name = kinds[i].name;
    }
    if (!yaml_fields(tree, node, "shape", fields, COUNT(fields))) {
        return false;
    }
    if (node->count > 1) {
        return yaml_fail_at_key(tree, node->first->next, "a tool has one shape; remove one");
    }
    for (size_t i = 0; i < COUNT(kinds); i++) {
        if (fields[i].node != NULL) {
            shape->node = fields[i].node;
            shape->geometry.kind = kinds[i].kind;
            return kinds[i].read(tree, fields[i].node, shape);
        }
    }
    return true;
}

/* ---- making --------------------------------------------------------------------------------- */

/* A shell from points alone: inwards is towards their mean, as for any tool that is about round. */
static bool guess_normals(yaml_tree *tree, point_file *file) {
    shcd_vec3 mean = {0.0, 0.0, 0.0};
    file->normals = yaml_allocate(tree, file->n * sizeof *file->normals);
    if (file->normals == NULL) {
        return false;
    }
    for (size_t i = 0; i < file->n; i++) {
        mean = shcd_mul_add(mean, 1.0 / (double)file->n, file->points[i]);
    }
    for (size_t i = 0; i < file->n; i++) {
        const shcd_vec3 inward = shcd_sub(mean, file->points[i]);
        file->normals[i] = shcd_norm(inward) > 0.0 ? shcd_unit(inward) : shcd_vec3_make(0, 0, 1);
    }
    return true;
}

/* Three decimals are precise enough to be taken as a unit vector. */
static bool unify_normals(yaml_tree *tree, const tool_shape *shape, const point_file *file) {
    for (size_t i = 0; i < file->n; i++) {
        const double length = shcd_norm(file->normals[i]);
        if (!(length > 0.99 && length < 1.01)) {
            return yaml_fail(tree, shape->file_node,
                             "%s: the normal of point %zu has length %.6g, must be 1", shape->path,
                             i + 1, length);
        }
        file->normals[i] = shcd_scale(1.0 / length, file->normals[i]);
    }
    return true;
}

static bool read_file(yaml_tree *tree, const tool_shape *shape, shcd_tool_geometry_def *def) {
    const bool is_shell = def->kind == SHCD_TOOL_SHELL;
    point_file file = {0, NULL, NULL};
    if (!point_file_read(tree, shape->file_node, shape->path,
                         is_shell ? SHCD_SHELL_POINTS_MAX : SHCD_HULL_POINTS_MAX, &file)) {
        return false;
    }
    for (size_t i = 0; i < file.n; i++) {
        if (!(shcd_norm(file.points[i]) <= 2.0 * LENGTH_MAX_M)) {
            return yaml_fail(tree, shape->file_node,
                             "%s: point %zu is %.6g m from the tool's origin, must be within 2 m; "
                             "the file is read in metres",
                             shape->path, i + 1, shcd_norm(file.points[i]));
        }
    }
    if (is_shell &&
        !(file.normals == NULL ? guess_normals(tree, &file) : unify_normals(tree, shape, &file))) {
        return false;
    }
    def->points = file.points;
    def->normals = is_shell ? file.normals : NULL;
    def->n_points = file.n;
    return true;
}

bool tool_shape_make(yaml_tree *tree, const tool_shape *shape, shcd_tool_def *tool,
                     shcd_tool_geometry **geometry) {
    shcd_tool_geometry_def def = shape->geometry;
    shcd_error problem = {SHCD_OK, ""};
    tool->kind = def.kind;
    if (def.kind == SHCD_TOOL_POINT || def.kind == SHCD_TOOL_SPHERE) {
        tool->radius_m = def.radius_m;
        return true;
    }
    if (shape->path != NULL && !read_file(tree, shape, &def)) {
        return false;
    }
    if (shcd_tool_geometry_create(&def, NULL, geometry, &problem) != SHCD_OK) {
        return yaml_fail(tree, shape->node, "no tool can be made from it: %s", problem.message);
    }
    tool->geometry = *geometry;
    tool->contact_share = shape->contact_share;
    return true;
}
