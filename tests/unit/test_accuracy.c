/* SPDX-License-Identifier: BSD-3-Clause */
/* shcd_accuracy_choose() against an exhaustive comparison of all rows, and its refusals: a pair
 * that a message names must be granted when it is asked for. */
#include "shcd/accuracy.h"
#include "support/check.h"

#include <string.h>

#define ROWS_MAX 40
#define ANY 1e300

static const char *const tier_names[] = {"exact", "fast", "map", "track"};

static shcd_cost_row row_of(int degree, int tier, double error_m, double ns) {
    shcd_cost_row row;
    memset(&row, 0, sizeof row);
    row.degree = degree;
    row.tier = tier;
    row.error_max_m = error_m;
    row.ns_p50 = 0.7 * ns;
    row.ns_p99 = ns;
    return row;
}

/* Few values, so that ties are common. */
static size_t random_rows(check_random *r, shcd_cost_row *rows) {
    const size_t n = 1 + (size_t)(check_random_bits(r) % ROWS_MAX);
    for (size_t i = 0; i < n; i++) {
        rows[i] = row_of(1 + (int)(check_random_bits(r) % 20), (int)(check_random_bits(r) % 4),
                         1e-5 * (double)(1 + check_random_bits(r) % 12),
                         250.0 * (double)(1 + check_random_bits(r) % 12));
        rows[i].normal_p99_rad = 0.05 * (double)(check_random_bits(r) % 10);
    }
    return n;
}

/* ---- the oracle: every row against every other ---- */

static int is_considered(const shcd_cost_row *row, const shcd_accuracy_request *asked) {
    const double limit = asked->normal_max_rad > 0.0 ? asked->normal_max_rad : 0.3;
    return row->normal_p99_rad <= limit &&
           (asked->tiers == 0 || (asked->tiers >> row->tier & 1u) != 0);
}

static double error_of(const shcd_cost_row *row, const shcd_accuracy_request *asked) {
    return row->error_max_m + asked->extra_error_m;
}

static double time_of(const shcd_cost_row *row, const shcd_accuracy_request *asked) {
    return 1e-3 * row->ns_p99 * (double)(asked->n_queries > 0 ? asked->n_queries : 1);
}

/* The row within both limits that no other such row beats; -1: none. */
static int best_row(const shcd_cost_row *rows, size_t n, const shcd_accuracy_request *asked,
                    double error_max, double time_max, int by_time) {
    for (size_t i = 0; i < n; i++) {
        int beaten = !is_considered(&rows[i], asked) || error_of(&rows[i], asked) > error_max ||
                     time_of(&rows[i], asked) > time_max;
        const double first = by_time ? rows[i].ns_p99 : rows[i].error_max_m;
        const double second = by_time ? rows[i].error_max_m : rows[i].ns_p99;
        for (size_t k = 0; k < n && !beaten; k++) {
            const double f = by_time ? rows[k].ns_p99 : rows[k].error_max_m;
            const double s = by_time ? rows[k].error_max_m : rows[k].ns_p99;
            const int is_better =
                f < first || (f <= first && s < second) || (f <= first && s <= second && k < i);
            beaten = is_considered(&rows[k], asked) && error_of(&rows[k], asked) <= error_max &&
                     time_of(&rows[k], asked) <= time_max && is_better;
        }
        if (!beaten) {
            return (int)i;
        }
    }
    return -1;
}

/* ---- against it ---- */

static shcd_accuracy_request random_request(check_random *r) {
    shcd_accuracy_request asked = SHCD_ACCURACY_REQUEST_INIT;
    const uint64_t kind = check_random_bits(r);
    asked.tolerance_m = (kind & 3u) != 0 ? check_uniform(r, 5e-6, 1.5e-4) : 0.0;
    asked.budget_us = (kind & 12u) != 0 ? check_uniform(r, 0.1, 6.0) : 0.0;
    asked.extra_error_m = (kind & 16u) != 0 ? 2e-5 : 0.0;
    asked.normal_max_rad = (kind & 32u) != 0 ? 0.2 : 0.0;
    asked.n_queries = (kind & 64u) != 0 ? 2 : 0;
    asked.tiers = (kind & 128u) != 0 ? (uint32_t)(kind >> 8) & 15u : 0;
    return asked;
}

