/* SPDX-License-Identifier: BSD-3-Clause */
/* The key `accuracy` of a body: what it may say, and which degree and tier follow from it. */
#ifndef SHCDD_SCENE_ACCURACY_H
#define SHCDD_SCENE_ACCURACY_H

#include "yaml_tree.h"

#include "shcd/shcd.h"

typedef struct scene_accuracy {
    const yaml_node *node; /**< NULL: the body states none */
    const yaml_node *against;
    double tolerance_m, budget_us; /**< 0: not given */
    bool is_against_mesh;
    unsigned tiers; /**< SHCD_TIER_BIT of those that may be chosen */
} scene_accuracy;

/** What a body gets. What is not NULL is the caller's to free, map before model. */
typedef struct scene_answer {
    shcd_model *model; /**< of a lower degree; NULL: the one given will do */
    shcd_map *map;     /**< NULL: none, or the model's own */
    shcd_body_accuracy accuracy;
} scene_answer;

/** Reads the map. */
bool scene_accuracy_read(const yaml_tree *tree, const yaml_node *node, scene_accuracy *asked);

/** Chooses from the model's cost table, or from a measurement made now if the model has none of
 * this machine: that takes up to about a second and prints a line on stderr. Another line there
 * says what was chosen.
 *  @param[in] is_whole  only the model's own degree will do: its effects need the modes or the
 *                       learned response that the model carries, and one that is cut off has none
 *  @param[in] n_tools   that share the budget */
bool scene_accuracy_resolve(const yaml_tree *tree, const scene_accuracy *asked,
                            const shcd_model *model, const char *body, bool is_whole,
                            size_t n_tools, scene_answer *answer);

#endif
