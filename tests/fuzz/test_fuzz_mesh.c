/* SPDX-License-Identifier: BSD-3-Clause */
/* The checks behind the mesh import, fed with surfaces that are changed at random: by what happens
 * to meshes (a face lost, doubled or turned, vertices torn apart or merged, parts joined), and by
 * what should not (indices out of range, values that are not finite). What is accepted must be one
 * closed, oriented surface of genus 0, which is shown here from the definition: each directed edge
 * once in either direction, connected, one fan at each vertex, Euler number 2, positive volume. */
#include "mutate.h"

#include "shcd/fit.h"

enum { VERTICES_MAX = 384, TRIANGLES_MAX = 128, N_CASES = 200000 };

typedef struct soup {
    double vertices[3 * VERTICES_MAX];
    uint32_t triangles[3 * TRIANGLES_MAX];
    size_t n_vertices, n_triangles;
} soup;

/* ---- surfaces to start from ---- */

static const double octahedron_vertices[] = {1, 0,  0, -1, 0, 0, 0, 1, 0,
                                             0, -1, 0, 0,  0, 1, 0, 0, -1};
static const uint32_t octahedron[] = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4,
                                      2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
static const double tetrahedron_vertices[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
static const uint32_t tetrahedron[] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2};
/* each pair of the six vertices is an edge of two triangles: the projective plane */
static const uint32_t projective[] = {0, 1, 2, 0, 2, 3, 0, 3, 4, 0, 4, 5, 0, 5, 1,
                                      1, 2, 4, 2, 3, 5, 3, 4, 1, 4, 5, 2, 5, 1, 3};

static void add_vertex(soup *s, double x, double y, double z) {
    if (s->n_vertices < VERTICES_MAX) {
        s->vertices[3 * s->n_vertices] = x;
        s->vertices[3 * s->n_vertices + 1] = y;
        s->vertices[3 * s->n_vertices + 2] = z;
        ++s->n_vertices;
    }
}

static void add_triangle(soup *s, uint32_t a, uint32_t b, uint32_t c) {
    if (s->n_triangles < TRIANGLES_MAX) {
        s->triangles[3 * s->n_triangles] = a;
        s->triangles[3 * s->n_triangles + 1] = b;
        s->triangles[3 * s->n_triangles + 2] = c;
        ++s->n_triangles;
    }
}

static void add_arrays(soup *s, const double *vertices, size_t n_vertices,
                       const uint32_t *triangles, size_t n_triangles) {
    const uint32_t first = (uint32_t)s->n_vertices;
    for (size_t i = 0; i < n_vertices; ++i) {
        add_vertex(s, vertices[3 * i], vertices[3 * i + 1], vertices[3 * i + 2]);
    }
    for (size_t i = 0; i < n_triangles; ++i) {
        add_triangle(s, first + triangles[3 * i], first + triangles[3 * i + 1],
                     first + triangles[3 * i + 2]);
    }
}

static void add_torus(soup *s) {
    static const double around[3][2] = {{1.0, 0.0}, {-0.5, 0.75}, {-0.5, -0.75}};
    for (uint32_t i = 0; i < 9; ++i) {
        const double *outer = around[i / 3], *inner = around[i % 3];
        add_vertex(s, outer[0] * (3.0 + inner[0]), outer[1] * (3.0 + inner[0]), inner[1]);
    }
    for (uint32_t i = 0; i < 9; ++i) {
        const uint32_t b = (i + 3) % 9, c = i - i % 3 + (i + 1) % 3, d = (c + 3) % 9;
        add_triangle(s, i, b, d);
        add_triangle(s, i, d, c);
    }
}

static void start(check_random *r, soup *s) {
    const size_t kind = mutate_below(r, 8);
    s->n_vertices = s->n_triangles = 0;
    if (kind < 2) {
        add_arrays(s, tetrahedron_vertices, 4, tetrahedron, 4);
    } else if (kind < 6) {
        add_arrays(s, octahedron_vertices, 6, octahedron, 8);
    } else if (kind == 6) {
        add_torus(s);
    } else {
        add_arrays(s, octahedron_vertices, 6, projective, 10);
    }
}

/* ---- changes ---- */

static uint32_t *any_triangle(check_random *r, soup *s) {
    return &s->triangles[3 * mutate_below(r, s->n_triangles)];
}

static void turn(uint32_t *t) {
    const uint32_t kept = t[1];
    t[1] = t[2];
    t[2] = kept;
}

