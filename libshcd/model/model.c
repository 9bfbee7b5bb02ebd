/* SPDX-License-Identifier: BSD-3-Clause */
/* Creation and inspection of the constant model. */
#include "model/model.h"

#include "base/harmonics.h"

#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979324
/* Up to this degree the enclosure offsets are sampled; beyond, the coefficient bound is used, since
 * sampling every degree on a fine enough grid would take longer than everything else together. */
#define ENCLOSURE_SAMPLED_DEGREE 40

static void *take(const shcd_allocator *allocator, size_t count, size_t size) {
    return allocator->allocate(count * size, allocator->user);
}

static void give(const shcd_allocator *allocator, void *memory) {
    if (memory != NULL) {
        allocator->release(memory, allocator->user);
    }
}

/* Doubles to allocate on top, so that a table can start at a line of the cache: vector loads across
 * two lines take twice as long. */
#define ALIGNMENT_SLACK 7

static double *align(double *memory) {
    const uintptr_t past = (uintptr_t)memory % 64;
    return past == 0 ? memory : memory + (64 - past) / sizeof *memory;
}

/* sup over w of |sum over degree l of c_i Y_i(w)| <= |D_l| sqrt((2l+1)/(4 pi)) by the addition
 * theorem and Cauchy-Schwarz, D_l the 3 x (2l+1) block; the Frobenius norm bounds the spectral one.
 */
static double degree_bound(const double *coefficients, int l) {
    double sum = 0.0;
    for (size_t i = 3 * SHCD_INDEX(l, -l); i <= 3 * SHCD_INDEX(l, l) + 2; i++) {
        sum += coefficients[i] * coefficients[i];
    }
    return sqrt(sum * (2.0 * l + 1.0) / (4.0 * PI)) * (1.0 + 1e-12);
}

/* Rounding of an evaluated S: each degree's part is a sum of products whose recurrence in z
 * amplifies the rounding of z by the derivative of Y, at most l(l+1)/2 at the pole. Besides, in
 * units of one rounding u = 1.1e-16: the packed coefficients carry a scale made of at most L
 * factors, 2.5 u each (a division under a root, the root, the product), and one product; the
 * running sums are L + 1 long in a lane, L/8 + 1 over blocks and 3 over lanes; a power of x + i y
 * is made of at most 3 + L/8 complex products, 3 u each. Together 4 L + 16 < 2 (2 (L + 1) + 20)
 * (first-order analysis; 2.2e-16 is 2 u). */
double shcdi_evaluation_error(const double *coefficients, int degree) {
    double sum = 0.0;
    for (int l = 0; l <= degree; l++) {
        sum += (l * (l + 1.0) + 2.0 * (degree + 1) + 20.0) * degree_bound(coefficients, l);
    }
    return 2.2e-16 * sum;
}

/* ---- enclosure offsets ---- */

/* Raises tail[d] to |S - S_d| at w, S_d the series truncated at d. part: degree+1 points. */
static void raise_tails(const shcd_model *model, shcd_vec3 w, shcd_vec3 *part, double *tail) {
    const int top = model->degree;
    shcdi_surface_partial(&model->series, w, part);
    for (int d = 0; d < top; d++) {
        tail[d] = shcdi_max(tail[d], shcd_norm(shcd_sub(part[top], part[d])));
    }
}

/* S - S_d is a vector-valued trigonometric polynomial of degree L along every great circle, so its
 * supremum is at most its maximum over nodes with covering angle delta, over cos(L delta)
 * (Bernstein; see bounds.c). */
