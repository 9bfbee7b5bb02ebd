/* SPDX-License-Identifier: BSD-3-Clause */
/* What the reports of fit, modes and info say about the modes of a body's surface. */
#ifndef SHCD_TOOLS_BODY_MODES_H
#define SHCD_TOOLS_BODY_MODES_H

#include "json.h"

#include "shcd/model.h"

/** One line; modes NULL: none. */
void body_print_modes(FILE *file, const shcd_modes *modes);

/** Member "modes" of an open JSON object; null without modes. */
void body_write_modes(json_writer *json, const shcd_modes *modes);

#endif
