/* SPDX-License-Identifier: BSD-3-Clause */
/* A YAML file as a small tree in which every value knows its line, column and path, so that each
 * complaint can name its place. The tree holds the part of YAML that a scene needs: maps with text
 * keys, lists and scalars. Anchors, aliases, merge keys, tags, directives and further documents are
 * refused: in a file that sets forces, what stands at a place should be what counts there. */
#ifndef SHCDD_YAML_TREE_H
#define SHCDD_YAML_TREE_H

#include <stdbool.h>
#include <stddef.h>

#define YAML_DEPTH_MAX 16

typedef enum yaml_kind { YAML_SCALAR, YAML_LIST, YAML_MAP } yaml_kind;

/** Both from 1; columns count characters. */
typedef struct yaml_place {
    unsigned line, column;
} yaml_place;

typedef struct yaml_node {
    yaml_kind kind;
    bool is_plain;    /**< a scalar without quotes */
    yaml_place at;    /**< of the first character */
    const char *text; /**< of a scalar; a zero byte follows, and may also stand inside */
    size_t length;    /**< of the text in bytes */
    struct yaml_node *parent, *first, *last, *next;
    struct yaml_node *key; /**< scalar; NULL unless the parent is a map */
    size_t index;          /**< place in the parent, from 0 */
    size_t count;          /**< of children */
} yaml_node;

/** The tree, the memory that belongs to it, and where complaints go. */
typedef struct yaml_tree {
    const char *file; /**< borrowed: starts every complaint */
    char *error;      /**< borrowed: receives one line */
    size_t error_size;
    yaml_node *root; /**< not NULL after a successful yaml_read() */
    size_t n_nodes;
    struct yaml_block *blocks;
} yaml_tree;

/** Releases all memory of the tree. */
void yaml_release(yaml_tree *tree);

/** Zeroed memory that lives as long as the tree; NULL (with a complaint written) if there is
 *  none. */
void *yaml_allocate(yaml_tree *tree, size_t size);

/** A path of the file, which starts at the file's folder unless it is absolute, so that a folder of
 *  scenes can be moved; NULL (with a complaint written) if there is no memory. */
const char *yaml_resolve_path(yaml_tree *tree, const char *path);

#define YAML_EXCERPT_SIZE 48
/** The start of a scalar's text, short enough to be quoted in a complaint. */
const char *yaml_excerpt(const yaml_node *node, char buffer[static YAML_EXCERPT_SIZE]);

/** Writes "FILE:LINE:COLUMN: PATH: message" and returns false, as do those below. The path is the
 *  node's ("scene" for NULL), with a further key if that is not NULL. */
bool yaml_fail_at(const yaml_tree *tree, yaml_place at, const yaml_node *node, const char *key,
                  const char *format, ...) __attribute__((format(printf, 5, 6)));
/** The same, at the place of the node; NULL: the start of the file. */
bool yaml_fail(const yaml_tree *tree, const yaml_node *node, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/** The same, with the place of the node's key. */
bool yaml_fail_at_key(const yaml_tree *tree, const yaml_node *node, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
/** The same, about a key that the map lacks. */
bool yaml_fail_missing(const yaml_tree *tree, const yaml_node *map, const char *key,
                       const char *format, ...) __attribute__((format(printf, 4, 5)));
/** For a file that cannot be read, without a place: "FILE: message" and strerror(reason) unless
 * that is 0. */
bool yaml_fail_file(const yaml_tree *tree, const char *message, int reason);

#endif
