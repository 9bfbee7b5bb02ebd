/* SPDX-License-Identifier: BSD-3-Clause */
/** @file
 *  Offline: closed triangle mesh -> fold-free spherical parameterization -> coefficients -> model.
 *
 *  In libshcd-fit, which links GSL, FFTW, CHOLMOD and Assimp: its binaries are GPL-3.0-or-later.
 *  These functions allocate and may take minutes; none is RT safe. GSL's error handler and FFTW's
 *  planner are global: do not run two of them at once.
 */
#ifndef SHCD_FIT_H
#define SHCD_FIT_H

#include "shcd/model.h"

#ifdef __cplusplus
extern "C" {
#endif

/** A checked triangle mesh: closed, one component, genus 0, outward oriented. */
typedef struct shcd_mesh shcd_mesh;

/** What the mesh checks found and repaired. */
typedef struct shcd_mesh_report {
    size_t struct_size;
    uint64_t n_vertices_read, n_triangles_read; /**< as stored in the file */
    uint64_t n_vertices, n_triangles;           /**< after merging and repair */
    uint64_t n_vertices_merged;                 /**< by equal position */
    uint64_t n_vertices_unused;                 /**< dropped */
    uint64_t n_triangles_degenerate_dropped;    /**< two corners at one vertex */
    uint64_t n_triangles_zero_area;             /**< collinear, kept (areas are floored) */
    uint64_t n_triangles_flipped;               /**< turned to agree with their neighbours */
    int32_t turned_inside_out;                  /**< 1: all turned, since the volume was negative */
    int32_t reserved0;
    double diagonal_m;
    double volume_m3;
    double area_m2;
} shcd_mesh_report;
#define SHCD_MESH_REPORT_INIT SHCD_SIZED_INIT(shcd_mesh_report)

/** Reads OBJ, PLY, STL or OFF (all submeshes joined), then checks and repairs as
 *  shcd_mesh_create().
 *  Runs in the caller's process: a hostile file can still make Assimp fail hard; the command
 *  `shcd fit` imports in a child with limits. Faces have at most 1000 corners.
 *  @param[in] unit_m  metres in one unit of the file, > 0
 *  @return also SHCD_ERR_IO, SHCD_ERR_FORMAT. The message starts with the path. */
SHCD_API SHCD_NODISCARD shcd_status shcd_mesh_import(const char *path, double unit_m,
                                                     shcd_mesh **mesh, shcd_mesh_report *report,
                                                     shcd_error *error);

/** Checks and repairs an indexed triangle mesh; the arrays are copied.
 *
 *  In this order: empty; index out of range; vertex not finite (named with a face that uses it);
 *  vertices merged by equal position, unused ones and triangles with repeated corners dropped; open
 *  edge (its end points are named); edge with more than two triangles; several components; not
 *  orientable, or orientation repaired by turning triangles; a vertex where two fans of triangles
 *  meet; genus (Euler number); volume zero. On failure the report is untouched.
 *
 *  @param[in] vertices_m  3 n_vertices values [m]
 *  @param[in] triangles   3 n_triangles indices
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT, SHCD_ERR_NOT_FINITE, SHCD_ERR_GEOMETRY, SHCD_ERR_MEMORY;
 *  each refusal has its own reason and place in the message. */
SHCD_API SHCD_NODISCARD shcd_status shcd_mesh_create(const double *vertices_m, size_t n_vertices,
                                                     const uint32_t *triangles, size_t n_triangles,
                                                     shcd_mesh **mesh, shcd_mesh_report *report,
                                                     shcd_error *error);
/** Accepts NULL. */
SHCD_API void shcd_mesh_free(shcd_mesh *mesh);

/** After merging and repair. */
SHCD_API size_t shcd_mesh_vertex_count(const shcd_mesh *mesh);
/** After repair. */
SHCD_API size_t shcd_mesh_triangle_count(const shcd_mesh *mesh);
/** 3 per vertex [m], owned by the mesh. */
SHCD_API const double *shcd_mesh_vertices(const shcd_mesh *mesh);
/** 3 per triangle, counter-clockwise seen from outside, owned by the mesh. */
SHCD_API const uint32_t *shcd_mesh_triangles(const shcd_mesh *mesh);

/** Called now and then during a fit; `fraction` in [0, 1] within `stage`. Return non-zero to stop:
 *  the fit then ends with SHCD_ERR_CANCELLED. */
typedef int (*shcd_progress)(const char *stage, double fraction, void *user);

/** Options of shcd_fit(). Start from SHCD_FIT_OPTIONS_INIT; zero fields mean the defaults. */
typedef struct shcd_fit_options {
    size_t struct_size;
    int32_t degree;         /**< 0: 15, or the smallest that meets tolerance_m if that is given */
    int32_t degree_max;     /**< with tolerance_m: give up beyond it; 0: 50 */
    double tolerance_m;     /**< wanted Hausdorff error against the mesh [m]; 0: by degree */
    double area_weight;     /**< lambda of the parameterization energy; 0: 5 */
    uint64_t n_samples;     /**< samples on the mesh for the least squares; 0: 40 (degree+1)^2,
                                 at least 20000 */
    double unit_m;          /**< recorded in the model: metres in one unit of the mesh file; 0: 1 */
    shcd_progress progress; /**< NULL: none */
    void *progress_user;
} shcd_fit_options;
#define SHCD_FIT_OPTIONS_INIT                                                                      \
    { sizeof(shcd_fit_options), 0, 0, 0.0, 0.0, 0, 0.0, NULL, NULL }

/** What a fit did, beyond what the model records. */
typedef struct shcd_fit_report {
    size_t struct_size;
    int32_t degree;
    int32_t start;            /**< start that succeeded: 0 radial, 1 cylinder, 2 smoothed */
    uint64_t n_flipped_start; /**< spherical triangles flipped before untangling */
    uint64_t n_flipped;       /**< after: always 0 in a returned model */
    uint64_t n_untangle_iterations;
    uint64_t n_polish_iterations;
    uint64_t n_samples;
    double min_det_ratio; /**< min det(u1,u2,u3) / (2 A), > 0 */
    double time_parameterize_s, time_coefficients_s, time_model_s, time_error_s;
    shcd_fit_record record;
} shcd_fit_report;
#define SHCD_FIT_REPORT_INIT SHCD_SIZED_INIT(shcd_fit_report)

/** Fits a model to a mesh.
 *
 *  Parameterization: a start (radial projection; a harmonic cylinder map for bent bodies; smoothing
 *  flow), then untangling and polishing of a fold-over-free energy (libshcd/fit/parameterize.c).
 * That no spherical triangle is flipped *and* that they cover the sphere once is a hard
 * post-condition. Coefficients: least squares on stratified samples of the faces, weighted by mesh
 * area. The normal equations take (degree+1)^6 operations: about 1 s at degree 15, 3 s at 30, a
 * minute at 50, hours beyond 100.
 *  @param[out] model   untouched on failure
 *  @param[out] report  may be NULL
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT, SHCD_ERR_CONVERGENCE, SHCD_ERR_GEOMETRY, SHCD_ERR_MEMORY,
 *  SHCD_ERR_CANCELLED. Deterministic. */
SHCD_API SHCD_NODISCARD shcd_status shcd_fit(const shcd_mesh *mesh, const shcd_fit_options *options,
                                             const shcd_allocator *allocator, shcd_model **model,
                                             shcd_fit_report *report, shcd_error *error);

/** The parameterization alone: one unit vector for each vertex of the mesh.
 *  @param[out] directions  3 per vertex */
SHCD_API SHCD_NODISCARD shcd_status shcd_parameterize(const shcd_mesh *mesh,
                                                      const shcd_fit_options *options,
                                                      double *directions, shcd_fit_report *report,
                                                      shcd_error *error);

/** Samples of a Gauss-Legendre x uniform grid: n_latitudes nodes z_j (descending, roots of
 *  P_n), n_longitudes angles phi_k = 2 pi k / n_longitudes; values[j n_longitudes + k].
 *
 *  shcd_synthesis() evaluates a series on it, shcd_analysis() projects samples onto harmonics:
 *  exact for a band-limited function if n_latitudes > degree and n_longitudes > 2 degree (round
 * trip to 1e-12). FFTW over longitude.
 *  @param[in] coefficients  (degree+1)^2 values of one function
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT (grid too small for the degree), SHCD_ERR_MEMORY. */
SHCD_API SHCD_NODISCARD shcd_status shcd_synthesis(int degree, const double *coefficients,
                                                   size_t n_latitudes, size_t n_longitudes,
                                                   double *values);
/** The way back from values to coefficients, see shcd_synthesis(). */
SHCD_API SHCD_NODISCARD shcd_status shcd_analysis(int degree, const double *values,
                                                  size_t n_latitudes, size_t n_longitudes,
                                                  double *coefficients);

#ifdef __cplusplus
}
#endif
#endif
