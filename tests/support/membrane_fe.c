/* SPDX-License-Identifier: BSD-3-Clause */
/* Each triangle contributes K_ij = e_i . e_j / (4 A), e_i the edge opposite to corner i (half the
 * cotangents, off the diagonal), and M_ij = A (1 + delta_ij) / 12. Products with a vector go over
 * the triangles; only the factorisation needs a sparse matrix. */
#include "support/membrane_fe.h"

#include "shcd/vec.h"
#include "support/check.h"

#include <cholmod.h>

#include <string.h>

typedef struct element {
    double stiffness[3]; /* of the corner pairs (1,2), (2,0), (0,1) */
    double area;
} element;

struct membrane_fe {
    size_t n_vertices, n_triangles;
    shcd_vec3 *direction, *point;
    uint32_t (*triangle)[3];
    element *element;
};

struct membrane_fe_factor {
    cholmod_common common;
    cholmod_factor *factor;
    cholmod_dense *right_hand_side;
};

static void *need(size_t count, size_t size) {
    void *memory = calloc(count, size);
    assert_non_null(memory);
    return memory;
}

/* ---- mesh ---- */

/* Middles of edges by the edge's ends: open addressing, never full. */
typedef struct middles {
    uint64_t *key; /* low end << 32 | high end, plus 1; 0: free */
    uint32_t *vertex;
    size_t mask;
} middles;

static uint32_t middle_of(middles *m, membrane_fe *fe, uint32_t a, uint32_t b) {
    const uint64_t low = a < b ? a : b, high = a < b ? b : a, key = (low << 32 | high) + 1;
    size_t at = (size_t)((key * 0x9e3779b97f4a7c15u) >> 32) & m->mask;
    while (m->key[at] != 0 && m->key[at] != key) {
        at = (at + 1) & m->mask;
    }
    if (m->key[at] == 0) {
        m->key[at] = key;
        m->vertex[at] = (uint32_t)fe->n_vertices;
        fe->direction[fe->n_vertices++] = shcd_unit(shcd_add(fe->direction[a], fe->direction[b]));
    }
    return m->vertex[at];
}

