/* SPDX-License-Identifier: BSD-3-Clause */
/* The account that a contact with several walls keeps: what it withholds, and what must not make it
 * withhold. */
#include "response/scene_private.h"
#include "support/groove.h"
#include "support/scene_fixture.h"

#define DT_S 1e-3
#define BALL_M 0.012

/* U = 2 J was never given but for 0.5: a quarter of the law is kept. What is given later lets it
 * come back, in its time. */
static void test_what_was_not_given_is_withheld(void **state) {
    shcdi_account a = {.is_open = 0};
    (void)state;
    assert_near(shcdi_account_admit(&a, 7.0, 0.5, 1.0, DT_S), 1.0, 0.0); /* opens */
    assert_near(a.held_j, 0.5, 0.0);
    assert_near(a.spare_j, 0.0, 0.0);
    assert_near(shcdi_account_admit(&a, 0.0, 2.0, 1.0, DT_S), 0.25, 1e-15);
    assert_near(a.held_j + a.spare_j, 0.5, 1e-15);
    assert_near(shcdi_account_admit(&a, 0.25, 2.0, 1.0, DT_S), 0.25 + DT_S / 0.4, 1e-15);
    for (int i = 0; i < 400; i++) {
        (void)shcdi_account_admit(&a, 0.01, 2.0, 1.0, DT_S);
    }
    assert_near(a.withheld, 0.0, 0.0);
    assert_near(a.held_j, 2.0, 0.0);
    assert_near(a.held_j + a.spare_j, 0.75 + 400 * 0.01, 1e-12);
}

/* With other gains the law is another, and that is nobody's energy. */
static void test_what_a_switch_brings_is_not_withheld(void **state) {
    shcdi_account a = {.is_open = 0};
    (void)state;
    (void)shcdi_account_admit(&a, 0.0, 0.5, 1.0, DT_S);
    assert_near(shcdi_account_admit(&a, 0.0, 2.0, 0.9, DT_S), 1.0, 0.0);
    assert_near(a.held_j, 2.0, 0.0);
    assert_near(shcdi_account_admit(&a, 0.0, 4.0, 0.9, DT_S), 0.5, 1e-15);
}

static fixture f;
static const shcdi_account *account_of(int is_soft) {
    const shcdi_body *body = &f.scene->bodies[0];
    return is_soft ? &shcdi_soft_parts_of(body->soft, (unsigned char *)f.state + body->soft_offset)
                          .head->account
                   : &f.state->contacts[0].account;
}

static double hold(double x, int n) {
    for (int i = 0; i < n; i++) {
        f.in[0].tool_in_world = fixture_pose(x, 0.0, 0.0);
        fixture_step(&f);
    }
    return f.out[0].wrench.force_n.x;
}

/* A ball that rests in a groove while the law is switched off and on again gets the force that it
 * had; one that waves about far from the body pays for nothing. */
static void test_a_switch_and_a_tool_elsewhere_change_nothing(void **state) {
    const shcd_effect_def effects[2] = {{"stiffness", NULL, 0}, {"wave", NULL, 0}};
    (void)state;
    for (int is_soft = 0; is_soft < 2; is_soft++) {
        shcd_model *model = is_soft ? groove_soft_body(8, 0.5) : groove_body(8, 0.5);
        const shcd_body_def body =
            fixture_body("body", model, fixture_pose(0, 0, 0), effects, is_soft ? 2 : 1);
        const shcd_tool_def tools[2] = {fixture_tool("ball", BALL_M), fixture_tool("far", BALL_M)};
        double x = 0.06;
        fixture_open(&f, &body, 1, tools, 2);
        f.in[1].tool_in_world = fixture_pose(0.3, 0.0, 0.0);
        f.in[0].flags = f.in[1].flags = SHCD_TOOL_INPUT_ACTIVE;
        for (; f.out[0].penetration_m < 0.003; x -= 2e-5) {
            (void)hold(x, 1);
        }
        const double before_n = hold(x, 2000);
        assert_int_equal(f.out[0].n_contacts, 2);
        assert_true(account_of(is_soft)->is_open);
        const double spare_j = account_of(is_soft)->spare_j;
        for (int i = 0; i < 200; i++) {
            f.in[1].tool_in_world = fixture_pose(0.3 + 1e-3 * (i % 100), 0.0, 0.0);
            (void)hold(x, 1);
        }
        assert_near(account_of(is_soft)->spare_j, spare_j, 1e-7);
        assert_int_equal(shcd_state_switch(f.scene, f.state, 0, 0, 0.1), SHCD_OK);
        assert_near(hold(x, 1000), 0.0, 0.0);
        assert_int_equal(shcd_state_switch(f.scene, f.state, 0, 1, 0.1), SHCD_OK);
        const double after_n = hold(x, 3000);
        print_message("%s: %.5f N, %.5f N after the law was off; kept %.4f\n",
                      is_soft ? "soft" : "rigid", before_n, after_n,
                      1.0 - account_of(is_soft)->withheld);
        /* what yields besides has its own end, which it may not have reached before */
        assert_near(after_n, before_n, 0.01 * before_n);
        assert_near(account_of(is_soft)->withheld, 0.0, 0.01);
        fixture_close(&f);
        shcd_model_free(model);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_what_was_not_given_is_withheld),
        cmocka_unit_test(test_what_a_switch_brings_is_not_withheld),
        cmocka_unit_test(test_a_switch_and_a_tool_elsewhere_change_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
