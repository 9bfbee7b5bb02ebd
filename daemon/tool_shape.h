/* SPDX-License-Identifier: BSD-3-Clause */
/* The `shape` of a tool in a scene file, and the geometry that it becomes. */
#ifndef SHCDD_TOOL_SHAPE_H
#define SHCDD_TOOL_SHAPE_H

#include "yaml_tree.h"

#include "shcd/shcd.h"

/** What to write where a shape is missing. */
#define TOOL_SHAPE_HINT                                                                            \
    "point, or one of sphere, capsule, box, hull, shell, like {sphere: {radius_m: r}}"

/** A shape whose files are not read yet. All zero: a point. */
typedef struct tool_shape {
    const yaml_node *node;       /**< the value of the shape's name */
    const yaml_node *file_node;  /**< where complaints about the file go */
    const yaml_node *share_node; /**< contact_share; NULL: left out */
    const char *path;            /**< hull, shell; NULL: none */
    shcd_tool_geometry_def geometry;
    double contact_share; /**< 0: left out */
} tool_shape;

/** Reads everything that stands in the scene file. */
bool tool_shape_read(yaml_tree *tree, const yaml_node *node, tool_shape *shape);

/** Reads the shape's file, if it has one, and makes what the tool needs. A relative path starts at
 *  the scene file's folder.
 *  @param[out] geometry  NULL for a point and a sphere; to be freed after the scene */
bool tool_shape_make(yaml_tree *tree, const tool_shape *shape, shcd_tool_def *tool,
                     shcd_tool_geometry **geometry);

#endif
