/* SPDX-License-Identifier: BSD-3-Clause */
/* Sweeps inside the library: a ball that moves in a straight line while the body deforms. */
#ifndef SHCDI_QUERY_SWEEP_H
#define SHCDI_QUERY_SWEEP_H

#include "query/view.h"
#include "shcd/sweep.h"

/** shcd_sweep() of a sphere (radius 0: a point) without its checks, for the tick.
 *  @param[in] from, to        its centre at t = 0 and t = 1, body frame
 *  @param[in] coefficients_to NULL: the shape stays, and scratch may be NULL
 *  @param[in] scratch         shcd_sweep_scratch_size() bytes aligned to 16
 *  @param[in] tolerance_m     > 0; or 0 as in shcd_sweep_def
 *  @return SHCD_OK or what shcd_sweep() says. RT safe. */
shcd_status shcdi_sweep_point(const shcd_model *model, const shcd_shape *shape, shcd_vec3 from,
                              shcd_vec3 to, double radius_m, const double *coefficients_to,
                              void *scratch, double tolerance_m, shcd_sweep_result *out);

/** A motion as shcd_sweep_def defines it, the quaternions with the signs of the shorter turn. */
typedef struct shcdi_motion {
    const shcd_tool_geometry *tool; /**< NULL: a ball of radius_m */
    double radius_m;                /**< of the ball, or the rounding of the tool's core */
    double bounding_m;              /**< no point of the tool is farther from its origin */
    shcd_pose from, to;
    shcd_vec3 velocity; /**< of the origin */
    double omega;       /**< bound of the turning speed */
    shcd_vec3 axis;     /**< unit, of the turn; zero if it does not turn */
} shcdi_motion;

/** RT safe. */
shcd_pose shcdi_motion_at(const shcdi_motion *motion, double t);

/** The rest of a motion from a time t_0 on, whose surface the view shows; at t_0 + h the surface
 * has moved by at most h growth_m. */
typedef struct shcdi_sweep_path {
    const shcdi_motion *motion;
    double from;   /**< t_0 */
    double keep_m; /**< the gap to be proven at every time that counts as free */
    double growth_m;
    double tolerance_m;
    double slack_m; /**< rounding of positions */
} shcdi_sweep_path;

/** What a sweep over the patches proved. */
typedef struct shcdi_sweep_free {
    double time;      /**< gap >= keep_m on [t_0, time]; HUGE_VAL: up to the end */
    double upper_m;   /**< of the gap at `time`; +inf: not known */
    int is_exhausted; /**< the budget ended the search */
    uint32_t n_evaluations, n_patches;
} shcdi_sweep_free;

/** Sweeps the tool over the patches of the surface.
 *  @param[in] start            parameter near which contact is expected first: a hint
 *  @param[in] evaluations_max  budget
 *  RT safe. */
void shcdi_sweep_patches(const shcdi_view *view, const shcdi_sweep_path *path, shcd_vec3 start,
                         uint32_t evaluations_max, shcdi_sweep_free *out);

#endif
