/* SPDX-License-Identifier: BSD-3-Clause */
#include "deform.h"

#include "shcd/vec.h"

#include <math.h>
#include <stdlib.h>

#define PI 3.14159265358979324

static size_t snapshot_bytes(size_t count) {
    return sizeof(deform_snapshot) + count * sizeof(double);
}

bool deform_create(const daemon_config *config, deform_boxes *boxes) {
    size_t total = 0;
    memset(boxes, 0, sizeof *boxes);
    boxes->n_bodies = shcd_scene_body_count(config->scene);
    for (size_t b = 0; b < boxes->n_bodies; b++) {
        boxes->is_soft[b] = shcd_scene_body_is_soft(config->scene, b) != 0;
        boxes->count[b] = 3 * SHCD_COUNT(shcd_model_degree(config->models[b]));
        total += boxes->is_soft[b] ? MAILBOX_BYTES(snapshot_bytes(boxes->count[b])) : 0;
    }
    boxes->memory = total > 0 ? aligned_alloc(EXCHANGE_LINE, total) : NULL;
    if (total > 0 && boxes->memory == NULL) {
        return false;
    }
    unsigned char *at = boxes->memory;
    for (size_t b = 0; b < boxes->n_bodies; b++) {
        if (boxes->is_soft[b]) {
            mailbox_init(&boxes->box[b], at, snapshot_bytes(boxes->count[b]));
            at += MAILBOX_BYTES(snapshot_bytes(boxes->count[b]));
        }
    }
    return true;
}

void deform_free(deform_boxes *boxes) {
    free(boxes->memory);
    boxes->memory = NULL;
}

/* Node k of n of the Gauss-Legendre rule on [-1, 1], by Newton from Chebyshev's guess. */
static void legendre_node(int n, int k, double *x, double *weight) {
    double z = cos(PI * (k + 0.75) / (n + 0.5)), slope = 1.0;
    for (int iteration = 0; iteration < 20; iteration++) {
        double p = 1.0, before = 0.0;
        for (int l = 1; l <= n; l++) {
            const double next = ((2 * l - 1) * z * p - (l - 1) * before) / l;
            before = p;
            p = next;
        }
        slope = n * (z * p - before) / (z * z - 1.0);
        z -= p / slope;
    }
    *x = z;
    *weight = 2.0 / ((1.0 - z * z) * slope * slope);
}

/* S . (S_1 x S_2) at one parameter: of degree at most 3 L, three times the volume's density. */
static double density(const shcd_model *model, const shcd_shape *shape, shcd_vec3 w) {
    shcd_vec3 s;
    double j[9];
    if (shcd_shape_surface(model, shape, w, &s, NULL, j) != SHCD_OK) {
        return 0.0;
    }
    /* rows are tangential gradients g_k: S_1 x S_2 = sum over pairs of (g_a x g_b) . w */
    const shcd_vec3 gx = {j[0], j[1], j[2]}, gy = {j[3], j[4], j[5]}, gz = {j[6], j[7], j[8]};
    return s.x * shcd_dot(w, shcd_cross(gy, gz)) + s.y * shcd_dot(w, shcd_cross(gz, gx)) +
           s.z * shcd_dot(w, shcd_cross(gx, gy));
}

double deform_volume(const shcd_model *model, shcd_shape *shape, const double *coefficients) {
    /* exact for polynomials of degree 3 L on the sphere */
    const int degree = 3 * shcd_model_degree(model);
    const int n_theta = degree / 2 + 1, n_phi = degree + 1;
    double sum = 0.0;
    if (shcd_shape_set(model, shape, coefficients, SHCD_FOLLOW_INFLATE) != SHCD_OK) {
        return 0.0;
    }
    for (int k = 0; k < n_theta; k++) {
        double z, weight;
        legendre_node(n_theta, k, &z, &weight);
        const double sine = sqrt((1.0 - z) * (1.0 + z));
        for (int i = 0; i < n_phi; i++) {
            const double phi = 2.0 * PI * i / n_phi;
            const shcd_vec3 w = {sine * cos(phi), sine * sin(phi), z};
            sum += weight * density(model, shape, w);
        }
    }
    return sum * 2.0 * PI / n_phi / 3.0;
}
