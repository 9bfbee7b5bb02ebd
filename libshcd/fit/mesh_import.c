/* SPDX-License-Identifier: BSD-3-Clause */
/* Mesh files, read by Assimp under supervision: our scan of the file comes first (mesh_scan.h says
 * why), no post-processing runs before the faces are checked against it, and merging is left to
 * mesh.c.
 *
 * Assimp stores positions as float. The relative rounding of 6e-8 of the largest coordinate is far
 * below any fit error, unless the body lies far from the origin. */
#include "mesh.h"

#include "fail.h"
#include "mesh_scan.h"

#include "shcd/vec.h"

#include <assimp/cimport.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Assimp takes the size as 32 bits, and needs a multiple of it as memory. */
#define FILE_SIZE_MAX ((size_t)1 << 30)

typedef struct mesh_format {
    const char *extension;
    shcdi_mesh_scan scan;
} mesh_format;

/* The arrays that shcdi_mesh_make() receives. */
typedef struct gathered {
    double *vertices;
    uint32_t *triangles;
    uint32_t *file_index; /* OBJ: of each vertex as Assimp numbers them */
    size_t n_vertices, n_triangles;
} gathered;

static const mesh_format *find_format(const char *path) {
    static const mesh_format known[] = {{"obj", shcdi_scan_obj},
                                        {"ply", shcdi_scan_ply},
                                        {"stl", shcdi_scan_stl},
                                        {"off", shcdi_scan_off}};
    const char *dot = strrchr(path, '.');
    for (size_t i = 0; dot != NULL && i < sizeof known / sizeof known[0]; ++i) {
        const char *wanted = known[i].extension;
        const char *given = dot + 1;
        while (*wanted != '\0' && (*given == *wanted || *given == *wanted - 'a' + 'A')) {
            ++wanted;
            ++given;
        }
        if (*wanted == '\0' && *given == '\0') {
            return &known[i];
        }
    }
    return NULL;
}

/* A message has room for the reason only if the path is short; the end of a path tells more than
 * its beginning. */
static void shorten_path(const char *path, char *name, size_t capacity) {
    const size_t n = strlen(path);
    if (n < capacity) {
        memcpy(name, path, n + 1);
    } else {
        (void)snprintf(name, capacity, "...%s", path + (n - (capacity - 4)));
    }
}

/* Reads in growing pieces: the size of what is no regular file is not known beforehand. */
static shcd_status read_stream(FILE *stream, shcdi_mesh_file *file) {
    size_t capacity = (size_t)1 << 16;
    for (;;) {
        char *grown = realloc(file->bytes, capacity);
        if (grown == NULL) {
            return shcdi_scan_out_of_memory(file);
        }
        file->bytes = grown;
        errno = 0;
        file->size += fread(file->bytes + file->size, 1, capacity - file->size, stream);
        if (ferror(stream)) {
            return shcdi_fit_fail(file->error, SHCD_ERR_IO, "%s: cannot be read: %s", file->name,
                                  strerror(errno));
        }
        if (file->size < capacity) {
            break;
        }
        if (capacity > FILE_SIZE_MAX) {
            return shcdi_fit_fail(file->error, SHCD_ERR_FORMAT,
                                  "%s: larger than 1 GiB, the limit for mesh files", file->name);
        }
        capacity *= 2;
    }
    if (file->size == 0) {
        return shcdi_fit_fail(file->error, SHCD_ERR_FORMAT, "%s: the file is empty", file->name);
    }
    return SHCD_OK;
}

static shcd_status read_file(const char *path, shcdi_mesh_file *file) {
    FILE *stream = NULL;
    shcd_status status = SHCD_OK;
    errno = 0;
    stream = fopen(path, "rb");
    if (stream == NULL) {
        return shcdi_fit_fail(file->error, SHCD_ERR_IO, "%s: cannot be opened: %s", file->name,
                              strerror(errno));
    }
    status = read_stream(stream, file);
    (void)fclose(stream);
    return status;
}

static shcd_status disagreement(const shcdi_mesh_file *file, size_t face) {
    return shcdi_fit_fail(file->error, SHCD_ERR_FORMAT,
                          "%s: Assimp reads face %zu of %zu differently from the file", file->name,
                          face, file->n_faces);
}

/* Faces of three corners or more, over all submeshes in their order; checks that each is one of
 * the scan, corner by corner. OBJ arrives with one vertex for each corner, STL by its nature. */
