/* SPDX-License-Identifier: BSD-3-Clause */
/* Convex hull by adding, again and again, the point that is farthest outside of what there is: the
 * triangles that see it give way to a fan from their outline to the point.
 *
 * Points no farther outside than 1e-9 of the extent are left out. That makes the order of points on
 * a common face irrelevant (a grid on a cube's face leaves its four corners) and keeps each added
 * point clear of the rounding of the planes it is tested against. */
#include "query/hull.h"

#include <string.h>

#define FLAT 1e-6 /* of the extent: less thickness is no volume */
#define OUTSIDE 1e-9

static double extent_of(const shcd_vec3 *point, size_t n) {
    double most = 0.0;
    for (size_t i = 1; i < n; i++) {
        most = shcdi_max(most, shcd_norm(shcd_sub(point[i], point[0])));
    }
    return most;
}

static void set_plane(const shcd_vec3 *point, shcdi_hull_triangle *t) {
    /* from the shortest edge on: the cross product of two long, nearly parallel ones cancels */
    const shcd_vec3 a = point[t->v[0]], b = point[t->v[1]], c = point[t->v[2]];
    const shcd_vec3 ab = shcd_sub(b, a), bc = shcd_sub(c, b), ca = shcd_sub(a, c);
    const double lab = shcd_dot(ab, ab), lbc = shcd_dot(bc, bc), lca = shcd_dot(ca, ca);
    shcd_vec3 n;
    if (lab >= lbc && lab >= lca) {
        n = shcd_cross(bc, ca);
    } else if (lbc >= lca) {
        n = shcd_cross(ca, ab);
    } else {
        n = shcd_cross(ab, bc);
    }
    t->normal = shcd_unit(n);
    t->offset = shcd_dot(t->normal, a);
}

static int add_triangle(const shcd_vec3 *point, int a, int b, int c, shcdi_hull *hull) {
    if (hull->n == SHCDI_HULL_TRIANGLES_MAX) {
        return 0;
    }
    shcdi_hull_triangle *t = &hull->triangle[hull->n++];
    t->v[0] = a;
    t->v[1] = b;
    t->v[2] = c;
    set_plane(point, t);
    return 1;
}

/* Index of the largest value of |v_i|, v_i the component of a point off the points chosen so far.
 */
static size_t farthest_off(const shcd_vec3 *point, size_t n, const size_t *chosen, int n_chosen,
                           double *most) {
    const shcd_vec3 o = point[chosen[0]];
    size_t best = 0;
    *most = -1.0;
    for (size_t i = 0; i < n; i++) {
        const shcd_vec3 d = shcd_sub(point[i], o);
        double off = shcd_norm(d);
        if (n_chosen == 2) {
            off = shcd_norm(shcd_cross(d, shcd_unit(shcd_sub(point[chosen[1]], o))));
        } else if (n_chosen == 3) {
            const shcd_vec3 normal =
                shcd_unit(shcd_cross(shcd_sub(point[chosen[1]], o), shcd_sub(point[chosen[2]], o)));
            off = fabs(shcd_dot(d, normal));
        }
        if (off > *most) {
            *most = off;
            best = i;
        }
    }
    return best;
}

static int first_tetrahedron(const shcd_vec3 *point, size_t n, double extent, shcdi_hull *hull) {
    size_t c[4] = {0, 0, 0, 0};
    double off;
    if (n < 4) {
        return 0;
    }
    c[0] = farthest_off(point, n, c, 1, &off); /* an extreme point */
    for (int k = 1; k < 4; k++) {
        c[k] = farthest_off(point, n, c, k, &off);
        if (!(off > FLAT * extent)) {
            return 0;
        }
    }
    const shcd_vec3 o = point[c[0]];
    const shcd_vec3 normal = shcd_cross(shcd_sub(point[c[1]], o), shcd_sub(point[c[2]], o));
    if (shcd_dot(normal, shcd_sub(point[c[3]], o)) > 0.0) { /* c3 below the triangle c0 c1 c2 */
        const size_t swap = c[1];
        c[1] = c[2];
        c[2] = swap;
    }
    const int v[4] = {(int)c[0], (int)c[1], (int)c[2], (int)c[3]};
    return add_triangle(point, v[0], v[1], v[2], hull) &&
           add_triangle(point, v[0], v[2], v[3], hull) &&
           add_triangle(point, v[0], v[3], v[1], hull) &&
           add_triangle(point, v[1], v[3], v[2], hull);
}

static double above(const shcdi_hull_triangle *t, shcd_vec3 p) {
    return shcd_dot(t->normal, p) - t->offset;
}

/* The triangle on the other side of the edge a -> b. */
static size_t neighbour(const shcdi_hull *hull, size_t n, int a, int b) {
    for (size_t i = 0; i < n; i++) {
        const int *v = hull->triangle[i].v;
        if ((v[0] == b && v[1] == a) || (v[1] == b && v[2] == a) || (v[2] == b && v[0] == a)) {
            return i;
        }
    }
    return n;
}

/* Triangles that see a point, in one piece around the one that sees it best: what rounding makes of
 * faces in a plane with the point must not tear the outline apart. */
static void mark_visible(const shcdi_hull *hull, shcd_vec3 p, size_t first,
                         unsigned char *visible) {
    size_t waiting[SHCDI_HULL_TRIANGLES_MAX], n = 1;
    memset(visible, 0, hull->n);
    visible[first] = 1;
    waiting[0] = first;
    while (n > 0) {
        const int *v = hull->triangle[waiting[--n]].v;
        for (int k = 0; k < 3; k++) {
            const size_t next = neighbour(hull, hull->n, v[k], v[(k + 1) % 3]);
            if (next < hull->n && !visible[next] &&
                above(&hull->triangle[next], p) > hull->tolerance) {
                visible[next] = 1;
                waiting[n++] = next;
            }
        }
    }
}

static int add_point(const shcd_vec3 *point, int index, size_t seen_best, shcdi_hull *hull) {
    unsigned char visible[SHCDI_HULL_TRIANGLES_MAX];
    const size_t n = hull->n;
    mark_visible(hull, point[index], seen_best, visible);
    for (size_t i = 0; i < n; i++) {
        for (int k = 0; k < 3 && visible[i]; k++) {
            const int a = hull->triangle[i].v[k], b = hull->triangle[i].v[(k + 1) % 3];
            const size_t other = neighbour(hull, n, a, b);
            const int is_outline = other < n && !visible[other];
            if (is_outline && !add_triangle(point, a, b, index, hull)) {
                return 0;
            }
        }
    }
    size_t kept = 0;
    for (size_t i = 0; i < hull->n; i++) {
        if (i >= n || !visible[i]) {
            hull->triangle[kept++] = hull->triangle[i];
        }
    }
    hull->n = kept;
    return 1;
}

int shcdi_hull_of(const shcd_vec3 *point, size_t n, shcdi_hull *hull) {
    const double extent = extent_of(point, n);
    hull->n = 0;
    hull->tolerance = OUTSIDE * extent;
    if (!first_tetrahedron(point, n, extent, hull)) {
        return 0;
    }
    for (size_t round = 0; round < n; round++) {
        double most = hull->tolerance;
        size_t farthest = n, seen_best = 0;
        for (size_t i = 0; i < n; i++) {
            for (size_t k = 0; k < hull->n; k++) {
                const double d = above(&hull->triangle[k], point[i]);
                if (d > most) {
                    most = d;
                    farthest = i;
                    seen_best = k;
                }
            }
        }
        if (farthest == n || !add_point(point, (int)farthest, seen_best, hull)) {
            break;
        }
    }
    return 1;
}
