/* SPDX-License-Identifier: BSD-3-Clause */
/* A start that covers the sphere once however the body is bent. Let unit flux enter the surface at
 * one vertex and leave at another far away. On a closed surface of genus 0 the potential h has no
 * other extremum, hence no saddle: its level sets are single loops from pole to pole, and the flux
 * that crosses a path between two triangles (the conjugate of h) is a longitude whose period is the
 * total flux. Latitude is the rank of h by area, so that each zone of the sphere gets its share.
 *
 * The two poles are the extremes of the slowest mode of the Laplacian: the far ends of the body
 * along its surface. Potential and conjugate after Brechbuehler, Gerig, Kuebler, "Parametrization
 * of closed surfaces for 3-D shape description", CVIU 61(2), 1995, who solve for the longitude
 * across a date line; the conjugate needs none. */
#include "start_cylinder.h"

#include "edges.h"

#include <stdlib.h>

#define N_INVERSE_ITERATIONS 40
/* The Laplacian of a closed surface is singular; this much mass, against weights of order 1, makes
 * it definite and spoils the conservation of flux by as little. */
#define MASS_FACTOR 1e-9

static const double two_pi = 6.283185307179586477;

typedef struct cylinder {
    const shcdi_energy *energy;
    double *weights, *mass, *longitude; /* 3 per triangle; per vertex; per triangle, in turns */
    shcd_vec3 *potential, *work;        /* per vertex; the potential is the x component */
    size_t *across;                     /* corner on the other side of edge 3 t + k */
    size_t *queue;
    unsigned char *reached;
    size_t north, south;
} cylinder;

static void release(cylinder *c) {
    free(c->weights);
    free(c->mass);
    free(c->longitude);
    free(c->potential);
    free(c->work);
    free(c->across);
    free(c->queue);
    free(c->reached);
}

static shcd_status allocate(cylinder *c) {
    const size_t n = c->energy->n_vertices, m = c->energy->n_triangles;
    c->weights = malloc(3 * m * sizeof *c->weights);
    c->mass = malloc(n * sizeof *c->mass);
    c->longitude = calloc(m, sizeof *c->longitude);
    c->potential = malloc(n * sizeof *c->potential);
    c->work = malloc(n * sizeof *c->work);
    c->across = malloc(3 * m * sizeof *c->across);
    c->queue = malloc((n > m ? n : m) * sizeof *c->queue);
    c->reached = calloc(m, sizeof *c->reached);
    return c->weights != NULL && c->mass != NULL && c->longitude != NULL && c->potential != NULL &&
                   c->work != NULL && c->across != NULL && c->queue != NULL && c->reached != NULL
               ? SHCD_OK
               : SHCD_ERR_MEMORY;
}

static shcd_status match_edges(cylinder *c) {
    const size_t n_sides = 3 * c->energy->n_triangles;
    shcdi_edge *edges = shcdi_edges_sorted(c->energy->triangles, c->energy->n_triangles);
    if (edges == NULL) {
        return SHCD_ERR_MEMORY;
    }
    for (size_t e = 0; e + 1 < n_sides; e += 2) { /* closed: the sides come in pairs */
        c->across[edges[e].corner] = edges[e + 1].corner;
        c->across[edges[e + 1].corner] = edges[e].corner;
    }
    free(edges);
    return SHCD_OK;
}

/* Inverse iteration towards the slowest mode, from the coordinate along the longest extent. */
static shcd_status find_poles(cylinder *c, shcdi_laplacian *laplacian, const shcd_vec3 *positions) {
    const size_t n = c->energy->n_vertices;
    const double *area = c->energy->vertex_area;
    shcd_status status = SHCD_OK;
    for (size_t i = 0; i < n; ++i) {
        c->potential[i] = positions[i];
    }
    for (int k = 0; k < N_INVERSE_ITERATIONS && status == SHCD_OK; ++k) {
        shcd_vec3 mean = shcd_vec3_make(0.0, 0.0, 0.0);
        double size = 0.0;
        for (size_t i = 0; i < n; ++i) {
            mean = shcd_mul_add(mean, area[i], c->potential[i]); /* the areas sum to 1 */
            size = fmax(size, shcd_dot(c->potential[i], c->potential[i]));
        }
        const double scale = size > 0.0 ? 1.0 / sqrt(size) : 1.0;
        for (size_t i = 0; i < n; ++i) {
            c->work[i] = shcd_scale(scale * area[i], shcd_sub(c->potential[i], mean));
        }
        status = shcdi_laplacian_solve(laplacian, c->work, c->potential);
    }
    c->north = c->south = 0;
    for (size_t i = 1; i < n; ++i) {
        const double sum = c->potential[i].x + c->potential[i].y + c->potential[i].z;
        const shcd_vec3 a = c->potential[c->north], b = c->potential[c->south];
        c->north = sum > a.x + a.y + a.z ? i : c->north;
        c->south = sum < b.x + b.y + b.z ? i : c->south;
    }
    return status == SHCD_OK && c->north == c->south ? SHCD_ERR_CONVERGENCE : status;
}

