/* SPDX-License-Identifier: BSD-3-Clause */
/* The modal sums for processors with AVX2. The target is named here, not by a compiler option, so
 * that the file may be compiled like any other. */
#ifdef __x86_64__
#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx2"))), apply_to = function)
#else
#pragma GCC target("avx2")
#endif
#define MODAL_PATH avx2
#define LANES 4
#include "response/modal_kernel.h"
#ifdef __clang__
#pragma clang attribute pop
#endif
#else
typedef int shcdi_no_modal_avx2; /* a translation unit may not be empty */
#endif
