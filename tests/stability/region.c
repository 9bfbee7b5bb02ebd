/* SPDX-License-Identifier: BSD-3-Clause */
/* Measures the region of stability: for a stiffness and a delay the smallest damping of device and
 * hand at which the loop of hand, daemon and body comes to rest, by bisection.
 *
 *     region                prints the table, which docs/stability-region.txt is
 *     region --check FILE   measures the table of FILE again; fails where a figure is off by 2 %
 *
 * A sphere is pressed on the tip of an ellipsoid, along its axis, so that the motion stays on it.
 * In contact the loop is linear: its oscillation grows or decays exponentially, near the border
 * slowly, and its energy about the rest, m v^2/2 + (k + k_h) (x - x_rest)^2/2, tells which over two
 * seconds (the delay makes it ripple, by a share of sqrt(k/m) delay, where the rates are high). A
 * loop that leaves the surface is beyond the border. */
#include "session.h"

#include "shcd/vec.h"
#include "support/scene_fixture.h"

#include <string.h>

#define RATE_HZ 1000.0
#define MASS_KG 0.1
#define GRIP_N_PER_M 300.0
#define STEPS 11
#define REST_J 1e-18 /* an amplitude of 1e-10 m on the softest spring */
#define SEMI_AXIS_M 0.08
#define RADIUS_M 0.003

static const double stiffnesses_n_per_m[] = {10.0,   30.0,   100.0,  300.0,   1000.0,
                                             2000.0, 4000.0, 8000.0, 14000.0, 20000.0};
static const double delays_s[] = {0.0, 0.5e-3, 1e-3, 2e-3};
#define N_STIFFNESSES (sizeof stiffnesses_n_per_m / sizeof stiffnesses_n_per_m[0])
#define N_DELAYS (sizeof delays_s / sizeof delays_s[0])

static double theory(double k, double delay_s) {
    return k * (0.5 / RATE_HZ + delay_s);
}

static double energy(const rig *r, double k) {
    const double tip = SEMI_AXIS_M + RADIUS_M, target = r->hand.target_m.x;
    const double rest = (k * tip + GRIP_N_PER_M * target) / (k + GRIP_N_PER_M);
    const double x = r->hand.position_m.x - rest, v = r->hand.velocity_m_per_s.x;
    return 0.5 * MASS_KG * v * v + 0.5 * (k + GRIP_N_PER_M) * x * x;
}

static bool comes_to_rest(const shcd_model *model, double k, double delay_s, double b) {
    static rig r;
    const rig_setup setup = {.model = model,
                             .radius_m = RADIUS_M,
                             .stiffness_n_per_m = k,
                             .device = &rig_bare_device,
                             .reserve_j = HUGE_VAL,
                             .hand = {.mass_kg = MASS_KG,
                                      .damping_n_s_per_m = b,
                                      .grip_n_per_m = GRIP_N_PER_M,
                                      .delay_s = delay_s,
                                      .rate_hz = RATE_HZ}};
    const session s = session_make(SESSION_PRESS, &setup, shcd_vec3_make(1.0, 0.0, 0.0),
                                   shcd_vec3_make(0.0, 1.0, 0.0), fmin(2.0, 0.006 * k));
    const watch w = session_run(&r, &setup, &s);
    const double before_j = energy(&r, k);
    for (int i = 0; i < 2 * (int)RATE_HZ; i++) {
        rig_tick(&r, r.hand.target_m);
    }
    const double after_j = energy(&r, k);
    rig_close(&r);
    return w.n_changes == 0 && (after_j <= before_j || after_j < REST_J);
}

static double measure(const shcd_model *model, double k, double delay_s) {
    double low = 0.0, high = 1.25 * theory(k, delay_s);
    for (int i = 0; i < STEPS; i++) {
        const double b = 0.5 * (low + high);
        if (comes_to_rest(model, k, delay_s, b)) {
            high = b;
        } else {
            low = b;
        }
    }
    return 0.5 * (low + high);
}

static int check(const shcd_model *model, const char *path) {
    char line[256];
    size_t n = 0;
    FILE *file = fopen(path, "r");
    if (file == NULL) {
        fprintf(stderr, "region: cannot read %s\n", path);
        return 1;
    }
    while (fgets(line, sizeof line, file) != NULL) {
        double delay_ms, k, expected, measured;
        if (sscanf(line, "%lf %lf %lf %lf", &delay_ms, &k, &expected, &measured) != 4) {
            continue;
        }
        const double now = measure(model, k, 1e-3 * delay_ms);
        n++;
        if (!(fabs(now - measured) <= 0.02 * measured) || !(now <= 1.01 * expected) ||
            !(fabs(theory(k, 1e-3 * delay_ms) - expected) <= 1e-3 * expected)) {
            fprintf(stderr, "region: %g N/m at %g ms: %.4g N s/m, %s has %.4g of %.4g\n", k,
                    delay_ms, now, path, measured, expected);
            fclose(file);
            return 1;
        }
    }
    fclose(file);
    if (n != N_STIFFNESSES * N_DELAYS) {
        fprintf(stderr, "region: %s has %zu rows, not %zu\n", path, n, N_STIFFNESSES * N_DELAYS);
        return 1;
    }
    return 0;
}

int main(int n_arguments, char **arguments) {
    shcd_model *model = fixture_ellipsoid(SEMI_AXIS_M, 0.06, 0.05);
    int status = 0;
    if (n_arguments == 3 && strcmp(arguments[1], "--check") == 0) {
        status = check(model, arguments[2]);
    } else if (n_arguments == 1) {
        printf("# Least damping of device and hand at which the loop comes to rest: %g Hz, mass "
               "%g kg, grip %g N/m.\n"
               "# delay_ms stiffness_n_per_m theory_n_s_per_m measured_n_s_per_m\n",
               RATE_HZ, MASS_KG, GRIP_N_PER_M);
        for (size_t d = 0; d < N_DELAYS; d++) {
            for (size_t i = 0; i < N_STIFFNESSES; i++) {
                const double k = stiffnesses_n_per_m[i];
                printf("%g %g %.4g %.3g\n", 1e3 * delays_s[d], k, theory(k, delays_s[d]),
                       measure(model, k, delays_s[d]));
                (void)fflush(stdout);
            }
            printf("\n\n"); /* a block for gnuplot */
        }
    } else {
        fprintf(stderr, "usage: region [--check FILE]\n");
        status = 2;
    }
    shcd_model_free(model);
    return status;
}