static void start_icosahedron(membrane_fe *fe) {
    static const uint32_t faces[20][3] = {
        {0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
        {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
        {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
    const double t = 0.5 * (1.0 + sqrt(5.0));
    for (size_t i = 0; i < 12; i++) {
        const double one = i % 2 == 0 ? -1.0 : 1.0, golden = i % 4 < 2 ? t : -t;
        const shcd_vec3 v[3] = {{one, golden, 0.0}, {0.0, one, golden}, {golden, 0.0, one}};
        fe->direction[i] = shcd_unit(v[i / 4]);
    }
    memcpy(fe->triangle, faces, sizeof faces);
    fe->n_vertices = 12;
    fe->n_triangles = 20;
}

static void subdivide(membrane_fe *fe) {
    size_t capacity = 64;
    while (capacity < 4 * fe->n_triangles) {
        capacity *= 2;
    }
    middles m = {need(capacity, sizeof *m.key), need(capacity, sizeof *m.vertex), capacity - 1};
    const size_t n = fe->n_triangles;
    for (size_t i = 0; i < n; i++) {
        const uint32_t *t = fe->triangle[i];
        const uint32_t a = t[0], b = t[1], c = t[2];
        const uint32_t ab = middle_of(&m, fe, a, b), bc = middle_of(&m, fe, b, c);
        const uint32_t ca = middle_of(&m, fe, c, a);
        const uint32_t split[4][3] = {{ab, bc, ca}, {a, ab, ca}, {ab, b, bc}, {ca, bc, c}};
        memcpy(fe->triangle[i], split[0], sizeof split[0]);
        memcpy(fe->triangle[fe->n_triangles], split[1], 3 * sizeof split[0]);
        fe->n_triangles += 3;
    }
    free(m.key);
    free(m.vertex);
}

static void fill_elements(membrane_fe *fe) {
    for (size_t i = 0; i < fe->n_triangles; i++) {
        shcd_vec3 edge[3];
        for (size_t k = 0; k < 3; k++) {
            edge[k] = shcd_sub(fe->point[fe->triangle[i][(k + 2) % 3]],
                               fe->point[fe->triangle[i][(k + 1) % 3]]);
        }
        element *e = &fe->element[i];
        e->area = 0.5 * shcd_norm(shcd_cross(edge[0], edge[1]));
        assert_true(e->area > 0.0);
        for (size_t k = 0; k < 3; k++) {
            e->stiffness[k] = shcd_dot(edge[(k + 1) % 3], edge[(k + 2) % 3]) / (4.0 * e->area);
        }
    }
}

membrane_fe *membrane_fe_create(const shcd_model *model, int level) {
    membrane_fe *fe = need(1, sizeof *fe);
    assert_in_range(level, 0, 8);
    const size_t n_triangles = (size_t)20 << 2 * level, n_vertices = n_triangles / 2 + 2;
    fe->direction = need(n_vertices, sizeof *fe->direction);
    fe->point = need(n_vertices, sizeof *fe->point);
    fe->triangle = need(n_triangles, sizeof *fe->triangle);
    fe->element = need(n_triangles, sizeof *fe->element);
    start_icosahedron(fe);
    for (int i = 0; i < level; i++) {
        subdivide(fe);
    }
    assert_int_equal(fe->n_triangles, n_triangles);
    assert_int_equal(fe->n_vertices, n_vertices);
    for (size_t v = 0; v < n_vertices; v++) {
        assert_int_equal(shcd_model_surface(model, -1, fe->direction[v], &fe->point[v], NULL, NULL),
                         SHCD_OK);
    }
    fill_elements(fe);
    return fe;
}

void membrane_fe_free(membrane_fe *fe) {
    if (fe != NULL) {
        free(fe->direction);
        free(fe->point);
        free(fe->triangle);
        free(fe->element);
        free(fe);
    }
}

size_t membrane_fe_count(const membrane_fe *fe) {
    return fe->n_vertices;
}

const shcd_vec3 *membrane_fe_directions(const membrane_fe *fe) {
    return fe->direction;
}

const shcd_vec3 *membrane_fe_points(const membrane_fe *fe) {
    return fe->point;
}

/* ---- products ---- */

void membrane_fe_times_mass(const membrane_fe *fe, const double *x, double *y) {
    memset(y, 0, fe->n_vertices * sizeof *y);
    for (size_t i = 0; i < fe->n_triangles; i++) {
        const uint32_t *t = fe->triangle[i];
        const double sum = x[t[0]] + x[t[1]] + x[t[2]];
        for (size_t k = 0; k < 3; k++) {
            y[t[k]] += fe->element[i].area / 12.0 * (sum + x[t[k]]);
        }
    }
}

/* The rows of an element's stiffness sum to zero: only differences count. */
void membrane_fe_times_stiffness(const membrane_fe *fe, const double *x, double *y) {
    memset(y, 0, fe->n_vertices * sizeof *y);
    for (size_t i = 0; i < fe->n_triangles; i++) {
        const uint32_t *t = fe->triangle[i];
        for (size_t k = 0; k < 3; k++) {
            const uint32_t a = t[(k + 1) % 3], b = t[(k + 2) % 3];
            const double flow = fe->element[i].stiffness[k] * (x[b] - x[a]);
            y[a] += flow;
            y[b] -= flow;
        }
    }
}

double membrane_fe_integral(const membrane_fe *fe, const double *a, const double *b) {
    double *ones = need(2 * fe->n_vertices, sizeof *ones), *product = ones + fe->n_vertices;
    for (size_t v = 0; v < fe->n_vertices; v++) {
        ones[v] = 1.0;
    }
    membrane_fe_times_mass(fe, b != NULL ? b : ones, product);
    double sum = 0.0;
    for (size_t v = 0; v < fe->n_vertices; v++) {
        sum += (a != NULL ? a[v] : 1.0) * product[v];
    }
    free(ones);
    return sum;
}

/* ---- solutions ---- */

static cholmod_sparse *make_matrix(const membrane_fe *fe, double tension, double kappa,
                                   cholmod_common *common) {
    const size_t n = fe->n_vertices, n_entries = 6 * fe->n_triangles;
    cholmod_triplet *list = cholmod_allocate_triplet(n, n, n_entries, -1, CHOLMOD_REAL, common);
    assert_non_null(list);
    int *row = list->i, *column = list->j;
    double *value = list->x;
    for (size_t i = 0; i < fe->n_triangles; i++) {
        const uint32_t *t = fe->triangle[i];
        const element *e = &fe->element[i];
        for (size_t k = 0; k < 3; k++) {
            const uint32_t a = t[(k + 1) % 3], b = t[(k + 2) % 3];
            const double *s = e->stiffness;
            row[list->nnz] = (int)(a > b ? a : b);
            column[list->nnz] = (int)(a > b ? b : a);
            value[list->nnz++] = tension * s[k] + kappa * e->area / 12.0;
            row[list->nnz] = column[list->nnz] = (int)t[k];
            value[list->nnz++] =
                -tension * (s[(k + 1) % 3] + s[(k + 2) % 3]) + kappa * e->area / 6.0;
        }
    }
    cholmod_sparse *matrix = cholmod_triplet_to_sparse(list, 0, common);
    assert_non_null(matrix);
    cholmod_free_triplet(&list, common);
    return matrix;
}

membrane_fe_factor *membrane_fe_factorise(const membrane_fe *fe, double tension, double kappa) {
    membrane_fe_factor *factor = need(1, sizeof *factor);
    cholmod_common *common = &factor->common;
    cholmod_start(common);
    cholmod_sparse *matrix = make_matrix(fe, tension, kappa, common);
    factor->factor = cholmod_analyze(matrix, common);
    assert_non_null(factor->factor);
    assert_true(cholmod_factorize(matrix, factor->factor, common));
    assert_int_equal(factor->factor->minor, fe->n_vertices); /* positive definite */
    cholmod_free_sparse(&matrix, common);
    factor->right_hand_side =
        cholmod_allocate_dense(fe->n_vertices, 1, fe->n_vertices, CHOLMOD_REAL, common);
    assert_non_null(factor->right_hand_side);
    return factor;
}

void membrane_fe_solve(membrane_fe_factor *factor, double *x) {
    const size_t size = factor->right_hand_side->nrow * sizeof *x;
    memcpy(factor->right_hand_side->x, x, size);
    cholmod_dense *solution =
        cholmod_solve(CHOLMOD_A, factor->factor, factor->right_hand_side, &factor->common);
    assert_non_null(solution);
    memcpy(x, solution->x, size);
    cholmod_free_dense(&solution, &factor->common);
}

void membrane_fe_factor_free(membrane_fe_factor *factor) {
    if (factor != NULL) {
        cholmod_free_factor(&factor->factor, &factor->common);
        cholmod_free_dense(&factor->right_hand_side, &factor->common);
        cholmod_finish(&factor->common);
        free(factor);
    }
}

double membrane_fe_compliance(const membrane_fe *fe, double tension_n_per_m, double kappa_n_per_m3,
                              const double *patch_per_m2, double *deflection_m_per_n) {
    double *d = need(fe->n_vertices, sizeof *d);
    membrane_fe_factor *factor = membrane_fe_factorise(fe, tension_n_per_m, kappa_n_per_m3);
    membrane_fe_times_mass(fe, patch_per_m2, d);
    membrane_fe_solve(factor, d);
    const double compliance = membrane_fe_integral(fe, patch_per_m2, d);
    if (deflection_m_per_n != NULL) {
        memcpy(deflection_m_per_n, d, fe->n_vertices * sizeof *d);
    }
    membrane_fe_factor_free(factor);
    free(d);
    return compliance;
}
