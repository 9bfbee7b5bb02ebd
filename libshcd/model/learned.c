/* SPDX-License-Identifier: BSD-3-Clause */
/* The learned response of a model. It comes from a training or from a file, and a force is made of
 * it in every tick. Refused are numbers that could overflow in a tick, and, since an energy below
 * zero or a force that pulls the tool in cannot be seen in the numbers, what does so at a centre.
 */
#include "model/learned.h"

#include "model/bytes.h"
#include "model/learned_eval.h"
#include "model/model.h"

/* A body measures 1e-9 .. 1e9 m. A depth of that size times the largest weight, its square and the
 * sum over all centres and terms stay finite. */
#define LENGTH_MAX 1e10
#define LENGTH_MIN 1e-15
#define NUMBER_MAX 1e30
/* Depths at which the energy is looked at, at each centre. */
#define CHECKED_DEPTHS 8

#define N_SCALARS 12u
#define N_ERRORS 16u
#define HEAD_SIZE (16u + 16u + 8u * (N_SCALARS + N_ERRORS))

#define SCALARS_AT offsetof(shcd_learned, support_m)
#define ERRORS_AT offsetof(shcd_learned_record, force_error_max_n)
_Static_assert(offsetof(shcd_learned, record) == SCALARS_AT + 8 * N_SCALARS &&
                   sizeof(shcd_learned_record) == ERRORS_AT + 8 * N_ERRORS && ERRORS_AT == 24,
               "LEAR holds the scalars and the record field by field");

static size_t count_of(size_t n_centres, size_t n_terms, size_t n_modes) {
    return n_centres == 0 ? 0 : 3 * n_centres + (n_centres + 1 + n_modes) * n_terms;
}

size_t shcdi_learned_count(const shcd_learned *learned) {
    return count_of(learned->n_centres, learned->n_terms, learned->n_modes);
}

/* ---- checks ---- */

static shcd_status check_counts(const char *where, shcd_status wrong, size_t n_modes,
                                const shcd_learned *l, shcd_error *error) {
    if (l->n_centres < 1 || l->n_centres > SHCD_LEARNED_CENTRES_MAX || l->n_terms < 1 ||
        l->n_terms > SHCD_LEARNED_TERMS_MAX) {
        return shcdi_fail(error, wrong,
                          "%s: %zu centres and %zu terms of the learned response, not 1 .. %d and "
                          "1 .. %d",
                          where, l->n_centres, l->n_terms, SHCD_LEARNED_CENTRES_MAX,
                          SHCD_LEARNED_TERMS_MAX);
    }
    if (l->n_modes > n_modes) {
        return shcdi_fail(error, wrong, "%s: dents of %zu modes, the body has %zu", where,
                          l->n_modes, n_modes);
    }
    if (l->record.source != SHCD_LEARNED_MEMBRANE && l->record.source != SHCD_LEARNED_SAMPLES) {
        return shcdi_fail(error, wrong, "%s: unknown source %d of the learned response", where,
                          (int)l->record.source);
    }
    if (l->centre_m == NULL || l->weight_n_per_m == NULL ||
        (l->n_modes > 0 && l->dent_m3_per_n == NULL)) {
        return shcdi_fail(error, wrong, "%s: no centres, weights or dents of the learned response",
                          where);
    }
    return SHCD_OK;
}

static shcd_status check_value(const char *where, shcd_status wrong, const char *name, size_t i,
                               double value, double low, double high, shcd_error *error) {
    if (!shcdi_is_finite(value)) {
        return shcdi_fail(error, SHCD_ERR_NOT_FINITE,
                          "%s: %s %zu of the learned response is not "
                          "finite",
                          where, name, i);
    }
    return value >= low && value <= high
               ? SHCD_OK
               : shcdi_fail(error, wrong, "%s: %s %zu of the learned response is %.3g", where, name,
                            i, value);
}