static shcd_status fill_enclosure(shcd_model *model) {
    const int degree = model->degree;
    double *tail = model->enclosure;
    memset(tail, 0, ((size_t)degree + 1) * sizeof *tail);
    if (degree > ENCLOSURE_SAMPLED_DEGREE) {
        for (int d = degree - 1; d >= 0; d--) {
            tail[d] = tail[d + 1] + degree_bound(model->coefficients, d + 1);
        }
        return SHCD_OK;
    }
    shcd_vec3 *part = take(&model->allocator, (size_t)degree + 1, sizeof *part);
    if (part == NULL) {
        return SHCD_ERR_MEMORY;
    }
    const size_t n = 8 + 4 * (size_t)degree; /* L delta <= 0.56 */
    for (size_t j = 0; j < n; j++) {
        const double theta = ((double)j + 0.5) * PI / (double)n;
        for (size_t k = 0; k < 2 * n; k++) {
            const double phi = (double)k * PI / (double)n;
            const shcd_vec3 w = {sin(theta) * cos(phi), sin(theta) * sin(phi), cos(theta)};
            raise_tails(model, w, part, tail);
        }
    }
    const double factor = (1.0 + 1e-9) / cos(degree * shcdi_grid_covering(n));
    for (int d = 0; d < degree; d++) {
        /* two rounded points make a sample; the factor is below 1.5 */
        tail[d] = tail[d] * factor + 3.0 * model->evaluation_error_m;
    }
    give(&model->allocator, part);
    return SHCD_OK;
}

/* ---- creation ---- */

/* Older callers know a shorter definition: what they left out keeps its default. */
static shcd_status read_definition(const shcd_model_def *given, shcd_model_def *def,
                                   shcd_error *error) {
    const shcd_model_def defaults = SHCD_MODEL_DEF_INIT;
    if (given == NULL) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, "model_create: definition is null");
    }
    if (given->struct_size < sizeof given->struct_size) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT,
                          "model_create: struct_size is %zu; use SHCD_MODEL_DEF_INIT",
                          given->struct_size);
    }
    *def = defaults;
    memcpy(def, given, given->struct_size < sizeof *def ? given->struct_size : sizeof *def);
    return SHCD_OK;
}

/* A file with such a record would be refused: it must not be written. */
static shcd_status check_fit(const shcd_fit_record *fit, shcd_error *error) {
    const size_t first = offsetof(shcd_fit_record, mesh_diagonal_m);
    for (size_t at = first; fit != NULL && at < sizeof *fit; at += sizeof(double)) {
        double value;
        memcpy(&value, (const char *)fit + at, sizeof value);
        if (!shcdi_is_finite(value)) {
            return shcdi_fail(error, SHCD_ERR_NOT_FINITE,
                              "model_create: value %zu of the fit record is not finite",
                              (at - first) / sizeof(double));
        }
    }
    return SHCD_OK;
}

static shcd_status check_definition(const shcd_model_def *def, shcd_error *error) {
    if (def->coefficients == NULL) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, "model_create: coefficients is null");
    }
    if (def->degree < 1 || def->degree > SHCD_DEGREE_MAX) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, "model_create: degree %d is not in 1 .. %d",
                          (int)def->degree, SHCD_DEGREE_MAX);
    }
    if (def->simd < SHCD_SIMD_AUTO || def->simd > SHCD_SIMD_AVX512) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, "model_create: simd %d is not a shcd_simd",
                          (int)def->simd);
    }
    if (shcdi_simd_choose(def->simd) == 0) {
        return shcdi_fail(error, SHCD_ERR_UNSUPPORTED, "model_create: this processor has no %s",
                          def->simd == SHCD_SIMD_AVX2 ? "AVX2" : "AVX-512 (F, BW, DQ and VL)");
    }
    double largest = 0.0;
    for (int l = 0; l <= def->degree; l++) {
        for (int m = -l; m <= l; m++) {
            for (size_t k = 0; k < 3; k++) {
                const double c = def->coefficients[3 * SHCD_INDEX(l, m) + k];
                if (!shcdi_is_finite(c)) {
                    return shcdi_fail(error, SHCD_ERR_NOT_FINITE,
                                      "model_create: coefficient (l=%d, m=%d) of %c is not finite",
                                      l, m, "xyz"[k]);
                }
                largest = shcdi_max(largest, fabs(c));
            }
        }
    }
    if (!(largest < 1e10)) {
        return shcdi_fail(error, SHCD_ERR_GEOMETRY,
                          "model_create: a coefficient of size %.3g m: bodies reach to 1e9 m",
                          largest);
    }
    shcd_status status = check_fit(def->fit, error);
    if (status == SHCD_OK) {
        status = shcdi_cost_check("model_create", SHCD_ERR_ARGUMENT, def->degree, def->cost_rows,
                                  def->n_cost_rows, def->cost_machine, error);
    }
    if (status == SHCD_OK) {
        status =
            shcdi_modes_check("model_create", SHCD_ERR_ARGUMENT, def->degree, def->modes, error);
    }
    return status != SHCD_OK ? status
                             : shcdi_learned_check("model_create", SHCD_ERR_ARGUMENT,
                                                   def->modes != NULL ? def->modes->n_modes : 0,
                                                   def->learned, error);
}

