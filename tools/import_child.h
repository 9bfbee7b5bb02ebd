/* SPDX-License-Identifier: BSD-3-Clause */
/* Mesh files come from anywhere, and the importer behind libshcd-fit is large and not ours: it runs
 * in a child process with limits, so that a file can end the import but neither the command nor the
 * machine. (A library must not fork; a command may.) */
#ifndef SHCD_TOOLS_IMPORT_CHILD_H
#define SHCD_TOOLS_IMPORT_CHILD_H

#include "shcd/fit.h"

/** What one import may cost. A file of size s may take 256 MiB + 64 s of memory, but no more than
 *  the machine has, and 10 s + 4 s per MiB of processor time; four times that on the clock. What
 *  has no size (a pipe) is treated as 16 MiB. */
typedef struct import_limits {
    int memory_mib; /**< 0: by the size of the file */
    int time_s;     /**< of processor time; 0: by the size of the file */
} import_limits;

enum { IMPORT_MEMORY_MAX_MIB = 1 << 24, IMPORT_TIME_MAX_S = 1 << 24 };

/** shcd_mesh_import() in a child process. The parent checks what it is given anew. NULL: reported;
 *  no process is left behind. */
shcd_mesh *import_in_child(const char *path, double unit_m, const import_limits *limits,
                           shcd_mesh_report *report);

#endif
