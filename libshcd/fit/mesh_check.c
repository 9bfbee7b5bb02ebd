/* SPDX-License-Identifier: BSD-3-Clause */
/* Is it one closed orientable surface of genus 0? A body of spherical harmonics is the image of a
 * sphere, so everything else is refused, with the place where it fails.
 *
 * All questions are answered from the list of triangle sides sorted by edge: a run of one side is
 * an open edge, a run of more than two is non-manifold, and pairs connect triangles (components,
 * orientation) and corners (fans at a vertex). Edges alone do not make a surface: two fans may
 * share a vertex, and then the Euler number no longer tells the genus. */
#include "mesh.h"

#include "fail.h"

#include "shcd/vec.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#define PLACE "(%.9g, %.9g, %.9g)"
#define PLACE_OF(p) (p)[0], (p)[1], (p)[2]

/* Side 3 t + k of triangle t runs from its corner k to the next one. */
typedef struct side {
    uint64_t edge; /* lower vertex in the upper half, higher vertex in the lower half */
    uint32_t number;
} side;

typedef struct topology {
    const char *name;
    shcd_mesh *mesh;
    const uint32_t *source;
    shcd_error *error;
    size_t n_sides;
    side *sides;        /* sorted by edge, then number */
    uint32_t *opposite; /* the other side at the same edge, by side */
    uint32_t *parent;   /* union-find over triangles, later over corners */
    uint32_t *queue;
    unsigned char *state; /* per triangle: 0 not reached, KEPT or TURNED */
} topology;

enum { KEPT = 1, TURNED = 2 };

static int allocate(topology *t, const shcd_mesh *mesh) {
    t->n_sides = 3 * mesh->n_triangles;
    t->sides = malloc(t->n_sides * sizeof *t->sides);
    t->opposite = malloc(t->n_sides * sizeof *t->opposite);
    t->parent = malloc(t->n_sides * sizeof *t->parent);
    t->queue = malloc(mesh->n_triangles * sizeof *t->queue);
    t->state = calloc(mesh->n_triangles, 1);
    return t->sides != NULL && t->opposite != NULL && t->parent != NULL && t->queue != NULL &&
           t->state != NULL;
}

static void release(topology *t) {
    free(t->sides);
    free(t->opposite);
    free(t->parent);
    free(t->queue);
    free(t->state);
}

static uint32_t next_side(uint32_t s) {
    return s % 3 == 2 ? s - 2 : s + 1;
}

static const double *start_of(const topology *t, uint32_t s) {
    return &t->mesh->vertices[3 * (size_t)t->mesh->triangles[s]];
}

static int compare_sides(const void *left, const void *right) {
    const side *a = left, *b = right;
    if (a->edge != b->edge) {
        return a->edge < b->edge ? -1 : 1;
    }
    return a->number < b->number ? -1 : a->number > b->number;
}

static void sort_sides(topology *t) {
    const uint32_t *triangles = t->mesh->triangles;
    for (uint32_t s = 0; s < t->n_sides; ++s) {
        const uint64_t a = triangles[s], b = triangles[next_side(s)];
        t->sides[s].edge = a < b ? a << 32 | b : b << 32 | a;
        t->sides[s].number = s;
    }
    qsort(t->sides, t->n_sides, sizeof *t->sides, compare_sides);
}

/* End of the run of equal edges that starts at i. */
static size_t run_end(const topology *t, size_t i) {
    size_t end = i + 1;
    while (end < t->n_sides && t->sides[end].edge == t->sides[i].edge) {
        ++end;
    }
    return end;
}

/* Path halving; the root of a set is its lowest member, so results do not depend on the order. */
static uint32_t find_root(uint32_t *parent, uint32_t i) {
    while (parent[i] != i) {
        parent[i] = parent[parent[i]];
        i = parent[i];
    }
    return i;
}

/* 1 if two sets became one. */
static unsigned unite(uint32_t *parent, uint32_t i, uint32_t j) {
    const uint32_t a = find_root(parent, i), b = find_root(parent, j);
    if (a == b) {
        return 0;
    }
    parent[a > b ? a : b] = a < b ? a : b;
    return 1;
}

/* Triangles are connected through edges, whatever the number of triangles at an edge. */
static size_t count_components(topology *t) {
    size_t n = t->mesh->n_triangles;
    for (uint32_t i = 0; i < t->mesh->n_triangles; ++i) {
        t->parent[i] = i;
    }
    for (size_t i = 1; i < t->n_sides; ++i) {
        if (t->sides[i].edge == t->sides[i - 1].edge) {
            n -= unite(t->parent, t->sides[i].number / 3, t->sides[i - 1].number / 3);
        }
    }
    return n;
}

