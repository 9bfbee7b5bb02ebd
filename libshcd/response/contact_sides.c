/* SPDX-License-Identifier: BSD-3-Clause */
/* The walls that a ball touches: in a groove or a corner, up to two beside the deepest contact.
 *
 * A ball whose centre p is outside touches the surface wherever a foot, a local minimum of |S - p|,
 * is nearer than its radius. Feet that are known go first: that of the deepest contact, and those
 * of the last tick, followed by Newton. A wall that is there is therefore found for as long as it
 * is there. Then new ones are looked for: of every block of leaves the nearest one that may hold a
 * foot is the start of a run, nearest first, a capped number of them.
 *
 * A foot can also end while the ball is in it: where p passes a focal point of a hollow, the foot
 * merges with a saddle and is gone, and there a foot begins the other way round; and a foot that
 * the cap has left out may be found late. Then the wall does not end or begin at once, but fades:
 * out, in the plane that it had, until it has no part in the force; in, from the depth at which it
 * begins to have one. A fade goes by FADE_SPEED and by what the tool itself has moved, so that it
 * changes the force by no more than the spring does over such a way.
 *
 * A ball whose centre is inside has one contact, its proxy: from within, all walls push the same
 * way in or none is known to be the one it came through. */
#include "response/proxy.h"
#include "response/walls.h"

#include "query/view.h"

#define RUNS_MAX 6
#define STARTS_MAX 16

/* Feet that are nearer to each other than this share of the diagonal are one: Newton's stationarity
 * is far better, and the finest detail of a surface far larger. */
#define SAME_FOOT 1e-6

/* Speed of a fade [m/s], and the time that the fade of a deep wall takes at most [s]. */
#define FADE_SPEED 0.05
#define FADE_TIME_S 0.1

/* A leaf may hold a foot of p if p lies above it, but for two of its edges and 14 degrees by which
 * its surface may be turned against its triangle. */
#define LEAF_EDGES 2.0
#define LEAF_TURN 0.25

/* Where a run may start. */
typedef struct start {
    double distance2_m2;
    double edge_m;
    shcd_vec3 x, normal, parameter;
} start;

/* Walls found so far in this tick. */
typedef struct walls {
    const shcdi_body *body;
    shcd_vec3 p;
    double radius_m, dt_s;
    const shcdi_pursuit *pursuit;
    shcdi_wall last[SHCDI_WALLS_MAX]; /* of the last tick; not touching: ended, or gone on */
    shcdi_wall *now;                  /* of this one, in the slots of their effects' memory */
    shcdi_wall found[RUNS_MAX + 1];   /* new ones; the deepest contact, if new, is the first */
    size_t n_found;
    int n_runs;
    bool is_deepest_new, was_touching;
    start starts[STARTS_MAX]; /* nearest first */
    size_t n_starts;
    shcdi_gap *out;
} walls;

/* ---- known feet ----------------------------------------------------------------------------- */

static bool continues(const walls *w, const shcdi_wall *last, const shcdi_wall *now) {
    return shcd_norm(shcd_sub(now->foot_m, last->foot_m)) <= w->pursuit->reach_m &&
           shcd_dot(now->normal, last->normal) >= SHCDI_TURN_COSINE;
}

static bool is_known(const walls *w, const shcdi_wall *wall) {
    const double apart_m = SAME_FOOT * w->body->diagonal_m;
    bool is = false;
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        is |=
            w->now[i].is_touching && shcd_norm(shcd_sub(w->now[i].foot_m, wall->foot_m)) <= apart_m;
    }
    for (size_t i = 0; i < w->n_found; i++) {
        is |= shcd_norm(shcd_sub(w->found[i].foot_m, wall->foot_m)) <= apart_m;
    }
    return is;
}

/* @return whether a run has found a wall that was not known */
static bool run_from(walls *w, shcd_vec3 parameter, shcdi_wall *wall) {
    const shcdi_wall none = {.is_touching = 1};
    shcd_proximity found;
    if (shcdi_track_now(w->body, w->out->shape, w->p, parameter, &found) != SHCD_OK) {
        return false;
    }
    shcdi_count(w->out, &found);
    *wall = none;
    wall->foot_m = found.point_m;
    wall->normal = shcdi_normal_at(&found, w->p);
    wall->parameter = found.parameter;
    wall->depth_m = w->radius_m - found.distance_m;
    return (found.flags & SHCD_PROXIMITY_NOT_STATIONARY) == 0 && found.distance_m > 0.0 &&
           wall->depth_m > 0.0 && !is_known(w, wall);
}

