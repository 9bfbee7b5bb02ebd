/* SPDX-License-Identifier: BSD-3-Clause */
/* The text is cut at the size of the caller's buffer; a cut message is still a terminated one. */
#include "fail.h"

#include <stdarg.h>
#include <stdio.h>

shcd_status shcdi_fit_fail(shcd_error *error, shcd_status status, const char *format, ...) {
    if (error != NULL) {
        va_list arguments;
        error->status = status;
        va_start(arguments, format);
        (void)vsnprintf(error->message, sizeof error->message, format, arguments);
        va_end(arguments);
    }
    return status;
}
