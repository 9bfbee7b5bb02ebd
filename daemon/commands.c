/* SPDX-License-Identifier: BSD-3-Clause */
#include "commands.h"

#include <stdio.h>
#include <string.h>

#define SCENE_REVISION 1 /* no command replaces the scene */

static command_entry *find(command_table *table, int64_t client_id, int64_t cmd_id) {
    for (size_t i = 0; i < COMMANDS_REMEMBERED; i++) {
        command_entry *e = &table->entries[i];
        if (e->used && e->ack.client_id == client_id && e->ack.cmd_id == cmd_id) {
            return e;
        }
    }
    return NULL;
}

/* The oldest entry that nobody waits for. There is one: at most 2 SHARED_COMMANDS are pending. */
static command_entry *recycle(command_table *table) {
    for (size_t i = 0; i < COMMANDS_REMEMBERED; i++) {
        command_entry *e = &table->entries[table->next];
        table->next = (table->next + 1) % COMMANDS_REMEMBERED;
        if (!e->pending) {
            return e;
        }
    }
    return NULL;
}

static void answer(const shcdmsg_command_t *command, int32_t status, const char *text,
                   shcdmsg_command_ack_t *ack) {
    memset(ack, 0, sizeof *ack);
    ack->client_id = command->client_id;
    ack->cmd_id = command->cmd_id;
    ack->status = status;
    ack->applied_tick = -1;
    ack->scene_rev = SCENE_REVISION;
    snprintf((char *)ack->text, sizeof ack->text, "%s", text);
}

/* Fills `ack` with a refusal, or returns false. */
static bool refuse(const shcdmsg_command_t *c, shcdmsg_command_ack_t *ack) {
    char text[128];
    if (c->op != SHCDMSG_COMMAND_T_RESET && c->op != SHCDMSG_COMMAND_T_ZERO_FORCE) {
        snprintf(text, sizeof text, "op %d is not supported, only RESET (%d) and ZERO_FORCE (%d)",
                 (int)c->op, SHCDMSG_COMMAND_T_RESET, SHCDMSG_COMMAND_T_ZERO_FORCE);
        answer(c, SHCDMSG_COMMAND_ACK_T_NOT_SUPPORTED, text, ack);
        return true;
    }
    if (c->n_val < 0 || c->n_val > (int32_t)(sizeof c->val / sizeof c->val[0])) {
        snprintf(text, sizeof text, "n_val is %d, must be 0 to 16", (int)c->n_val);
        answer(c, SHCDMSG_COMMAND_ACK_T_BAD_ARG, text, ack);
        return true;
    }
    for (int32_t i = 0; i < c->n_val; i++) {
        if (!(c->val[i] - c->val[i] == 0.0)) {
            snprintf(text, sizeof text, "val[%d] is not finite", (int)i);
            answer(c, SHCDMSG_COMMAND_ACK_T_BAD_ARG, text, ack);
            return true;
        }
    }
    return false;
}

bool commands_take(command_table *table, const shcdmsg_command_t *command, ring *to_loop,
                   shcdmsg_command_ack_t *ack) {
    command_entry *e = find(table, command->client_id, command->cmd_id);
    if (e != NULL) {
        *ack = e->ack;
        return !e->pending;
    }
    const bool refused = refuse(command, ack);
    tick_command *slot = refused ? NULL : ring_reserve(to_loop);
    e = refused || slot != NULL ? recycle(table) : NULL;
    if (e == NULL) {
        /* not remembered, so that the next attempt counts as new */
        answer(command, SHCDMSG_COMMAND_ACK_T_BUSY, "queue full, send it again", ack);
        return true;
    }
    e->used = true;
    e->pending = !refused;
    if (refused) {
        e->ack = *ack;
        return true;
    }
    answer(command, SHCDMSG_COMMAND_ACK_T_OK, "", &e->ack);
    slot->client_id = command->client_id;
    slot->cmd_id = command->cmd_id;
    slot->op = command->op;
    ring_commit(to_loop);
    return false;
}

bool commands_confirm(command_table *table, const tick_applied *applied,
                      shcdmsg_command_ack_t *ack) {
    command_entry *e = find(table, applied->client_id, applied->cmd_id);
    if (e == NULL || !e->pending) {
        return false;
    }
    e->pending = false;
    e->ack.applied_tick = applied->tick;
    *ack = e->ack;
    return true;
}
