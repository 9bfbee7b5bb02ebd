/* SPDX-License-Identifier: BSD-3-Clause */
/* shcd_train(): data, network, test, and a model that carries the result. */
#include "fail.h"
#include "train_test.h"

#include "shcd/vec.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A stiffening indentation takes a hundred times as long, and each term in the depth multiplies the
 * unknowns. */
#define POINTS_LINEAR 600
#define POINTS_STIFFENING 450
#define POINTS_MAX 20000
#define CENTRES_LINEAR 400
#define CENTRES_TERMS 300
#define TERMS_MAX 5

/* ---- options ---- */

typedef struct range_check {
    const char *name;
    double value, low, high; /* low < value <= high, or 0 */
} range_check;

static shcd_status check(const shcd_train_options *s, shcd_error *error) {
    const range_check ranges[] = {
        {"Young's modulus [Pa]", s->young_pa, 0.0, 1e12},
        {"Poisson's ratio", s->poisson_ratio, 0.0, 0.4999},
        {"patch radius [m]", s->patch_radius_m, 0.0, 1e6},
        {"support length [m]", s->support_length_m, 0.0, 1e6},
        {"thickness [m]", s->thickness_m, 0.0, 1e6},
        {"stiffening", s->stiffening, 0.0, 1e4},
        {"largest depth [m]", s->depth_max_m, 0.0, 1e6},
        {"number of points", s->n_points, 7.0, POINTS_MAX},
        {"degree of the space", s->space_degree, 0.0, SHCD_DEGREE_MAX},
        {"number of centres", s->n_centres, 0.0, SHCD_LEARNED_CENTRES_MAX},
    };
    for (size_t i = 0; i < sizeof ranges / sizeof ranges[0]; i++) {
        const range_check *r = &ranges[i];
        if (!isfinite(r->value)) {
            return shcdi_fit_fail(error, SHCD_ERR_NOT_FINITE, "train: %s is not finite", r->name);
        }
        if (r->value != 0.0 && !(r->value > r->low && r->value <= r->high)) {
            return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT,
                                  "train: %s: %g is not above %g and at most %g", r->name, r->value,
                                  r->low, r->high);
        }
    }
    if (s->n_samples > 0 && s->samples == NULL) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT, "train: samples is null");
    }
    return SHCD_OK;
}

static shcd_status resolve(const shcd_train_options *given, shcd_train_options *s,
                           shcd_error *error) {
    const shcd_train_options defaults = SHCD_TRAIN_OPTIONS_INIT;
    *s = defaults;
    if (given != NULL) {
        if (given->struct_size < sizeof given->struct_size) {
            return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT,
                                  "train: options without struct_size (use "
                                  "SHCD_TRAIN_OPTIONS_INIT)");
        }
        memcpy(s, given, given->struct_size < sizeof *s ? given->struct_size : sizeof *s);
        s->struct_size = sizeof *s;
    }
    const shcd_status status = check(s, error);
    if (s->n_points == 0) {
        s->n_points = s->stiffening > 0.0 ? POINTS_STIFFENING : POINTS_LINEAR;
    }
    s->seed = s->seed != 0 ? s->seed : 1;
    return status;
}

static double or_default(double value, double otherwise) {
    return value > 0.0 ? value : otherwise;
}

static shcdi_membrane_material material_of(const shcd_train_options *s) {
    shcdi_membrane_material m = {.young_pa = or_default(s->young_pa, 5000.0),
                                 .poisson = or_default(s->poisson_ratio, 0.45),
                                 .patch_radius_m = or_default(s->patch_radius_m, 0.005),
                                 .support_length_m = or_default(s->support_length_m, 0.02),
                                 .stiffening = s->stiffening};
    shcdi_membrane_match(&m);
    if (s->thickness_m > 0.0) {
        m.foundation_n_per_m3 *= s->thickness_m / m.thickness_m;
        m.thickness_m = s->thickness_m;
    }
    return m;
}

/* ---- the two kinds of data ---- */

typedef struct training {
    const shcd_model *model;
    shcd_train_options options;
    shcdi_progress progress;
    shcdi_train_source source; /* membrane only */
    shcdi_train_data data;
    shcd_learned network;
    double *numbers; /* centres, weights, dents */
} training;

static shcd_status press_membrane(training *t, shcd_error *error) {
    const shcdi_membrane_material material = material_of(&t->options);
    shcd_model_info info = SHCD_MODEL_INFO_INIT;
    shcd_status status = shcd_model_describe(t->model, &info);
    if (status != SHCD_OK) {
        return shcdi_fit_fail(error, status, "train: %s", shcd_status_string(status));
    }
    const double depth_max_m = or_default(
        t->options.depth_max_m, fmin(2.0 * material.patch_radius_m, 0.05 * info.diagonal_m));
    status = shcdi_train_source_init(&t->source, t->model, &material, t->options.space_degree,
                                     depth_max_m, &t->progress, error);
    if (status != SHCD_OK) {
        return status;
    }
    shcd_learned *network = &t->network;
    network->record.source = SHCD_LEARNED_MEMBRANE;
    network->record.quadrature_error = t->source.quadrature_error;
    network->young_pa = material.young_pa;
    network->poisson_ratio = material.poisson;
    network->patch_radius_m = material.patch_radius_m;
    network->support_length_m = material.support_length_m;
    network->thickness_m = material.thickness_m;
    network->foundation_n_per_m3 = material.foundation_n_per_m3;
    network->stiffening = material.stiffening;
    network->direct_n_per_m = 2.0 * material.young_pa * material.patch_radius_m /
                              (1.0 - material.poisson * material.poisson);
    return shcdi_train_data_press(&t->data, &t->source, depth_max_m, (size_t)t->options.n_points,
                                  (uint64_t)t->options.seed, &t->progress, error);
}

