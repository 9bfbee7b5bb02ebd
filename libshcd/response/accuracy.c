/* SPDX-License-Identifier: BSD-3-Clause */
/* Accuracy within a tick: from a budget to counts, and from counts to the tier that answers.
 *
 * Nothing here reads a clock. A budget in microseconds is spent by counts, each evaluation and each
 * bound at the price that the cost table measured, so that a replay decides as the tick did. */
#include "response/accuracy.h"

#include "response/proxy.h"

/* The smallest caps that a query gets: a search that visits no leaf at all finds no foot. */
#define EVALUATIONS_LEAST 8u
#define PATCHES_LEAST 64u

/* Where a table says nothing of prices: an evaluation is taken for so many bounds. Only the split
 * of a budget hangs on it, its sum does not: see shcd_body_accuracy_of(). */
#define PATCHES_OF_AN_EVALUATION 32.0

/* ---- from a table to a body ---- */

static double usual_ns(const shcd_cost_row *rows, size_t n_rows, int degree, int tier,
                       const shcd_body_accuracy *price) {
    for (size_t i = 0; i < n_rows; i++) {
        if (rows[i].degree == degree && rows[i].tier == tier) {
            return rows[i].evaluations_mean * price->evaluation_ns +
                   rows[i].patches_mean * price->patch_ns;
        }
    }
    return 0.0;
}

shcd_status shcd_body_accuracy_of(const shcd_cost_row *rows, size_t n_rows, size_t row,
                                  double budget_us, shcd_body_accuracy *accuracy) {
    if (rows == NULL || row >= n_rows || accuracy == NULL || budget_us < 0.0) {
        return SHCD_ERR_ARGUMENT;
    }
    if (!shcdi_is_finite(budget_us)) {
        return SHCD_ERR_NOT_FINITE;
    }
    const shcd_cost_row *chosen = &rows[row];
    shcd_body_accuracy made = {.tier = chosen->tier,
                               .map_hermite = chosen->interpolation == SHCD_MAP_HERMITE,
                               .budget_us = budget_us};
    /* without prices: those by which the row's usual query costs its median time */
    const double usual = chosen->evaluations_mean + chosen->patches_mean / PATCHES_OF_AN_EVALUATION;
    made.evaluation_ns = chosen->evaluation_ns > 0.0
                             ? chosen->evaluation_ns
                             : shcdi_max(1.0, chosen->ns_p50 / shcdi_max(1.0, usual));
    made.patch_ns =
        chosen->patch_ns > 0.0 ? chosen->patch_ns : made.evaluation_ns / PATCHES_OF_AN_EVALUATION;
    const double evaluations_ns = chosen->evaluations_mean * made.evaluation_ns;
    const double both_ns = evaluations_ns + chosen->patches_mean * made.patch_ns;
    if (both_ns > 0.0) {
        made.evaluation_share = shcdi_min(0.9, shcdi_max(0.1, evaluations_ns / both_ns));
    }
    made.exact_ns = usual_ns(rows, n_rows, chosen->degree, SHCD_TIER_EXACT, &made);
    made.fast_ns = usual_ns(rows, n_rows, chosen->degree, SHCD_TIER_FAST, &made);
    *accuracy = made;
    return SHCD_OK;
}

shcd_status shcdi_accuracy_check(const char *body, const shcd_body_accuracy *accuracy,
                                 shcd_error *error) {
    const double values[] = {
        accuracy->tolerance, accuracy->budget_us, accuracy->evaluation_ns,   accuracy->patch_ns,
        accuracy->exact_ns,  accuracy->fast_ns,   accuracy->evaluation_share};
    for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) {
        if (!shcdi_is_finite(values[i])) {
            return shcdi_fail(error, SHCD_ERR_NOT_FINITE,
                              "scene_create: body '%s': a value of its accuracy is not finite",
                              body);
        }
        if (values[i] < 0.0) {
            return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                              "scene_create: body '%s': a value of its accuracy is negative (%g)",
                              body, values[i]);
        }
    }
    if (accuracy->tier < SHCD_TIER_EXACT || accuracy->tier > SHCD_TIER_TRACK) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, "scene_create: body '%s': unknown tier %d",
                          body, (int)accuracy->tier);
    }
    if (accuracy->evaluation_share > 1.0) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: body '%s': evaluation_share is %g, above 1", body,
                          accuracy->evaluation_share);
    }
    if (accuracy->budget_us > 0.0 && !(accuracy->evaluation_ns > 0.0 && accuracy->patch_ns > 0.0)) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "scene_create: body '%s': a budget needs evaluation_ns and patch_ns",
                          body);
    }
    return SHCD_OK;
}

