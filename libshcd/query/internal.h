/* SPDX-License-Identifier: BSD-3-Clause */
/* The tiers behind shcd_closest(). */
#ifndef SHCDI_QUERY_INTERNAL_H
#define SHCDI_QUERY_INTERNAL_H

#include "model/model.h"
#include "shcd/query.h"

/** The map tier, on the model's own map or another one of it; fills a zeroed result. RT safe. */
void shcdi_query_map(const shcd_model *model, const shcdi_map *map, shcd_vec3 p, int hermite,
                     shcd_proximity *out);

/** The fast and exact tiers; fills a zeroed result. RT safe. */
void shcdi_query_certified(const shcd_model *model, shcd_vec3 p, const shcd_query_options *options,
                           shcd_proximity *out);

#endif
