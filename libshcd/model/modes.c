/* SPDX-License-Identifier: BSD-3-Clause */
/* The modes of a model's surface. They come from a fit or from a file, and a response is made of
 * them in every tick: what it cannot take (a negative or misplaced eigenvalue, a number that
 * overflows in a product) is refused in both cases by the same check. */
#include "model/modes.h"

#include "model/bytes.h"
#include "model/model.h"

/* A body measures 1e-9 .. 1e9 m; the square of a number up to this one is still finite in SI units
 * of any material. */
#define NUMBER_MAX 1e30

#define HEAD_SIZE 40u /* count, degree, anchored, reserved: u32; area, volume, error: doubles */

size_t shcdi_modes_count(size_t n_modes, int degree) {
    return n_modes * (1 + SHCD_COUNT(degree));
}

/* ---- checks, of a structure and of bytes alike ---- */

typedef double number_at(const void *source, size_t n_modes, size_t i);

static double number_of_view(const void *source, size_t n_modes, size_t i) {
    const shcd_modes *modes = source;
    return i < n_modes ? modes->eigenvalue_per_m2[i] : modes->coefficient_per_m[i - n_modes];
}

static double number_of_payload(const void *source, size_t n_modes, size_t i) {
    (void)n_modes;
    return shcdi_get_double((const unsigned char *)source + HEAD_SIZE + 8 * i);
}

static shcd_status check_head(const char *where, shcd_status wrong, int degree,
                              const shcd_modes *modes, shcd_error *error) {
    const size_t n = SHCD_COUNT(degree);
    const size_t most = n < SHCD_MODES_MAX ? n : SHCD_MODES_MAX;
    if (modes->n_modes < 1 || modes->n_modes > most) {
        return shcdi_fail(error, wrong, "%s: %zu modes, not 1 .. %zu", where, modes->n_modes, most);
    }
    const double values[3] = {modes->area_m2, modes->volume_m3, modes->eigenvalue_error};
    static const char *const names[3] = {"area", "volume", "eigenvalue error"};
    for (int i = 0; i < 3; i++) {
        if (!shcdi_is_finite(values[i])) {
            return shcdi_fail(error, SHCD_ERR_NOT_FINITE, "%s: the modes' %s is not finite", where,
                              names[i]);
        }
        if (!(values[i] > 0.0 || (i == 2 && values[i] == 0.0)) || values[i] > NUMBER_MAX) {
            return shcdi_fail(error, wrong, "%s: the modes' %s is %.3g", where, names[i],
                              values[i]);
        }
    }
    if (modes->is_anchored != 0 && modes->is_anchored != 1) {
        return shcdi_fail(error, wrong, "%s: is_anchored of the modes is %d, not 0 or 1", where,
                          (int)modes->is_anchored);
    }
    return SHCD_OK;
}

static shcd_status check_numbers(const char *where, shcd_status wrong, int degree, size_t n_modes,
                                 number_at *at, const void *source, shcd_error *error) {
    double last = 0.0;
    for (size_t i = 0; i < n_modes; i++) {
        const double lambda = at(source, n_modes, i);
        if (!shcdi_is_finite(lambda)) {
            return shcdi_fail(error, SHCD_ERR_NOT_FINITE, "%s: eigenvalue %zu is not finite", where,
                              i);
        }
        if (lambda < last || lambda > NUMBER_MAX) {
            return shcdi_fail(error, wrong,
                              "%s: eigenvalue %zu is %.3g: negative, below the one before, or "
                              "beyond %.0g",
                              where, i, lambda, NUMBER_MAX);
        }
        last = lambda;
    }
    const size_t n = SHCD_COUNT(degree);
    for (size_t i = 0; i < n_modes * n; i++) {
        const double value = at(source, n_modes, n_modes + i);
        if (!shcdi_is_finite(value) || fabs(value) > NUMBER_MAX) {
            return shcdi_fail(error, shcdi_is_finite(value) ? wrong : SHCD_ERR_NOT_FINITE,
                              "%s: coefficient %zu of mode %zu is not finite or beyond %.0g", where,
                              i % n, i / n, NUMBER_MAX);
        }
    }
    return SHCD_OK;
}

shcd_status shcdi_modes_check(const char *where, shcd_status wrong, int degree,
                              const shcd_modes *modes, shcd_error *error) {
    if (modes == NULL) {
        return SHCD_OK;
    }
    const shcd_status status = check_head(where, wrong, degree, modes, error);
    if (status != SHCD_OK) {
        return status;
    }
    if (modes->eigenvalue_per_m2 == NULL || modes->coefficient_per_m == NULL) {
        return shcdi_fail(error, wrong, "%s: no eigenvalues or no coefficients of the modes",
                          where);
    }
    return check_numbers(where, wrong, degree, modes->n_modes, number_of_view, modes, error);
}