static double any_value(check_random *r, const soup *s) {
    static const double special[] = {
        (double)NAN, (double)INFINITY, -(double)INFINITY, 0.0, -0.0, 1e300, -1e308, 1e-310, 1e-9,
        1.0};
    const size_t i = mutate_below(r, 2 * sizeof special / sizeof special[0]);
    return i < sizeof special / sizeof special[0] ? special[i]
                                                  : s->vertices[mutate_below(r, 3 * s->n_vertices)];
}

/* A corner more for a triangle, at its centroid or on its first edge: then it lacks area. */
static void split(check_random *r, soup *s) {
    uint32_t *t = any_triangle(r, s);
    const uint32_t a = t[0], b = t[1], c = t[2], m = (uint32_t)s->n_vertices;
    const double weight = mutate_below(r, 2) == 0 ? 1.0 / 3.0 : 0.5;
    double p[3];
    if (s->n_vertices == VERTICES_MAX || s->n_triangles + 2 > TRIANGLES_MAX || a >= m || b >= m ||
        c >= m) {
        return;
    }
    for (size_t k = 0; k < 3; ++k) {
        p[k] = weight * s->vertices[3 * a + k] + weight * s->vertices[3 * b + k] +
               (1.0 - 2.0 * weight) * s->vertices[3 * c + k];
    }
    t[2] = m;
    add_vertex(s, p[0], p[1], p[2]);
    add_triangle(s, b, c, m);
    add_triangle(s, c, a, m);
}

/* Each triangle gets corners of its own, as in STL. */
static void tear(soup *s) {
    const soup from = *s;
    s->n_vertices = s->n_triangles = 0;
    for (size_t i = 0; i < from.n_triangles; ++i) {
        const uint32_t n = (uint32_t)s->n_vertices;
        for (size_t k = 0; k < 3; ++k) {
            const uint32_t v = from.triangles[3 * i + k];
            const double *p = &from.vertices[v < from.n_vertices ? 3 * (size_t)v : 0];
            add_vertex(s, p[0], p[1], p[2]);
        }
        add_triangle(s, n, n + 1, n + 2);
    }
}

static void change_triangles(check_random *r, soup *s, size_t kind) {
    uint32_t *t = any_triangle(r, s);
    switch (kind) {
    case 0:
        t[mutate_below(r, 3)] = (uint32_t)mutate_below(r, s->n_vertices);
        break;
    case 1:
        t[mutate_below(r, 3)] = mutate_below(r, 2) == 0 ? (uint32_t)s->n_vertices : UINT32_MAX;
        break;
    case 2:
        turn(t);
        break;
    case 3:
        memmove(t, &s->triangles[3 * --s->n_triangles], 3 * sizeof *t);
        break;
    case 4:
        add_triangle(s, t[0], t[1], t[2]);
        break;
    case 5:
        add_triangle(s, t[0], t[2], t[1]);
        break;
    case 6:
        add_triangle(s, t[0], t[0], t[2]);
        break;
    default:
        split(r, s);
        break;
    }
}

static void change_vertices(check_random *r, soup *s, size_t kind) {
    double *p = &s->vertices[3 * mutate_below(r, s->n_vertices)];
    switch (kind) {
    case 0:
        p[mutate_below(r, 3)] = any_value(r, s);
        break;
    case 1:
        memmove(p, &s->vertices[3 * mutate_below(r, s->n_vertices)], 3 * sizeof *p);
        break;
    case 2:
        add_vertex(s, any_value(r, s), any_value(r, s), any_value(r, s));
        break;
    case 3:
        for (size_t i = 0; i < 3 * s->n_vertices; ++i) {
            s->vertices[i] += check_uniform(r, -0.5, 0.5);
        }
        break;
    case 4:
        for (size_t i = 0; i < 3 * s->n_vertices; ++i) {
            s->vertices[i] = ldexp(s->vertices[i], mutate_below(r, 2) == 0 ? 1000 : -1000);
        }
        break;
    case 5:
        for (size_t i = 0; i < s->n_triangles; ++i) {
            turn(&s->triangles[3 * i]);
        }
        break;
    case 6:
        tear(s);
        break;
    default:
        start(r, s);
        add_arrays(s, octahedron_vertices, 6, octahedron, 8);
        break;
    }
}

static void change(check_random *r, soup *s) {
    const size_t kind = mutate_below(r, 32);
    if (s->n_triangles == 0 || s->n_vertices == 0) {
        start(r, s);
    } else if (kind < 16) {
        split(r, s);
    } else if (kind < 24) {
        change_triangles(r, s, kind - 16);
    } else {
        change_vertices(r, s, kind - 24);
    }
}

