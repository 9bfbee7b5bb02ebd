/* SPDX-License-Identifier: BSD-3-Clause */
/* Typed access to a YAML tree. Every function writes a complaint with its place and returns false
 * when the value is not what is asked for; outputs are then untouched. */
#ifndef SHCDD_YAML_VALUE_H
#define SHCDD_YAML_VALUE_H

#include "yaml_tree.h"

/** One key that a map may hold. */
typedef struct yaml_field {
    const char *name;
    const char *required;  /**< what to write if it is missing; NULL: optional */
    const yaml_node *node; /**< filled: the value, or NULL */
} yaml_field;

/** Takes a map apart: refuses what is not a map, unknown keys (with the list of known ones), keys
 *  given twice, and missing required ones.
 *  @param[in] what  noun for complaints, e.g. "effect" */
bool yaml_fields(const yaml_tree *tree, const yaml_node *map, const char *what, yaml_field *fields,
                 size_t n_fields);

/** A list of count_min to count_max items. */
bool yaml_list(const yaml_tree *tree, const yaml_node *node, const char *what, size_t count_min,
               size_t count_max);

/** A decimal number, read whole, finite and within [min, max].
 *  @param[in] unit  for complaints; "1" or NULL: none */
bool yaml_number(const yaml_tree *tree, const yaml_node *node, double min, double max,
                 const char *unit, double *value);

/** A list of exactly n such numbers. */
bool yaml_numbers(const yaml_tree *tree, const yaml_node *node, size_t n, double min, double max,
                  const char *unit, double *values);

/** Decimal digits, no sign, 0 .. max. */
bool yaml_integer(const yaml_tree *tree, const yaml_node *node, unsigned max, unsigned *value);

/** Text of 1 to bytes_max bytes without control characters; a plain number, null or truth value is
 *  not text. The result belongs to the tree. */
bool yaml_text(const yaml_tree *tree, const yaml_node *node, size_t bytes_max, const char **text);

/** Whether a scalar's text equals a string. */
bool yaml_equals(const yaml_node *node, const char *text);

#endif
