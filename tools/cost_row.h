/* SPDX-License-Identifier: BSD-3-Clause */
/* One way to answer a query, and what it costs: a row of the table. The members of the JSON carry
 * these names (spreads as error_max_m, error_p99_m, error_rms_m and so on); scenes read them, so
 * they stay.
 *
 * The contact band holds the points within 1 % of the diagonal from the true surface, the near band
 * those within 5 %. Errors are against the exact answer of the whole series. */
#ifndef SHCD_TOOLS_COST_ROW_H
#define SHCD_TOOLS_COST_ROW_H

#include "cost_clock.h"
#include "cost_points.h"
#include "cost_stats.h"

#include "shcd/shape.h"

/** The median of this many rounds counts; each round has points of its own. */
#define COST_ROUNDS 5

typedef struct cost_row {
    int degree;                /**< of the series; -1: a field, which has none */
    const char *tier;          /**< exact, fast, track, map; grid or adf for the fields */
    int map_resolution;        /**< map: its n; grid: cells along the longest side; else 0 */
    const char *interpolation; /**< linear or hermite; trilinear for the fields; NULL: none */
    double field_tolerance_m;  /**< adf: error at which cells are no longer split; else 0 */
    double build_s;            /**< map and fields: time to make it; else 0 */
    double radius_error_max_m; /**< map: what interpolation does to the radii it stores; else 0 */
    double radius_error_rms_m;
    cost_spread error_m;      /**< signed distance, contact band */
    cost_spread near_error_m; /**< near band */
    cost_spread normal_rad;   /**< angle between the unit normals, contact band */
    cost_spread near_normal_rad;
    cost_spread force_error_n; /**< stiffness times error of the depth max(0, -d), contact band */
    cost_spread mesh_error_m;  /**< signed distance against the mesh, its contact band */
    double ns_p50, ns_p99; /**< of one query, random points; track, which a scene asks from tick to
                                tick only: on the path */
    double path_ns_p50, path_ns_p99;          /**< exact: with the certificate of the last answer */
    double evaluations_mean, evaluations_p99; /**< of the surface, random points */
    double patches_mean;                      /**< lower bounds, random points */
    double path_evaluations_mean;
    uint64_t bytes;     /**< memory held; map: by a model whose own map is this one */
    uint64_t map_bytes; /**< map: of the map alone; else 0 */
    bool on_time_front; /**< no other row of the body is both nearer to the truth and faster */
    bool on_bytes_front;
} cost_row;

enum cost_set { COST_RANDOM, COST_PATH };

/** What a contender said about the points of one set. */
typedef struct cost_answers {
    double *distance_m;
    shcd_vec3 *normal;
    uint32_t *n_evaluations, *n_patches;
    double p50[COST_ROUNDS], p99[COST_ROUNDS]; /**< time of a query [ns] */
} cost_answers;

/** Something that answers queries. */
typedef struct cost_contender {
    /** Fills in at least distance_m, normal and n_evaluations. */
    shcd_status (*ask)(struct cost_contender *self, shcd_vec3 point, shcd_proximity *out);
    /** The same for a point that is a step away from the last one; NULL: `ask`. */
    shcd_status (*ask_next)(struct cost_contender *self, shcd_vec3 point, shcd_proximity *out);
    /** Called before a path, with the point in front of it; NULL: nothing is to be done. */
    shcd_status (*start)(struct cost_contender *self, shcd_vec3 point);
    bool needs_start;    /**< there is no answer without a last one */
    const void *subject; /**< the model, map or field; borrowed */
    shcd_query_options options;
    shcd_vec3 parameter;          /**< track: the foot of the last query */
    shcd_certificate certificate; /**< exact: what the last query on the path proved */
    cost_row row;
    cost_answers answers[2]; /**< by cost_set */
} cost_contender;

/** Both sets have the same number of points, a multiple of COST_ROUNDS. */
typedef struct cost_task {
    const cost_clock *clock;
    const cost_points *random, *path;
    double diagonal_m;
    double stiffness_n_per_m;
} cost_task;

/** Makes a contender of a model. tier: "exact", "fast" or "track". */
void cost_contender_model(const shcd_model *model, const char *tier, cost_contender *contender);

/** One round of one contender; `scratch` holds a value for each point of both sets. False:
 * reported.
 */
bool cost_measure(const cost_task *task, int round, cost_contender *contender, double *scratch);

/** Fills in the row after the last round; `scratch` as above. */
void cost_finish(const cost_task *task, cost_contender *contender, double *scratch);

/** Memory for the answers. False: no memory. */
bool cost_contender_reserve(size_t n_points, cost_contender *contender);
void cost_contender_release(cost_contender *contender);

/** Marks the rows that no row of the body beats in both max error and cost (path_ns_p50, bytes);
 *  errors closer together than `floor_m`, the tolerance of the truth, count as equal. Fields are
 *  compared with the body's rows only. */
void cost_mark_fronts(cost_contender *contenders, size_t n, double floor_m);

#endif