static shcd_status check_scalars(const char *where, shcd_status wrong, const shcd_learned *l,
                                 shcd_error *error) {
    double scalars[N_SCALARS], errors[N_ERRORS];
    memcpy(scalars, (const char *)l + SCALARS_AT, sizeof scalars);
    memcpy(errors, (const char *)&l->record + ERRORS_AT, sizeof errors);
    shcd_status status = SHCD_OK;
    for (size_t i = 0; i < N_SCALARS && status == SHCD_OK; i++) {
        const int is_length = i < 3; /* support, fill, depth_max */
        status = check_value(where, wrong, "value", i, scalars[i], is_length ? LENGTH_MIN : 0.0,
                             is_length ? LENGTH_MAX : NUMBER_MAX, error);
    }
    for (size_t i = 0; i < N_ERRORS && status == SHCD_OK; i++) {
        status = check_value(where, wrong, "record", i, errors[i], 0.0, NUMBER_MAX, error);
    }
    return status;
}

static shcd_status check_numbers(const char *where, shcd_status wrong, const shcd_learned *l,
                                 shcd_error *error) {
    const struct {
        const char *name;
        const double *values;
        size_t n;
        double most;
    } part[3] = {
        {"coordinate", l->centre_m, 3 * l->n_centres, LENGTH_MAX},
        {"weight", l->weight_n_per_m, (l->n_centres + 1) * l->n_terms, NUMBER_MAX},
        {"dent", l->dent_m3_per_n, l->n_modes * l->n_terms, NUMBER_MAX},
    };
    shcd_status status = SHCD_OK;
    for (size_t k = 0; k < 3; k++) {
        for (size_t i = 0; i < part[k].n && status == SHCD_OK; i++) {
            status = check_value(where, wrong, part[k].name, i, part[k].values[i], -part[k].most,
                                 part[k].most, error);
        }
    }
    return status;
}

static shcd_status check_energy(const char *where, shcd_status wrong, const shcd_learned *l,
                                shcd_error *error) {
    for (size_t j = 0; j < l->n_centres; j++) {
        const double *c = l->centre_m + 3 * j;
        shcdi_learned_site site;
        shcdi_learned_at(l, shcd_vec3_make(c[0], c[1], c[2]), 0, &site);
        for (int i = 1; i <= CHECKED_DEPTHS; i++) {
            shcd_learned_output out;
            shcdi_learned_press(l, &site, l->depth_max_m * i / CHECKED_DEPTHS, &out);
            if (!(out.energy_j > 0.0) || !(out.force_n > 0.0)) {
                return shcdi_fail(error, wrong,
                                  "%s: the learned response at centre %zu, depth %.3g m, has "
                                  "energy %.3g J and force %.3g N",
                                  where, j, l->depth_max_m * i / CHECKED_DEPTHS, out.energy_j,
                                  out.force_n);
            }
        }
    }
    return SHCD_OK;
}

shcd_status shcdi_learned_check(const char *where, shcd_status wrong, size_t n_modes,
                                const shcd_learned *learned, shcd_error *error) {
    if (learned == NULL) {
        return SHCD_OK;
    }
    shcd_status status = check_counts(where, wrong, n_modes, learned, error);
    status = status == SHCD_OK ? check_scalars(where, wrong, learned, error) : status;
    status = status == SHCD_OK ? check_numbers(where, wrong, learned, error) : status;
    return status == SHCD_OK ? check_energy(where, wrong, learned, error) : status;
}

/* ---- in the model ---- */

/* Points the arrays into one piece of memory. */
static void point_into(double *numbers, shcd_learned *view) {
    view->centre_m = numbers;
    view->weight_n_per_m = numbers + 3 * view->n_centres;
    view->dent_m3_per_n =
        view->n_modes > 0 ? view->weight_n_per_m + (view->n_centres + 1) * view->n_terms : NULL;
}

shcd_status shcdi_learned_copy(const shcd_learned *learned, const shcd_allocator *allocator,
                               shcdi_learned *copy) {
    if (learned == NULL) {
        return SHCD_OK;
    }
    const size_t n_centre = 3 * learned->n_centres;
    const size_t n_weight = (learned->n_centres + 1) * learned->n_terms;
    const size_t n_dent = learned->n_modes * learned->n_terms;
    copy->numbers =
        allocator->allocate(shcdi_learned_count(learned) * sizeof(double), allocator->user);
    if (copy->numbers == NULL) {
        return SHCD_ERR_MEMORY;
    }
    memcpy(copy->numbers, learned->centre_m, n_centre * sizeof(double));
    memcpy(copy->numbers + n_centre, learned->weight_n_per_m, n_weight * sizeof(double));
    if (n_dent > 0) {
        memcpy(copy->numbers + n_centre + n_weight, learned->dent_m3_per_n,
               n_dent * sizeof(double));
    }
    copy->view = *learned;
    point_into(copy->numbers, &copy->view);
    return SHCD_OK;
}

