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
    int32_t n_modes; /**< modes that the model gets, see shcd_fit_modes(); 0: none, -1: the
                          default number */
    int32_t reserved0;
} shcd_fit_options;
#define SHCD_FIT_OPTIONS_INIT                                                                      \
    { sizeof(shcd_fit_options), 0, 0, 0.0, 0.0, 0, 0.0, NULL, NULL, 0, 0 }

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
    double time_modes_s;
    shcd_error modes_error; /**< status SHCD_OK, or why the model has no modes that were wanted */
} shcd_fit_report;
#define SHCD_FIT_REPORT_INIT SHCD_SIZED_INIT(shcd_fit_report)

/** Fits a model to a mesh.
 *
 *  Parameterization: a start (radial projection; a harmonic cylinder map for bent bodies; smoothing
 *  flow), then untangling and polishing of a fold-over-free energy (libshcd/fit/parameterize.c).
 * That no spherical triangle is flipped *and* that they cover the sphere once is a hard
 * post-condition. Coefficients: least squares on stratified samples of the faces, weighted by mesh
 * area. The normal equations take (degree+1)^6 operations: about 1 s at degree 15, 3 s at 30, a
 * minute at 50, hours beyond 100. A surface whose modes cannot be computed to their accuracy makes
 * a model without modes, and the report says why.
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

/** Most anchors of shcd_fit_modes(). */
#define SHCD_ANCHORS_MAX 64

/** A region where the membrane is held: alpha(w) = alpha_per_m2 (1 - (d/radius)^2)^4 for points
 *  S(w) nearer than radius to the anchor's point, d their distance through space. Frozen layout. */
typedef struct shcd_anchor {
    shcd_vec3 point_m;   /**< in the body's frame */
    double radius_m;     /**< > 0 */
    double alpha_per_m2; /**< >= 0; 0: 16/radius^2. In a region of constant alpha a deflection dies
                              off over 1/sqrt(alpha). */
} shcd_anchor;

/** Options of shcd_fit_modes(). Start from SHCD_MODES_OPTIONS_INIT; zero fields mean the defaults.
 */
typedef struct shcd_modes_options {
    size_t struct_size;
    int32_t
        n_modes; /**< 1 .. min((degree+1)^2, SHCD_MODES_MAX); 0: 64, or all if there are fewer */
    int32_t reserved0;
    const shcd_anchor *anchors; /**< NULL: none */
    size_t n_anchors;           /**< 0 .. SHCD_ANCHORS_MAX; alpha is the sum over them */
    shcd_progress progress;     /**< NULL: none */
    void *progress_user;
} shcd_modes_options;
#define SHCD_MODES_OPTIONS_INIT                                                                    \
    { sizeof(shcd_modes_options), 0, 0, NULL, 0, NULL, NULL }

/** Computes the lowest modes of the model's surface: -Lap_S phi + alpha phi = lambda phi in the
 *  space of the model's harmonics.
 *
 *  Galerkin: K v = lambda M v with M_ij = int Y_i Y_j dA and K_ij = int (grad_S Y_i . grad_S Y_j +
 *  alpha Y_i Y_j) dA, by Gauss-Legendre x uniform quadrature on the true surface, whose number of
 *  nodes is doubled in both directions until no wanted eigenvalue changes by more than 1e-8
 *  (lambda + 1/area). Modes are M-orthonormal to rounding; their largest coefficient is positive;
 *  equal eigenvalues keep the order in which the solver finds them. Without anchors lambda_0 = 0
 *  and phi_0 = 1/sqrt(area), exactly. What the quadrature does not resolve, a space of more
 *  harmonics would: the truncation of the space raises high eigenvalues (docs/modes.md).
 *
 *  Deterministic. Takes about (degree+1)^6 operations: 0.2 s at degree 15, 4 s at 30, a minute
 *  at 45.
 *  @param[out] modes  untouched on failure; release with shcd_modes_free()
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT (also: an anchor that reaches no point of the surface),
 *  SHCD_ERR_NOT_FINITE, SHCD_ERR_GEOMETRY (no tangent plane at a node), SHCD_ERR_CONVERGENCE (the
 *  message names the agreement that was reached), SHCD_ERR_MEMORY, SHCD_ERR_CANCELLED. */
SHCD_API SHCD_NODISCARD shcd_status shcd_fit_modes(const shcd_model *model,
                                                   const shcd_modes_options *options,
                                                   shcd_modes **modes, shcd_error *error);
/** Releases what shcd_fit_modes() made; accepts NULL. */
SHCD_API void shcd_modes_free(shcd_modes *modes);

