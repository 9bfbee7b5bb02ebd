/* SPDX-License-Identifier: BSD-3-Clause */
/* GSL's nodes are good to the last bit, but where it has no table (n = 151, say) its weights are
 * only good to 6e-10: they are made from the nodes here. */
#include "gauss.h"

#include <gsl/gsl_errno.h>
#include <gsl/gsl_integration.h>

/* 2 / ((1 - z^2) P_n'(z)^2), P_n and P_n-1 by the three-term recurrence. */
static double weight_at_node(size_t n, double z) {
    double before = 1.0, value = z;
    for (size_t l = 2; l <= n; ++l) {
        const double next =
            ((double)(2 * l - 1) * z * value - (double)(l - 1) * before) / (double)l;
        before = value;
        value = next;
    }
    const double sine2 = (1.0 - z) * (1.0 + z);
    const double derivative = (double)n * (before - z * value) / sine2;
    return 2.0 / (sine2 * derivative * derivative);
}

shcd_status shcdi_gauss_nodes(size_t n, double *z, double *weight) {
    gsl_error_handler_t *handler = gsl_set_error_handler_off();
    gsl_integration_glfixed_table *table = gsl_integration_glfixed_table_alloc(n);
    shcd_status status = table != NULL ? SHCD_OK : SHCD_ERR_MEMORY;
    for (size_t j = 0; j < n && status == SHCD_OK; ++j) {
        const size_t i = n - 1 - j; /* GSL's nodes ascend */
        double rough_weight;
        if (gsl_integration_glfixed_point(-1.0, 1.0, i, &z[j], &rough_weight, table) !=
            GSL_SUCCESS) {
            status = SHCD_ERR_ARGUMENT;
        }
        weight[j] = weight_at_node(n, z[j]);
    }
    if (table != NULL) {
        gsl_integration_glfixed_table_free(table);
    }
    gsl_set_error_handler(handler);
    return status;
}