/* Each edge needs exactly two triangles. The first offender in the order of the file is named. */
static shcd_status check_edges(topology *t, size_t n_components) {
    size_t n_open = 0, n_crowded = 0, n_edges = 0, n_at_crowded = 0;
    uint32_t open = UINT32_MAX, crowded = UINT32_MAX;
    for (size_t i = 0, end = 0; i < t->n_sides; i = end) {
        const uint32_t first = t->sides[i].number;
        end = run_end(t, i);
        ++n_edges;
        if (end - i == 1) {
            ++n_open;
            open = first < open ? first : open;
        } else if (end - i == 2) {
            t->opposite[first] = t->sides[i + 1].number;
            t->opposite[t->sides[i + 1].number] = first;
        } else {
            ++n_crowded;
            n_at_crowded = first < crowded ? end - i : n_at_crowded;
            crowded = first < crowded ? first : crowded;
        }
    }
    if (n_open > 0) {
        return shcdi_fit_fail(
            t->error, SHCD_ERR_GEOMETRY,
            "%s: open edge from " PLACE " to " PLACE " m at triangle %lu (%zu of %zu edges are "
            "open, %zu component%s)",
            t->name, PLACE_OF(start_of(t, open)), PLACE_OF(start_of(t, next_side(open))),
            (unsigned long)t->source[open / 3], n_open, n_edges, n_components,
            n_components == 1 ? "" : "s");
    }
    if (n_crowded > 0) {
        return shcdi_fit_fail(t->error, SHCD_ERR_GEOMETRY,
                              "%s: non-manifold edge from " PLACE " to " PLACE
                              " m: %zu triangles share it (%zu such edge%s)",
                              t->name, PLACE_OF(start_of(t, crowded)),
                              PLACE_OF(start_of(t, next_side(crowded))), n_at_crowded, n_crowded,
                              n_crowded == 1 ? "" : "s");
    }
    return SHCD_OK;
}

static int compare_sizes_down(const void *left, const void *right) {
    const uint32_t a = *(const uint32_t *)left, b = *(const uint32_t *)right;
    return a > b ? -1 : a < b;
}

/* Names the sizes of the largest components; `parent` still holds the triangles' sets. */
static shcd_status check_components(topology *t, size_t n_components) {
    enum { N_NAMED = 4 };
    char sizes[96];
    size_t length = 0, n = 0;
    if (n_components == 1) {
        return SHCD_OK;
    }
    for (uint32_t i = 0; i < t->mesh->n_triangles; ++i) {
        t->queue[i] = 0;
    }
    for (uint32_t i = 0; i < t->mesh->n_triangles; ++i) {
        ++t->queue[find_root(t->parent, i)];
    }
    qsort(t->queue, t->mesh->n_triangles, sizeof *t->queue, compare_sizes_down);
    n = n_components < N_NAMED ? n_components : N_NAMED;
    for (size_t i = 0; i < n; ++i) {
        length += (size_t)snprintf(sizes + length, sizeof sizes - length, "%s%lu",
                                   i == 0 ? "" : ", ", (unsigned long)t->queue[i]);
    }
    return shcdi_fit_fail(t->error, SHCD_ERR_GEOMETRY,
                          "%s: %zu components (of %s%s triangles); a body is one closed surface",
                          t->name, n_components, sizes, n_components > n ? ", ..." : "");
}

static void turn(uint32_t *corner) {
    const uint32_t kept = corner[1];
    corner[1] = corner[2];
    corner[2] = kept;
}

/* Neighbours agree if they run through their common edge in opposite directions. Breadth first from
 * triangle 0; a contradiction on the way round means a one-sided surface. */
static shcd_status decide_orientation(topology *t) {
    size_t n_queued = 1;
    t->queue[0] = 0;
    t->state[0] = KEPT;
    for (size_t i = 0; i < n_queued; ++i) {
        const uint32_t here = t->queue[i];
        for (uint32_t s = 3 * here; s < 3 * here + 3; ++s) {
            const uint32_t other = t->opposite[s], there = other / 3;
            const int agree = t->mesh->triangles[s] != t->mesh->triangles[other];
            const unsigned char wanted =
                agree ? t->state[here] : (unsigned char)(KEPT + TURNED - t->state[here]);
            if (t->state[there] == 0) {
                t->state[there] = wanted;
                t->queue[n_queued++] = there;
            } else if (t->state[there] != wanted) {
                return shcdi_fit_fail(t->error, SHCD_ERR_GEOMETRY,
                                      "%s: not orientable: no turning of triangles makes them "
                                      "agree at the edge from " PLACE " to " PLACE " m",
                                      t->name, PLACE_OF(start_of(t, s)),
                                      PLACE_OF(start_of(t, next_side(s))));
            }
        }
    }
    return SHCD_OK;
}

