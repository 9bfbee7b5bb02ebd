/* SPDX-License-Identifier: BSD-3-Clause */
/* Building a distance map: all crossings at every node, a check by parity, measured errors. */
#include "model/map_cast.h"

#include <string.h>

#define DEFAULT_RESOLUTION 32 /* 4098 nodes */
/* a prime, so that the spiral does not fall into step with a grid */
#define MEASURED_DIRECTIONS 1021
/* Newton's steps for a ray, in the mean of all: 21 to 220 on an organ, livers, a bunny and an
 * Armadillo at degree 15 and 30. A shape made to take long can take 1920 on each; when all are
 * spent, the nodes that are left have no count. */
#define STEPS_PER_RAY 400

typedef struct builder {
    const shcd_model *model;
    const shcd_allocator *allocator;
    shcdi_map *map;
    size_t capacity, odd, even, one;
    int has_last; /* the samples of a pole follow each other and share their crossings */
    shcd_vec3 last;
    size_t last_slot;
    size_t steps_left;
} builder;

static void release(const shcd_allocator *allocator, void *memory) {
    if (memory != NULL) {
        allocator->release(memory, allocator->user);
    }
}

static int reserve(builder *b, size_t more) {
    shcdi_map *map = b->map;
    if (map->n_crossings + more <= b->capacity) {
        return 1;
    }
    const size_t capacity = 2 * b->capacity + more + SHCDI_MAP_CROSSINGS_MAX;
    shcdi_crossing *larger = b->allocator->allocate(capacity * sizeof *larger, b->allocator->user);
    if (larger == NULL) {
        return 0;
    }
    if (map->n_crossings > 0) {
        memcpy(larger, map->crossing, map->n_crossings * sizeof *larger);
    }
    release(b->allocator, map->crossing);
    map->crossing = larger;
    b->capacity = capacity;
    return 1;
}

static int fill_node(void *user, size_t slot, shcd_vec3 d) {
    builder *b = user;
    shcdi_map *map = b->map;
    if (b->has_last && d.x == b->last.x && d.y == b->last.y && d.z == b->last.z) {
        map->first[slot] = map->first[b->last_slot];
        map->count[slot] = map->count[b->last_slot];
        return 1;
    }
    b->has_last = 1;
    b->last = d;
    b->last_slot = slot;
    shcdi_hit hits[SHCDI_MAP_CROSSINGS_MAX + 1];
    const int n = shcdi_cast_within(b->model, map->centre, d, &b->steps_left, hits);
    map->first[slot] = (uint32_t)map->n_crossings;
    if (n > SHCDI_MAP_CROSSINGS_MAX) {
        map->count[slot] = SHCDI_MAP_UNSURE;
        return 1;
    }
    map->count[slot] = (uint8_t)n;
    b->odd += n % 2 == 1;
    b->even += n % 2 == 0;
    if (!reserve(b, (size_t)n)) {
        return 0;
    }
    for (int i = 0; i < n; i++) {
        map->crossing[map->n_crossings++] =
            shcdi_map_crossing(d, hits[i].radius, hits[i].normal, hits[i].w);
    }
    return 1;
}

/* From a fixed centre all rays cross a closed surface an odd number of times, or all an even
 * number; a ray that differs has grazed it. */
static int check_parity(void *user, size_t slot, shcd_vec3 d) {
    builder *b = user;
    uint8_t *n = &b->map->count[slot];
    (void)d;
    if (*n != SHCDI_MAP_UNSURE && (*n % 2 == 1) != (b->map->centre_inside != 0)) {
        *n = SHCDI_MAP_UNSURE;
    }
    b->one += *n == 1;
    if (*n != SHCDI_MAP_UNSURE && *n > b->map->crossings_max) {
        b->map->crossings_max = *n;
    }
    return 1;
}

static int count_equal(void *user, const shcdi_cell *cell) {
    shcdi_map *map = user;
    int equal = map->count[cell->slot[0]] != SHCDI_MAP_UNSURE;
    for (int i = 1; i < cell->n; i++) {
        equal = equal && map->count[cell->slot[i]] == map->count[cell->slot[0]];
    }
    map->equal_count_share += equal ? 1.0 : 0.0;
    return 1;
}

