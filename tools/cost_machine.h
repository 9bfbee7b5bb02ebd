/* SPDX-License-Identifier: BSD-3-Clause */
/* On what a measurement was made. */
#ifndef SHCD_TOOLS_COST_MACHINE_H
#define SHCD_TOOLS_COST_MACHINE_H

typedef struct cost_machine {
    char cpu[128]; /**< as the system names it */
    char architecture[64];
    char system[160];
    int n_processors; /**< online */
    double load;      /**< mean number of running programs in the last minute; -1: unknown */
} cost_machine;

void cost_machine_describe(cost_machine *machine);

#endif
