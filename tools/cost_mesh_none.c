/* SPDX-License-Identifier: BSD-3-Clause */
/* `shcd cost --mesh` in a build without libshcd-fit. */
#include "cost_mesh.h"

#include "report.h"

#include <stddef.h>

cost_mesh *cost_mesh_read(const char *path, double unit_m) {
    (void)unit_m;
    report_failure("%s: this build cannot read meshes: it was configured with SHCD_BUILD_FIT=OFF",
                   path);
    return NULL;
}
