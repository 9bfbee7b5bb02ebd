/* SPDX-License-Identifier: BSD-3-Clause */
/* The other walls that a ball touches: in a groove or a corner, up to two beside the deepest
 * contact.
 *
 * A ball whose centre p is outside touches the surface wherever a foot, a local minimum of |S - p|,
 * is nearer than its radius. Feet of one wall are one contact: only feet whose normals differ from
 * those already found by more than 26 degrees count, and up to 45 degrees a wall counts in part, so
 * that it fades in as a bend becomes a corner. Every leaf of the surface that may be nearer than
 * the radius and faces another way is the start of a Newton run, nearest leaf first within a block;
 * the runs are capped, and a wall that the cap leaves out is felt in a later tick, when the ball
 * has moved or the first walls have pushed it out.
 *
 * A ball whose centre is inside has one contact, its proxy: from within, all walls push the same
 * way in or none is known to be the one it came through. */
#include "response/proxy.h"

#include "query/view.h"

#define RUNS_MAX 6
/* Cosines between normals: a wall of its own begins at 26 degrees, and is whole at 45. */
#define BEGINS SHCDI_TURN_COSINE
#define IS_WHOLE 0.70710678118654752

/* Walls found so far in this tick. */
typedef struct walls {
    const shcdi_body *body;
    shcd_vec3 p;
    double radius_m;
    shcd_vec3 normal[1 + SHCDI_SIDES_MAX];
    size_t n;
    shcdi_side side[SHCDI_SIDES_MAX];
    int n_runs;
    shcdi_gap *out;
} walls;

static double largest_cosine(const walls *w, shcd_vec3 normal) {
    double largest = -1.0;
    for (size_t i = 0; i < w->n; i++) {
        largest = shcdi_max(largest, shcd_dot(normal, w->normal[i]));
    }
    return largest;
}

static double squared_distance(shcd_vec3 p, const shcd_vec3 x[3]) {
    const shcd_vec3 middle = shcd_scale(1.0 / 3.0, shcd_add(x[0], shcd_add(x[1], x[2])));
    const shcd_vec3 way = shcd_sub(p, middle);
    return shcd_dot(way, way);
}

static void run_from(walls *w, shcd_vec3 parameter) {
    shcd_proximity found;
    w->n_runs++;
    if (shcdi_track_now(w->body, w->out->shape, w->p, parameter, &found) != SHCD_OK) {
        return;
    }
    shcdi_count(w->out, &found);
    const shcd_vec3 normal = shcdi_normal_at(&found, w->p);
    const double cosine = largest_cosine(w, normal);
    if ((found.flags & SHCD_PROXIMITY_NOT_STATIONARY) != 0 || !(found.distance_m > 0.0) ||
        !(found.distance_m < w->radius_m) || cosine >= BEGINS) {
        return;
    }
    const double share = shcdi_min(1.0, (BEGINS - cosine) / (BEGINS - IS_WHOLE));
    shcdi_side *side = &w->side[w->n - 1];
    side->foot_m = found.point_m;
    side->normal = normal;
    side->parameter = found.parameter;
    side->depth_m = w->radius_m - found.distance_m;
    side->share = share * share * (3.0 - 2.0 * share);
    w->normal[w->n++] = normal;
}

/* A leaf that faces a wall already found, or away from p, starts nothing. */
static bool is_start(const walls *w, const shcd_vec3 x[3], double reach_m) {
    const shcd_vec3 n = shcd_unit(shcd_cross(shcd_sub(x[1], x[0]), shcd_sub(x[2], x[0])));
    return shcd_dot(shcd_sub(w->p, x[0]), n) > 0.0 && largest_cosine(w, n) < BEGINS &&
           squared_distance(w->p, x) < reach_m * reach_m;
}

static void look_into(walls *w, const shcdi_view *view, size_t block) {
    size_t best = SIZE_MAX;
    double nearest = HUGE_VAL;
    for (size_t leaf = block * SHCDI_BLOCK_LEAVES; leaf < (block + 1) * SHCDI_BLOCK_LEAVES;
         leaf++) {
        shcd_vec3 x[3];
        shcdi_view_triangle(view, leaf, x);
        /* from its middle a leaf reaches two thirds of its longest median, below an edge */
        const double edge = shcd_norm(shcd_sub(x[1], x[0]));
        if (is_start(w, x, w->radius_m + edge) && squared_distance(w->p, x) < nearest) {
            nearest = squared_distance(w->p, x);
            best = leaf;
        }
    }
    if (best != SIZE_MAX) {
        shcd_vec3 middle = {0.0, 0.0, 0.0};
        for (int k = 0; k < 3; k++) {
            middle = shcd_add(middle, shcdi_view_corner(view, best, k));
        }
        run_from(w, shcd_unit(middle));
    }
}

/* The side that was at most this far away in the last tick goes on with its memory. */
static void settle(const walls *w, const shcdi_pursuit *u, shcdi_contact *contact) {
    shcdi_side last[SHCDI_SIDES_MAX];
    bool is_taken[SHCDI_SIDES_MAX] = {false};
    for (size_t i = 0; i < SHCDI_SIDES_MAX; i++) {
        last[i] = contact->side[i];
        contact->side[i].is_touching = 0;
    }
    for (size_t k = 0; k + 1 < w->n; k++) {
        size_t slot = SHCDI_SIDES_MAX;
        for (size_t i = 0; i < SHCDI_SIDES_MAX && slot == SHCDI_SIDES_MAX; i++) {
            const bool continues =
                last[i].is_touching && !is_taken[i] &&
                shcd_norm(shcd_sub(w->side[k].foot_m, last[i].foot_m)) <= u->reach_m &&
                shcd_dot(w->side[k].normal, last[i].normal) >= SHCDI_TURN_COSINE;
            slot = continues ? i : slot;
        }
        const bool is_new = slot == SHCDI_SIDES_MAX;
        for (size_t i = 0; i < SHCDI_SIDES_MAX && slot == SHCDI_SIDES_MAX; i++) {
            slot = !is_taken[i] && !last[i].is_touching ? i : slot;
        }
        for (size_t i = 0; i < SHCDI_SIDES_MAX && slot == SHCDI_SIDES_MAX; i++) {
            slot = !is_taken[i] ? i : slot;
        }
        is_taken[slot] = true;
        contact->side[slot] = w->side[k];
        contact->side[slot].is_touching = 1;
        contact->side[slot].is_new = is_new;
    }
}

void shcdi_sides_update(const shcdi_body *body, const shcdi_tool *tool, const shcdi_pursuit *u,
                        shcdi_contact *contact, shcdi_gap *out) {
    walls w = {.body = body, .p = u->p, .radius_m = tool->radius_m, .n = 1, .out = out};
    w.normal[0] = out->normal;
    /* degree 1 is convex; a centre that is inside keeps its proxy alone */
    if (contact->is_touching && tool->radius_m > 0.0 && out->gap_m > -tool->radius_m &&
        body->n_harmonics > 4) {
        shcdi_view view;
        shcdi_view_of(body->model, out->shape, &view);
        const size_t n_blocks = shcdi_view_block_count(&view);
        for (size_t b = 0; b < n_blocks && w.n_runs < RUNS_MAX && w.n <= SHCDI_SIDES_MAX; b++) {
            shcd_vec3 centre;
            const double reach = shcdi_view_block_ball(&view, b, &centre) + w.radius_m;
            const shcd_vec3 way = shcd_sub(w.p, centre);
            if (shcd_dot(way, way) < reach * reach) {
                look_into(&w, &view, b);
            }
        }
    }
    settle(&w, u, contact);
}
