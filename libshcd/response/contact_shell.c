/* SPDX-License-Identifier: BSD-3-Clause */
/* The contacts of a point shell with one body.
 *
 * The tree of points (shell_tree.c) is visited coarse first. With T >= 0 an upper bound of the gap,
 * or 0 once a point is known to be inside, a point whose signed distance is proven to be at least
 * T matters neither to the force nor to the gap, and a subtree goes with its root if that has
 * reach_m to spare. What proves it, cheapest first:
 *  - the point's own last answer, less the way that the tool has gone since: signed distance is
 *    1-Lipschitz. The way is a running sum over ticks, the same for all points, so that a bound
 *    that is kept as (bound + way then) needs no upkeep;
 *  - its parent's bound less the distance between the two;
 *  - in contact, for a point without others below it, the distance map: where it proves the side,
 *    outside is outside, and no distance is needed;
 *  - the certified query. The fast tier would be cheaper, but its lower bounds, looser by the
 *    deviation of a leaf, let so many more points through that it costs more in the end.
 * A point that was inside in the last tick keeps a proxy, as a point tool does (contact.c).
 *
 * The tick's caps end the visit. A contact whose children were left stands for them, with all that
 * is below them; a contact that was left is let go. What is left is counted.
 *
 * Limits: a point has no memory of its foot while it is outside, so one that gets past the medial
 * axis within the tick in which it enters is felt on the far side. */
#include "response/accuracy.h"
#include "response/proxy.h"

#include "model/distance_map.h"
#include "model/model.h"

#include <string.h>

/* Most points that wait at a time, so also about the most that are visited. */
#define QUEUE_MAX 4096

_Static_assert(SHCD_SHELL_POINTS_MAX <= UINT16_MAX + 1, "a point waits as 16 bits, for the stack");

/* Evaluations and bounds for each body and tick, where the tool states none: this many times those
 * of other tools. A contact that is followed takes two or three evaluations. */
#define EVALUATIONS_FACTOR 4.0
#define PATCHES_MAX 4e9

#define ROUNDING (16.0 * 0x1p-53)

/* Rounding of an evaluated S as a share of the diagonal: 1e-13 is the promise of the harmonics. */
#define EVALUATION_SHARE 1e-12

/* Beyond this way [m] the sums of bound and way would lose digits: all bounds are forgotten. */
#define WAY_MAX 1e6

/* Head of the state; key_m[n_points], slot_of[n_points, even], slots[n_slots] follow. */
typedef struct shell_state {
    shcd_pose ball;
    double way_m;     /* gone since the keys are valid */
    double nearest_m; /* upper bound of the gap in the last tick */
    double still_s;
    double surface_way_m; /* of the body by then */
    uint32_t is_known;    /* 0: all of this is void */
    uint32_t n_contacts;
    uint32_t stamp;
    uint32_t reserved0;
} shell_state;

_Static_assert(sizeof(shell_state) % 8 == 0 && sizeof(shcdi_slot) % 8 == 0,
               "arrays follow each other without gaps");

static size_t even(size_t n) {
    return (n + 1) / 2 * 2;
}

size_t shcdi_shell_state_bytes(const shcdi_shell *shell) {
    return sizeof(shell_state) + shell->n_points * sizeof(double) +
           even(shell->n_points) * sizeof(uint32_t) + shell->n_slots * sizeof(shcdi_slot);
}

/* A visit. */
typedef struct hunt {
    const shcdi_body *body;
    const shcdi_shell *shell;
    shell_state *state;
    double *key_m;     /* proven lower bound of signed distance, plus the way then */
    uint32_t *slot_of; /* contact of a point, plus 1; 0: none */
    shcdi_slot *slot;
    unsigned char *effects;
    shcd_pose pose;
    double dt_s;
    double surface_motion_m; /* of the body's surface since the last visit, at most */
    double gap_m;            /* upper bound, of the last tick or of the nearest visited point */
    double lower_m;          /* of all points not visited, proven */
    bool was_touching;       /* the shell was in contact in the last tick */
    bool has_nearest;        /* gap_m is a visited point's */
    shcd_query_options options;
    shcdi_gap *out;
} hunt;

static void lay_out(hunt *h, const shcdi_shell *shell, unsigned char *memory) {
    h->shell = shell;
    h->state = (shell_state *)(void *)memory;
    h->key_m = (double *)(void *)(h->state + 1);
    h->slot_of = (uint32_t *)(void *)(h->key_m + shell->n_points);
    h->slot = (shcdi_slot *)(void *)(h->slot_of + even(shell->n_points));
    h->effects = memory + shell->body_bytes;
}

