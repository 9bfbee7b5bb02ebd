/* SPDX-License-Identifier: BSD-3-Clause */
/* Octahedral grid. Nodes are the lattice points of |x| + |y| + |z| = n, so that there are no poles
 * and a look-up needs no trigonometry: q = n d/|d|_1 lies in a lattice triangle of one face, with
 * barycentric coordinates from the fractions of its coordinates. A face has n^2 triangles: with
 * (i, j) the whole parts of |q.x| and |q.y|, row i holds 2 (n - i) - 1 of them, so they are
 * numbered 2 n i - i^2 + 2 j, plus 1 for those that point down.
 *
 * Latitude-longitude grid. theta_j = pi j/n, phi_k = pi k/n; slot 2 n j + k. The rows j = 0 and j =
 * n hold one direction 2 n times over, so that every cell has four samples. The two angles come
 * from shcdi_angle().
 */
#include "model/map_grid.h"

#include "model/tree.h"

#define PI 3.14159265358979324

size_t shcdi_grid_slots(int grid, int n) {
    const size_t m = (size_t)n;
    return grid == SHCD_MAP_OCTAHEDRAL ? (2 * m + 1) * (2 * m + 1) : 2 * m * (m + 1);
}

size_t shcdi_grid_nodes(int grid, int n) {
    const size_t m = (size_t)n;
    return grid == SHCD_MAP_OCTAHEDRAL ? 4 * m * m + 2 : 2 * m * (m + 1);
}

size_t shcdi_grid_cells(int grid, int n) {
    const size_t m = (size_t)n;
    return grid == SHCD_MAP_OCTAHEDRAL ? 8 * m * m : 2 * m * m;
}

/* ---- angles ---- */

/* t = min/max of |x|, |y| lies in [0, 1]; with c the nearest quarter, atan t = atan c + atan u,
 * u = (t - c)/(1 + t c), |u| <= 1/8. The odd Taylor series up to u^15 then errs by less than
 * u^17/17 = 2.6e-17; what remains is rounding of the table and of the sums, each below pi 2^-52. */
double shcdi_angle(double y, double x) {
    static const double quarter[5] = {0.0, 0.24497866312686415, 0.46364760900080612,
                                      0.64350110879328439, 0.78539816339744831};
    const double ax = fabs(x), ay = fabs(y);
    const double high = shcdi_max(ax, ay), low = shcdi_min(ax, ay);
    if (!(high > 0.0)) {
        return 0.0;
    }
    const double t = low / high;
    const int i = (int)(4.0 * t + 0.5);
    const double c = 0.25 * i;
    const double u = (t - c) / (1.0 + t * c);
    const double v = u * u;
    const double series =
        1.0 -
        v * (1.0 / 3.0 -
             v * (1.0 / 5.0 -
                  v * (1.0 / 7.0 -
                       v * (1.0 / 9.0 - v * (1.0 / 11.0 - v * (1.0 / 13.0 - v * (1.0 / 15.0)))))));
    double a = quarter[i] + u * series;
    a = ay > ax ? 0.5 * PI - a : a;
    a = x < 0.0 ? PI - a : a;
    a = y < 0.0 ? 2.0 * PI - a : a;
    return a < 2.0 * PI ? a : 0.0;
}

/* ---- octahedral ---- */

/* Parts that sum to 0 or 3 are those of a node that rounding has put on one side of its lattice
 * planes; it becomes corner `top` of an upward triangle, with all the weight. */
static void snap_to_node(int left, int whole[3], double part[3]) {
    int top = 0;
    for (int k = 1; k < 3; k++) {
        top = whole[k] + part[k] > whole[top] + part[top] ? k : top;
    }
    for (int k = 0; k < 3; k++) {
        whole[k] += left == 3 ? k != top : k == top ? left - 1 : 0;
        part[k] = k == top ? 1.0 : 0.0;
    }
}

