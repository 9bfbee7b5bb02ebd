/* SPDX-License-Identifier: BSD-3-Clause */
/* Nodes and weights of Gauss-Legendre quadrature on [-1, 1]. */
#ifndef SHCD_FIT_GAUSS_H
#define SHCD_FIT_GAUSS_H

#include "shcd/base.h"

/** @param[out] z       n roots of P_n, descending
 *  @param[out] weight  n weights, sum 2
 *  @return SHCD_OK, SHCD_ERR_MEMORY, SHCD_ERR_ARGUMENT. Sets GSL's error handler meanwhile. */
shcd_status shcdi_gauss_nodes(size_t n, double *z, double *weight);

#endif
