/* SPDX-License-Identifier: BSD-3-Clause */
/* Winding number by a ray: the leaf triangles that it leaves through, less those that it enters
 * through.
 *
 * The triangles with strips over the gaps between blocks are a closed surface T. A triangle's
 * points lie within its deviation of the points of S with the same parameter. Neighbouring blocks
 * store a common edge twice, each end moved by the grid of its block and by what the block's
 * positions are stale by; the strip between the two lies within `gap` of both, gap the sum of what
 * the two may have moved, and its points are between those of equal parameter. A point farther from
 * S than all that sees S and T turn around it equally often, since the straight ways from one to
 * the other do not meet it; and around T that number is what a ray counts, if it meets no edge and
 * no strip. A ray that comes within `gap` of an edge between blocks is given up for another one.
 *
 * Edges inside a block have the same two ends for both of their triangles: whether the ray passes
 * on one side or the other is the sign of one number and of its negative, whatever it was rounded
 * to, so that exactly one of the two is hit. Where it is 0 the ray is given up, too. */
#include "query/winding.h"

/* Sides of a block, along its outer nodes. */
#define SIDE_EDGES 12
static const uint8_t side[SIDE_EDGES + 1] = {14, 13, 11, 8, 4, 3, 2, 1, 0, 5, 9, 12, 14};

#define RAYS_MAX 8
/* Directions without a relation to any lattice, not quite unit vectors. */
static const shcd_vec3 direction[RAYS_MAX - 1] = {{0.137, 0.691, 0.709},   {-0.823, 0.211, 0.527},
                                                  {0.463, -0.859, 0.219},  {0.313, 0.271, -0.911},
                                                  {-0.571, -0.477, 0.668}, {-0.229, 0.787, -0.573},
                                                  {0.907, 0.401, 0.127}};

typedef struct ray {
    shcd_vec3 from;      /* scaled, relative to the index's origin */
    shcd_vec3 u, e1, e2; /* unit vectors */
    double gap;          /* scaled */
    int winding;
} ray;

typedef struct seen {
    double x, y, z; /* along e1, e2, u */
} seen;

static double cross2(const seen *a, const seen *b) {
    return a->x * b->y - a->y * b->x;
}

/* Whether the ray's line passes within the gap of the edge from a to b; roundings are far below
 * the gap. */
static int is_beside(const seen *a, const seen *b, double gap) {
    const double x = b->x - a->x, y = b->y - a->y, xx = x * x + y * y;
    double t = xx > 0.0 ? -(a->x * x + a->y * y) / xx : 0.0;
    t = t < 0.0 ? 0.0 : t > 1.0 ? 1.0 : t;
    const double dx = a->x + t * x, dy = a->y + t * y;
    return dx * dx + dy * dy <= gap * gap;
}

/* 0: the ray is given up. */
static int hit_leaf(ray *r, const seen *a, const seen *b, const seen *c) {
    const double ab = cross2(a, b), bc = cross2(b, c), ca = cross2(c, a);
    if (ab == 0.0 || bc == 0.0 || ca == 0.0) {
        return 0;
    }
    if ((ab > 0.0) == (bc > 0.0) && (bc > 0.0) == (ca > 0.0)) {
        /* the triangle is far from the point: which side it is on does not hang on rounding */
        const double way = bc * a->z + ca * b->z + ab * c->z;
        if ((way > 0.0) == (ab > 0.0)) {
            r->winding += ab > 0.0 ? 1 : -1;
        }
    }
    return 1;
}

static int hit_block(ray *r, const shcdi_block *block) {
    seen node[SHCDI_BLOCK_NODES];
    const double unit = (double)block->unit;
    const shcd_vec3 off = {(double)block->centre[0] - r->from.x,
                           (double)block->centre[1] - r->from.y,
                           (double)block->centre[2] - r->from.z};
    for (size_t i = 0; i < SHCDI_BLOCK_NODES; i++) {
        const shcd_vec3 x = {off.x + unit * (double)block->q[0][i],
                             off.y + unit * (double)block->q[1][i],
                             off.z + unit * (double)block->q[2][i]};
        node[i].x = shcd_dot(x, r->e1);
        node[i].y = shcd_dot(x, r->e2);
        node[i].z = shcd_dot(x, r->u);
    }
    for (size_t i = 0; i < SIDE_EDGES; i++) {
        if (is_beside(&node[side[i]], &node[side[i + 1]], r->gap)) {
            return 0;
        }
    }
    for (size_t i = 0; i < SHCDI_BLOCK_LEAVES; i++) {
        if (!hit_leaf(r, &node[shcdi_block_corner[0][i]], &node[shcdi_block_corner[1][i]],
                      &node[shcdi_block_corner[2][i]])) {
            return 0;
        }
    }
    return 1;
}

static void aim(ray *r, shcd_vec3 along) {
    r->u = shcd_unit(along);
    const shcd_vec3 other =
        fabs(r->u.x) < 0.6 ? shcd_vec3_make(1.0, 0.0, 0.0) : shcd_vec3_make(0.0, 1.0, 0.0);
    r->e1 = shcd_unit(shcd_cross(r->u, other));
    r->e2 = shcd_cross(r->u, r->e1);
    r->winding = 0;
}

/* Triangles and strips lie within their block's ball and a gap of it. */
static int cast(const shcdi_view *view, ray *r, uint32_t *n_patches) {
    const shcdi_index *index = view->index;
    const float *ball = view->positions.ball;
    const size_t n = index->n_balls;
    *n_patches += (uint32_t)(n / SHCDI_BLOCK_LEAVES);
    for (size_t b = 0; b < index->table.n_blocks; b++) {
        const shcd_vec3 c = {(double)ball[b] - r->from.x, (double)ball[n + b] - r->from.y,
                             (double)ball[2 * n + b] - r->from.z};
        const double radius = ((double)ball[3 * n + b] + r->gap) * (1.0 + 1e-9);
        const double along = shcd_dot(c, r->u);
        if (along + radius > 0.0 && shcd_dot(c, c) - along * along <= radius * radius) {
            ++*n_patches;
            if (!hit_block(r, &view->positions.block[b])) {
                return 0;
            }
        }
    }
    return 1;
}

/* What a node may have been moved by its block's grid. A unit is a 32766th of the way from the
 * block's centre to a node, which is at most twice the ball's radius, or 2^-20 of that
 * (block_kernel.h). */
static double grid_error(const shcdi_view *view) {
    return 2.0 * (double)SHCDI_GRID_ERROR / 32766.0 * 1.01 * view->radius_m;
}

int shcdi_winding(const shcdi_view *view, shcd_vec3 p, int *winding, uint32_t *n_patches) {
    const shcdi_index *index = view->index;
    ray r = {.from = shcd_scale(index->scale, shcd_sub(p, index->origin))};
    r.gap = (2.0 * grid_error(view) + view->parting_m) * index->scale * (1.0 + 1e-9);
    for (int i = 0; i < RAYS_MAX; i++) {
        /* away from the centre there is least in the way */
        aim(&r, i == 0 ? shcd_mul_add(r.from, 0.01, direction[0]) : direction[i - 1]);
        if (cast(view, &r, n_patches)) {
            *winding = r.winding;
            return 1;
        }
    }
    return 0;
}

double shcdi_tessellation_error(const shcdi_view *view) {
    /* a strip's points lie between two that belong to the same parameter */
    return view->model->info.max_deviation_m + view->deviation_growth_m + 2.0 * grid_error(view);
}
