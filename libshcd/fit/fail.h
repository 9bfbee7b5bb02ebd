/* SPDX-License-Identifier: BSD-3-Clause */
/* How every function of libshcd-fit reports a failure: a status and one line of text. */
#ifndef SHCD_FIT_FAIL_H
#define SHCD_FIT_FAIL_H

#include "shcd/base.h"

/** Fills `error` (NULL is allowed) and returns `status`, so that a refusal is one statement. */
shcd_status shcdi_fit_fail(shcd_error *error, shcd_status status, const char *format, ...)
#if defined(__GNUC__) || defined(__clang__)
    __attribute__((format(printf, 3, 4)))
#endif
    ;

#endif