static void locate_octahedral(int n, shcd_vec3 d, shcdi_stencil *at) {
    const double sum = fabs(d.x) + fabs(d.y) + fabs(d.z);
    const double scale = n / sum;
    const double q[3] = {fabs(d.x) * scale, fabs(d.y) * scale, fabs(d.z) * scale};
    const double component[3] = {d.x, d.y, d.z};
    int whole[3], left = n;
    double part[3];
    for (int k = 0; k < 3; k++) {
        whole[k] = (int)q[k];
        part[k] = q[k] - whole[k];
        left -= whole[k];
    }
    const int up = left != 2;
    if (left != 1 && left != 2) {
        snap_to_node(left, whole, part);
    }
    at->n = 3;
    for (int i = 0; i < 3; i++) {
        at->weight[i] = up ? part[i] : 1.0 - part[i];
        for (int k = 0; k < 3; k++) {
            const int step = up ? (i == k) : (i != k);
            at->p[i][k] = (whole[k] + step) * (component[k] < 0.0 ? -1 : 1);
        }
        at->slot[i] = shcdi_lattice_cell(at->p[i], n);
    }
    at->weight[2] = shcdi_max(0.0, 1.0 - (at->weight[0] + at->weight[1]));
    at->slot[3] = at->slot[0];
    at->weight[3] = 0.0;
    const size_t m = (size_t)n, i = (size_t)whole[0], j = (size_t)whole[1];
    const size_t face = (d.x < 0.0 ? 1u : 0u) | (d.y < 0.0 ? 2u : 0u) | (d.z < 0.0 ? 4u : 0u);
    at->cell = face * m * m + 2 * m * i - i * i + 2 * j + (up ? 0 : 1);
}

static int visit_octahedral(int n, int (*visit)(void *, size_t, shcd_vec3), void *user) {
    for (int i = -n; i <= n; i++) {
        const int rest = n - (i < 0 ? -i : i);
        for (int j = -rest; j <= rest; j++) {
            const int k = rest - (j < 0 ? -j : j);
            for (int side = 0; side < (k != 0 ? 2 : 1); side++) {
                const int p[3] = {i, j, side == 0 ? k : -k};
                const shcd_vec3 d = {(double)p[0], (double)p[1], (double)p[2]};
                if (!visit(user, shcdi_lattice_cell(p, n), shcd_unit(d))) {
                    return 0;
                }
            }
        }
    }
    return 1;
}

/* Triangle `down` of lattice square (i, j) of a face, given by its signs. */
static void octahedral_cell(int n, int face, int i, int j, int down, shcdi_cell *cell) {
    const int sign[3] = {face & 1 ? -1 : 1, face & 2 ? -1 : 1, face & 4 ? -1 : 1};
    const int whole[3] = {i, j, n - 1 - down - i - j};
    const size_t m = (size_t)n, a = (size_t)i, b = (size_t)j;
    cell->n = 3;
    cell->index = (size_t)face * m * m + 2 * m * a - a * a + 2 * b + (size_t)down;
    for (int c = 0; c < 3; c++) {
        int p[3];
        for (int k = 0; k < 3; k++) {
            p[k] = sign[k] * (whole[k] + (down ? c != k : c == k));
            cell->u[c][k] = p[k];
        }
        cell->slot[c] = shcdi_lattice_cell(p, n);
    }
}

/* ---- latitude and longitude ---- */