static shcd_status find_potential(cylinder *c, shcdi_laplacian *laplacian) {
    const size_t n = c->energy->n_vertices;
    for (size_t i = 0; i < n; ++i) {
        c->work[i] = shcd_vec3_make(0.0, 0.0, 0.0);
    }
    c->work[c->north].x = 1.0;
    c->work[c->south].x = -1.0;
    return shcdi_laplacian_solve(laplacian, c->work, c->potential);
}

/* Breadth first over the triangles: longitude grows by the flux across each edge on the way. */
static void integrate_flux(cylinder *c) {
    size_t head = 0, tail = 0;
    c->queue[tail++] = 0;
    c->reached[0] = 1;
    while (head < tail) {
        const size_t t = c->queue[head++];
        const uint32_t *triangle = c->energy->triangles + 3 * t;
        for (size_t k = 0; k < 3; ++k) {
            const size_t other = c->across[3 * t + k], neighbour = other / 3;
            if (c->reached[neighbour]) {
                continue;
            }
            const double drop =
                c->potential[triangle[(k + 2) % 3]].x - c->potential[triangle[(k + 1) % 3]].x;
            c->longitude[neighbour] =
                c->longitude[t] + (c->weights[3 * t + k] + c->weights[other]) * drop;
            c->reached[neighbour] = 1;
            c->queue[tail++] = neighbour;
        }
    }
}

typedef struct ranked {
    double potential;
    size_t vertex;
} ranked;

static int compare_ranked(const void *pa, const void *pb) {
    const ranked *a = pa, *b = pb;
    if (a->potential != b->potential) {
        return a->potential < b->potential ? -1 : 1;
    }
    return a->vertex < b->vertex ? -1 : a->vertex > b->vertex;
}

/* z from the area below each vertex; x and y from the mean direction of the triangles around it. */
static shcd_status place(const cylinder *c, shcd_vec3 *u) {
    const size_t n = c->energy->n_vertices;
    ranked *order = malloc(n * sizeof *order);
    if (order == NULL) {
        return SHCD_ERR_MEMORY;
    }
    for (size_t i = 0; i < n; ++i) {
        order[i] = (ranked){c->potential[i].x, i};
        u[i] = shcd_vec3_make(0.0, 0.0, 0.0);
    }
    qsort(order, n, sizeof *order, compare_ranked);
    for (size_t t = 0; t < c->energy->n_triangles; ++t) {
        const shcd_vec3 direction =
            shcd_vec3_make(cos(two_pi * c->longitude[t]), sin(two_pi * c->longitude[t]), 0.0);
        for (int k = 0; k < 3; ++k) {
            shcd_vec3 *v = &u[c->energy->triangles[3 * t + (size_t)k]];
            *v = shcd_add(*v, direction);
        }
    }
    double below = 0.0;
    for (size_t r = 0; r < n; ++r) {
        const size_t i = order[r].vertex;
        const double z = -1.0 + 2.0 * (below + 0.5 * c->energy->vertex_area[i]);
        const double radius = sqrt(fmax(0.0, (1.0 - z) * (1.0 + z)));
        const shcd_vec3 direction = shcd_unit(u[i]);
        u[i] = shcd_unit(shcd_vec3_make(radius * direction.x, radius * direction.y, z));
        below += c->energy->vertex_area[i];
    }
    u[c->north] = shcd_vec3_make(0.0, 0.0, 1.0);
    u[c->south] = shcd_vec3_make(0.0, 0.0, -1.0);
    free(order);
    return SHCD_OK;
}

shcd_status shcdi_start_cylinder(const shcdi_energy *energy, shcdi_laplacian *laplacian,
                                 const shcd_vec3 *positions, shcd_vec3 *u) {
    cylinder c = {.energy = energy};
    shcd_status status = allocate(&c);
    status = status == SHCD_OK ? match_edges(&c) : status;
    if (status == SHCD_OK) {
        shcdi_energy_cotangent_weights(energy, c.weights);
        for (size_t i = 0; i < energy->n_vertices; ++i) {
            c.mass[i] = MASS_FACTOR * energy->vertex_area[i];
        }
        status = shcdi_laplacian_factorise(laplacian, c.weights, c.mass);
    }
    status = status == SHCD_OK ? find_poles(&c, laplacian, positions) : status;
    status = status == SHCD_OK ? find_potential(&c, laplacian) : status;
    if (status == SHCD_OK) {
        integrate_flux(&c);
        status = place(&c, u);
    }
    release(&c);
    return status;
}