static void check_nearest(const shcd_cost_row *rows, size_t n, const shcd_accuracy_request *asked,
                          const shcd_accuracy_pair nearest[2]) {
    int meeting =
        asked->tolerance_m > 0.0 ? best_row(rows, n, asked, asked->tolerance_m, ANY, 1) : -1;
    int fitting = asked->budget_us > 0.0 ? best_row(rows, n, asked, ANY, asked->budget_us, 0) : -1;
    meeting = meeting >= 0 ? meeting : best_row(rows, n, asked, ANY, ANY, 0);
    fitting = fitting >= 0 ? fitting : best_row(rows, n, asked, ANY, ANY, 1);
    assert_int_equal(nearest[0].row, meeting);
    assert_int_equal(nearest[1].row, fitting);
}

/* "... 0.1 mm in 12 us (degree 15, exact) ...": the pair, in metres and microseconds. */
static const char *read_pair(const char *text, shcd_accuracy_request *asked) {
    char length_unit[4], time_unit[4];
    double length = 0.0, time = 0.0;
    if (sscanf(text, "%lf %2s in %lf %2s", &length, length_unit, &time, time_unit) != 4) {
        fail_msg("no pair in '%s'", text);
    }
    asked->tolerance_m = length * (length_unit[0] == 'm'   ? 1e-3
                                   : length_unit[0] == 'u' ? 1e-6
                                                           : 1e-9);
    asked->budget_us = time * (time_unit[0] == 'm' ? 1e3 : time_unit[0] == 'u' ? 1.0 : 1e-3);
    return strchr(text, ')') + 1;
}

static void check_message(const shcd_cost_row *rows, size_t n, const shcd_accuracy_request *asked,
                          const shcd_error *error) {
    const char *is = strstr(error->message, " is not feasible: nearest ");
    assert_int_equal(error->status, SHCD_ERR_UNSUPPORTED);
    assert_non_null(is);
    const char *at = strstr(is, "nearest is ");
    const int n_pairs = at != NULL ? 1 : 2;
    at = at != NULL ? at + 11 : strstr(is, "nearest are ") + 12;
    for (int i = 0; i < n_pairs; i++) {
        shcd_accuracy_request again = *asked;
        shcd_accuracy_pair choice;
        at = read_pair(at, &again);
        if (shcd_accuracy_choose(rows, n, &again, &choice, NULL, NULL) != SHCD_OK) {
            fail_msg("%s: pair %d is refused", error->message, i);
        }
        at += i + 1 < n_pairs ? strlen(" or ") : 0;
    }
    assert_int_equal(*at, '\0');
}