static shcd_status allocate_pieces(shcd_model *model) {
    const int degree = model->degree;
    const size_t n_coefficients = 3 * SHCD_COUNT(degree);
    const size_t n_constants = shcdi_recurrence_size(degree) + ALIGNMENT_SLACK;
    const size_t n_packed = shcdi_packed_size(degree) + ALIGNMENT_SLACK;
    model->coefficients = take(&model->allocator, n_coefficients, sizeof(double));
    model->recurrence = take(&model->allocator, n_constants, sizeof(double));
    model->packed = take(&model->allocator, n_packed, sizeof(double));
    model->enclosure = take(&model->allocator, (size_t)degree + 1, sizeof(double));
    if (model->coefficients == NULL || model->recurrence == NULL || model->packed == NULL ||
        model->enclosure == NULL) {
        return SHCD_ERR_MEMORY;
    }
    return shcdi_tree_create(shcdi_tree_level_for(degree), &model->allocator, &model->tree);
}

static shcd_status derive_bounds(shcd_model *model) {
    shcdi_bounds bounds;
    const shcd_status status =
        shcdi_bounds_create(model->degree, model->coefficients, &model->allocator, &bounds);
    if (status != SHCD_OK) {
        return status;
    }
    shcdi_tree_fill(&model->tree, &model->series, &bounds, model->evaluation_error_m);
    memcpy(model->m, bounds.sup, sizeof model->m); /* of the three orders */
    shcdi_bounds_free(&bounds, &model->allocator);
    return SHCD_OK;
}

static shcd_status check_shape(const shcd_model *model, shcd_error *error) {
    const double diagonal = model->info.diagonal_m;
    if (!(diagonal >= 1e-9 && diagonal <= 1e9)) {
        return shcdi_fail(error, SHCD_ERR_GEOMETRY,
                          "model_create: the body's diagonal is %.3g m, not in 1e-9 .. 1e9 m",
                          diagonal);
    }
    const double volume = model->info.volume_m3;
    if (!(fabs(volume) > 1e-12 * diagonal * diagonal * diagonal)) {
        return shcdi_fail(error, SHCD_ERR_GEOMETRY,
                          "model_create: the body has no volume (%.3g m^3)", volume);
    }
    if (volume < 0.0) {
        return shcdi_fail(error, SHCD_ERR_GEOMETRY,
                          "model_create: the surface is inside out (volume %.3g m^3); mirror the "
                          "parameter sphere (change the sign of all c_lm with m < 0)",
                          volume);
    }
    return SHCD_OK;
}

/* What the body needs in a query: coefficients, bounds and positions, and its map but for the seeds
 * of Newton's method in it. Tables that depend on the degree only, and those seeds, are counted
 * apart. */
static void fill_bytes(shcd_model *model) {
    shcd_model_info *info = &model->info;
    const int degree = model->degree;
    const size_t seeds = shcdi_map_seed_bytes(&model->map);
    info->body_bytes = sizeof *model +
                       (3 * SHCD_COUNT(degree) + shcdi_packed_size(degree) + ALIGNMENT_SLACK +
                        (size_t)degree + 1) *
                           sizeof(double) +
                       shcdi_index_body_bytes(&model->index) + shcdi_map_bytes(&model->map) - seeds;
    info->table_bytes = (shcdi_recurrence_size(degree) + ALIGNMENT_SLACK) * sizeof(double) +
                        shcdi_index_table_bytes(&model->index);
    info->map_seed_bytes = seeds;
    info->run_time_bytes = info->body_bytes + info->table_bytes + seeds +
                           model->cost.n * sizeof(shcd_cost_row) +
                           (shcdi_modes_count(model->modes.view.n_modes, degree) +
                            shcdi_learned_count(&model->learned.view)) *
                               sizeof(double);
    if (model->tree.n_leaves > 0) { /* kept by a plain model */
        const shcdi_tree *tree = &model->tree;
        info->run_time_bytes += 2 * tree->n_vertices * sizeof(shcd_vec3) +
                                tree->n_leaves * sizeof(shcdi_leaf) +
                                shcdi_tree_ball_count(tree->level) * sizeof(shcdi_ball);
    }
}

