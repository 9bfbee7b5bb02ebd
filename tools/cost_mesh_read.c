/* SPDX-License-Identifier: BSD-3-Clause */
/* Mesh files are read by libshcd-fit, in a process of its own. */
#include "cost_mesh.h"

#include "import_child.h"
#include "report.h"

#include <stddef.h>

cost_mesh *cost_mesh_read(const char *path, double unit_m) {
    const import_limits limits = {0, 0};
    shcd_mesh_report report = SHCD_MESH_REPORT_INIT;
    shcd_mesh *source = import_in_child(path, unit_m, &limits, &report);
    if (source == NULL) {
        return NULL;
    }
    cost_mesh *mesh =
        cost_mesh_create(shcd_mesh_vertices(source), shcd_mesh_vertex_count(source),
                         shcd_mesh_triangles(source), shcd_mesh_triangle_count(source));
    shcd_mesh_free(source);
    if (mesh == NULL) {
        report_failure("%s: no memory", path);
    }
    return mesh;
}
