/* SPDX-License-Identifier: BSD-3-Clause */
/* The peers: Embree's point query and CGAL's AABB tree on the same surface as triangles.
 *
 * CGAL's AABB tree is GPL-3.0-or-later, so a binary that holds this file is, too: it is built on
 * request only (SHCD_BENCH_PEERS), stays in the build folder, and is neither installed nor
 * distributed. */
#include "bench.h"

#include <CGAL/AABB_face_graph_triangle_primitive.h>
#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Simple_cartesian.h>
#include <CGAL/version.h>
#include <embree3/rtcore.h>

#include <malloc.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

namespace {

/* ---- Embree ---- */

/* Single precision throughout, as Embree is: coordinates and the few operations of a distance to a
 * triangle err by a few units of 2^-24 of the body's extent. */
constexpr double embree_rounding = 16.0 / 16777216.0;

struct embree_scene {
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;
    RTCGeometry geometry = nullptr;
    float *vertices = nullptr; /* in Embree's buffer */
    const unsigned *triangles = nullptr;
    const bench_mesh *mesh = nullptr;
    float distance = 0.0f;
    ssize_t bytes = 0; /* what Embree holds now, as it reports itself */

    ~embree_scene() {
        if (scene != nullptr) {
            rtcReleaseScene(scene);
        }
        if (device != nullptr) {
            rtcReleaseDevice(device);
        }
    }
    void place(const double *vertices_m) {
        for (size_t i = 0; i < 3 * mesh->n_vertices; i++) {
            vertices[i] = static_cast<float>(vertices_m[i]);
        }
    }
};

struct vec3f {
    float x, y, z;
};
inline vec3f operator-(vec3f a, vec3f b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline float dot(vec3f a, vec3f b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}
inline vec3f along(vec3f a, float s, vec3f d) {
    return {a.x + s * d.x, a.y + s * d.y, a.z + s * d.z};
}

/* Closest point of a triangle by the region of p among corners, edges and face: Ericson, Real-Time
 * Collision Detection (2005), section 5.1.5. Returned is the squared distance. */
inline float triangle_distance2(vec3f p, vec3f a, vec3f b, vec3f c) {
    const vec3f ab = b - a, ac = c - a, ap = p - a;
    const float d1 = dot(ab, ap), d2 = dot(ac, ap);
    if (d1 <= 0.0f && d2 <= 0.0f) {
        return dot(ap, ap);
    }
    const vec3f bp = p - b;
    const float d3 = dot(ab, bp), d4 = dot(ac, bp);
    if (d3 >= 0.0f && d4 <= d3) {
        return dot(bp, bp);
    }
    const float vc = d1 * d4 - d3 * d2;
    if (vc <= 0.0f && d1 >= 0.0f && d3 <= 0.0f) {
        const vec3f q = ap - along({0, 0, 0}, d1 / (d1 - d3), ab);
        return dot(q, q);
    }
    const vec3f cp = p - c;
    const float d5 = dot(ab, cp), d6 = dot(ac, cp);
    if (d6 >= 0.0f && d5 <= d6) {
        return dot(cp, cp);
    }
    const float vb = d5 * d2 - d1 * d6;
    if (vb <= 0.0f && d2 >= 0.0f && d6 <= 0.0f) {
        const vec3f q = ap - along({0, 0, 0}, d2 / (d2 - d6), ac);
        return dot(q, q);
    }
    const float va = d3 * d6 - d5 * d4;
    if (va <= 0.0f && d4 - d3 >= 0.0f && d5 - d6 >= 0.0f) {
        const vec3f q = bp - along({0, 0, 0}, (d4 - d3) / ((d4 - d3) + (d5 - d6)), c - b);
        return dot(q, q);
    }
    const float scale = 1.0f / (va + vb + vc);
    const vec3f q = ap - along(along({0, 0, 0}, vb * scale, ab), vc * scale, ac);
    return dot(q, q);
}

bool embree_memory(void *self, ssize_t bytes, bool) {
    static_cast<embree_scene *>(self)->bytes += bytes; /* one thread */
    return true;
}

bool embree_leaf(RTCPointQueryFunctionArguments *arguments) {
    auto *e = static_cast<embree_scene *>(arguments->userPtr);
    const unsigned *t = e->triangles + 3 * arguments->primID;
    const vec3f p = {arguments->query->x, arguments->query->y, arguments->query->z};
    vec3f corner[3];
    for (int k = 0; k < 3; k++) {
        const float *v = e->vertices + 3 * t[k];
        corner[k] = {v[0], v[1], v[2]};
    }
    const float d2 = triangle_distance2(p, corner[0], corner[1], corner[2]);
    if (d2 < arguments->query->radius * arguments->query->radius) {
        arguments->query->radius = std::sqrt(d2);
        return true; /* the radius shrank */
    }
    return false;
}

double embree_query(void *self, const double point[3]) {
    auto *e = static_cast<embree_scene *>(self);
    RTCPointQueryContext context;
    RTCPointQuery query;
    rtcInitPointQueryContext(&context);
    query.x = static_cast<float>(point[0]);
    query.y = static_cast<float>(point[1]);
    query.z = static_cast<float>(point[2]);
    query.radius = std::numeric_limits<float>::infinity();
    query.time = 0.0f;
    rtcPointQuery(e->scene, &query, &context, embree_leaf, e);
    e->distance = query.radius;
    return static_cast<double>(query.radius);
}

void embree_explain(void *self, bench_answer *answer) {
    const auto *e = static_cast<const embree_scene *>(self);
    answer->lower_m = answer->upper_m = static_cast<double>(e->distance);
    answer->is_global = 1;
}

void embree_release(void *self) {
    delete static_cast<embree_scene *>(self);
}

void embree_prepare(void *self, size_t k) {
    auto *e = static_cast<embree_scene *>(self);
    e->place(k % 2 == 0 ? e->mesh->moved_m : e->mesh->vertices_m);
}

double embree_refit(void *self) {
    auto *e = static_cast<embree_scene *>(self);
    rtcUpdateGeometryBuffer(e->geometry, RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(e->geometry);
    rtcCommitScene(e->scene);
    return static_cast<double>(e->vertices[0]);
}

embree_scene *embree_create(const bench_mesh *mesh, bool dynamic) {
    auto *e = new embree_scene;
    e->mesh = mesh;
    e->device = rtcNewDevice("threads=1");
    if (e->device == nullptr) {
        delete e;
        return nullptr;
    }
    rtcSetDeviceMemoryMonitorFunction(e->device, embree_memory, e);
    e->scene = rtcNewScene(e->device);
    rtcSetSceneFlags(e->scene, dynamic ? RTC_SCENE_FLAG_DYNAMIC : RTC_SCENE_FLAG_NONE);
    rtcSetSceneBuildQuality(e->scene, dynamic ? RTC_BUILD_QUALITY_LOW : RTC_BUILD_QUALITY_HIGH);
    e->geometry = rtcNewGeometry(e->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetGeometryBuildQuality(e->geometry,
                               dynamic ? RTC_BUILD_QUALITY_REFIT : RTC_BUILD_QUALITY_HIGH);
    e->vertices = static_cast<float *>(
        rtcSetNewGeometryBuffer(e->geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                3 * sizeof(float), mesh->n_vertices));
    auto *triangles = static_cast<unsigned *>(
        rtcSetNewGeometryBuffer(e->geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(unsigned), mesh->n_triangles));
    std::memcpy(triangles, mesh->triangles, 3 * mesh->n_triangles * sizeof *triangles);
    e->triangles = triangles;
    e->place(mesh->vertices_m);
    rtcCommitGeometry(e->geometry);
    rtcAttachGeometry(e->scene, e->geometry);
    rtcReleaseGeometry(e->geometry); /* the scene holds it */
    rtcCommitScene(e->scene);
    if (rtcGetDeviceError(e->device) != RTC_ERROR_NONE) {
        delete e;
        return nullptr;
    }
    return e;
}

/* ---- CGAL ---- */

using kernel = CGAL::Simple_cartesian<double>;
using triangle_iterator = std::vector<kernel::Triangle_3>::const_iterator;
using tree_primitive = CGAL::AABB_triangle_primitive<kernel, triangle_iterator>;
using tree_type = CGAL::AABB_tree<CGAL::AABB_traits<kernel, tree_primitive>>;

struct cgal_tree {
    const bench_mesh *mesh = nullptr;
    std::vector<kernel::Triangle_3> triangles;
    tree_type tree;
    double distance = 0.0;

    void place(const double *vertices_m) {
        triangles.clear();
        triangles.reserve(mesh->n_triangles);
        for (size_t t = 0; t < mesh->n_triangles; t++) {
            kernel::Point_3 corner[3];
            for (size_t k = 0; k < 3; k++) {
                const double *v = vertices_m + 3 * static_cast<size_t>(mesh->triangles[3 * t + k]);
                corner[k] = kernel::Point_3(v[0], v[1], v[2]);
            }
            triangles.emplace_back(corner[0], corner[1], corner[2]);
        }
    }
    void build() {
        tree.clear();
        tree.insert(triangles.begin(), triangles.end());
        tree.build();
    }
};

double cgal_query(void *self, const double point[3]) {
    auto *c = static_cast<cgal_tree *>(self);
    const kernel::Point_3 p(point[0], point[1], point[2]);
    c->distance = std::sqrt(CGAL::squared_distance(p, c->tree.closest_point(p)));
    return c->distance;
}

void cgal_explain(void *self, bench_answer *answer) {
    const auto *c = static_cast<const cgal_tree *>(self);
    answer->lower_m = answer->upper_m = c->distance;
    answer->is_global = 1;
}

void cgal_release(void *self) {
    delete static_cast<cgal_tree *>(self);
}

void cgal_prepare(void *self, size_t k) {
    auto *c = static_cast<cgal_tree *>(self);
    c->place(k % 2 == 0 ? c->mesh->moved_m : c->mesh->vertices_m);
}

double cgal_rebuild(void *self) {
    auto *c = static_cast<cgal_tree *>(self);
    c->build();
    return static_cast<double>(c->tree.size());
}

bench_method make_method(const char *name, const char *what, void *self, double tolerance_m) {
    bench_method method = {};
    method.name = name;
    method.what = what;
    method.self = self;
    method.workloads = BENCH_EVERYWHERE;
    method.is_peer = 1;
    method.tolerance_m = tolerance_m;
    return method;
}

bench_update make_update(const char *name, const char *what, void *self) {
    bench_update update = {};
    update.name = name;
    update.what = what;
    update.self = self;
    update.is_peer = 1;
    return update;
}

bool add_embree(bench_list *list, const bench_mesh *mesh) {
    embree_scene *e = embree_create(mesh, false);
    embree_scene *moved = embree_create(mesh, true);
    embree_scene *moving = embree_create(mesh, true);
    if (e == nullptr || moved == nullptr || moving == nullptr) {
        delete e;
        delete moved;
        delete moving;
        std::fputs("bench_query: Embree cannot make its scene\n", stderr);
        return false;
    }
    double extent = 0.0;
    for (size_t i = 0; i < 3 * mesh->n_vertices; i++) {
        extent = std::fmax(extent, std::fabs(mesh->vertices_m[i]));
        extent = std::fmax(extent, std::fabs(mesh->moved_m[i]));
    }
    bench_method method =
        make_method("embree", "Embree rtcPointQuery, unsigned, float", e,
                    mesh->deviation_m + embree_rounding * (extent + mesh->diagonal_m));
    method.query = embree_query;
    method.explain = embree_explain;
    method.release = embree_release;
    method.bytes = static_cast<double>(e->bytes);
    bench_add_method(list, &method);

    embree_prepare(moved, 0);
    (void)embree_refit(moved);
    method.name = "moved-embree";
    method.what = "the same on the deformed surface, refitted";
    method.self = moved;
    method.is_moved = 1;
    method.tolerance_m += mesh->moved_deviation_m - mesh->deviation_m;
    method.bytes = static_cast<double>(moved->bytes);
    bench_add_method(list, &method);

    bench_update update = make_update("embree-refit", "Embree, all vertices moved, refit", moving);
    update.prepare = embree_prepare;
    update.apply = embree_refit;
    update.release = embree_release;
    bench_add_update(list, &update);
    return true;
}

/* Of the C library's heap, large blocks included. */
double heap_bytes() {
    const auto info = mallinfo2();
    return static_cast<double>(info.uordblks) + static_cast<double>(info.hblkhd);
}

void add_cgal(bench_list *list, const bench_mesh *mesh) {
    const double before = heap_bytes();
    auto *c = new cgal_tree;
    c->mesh = mesh;
    c->place(mesh->vertices_m);
    c->build();
    c->tree.accelerate_distance_queries();
    bench_method method = make_method("cgal", "CGAL AABB tree with hints, unsigned, double", c,
                                      mesh->deviation_m + 1e-9 * mesh->diagonal_m);
    method.query = cgal_query;
    method.explain = cgal_explain;
    method.release = cgal_release;
    method.bytes = heap_bytes() - before;
    bench_add_method(list, &method);

    auto *moving = new cgal_tree;
    moving->mesh = mesh;
    bench_update update =
        make_update("cgal-rebuild", "CGAL, all vertices moved, built anew", moving);
    update.prepare = cgal_prepare;
    update.apply = cgal_rebuild;
    update.release = cgal_release;
    bench_add_update(list, &update);
}

} // namespace

extern "C" int bench_add_peers(bench_list *list, const bench_mesh *mesh) {
    if (!add_embree(list, mesh)) {
        return 1;
    }
    add_cgal(list, mesh);
    return 0;
}

extern "C" const char *bench_peers_versions(void) {
    static const std::string versions =
        std::string("Embree ") + RTC_VERSION_STRING + ", CGAL " CGAL_VERSION_STR;
    return versions.c_str();
}