static void locate_latitude_longitude(int n, shcd_vec3 d, shcdi_stencil *at) {
    const double u = shcdi_angle(sqrt(d.x * d.x + d.y * d.y), d.z) * (n / PI);
    const double v = shcdi_angle(d.y, d.x) * (n / PI);
    const size_t m = 2 * (size_t)n;
    size_t j = (size_t)u, k = (size_t)v;
    j = j < (size_t)n ? j : (size_t)n - 1;
    k = k < m ? k : m - 1;
    const double s = shcdi_min(1.0, u - (double)j), t = shcdi_min(1.0, v - (double)k);
    const size_t next = k + 1 < m ? k + 1 : 0;
    at->n = 4;
    at->cell = j * m + k;
    at->slot[0] = j * m + k;
    at->slot[1] = j * m + next;
    at->slot[2] = (j + 1) * m + k;
    at->slot[3] = (j + 1) * m + next;
    at->weight[0] = (1.0 - s) * (1.0 - t);
    at->weight[1] = (1.0 - s) * t;
    at->weight[2] = s * (1.0 - t);
    at->weight[3] = s * t;
}

static int visit_latitude_longitude(int n, int (*visit)(void *, size_t, shcd_vec3), void *user) {
    const size_t m = 2 * (size_t)n;
    for (size_t j = 0; j <= (size_t)n; j++) {
        for (size_t k = 0; k < m; k++) {
            /* all samples of a pole are one direction, and it is exact */
            const double u[3] = {PI * (double)j / n, PI * (double)k / n, 0.0};
            const shcd_vec3 pole = {0.0, 0.0, j == 0 ? 1.0 : -1.0};
            const int is_pole = j == 0 || j == (size_t)n;
            const shcd_vec3 d =
                is_pole ? pole : shcdi_grid_direction(SHCD_MAP_LATITUDE_LONGITUDE, u);
            if (!visit(user, j * m + k, d)) {
                return 0;
            }
        }
    }
    return 1;
}

static void latitude_longitude_cell(int n, size_t j, size_t k, shcdi_cell *cell) {
    const size_t m = 2 * (size_t)n;
    cell->n = 4;
    cell->index = j * m + k;
    for (size_t c = 0; c < 4; c++) {
        const size_t row = j + c / 2, column = k + c % 2;
        cell->slot[c] = row * m + column % m;
        cell->u[c][0] = PI * (double)row / n;
        cell->u[c][1] = PI * (double)column / n;
        cell->u[c][2] = 0.0;
    }
}

/* ---- either ---- */

void shcdi_grid_locate(int grid, int n, shcd_vec3 d, shcdi_stencil *at) {
    if (grid == SHCD_MAP_OCTAHEDRAL) {
        locate_octahedral(n, d, at);
    } else {
        locate_latitude_longitude(n, d, at);
    }
}

int shcdi_grid_visit_nodes(int grid, int n, int (*visit)(void *, size_t, shcd_vec3), void *user) {
    return grid == SHCD_MAP_OCTAHEDRAL ? visit_octahedral(n, visit, user)
                                       : visit_latitude_longitude(n, visit, user);
}

int shcdi_grid_visit_cells(int grid, int n, int (*visit)(void *, const shcdi_cell *), void *user) {
    shcdi_cell cell;
    if (grid == SHCD_MAP_OCTAHEDRAL) {
        for (int face = 0; face < 8; face++) {
            for (int i = 0; i < n; i++) {
                for (int j = 0; i + j < n; j++) {
                    for (int down = 0; down <= (i + j < n - 1); down++) {
                        octahedral_cell(n, face, i, j, down, &cell);
                        if (!visit(user, &cell)) {
                            return 0;
                        }
                    }
                }
            }
        }
        return 1;
    }
    for (size_t j = 0; j < (size_t)n; j++) {
        for (size_t k = 0; k < 2 * (size_t)n; k++) {
            latitude_longitude_cell(n, j, k, &cell);
            if (!visit(user, &cell)) {
                return 0;
            }
        }
    }
    return 1;
}

shcd_vec3 shcdi_grid_direction(int grid, const double u[3]) {
    if (grid == SHCD_MAP_OCTAHEDRAL) {
        return shcd_unit(shcd_vec3_make(u[0], u[1], u[2]));
    }
    return shcd_vec3_make(sin(u[0]) * cos(u[1]), sin(u[0]) * sin(u[1]), cos(u[0]));
}
