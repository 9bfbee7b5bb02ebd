/* SPDX-License-Identifier: BSD-3-Clause */
/** @file
 *  The constant model of one body: a closed surface S(w) = sum_i c_i Y_i(w), w on the unit sphere,
 *  with everything a query needs, derived from the coefficients when the model is made.
 *
 *  A model is immutable after creation and may be shared between threads without locks. It must
 *  outlive the scenes that refer to it.
 */
#ifndef SHCD_MODEL_H
#define SHCD_MODEL_H

#include "shcd/base.h"
#include "shcd/learned.h"

#ifdef __cplusplus
extern "C" {
#endif

/** A body: coefficients and what is derived from them once. Constant, shared by threads. */
typedef struct shcd_model shcd_model;

/** What the fit measured against the mesh it came from; stored in the model and in the file. All
 *  zero (n_triangles == 0) when the model did not come from a mesh. */
typedef struct shcd_fit_record {
    uint64_t n_triangles;      /**< of the mesh, after repair; 0: no record */
    uint64_t n_vertices;       /**< of the mesh, after merging */
    double mesh_diagonal_m;    /**< diagonal of the mesh's bounding box [m] */
    double rms_error_m;        /**< area-weighted RMS distance, both directions pooled [m] */
    double hausdorff_error_m;  /**< symmetric Hausdorff distance, sampled [m] */
    double area_log_ratio_rms; /**< rms of log(sphere area share / mesh area share), 0 = ideal */
    double area_ratio_min;     /**< smallest (sphere area share) / (mesh area share) */
    double area_ratio_max;     /**< largest such ratio */
    double local_thickness_m;  /**< smallest sampled thickness of the mesh [m] */
    double fit_time_s;         /**< wall-clock time of the fit [s] */
    double unit_m;             /**< metres in one unit of the mesh file */
    double reserved[5];        /**< zero */
} shcd_fit_record;

/** One way to answer queries of a model, as it was measured: how far from the truth, and how long.
 *
 *  Errors are those of the signed distance against the exact answer of the model's whole series,
 * for points near its surface; times are of one query on the machine that the table names. Frozen
 *  layout. Values that were not measured are zero. */
typedef struct shcd_cost_row {
    int32_t degree;         /**< of the series that answers, 1 .. model degree */
    int32_t tier;           /**< a shcd_tier */
    int32_t map_resolution; /**< map tier: its resolution; else 0 */
    int32_t interpolation;  /**< map tier: a shcd_map_interpolation; else 0 */
    double error_max_m;
    double error_p99_m;
    double error_rms_m;
    double normal_p99_rad; /**< angle between the unit normals */
    double ns_p50;         /**< of one query, random points (track tier: on a path) [ns] */
    double ns_p99;
    double path_ns_p50; /**< on a path, from one point to the next [ns] */
    double path_ns_p99;
    double evaluations_mean; /**< shcd_proximity::n_evaluations, random points */
    double patches_mean;     /**< shcd_proximity::n_patches */
    double evaluation_ns;    /**< what one more evaluation costs [ns] */
    double patch_ns;         /**< what one more bound costs [ns] */
    uint64_t bytes;          /**< memory held by the objects that answer */
    double reserved[5];      /**< zero */
} shcd_cost_row;

/** Most rows of a model's cost table. */
#define SHCD_COST_ROWS_MAX 256
/** Room for the name of the machine that a table was measured on, the ending zero included. */
#define SHCD_COST_MACHINE_SIZE 96

/** Most modes of a model. */
#define SHCD_MODES_MAX 1024

/** Modes of the body's true rest surface: phi_k(w) = sum_i v_ki Y_i(w) [1/m] with
 *  -Lap_S phi_k + alpha phi_k = lambda_k phi_k in the space of the model's harmonics, and
 *  int phi_j phi_k dA = 1 if j = k, else 0. docs/modes.md has the equation and its error. Frozen
 *  layout. */
typedef struct shcd_modes {
    size_t n_modes;                  /**< 1 .. min((degree+1)^2, SHCD_MODES_MAX) */
    const double *eigenvalue_per_m2; /**< n_modes, lambda_k [1/m^2], ascending, >= 0 */
    const double *coefficient_per_m; /**< n_modes rows of (degree+1)^2: v_ki [1/m] */
    double area_m2;                  /**< of the surface, by the modes' own quadrature */
    double eigenvalue_error; /**< largest change of an eigenvalue at the last doubling of the
                                  quadrature, relative to lambda_k + 1/area */
    double volume_m3;        /**< enclosed, by the same quadrature */
    int32_t is_anchored;     /**< 1: alpha is not zero everywhere, and no eigenvalue is */
    int32_t reserved0;       /**< zero */
} shcd_modes;

/** How the series of a model is evaluated. All ways give the same bits; they differ in speed. */
typedef enum shcd_simd {
    SHCD_SIMD_AUTO = 0,     /**< the fastest that this processor has */
    SHCD_SIMD_PORTABLE = 1, /**< for any processor */
    SHCD_SIMD_AVX2 = 2,
    SHCD_SIMD_AVX512 = 3 /**< AVX-512 F, BW, DQ and VL */
} shcd_simd;

/** Definition of a model. Start from SHCD_MODEL_DEF_INIT. */
typedef struct shcd_model_def {
    size_t struct_size;
    int32_t degree; /**< 0 .. SHCD_DEGREE_MAX; 1 or more for a surface */
    int32_t simd;   /**< a shcd_simd; SHCD_ERR_UNSUPPORTED if this processor does not have it */
    const double
        *coefficients; /**< 3 (degree+1)^2 values [m], [3 SHCD_INDEX(l,m) + k], k = x,y,z */
    const shcd_fit_record *fit;     /**< copied; NULL: none */
    const shcd_cost_row *cost_rows; /**< copied; NULL: no table */
    size_t n_cost_rows;             /**< 0 .. SHCD_COST_ROWS_MAX */
    /** Where the rows were measured, e.g. the processor's name: printable ASCII, less than
     *  SHCD_COST_MACHINE_SIZE bytes; copied. NULL: not known. */
    const char *cost_machine;
    const shcd_modes *modes;     /**< copied; NULL: none */
    const shcd_learned *learned; /**< copied; NULL: none. Its dents need as many modes */
} shcd_model_def;
#define SHCD_MODEL_DEF_INIT                                                                        \
    { sizeof(shcd_model_def), 0, 0, NULL, NULL, NULL, 0, NULL, NULL, NULL }

/** How sure a stored property is. */
typedef enum shcd_certainty {
    SHCD_CERTAINTY_UNKNOWN = 0, /**< not examined */
    SHCD_CERTAINTY_SAMPLED = 1, /**< seen on samples; finer detail may differ */
    SHCD_CERTAINTY_PROVEN = 2   /**< follows from a bound */
} shcd_certainty;

/** What a model is. Set struct_size (SHCD_MODEL_INFO_INIT), then call shcd_model_describe(). */
typedef struct shcd_model_info {
    size_t struct_size;
    int32_t degree;
    int32_t is_embedded;        /**< 1: no self-intersection was found; 0: there is one */
    int32_t embedded_certainty; /**< a shcd_certainty */
    int32_t is_star_shaped;     /**< 1: every ray from star_centre_m meets the surface once */
    int32_t star_certainty;     /**< a shcd_certainty */
    int32_t reserved0;
    shcd_vec3 box_min_m; /**< bounding box of the sampled surface [m] */
    shcd_vec3 box_max_m;
    double diagonal_m;       /**< diagonal of that box: the yardstick of relative errors [m] */
    shcd_vec3 centre_m;      /**< centre of the enclosing ball [m] */
    double radius_m;         /**< its certified radius: |S(w) - centre| <= radius for all w [m] */
    shcd_vec3 star_centre_m; /**< kernel centre if star-shaped, else the volume centroid [m] */
    double star_margin_m;    /**< min over the sampled surface of (S - star_centre) . n [m] */
    double volume_m3;        /**< of the leaf tessellation [m^3] */
    double area_m2;          /**< of the leaf tessellation [m^2] */
    double max_first_derivative_m;  /**< certified bound of |S'| along great circles [m/rad] */
    double max_second_derivative_m; /**< certified bound of |S''| [m/rad^2] */
    double max_deviation_m;         /**< certified distance of S from its leaf triangles [m] */
    uint64_t n_leaves;              /**< leaf triangles of the query tree */
    uint64_t run_time_bytes;        /**< memory that the model holds */
    int32_t map_resolution;         /**< texels on a side of the octahedral distance map */
    int32_t map_crossings_max;      /**< most crossings of one texel's ray */
    double map_one_crossing_share;  /**< share of texels whose ray crosses the surface once */
    double map_bilinear_error_m; /**< largest measured radius error of the bilinear look-up [m] */
    double map_hermite_error_m;  /**< the same of the cubic Hermite look-up [m] */
    double map_bilinear_rms_m;   /**< rms of the same measured errors [m] */
    double map_hermite_rms_m;
    double map_equal_count_share; /**< share of cells whose nodes have equal counts of crossings */
    double map_bounded_share;     /**< share of cells with a proven count and a proven error */
    double map_bilinear_bound_m;  /**< largest proven radius error in those cells [m] */
    double map_hermite_bound_m;
    shcd_fit_record fit;
    uint64_t body_bytes;     /**< of run_time_bytes: coefficients, bounds, positions, map radii */
    uint64_t table_bytes;    /**< of run_time_bytes: what depends on the degree only */
    uint64_t map_seed_bytes; /**< of run_time_bytes: starting parameters in the map */
    int32_t simd;            /**< the shcd_simd in use */
    int32_t reserved1;
} shcd_model_info;
#define SHCD_MODEL_INFO_INIT SHCD_SIZED_INIT(shcd_model_info)

/** Makes a model from coefficients and derives its bounds, query tree and distance map.
 *
 *  @param[in]  definition  copied; coefficients finite and not all zero beyond l = 0
 *  @param[in]  allocator   NULL: malloc; copied into the model
 *  @param[out] model       untouched on failure; release with shcd_model_free()
 *  @param[out] error       may be NULL
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT, SHCD_ERR_NOT_FINITE, SHCD_ERR_GEOMETRY (no extent, or too
 *  large or small: the diagonal must lie in 1e-9 .. 1e9 m), SHCD_ERR_UNSUPPORTED (simd),
 *  SHCD_ERR_MEMORY.
 *  If the surface is inside out (negative volume) it is refused with SHCD_ERR_GEOMETRY: outward
 *  normals decide the sign of distance.
 *  Takes 0.1 to 10 s depending on the degree; not RT safe. */
SHCD_API SHCD_NODISCARD shcd_status shcd_model_create(const shcd_model_def *definition,
                                                      const shcd_allocator *allocator,
                                                      shcd_model **model, shcd_error *error);

/** Releases a model; NULL is allowed. */
SHCD_API void shcd_model_free(shcd_model *model);

/** Fills min(info->struct_size, library's size) bytes of info.
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT (struct_size 0). RT safe. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_model_describe(const shcd_model *model,
                                                                shcd_model_info *info);

/** The degree and the coefficients as given at creation, 3 (degree+1)^2 values, owned by the model.
 *  RT safe. */
SHCD_API SHCD_RT int shcd_model_degree(const shcd_model *model);
/** See shcd_model_degree(). RT safe. */
SHCD_API SHCD_RT const double *shcd_model_coefficients(const shcd_model *model);

/** The cost table as given at creation, owned by the model; NULL and *n = 0 without one. What it is
 *  for: shcd_accuracy_choose(). RT safe. */
SHCD_API SHCD_RT const shcd_cost_row *shcd_model_cost_rows(const shcd_model *model, size_t *n);
/** The machine of that table; "" if it is not known or there is no table. RT safe. */
SHCD_API SHCD_RT const char *shcd_model_cost_machine(const shcd_model *model);

/** The modes as given at creation, owned by the model; NULL without them. The offline
 *  shcd_fit_modes() computes them. RT safe. */
SHCD_API SHCD_RT const shcd_modes *shcd_model_modes(const shcd_model *model);

/** The learned response as given at creation, owned by the model; NULL without one. The offline
 *  shcd_train() makes it. RT safe. */
SHCD_API SHCD_RT const shcd_learned *shcd_model_learned(const shcd_model *model);

/** Certified offset of a low-degree surface: every S(w) of the full model lies within offset_m of
 *  the surface of the series truncated at `degree`, at the same parameter w. The low-degree surface
 *  inflated by it encloses the body (a truncated series alone does not).
 *
 *  Bound: max over samples of |S - S_degree|, raised by Bernstein's inequality between samples.
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT (degree out of 0 .. model degree). RT safe. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_model_enclosure_offset(const shcd_model *model,
                                                                        int degree,
                                                                        double *offset_m);

/** Evaluates the surface at a parameter.
 *
 *  @param[in]  degree      truncate the series here; -1: the model's degree
 *  @param[in]  parameter   direction w; normalised first
 *  @param[out] point       S(w) [m], or NULL
 *  @param[out] normal      outward unit normal, or NULL; zero where the surface is singular
 *  @param[out] jacobian    9 values, row k the tangential gradient of coordinate k [m/rad], or NULL
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT, SHCD_ERR_NOT_FINITE. RT safe; thread safe. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_model_surface(const shcd_model *model, int degree,
                                                               shcd_vec3 parameter,
                                                               shcd_vec3 *point, shcd_vec3 *normal,
                                                               double *jacobian);

/** The surface at one parameter at every degree, in one pass.
 *
 *  @param[in]  parameter  direction w; normalised first
 *  @param[out] sums_m     degree + 1 points: sums_m[d] is the series truncated at degree d, the
 *                         point that shcd_model_surface() gives for that degree
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT, SHCD_ERR_NOT_FINITE. RT safe; thread safe. */
SHCD_API SHCD_RT SHCD_NODISCARD shcd_status shcd_model_partial_sums(const shcd_model *model,
                                                                    shcd_vec3 parameter,
                                                                    shcd_vec3 *sums_m);

/** Number of bytes that shcd_model_write() needs. RT safe. */
SHCD_API SHCD_RT size_t shcd_model_write_size(const shcd_model *model);

/** Serialises a model in the .shcd format (little-endian, chunked, CRC-32 per chunk).
 *  @return SHCD_OK, SHCD_ERR_ARGUMENT (buffer smaller than shcd_model_write_size()). Does
 *  not allocate; not RT safe, since zlib is called. */
SHCD_API SHCD_NODISCARD shcd_status shcd_model_write(const shcd_model *model, void *bytes,
                                                     size_t capacity);

/** Makes a model from the bytes of a .shcd file; everything is validated before use.
 *  @return as shcd_model_create(), and SHCD_ERR_FORMAT, SHCD_ERR_UNSUPPORTED (a newer version or an
 *  unknown required chunk). The message names the chunk and the byte. */
SHCD_API SHCD_NODISCARD shcd_status shcd_model_read(const void *bytes, size_t size,
                                                    const shcd_allocator *allocator,
                                                    shcd_model **model, shcd_error *error);

/** shcd_model_read() of a file. With shcd_model_save() the only place where the library touches the
 *  file system. @return also SHCD_ERR_IO. */
SHCD_API SHCD_NODISCARD shcd_status shcd_model_load(const char *path,
                                                    const shcd_allocator *allocator,
                                                    shcd_model **model, shcd_error *error);

/** shcd_model_write() to a file: written beside it and renamed, so that a failure leaves neither a
 *  half-written file nor a changed old one. @return also SHCD_ERR_IO. */
SHCD_API SHCD_NODISCARD shcd_status shcd_model_save(const shcd_model *model, const char *path,
                                                    shcd_error *error);

#ifdef __cplusplus
}
#endif
#endif