static shcd_status compare_faces(const shcdi_mesh_file *file, const struct aiScene *scene,
                                 int is_expanded) {
    const uint32_t *expected = file->faces;
    size_t n_faces = 0, n_corners = 0, n_vertices = 0;
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
        const struct aiMesh *mesh = scene->mMeshes[m];
        for (unsigned f = 0; f < mesh->mNumFaces; ++f) {
            const struct aiFace *face = &mesh->mFaces[f];
            const size_t n = n_faces == file->n_faces ? 0 : (expected != NULL ? *expected : 3);
            if (n == 0 || face->mNumIndices != n) {
                return disagreement(file, n_faces);
            }
            for (unsigned k = 0; k < face->mNumIndices; ++k, ++n_corners) {
                const size_t index = n_vertices + face->mIndices[k];
                if (face->mIndices[k] >= mesh->mNumVertices ||
                    index != (is_expanded ? n_corners : expected[k + 1])) {
                    return disagreement(file, n_faces);
                }
            }
            expected += expected != NULL ? n + 1 : 0;
            ++n_faces;
        }
        n_vertices += mesh->mNumVertices;
    }
    if (n_faces != file->n_faces || n_vertices != (is_expanded ? n_corners : file->n_vertices)) {
        return disagreement(file, n_faces);
    }
    return SHCD_OK;
}

/* Splitting a polygon looks at its corners' positions, so these must be finite by then. */
static shcd_status check_polygons(const shcdi_mesh_file *file, const struct aiScene *scene) {
    size_t n_faces = 0;
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
        const struct aiMesh *mesh = scene->mMeshes[m];
        for (unsigned f = 0; f < mesh->mNumFaces; ++f, ++n_faces) {
            const struct aiFace *face = &mesh->mFaces[f];
            for (unsigned k = 0; k < face->mNumIndices && face->mNumIndices > 3; ++k) {
                const struct aiVector3D p = mesh->mVertices[face->mIndices[k]];
                if (!shcd_vec3_is_finite(shcd_vec3_make((double)p.x, (double)p.y, (double)p.z))) {
                    return shcdi_fit_fail(file->error, SHCD_ERR_NOT_FINITE,
                                          "%s: vertex (%.9g, %.9g, %.9g) is not finite; face %zu "
                                          "uses it",
                                          file->name, (double)p.x, (double)p.y, (double)p.z,
                                          n_faces);
                }
            }
        }
    }
    return SHCD_OK;
}

/* Triangles keep the vertex numbers of the file in OBJ too, so that messages can name them. */
static int map_to_file(const shcdi_mesh_file *file, gathered *to) {
    size_t at = 0, corner = 0;
    to->file_index = malloc(file->n_corners * sizeof *to->file_index);
    if (to->file_index == NULL) {
        return 0;
    }
    while (at < file->faces_length) {
        const size_t n = file->faces[at++];
        for (size_t k = 0; k < n; ++k) {
            to->file_index[corner++] = file->faces[at++];
        }
    }
    return 1;
}

static void gather_vertices(const struct aiScene *scene, double unit_m, gathered *to) {
    size_t base = 0;
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
        const struct aiMesh *mesh = scene->mMeshes[m];
        for (unsigned v = 0; v < mesh->mNumVertices; ++v) {
            const size_t index = to->file_index != NULL ? to->file_index[base + v] : base + v;
            to->vertices[3 * index + 0] = (double)mesh->mVertices[v].x * unit_m;
            to->vertices[3 * index + 1] = (double)mesh->mVertices[v].y * unit_m;
            to->vertices[3 * index + 2] = (double)mesh->mVertices[v].z * unit_m;
        }
        base += mesh->mNumVertices;
    }
}

/* 0 if a polygon was not split into the number of triangles that it has. */
static int gather_triangles(const struct aiScene *scene, gathered *to) {
    size_t base = 0, n = 0;
    for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
        const struct aiMesh *mesh = scene->mMeshes[m];
        for (unsigned f = 0; f < mesh->mNumFaces; ++f, ++n) {
            if (n == to->n_triangles || mesh->mFaces[f].mNumIndices != 3) {
                return 0;
            }
            for (size_t k = 0; k < 3; ++k) {
                const size_t index = base + mesh->mFaces[f].mIndices[k];
                to->triangles[3 * n + k] =
                    to->file_index != NULL ? to->file_index[index] : (uint32_t)index;
            }
        }
        base += mesh->mNumVertices;
    }
    return n == to->n_triangles;
}

