/* SPDX-License-Identifier: BSD-3-Clause */
/* Proven error of the look-up, cell by cell.
 *
 * A cell whose nodes agree in their count K gets a bound if K sheets are proven over the whole of
 * it (map_sheet.c), they pass through the nodes' crossings, and nothing else of the surface meets
 * the cell's rays. A cell that fails is split in four, twice at most; where that fails too, a ray
 * grazes or nearly so, and there is no bound.
 *
 * Sheets. Over each part of the cell, K different crossings on the middle ray are continued over
 * the part, each one-to-one within its own cap of the parameter sphere. A crossing at a corner
 * belongs to the sheet in whose cap it lies, so corners shared by parts tie their sheets together,
 * in the order of the radii at the nodes. Different sheets never meet, since continuation is
 * locally one-to-one. If two sheets of a self-intersecting surface change places in a cell, sorted
 * radii still differ by no more than the largest error of the sheets.
 *
 * Nothing else. A surface that is proven star-shaped about the centre has no other crossing.
 * Otherwise every leaf whose ball meets the part's cone is cut down until each piece lies in one of
 * the caps (where each ray has its one crossing) or, being within its deviation
 * of a flat triangle (tree.c), misses the cone.
 *
 * Error. Octahedral: with f(q) = r(q/|q|) the look-up is the linear interpolant of f on a flat
 * lattice triangle of edge h = sqrt(2), which errs by at most h^2/6 sup |D^2 f| (tree.c). Along a
 * straight line q/|q| moves on a great circle at |theta'| <= 1/|q| with |theta''| <= 1/|q|^2, so
 * |D^2 f| <= D = (m2 + m1)/|q|^2 in all directions of R^3, m1 and m2 bounds of r' and r''. The
 * bound is D/3. Latitude-longitude: the bilinear interpolant errs by at most s^2/8 (sup |f_tt| +
 * sup |f_pp|), s the step, f_tt = r'' along a meridian, and the circle of latitude adds its
 * curvature: |f_pp| <= sin^2 m2 + |sin cos| m1. Hermite: a cubic through values and derivatives of
 * a function with |g''| <= D on an interval of length l errs by at most D l^2/16, its derivative by
 * 0.2515 D l (largest L1 norms of the Peano kernels). On the edge opposite a corner that makes D/8
 * for the value. The derivative along v = alpha e + beta q + gamma nu is off by |alpha e| 0.2515 D
 * h + |gamma| D h/2, the latter since the linear interpolant of a function with slope <= D h over
 * the edge errs by half of that. Here |gamma|
 * <= height = sqrt(3/2); with m the normal of the face, v.m = e.m = 0 gives beta = -gamma nu.m/q.m,
 * and |beta q.e|/|e| <= 0.71 |gamma| over a face (largest on its border), so |alpha e| <= h/2 +
 * 0.71 |gamma| < 1.58. The derivative is off by 1.43 D, and the cubic from the corner (l^2 <= 2,
 * derivatives weigh at most 4/27) by D (1/8 + 1/8 + 1.43 4/27) < 0.47 D = 1.41 D/3. A blend of
 * three such values errs no more. It is second order only: no derivative of r beyond the second is
 * bounded. Nodes add the tolerance of Newton's method and the rounding of float.
 */
#include "model/map_sheet.h"

#include <string.h>

#define PI 3.14159265358979324
/* a leaf is cut down to what a tree of this level would have as leaves */
#define PIECE_LEVEL 10
#define PIECE_LEVELS_MAX 8
/* Newton's steps for a cell, in the mean of all. Real bodies take up to 30 with one split, four
 * times as many with each further one; when all are spent, the cells that are left have no bound.
 */
#define STEPS_PER_CELL ((size_t)100)
/* a bound beyond this part of the diagonal is not worth the name */
#define USEFUL 0.05

typedef struct bounder {
    const shcd_model *model;
    shcdi_map *map;
    shcdi_cap *caps;
    int splits; /* a cell is split this often */
    int pieces; /* splits of leaves for one part of a cell */
    size_t n_bounded;
    size_t *steps_left; /* of Newton's method, for all cells */
} bounder;

/* Part of a cell, with the K crossings at each of its corners. */
typedef struct part {
    int n, level;
    double u[4][3];
    shcd_vec3 w[4][SHCDI_MAP_CROSSINGS_MAX];
} part;

static void middle_of(const part *p, const int corners[], int n, double u[3]) {
    for (int k = 0; k < 3; k++) {
        u[k] = 0.0;
        for (int i = 0; i < n; i++) {
            u[k] += p->u[corners[i]][k] / n;
        }
    }
}

