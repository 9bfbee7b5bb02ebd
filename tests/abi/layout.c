/* SPDX-License-Identifier: BSD-3-Clause */
/* The layouts that compiled programs rely on, as numbers: sizes, offsets and values of shcd.layout,
 * asserted in C and in C++. */
#include <stddef.h>
#include <stdint.h>

#include "shcd/fit.h"
#include "shcd/map.h"
#include "shcd/shcd.h"

#if UINTPTR_MAX != UINT64_MAX
#error "shcd.layout holds the layouts of a 64-bit machine"
#endif

#ifdef __cplusplus
#define ASSERT static_assert
#else
#define ASSERT _Static_assert
#endif
#define SIZE(type, bytes) ASSERT(sizeof(type) == (bytes), "size of " #type);
#define AT(type, member, byte)                                                                     \
    ASSERT(offsetof(type, member) == (byte), "offset of " #type "." #member);
#define VALUE(name, value) ASSERT((long)(name) == (value), "value of " #name);

#include "shcd.layout"