static void fill_info(shcd_model *model, const shcd_model_def *def) {
    shcd_model_info *info = &model->info;
    const shcdi_tree *tree = &model->tree;
    info->struct_size = sizeof *info;
    info->degree = model->degree;
    info->is_embedded = shcdi_is_embedded(tree);
    info->embedded_certainty = SHCD_CERTAINTY_SAMPLED;
    info->max_first_derivative_m = model->m[0];
    info->max_second_derivative_m = model->m[1];
    info->max_deviation_m = tree->deviation_max;
    info->n_leaves = tree->n_leaves;
    info->map_resolution = model->map.resolution;
    info->map_crossings_max = model->map.crossings_max;
    info->map_one_crossing_share = model->map.one_crossing_share;
    info->map_bilinear_error_m = model->map.linear_error_m;
    info->map_hermite_error_m = model->map.hermite_error_m;
    info->map_bilinear_rms_m = model->map.linear_rms_m;
    info->map_hermite_rms_m = model->map.hermite_rms_m;
    info->map_equal_count_share = model->map.equal_count_share;
    info->map_bounded_share = model->map.bounded_share;
    info->map_bilinear_bound_m = model->map.bound_m;
    info->map_hermite_bound_m = SHCDI_MAP_HERMITE_RATIO * model->map.bound_m;
    if (def->fit != NULL) {
        info->fit = *def->fit;
    }
}

/* Series, tree and bounds, and what follows from the tree. */
static shcd_status build_surface(shcd_model *model, const double *coefficients, shcd_error *error) {
    const int degree = model->degree;
    shcd_status status = allocate_pieces(model);
    if (status == SHCD_OK) {
        memcpy(model->coefficients, coefficients, 3 * SHCD_COUNT(degree) * sizeof(double));
        double *recurrence = align(model->recurrence), *packed = align(model->packed);
        shcdi_recurrence_fill(degree, recurrence);
        shcdi_pack(degree, model->coefficients, packed);
        model->series = (shcdi_series){degree, recurrence, packed, model->info.simd};
        model->evaluation_error_m = shcdi_evaluation_error(model->coefficients, degree);
        if (degree == 1) {
            shcdi_ellipsoid_make(model->coefficients, &model->ellipsoid);
        }
        status = derive_bounds(model);
    }
    if (status != SHCD_OK) {
        return shcdi_fail(error, status, "model_create: %s", shcd_status_string(status));
    }
    shcdi_shape_measure(model);
    status = check_shape(model, error);
    if (status != SHCD_OK) {
        return status;
    }
    status = shcdi_index_create(&model->tree, &model->series, model->info.centre_m,
                                model->info.radius_m, &model->allocator, &model->index);
    return status == SHCD_OK
               ? SHCD_OK
               : shcdi_fail(error, status, "model_create: %s", shcd_status_string(status));
}

static shcd_status build(shcd_model *model, const shcd_model_def *def, shcd_error *error) {
    shcd_status status = build_surface(model, def->coefficients, error);
    if (status != SHCD_OK) {
        return status;
    }
    status = shcdi_shape_kernel(model);
    if (status == SHCD_OK) {
        status = fill_enclosure(model);
    }
    if (status == SHCD_OK) {
        status = shcdi_map_create(model);
    }
    if (status == SHCD_OK) {
        status = shcdi_cost_copy(def->cost_rows, def->n_cost_rows, def->cost_machine,
                                 &model->allocator, &model->cost);
    }
    if (status == SHCD_OK) {
        status = shcdi_modes_copy(def->modes, model->degree, &model->allocator, &model->modes);
    }
    if (status == SHCD_OK) {
        status = shcdi_learned_copy(def->learned, &model->allocator, &model->learned);
    }
    if (status != SHCD_OK) {
        return shcdi_fail(error, status, "model_create: %s", shcd_status_string(status));
    }
    if (model->map.star_margin_m > 0.0) {
        model->info.star_certainty = SHCD_CERTAINTY_PROVEN;
    }
    fill_info(model, def);
    shcdi_tree_free(&model->tree, &model->allocator);
    fill_bytes(model);
    return SHCD_OK;
}