static shcd_vec3 mean_crossing(const part *p, const int corners[], int n, int k) {
    shcd_vec3 w = {0.0, 0.0, 0.0};
    for (int i = 0; i < n; i++) {
        w = shcd_add(w, p->w[corners[i]][k]);
    }
    return shcd_unit(w);
}

static const int ALL[4] = {0, 1, 2, 3};

/* The farthest point of a part from its middle is a corner: a geodesic triangle lies in every cap
 * (below a half-sphere) that holds its corners; in (theta, phi) the distance grows with |phi -
 * phi_c| and is quasi-convex in theta. */
static shcdi_cone cone_of(const shcdi_map *map, const part *p) {
    double u[3];
    middle_of(p, ALL, p->n, u);
    shcdi_cone cone = {map->centre, shcdi_grid_direction(map->grid, u), 0.0};
    for (int i = 0; i < p->n; i++) {
        const shcd_vec3 d = shcdi_grid_direction(map->grid, p->u[i]);
        const double chord = shcd_norm(shcd_sub(d, cone.d));
        cone.angle = shcdi_max(cone.angle, 2.0 * asin(shcdi_min(1.0, 0.5 * chord)));
    }
    cone.angle += 1e-12;
    return cone;
}

/* ---- nothing else ---- */

static int ball_meets_cone(const shcdi_cone *cone, shcd_vec3 centre, double radius) {
    const shcd_vec3 v = shcd_sub(centre, cone->origin);
    const double along = shcd_dot(v, cone->d);
    const double across = shcd_norm(shcd_mul_add(v, -along, cone->d));
    const double c = cos(cone->angle), s = sin(cone->angle);
    const double away = along * c + across * s > 0.0 ? across * c - along * s : shcd_norm(v);
    return away <= radius * (1.0 + 1e-9);
}

static int in_a_cap(const shcdi_sheet *sheet, int n, const shcd_vec3 w[3]) {
    for (int k = 0; k < n; k++) {
        const double chord = 2.0 * sin(0.5 * sheet[k].unique) * (1.0 - 1e-9);
        int inside = 1;
        for (int i = 0; i < 3; i++) {
            inside = inside && shcd_norm(shcd_sub(w[i], sheet[k].w)) <= chord;
        }
        if (inside) {
            return 1;
        }
    }
    return 0;
}

typedef struct piece {
    shcd_vec3 w[3], x[3]; /* corners on the parameter sphere, and S there */
    int level;
} piece;

static int piece_meets_cone(const bounder *b, const shcdi_cone *cone, const shcdi_leaf *leaf,
                            const piece *p) {
    const shcd_vec3 c = shcd_scale(1.0 / 3.0, shcd_add(p->x[0], shcd_add(p->x[1], p->x[2])));
    double radius = 0.0;
    for (int i = 0; i < 3; i++) {
        radius = shcdi_max(radius, shcd_norm(shcd_sub(p->x[i], c)));
    }
    radius += shcdi_patch_deviation(p->w[0], p->w[1], p->w[2], (double)leaf->m1, (double)leaf->m2) +
              2.0 * b->model->evaluation_error_m;
    return ball_meets_cone(cone, c, radius);
}

static void split_piece(const shcd_model *model, const piece *p, piece child[4]) {
    piece *mid = &child[3];
    for (int k = 0; k < 3; k++) {
        mid->w[k] = shcd_unit(shcd_add(p->w[k], p->w[(k + 1) % 3]));
        mid->x[k] = shcdi_surface_point(&model->series, model->degree, mid->w[k]);
    }
    for (int k = 0; k < 3; k++) {
        const int before = (k + 2) % 3;
        child[k] = (piece){{p->w[k], mid->w[k], mid->w[before]},
                           {p->x[k], mid->x[k], mid->x[before]},
                           p->level + 1};
    }
    mid->level = p->level + 1;
}

/* The leaf is known to meet the cone; *left counts splits. */
static int leaf_is_settled(const bounder *b, const shcdi_cone *cone, const shcdi_sheet *sheet,
                           int n_sheets, uint32_t index, int *left) {
    const shcdi_tree *tree = &b->model->tree;
    const shcdi_leaf *leaf = &tree->leaf[index];
    piece stack[3 * PIECE_LEVELS_MAX + 4];
    for (int k = 0; k < 3; k++) {
        stack[0].w[k] = tree->direction[leaf->vertex[k]];
        stack[0].x[k] = tree->position[leaf->vertex[k]];
    }
    stack[0].level = 0;
    int n = 1;
    while (n > 0) {
        const piece top = stack[--n];
        if (in_a_cap(sheet, n_sheets, top.w) ||
            (top.level > 0 && !piece_meets_cone(b, cone, leaf, &top))) {
            continue;
        }
        if (top.level + tree->level == PIECE_LEVEL || --*left < 0) {
            return 0;
        }
        split_piece(b->model, &top, &stack[n]);
        n += 4;
    }
    return 1;
}