/* ---- the learned response ------------------------------------------------------------------- */

/** One measured or simulated indentation. Frozen layout. */
typedef struct shcd_train_sample {
    shcd_vec3 point_m;    /**< contact point on the rest surface, body frame [m] */
    double depth_m;       /**< > 0, along the inward normal [m] */
    double force_n;       /**< normal force on the tool [N] */
    double energy_j;      /**< that it took, if shcd_train_options::has_energy [J] */
    double speed_m_per_s; /**< of going in, if shcd_train_options::has_speed [m/s] */
    double reserved;      /**< zero */
} shcd_train_sample;

/** One of the indentations that the network was tested on. Frozen layout. */
typedef struct shcd_train_check {
    shcd_vec3 point_m;
    double depth_m;
    double force_n;         /**< the truth */
    double network_force_n; /**< what the network says */
    double dent_error_m;    /**< largest error of the dent; 0: not tested */
    double slope_error_n;   /**< of dU/dx along the surface; 0: not tested */
} shcd_train_check;

/** Told of each tested indentation, in a fixed order. */
typedef void (*shcd_train_watch)(const shcd_train_check *check, void *user);

/** Options of shcd_train(). Start from SHCD_TRAIN_OPTIONS_INIT; zero fields mean the defaults. */
typedef struct shcd_train_options {
    size_t struct_size;
    const shcd_train_sample *samples; /**< NULL: the built-in membrane */
    size_t n_samples;
    int32_t has_energy; /**< 1: the samples' energies are read */
    int32_t has_speed;  /**< 1: so are their speeds */
    /* of the built-in membrane; not read if there are samples */
    double young_pa;         /**< E; 0: 5000 Pa, liver */
    double poisson_ratio;    /**< nu, below 0.5; 0: 0.45 */
    double patch_radius_m;   /**< a; 0: 5 mm */
    double support_length_m; /**< l; 0: 20 mm */
    double thickness_m;      /**< h; 0: the one at which the static stiffness is 2 E* a */
    double stiffening;       /**< beta; 0: linear */
    double depth_max_m;      /**< 0: 2 a, at most 5 % of the diagonal */
    int32_t n_points;        /**< places that are pressed; 0: 600, or 450 if it stiffens */
    int32_t space_degree;    /**< of the harmonics it is solved in; 0: enough for the patch */
    int32_t n_centres;       /**< 0: two for three places, at most 400, or 300 if there are
                                    samples or it stiffens */
    int32_t seed;            /**< of the tested places; 0: 1 */
    shcd_progress progress;  /**< NULL: none */
    void *progress_user;
    shcd_train_watch watch; /**< NULL: none */
    void *watch_user;
} shcd_train_options;
#define SHCD_TRAIN_OPTIONS_INIT SHCD_SIZED_INIT(shcd_train_options)

/** Trains a body's learned response and makes a model that carries it.
 *
 *  The energy U(x, depth) of shcd/learned.h is fitted by least squares to energies, to forces as
 *  its slope in the depth and, with the built-in membrane, to its slopes along the surface.
 *
 *  Built-in training data: the static minimum of int h (G/(2 beta)) (exp(beta |grad_S d|^2) - 1) +
 *  kappa |d|^2/2 dA over displacements d of the rest surface that press the patch g_a at the
 * contact in by the depth along the normal: strictly convex, so unique; beta = 0 is the static
 * answer of the effect `wave` with the same modes. G = E/(2 (1 + nu)), kappa = G h/l^2. It needs
 * modes; a model without them gets the default ones.
 *
 *  Samples of the user's: at least 8 different points, each within 5 % of the diagonal of the
 *  surface, to which it is moved. One place in five is kept for the test. With energies, the record
 *  says how far forces are from the slope of a network that saw the energies alone.
 *
 *  Centres are chosen greedily, the farthest first; support, number of terms and ridge by
 *  cross-validation. Tested are places that the training did not see.
 *  @param[out] trained  a new model, with everything that the given one had; untouched on failure
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT, SHCD_ERR_NOT_FINITE, SHCD_ERR_GEOMETRY, SHCD_ERR_CONVERGENCE
 *  (no static solution; or the network has a place where it does not resist), SHCD_ERR_MEMORY,
 *  SHCD_ERR_CANCELLED. Deterministic. Takes a minute at degree 15. */
SHCD_API SHCD_NODISCARD shcd_status shcd_train(const shcd_model *model,
                                               const shcd_train_options *options,
                                               const shcd_allocator *allocator,
                                               shcd_model **trained, shcd_error *error);

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
