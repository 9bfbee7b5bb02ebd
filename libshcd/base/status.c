/* SPDX-License-Identifier: BSD-3-Clause */
/* Version, status texts and the default allocator. */
#include "base/internal.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

uint32_t shcd_version(void) {
    return SHCD_VERSION;
}

const char *shcd_status_string(shcd_status status) {
    switch (status) {
    case SHCD_OK:
        return "done";
    case SHCD_ERR_ARGUMENT:
        return "argument out of range";
    case SHCD_ERR_MEMORY:
        return "out of memory";
    case SHCD_ERR_FORMAT:
        return "wrong format";
    case SHCD_ERR_IO:
        return "input or output failed";
    case SHCD_ERR_NOT_FINITE:
        return "a number is not finite";
    case SHCD_ERR_GEOMETRY:
        return "the shape cannot be a body";
    case SHCD_ERR_CONVERGENCE:
        return "no convergence";
    case SHCD_ERR_UNSUPPORTED:
        return "not supported";
    case SHCD_ERR_CANCELLED:
        return "cancelled";
    }
    return "unknown status";
}

shcd_status shcdi_fail(shcd_error *error, shcd_status status, const char *format, ...) {
    if (error != NULL) {
        va_list arguments;
        error->status = status;
        va_start(arguments, format);
        vsnprintf(error->message, sizeof error->message, format, arguments);
        va_end(arguments);
    }
    return status;
}

static void *default_allocate(size_t size, void *user) {
    (void)user;
    return malloc(size);
}

static void default_release(void *memory, void *user) {
    (void)user;
    free(memory);
}

shcd_allocator shcdi_allocator(const shcd_allocator *given) {
    if (given != NULL) {
        return *given;
    }
    const shcd_allocator standard = {default_allocate, default_release, NULL};
    return standard;
}