/* Outside of a table's domain: the line through zero that fits its forces best. */
static void direct_of_table(training *t) {
    double above = 0.0, below = 0.0;
    for (size_t i = 0; i < t->data.train.n_rows; i++) {
        const shcdi_train_row *row = &t->data.train.row[i];
        above += row->depth_m * row->force_n;
        below += row->depth_m * row->depth_m;
    }
    t->network.direct_n_per_m = fmax(0.0, above / below);
}

static shcd_status take_table(training *t, shcd_error *error) {
    const shcd_status status =
        shcdi_train_data_table(&t->data, t->model, &t->options, (uint64_t)t->options.seed, error);
    if (status == SHCD_OK) {
        t->network.record.source = SHCD_LEARNED_SAMPLES;
        direct_of_table(t);
    }
    return status;
}

/* ---- network, test, model ---- */

static shcd_status fit_network(training *t, shcd_error *error) {
    const int has_terms = t->options.samples != NULL || t->options.stiffening > 0.0;
    const size_t most = has_terms ? CENTRES_TERMS : CENTRES_LINEAR;
    const size_t share = 2 * t->data.train.n_places / 3, wanted = (size_t)t->options.n_centres;
    const shcdi_train_settings settings = {.n_centres = wanted > 0     ? wanted
                                                        : share < most ? share
                                                                       : most,
                                           .n_terms = has_terms ? TERMS_MAX : 1,
                                           .has_speed =
                                               t->options.samples != NULL && t->options.has_speed,
                                           .wants_consistency = t->options.samples != NULL};
    const size_t n = settings.n_centres;
    t->numbers = calloc(3 * n + (n + 1 + t->data.n_modes) * TERMS_MAX, sizeof *t->numbers);
    if (t->numbers == NULL) {
        return shcdi_fit_fail(error, SHCD_ERR_MEMORY, "train: out of memory");
    }
    shcd_status status = shcdi_train_network(&t->data.train, &settings, &t->progress, t->numbers,
                                             &t->network, &t->network.record.consistency_rms_n);
    if (status == SHCD_OK && t->data.n_modes > 0) {
        double *dent =
            t->numbers + 3 * t->network.n_centres + (t->network.n_centres + 1) * t->network.n_terms;
        status = shcdi_train_dents(&t->data, t->network.n_terms, dent);
        t->network.dent_m3_per_n = dent;
        t->network.n_modes = t->data.n_modes;
    }
    return status == SHCD_OK
               ? SHCD_OK
               : shcdi_fit_fail(error, status, "train: network: %s", shcd_status_string(status));
}

static shcd_status test_network(training *t, shcd_error *error) {
    const int is_table = t->options.samples != NULL;
    shcd_status status = shcdi_train_test(&t->data, is_table ? NULL : t->source.dents, &t->network,
                                          t->options.watch, t->options.watch_user);
    if (status != SHCD_OK) {
        return shcdi_fit_fail(error, status, "train: %s", shcd_status_string(status));
    }
    return shcdi_train_examine(&t->data, is_table ? NULL : t->model, &t->network, error);
}

static shcd_status make_model(const training *t, const shcd_allocator *allocator,
                              shcd_model **trained, shcd_error *error) {
    shcd_model_info info = SHCD_MODEL_INFO_INIT;
    const shcd_status status = shcd_model_describe(t->model, &info);
    if (status != SHCD_OK) {
        return shcdi_fit_fail(error, status, "train: %s", shcd_status_string(status));
    }
    shcd_model_def definition = SHCD_MODEL_DEF_INIT;
    definition.degree = shcd_model_degree(t->model);
    definition.simd = info.simd;
    definition.coefficients = shcd_model_coefficients(t->model);
    definition.fit = info.fit.n_triangles > 0 ? &info.fit : NULL;
    definition.cost_rows = shcd_model_cost_rows(t->model, &definition.n_cost_rows);
    definition.cost_machine = shcd_model_cost_machine(t->model);
    definition.modes = t->source.modes != NULL ? t->source.modes : shcd_model_modes(t->model);
    definition.learned = &t->network;
    return shcd_model_create(&definition, allocator, trained, error);
}

shcd_status shcd_train(const shcd_model *model, const shcd_train_options *options,
                       const shcd_allocator *allocator, shcd_model **trained, shcd_error *error) {
    if (model == NULL || trained == NULL) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT, "train: no model, or no place for one");
    }
    training t = {.model = model};
    shcd_status status = resolve(options, &t.options, error);
    if (status != SHCD_OK) {
        return status;
    }
    t.progress = (shcdi_progress){t.options.progress, t.options.progress_user};
    status = t.options.samples != NULL ? take_table(&t, error) : press_membrane(&t, error);
    status = status == SHCD_OK ? fit_network(&t, error) : status;
    status = status == SHCD_OK ? test_network(&t, error) : status;
    status = status == SHCD_OK ? make_model(&t, allocator, trained, error) : status;
    shcdi_train_data_release(&t.data);
    shcdi_train_source_release(&t.source);
    free(t.numbers);
    return status;
}
