/* SPDX-License-Identifier: BSD-3-Clause */
/* The surface of a model, or of any series, at one parameter: point, normal, Jacobian. */
#include "base/harmonics.h"
#include "model/model.h"

shcd_status shcdi_surface_values(const shcdi_series *series, int degree, shcd_vec3 parameter,
                                 shcd_vec3 *point, shcd_vec3 *normal, double *jacobian) {
    shcd_vec3 w;
    const shcd_status status = shcdi_direction(parameter, &w);
    if (status != SHCD_OK) {
        return status;
    }
    if (normal == NULL && jacobian == NULL) {
        if (point != NULL) {
            *point = shcdi_surface_point(series, degree, w);
        }
        return SHCD_OK;
    }
    shcdi_jet jet;
    shcdi_surface_first(series, degree, w, &jet);
    if (point != NULL) {
        *point = jet.s;
    }
    if (normal != NULL) {
        *normal = shcd_unit(shcd_cross(jet.s1, jet.s2));
    }
    if (jacobian != NULL) {
        const double a[3] = {jet.s1.x, jet.s1.y, jet.s1.z}, b[3] = {jet.s2.x, jet.s2.y, jet.s2.z};
        for (int k = 0; k < 3; k++) {
            jacobian[3 * k] = a[k] * jet.t1.x + b[k] * jet.t2.x;
            jacobian[3 * k + 1] = a[k] * jet.t1.y + b[k] * jet.t2.y;
            jacobian[3 * k + 2] = a[k] * jet.t1.z + b[k] * jet.t2.z;
        }
    }
    return SHCD_OK;
}

shcd_status shcd_model_surface(const shcd_model *model, int degree, shcd_vec3 parameter,
                               shcd_vec3 *point, shcd_vec3 *normal, double *jacobian) {
    if (model == NULL || degree < -1 || degree > model->degree) {
        return SHCD_ERR_ARGUMENT;
    }
    return shcdi_surface_values(&model->series, degree == -1 ? model->degree : degree, parameter,
                                point, normal, jacobian);
}