static void test_choose_random_tables_agrees_with_exhaustive_comparison(void **state) {
    const size_t n_cases = check_scaled(20000);
    size_t n_granted = 0, n_refused = 0, n_none = 0;
    (void)state;
    for (size_t i = 0; i < n_cases; i++) {
        check_random r = {0xacc0000u + i};
        shcd_cost_row rows[ROWS_MAX];
        const size_t n = random_rows(&r, rows);
        const shcd_accuracy_request asked = random_request(&r);
        const shcd_accuracy_pair untouched = {99, -1.0, -1.0};
        shcd_accuracy_pair choice = untouched, nearest[2] = {untouched, untouched};
        shcd_error error = {SHCD_OK, ""};
        const shcd_status status = shcd_accuracy_choose(rows, n, &asked, &choice, nearest, &error);
        const int best =
            best_row(rows, n, &asked, asked.tolerance_m > 0.0 ? asked.tolerance_m : ANY,
                     asked.budget_us > 0.0 ? asked.budget_us : ANY, asked.tolerance_m > 0.0);
        if (best_row(rows, n, &asked, ANY, ANY, 0) < 0) {
            assert_int_equal(status, SHCD_ERR_UNSUPPORTED);
            assert_memory_equal(&nearest[0], &untouched, sizeof untouched);
            n_none++;
            continue;
        }
        check_nearest(rows, n, &asked, nearest);
        assert_int_equal(status, best >= 0 ? SHCD_OK : SHCD_ERR_UNSUPPORTED);
        if (best >= 0) {
            assert_int_equal(choice.row, best);
            assert_near(choice.error_m, error_of(&rows[best], &asked), 0.0);
            assert_near(choice.time_us, time_of(&rows[best], &asked), 0.0);
            n_granted++;
        } else {
            assert_memory_equal(&choice, &untouched, sizeof untouched);
            check_message(rows, n, &asked, &error);
            n_refused++;
        }
    }
    print_message("%zu requests: %zu granted, %zu refused, %zu without a row\n", n_cases, n_granted,
                  n_refused, n_none);
    assert_true(n_cases < 100 || (n_granted > n_cases / 10 && n_refused > n_cases / 10));
}

static void test_choose_infeasible_names_the_nearest_pairs(void **state) {
    const shcd_cost_row rows[] = {row_of(15, SHCD_TIER_EXACT, 0.9e-4, 12000.0 / 1.006),
                                  row_of(10, SHCD_TIER_FAST, 4e-4 / 1.006, 2900.0),
                                  row_of(5, SHCD_TIER_TRACK, 9e-4, 500.0)};
    shcd_accuracy_request asked = SHCD_ACCURACY_REQUEST_INIT;
    shcd_accuracy_pair choice;
    shcd_error error;
    (void)state;
    asked.tolerance_m = 1e-4;
    asked.budget_us = 3.0;
    assert_int_equal(shcd_accuracy_choose(rows, 3, &asked, &choice, NULL, &error),
                     SHCD_ERR_UNSUPPORTED);
    assert_string_equal(error.message,
                        "0.1 mm in 3 us is not feasible: nearest are 0.1 mm in 12 us (degree 15, "
                        "exact) or 0.4 mm in 3 us (degree 10, fast)");
    asked.budget_us = 0.0;
    asked.tolerance_m = 1e-6;
    assert_int_equal(shcd_accuracy_choose(rows, 3, &asked, &choice, NULL, &error),
                     SHCD_ERR_UNSUPPORTED);
    assert_string_equal(error.message, "1 um is not feasible: nearest is 90.5 um in 12 us "
                                       "(degree 15, exact)");
    asked.tolerance_m = 1.1e-6; /* all lengths of a message in one unit, that of the smallest */
    asked.budget_us = 0.51;
    const shcd_cost_row fine[] = {row_of(15, SHCD_TIER_EXACT, 1e-6, 1.2e6),
                                  row_of(5, SHCD_TIER_TRACK, 1.5e-3, 500.0)};
    assert_int_equal(shcd_accuracy_choose(fine, 2, &asked, &choice, NULL, &error),
                     SHCD_ERR_UNSUPPORTED);
    assert_string_equal(error.message,
                        "1.1 um in 0.51 us is not feasible: nearest are 1.1 um in 1206 us "
                        "(degree 15, exact) or 1508 um in 0.51 us (degree 5, track)");
    asked.tolerance_m = 0.0;
    asked.budget_us = 0.25;
    assert_int_equal(shcd_accuracy_choose(rows, 3, &asked, &choice, NULL, &error),
                     SHCD_ERR_UNSUPPORTED);
    assert_string_equal(error.message,
                        "an answer in 0.25 us is not feasible: nearest is 0.905 mm in "
                        "0.503 us (degree 5, track)");
}