const shcd_learned *shcd_model_learned(const shcd_model *model) {
    return model != NULL && model->learned.view.n_centres > 0 ? &model->learned.view : NULL;
}

/* ---- bytes: four counts u32, two u64, the scalars, the record, then the arrays ---- */

size_t shcdi_learned_payload_size(const shcd_learned *learned) {
    return HEAD_SIZE + 8 * shcdi_learned_count(learned);
}

void shcdi_learned_write(const shcdi_learned *learned, unsigned char *payload) {
    const shcd_learned *l = &learned->view;
    double values[N_SCALARS + N_ERRORS];
    memcpy(values, (const char *)l + SCALARS_AT, 8 * N_SCALARS);
    memcpy(values + N_SCALARS, (const char *)&l->record + ERRORS_AT, 8 * N_ERRORS);
    shcdi_put_u32(payload, (uint32_t)l->n_centres);
    shcdi_put_u32(payload + 4, (uint32_t)l->n_terms);
    shcdi_put_u32(payload + 8, (uint32_t)l->n_modes);
    shcdi_put_u32(payload + 12, (uint32_t)l->record.source);
    shcdi_put_u64(payload + 16, l->record.n_samples);
    shcdi_put_u64(payload + 24, l->record.n_holdout);
    for (size_t i = 0; i < N_SCALARS + N_ERRORS; i++) {
        shcdi_put_double(payload + 32 + 8 * i, values[i]);
    }
    for (size_t i = 0; i < shcdi_learned_count(l); i++) {
        shcdi_put_double(payload + HEAD_SIZE + 8 * i, learned->numbers[i]);
    }
}

size_t shcdi_learned_payload_count(const unsigned char *payload, uint64_t length) {
    if (length < HEAD_SIZE) {
        return 0;
    }
    const size_t n_centres = shcdi_get_u32(payload), n_terms = shcdi_get_u32(payload + 4);
    const size_t n_modes = shcdi_get_u32(payload + 8);
    if (n_centres < 1 || n_centres > SHCD_LEARNED_CENTRES_MAX || n_terms < 1 ||
        n_terms > SHCD_LEARNED_TERMS_MAX || n_modes > SHCD_MODES_MAX) {
        return 0;
    }
    const size_t count = count_of(n_centres, n_terms, n_modes);
    return length == HEAD_SIZE + 8 * (uint64_t)count ? count : 0;
}

void shcdi_learned_read(const unsigned char *payload, double *numbers, shcd_learned *learned) {
    const uint32_t source = shcdi_get_u32(payload + 12);
    double values[N_SCALARS + N_ERRORS];
    for (size_t i = 0; i < N_SCALARS + N_ERRORS; i++) {
        values[i] = shcdi_get_double(payload + 32 + 8 * i);
    }
    memset(learned, 0, sizeof *learned);
    learned->n_centres = shcdi_get_u32(payload);
    learned->n_terms = shcdi_get_u32(payload + 4);
    learned->n_modes = shcdi_get_u32(payload + 8);
    memcpy(&learned->record.source, &source, sizeof source);
    learned->record.n_samples = shcdi_get_u64(payload + 16);
    learned->record.n_holdout = shcdi_get_u64(payload + 24);
    memcpy((char *)learned + SCALARS_AT, values, 8 * N_SCALARS);
    memcpy((char *)&learned->record + ERRORS_AT, values + N_SCALARS, 8 * N_ERRORS);
    const size_t count = shcdi_learned_count(learned);
    for (size_t i = 0; i < count; i++) {
        numbers[i] = shcdi_get_double(payload + HEAD_SIZE + 8 * i);
    }
    point_into(numbers, learned);
}