static shcd_model *model_begin(int degree, int simd, const shcd_allocator *memory) {
    shcd_model *made = memory->allocate(sizeof *made, memory->user);
    if (made != NULL) {
        memset(made, 0, sizeof *made);
        made->allocator = *memory;
        made->degree = degree;
        made->info.simd = shcdi_simd_choose(simd);
    }
    return made;
}

shcd_status shcdi_model_create_plain(int degree, const double *coefficients, int simd,
                                     const shcd_allocator *allocator, shcd_model **model,
                                     shcd_error *error) {
    shcd_model *made = model_begin(degree, simd, allocator);
    if (made == NULL) {
        return shcdi_fail(error, SHCD_ERR_MEMORY, "model_create: out of memory");
    }
    const shcd_status status = build_surface(made, coefficients, error);
    if (status != SHCD_OK) {
        shcd_model_free(made);
        return status;
    }
    fill_bytes(made);
    *model = made;
    return SHCD_OK;
}

shcd_status shcd_model_create(const shcd_model_def *definition, const shcd_allocator *allocator,
                              shcd_model **model, shcd_error *error) {
    if (model == NULL) {
        return shcdi_fail(error, SHCD_ERR_ARGUMENT, "model_create: no place for the model");
    }
    shcd_model_def def;
    shcd_status status = read_definition(definition, &def, error);
    if (status == SHCD_OK) {
        status = check_definition(&def, error);
    }
    if (status != SHCD_OK) {
        return status;
    }
    const shcd_allocator memory = shcdi_allocator(allocator);
    shcd_model *made = model_begin(def.degree, def.simd, &memory);
    if (made == NULL) {
        return shcdi_fail(error, SHCD_ERR_MEMORY, "model_create: out of memory");
    }
    status = build(made, &def, error);
    if (status != SHCD_OK) {
        shcd_model_free(made);
        return status;
    }
    *model = made;
    return SHCD_OK;
}

void shcd_model_free(shcd_model *model) {
    if (model == NULL) {
        return;
    }
    const shcd_allocator memory = model->allocator;
    shcdi_map_free(&model->map, &memory);
    give(&memory, model->modes.numbers);
    give(&memory, model->learned.numbers);
    give(&memory, model->cost.rows);
    shcdi_index_free(&model->index, &memory);
    shcdi_tree_free(&model->tree, &memory);
    give(&memory, model->enclosure);
    give(&memory, model->packed);
    give(&memory, model->recurrence);
    give(&memory, model->coefficients);
    give(&memory, model);
}

/* ---- inspection ---- */

shcd_status shcd_model_describe(const shcd_model *model, shcd_model_info *info) {
    if (model == NULL || info == NULL || info->struct_size < sizeof info->struct_size) {
        return SHCD_ERR_ARGUMENT;
    }
    const size_t size =
        info->struct_size < sizeof model->info ? info->struct_size : sizeof model->info;
    memcpy((char *)info + sizeof(size_t), (const char *)&model->info + sizeof(size_t),
           size - sizeof(size_t));
    return SHCD_OK;
}

int shcd_model_degree(const shcd_model *model) {
    return model != NULL ? model->degree : -1;
}

const double *shcd_model_coefficients(const shcd_model *model) {
    return model != NULL ? model->coefficients : NULL;
}

shcd_status shcd_model_enclosure_offset(const shcd_model *model, int degree, double *offset_m) {
    if (model == NULL || offset_m == NULL || degree < 0 || degree > model->degree) {
        return SHCD_ERR_ARGUMENT;
    }
    *offset_m = model->enclosure[degree];
    return SHCD_OK;
}
