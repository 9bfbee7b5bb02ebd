/* SPDX-License-Identifier: BSD-3-Clause */
/* The evaluation for any processor: two lanes are what every 64-bit machine has. */
#define SHCDI_SUFFIX portable
#define LANES 2
#include "model/surface_kernel.h"
