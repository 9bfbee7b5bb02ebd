/* SPDX-License-Identifier: BSD-3-Clause */
#include "response/account.h"

#include "base/internal.h"

/* Time in which what is withheld would come back altogether [s]. */
#define RETURN_TIME_S 0.4

static double give_back(shcdi_account *a, double dt_s) {
    a->withheld = shcdi_max(0.0, a->withheld - dt_s / RETURN_TIME_S);
    return 1.0 - a->withheld;
}

double shcdi_account_admit(shcdi_account *a, double given_j, double energy_j, double dt_s) {
    if (!a->is_open) {
        shcdi_account_settle(a, energy_j, energy_j);
        return 1.0;
    }
    const double most_j = shcdi_max(0.0, a->spare_j + a->held_j + given_j);
    double kept = give_back(a, dt_s);
    if (kept * energy_j > most_j) {
        kept = most_j / energy_j;
        a->withheld = 1.0 - kept;
    }
    shcdi_account_settle(a, most_j, kept * energy_j);
    return kept;
}

double shcdi_account_most(shcdi_account *a, double given_j, double dt_s) {
    if (!a->is_open) {
        return HUGE_VAL;
    }
    (void)give_back(a, dt_s);
    return a->spare_j + a->held_j + given_j;
}

void shcdi_account_settle(shcdi_account *a, double most_j, double stored_j) {
    a->spare_j = a->is_open ? most_j - stored_j : 0.0;
    a->held_j = stored_j;
    a->is_open = 1;
}