static int nothing_else(const bounder *b, const shcdi_cone *cone, const shcdi_sheet *sheet,
                        int n_sheets) {
    const shcdi_tree *tree = &b->model->tree;
    uint32_t stack[8 + 3 * (SHCDI_TREE_LEVEL_MAX + 1)];
    int level_of[8 + 3 * (SHCDI_TREE_LEVEL_MAX + 1)];
    int n = 0, left = b->pieces;
    for (uint32_t i = 0; i < 8; i++) {
        stack[n] = i;
        level_of[n++] = 0;
    }
    while (n > 0) {
        const uint32_t i = stack[--n];
        const int level = level_of[n];
        const shcdi_ball *ball = &tree->ball[shcdi_tree_level_start(level) + i];
        if (!ball_meets_cone(cone, ball->centre, ball->radius)) {
            continue;
        }
        if (level == tree->level) {
            if (!leaf_is_settled(b, cone, sheet, n_sheets, i, &left)) {
                return 0;
            }
            continue;
        }
        for (uint32_t k = 0; k < 4; k++) {
            stack[n] = 4 * i + k;
            level_of[n++] = level + 1;
        }
    }
    return 1;
}

/* ---- one part ---- */

static double sheet_error(const shcdi_map *map, const part *p, const shcdi_sheet *sheet) {
    const double rounding = 0x1p-22 * (sheet->r_max + sheet->m1 + sheet->m2);
    double curvature;
    if (map->grid == SHCD_MAP_OCTAHEDRAL) {
        double u[3], far = 0.0;
        middle_of(p, ALL, 3, u);
        const shcd_vec3 q = {u[0], u[1], u[2]};
        for (int i = 0; i < 3; i++) {
            const shcd_vec3 corner = {p->u[i][0], p->u[i][1], p->u[i][2]};
            far = shcdi_max(far, shcd_norm(shcd_sub(corner, q)));
        }
        const double nearest = shcd_norm(q) - far;
        curvature = (sheet->m2 + sheet->m1) / (3.0 * nearest * nearest);
    } else {
        const double low = p->u[0][0], high = p->u[2][0], step = PI / map->resolution;
        const double sine =
            low <= 0.5 * PI && high >= 0.5 * PI ? 1.0 : shcdi_max(sin(low), sin(high));
        const double cosine = shcdi_max(fabs(cos(low)), fabs(cos(high)));
        const double turn = shcdi_min(0.5, sine * cosine);
        curvature = step * step / 8.0 * (sheet->m2 * (1.0 + sine * sine) + sheet->m1 * turn);
    }
    return (curvature + sheet->node + rounding) * (1.0 + 1e-9);
}

/* Raises *error; 0 if the part has to be split. */
static int prove(const bounder *b, const part *p, int n_sheets, double *error) {
    const shcdi_cone cone = cone_of(b->map, p);
    shcdi_sheet sheet[SHCDI_MAP_CROSSINGS_MAX];
    const int is_star = n_sheets == 1 && b->map->star_margin_m > 0.0;
    double largest = 0.0;
    if (!(cone.angle < 1.0)) {
        return 0;
    }
    for (int k = 0; k < n_sheets; k++) {
        const shcd_vec3 start = mean_crossing(p, ALL, p->n, k);
        if (!shcdi_sheet_prove(b->model, b->caps, &cone, start, !is_star, b->steps_left,
                               &sheet[k])) {
            return 0;
        }
        /* stored parameters are float: 2e-7 off at most */
        const double chord = 2.0 * sin(0.5 * sheet[k].unique) - 1e-6;
        for (int i = 0; i < p->n; i++) {
            if (!(shcd_norm(shcd_sub(p->w[i][k], sheet[k].w)) <= chord)) {
                return 0;
            }
        }
        for (int j = 0; j < k; j++) {
            if (!(shcd_norm(shcd_sub(sheet[j].w, sheet[k].w)) > 1e-6)) {
                return 0;
            }
        }
        largest = shcdi_max(largest, sheet_error(b->map, p, &sheet[k]));
    }
    if (!(largest <= USEFUL * b->model->info.diagonal_m)) {
        return 0;
    }
    if (!is_star && !nothing_else(b, &cone, sheet, n_sheets)) {
        return 0;
    }
    *error = shcdi_max(*error, largest);
    return 1;
}