shcdi_slot *shcdi_shell_contacts(const shcdi_shell *shell, unsigned char *memory, uint32_t *count) {
    hunt h;
    lay_out(&h, shell, memory);
    *count = h.state->n_contacts;
    return h.slot;
}

void shcdi_shell_release(const shcdi_shell *shell, unsigned char *memory) {
    hunt h;
    lay_out(&h, shell, memory);
    for (uint32_t s = 0; s < h.state->n_contacts; s++) {
        h.slot_of[h.slot[s].point] = 0;
    }
    h.state->n_contacts = 0;
}

/* ---- contacts ------------------------------------------------------------------------------- */

/* The last contact takes the place of the one that ends: they stay dense. */
static void end_contact(hunt *h, uint32_t s) {
    const uint32_t last = --h->state->n_contacts;
    const size_t bytes = h->body->memory_bytes;
    h->slot_of[h->slot[s].point] = 0;
    if (s != last) {
        h->slot[s] = h->slot[last];
        h->slot_of[h->slot[s].point] = s + 1;
        memcpy(h->effects + s * bytes, h->effects + last * bytes, bytes);
    }
}

static void set_contact(hunt *h, uint32_t v, shcd_vec3 p, const shcd_proximity *found) {
    const bool is_new = h->slot_of[v] == 0;
    if (is_new) {
        h->slot_of[v] = ++h->state->n_contacts;
    }
    shcdi_slot *slot = &h->slot[h->slot_of[v] - 1];
    slot->proxy.tool_m = p;
    slot->proxy.foot_m = found->point_m;
    slot->proxy.normal = shcdi_normal_at(found, p);
    slot->proxy.parameter = found->parameter;
    slot->depth_m = -found->distance_m;
    slot->point = v;
    slot->weight = 1;
    slot->stamp = h->state->stamp;
    slot->is_new = is_new;
}

/* ---- one point ------------------------------------------------------------------------------ */

/* Proven lower bound of a point's signed distance, from its last query. */
static double known_lower(const hunt *h, uint32_t v) {
    const double way = h->state->way_m;
    return h->key_m[v] - way - ROUNDING * (fabs(h->key_m[v]) + way);
}

/* Below this bound a point has to be looked at. */
static double threshold(const hunt *h) {
    return shcdi_max(h->gap_m, 0.0);
}

/* Whether the distance map proves that p is outside, by the parity of the crossings beyond it: each
 * lies within the bound of its looked-up radius, in a cell in which their number is proven. */
static bool is_outside(const shcd_model *model, shcd_vec3 p) {
    const shcd_vec3 away = shcd_sub(p, model->map.centre);
    const double rho = shcd_norm(away);
    shcdi_map_ray ray;
    int n_beyond = 0;
    if (!model->info.is_embedded || !(rho > 0.0)) {
        return false;
    }
    shcdi_map_look_up(&model->map, away, 0, &ray);
    if (ray.count < 0) {
        return false;
    }
    const double bound = shcdi_map_bound_at(&model->map, &ray.at, 0) + 1e-14 * rho;
    for (int i = 0; i < ray.count; i++) {
        if (!(fabs(ray.radius[i] - rho) > bound)) {
            return false;
        }
        n_beyond += ray.radius[i] > rho;
    }
    return bound < HUGE_VAL && n_beyond % 2 == 0;
}

static void note_nearest(hunt *h, shcd_vec3 p, const shcd_proximity *found) {
    if (h->has_nearest && found->distance_m >= h->gap_m) {
        return;
    }
    h->has_nearest = true;
    h->gap_m = found->distance_m;
    h->out->foot_m = found->point_m;
    h->out->normal = shcdi_normal_at(found, p);
}

/* @return whether the point's proxy still holds it */
static bool keep_contact(hunt *h, uint32_t v, shcd_vec3 p, double *lower_m) {
    const shcdi_pursuit u =
        shcdi_pursue(h->body, &h->slot[h->slot_of[v] - 1].proxy, p, h->surface_motion_m, h->dt_s);
    shcd_proximity found;
    if (!shcdi_keep_proxy(&u, &found, h->out)) {
        end_contact(h, h->slot_of[v] - 1);
        return false;
    }
    set_contact(h, v, p, &found);
    note_nearest(h, p, &found);
    /* the foot is a point of the surface, so no farther than the nearest one */
    *lower_m = -shcd_norm(shcd_sub(p, found.point_m)) * (1.0 + ROUNDING) - ROUNDING * shcd_norm(p) -
               EVALUATION_SHARE * h->body->diagonal_m;
    *lower_m = shcdi_max(*lower_m, known_lower(h, v));
    h->key_m[v] = *lower_m + h->state->way_m;
    return true;
}

