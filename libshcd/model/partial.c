/* SPDX-License-Identifier: BSD-3-Clause */
/* Every lower degree's surface on the way to the highest. */
#include "base/harmonics.h"
#include "model/model.h"

shcd_status shcd_model_partial_sums(const shcd_model *model, shcd_vec3 parameter,
                                    shcd_vec3 *sums_m) {
    shcd_vec3 w;
    if (model == NULL || sums_m == NULL) {
        return SHCD_ERR_ARGUMENT;
    }
    const shcd_status status = shcdi_direction(parameter, &w);
    if (status == SHCD_OK) {
        shcdi_surface_partial(&model->series, w, sums_m);
    }
    return status;
}