/* ---- in the model ---- */

shcd_status shcdi_modes_copy(const shcd_modes *modes, int degree, const shcd_allocator *allocator,
                             shcdi_modes *copy) {
    if (modes == NULL) {
        return SHCD_OK;
    }
    const size_t n = modes->n_modes, count = shcdi_modes_count(n, degree);
    copy->numbers = allocator->allocate(count * sizeof *copy->numbers, allocator->user);
    if (copy->numbers == NULL) {
        return SHCD_ERR_MEMORY;
    }
    memcpy(copy->numbers, modes->eigenvalue_per_m2, n * sizeof *copy->numbers);
    memcpy(copy->numbers + n, modes->coefficient_per_m, (count - n) * sizeof *copy->numbers);
    copy->view = *modes;
    copy->view.eigenvalue_per_m2 = copy->numbers;
    copy->view.coefficient_per_m = copy->numbers + n;
    return SHCD_OK;
}

const shcd_modes *shcd_model_modes(const shcd_model *model) {
    return model != NULL && model->modes.view.n_modes > 0 ? &model->modes.view : NULL;
}

/* ---- bytes ---- */

size_t shcdi_modes_payload_size(size_t n_modes, int degree) {
    return HEAD_SIZE + 8 * shcdi_modes_count(n_modes, degree);
}

void shcdi_modes_write(const shcdi_modes *modes, int degree, unsigned char *payload) {
    const shcd_modes *view = &modes->view;
    shcdi_put_u32(payload, (uint32_t)view->n_modes);
    shcdi_put_u32(payload + 4, (uint32_t)degree);
    shcdi_put_u32(payload + 8, (uint32_t)view->is_anchored);
    shcdi_put_u32(payload + 12, (uint32_t)view->reserved0);
    shcdi_put_double(payload + 16, view->area_m2);
    shcdi_put_double(payload + 24, view->volume_m3);
    shcdi_put_double(payload + 32, view->eigenvalue_error);
    for (size_t i = 0; i < shcdi_modes_count(view->n_modes, degree); i++) {
        shcdi_put_double(payload + HEAD_SIZE + 8 * i, modes->numbers[i]);
    }
}

size_t shcdi_modes_payload_count(const unsigned char *payload, uint64_t length) {
    const uint32_t n = length >= HEAD_SIZE ? shcdi_get_u32(payload) : 0;
    const uint32_t degree = length >= HEAD_SIZE ? shcdi_get_u32(payload + 4) : 0;
    const int fits = n > 0 && n <= SHCD_MODES_MAX && degree >= 1 && degree <= SHCD_DEGREE_MAX &&
                     length == shcdi_modes_payload_size(n, (int)degree);
    return fits ? n : 0;
}

static void read_head(const unsigned char *payload, shcd_modes *modes) {
    const uint32_t words[2] = {shcdi_get_u32(payload + 8), shcdi_get_u32(payload + 12)};
    memset(modes, 0, sizeof *modes);
    modes->n_modes = shcdi_get_u32(payload);
    memcpy(&modes->is_anchored, &words[0], sizeof modes->is_anchored);
    memcpy(&modes->reserved0, &words[1], sizeof modes->reserved0);
    modes->area_m2 = shcdi_get_double(payload + 16);
    modes->volume_m3 = shcdi_get_double(payload + 24);
    modes->eigenvalue_error = shcdi_get_double(payload + 32);
}

shcd_status shcdi_modes_check_payload(const char *where, int degree, const unsigned char *payload,
                                      shcd_error *error) {
    shcd_modes head;
    if (shcdi_get_u32(payload + 4) != (uint32_t)degree) {
        return shcdi_fail(error, SHCD_ERR_FORMAT, "%s: modes of degree %u, the body's is %d", where,
                          shcdi_get_u32(payload + 4), degree);
    }
    read_head(payload, &head);
    const shcd_status status = check_head(where, SHCD_ERR_FORMAT, degree, &head, error);
    return status != SHCD_OK ? status
                             : check_numbers(where, SHCD_ERR_FORMAT, degree, head.n_modes,
                                             number_of_payload, payload, error);
}

void shcdi_modes_read(const unsigned char *payload, double *numbers, shcd_modes *modes) {
    const int degree = (int)shcdi_get_u32(payload + 4);
    read_head(payload, modes);
    for (size_t i = 0; i < shcdi_modes_count(modes->n_modes, degree); i++) {
        numbers[i] = shcdi_get_double(payload + HEAD_SIZE + 8 * i);
    }
    modes->eigenvalue_per_m2 = numbers;
    modes->coefficient_per_m = numbers + modes->n_modes;
}
