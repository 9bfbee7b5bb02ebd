/* SPDX-License-Identifier: BSD-3-Clause */
#include "response/account.h"

#include "base/internal.h"

/* Time in which what is withheld would come back altogether [s]. */
#define RETURN_TIME_S 0.4

static double give_back(shcdi_account *a, double dt_s) {
    a->withheld = shcdi_max(0.0, a->withheld - dt_s / RETURN_TIME_S);
    return 1.0 - a->withheld;
}

/* @return whether the books go on from the last tick */
static int goes_on(shcdi_account *a, double gains) {
    const int is = a->is_open && a->gains == gains;
    a->gains = gains;
    return is;
}

double shcdi_account_admit(shcdi_account *a, double given_j, double energy_j, double gains,
                           double dt_s) {
    double kept = give_back(a, dt_s), most_j = HUGE_VAL;
    if (goes_on(a, gains)) {
        most_j = shcdi_max(0.0, a->spare_j + a->held_j + given_j);
        if (kept * energy_j > most_j) {
            kept = most_j / energy_j;
            a->withheld = 1.0 - kept;
        }
    }
    shcdi_account_settle(a, most_j, kept * energy_j);
    return kept;
}

double shcdi_account_most(shcdi_account *a, double given_j, double gains, int is_known,
                          double dt_s) {
    (void)give_back(a, dt_s);
    a->is_open = a->is_open && is_known;
    return goes_on(a, gains) ? a->spare_j + a->held_j + given_j : HUGE_VAL;
}

void shcdi_account_settle(shcdi_account *a, double most_j, double stored_j) {
    if (!a->is_open) {
        a->spare_j = 0.0;
    } else if (most_j < HUGE_VAL) {
        a->spare_j = most_j - stored_j;
    }
    a->held_j = stored_j;
    a->is_open = 1;
}
