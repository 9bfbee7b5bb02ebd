/* SPDX-License-Identifier: BSD-3-Clause */
/* The plot of `shcd cost` where one of its series has no row: a field that took too long to build,
 * a body of one degree only. The results are made by hand, since how many fields are built in time
 * is a matter of the machine. */
#include "cost_report.h"
#include "report.h"

#include "support/check.h"

#include <string.h>

static const struct {
    const char *tier, *interpolation;
    int degree;
} series[] = {{"exact", NULL, 5},      {"fast", NULL, 5},     {"track", NULL, 5},
              {"map", "linear", 5},    {"map", "hermite", 5}, {"grid", "trilinear", -1},
              {"adf", "trilinear", -1}};
enum { N_SERIES = sizeof series / sizeof series[0], ROWS_EACH = 2 };

static cost_result result;
static const cost_settings settings = {.body_path = "folder/body.shcd"};
static const cost_machine machine = {.cpu = "a processor"};

/* Rows of all series but those whose bit is set. */
static void make_result(unsigned left_out) {
    memset(&result, 0, sizeof result);
    result.settings = &settings;
    result.info.degree = 5;
    result.info.diagonal_m = 0.2;
    result.tolerance_m = 2e-10;
    for (int i = 0; i < N_SERIES; i++) {
        for (int k = 0; k < ROWS_EACH && (left_out & 1u << i) == 0; k++) {
            cost_row *row = &result.lineup.contender[result.lineup.n_contenders++].row;
            row->degree = series[i].degree;
            row->tier = series[i].tier;
            row->interpolation = series[i].interpolation;
            row->error_m.max = 1e-4 / (1.0 + i + 10.0 * k);
            row->path_ns_p50 = 50.0 * (1.0 + i + 5.0 * k);
            row->bytes = 10000u * (uint64_t)(1 + i + 3 * k);
            row->on_time_front = row->on_bytes_front = i == 0;
        }
    }
}

/* The picture; what gnuplot complains about goes to stderr, where ctest shows it. */
static void draw(enum gnuplot_format format, char *picture, size_t size) {
    FILE *file = tmpfile();
    assert_non_null(file);
    assert_true(cost_plot_draw(file, format, &machine, &result));
    rewind(file);
    const size_t n = fread(picture, 1, size - 1, file);
    picture[n] = '\0';
    assert_true(n > 1000 && n < size - 1);
    assert_int_equal(fclose(file), 0);
}

static char picture[1 << 20];

static void test_plot_draw_with_all_series_names_them(void **state) {
    (void)state;
    make_result(0);
    draw(GNUPLOT_SVG, picture, sizeof picture);
    assert_non_null(strstr(picture, "octree ADF"));
    assert_non_null(strstr(picture, "uniform grid"));
    assert_non_null(strstr(picture, "</svg>"));
}

static void test_plot_draw_without_one_series_is_whole(void **state) {
    (void)state;
    for (int i = 1; i < N_SERIES; i++) {
        make_result(1u << i);
        draw(GNUPLOT_SVG, picture, sizeof picture);
        assert_non_null(strstr(picture, "</svg>"));
        /* its name is not drawn anywhere */
        assert_true((strstr(picture, "octree ADF") == NULL) == (i == N_SERIES - 1));
        assert_true((strstr(picture, "uniform grid") == NULL) == (i == N_SERIES - 2));
    }
}

static void test_plot_draw_of_the_exact_tier_alone_is_whole(void **state) {
    (void)state;
    make_result(~1u);
    draw(GNUPLOT_SVG, picture, sizeof picture);
    assert_non_null(strstr(picture, "exact"));
    assert_non_null(strstr(picture, "</svg>"));
    draw(GNUPLOT_PNG, picture, sizeof picture);
    assert_memory_equal(picture, "\x89PNG", 4);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_plot_draw_with_all_series_names_them),
        cmocka_unit_test(test_plot_draw_without_one_series_is_whole),
        cmocka_unit_test(test_plot_draw_of_the_exact_tier_alone_is_whole),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
