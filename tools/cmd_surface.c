/* SPDX-License-Identifier: BSD-3-Clause */
/* `shcd surface`: the surface, or its low-degree part, as a triangle mesh in OBJ or PLY. */
#include "arguments.h"
#include "body.h"
#include "commands.h"
#include "number.h"
#include "output.h"
#include "report.h"
#include "sphere_mesh.h"

#include "shcd/vec.h"

#include <inttypes.h>
#include <stddef.h>
#include <string.h>

#define LEVEL_DEFAULT 5

typedef struct surface_request {
    const char *body;
    const char *output;
    bool ply;
    int degree; /**< -1: the body's */
    int level;
} surface_request;

static bool ends_with(const char *text, const char *end) {
    const size_t length = strlen(text);
    const size_t n = strlen(end);
    return length > n && strcmp(text + length - n, end) == 0;
}

/* Returns an exit status, or -1 if the command is to go on. */
static int parse_request(int argc, char **argv, surface_request *request) {
    arguments a;
    int key;
    arguments_begin(&a, argc, argv);
    while ((key = arguments_next(&a)) > 0) {
        if (key == OPTION_OUTPUT) {
            request->output = a.value;
        } else if (key == OPTION_DEGREE) {
            if (!number_parse_integer(a.value, 1, SHCD_DEGREE_MAX, &request->degree)) {
                return report_usage("--degree %s: must be 1 to %d", a.value, SHCD_DEGREE_MAX);
            }
        } else if (!number_parse_integer(a.value, 0, SPHERE_MESH_LEVEL_MAX, &request->level)) {
            return report_usage("--subdivide %s: must be 0 to %d", a.value, SPHERE_MESH_LEVEL_MAX);
        }
    }
    if (key != ARGUMENTS_END) {
        return arguments_status(key);
    }
    request->body = arguments_operand(&a, "BODY.shcd");
    if (request->body == NULL) {
        return STATUS_USAGE;
    }
    if (request->output == NULL) {
        return report_usage("-o OUT.obj or -o OUT.ply is missing");
    }
    request->ply = ends_with(request->output, ".ply");
    if (!request->ply && !ends_with(request->output, ".obj")) {
        return report_usage("%s: the name must end in .obj or .ply", request->output);
    }
    return -1;
}

/* Moves the vertices from the sphere to the surface. */
static bool evaluate(const shcd_model *model, int degree, sphere_mesh *mesh) {
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        shcd_vec3 point;
        const shcd_status status =
            shcd_model_surface(model, degree, mesh->vertices[i], &point, NULL, NULL);
        if (status != SHCD_OK) {
            report_failure("%s", shcd_status_string(status));
            return false;
        }
        mesh->vertices[i] = point;
    }
    return true;
}

/* A body is never inside out, but a truncated series of it may be. */
static void turn_outward(sphere_mesh *mesh) {
    double volume = 0.0;
    const shcd_vec3 *v = mesh->vertices;
    const shcd_vec3 origin = v[0]; /* near the surface: little cancellation */
    for (size_t t = 0; t < mesh->n_triangles; t++) {
        const uint32_t *triangle = mesh->triangles[t];
        volume += shcd_dot(
            shcd_sub(v[triangle[0]], origin),
            shcd_cross(shcd_sub(v[triangle[1]], origin), shcd_sub(v[triangle[2]], origin)));
    }
    if (volume < 0.0) {
        for (size_t t = 0; t < mesh->n_triangles; t++) {
            const uint32_t second = mesh->triangles[t][1];
            mesh->triangles[t][1] = mesh->triangles[t][2];
            mesh->triangles[t][2] = second;
        }
    }
}

static void write_obj(FILE *file, const sphere_mesh *mesh, int degree) {
    fprintf(file, "# spherical-harmonics surface, degree %d, metres\n", degree);
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        const shcd_vec3 *v = &mesh->vertices[i];
        fprintf(file, "v %.17g %.17g %.17g\n", v->x, v->y, v->z);
    }
    for (size_t t = 0; t < mesh->n_triangles; t++) {
        const uint32_t *triangle = mesh->triangles[t];
        fprintf(file, "f %" PRIu32 " %" PRIu32 " %" PRIu32 "\n", triangle[0] + 1, triangle[1] + 1,
                triangle[2] + 1);
    }
}

static void put_little_endian(unsigned char *bytes, uint64_t value, size_t size) {
    for (size_t i = 0; i < size; i++) {
        bytes[i] = (unsigned char)(value >> (8 * i));
    }
}

static void write_ply(FILE *file, const sphere_mesh *mesh, int degree) {
    fprintf(file,
            "ply\nformat binary_little_endian 1.0\n"
            "comment spherical-harmonics surface, degree %d, metres\n"
            "element vertex %zu\nproperty double x\nproperty double y\nproperty double z\n"
            "element face %zu\nproperty list uchar int vertex_indices\nend_header\n",
            degree, mesh->n_vertices, mesh->n_triangles);
    for (size_t i = 0; i < mesh->n_vertices; i++) {
        const double v[3] = {mesh->vertices[i].x, mesh->vertices[i].y, mesh->vertices[i].z};
        unsigned char bytes[24];
        for (size_t k = 0; k < 3; k++) {
            uint64_t bits;
            memcpy(&bits, &v[k], sizeof bits);
            put_little_endian(bytes + 8 * k, bits, 8);
        }
        fwrite(bytes, 1, sizeof bytes, file);
    }
    for (size_t t = 0; t < mesh->n_triangles; t++) {
        unsigned char bytes[13] = {3};
        for (size_t k = 0; k < 3; k++) {
            put_little_endian(bytes + 1 + 4 * k, mesh->triangles[t][k], 4);
        }
        fwrite(bytes, 1, sizeof bytes, file);
    }
}

static bool write_surface(const shcd_model *model, const surface_request *request,
                          sphere_mesh *mesh) {
    const int model_degree = shcd_model_degree(model);
    const int degree = request->degree < 0 ? model_degree : request->degree;
    output_file output;
    if (degree > model_degree) {
        report_failure("--degree %d: the body's degree is %d", degree, model_degree);
        return false;
    }
    if (!sphere_mesh_create(request->level, mesh)) {
        report_failure("%s", shcd_status_string(SHCD_ERR_MEMORY));
        return false;
    }
    if (!evaluate(model, degree, mesh) || !output_open(&output, request->output)) {
        return false;
    }
    turn_outward(mesh);
    if (request->ply) {
        write_ply(output.file, mesh, degree);
    } else {
        write_obj(output.file, mesh, degree);
    }
    return output_finish(&output) && output_publish(&output);
}

int command_surface(int argc, char **argv) {
    surface_request request = {NULL, NULL, false, -1, LEVEL_DEFAULT};
    const int status = parse_request(argc, argv, &request);
    if (status >= 0) {
        return status;
    }
    if (output_same(request.body, request.output)) {
        return report_failure("%s: the output would overwrite the input", request.output);
    }
    if (!output_check(request.output)) {
        return STATUS_FAILED;
    }
    shcd_model *model = body_load(request.body);
    if (model == NULL) {
        return STATUS_FAILED;
    }
    sphere_mesh mesh = {0, 0, NULL, NULL};
    const bool written = write_surface(model, &request, &mesh);
    sphere_mesh_free(&mesh);
    shcd_model_free(model);
    return written ? STATUS_DONE : STATUS_FAILED;
}