static void test_choose_bad_request_is_refused(void **state) {
    const shcd_cost_row row = row_of(3, SHCD_TIER_FAST, 1e-4, 1000.0);
    const shcd_accuracy_request good = SHCD_ACCURACY_REQUEST_INIT;
    shcd_accuracy_request asked = good;
    shcd_accuracy_pair choice;
    shcd_error error;
    (void)state;
    assert_int_equal(shcd_accuracy_choose(&row, 1, &good, &choice, NULL, NULL), SHCD_OK);
    assert_int_equal(shcd_accuracy_choose(&row, 1, NULL, &choice, NULL, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_accuracy_choose(NULL, 1, &good, &choice, NULL, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_accuracy_choose(&row, 0, &good, &choice, NULL, NULL), SHCD_ERR_ARGUMENT);
    assert_int_equal(shcd_accuracy_choose(&row, 1, &good, NULL, NULL, NULL), SHCD_ERR_ARGUMENT);
    asked.struct_size = 0;
    assert_int_equal(shcd_accuracy_choose(&row, 1, &asked, &choice, NULL, &error),
                     SHCD_ERR_ARGUMENT);
    asked = good;
    asked.budget_us = -1.0;
    assert_int_equal(shcd_accuracy_choose(&row, 1, &asked, &choice, NULL, &error),
                     SHCD_ERR_ARGUMENT);
    assert_non_null(strstr(error.message, "budget_us"));
    asked = good;
    asked.tolerance_m = (double)NAN;
    assert_int_equal(shcd_accuracy_choose(&row, 1, &asked, &choice, NULL, &error),
                     SHCD_ERR_NOT_FINITE);
    assert_non_null(strstr(error.message, "tolerance_m"));
}

/* A caller that knows fewer fields: what lies behind its request is not read. */
static void test_choose_older_request_has_defaults(void **state) {
    const shcd_cost_row row = row_of(3, SHCD_TIER_FAST, 1e-4, 1000.0);
    shcd_accuracy_request asked = SHCD_ACCURACY_REQUEST_INIT;
    shcd_accuracy_pair choice;
    (void)state;
    asked.tolerance_m = 1e-3;
    asked.budget_us = 1e-6;
    assert_int_equal(shcd_accuracy_choose(&row, 1, &asked, &choice, NULL, NULL),
                     SHCD_ERR_UNSUPPORTED);
    asked.struct_size = offsetof(shcd_accuracy_request, budget_us);
    assert_int_equal(shcd_accuracy_choose(&row, 1, &asked, &choice, NULL, NULL), SHCD_OK);
}

/* Each tier can be the only one allowed, and is named in a refusal. */
static void test_choose_tiers_are_a_mask(void **state) {
    (void)state;
    for (int tier = 0; tier < 4; tier++) {
        shcd_cost_row rows[4];
        shcd_accuracy_request asked = SHCD_ACCURACY_REQUEST_INIT;
        shcd_accuracy_pair choice;
        shcd_error error;
        for (int i = 0; i < 4; i++) {
            rows[i] = row_of(4, i, 1e-4, 1000.0);
        }
        asked.tiers = SHCD_TIER_BIT(tier);
        assert_int_equal(shcd_accuracy_choose(rows, 4, &asked, &choice, NULL, NULL), SHCD_OK);
        assert_int_equal(rows[choice.row].tier, tier);
        asked.tolerance_m = 1e-6;
        assert_int_equal(shcd_accuracy_choose(rows, 4, &asked, &choice, NULL, &error),
                         SHCD_ERR_UNSUPPORTED);
        assert_non_null(strstr(error.message, tier_names[tier]));
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_choose_random_tables_agrees_with_exhaustive_comparison),
        cmocka_unit_test(test_choose_infeasible_names_the_nearest_pairs),
        cmocka_unit_test(test_choose_bad_request_is_refused),
        cmocka_unit_test(test_choose_older_request_has_defaults),
        cmocka_unit_test(test_choose_tiers_are_a_mask),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
