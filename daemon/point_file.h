/* SPDX-License-Identifier: BSD-3-Clause */
/* Points of a tool from a text file: one on each line, x,y,z or x,y,z,nx,ny,nz in metres, in the
 * tool's frame. */
#ifndef SHCDD_POINT_FILE_H
#define SHCDD_POINT_FILE_H

#include "yaml_tree.h"

#include "shcd/base.h"

typedef struct point_file {
    size_t n;
    shcd_vec3 *points;
    shcd_vec3 *normals; /**< NULL: the file has none */
} point_file;

/** Most bytes of a file, and of a line. */
#define POINT_FILE_BYTES_MAX ((size_t)16 << 20)
#define POINT_FILE_LINE_MAX 1024

/** Reads a file. Values are separated by commas or blanks; empty lines, lines that begin with # and
 *  a first line "x,y,z" or "x,y,z,nx,ny,nz" are left out; of a file whose name ends in .obj the
 *  lines "v x y z" are read and no others. All rows have the same number of values. Numbers are
 *  read in the thread's locale.
 *  @param[in]  node   where complaints about the file go: "...: KEY: NAME:LINE: what is wrong"
 *  @param[in]  name   path as the scene has it; a relative one starts at the scene file's folder
 *  @param[in]  n_max  points
 *  @param[out] file   its memory belongs to the tree; untouched on failure */
bool point_file_read(yaml_tree *tree, const yaml_node *node, const char *name, size_t n_max,
                     point_file *file);

#endif