/* ---- what an accepted mesh must be ---- */

/* From `first` on, triangle to triangle across the edges at v: how many until it closes? */
static size_t walk_around(const uint32_t (*next)[VERTICES_MAX], uint32_t v, uint32_t first) {
    uint32_t at = first;
    size_t n = 0;
    do {
        at = next[v][at];
        ++n;
    } while (at != first && n <= TRIANGLES_MAX);
    return n;
}

static void check_fans(const uint32_t *t, size_t n_vertices, size_t n_triangles) {
    /* next[v][a] = b for a triangle (v, a, b); the directed edges are unique by then */
    static uint32_t next[VERTICES_MAX][VERTICES_MAX];
    static uint32_t first[VERTICES_MAX];
    size_t degree[VERTICES_MAX] = {0};
    for (size_t c = 0; c < 3 * n_triangles; ++c) {
        const uint32_t *corner = &t[c - c % 3];
        const uint32_t v = corner[c % 3], a = corner[(c + 1) % 3], b = corner[(c + 2) % 3];
        next[v][a] = b;
        first[v] = a;
        ++degree[v];
    }
    for (uint32_t v = 0; v < n_vertices; ++v) {
        assert_true(degree[v] >= 3 || (degree[v] == 2 && n_triangles > 2));
        assert_int_equal(walk_around((const uint32_t(*)[VERTICES_MAX])next, v, first[v]),
                         degree[v]);
    }
}

/* Each directed edge once, and once in the other direction. Returns the number of edges. */
static size_t check_edges(const uint32_t *t, size_t n_vertices, size_t n_triangles) {
    static unsigned char seen[VERTICES_MAX][VERTICES_MAX];
    size_t n_directed = 0;
    memset(seen, 0, sizeof seen);
    for (size_t c = 0; c < 3 * n_triangles; ++c) {
        const uint32_t a = t[c], b = t[c - c % 3 + (c + 1) % 3];
        assert_true(a < n_vertices && b < n_vertices && a != b);
        assert_int_equal(seen[a][b]++, 0);
    }
    for (size_t a = 0; a < n_vertices; ++a) {
        for (size_t b = 0; b < n_vertices; ++b) {
            assert_int_equal(seen[a][b], seen[b][a]);
            n_directed += seen[a][b];
        }
    }
    return n_directed / 2;
}

static void check_connected(const uint32_t *t, size_t n_vertices, size_t n_triangles) {
    unsigned char reached[VERTICES_MAX] = {1};
    size_t n_reached = 1;
    for (int grown = 1; grown;) {
        grown = 0;
        for (size_t c = 0; c < 3 * n_triangles; ++c) {
            const uint32_t a = t[c], b = t[c - c % 3 + (c + 1) % 3];
            if (reached[a] && !reached[b]) {
                reached[b] = 1;
                ++n_reached;
                grown = 1;
            }
        }
    }
    assert_int_equal(n_reached, n_vertices);
}

/* Finite, no two at one place, and the triangles enclose a positive volume (in units of the largest
 * coordinate, so that nothing overflows). */
static void check_positions(const double *v, const uint32_t *t, size_t n_vertices,
                            size_t n_triangles) {
    long double largest = 0.0L, volume = 0.0L;
    for (size_t i = 0; i < 3 * n_vertices; ++i) {
        assert_true(isfinite(v[i]));
        largest = fmaxl(largest, fabsl((long double)v[i]));
    }
    for (size_t i = 0; i < n_vertices; ++i) {
        for (size_t j = 0; j < i; ++j) {
            assert_true(v[3 * i] != v[3 * j] || v[3 * i + 1] != v[3 * j + 1] ||
                        v[3 * i + 2] != v[3 * j + 2]);
        }
    }
    for (size_t i = 0; i < n_triangles; ++i) {
        long double p[3][3];
        for (size_t k = 0; k < 9; ++k) {
            p[k / 3][k % 3] = (long double)v[3 * (size_t)t[3 * i + k / 3] + k % 3] / largest;
        }
        volume += p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) +
                  p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) +
                  p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
    }
    assert_true(volume > 0.0L);
}