/* Errors at directions off the nodes: a golden-angle spiral. */
static void measure_errors(const shcd_model *model, shcdi_map *map) {
    const int with_hermite = map->grid == SHCD_MAP_OCTAHEDRAL;
    const size_t steps = (size_t)STEPS_PER_RAY * MEASURED_DIRECTIONS;
    size_t steps_left = steps;
    double linear2 = 0.0, hermite2 = 0.0;
    for (int i = 0; i < MEASURED_DIRECTIONS; i++) {
        const double z = 1.0 - (2.0 * i + 1.0) / MEASURED_DIRECTIONS, s = sqrt(1.0 - z * z);
        const double phi = 2.39996322972865332 * i;
        const shcd_vec3 d = {s * cos(phi), s * sin(phi), z};
        shcdi_map_ray linear, hermite;
        shcdi_map_look_up(map, d, 0, &linear);
        shcdi_map_look_up(map, d, with_hermite, &hermite);
        if (linear.count < 0) {
            continue;
        }
        shcdi_hit hits[SHCDI_MAP_CROSSINGS_MAX + 1];
        const int n = shcdi_cast_within(model, map->centre, d, &steps_left, hits);
        if (steps_left == 0) {
            break;
        }
        if (n != linear.count) {
            map->n_miscounted++;
            continue;
        }
        for (int k = 0; k < linear.count; k++) {
            const double e = fabs(linear.radius[k] - hits[k].radius);
            const double h = with_hermite ? fabs(hermite.radius[k] - hits[k].radius) : 0.0;
            map->linear_error_m = shcdi_max(map->linear_error_m, e);
            map->hermite_error_m = shcdi_max(map->hermite_error_m, h);
            linear2 += e * e;
            hermite2 += h * h;
            map->n_measured++;
        }
    }
    map->n_steps += steps - steps_left;
    if (map->n_measured > 0) {
        map->linear_rms_m = sqrt(linear2 / (double)map->n_measured);
        map->hermite_rms_m = sqrt(hermite2 / (double)map->n_measured);
    }
}

shcd_status shcdi_map_build(const shcd_model *model, const shcdi_map_settings *settings,
                            const shcd_allocator *allocator, shcdi_map *map) {
    const int grid = settings->grid, n = settings->resolution;
    map->grid = grid;
    map->resolution = n;
    map->centre = settings->centre;
    map->n_slots = shcdi_grid_slots(grid, n);
    map->n_cells = shcdi_grid_cells(grid, n);
    map->first = allocator->allocate(map->n_slots * sizeof *map->first, allocator->user);
    map->count = allocator->allocate(map->n_slots, allocator->user);
    if (map->first == NULL || map->count == NULL) {
        return SHCD_ERR_MEMORY;
    }
    memset(map->first, 0, map->n_slots * sizeof *map->first);
    memset(map->count, SHCDI_MAP_UNSURE, map->n_slots);
    const size_t steps = STEPS_PER_RAY * shcdi_grid_nodes(grid, n);
    builder b = {model, allocator, map, 0, 0, 0, 0, 0, {0.0, 0.0, 0.0}, 0, steps};
    if (!reserve(&b, shcdi_grid_nodes(grid, n)) ||
        !shcdi_grid_visit_nodes(grid, n, fill_node, &b)) {
        return SHCD_ERR_MEMORY;
    }
    map->n_steps = steps - b.steps_left;
    map->centre_inside = b.odd > b.even;
    (void)shcdi_grid_visit_nodes(grid, n, check_parity, &b);
    map->one_crossing_share = (double)b.one / (double)shcdi_grid_nodes(grid, n);
    (void)shcdi_grid_visit_cells(grid, n, count_equal, map);
    map->equal_count_share /= (double)map->n_cells;
    measure_errors(model, map);
    if (map->centre_inside) {
        map->star_margin_m = shcdi_star_margin(model, map->centre);
    }
    return settings->splits >= 0 ? shcdi_map_bound(model, settings->splits, allocator, map)
                                 : SHCD_OK;
}

shcd_status shcdi_map_create(shcd_model *model) {
    /* one split: a second one would take longer than the rest of the model */
    const shcdi_map_settings settings = {SHCD_MAP_OCTAHEDRAL, DEFAULT_RESOLUTION,
                                         model->info.star_centre_m, 1};
    return shcdi_map_build(model, &settings, &model->allocator, &model->map);
}

void shcdi_map_free(shcdi_map *map, const shcd_allocator *allocator) {
    release(allocator, map->reference);
    release(allocator, map->bound);
    release(allocator, map->crossing);
    release(allocator, map->count);
    release(allocator, map->first);
    memset(map, 0, sizeof *map);
}

size_t shcdi_map_bytes(const shcdi_map *map) {
    return map->n_slots * (sizeof *map->first + sizeof *map->count) +
           map->n_crossings * sizeof *map->crossing +
           (map->bound != NULL ? map->n_cells * sizeof *map->bound : 0) +
           (map->reference != NULL ? map->n_slots * sizeof *map->reference : 0);
}
