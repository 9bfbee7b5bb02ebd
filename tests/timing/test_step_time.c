/* SPDX-License-Identifier: BSD-3-Clause */
/* What a tick costs against the period of a 1 kHz loop: two bodies, an ellipsoid and one of degree
 * 15, and two tools that press into both and leave again.
 *
 * Only the thread's own CPU time is judged, and of it only the 99th percentile with a wide margin:
 * maxima and wall time belong to the machine, not to the code. */
#include "support/scene_fixture.h"

#include <time.h>

#define N_TICKS 4000
#define DEGREE 15
#define P99_MAX_NS 250000.0 /* a quarter of the 1 ms period */

/* A sphere of 40 mm with smooth random detail: coefficients of degree l >= 2 normal with standard
 * deviation 8 mm / l^3, about 2 mm in all. */
static shcd_model *make_organ(void) {
    static double coefficients[3 * SHCD_COUNT(DEGREE)];
    const double unit = 2.0466534158929770; /* sqrt(4 pi / 3) */
    check_random random = {21};
    shcd_model_def def = SHCD_MODEL_DEF_INIT;
    shcd_model *model = NULL;
    shcd_error error = {SHCD_OK, ""};
    coefficients[3 * SHCD_INDEX(1, 1) + 0] = 0.04 * unit;
    coefficients[3 * SHCD_INDEX(1, -1) + 1] = 0.04 * unit;
    coefficients[3 * SHCD_INDEX(1, 0) + 2] = 0.04 * unit;
    for (int l = 2; l <= DEGREE; l++) {
        for (int m = -l; m <= l; m++) {
            for (size_t k = 0; k < 3; k++) {
                coefficients[3 * SHCD_INDEX(l, m) + k] =
                    0.008 / ((double)l * l * l) * check_normal(&random);
            }
        }
    }
    def.degree = DEGREE;
    def.coefficients = coefficients;
    if (shcd_model_create(&def, NULL, &model, &error) != SHCD_OK) {
        fail_msg("%s", error.message);
    }
    return model;
}

/* Each tool circles about a body's centre while its distance swings between well outside and some
 * 5 mm inside, at speeds of a hand: up to about 0.3 m/s. */
static void place_tools(fixture *f, size_t tick) {
    const double t = (double)tick * FIXTURE_TICK_S;
    for (size_t k = 0; k < 2; k++) {
        const double turn = 2.5 * t + 2.0 * (double)k;
        const double out = 0.045 + 0.01 * sin(9.0 * t + (double)k);
        const double x = k == 0 ? 0.0 : 0.11;
        f->in[k].tool_in_world.position_m =
            shcd_vec3_make(x + out * cos(turn), out * sin(turn) * cos(t), out * sin(turn) * sin(t));
        f->in[k].velocity_m_per_s = shcd_vec3_make(-0.1 * sin(turn), 0.1 * cos(turn), 0.0);
    }
}

static double cpu_time_ns(void) {
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e9 * (double)now.tv_sec + (double)now.tv_nsec;
}

static int compare(const void *a, const void *b) {
    const double x = *(const double *)a;
    const double y = *(const double *)b;
    return (x > y) - (x < y);
}

static void test_step_fits_into_a_quarter_of_the_period(void **state) {
    static double times_ns[N_TICKS];
    const shcd_effect_def effects[2] = {{"stiffness", NULL, 0}, {"damping", NULL, 0}};
    shcd_model *organ = make_organ();
    shcd_model *ellipsoid = fixture_ellipsoid(0.05, 0.04, 0.035);
    const shcd_body_def bodies[2] = {
        fixture_body("organ", organ, fixture_pose(0.0, 0.0, 0.0), effects, 2),
        fixture_body("ellipsoid", ellipsoid, fixture_pose(0.11, 0.0, 0.0), effects, 2)};
    const shcd_tool_def tools[2] = {fixture_tool("tip", 0.0), fixture_tool("ball", 0.003)};
    size_t n_evaluations = 0;
    size_t n_patches = 0;
    size_t n_contacts = 0;
    size_t n_truncated = 0;
    fixture f;
    (void)state;
    fixture_open(&f, bodies, 2, tools, 2);
    for (size_t i = 0; i < N_TICKS; i++) {
        double start;
        place_tools(&f, i);
        start = cpu_time_ns();
        fixture_step(&f);
        times_ns[i] = cpu_time_ns() - start;
        for (size_t k = 0; k < 2; k++) {
            n_evaluations += f.out[k].n_evaluations;
            n_patches += f.out[k].n_patches;
            n_contacts += (f.out[k].flags & SHCD_TOOL_OUTPUT_CONTACT) != 0;
            n_truncated += (f.out[k].flags & SHCD_TOOL_OUTPUT_TRUNCATED) != 0;
        }
    }
    qsort(times_ns, N_TICKS, sizeof times_ns[0], compare);
    printf("tick of 2 tools, 2 bodies, CPU time: p50 %.1f us, p99 %.1f us, max %.1f us\n"
           "per tool and tick: %.1f evaluations, %.1f bounds, %.0f %% in contact, %zu truncated\n",
           1e-3 * times_ns[N_TICKS / 2], 1e-3 * times_ns[N_TICKS * 99 / 100],
           1e-3 * times_ns[N_TICKS - 1], (double)n_evaluations / (2.0 * N_TICKS),
           (double)n_patches / (2.0 * N_TICKS), 100.0 * (double)n_contacts / (2.0 * N_TICKS),
           n_truncated);
    /* the path does what it is meant to: in contact for a good part, and out of it */
    assert_in_range(n_contacts, N_TICKS / 2, 2 * N_TICKS - N_TICKS / 2);
    assert_int_equal(n_truncated, 0);
    assert_at_most(times_ns[N_TICKS * 99 / 100], P99_MAX_NS);
    fixture_close(&f);
    shcd_model_free(organ);
    shcd_model_free(ellipsoid);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_step_fits_into_a_quarter_of_the_period),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