/* The fewer triangles are turned, whichever side triangle 0 is on. */
static void apply_orientation(topology *t, shcd_mesh_report *report) {
    size_t n_turned = 0;
    unsigned char minority = TURNED;
    for (size_t i = 0; i < t->mesh->n_triangles; ++i) {
        n_turned += t->state[i] == TURNED;
    }
    if (2 * n_turned > t->mesh->n_triangles) {
        minority = KEPT;
        n_turned = t->mesh->n_triangles - n_turned;
    }
    for (size_t i = 0; i < t->mesh->n_triangles; ++i) {
        if (t->state[i] == minority) {
            turn(&t->mesh->triangles[3 * i]);
        }
    }
    report->n_triangles_flipped = n_turned;
}

/* Corners at one vertex that are neighbours across an edge belong to one fan; a vertex of a surface
 * has one. Corner c is the start of side c. Uses up `opposite`. */
static shcd_status check_fans(topology *t) {
    uint32_t *const n_fans = t->opposite; /* by vertex; there are fewer vertices than corners */
    for (uint32_t c = 0; c < t->n_sides; ++c) {
        t->parent[c] = c;
    }
    for (uint32_t s = 0; s < t->n_sides; ++s) {
        const uint32_t other = t->opposite[s];
        const int same_way = t->mesh->triangles[s] == t->mesh->triangles[other];
        unite(t->parent, s, same_way ? other : next_side(other));
        unite(t->parent, next_side(s), same_way ? next_side(other) : other);
    }
    for (size_t v = 0; v < t->mesh->n_vertices; ++v) {
        n_fans[v] = 0;
    }
    for (uint32_t c = 0; c < t->n_sides; ++c) {
        n_fans[t->mesh->triangles[c]] += find_root(t->parent, c) == c;
    }
    for (uint32_t c = 0; c < t->n_sides; ++c) {
        if (n_fans[t->mesh->triangles[c]] > 1) {
            return shcdi_fit_fail(t->error, SHCD_ERR_GEOMETRY,
                                  "%s: non-manifold vertex " PLACE
                                  " m: the surface touches itself there (%lu fans of triangles)",
                                  t->name, PLACE_OF(start_of(t, c)),
                                  (unsigned long)n_fans[t->mesh->triangles[c]]);
        }
    }
    return SHCD_OK;
}

static shcd_status check_genus(const topology *t) {
    const long long euler = (long long)t->mesh->n_vertices - (long long)(t->n_sides / 2) +
                            (long long)t->mesh->n_triangles;
    if (euler != 2) {
        return shcdi_fit_fail(t->error, SHCD_ERR_GEOMETRY,
                              "%s: genus %lld (Euler number %lld): a body must have genus 0 (Euler "
                              "number 2), no handles or holes",
                              t->name, (2 - euler) / 2, euler);
    }
    return SHCD_OK;
}

static shcd_vec3 scaled(const double *p, const double *origin, int exponent) {
    /* halved first, so that the difference cannot overflow */
    return shcd_vec3_make(ldexp(0.5 * p[0] - 0.5 * origin[0], 1 - exponent),
                          ldexp(0.5 * p[1] - 0.5 * origin[1], 1 - exponent),
                          ldexp(0.5 * p[2] - 0.5 * origin[2], 1 - exponent));
}

/* Sum of the absolute products in the determinant det(a, b, c): its rounding error is this times a
 * few units. */
static double permanent(shcd_vec3 a, shcd_vec3 b, shcd_vec3 c) {
    return fabs(a.x) * (fabs(b.y * c.z) + fabs(b.z * c.y)) +
           fabs(a.y) * (fabs(b.z * c.x) + fabs(b.x * c.z)) +
           fabs(a.z) * (fabs(b.x * c.y) + fabs(b.y * c.x));
}

