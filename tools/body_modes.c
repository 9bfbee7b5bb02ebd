/* SPDX-License-Identifier: BSD-3-Clause */
/* Area and volume stand beside the modes since they come from the same quadrature, which is far
 * more accurate than the tessellation that gives a body's own. */
#include "body_modes.h"

#include <stddef.h>

void body_print_modes(FILE *file, const shcd_modes *modes) {
    if (modes == NULL) {
        fprintf(file, "%-22snone\n", "modes");
        return;
    }
    fprintf(file,
            "%-22s%zu%s, eigenvalues %.6g to %.6g /m^2, agreement %.2g; area %.9g m^2, volume %.9g "
            "m^3\n",
            "modes", modes->n_modes, modes->is_anchored != 0 ? " (anchored)" : "",
            modes->eigenvalue_per_m2[0], modes->eigenvalue_per_m2[modes->n_modes - 1],
            modes->eigenvalue_error, modes->area_m2, modes->volume_m3);
}

void body_write_modes(json_writer *json, const shcd_modes *modes) {
    if (modes == NULL) {
        json_null(json, "modes");
        return;
    }
    json_open_object(json, "modes");
    json_count(json, "n_modes", modes->n_modes);
    json_bool(json, "is_anchored", modes->is_anchored != 0);
    json_number(json, "area_m2", modes->area_m2);
    json_number(json, "volume_m3", modes->volume_m3);
    json_number(json, "eigenvalue_error", modes->eigenvalue_error);
    json_open_array(json, "eigenvalues_per_m2");
    for (size_t i = 0; i < modes->n_modes; i++) {
        json_number(json, NULL, modes->eigenvalue_per_m2[i]);
    }
    json_close_array(json);
    json_close_object(json);
}
