/* SPDX-License-Identifier: BSD-3-Clause */
/* The modal sums for any processor. */
#define MODAL_PATH portable
#define LANES 2
#include "response/modal_kernel.h"
