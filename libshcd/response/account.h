/* SPDX-License-Identifier: BSD-3-Clause */
/* No contact gives what it has not been given.
 *
 * One wall's law has an energy of its depth, and its force is the gradient: it cannot. Several
 * walls have one as long as each of their feet goes on (walls.c). Where a ball that does not fit
 * into a hollow passes a focal point, feet end and begin and the gradient has no limit; where the
 * turning of walls fades instead, a lap about such a point would yield work. So such a contact
 * keeps the account of shcd/energy.h itself, from its second wall on until it ends:
 *
 *     spare = sum over ticks (-F . dx + K |dx|^2/2) - U >= 0,
 *
 * and where U would make it negative as much of force and energy is withheld as is missing. It
 * comes back in time, as far as there is something to spare. What effects that are switched on or
 * off do to U comes from outside. Where a relief bends the surface the first wall has slopes of its
 * own, and the account begins with it. */
#ifndef SHCDI_ACCOUNT_H
#define SHCDI_ACCOUNT_H

#include <stdint.h>

/** Zero: closed. */
typedef struct shcdi_account {
    double held_j;   /**< U, after what is withheld */
    double spare_j;  /**< of a soft body less than 0 by what could not be withheld in a tick */
    double withheld; /**< share of the law */
    double gains;    /**< of the body's effects, as a sum that tells when one moves */
    uint32_t is_open;
    uint32_t reserved0;
} shcdi_account;

/** A rigid body's contact: books a tick and says what share of its law it may keep.
 *  @param[in] given_j   -F . dx + K |dx|^2/2 of the force that was held
 *  @param[in] energy_j  of the whole law, now
 *  @param[in] gains     of the effects, now. RT safe. */
double shcdi_account_admit(shcdi_account *account, double given_j, double energy_j, double gains,
                           double dt_s);

/** A soft body: how much it may store now; HUGE_VAL where that is not limited. What is withheld
 *  comes back first.
 *  @param[in] is_known  what has been given is known. RT safe. */
double shcdi_account_most(shcdi_account *account, double given_j, double gains, int is_known,
                          double dt_s);

/** And what it stores, its contacts having been solved; opens the account. RT safe. */
void shcdi_account_settle(shcdi_account *account, double most_j, double stored_j);

#endif