static uint32_t what_is_left(uint32_t cap, uint32_t spent) {
    return cap > spent ? cap - spent : 1u; /* 0 would mean the default */
}

/* The point's contact, if any. @return a proven lower bound of its signed distance */
static double visit(hunt *h, uint32_t v, double lower_m) {
    const shcd_vec3 p = shcd_transform(h->pose, h->shell->point[v]);
    shcd_proximity found;
    h->out->n_points_visited++;
    if (h->slot_of[v] != 0 && keep_contact(h, v, p, &lower_m)) {
        return lower_m;
    }
    /* the map is that of the rest shape */
    if (h->out->shape == NULL && (h->was_touching || h->gap_m < 0.0) && h->shell->n_below[v] == 1 &&
        is_outside(h->body->model, p)) {
        return shcdi_max(lower_m, 0.0);
    }
    shcd_query_options rest = h->options;
    rest.evaluations_max = what_is_left(h->options.evaluations_max, h->out->n_evaluations);
    rest.patches_max = what_is_left(h->options.patches_max, h->out->n_patches);
    if (shcdi_closest_now(h->body, h->out->shape, p, &rest, &found) != SHCD_OK) {
        return lower_m; /* cannot happen for a finite point */
    }
    shcdi_count(h->out, &found);
    h->out->flags |= shcdi_output_flags(found.flags);
    found.distance_m = shcdi_sure_distance(h->body, found.flags, found.distance_m);
    lower_m = shcdi_max(lower_m, found.lower_m);
    h->key_m[v] = lower_m + h->state->way_m;
    note_nearest(h, p, &found);
    if (found.distance_m < 0.0) {
        set_contact(h, v, p, &found);
    }
    return lower_m;
}

/* ---- the visit ------------------------------------------------------------------------------ */

/* v and all below it stay unvisited: a touching parent stands for them. */
static void leave(hunt *h, uint32_t v) {
    const uint32_t parent = h->slot_of[h->shell->parent[v]];
    h->out->n_points_left += h->shell->n_below[v];
    h->out->flags |= SHCD_TOOL_OUTPUT_DEGRADED;
    if (v > 0 && parent != 0 && h->slot[parent - 1].stamp == h->state->stamp) {
        h->slot[parent - 1].weight += h->shell->n_below[v];
    }
}

static bool is_at_cap(const hunt *h) {
    return h->out->n_evaluations >= h->options.evaluations_max ||
           h->out->n_patches >= h->options.patches_max;
}

/* Whether there is no room for a contact of v. */
static bool is_full(const hunt *h, uint32_t v) {
    return h->state->n_contacts == h->shell->n_slots && h->slot_of[v] == 0;
}

/* Takes one point from the queue and its children into it. */
static uint32_t take(hunt *h, uint32_t v, uint16_t *queue, uint32_t n_queued) {
    const shcdi_shell *shell = h->shell;
    double lower_m = known_lower(h, v);
    if (lower_m < threshold(h) || h->slot_of[v] != 0) {
        lower_m = visit(h, v, lower_m);
    }
    h->lower_m = shcdi_min(h->lower_m, lower_m);
    for (uint32_t c = shell->first_child[v]; c < shell->first_child[v + 1]; c++) {
        const uint32_t child = shell->child[c];
        const double from_parent = lower_m - shell->link_m[child] * (1.0 + ROUNDING);
        if (from_parent > known_lower(h, child)) {
            h->key_m[child] = from_parent + h->state->way_m;
        }
        const double below = known_lower(h, child) - shell->reach_m[child];
        if (below >= threshold(h) && h->slot_of[child] == 0) {
            h->lower_m = shcdi_min(h->lower_m, below);
        } else if (n_queued < QUEUE_MAX) {
            queue[n_queued++] = (uint16_t)child;
        } else {
            leave(h, child);
        }
    }
    return n_queued;
}

/* Contacts not seen: below a point that was left, which stands for them; or in a subtree proven
 * clear, where a point that has gone through the body still hangs on the side where it went in. */
static void end_stale(hunt *h) {
    for (uint32_t s = h->state->n_contacts; s-- > 0;) {
        const uint32_t v = h->slot[s].point;
        double lower_m;
        if (h->slot[s].stamp == h->state->stamp) {
            continue;
        }
        if (h->out->n_points_left > 0 || is_at_cap(h)) {
            end_contact(h, s);
        } else {
            h->out->n_points_visited++;
            (void)keep_contact(h, v, shcd_transform(h->pose, h->shell->point[v]), &lower_m);
        }
    }
}

