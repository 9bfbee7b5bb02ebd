/* SPDX-License-Identifier: BSD-3-Clause */
/* The points of a shell as a tree (the nested point trees of Barbic and James, Six-DoF Haptic
 * Rendering of Contact Between Geometrically Complex Reduced Deformable Models, IEEE Trans. Haptics
 * 1(1), 2008).
 *
 * The geometry's order is nested: each prefix spreads over the whole shell. The prefixes of 1, 8,
 * 64, ... points are the levels; a point's parent is the nearest point of all coarser levels. With
 * reach_m the distance from a point to the farthest one below it, a signed distance of at least
 * reach_m at that point proves the whole subtree clear, since signed distance is 1-Lipschitz. */
#include "response/scene_private.h"

#define LEVEL_RATIO 8
/* of a distance between points: a few units in the last place */
#define OUTWARD (1.0 + 8.0 * 0x1p-53)

size_t shcdi_shell_bytes(size_t n_points) {
    const size_t doubles = 2 * n_points;
    const size_t integers = 4 * n_points + 2; /* even, so that what follows is aligned */
    return doubles * sizeof(double) + integers * sizeof(uint32_t);
}

static uint32_t nearest_of(const shcd_vec3 *point, uint32_t n, shcd_vec3 p) {
    double least = HUGE_VAL;
    uint32_t nearest = 0;
    for (uint32_t k = 0; k < n; k++) {
        const shcd_vec3 r = shcd_sub(point[k], p);
        const double square = shcd_dot(r, r);
        if (square < least) {
            least = square;
            nearest = k;
        }
    }
    return nearest;
}

static void find_parents(shcdi_shell *shell) {
    uint32_t coarser = 1;
    for (uint32_t i = 1; i < shell->n_points; i++) {
        coarser = i >= LEVEL_RATIO * coarser ? LEVEL_RATIO * coarser : coarser;
        shell->parent[i] = nearest_of(shell->point, coarser, shell->point[i]);
        shell->link_m[i] =
            OUTWARD * shcd_norm(shcd_sub(shell->point[i], shell->point[shell->parent[i]]));
    }
}

/* Children by parent, each in the order of points (a counting sort). */
static void list_children(shcdi_shell *shell) {
    const uint32_t n = shell->n_points;
    for (uint32_t i = 1; i < n; i++) {
        shell->first_child[shell->parent[i] + 1]++;
    }
    for (uint32_t i = 0; i < n; i++) {
        shell->first_child[i + 1] += shell->first_child[i];
    }
    for (uint32_t i = n - 1; i > 0; i--) {
        /* from the back: first_child[p + 1] walks down to where p's children begin */
        shell->child[--shell->first_child[shell->parent[i] + 1]] = i;
    }
    for (uint32_t i = 0; i < n; i++) {
        shell->first_child[i] = shell->first_child[i + 1];
    }
    shell->first_child[n] = n - 1;
}

/* Every point tells all its ancestors how far it is. */
static void measure(shcdi_shell *shell) {
    for (uint32_t i = 0; i < shell->n_points; i++) {
        shell->n_below[i] = 1;
    }
    for (uint32_t i = shell->n_points - 1; i > 0; i--) {
        shell->n_below[shell->parent[i]] += shell->n_below[i];
    }
    for (uint32_t i = 1; i < shell->n_points; i++) {
        for (uint32_t a = shell->parent[i];; a = shell->parent[a]) {
            const double away = OUTWARD * shcd_norm(shcd_sub(shell->point[i], shell->point[a]));
            shell->reach_m[a] = shcdi_max(shell->reach_m[a], away);
            if (a == 0) {
                break;
            }
        }
    }
}

void shcdi_shell_build(const shcd_tool_geometry *geometry, unsigned char *memory,
                       shcdi_shell *shell) {
    const size_t n = shcdi_tool_point_count(geometry);
    double *doubles = (double *)(void *)memory;
    uint32_t *integers = (uint32_t *)(void *)(doubles + 2 * n);
    shell->n_points = (uint32_t)n;
    shell->point = shcdi_tool_points(geometry);
    shell->reach_m = doubles;
    shell->link_m = doubles + n;
    shell->parent = integers;
    shell->n_below = integers + n;
    shell->child = integers + 2 * n;
    shell->first_child = integers + 3 * n; /* n + 1 of them */
    find_parents(shell);
    list_children(shell);
    measure(shell);
}