/* Puts a wall of the last tick into its slot, where it is now. What it was short of then it catches
 * up with later. */
static void go_on(walls *w, size_t slot, const shcdi_wall *wall) {
    w->now[slot] = *wall;
    w->now[slot].short_m = w->last[slot].short_m;
    w->now[slot].share = w->last[slot].share;
    w->last[slot].is_touching = 0;
}

static void place_deepest(walls *w, const shcdi_wall *deepest, shcdi_contact *contact) {
    size_t slot = SHCDI_WALLS_MAX;
    double nearest = HUGE_VAL;
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        const double apart = shcd_norm(shcd_sub(deepest->foot_m, w->last[i].foot_m));
        if (w->last[i].is_touching && apart < nearest && continues(w, &w->last[i], deepest)) {
            slot = i;
            nearest = apart;
        }
    }
    w->is_deepest_new = slot == SHCDI_WALLS_MAX;
    if (w->is_deepest_new) {
        w->found[w->n_found++] = *deepest;
    } else {
        contact->deepest = (uint32_t)slot;
        go_on(w, slot, deepest);
    }
}

static void follow_last(walls *w) {
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        shcdi_wall wall;
        if (w->last[i].is_touching && run_from(w, w->last[i].parameter, &wall) &&
            continues(w, &w->last[i], &wall)) {
            go_on(w, i, &wall);
        }
    }
}

/* ---- new feet ------------------------------------------------------------------------------- */

/* A run from near a known foot would end in it. */
static bool leads_to(const start *s, const shcdi_wall *wall) {
    return shcd_norm(shcd_sub(s->x, wall->foot_m)) <= LEAF_EDGES * s->edge_m &&
           shcd_dot(s->normal, wall->normal) >= SHCDI_TURN_COSINE;
}

static bool is_covered(const walls *w, const start *s) {
    bool is = false;
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        is |= w->now[i].is_touching && leads_to(s, &w->now[i]);
    }
    for (size_t i = 0; i < w->n_found; i++) {
        is |= leads_to(s, &w->found[i]);
    }
    return is;
}

/* @return whether a leaf may hold a foot that is not known */
static bool is_start(const walls *w, const shcdi_view *view, size_t leaf, start *s) {
    shcd_vec3 x[3];
    shcdi_view_triangle(view, leaf, x);
    const shcd_vec3 a = shcd_sub(x[1], x[0]), b = shcd_sub(x[2], x[0]);
    s->x = shcd_scale(1.0 / 3.0, shcd_add(x[0], shcd_add(x[1], x[2])));
    s->normal = shcd_unit(shcd_cross(a, b));
    s->edge_m = shcdi_max(shcd_norm(a), shcd_norm(b));
    const shcd_vec3 way = shcd_sub(w->p, s->x);
    const double up = shcd_dot(way, s->normal);
    s->distance2_m2 = shcd_dot(way, way);
    /* from its middle a leaf reaches two thirds of its longest median, below an edge */
    const double reach = w->radius_m + s->edge_m;
    const double off = LEAF_EDGES * s->edge_m + LEAF_TURN * up;
    return up > 0.0 && s->distance2_m2 < reach * reach && s->distance2_m2 - up * up < off * off &&
           !is_covered(w, s);
}

static void note_start(walls *w, const start *s) {
    size_t at = w->n_starts < STARTS_MAX ? w->n_starts++ : STARTS_MAX;
    while (at > 0 && s->distance2_m2 < w->starts[at - 1].distance2_m2) {
        if (at < STARTS_MAX) {
            w->starts[at] = w->starts[at - 1];
        }
        at--;
    }
    if (at < STARTS_MAX) {
        w->starts[at] = *s;
    }
}

static void look_into(walls *w, const shcdi_view *view, size_t block) {
    size_t best = SIZE_MAX;
    start nearest = {.distance2_m2 = HUGE_VAL};
    for (size_t leaf = block * SHCDI_BLOCK_LEAVES; leaf < (block + 1) * SHCDI_BLOCK_LEAVES;
         leaf++) {
        start s;
        if (is_start(w, view, leaf, &s) && s.distance2_m2 < nearest.distance2_m2) {
            nearest = s;
            best = leaf;
        }
    }
    if (best != SIZE_MAX) {
        shcd_vec3 middle = {0.0, 0.0, 0.0};
        for (int k = 0; k < 3; k++) {
            middle = shcd_add(middle, shcdi_view_corner(view, best, k));
        }
        nearest.parameter = shcd_unit(middle);
        note_start(w, &nearest);
    }
}

