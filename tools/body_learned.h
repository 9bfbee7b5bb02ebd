/* SPDX-License-Identifier: BSD-3-Clause */
/* A body's learned response, for people and as JSON. */
#ifndef SHCD_TOOLS_BODY_LEARNED_H
#define SHCD_TOOLS_BODY_LEARNED_H

#include "json.h"

#include "shcd/learned.h"

#include <stdio.h>

/** NULL: none. */
void body_print_learned(FILE *file, const shcd_learned *learned);
/** A member "learned" of an open object; NULL: null. */
void body_write_learned(json_writer *json, const shcd_learned *learned);

#endif