/* ---- one cell ---- */

/* Corner c of child q as the corners of the parent whose mean it is, -1 ending the list. */
static const int TRIANGLE[4][3][3] = {{{0, -1}, {0, 1, -1}, {0, 2, -1}},
                                      {{1, -1}, {1, 2, -1}, {0, 1, -1}},
                                      {{2, -1}, {0, 2, -1}, {1, 2, -1}},
                                      {{0, 1, -1}, {1, 2, -1}, {0, 2, -1}}};
static const int SQUARE[4][4][5] = {{{0, -1}, {0, 1, -1}, {0, 2, -1}, {0, 1, 2, 3, -1}},
                                    {{0, 1, -1}, {1, -1}, {0, 1, 2, 3, -1}, {1, 3, -1}},
                                    {{0, 2, -1}, {0, 1, 2, 3, -1}, {2, -1}, {2, 3, -1}},
                                    {{0, 1, 2, 3, -1}, {1, 3, -1}, {2, 3, -1}, {3, -1}}};

/* Which crossing of a new corner belongs to which sheet is a guess that prove() checks. */
static int child_of(const bounder *b, const part *p, int q, int n_sheets, part *child) {
    child->n = p->n;
    child->level = p->level + 1;
    for (int c = 0; c < p->n; c++) {
        const int *from = p->n == 3 ? TRIANGLE[q][c] : SQUARE[q][c];
        int n = 0;
        while (n < 4 && from[n] >= 0) {
            n++;
        }
        middle_of(p, from, n, child->u[c]);
        const shcd_vec3 d = shcdi_grid_direction(b->map->grid, child->u[c]);
        for (int k = 0; k < n_sheets; k++) {
            shcdi_hit hit = {0.0, p->w[from[0]][k], {0.0, 0.0, 0.0}};
            if (n > 1 && !shcdi_ray_newton(b->model, b->map->centre, d,
                                           mean_crossing(p, from, n, k), b->steps_left, &hit)) {
                return 0;
            }
            child->w[c][k] = hit.w;
        }
    }
    return 1;
}

static int bound_cell(void *user, const shcdi_cell *cell) {
    bounder *b = user;
    shcdi_map *map = b->map;
    map->bound[cell->index] = INFINITY;
    const int n_sheets = map->count[cell->slot[0]];
    part stack[3 * SHCDI_MAP_SPLITS_MAX + 1];
    stack[0].n = cell->n;
    stack[0].level = 0;
    memcpy(stack[0].u, cell->u, sizeof cell->u);
    for (int i = 0; i < cell->n; i++) {
        if (map->count[cell->slot[i]] != n_sheets || n_sheets == SHCDI_MAP_UNSURE) {
            return 1;
        }
        for (int k = 0; k < n_sheets; k++) {
            stack[0].w[i][k] = shcd_unit(shcdi_from_floats(
                map->crossing[map->first[cell->slot[i]] + (uint32_t)k].parameter));
        }
    }
    double error = 0.0;
    int n = 1;
    while (n > 0) {
        const part top = stack[--n];
        if (prove(b, &top, n_sheets, &error)) {
            continue;
        }
        if (top.level == b->splits) {
            return 1;
        }
        for (int q = 0; q < 4; q++) {
            if (!child_of(b, &top, q, n_sheets, &stack[n++])) {
                return 1;
            }
        }
    }
    map->bound[cell->index] = (float)(error * (1.0 + 0x1p-22));
    map->bound_m = shcdi_max(map->bound_m, (double)map->bound[cell->index]);
    b->n_bounded++;
    return 1;
}

shcd_status shcdi_map_bound(const shcd_model *model, int splits, const shcd_allocator *allocator,
                            shcdi_map *map) {
    map->bound = allocator->allocate(map->n_cells * sizeof *map->bound, allocator->user);
    if (map->bound == NULL) {
        return SHCD_ERR_MEMORY;
    }
    const size_t steps = (STEPS_PER_CELL << (splits < 2 ? 0 : 2 * (splits - 1))) * map->n_cells;
    size_t steps_left = steps;
    shcdi_cap *caps = shcdi_caps_create(model, allocator);
    bounder b = {model, map, caps, splits, splits < 2 ? 50 : 200, 0, &steps_left};
    if (b.caps == NULL) {
        return SHCD_ERR_MEMORY;
    }
    (void)shcdi_grid_visit_cells(map->grid, map->resolution, bound_cell, &b);
    map->n_steps += steps - steps_left;
    map->bounded_share = (double)b.n_bounded / (double)map->n_cells;
    allocator->release(b.caps, allocator->user);
    return SHCD_OK;
}
