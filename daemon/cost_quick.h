/* SPDX-License-Identifier: BSD-3-Clause */
/* A short measurement of what queries of a body cost here and now, for scenes whose body file holds
 * no cost table of this machine. `shcd cost` measures with more care, and its -o keeps the table.
 */
#ifndef SHCDD_COST_QUICK_H
#define SHCDD_COST_QUICK_H

#include "shcd/shcd.h"

#include <stdbool.h>

/** Rows that one call adds: exact, fast, track, and the model's own map, linear and Hermite. */
#define COST_QUICK_ROWS 5

/** The name of this machine in cost tables: that of the processor. */
void cost_quick_machine(char name[SHCD_COST_MACHINE_SIZE]);

/** Measures one model; takes about 0.1 s at degree 15.
 *
 *  @param[in]  truth  the same body at its full degree: errors are against its exact answers
 *  @param[out] rows   COST_QUICK_ROWS
 *  @return false if a query failed, which it cannot for a model that was made */
bool cost_quick(const shcd_model *truth, const shcd_model *model, shcd_cost_row *rows);

#endif
