/* SPDX-License-Identifier: BSD-3-Clause */
/* A program outside the project that fits a body to a mesh and queries it: both libraries. */
#include <shcd/fit.h>
#include <shcd/shcd.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static void stop(const char *what, const char *why) {
    fprintf(stderr, "consumer: %s: %s\n", what, why);
    exit(1);
}

int main(void) {
    /* an octahedron with its corners 10 mm from the origin */
    const double corners[18] = {0.01, 0,     0, -0.01, 0, 0,    0, 0.01, 0,
                                0,    -0.01, 0, 0,     0, 0.01, 0, 0,    -0.01};
    const uint32_t faces[24] = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4,
                                2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
    const shcd_vec3 centre = {0.0, 0.0, 0.0};
    shcd_fit_options options = SHCD_FIT_OPTIONS_INIT;
    shcd_fit_report report = SHCD_FIT_REPORT_INIT;
    shcd_mesh *mesh = NULL;
    shcd_model *model = NULL;
    shcd_proximity out;
    shcd_error error;
    double face_m;
    options.degree = 3;
    if (shcd_mesh_create(corners, 6, faces, 8, &mesh, NULL, &error) != SHCD_OK ||
        shcd_fit(mesh, &options, NULL, &model, &report, &error) != SHCD_OK) {
        stop("fit", error.message);
    }
    if (shcd_closest(model, centre, NULL, &out) != SHCD_OK) {
        stop("shcd_closest", "failed");
    }
    /* the centre is 10/sqrt(3) mm from the faces, and the body within its error of the mesh */
    face_m = 0.01 / sqrt(3.0);
    printf("flipped %u, distance %.9g, faces at %.9g, Hausdorff error %.9g\n",
           (unsigned)report.n_flipped, out.distance_m, face_m, report.record.hausdorff_error_m);
    if (report.n_flipped != 0 || out.distance_m >= 0.0 ||
        !(fabs(-out.distance_m - face_m) <= report.record.hausdorff_error_m)) {
        stop("distance", "not that of the mesh");
    }
    shcd_model_free(model);
    shcd_mesh_free(mesh);
    return 0;
}