static void look_for_new(walls *w) {
    shcdi_view view;
    shcdi_view_of(w->body->model, w->out->shape, &view);
    const size_t n_blocks = shcdi_view_block_count(&view);
    for (size_t b = 0; b < n_blocks; b++) {
        shcd_vec3 centre;
        const double reach = shcdi_view_block_ball(&view, b, &centre) + w->radius_m;
        const shcd_vec3 way = shcd_sub(w->p, centre);
        if (shcd_dot(way, way) < reach * reach) {
            look_into(w, &view, b);
        }
    }
    for (size_t i = 0; i < w->n_starts && w->n_runs < RUNS_MAX; i++) {
        shcdi_wall wall;
        if (is_covered(w, &w->starts[i])) {
            continue;
        }
        w->n_runs++;
        if (run_from(w, w->starts[i].parameter, &wall)) {
            w->found[w->n_found++] = wall;
        }
    }
}

/* ---- beginning and ending ------------------------------------------------------------------- */

/* The depth up to which the others leave a wall without force, and the sine of its angle to the
 * nearest of them, by which a change of its depth beyond that turns the force. */
static double idle_depth(const walls *w, size_t slot, double *sine) {
    double m[SHCDI_WALLS_MAX], sum = 0.0, most = 0.0;
    const unsigned others = shcdi_walls_touched(w->now) & ~(1u << slot);
    const shcdi_wall_system q = shcdi_walls_couple(w->now, others);
    (void)shcdi_walls_solve(&q, m);
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        if ((others >> i & 1u) != 0) {
            double rate;
            const double c = shcdi_wall_coupling(&w->now[i], &w->now[slot], &rate);
            sum += c * m[i];
            most = shcdi_max(most, c);
        }
    }
    *sine = sqrt(shcdi_max(0.0, 1.0 - most * most));
    return sum;
}

static double step_of(const walls *w, double depth_m) {
    return w->pursuit->motion_m + shcdi_max(FADE_SPEED, depth_m / FADE_TIME_S) * w->dt_s;
}

/* The depth of a wall that fades in is less by what it was short of in the last tick. */
static void fall_short(walls *w, size_t slot) {
    shcdi_wall *wall = &w->now[slot];
    wall->short_m = shcdi_min(wall->short_m, wall->depth_m);
    wall->depth_m -= wall->short_m;
}

static void catch_up(walls *w, size_t slot) {
    shcdi_wall *wall = &w->now[slot];
    double sine = 0.0;
    if (wall->short_m > 0.0) {
        (void)idle_depth(w, slot, &sine);
        const double whole_m = wall->depth_m + wall->short_m;
        wall->short_m = shcdi_max(0.0, wall->short_m - sine * step_of(w, whole_m));
        wall->depth_m = whole_m - wall->short_m;
    }
}

/* A wall of the last tick that has not been found again stays, for now, where it was, as deep as
 * its plane allows. It is no newer than it was. */
static void keep_last(walls *w, size_t slot) {
    const shcdi_wall *last = &w->last[slot];
    const double in_plane_m = w->radius_m - shcd_dot(shcd_sub(w->p, last->foot_m), last->normal);
    w->now[slot] = *last;
    w->now[slot].is_new = 0;
    w->now[slot].depth_m = shcdi_min(last->depth_m, in_plane_m);
    w->now[slot].short_m = shcdi_max(0.0, in_plane_m - w->now[slot].depth_m);
}

static void fade_out(walls *w, size_t slot) {
    shcdi_wall *wall = &w->now[slot];
    const double in_plane_m = wall->depth_m + wall->short_m, last_m = w->last[slot].depth_m;
    double sine;
    const double idle_m = idle_depth(w, slot, &sine);
    wall->depth_m = shcdi_min(last_m - sine * step_of(w, last_m), in_plane_m);
    wall->short_m = shcdi_max(0.0, in_plane_m - wall->depth_m);
    wall->is_touching = wall->depth_m > idle_m;
}

/* Each fade goes by what the other walls leave it, so that all of them are where they were left in
 * the last tick before the first one moves on. */
