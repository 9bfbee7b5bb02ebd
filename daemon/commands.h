/* SPDX-License-Identifier: BSD-3-Clause */
/* Commands are executed once and answered as often as they are repeated: a client sends one again
 * until it sees the answer, since either message may get lost. This is the memory for that, owned
 * by the publisher thread. */
#ifndef SHCDD_COMMANDS_H
#define SHCDD_COMMANDS_H

#include "exchange.h"
#include "tick.h"

#include "shcdmsg_command_ack_t.h"
#include "shcdmsg_command_t.h"

#include <stdbool.h>

#define COMMANDS_REMEMBERED 64 /* more than can be on their way at once */

typedef struct command_entry {
    bool used;
    bool pending; /* the loop has not confirmed it */
    shcdmsg_command_ack_t ack;
} command_entry;

/** All zero: nothing remembered. */
typedef struct command_table {
    command_entry entries[COMMANDS_REMEMBERED];
    size_t next;             /* the oldest */
    const shcd_scene *scene; /* whose effects can be switched; NULL: none */
} command_table;

/** Takes a command: a new one is refused or passed on to the loop, a known one is not run again.
 *  @return true if `ack` is to be sent now (utime is left to the sender). */
bool commands_take(command_table *table, const shcdmsg_command_t *command, ring *to_loop,
                   shcdmsg_command_ack_t *ack);

/** Takes a confirmation of the loop. @return true if `ack` is to be sent now. */
bool commands_confirm(command_table *table, const tick_applied *applied,
                      shcdmsg_command_ack_t *ack);

#endif
