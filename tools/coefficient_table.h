/* SPDX-License-Identifier: BSD-3-Clause */
/* A table of coefficients read from CSV and checked to be complete. */
#ifndef SHCD_TOOLS_COEFFICIENT_TABLE_H
#define SHCD_TOOLS_COEFFICIENT_TABLE_H

#include <stdbool.h>
#include <stdio.h>

typedef struct coefficient_table {
    int degree;
    double *coefficients; /**< real basis, 3 (degree+1)^2, order of shcd_model_def */
} coefficient_table;

/** Reads "l,m,x,y,z" or "l,m,x_re,x_im,...". `name` stands in messages. False: reported, and the
 *  table holds nothing. */
bool coefficient_table_read(FILE *file, const char *name, coefficient_table *table);
void coefficient_table_free(coefficient_table *table);

#endif