uint64_t shcdi_accuracy_hash(uint64_t h, const shcd_body_accuracy *accuracy,
                             uint64_t (*hash)(uint64_t h, const void *bytes, size_t n)) {
    shcd_body_accuracy values = *accuracy;
    shcd_map_info info = SHCD_MAP_INFO_INIT;
    values.map = NULL;
    if (accuracy->map != NULL && shcd_map_describe(accuracy->map, &info) == SHCD_OK) {
        const int32_t map[2] = {info.grid, info.resolution};
        h = hash(h, map, sizeof map);
        h = hash(h, &info.centre_m, sizeof info.centre_m);
    }
    return hash(h, &values, sizeof values);
}

/* ---- within a tick ---- */

int shcdi_lower_tier(int a, int b) {
    static const int certainty[] = {
        [SHCD_TIER_MAP] = 0, [SHCD_TIER_TRACK] = 1, [SHCD_TIER_FAST] = 2, [SHCD_TIER_EXACT] = 3};
    return certainty[a] < certainty[b] ? a : b;
}

int shcdi_tier_within(const shcd_body_accuracy *accuracy, double rest_ns, bool has_foot) {
    int tier = accuracy->tier;
    if (accuracy->budget_us > 0.0) {
        if (tier == SHCD_TIER_EXACT && rest_ns < accuracy->exact_ns) {
            tier = SHCD_TIER_FAST;
        }
        if (tier == SHCD_TIER_FAST && rest_ns < accuracy->fast_ns) {
            tier = SHCD_TIER_TRACK;
        }
    }
    return tier == SHCD_TIER_TRACK && !has_foot ? SHCD_TIER_FAST : tier;
}

static uint32_t cap_for(double money_ns, double price_ns, uint32_t least, uint32_t most) {
    const double n = money_ns / price_ns;
    return n >= (double)most ? most : n > (double)least ? (uint32_t)n : least;
}

void shcdi_limit(const shcd_body_accuracy *accuracy, double rest_ns, shcd_query_options *options) {
    const double share = accuracy->evaluation_share > 0.0 ? accuracy->evaluation_share : 0.5;
    if (accuracy->budget_us > 0.0) {
        options->evaluations_max = cap_for(share * rest_ns, accuracy->evaluation_ns,
                                           EVALUATIONS_LEAST, options->evaluations_max);
        options->patches_max = cap_for((1.0 - share) * rest_ns, accuracy->patch_ns, PATCHES_LEAST,
                                       options->patches_max);
    }
}

void shcdi_answered_by(const shcd_body_accuracy *accuracy, int tier, shcdi_gap *out) {
    out->tier = shcdi_lower_tier(out->tier, tier);
    if (tier != accuracy->tier && shcdi_lower_tier(tier, accuracy->tier) == tier) {
        out->flags |= SHCD_TOOL_OUTPUT_DEGRADED;
    }
}

int shcdi_plan(const shcdi_body *body, const shcdi_tool *tool, bool has_foot, const shcdi_gap *out,
               shcd_query_options *options) {
    const shcd_body_accuracy *accuracy = &body->accuracy;
    const double rest_ns = shcdi_max(
        0.0, out->allowance_ns - shcdi_spent(accuracy, out->n_evaluations, out->n_patches));
    const int tier = shcdi_tier_within(accuracy, rest_ns, has_foot);
    shcdi_set_caps(body, tool, options);
    shcdi_limit(accuracy, rest_ns, options);
    options->tier = tier;
    options->map_hermite = accuracy->map_hermite;
    options->tolerance = accuracy->tolerance;
    return tier;
}

shcd_status shcdi_ask(const shcdi_body *body, const shcdi_tool *tool, shcd_vec3 p,
                      shcdi_contact *contact, shcd_proximity *found, shcdi_gap *out) {
    const shcd_body_accuracy *accuracy = &body->accuracy;
    shcd_query_options options = SHCD_QUERY_OPTIONS_INIT;
    const int tier = shcdi_plan(body, tool, contact->is_known != 0, out, &options);
    shcd_status status;
    if (tier == SHCD_TIER_EXACT) {
        status =
            shcd_closest_next(body->model, out->shape, p, &options, &contact->certificate, found);
    } else if (tier == SHCD_TIER_TRACK) {
        status = shcdi_track_now(body, out->shape, p, contact->proxy.parameter, found);
    } else if (tier == SHCD_TIER_MAP && accuracy->map != NULL && out->shape == NULL) {
        status = shcd_map_query(accuracy->map, p, accuracy->map_hermite, found);
    } else {
        status = shcdi_closest_now(body, out->shape, p, &options, found);
    }
    if (status == SHCD_OK) {
        shcdi_count(out, found);
        out->flags |= shcdi_output_flags(found->flags);
        shcdi_answered_by(accuracy, tier, out);
    }
    return status;
}
