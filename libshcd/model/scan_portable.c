/* SPDX-License-Identifier: BSD-3-Clause */
/* The scans for any processor. */
#define SCAN_PATH portable
#define LANES 4
#include "model/scan_kernel.h"