/* An accepted mesh given in again comes out the same, without repair. */
static void check_stable(const shcd_mesh *mesh) {
    const size_t n_vertices = shcd_mesh_vertex_count(mesh);
    const size_t n_triangles = shcd_mesh_triangle_count(mesh);
    shcd_mesh *again = NULL;
    shcd_mesh_report report = SHCD_MESH_REPORT_INIT;
    assert_int_equal(shcd_mesh_create(shcd_mesh_vertices(mesh), n_vertices,
                                      shcd_mesh_triangles(mesh), n_triangles, &again, &report,
                                      NULL),
                     SHCD_OK);
    assert_int_equal(report.n_vertices, n_vertices);
    assert_int_equal(report.n_triangles, n_triangles);
    assert_int_equal(report.n_triangles_flipped, 0);
    assert_int_equal(report.turned_inside_out, 0);
    assert_memory_equal(shcd_mesh_vertices(again), shcd_mesh_vertices(mesh),
                        3 * n_vertices * sizeof(double));
    assert_memory_equal(shcd_mesh_triangles(again), shcd_mesh_triangles(mesh),
                        3 * n_triangles * sizeof(uint32_t));
    shcd_mesh_free(again);
}

static void check_accepted(const soup *s, const shcd_mesh *mesh, const shcd_mesh_report *report) {
    const double *v = shcd_mesh_vertices(mesh);
    const uint32_t *t = shcd_mesh_triangles(mesh);
    const size_t n_vertices = shcd_mesh_vertex_count(mesh);
    const size_t n_triangles = shcd_mesh_triangle_count(mesh);
    size_t n_edges = 0;
    assert_in_range(n_vertices, 3, s->n_vertices);
    assert_in_range(n_triangles, 2, s->n_triangles);
    assert_int_equal(report->n_vertices, n_vertices);
    assert_int_equal(report->n_triangles, n_triangles);
    assert_int_equal(s->n_vertices,
                     n_vertices + report->n_vertices_merged + report->n_vertices_unused);
    assert_int_equal(s->n_triangles, n_triangles + report->n_triangles_degenerate_dropped);
    n_edges = check_edges(t, n_vertices, n_triangles);
    assert_int_equal(2 * n_edges, 3 * n_triangles);
    assert_int_equal(n_vertices + n_triangles, n_edges + 2);
    check_connected(t, n_vertices, n_triangles);
    check_fans(t, n_vertices, n_triangles);
    check_positions(v, t, n_vertices, n_triangles);
    check_stable(mesh);
}

static void check_refusal(shcd_status status, const shcd_error *error) {
    assert_true(status == SHCD_ERR_ARGUMENT || status == SHCD_ERR_NOT_FINITE ||
                status == SHCD_ERR_GEOMETRY);
    assert_int_equal(error->status, status);
    assert_memory_equal(error->message, "mesh_create: ", 13);
}

static shcd_status check_case(size_t number) {
    static soup s;
    check_random r = {0x0ddba11500000000u + number};
    shcd_mesh *const untouched = (shcd_mesh *)(uintptr_t)16;
    shcd_mesh *mesh = untouched;
    shcd_mesh_report report = SHCD_MESH_REPORT_INIT;
    const shcd_mesh_report blank = report;
    shcd_error error = {SHCD_OK, ""};
    shcd_status status = SHCD_OK;
    start(&r, &s);
    for (size_t n = mutate_below(&r, 12); n > 0; --n) {
        change(&r, &s);
    }
    status = shcd_mesh_create(s.vertices, s.n_vertices, s.triangles, s.n_triangles, &mesh, &report,
                              &error);
    if (status == SHCD_OK) {
        check_accepted(&s, mesh, &report);
        shcd_mesh_free(mesh);
    } else {
        check_refusal(status, &error);
        assert_ptr_equal(mesh, untouched);
        assert_memory_equal(&report, &blank, sizeof report);
    }
    return status;
}

static void test_mesh_create_changed_surfaces_are_refused_or_closed(void **state) {
    const size_t n = check_scaled(N_CASES);
    size_t counts[16] = {0};
    (void)state;
    for (size_t i = 0; i < n; ++i) {
        ++counts[-(int)check_case(i)];
    }
    print_message("%zu surfaces: %zu accepted, %zu not finite, %zu index, %zu geometry\n", n,
                  counts[0], counts[-SHCD_ERR_NOT_FINITE], counts[-SHCD_ERR_ARGUMENT],
                  counts[-SHCD_ERR_GEOMETRY]);
    /* else the changes are too wild, or too tame, to test anything */
    assert_true(n < 1000 ||
                (counts[0] > n / 10 && counts[-SHCD_ERR_NOT_FINITE] > n / 200 &&
                 counts[-SHCD_ERR_ARGUMENT] > n / 200 && counts[-SHCD_ERR_GEOMETRY] > n / 10));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_mesh_create_changed_surfaces_are_refused_or_closed),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
