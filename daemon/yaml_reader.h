/* SPDX-License-Identifier: BSD-3-Clause */
/* Reads a YAML file of at most 1 MiB into a tree. Prints nothing. */
#ifndef SHCDD_YAML_READER_H
#define SHCDD_YAML_READER_H

#include "yaml_tree.h"

#define YAML_FILE_BYTES_MAX ((size_t)1 << 20)
#define YAML_NODES_MAX 65536

/** Reads tree->file; the caller has set file, error and error_size, and zeroed the rest. Call
 *  yaml_release() whatever the outcome. */
bool yaml_read(yaml_tree *tree);

#endif
