/* SPDX-License-Identifier: BSD-3-Clause */
/* The modal sums for processors with AVX-512. The target is named here, not by a compiler option,
 * so that the file may be compiled like any other. */
#ifdef __x86_64__
#ifdef __clang__
#pragma clang attribute push(__attribute__((target("avx512f,avx512bw,avx512dq,avx512vl"))),        \
                             apply_to = function)
#else
#pragma GCC target("avx512f,avx512bw,avx512dq,avx512vl")
#endif
#define MODAL_PATH avx512
#define LANES 8
#include "response/modal_kernel.h"
#ifdef __clang__
#pragma clang attribute pop
#endif
#else
typedef int shcdi_no_modal_avx512; /* a translation unit may not be empty */
#endif
