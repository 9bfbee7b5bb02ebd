/* SPDX-License-Identifier: BSD-3-Clause */
/* Structures as callers with older or newer headers hold them: a block of exactly that many bytes,
 * so that memory checkers see an access beyond it, and without them a guard behind it. */
#ifndef SHCD_TESTS_SIZED_H
#define SHCD_TESTS_SIZED_H

#include "support/check.h"

#include <string.h>

#define SIZED_GUARD 64
#define SIZED_GUARD_BYTE 0xa5

/** A block whose first bytes are those of `from`; what `from` does not fill is zero, as a newer
 *  caller leaves it. struct_size is the block's size. */
static inline void *sized_copy(const void *from, size_t from_size, size_t size) {
    unsigned char *block = malloc(size + SIZED_GUARD);
    assert_non_null(block);
    memset(block, 0, size);
    memcpy(block, from, from_size < size ? from_size : size);
    memcpy(block, &size, sizeof size < size ? sizeof size : size);
    memset(block + size, SIZED_GUARD_BYTE, SIZED_GUARD);
    return block;
}

/** A block as sized_copy() makes it, without the guard: reading beyond it is an error that memory
 *  checkers report. For structures that the library only reads. */
static inline void *sized_input(const void *from, size_t from_size, size_t size) {
    unsigned char *block = sized_copy(from, from_size, size);
    unsigned char *exact = malloc(size);
    assert_non_null(exact);
    memcpy(exact, block, size);
    free(block);
    return exact;
}

/** The library filled the block as it fills the whole structure, kept its struct_size and left what
 *  lies behind it alone. Frees it. */
static inline void sized_check_output(void *block, size_t size, const void *whole,
                                      size_t whole_size) {
    const unsigned char *bytes = block;
    size_t stated;
    memcpy(&stated, bytes, sizeof stated);
    assert_int_equal(stated, size);
    const size_t shared = size < whole_size ? size : whole_size;
    assert_memory_equal(bytes + sizeof(size_t), (const unsigned char *)whole + sizeof(size_t),
                        shared - sizeof(size_t));
    for (size_t i = shared; i < size; i++) {
        assert_int_equal(bytes[i], 0);
    }
    for (size_t i = size; i < size + SIZED_GUARD; i++) {
        assert_int_equal(bytes[i], SIZED_GUARD_BYTE);
    }
    free(block);
}

/** The message of a refusal says which field to fill. */
static inline void sized_check_refusal(shcd_status status, const shcd_error *error) {
    assert_int_equal(status, SHCD_ERR_ARGUMENT);
    assert_int_equal(error->status, SHCD_ERR_ARGUMENT);
    if (strstr(error->message, "struct_size") == NULL) {
        fail_msg("'%s' does not name struct_size", error->message);
    }
}

#endif
