/* SPDX-License-Identifier: BSD-3-Clause */
/* The table of effects: each describes itself, and they stand in the order in which they act. */
#include "support/check.h"

#include "shcd/shcd.h"

#include <string.h>

#define COUNT(array) (sizeof(array) / sizeof(array)[0])

static void check_parameter(const shcd_parameter_info *p) {
    assert_true(strlen(p->name) > 0);
    assert_true(strlen(p->unit) > 0);
    assert_true(strlen(p->description) > 0);
    assert_true(p->min_value <= p->default_value && p->default_value <= p->max_value);
    if (p->columns == NULL) {
        assert_true(p->n_columns == 0 && p->n_rows_min == 0 && p->n_rows_max == 0);
        return;
    }
    assert_true(p->n_columns >= 2 && p->n_rows_min >= 1 && p->n_rows_min <= p->n_rows_max);
    for (size_t c = 0; c < p->n_columns; c++) {
        assert_true(strlen(p->columns[c].name) > 0);
        assert_true(strlen(p->columns[c].unit) > 0);
        assert_true(p->columns[c].min_value < p->columns[c].max_value);
    }
}

static void test_effect_at_describes_every_effect(void **state) {
    size_t n = 0;
    (void)state;
    for (; shcd_effect_at(n) != NULL; n++) {
        const shcd_effect_info *info = shcd_effect_at(n);
        assert_true(strlen(info->name) > 0);
        assert_true(strlen(info->description) > 0);
        assert_true(strlen(info->source) > 0);
        for (size_t k = 0; k < n; k++) {
            assert_string_not_equal(info->name, shcd_effect_at(k)->name);
        }
        for (size_t i = 0; i < info->n_parameters; i++) {
            check_parameter(&info->parameters[i]);
            for (size_t k = 0; k < i; k++) {
                assert_string_not_equal(info->parameters[i].name, info->parameters[k].name);
            }
        }
    }
    assert_null(shcd_effect_at(SIZE_MAX));
}

static void test_effect_at_is_in_the_order_of_application(void **state) {
    static const char *const order[] = {"texture", "stiffness",  "learned",  "wave",     "pulse",
                                        "damping", "relaxation", "friction", "viscosity"};
    size_t next = 0;
    (void)state;
    for (size_t e = 0; shcd_effect_at(e) != NULL && next < COUNT(order); e++) {
        next += strcmp(shcd_effect_at(e)->name, order[next]) == 0;
    }
    assert_int_equal(next, COUNT(order));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_effect_at_describes_every_effect),
        cmocka_unit_test(test_effect_at_is_in_the_order_of_application),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