static shcd_status gather(const shcdi_mesh_file *file, const struct aiScene *scene,
                          int is_indexed_obj, double unit_m, gathered *to) {
    to->n_vertices = file->n_vertices;
    to->n_triangles = file->n_corners - 2 * file->n_faces;
    /* an OBJ vertex that no face uses does not arrive; it stays zero and is dropped later */
    to->vertices = calloc(to->n_vertices, 3 * sizeof *to->vertices);
    to->triangles = malloc(to->n_triangles * 3 * sizeof *to->triangles);
    if (to->vertices == NULL || to->triangles == NULL ||
        (is_indexed_obj && !map_to_file(file, to))) {
        return shcdi_fit_fail(file->error, SHCD_ERR_MEMORY, "%s: out of memory", file->name);
    }
    gather_vertices(scene, unit_m, to);
    if (!gather_triangles(scene, to)) {
        return shcdi_fit_fail(file->error, SHCD_ERR_GEOMETRY,
                              "%s: Assimp cannot split a polygon into triangles; triangulate the "
                              "mesh first",
                              file->name);
    }
    return SHCD_OK;
}

/* From the scanned bytes to arrays. */
static shcd_status import_scene(shcdi_mesh_file *file, const mesh_format *format, double unit_m,
                                gathered *to) {
    const int is_obj = format->scan == shcdi_scan_obj;
    const int is_expanded = is_obj || format->scan == shcdi_scan_stl;
    const struct aiScene *scene =
        aiImportFileFromMemory(file->bytes, (unsigned)file->size, 0, format->extension);
    shcd_status status = SHCD_OK;
    if (scene == NULL) {
        char reason[96];
        (void)snprintf(reason, sizeof reason, "%s", aiGetErrorString());
        shcdi_make_printable(reason);
        if (strstr(reason, "bad_alloc") != NULL) {
            return shcdi_scan_out_of_memory(file);
        }
        return shcdi_fit_fail(file->error, SHCD_ERR_FORMAT, "%s: Assimp cannot read it: %s",
                              file->name, reason);
    }
    status = compare_faces(file, scene, is_expanded);
    if (status == SHCD_OK && file->n_corners > 3 * file->n_faces) {
        status = check_polygons(file, scene);
        if (status == SHCD_OK) {
            scene = aiApplyPostProcessing(scene, aiProcess_Triangulate);
        }
        if (scene == NULL) {
            return shcdi_fit_fail(file->error, SHCD_ERR_FORMAT, "%s: Assimp cannot triangulate it",
                                  file->name);
        }
    }
    if (status == SHCD_OK) {
        status = gather(file, scene, is_obj, unit_m, to);
    }
    aiReleaseImport(scene);
    return status;
}

static shcd_status import_file(const char *path, const mesh_format *format, double unit_m,
                               shcdi_mesh_file *file, gathered *to) {
    shcd_status status = read_file(path, file);
    if (status == SHCD_OK) {
        status = format->scan(file);
    }
    if (status == SHCD_OK && file->n_faces == 0) {
        status = shcdi_fit_fail(file->error, SHCD_ERR_GEOMETRY,
                                "%s: the mesh is empty (%zu vertices, no faces)", file->name,
                                file->n_vertices);
    }
    return status == SHCD_OK ? import_scene(file, format, unit_m, to) : status;
}

shcd_status shcd_mesh_import(const char *path, double unit_m, shcd_mesh **mesh,
                             shcd_mesh_report *report, shcd_error *error) {
    char name[112];
    shcdi_mesh_file file = {name, NULL, 0, 0, 0, 0, NULL, 0, 0, error};
    gathered arrays = {NULL, NULL, NULL, 0, 0};
    const mesh_format *format = NULL;
    shcd_status status = SHCD_OK;
    if (path == NULL || mesh == NULL ||
        (report != NULL && report->struct_size < sizeof report->struct_size)) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT,
                              "mesh_import: a null pointer, or a report without struct_size");
    }
    shorten_path(path, name, sizeof name);
    if (!(unit_m > 0.0) || !(unit_m - unit_m == 0.0)) {
        return shcdi_fit_fail(error, SHCD_ERR_ARGUMENT,
                              "%s: the unit of %g m is not positive and finite", name, unit_m);
    }
    format = find_format(path);
    if (format == NULL) {
        return shcdi_fit_fail(error, SHCD_ERR_FORMAT,
                              "%s: unknown kind of file; .obj, .ply, .stl and .off are read", name);
    }
    status = import_file(path, format, unit_m, &file, &arrays);
    free(file.bytes);
    free(file.faces);
    if (status == SHCD_OK) {
        status = shcdi_mesh_make(name, arrays.vertices, arrays.n_vertices, arrays.triangles,
                                 arrays.n_triangles, mesh, report, error);
    }
    free(arrays.vertices);
    free(arrays.triangles);
    free(arrays.file_index);
    return status;
}
