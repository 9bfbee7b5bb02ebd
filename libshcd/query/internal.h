/* SPDX-License-Identifier: BSD-3-Clause */
/* The tiers behind shcd_closest(). */
#ifndef SHCDI_QUERY_INTERNAL_H
#define SHCDI_QUERY_INTERNAL_H

#include "query/search.h"

/** The map tier, on the model's own map or another one of it; fills a zeroed result. RT safe. */
void shcdi_query_map(const shcd_model *model, const shcdi_map *map, shcd_vec3 p, int hermite,
                     shcd_proximity *out);

/** The fast and exact tiers; fills a zeroed result. *s keeps what was found. RT safe. */
void shcdi_query_certified(shcdi_search *s, const shcdi_view *view, shcd_vec3 p,
                           const shcd_query_options *options, shcd_proximity *out);

/** The exact tier with a foot to be expected near w: less is left to look at. Point and surface
 *  moved by at most `moved_m` since the point was on the side `last_sign`, if that is not 0. RT
 *  safe. */
void shcdi_query_certified_from(shcdi_search *s, const shcdi_view *view, shcd_vec3 p, shcd_vec3 w,
                                const shcd_query_options *options, int last_sign, double moved_m,
                                shcd_proximity *out);

/** Newton from a parameter; fills a zeroed result. RT safe. */
void shcdi_query_track(const shcdi_view *view, shcd_vec3 p, shcd_vec3 w, shcd_proximity *out);

/** Finite, and its square too. */
int shcdi_is_point(shcd_vec3 p);

/** Options read, 0 if they are not valid. */
int shcdi_query_options(const shcd_query_options *given, shcd_query_options *options);

#endif
