/* SPDX-License-Identifier: BSD-3-Clause */
/* Histogram against sorted samples, and the count of missed grid points. */
#include "loop.h"
#include "status.h"

#include "support/check.h"

static int compare(const void *a, const void *b) {
    const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

/* The promise of status.h: not below the exact percentile, at most one bin (1/8) above. */
static void check_quantile(const histogram *h, const int64_t *sorted, size_t n, double q) {
    size_t rank = (size_t)ceil(q * (double)n);
    rank = rank < 1 ? 1 : rank;
    const int64_t exact = sorted[rank - 1];
    const int64_t got = histogram_quantile_ns(h, q);
    if (got < exact || (double)got > 1.125 * (double)exact) {
        fail_msg("quantile %g is %lld, exact %lld", q, (long long)got, (long long)exact);
    }
}

static void test_histogram_quantiles_bracket_the_exact_ones(void **state) {
    (void)state;
    static int64_t values[20000];
    const size_t n = sizeof values / sizeof values[0];
    const double quantiles[] = {1e-9, 0.01, 0.25, 0.5, 0.9, 0.99, 0.999, 1.0};
    check_random random = {20240501};
    histogram h = {0};
    for (size_t i = 0; i < n; i++) {
        values[i] = (int64_t)exp(check_uniform(&random, 0.0, 21.0)); /* 1 ns to 1.3 s */
        histogram_add(&h, values[i]);
    }
    qsort(values, n, sizeof values[0], compare);
    for (size_t k = 0; k < sizeof quantiles / sizeof quantiles[0]; k++) {
        check_quantile(&h, values, n, quantiles[k]);
    }
    assert_int_equal(h.n, n);
    assert_int_equal(h.max_ns, values[n - 1]);
}

static void test_histogram_one_value_is_its_own_quantile(void **state) {
    (void)state;
    for (int64_t v = 0; v < (int64_t)1 << 33; v = v < 20 ? v + 1 : v + v / 3) {
        histogram h = {0};
        histogram_add(&h, v);
        assert_int_equal(histogram_quantile_ns(&h, 0.5), v);
        assert_int_equal(histogram_quantile_ns(&h, 1.0), v);
    }
}

static void test_histogram_octaves_match_powers_of_two(void **state) {
    (void)state;
    for (unsigned k = 0; k < 40; k++) {
        const int64_t low = (int64_t)1 << k;
        const int64_t values[] = {low, 2 * low - 1};
        for (size_t i = 0; i < 2; i++) {
            int64_t octaves[HISTOGRAM_OCTAVES];
            histogram h = {0};
            histogram_add(&h, values[i]);
            histogram_octaves(&h, octaves);
            for (unsigned j = 0; j < HISTOGRAM_OCTAVES; j++) {
                assert_int_equal(octaves[j], j == (k < 31 ? k : 31));
            }
        }
    }
}

static void test_histogram_odd_values_are_kept_in_range(void **state) {
    (void)state;
    histogram h = {0};
    int64_t octaves[HISTOGRAM_OCTAVES];
    assert_int_equal(histogram_quantile_ns(&h, 0.5), 0);
    histogram_add(&h, -5);
    histogram_add(&h, 0);
    histogram_add(&h, INT64_MAX);
    histogram_octaves(&h, octaves);
    assert_int_equal(octaves[0], 2);
    assert_int_equal(octaves[31], 1);
    assert_int_equal(histogram_quantile_ns(&h, 0.5), 0);
    assert_int_equal(histogram_quantile_ns(&h, 1.0), INT64_MAX);
}

static void test_loop_missed_counts_whole_periods(void **state) {
    (void)state;
    const int64_t period = 1000000;
    assert_int_equal(loop_missed(5 * period, 5 * period, period), 0);
    assert_int_equal(loop_missed(5 * period, 5 * period - 10, period), 0); /* woken early */
    assert_int_equal(loop_missed(5 * period, 6 * period - 1, period), 0);
    assert_int_equal(loop_missed(5 * period, 6 * period, period), 1);
    assert_int_equal(loop_missed(5 * period, 12 * period + 7, period), 7);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_histogram_quantiles_bracket_the_exact_ones),
        cmocka_unit_test(test_histogram_one_value_is_its_own_quantile),
        cmocka_unit_test(test_histogram_octaves_match_powers_of_two),
        cmocka_unit_test(test_histogram_odd_values_are_kept_in_range),
        cmocka_unit_test(test_loop_missed_counts_whole_periods),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