static void fade(walls *w) {
    bool is_ending[SHCDI_WALLS_MAX];
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        is_ending[i] = !w->now[i].is_touching && w->last[i].is_touching;
        if (is_ending[i]) {
            keep_last(w, i);
        } else if (w->now[i].is_touching) {
            fall_short(w, i);
        }
    }
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        if (is_ending[i]) {
            fade_out(w, i);
        } else if (w->now[i].is_touching) {
            catch_up(w, i);
        }
    }
}

/* For the deepest contact some slot is found: that of the wall with the least force. */
static size_t slot_for(const walls *w, bool is_deepest) {
    size_t slot = SHCDI_WALLS_MAX;
    for (size_t i = SHCDI_WALLS_MAX; i-- > 0;) {
        slot = !w->now[i].is_touching ? i : slot;
    }
    for (size_t i = 0; i < SHCDI_WALLS_MAX && slot == SHCDI_WALLS_MAX; i++) {
        slot = w->now[i].share == 0.0 && !w->now[i].is_new ? i : slot;
    }
    for (size_t i = 0; i < SHCDI_WALLS_MAX && slot == SHCDI_WALLS_MAX && is_deepest; i++) {
        bool is_least = true;
        for (size_t j = 0; j < SHCDI_WALLS_MAX; j++) {
            is_least &= w->now[i].share <= w->now[j].share;
        }
        slot = is_least ? i : slot;
    }
    return slot;
}

static void begin(walls *w, shcdi_contact *contact) {
    for (size_t i = 0; i < w->n_found; i++) {
        const bool is_deepest = i == 0 && w->is_deepest_new;
        const size_t slot = slot_for(w, is_deepest);
        double sine;
        if (slot == SHCDI_WALLS_MAX) {
            continue;
        }
        w->now[slot] = w->found[i];
        w->now[slot].is_new = 1;
        const double idle_m = idle_depth(w, slot, &sine);
        if (w->was_touching) { /* else there was no force that could jump */
            w->now[slot].short_m = shcdi_max(0.0, w->found[i].depth_m - idle_m);
            fall_short(w, slot);
            catch_up(w, slot);
        }
        if (is_deepest) {
            contact->deepest = (uint32_t)slot;
        }
    }
}

void shcdi_sides_release(shcdi_contact *contact) {
    const shcdi_wall none = {.is_touching = 0};
    const shcdi_account closed = {.is_open = 0};
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        contact->wall[i] = none;
    }
    contact->yielded = 0.0;
    contact->account = closed;
}

static void update(walls *w, const shcdi_wall *deepest, shcdi_contact *contact) {
    /* degree 1 is convex; a centre that is inside keeps its proxy alone */
    const bool has_sides = w->out->gap_m > -w->radius_m && w->body->n_harmonics > 4;
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        w->last[i] = contact->wall[i];
        w->was_touching |= w->last[i].is_touching != 0;
        w->now[i].is_touching = 0;
    }
    place_deepest(w, deepest, contact);
    if (has_sides) {
        follow_last(w);
        look_for_new(w);
    }
    fade(w);
    begin(w, contact);
    for (size_t i = 0; i < SHCDI_WALLS_MAX; i++) {
        /* what a wall without force remembers is of the past; soft bodies press all their walls */
        w->now[i].is_new |= w->now[i].share == 0.0 && w->body->soft == NULL;
    }
    shcdi_walls_share(contact);
    if (w->body->soft == NULL) { /* else when its forces are known: soft_tilt.c */
        shcdi_walls_tilt(w->body->model, w->p, contact);
        shcdi_walls_yield(w->dt_s, contact);
    }
}

void shcdi_sides_update(const shcdi_body *body, const shcdi_tool *tool, const shcdi_pursuit *u,
                        double dt_s, shcdi_contact *contact, shcdi_gap *out) {
    const shcdi_wall deepest = {.foot_m = out->foot_m,
                                .normal = out->normal,
                                .parameter = contact->proxy.parameter,
                                .depth_m = -out->gap_m,
                                .is_touching = 1};
    walls w = {.body = body,
               .p = u->p,
               .radius_m = tool->radius_m,
               .dt_s = dt_s,
               .pursuit = u,
               .now = contact->wall,
               .out = out};
    if (!contact->is_touching || !(tool->radius_m > 0.0)) {
        shcdi_sides_release(contact);
    } else {
        update(&w, &deepest, contact);
    }
}