static void visit_all(hunt *h) {
    uint16_t queue[QUEUE_MAX];
    uint32_t n_queued = 1;
    queue[0] = 0;
    for (uint32_t head = 0; head < n_queued; head++) {
        if (is_at_cap(h) || is_full(h, queue[head])) {
            leave(h, queue[head]);
        } else {
            n_queued = take(h, queue[head], queue, n_queued);
        }
    }
    end_stale(h);
}

/* ---- the tick ------------------------------------------------------------------------------- */

/* Those of a tick, not of a query: the bounds go with the evaluations. */
static void set_caps(const shcdi_body *body, const shcdi_tool *tool, shcd_query_options *options) {
    shcd_query_options single = *options;
    shcdi_tool usual = {.evaluations_max = 0};
    shcdi_set_caps(body, &usual, &single);
    const double factor = tool->evaluations_max > 0
                              ? (double)tool->evaluations_max / (double)single.evaluations_max
                              : EVALUATIONS_FACTOR;
    const double patches = shcdi_max(1.0, factor) * (double)single.patches_max;
    options->evaluations_max = tool->evaluations_max > 0
                                   ? tool->evaluations_max
                                   : single.evaluations_max * (uint32_t)EVALUATIONS_FACTOR;
    options->patches_max = patches < PATCHES_MAX ? (uint32_t)patches : (uint32_t)PATCHES_MAX;
}

static void forget(hunt *h, const shcd_pose *ball) {
    shcdi_shell_release(h->shell, (unsigned char *)h->state);
    for (uint32_t v = 0; v < h->shell->n_points; v++) {
        h->key_m[v] = -HUGE_VAL;
    }
    h->state->ball = *ball;
    h->state->way_m = 0.0;
    h->state->nearest_m = HUGE_VAL;
    h->state->still_s = 0.0;
    h->state->surface_way_m = shcdi_surface_way(h->out->shape);
    h->state->is_known = 1;
}

static void begin(hunt *h, const shcdi_tool *tool, const shcd_pose *ball) {
    shell_state *state = h->state;
    if (!state->is_known || state->way_m > WAY_MAX) {
        forget(h, ball);
    }
    const double surface_way = shcdi_surface_way(h->out->shape);
    h->surface_motion_m = surface_way - state->surface_way_m;
    const double motion = shcdi_motion_bound(tool, &state->ball, ball) + h->surface_motion_m;
    const double centre = shcd_norm(shcd_sub(ball->position_m, state->ball.position_m));
    if (shcdi_has_jumped(centre, h->dt_s, &state->still_s)) {
        shcdi_shell_release(h->shell, (unsigned char *)state);
    }
    state->ball = *ball;
    state->surface_way_m = surface_way;
    state->way_m += motion + 0x1p-52 * state->way_m;
    state->stamp++;
    h->was_touching = state->n_contacts > 0;
    h->gap_m = state->nearest_m + motion;
}

void shcdi_shell_update(const shcdi_body *body, const shcdi_tool *tool, shcd_pose tool_in_body,
                        double dt_s, shcdi_contact *contact, unsigned char *memory,
                        shcdi_gap *out) {
    const shcd_query_options defaults = SHCD_QUERY_OPTIONS_INIT;
    const shcd_pose ball = shcdi_ball_pose(tool, tool_in_body);
    hunt h;
    shcdi_gap_begin(out);
    lay_out(&h, &tool->shell, memory);
    h.body = body;
    h.pose = tool_in_body;
    h.dt_s = dt_s;
    h.lower_m = HUGE_VAL;
    h.has_nearest = false;
    h.options = defaults;
    h.out = out;
    set_caps(body, tool, &h.options);
    shcdi_limit(&body->accuracy, out->allowance_ns, &h.options);
    begin(&h, tool, &ball);
    visit_all(&h);
    h.state->nearest_m = h.gap_m;
    if (h.state->n_contacts == 0 && !h.has_nearest) {
        h.gap_m = shcdi_max(h.gap_m, 0.0); /* an upper bound from the last tick */
    }
    out->gap_m = h.gap_m;
    contact->ball = ball;
    contact->surface_way_m = shcdi_surface_way(out->shape);
    contact->is_known = 1;
    contact->is_touching = h.state->n_contacts > 0;
    contact->lower_m = (out->n_points_left == 0 ? h.lower_m : -HUGE_VAL) + tool->ball_radius_m;
}