/* Centre of the bounding box, its diagonal, and the power of two that brings it to order 1. */
static int frame_box(const shcd_mesh *mesh, double centre[3], double *diagonal) {
    double half[3], largest = 0.0;
    int exponent = 0;
    for (size_t k = 0; k < 3; ++k) {
        double low = mesh->vertices[k], high = low;
        for (size_t v = 1; v < mesh->n_vertices; ++v) {
            low = fmin(low, mesh->vertices[3 * v + k]);
            high = fmax(high, mesh->vertices[3 * v + k]);
        }
        centre[k] = 0.5 * low + 0.5 * high;
        half[k] = 0.5 * high - 0.5 * low;
        largest = fmax(largest, half[k]);
    }
    (void)frexp(largest, &exponent);
    for (size_t k = 0; k < 3; ++k) {
        half[k] = ldexp(half[k], -exponent);
    }
    *diagonal = ldexp(shcd_norm(shcd_vec3_make(half[0], half[1], half[2])), exponent + 1);
    return exponent;
}

/* Area, volume and the count of collinear triangles; refuses a volume that rounding alone could
 * explain, since its sign decides which side is inside.
 *
 * u = DBL_EPSILON/2. A determinant of centred coordinates is off by less than 8 u permanents (three
 * factors, five operations deep), the sum of n terms by n u more, and each by a few subnormal
 * numbers where products underflow: coordinates are of order 1, but may differ by 600 decades. A
 * cross product of two sides is off by less than 8 u times their lengths. */
static shcd_status measure(topology *t, shcd_mesh_report *report) {
    shcd_mesh *mesh = t->mesh;
    const double u = 0.5 * DBL_EPSILON;
    double centre[3], six_volumes = 0.0, permanents = 0.0, two_areas = 0.0;
    const int exponent = frame_box(mesh, centre, &report->diagonal_m);
    for (size_t i = 0; i < mesh->n_triangles; ++i) {
        const double *p[3];
        shcd_vec3 a, b, c, side1, side2;
        double twice_area;
        for (size_t k = 0; k < 3; ++k) {
            p[k] = &mesh->vertices[3 * (size_t)mesh->triangles[3 * i + k]];
        }
        a = scaled(p[0], centre, exponent);
        b = scaled(p[1], centre, exponent);
        c = scaled(p[2], centre, exponent);
        side1 = scaled(p[1], p[0], exponent);
        side2 = scaled(p[2], p[0], exponent);
        twice_area = shcd_norm(shcd_cross(side1, side2));
        two_areas += twice_area;
        report->n_triangles_zero_area +=
            twice_area <= 8.0 * u * shcd_norm(side1) * shcd_norm(side2);
        six_volumes += shcd_dot(a, shcd_cross(b, c));
        permanents += permanent(a, b, c);
    }
    report->area_m2 = ldexp(two_areas, 2 * exponent - 1);
    report->volume_m3 = ldexp(six_volumes / 6.0, 3 * exponent);
    if (!(fabs(six_volumes) > ((double)mesh->n_triangles + 8.0) * (u * permanents + DBL_MIN))) {
        return shcdi_fit_fail(t->error, SHCD_ERR_GEOMETRY,
                              "%s: the surface encloses no volume (%.3g m^3 is no more than "
                              "rounding)",
                              t->name, report->volume_m3);
    }
    if (six_volumes < 0.0) {
        for (size_t i = 0; i < mesh->n_triangles; ++i) {
            turn(&mesh->triangles[3 * i]);
        }
        report->volume_m3 = -report->volume_m3;
        report->turned_inside_out = 1;
    }
    return SHCD_OK;
}

static shcd_status check_all(topology *t, shcd_mesh_report *report) {
    size_t n_components = 0;
    shcd_status status = SHCD_OK;
    sort_sides(t);
    n_components = count_components(t);
    status = check_edges(t, n_components);
    if (status == SHCD_OK) {
        status = check_components(t, n_components);
    }
    if (status == SHCD_OK) {
        status = decide_orientation(t);
    }
    if (status == SHCD_OK) {
        status = check_fans(t);
    }
    if (status == SHCD_OK) {
        status = check_genus(t);
    }
    if (status != SHCD_OK) {
        return status;
    }
    apply_orientation(t, report);
    return measure(t, report);
}

shcd_status shcdi_mesh_check(const char *name, shcd_mesh *mesh, const uint32_t *source,
                             shcd_mesh_report *report, shcd_error *error) {
    topology t = {name, mesh, source, error, 0, NULL, NULL, NULL, NULL, NULL};
    const shcd_status status =
        allocate(&t, mesh) ? check_all(&t, report)
                           : shcdi_fit_fail(error, SHCD_ERR_MEMORY, "%s: out of memory", name);
    release(&t);
    return status;
}
