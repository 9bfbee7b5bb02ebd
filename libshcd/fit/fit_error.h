/* SPDX-License-Identifier: BSD-3-Clause */
/* How far a fitted surface is from its mesh, and what the map did to areas. */
#ifndef SHCD_FIT_FIT_ERROR_H
#define SHCD_FIT_FIT_ERROR_H

#include "progress.h"
#include "samples.h"

typedef struct shcdi_comparison shcdi_comparison;

/** Prepares the mesh's side: its samples and its tree. The body is borrowed. */
shcd_status shcdi_comparison_create(const shcdi_body *body, shcdi_comparison **comparison);
void shcdi_comparison_free(shcdi_comparison *comparison);

typedef struct shcdi_distance {
    double hausdorff_m; /**< larger of the two directions */
    double rms_m;       /**< area-weighted, both directions pooled */
    int is_complete;    /**< 0: stopped early, hausdorff_m is a lower bound and rms_m not known */
} shcdi_distance;

/** Distance between the mesh and the surface of a series, in both directions.
 *
 *  Sampled: the surface is a geodesic tessellation of the parameter sphere with frequency
 *  n = max(48, 2 degree), 10 (n+1)(n+2) points. Its points go to the exact triangles of the mesh;
 * at least 20 000 stratified samples and all vertices of the mesh go to the exact triangles of the
 *  tessellation. With edges of 1.2/n rad at most, a ripple of the highest degree and amplitude a
 *  strays from the tessellation by less than (1.2 degree/n)^2 a / 8 <= 0.05 a.
 *  @param[in] coefficients_m  relative to the body's centre
 *  @param[in] stop_above_m    give up as soon as a larger distance is seen; HUGE_VAL: never */
shcd_status shcdi_comparison_measure(shcdi_comparison *comparison, int degree,
                                     const double *coefficients_m, double stop_above_m,
                                     const shcdi_progress *progress, shcdi_distance *distance);

/** Smallest thickness of the mesh [m]: from each sample a ray runs inward along the face's normal
 * to its first hit on a triangle that does not touch the sample's own; it counts if the two walls
 * are parallel to 30 degrees. (Else it met the flank of a wedge, whose thickness falls to zero at
 * the ridge, the more so the finer the mesh; a ridge sharper than 30 degrees does count as thin.)
 * If no ray counts, the smallest hit of any kind. */
double shcdi_comparison_thickness(const shcdi_comparison *comparison);

/** Fills the area_* fields of the record. Triangles so thin that the map was not asked to keep
 * their area (below 1e-4 of the mean) are left out. */
void shcdi_area_ratios(const shcdi_body *body, const shcd_vec3 *u, shcd_fit_record *record);

#endif
