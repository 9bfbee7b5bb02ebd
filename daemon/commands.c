/* SPDX-License-Identifier: BSD-3-Clause */
#include "commands.h"

#include <math.h>
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

#define RAMP_S 0.2 /* where the client names none */
/* No ramp is shorter: an effect that holds the whole force of a device, 5 N, then changes it by
 * half of what the slew limit lets through, 500 N/s, and never by a step. */
#define RAMP_MIN_S 0.02
#define RAMP_MAX_S 60.0

/* The effect that a command names; the number of effects if there is none. */
static size_t find_effect(const shcd_scene *scene, const shcdmsg_command_t *c) {
    const size_t n = shcd_scene_effect_count(scene);
    size_t e = 0;
    while (e < n && (shcd_scene_effect_body(scene, e) != (size_t)c->object_id ||
                     strncmp(shcd_scene_effect_name(scene, e), (const char *)c->name,
                             sizeof c->name) != 0)) {
        e++;
    }
    return e;
}

/* Fills `ack` with a refusal, or returns false. */
static bool refuse_effect(const shcd_scene *scene, const shcdmsg_command_t *c,
                          shcdmsg_command_ack_t *ack) {
    char text[128];
    const size_t n_bodies = shcd_scene_body_count(scene);
    if (c->object_id < 0 || (size_t)c->object_id >= n_bodies) {
        snprintf(text, sizeof text, "object_id is %d, the scene has %zu bodies", (int)c->object_id,
                 n_bodies);
    } else if (find_effect(scene, c) == shcd_scene_effect_count(scene)) {
        snprintf(text, sizeof text, "body %d has no effect '%.31s'", (int)c->object_id,
                 (const char *)c->name);
    } else if (c->n_val < 1 || (c->val[0] != 0.0 && c->val[0] != 1.0)) {
        snprintf(text, sizeof text, "val[0] must be 1 (on) or 0 (off)");
    } else if (c->n_val > 1 && !(c->val[1] >= 0.0 && c->val[1] <= RAMP_MAX_S)) {
        snprintf(text, sizeof text, "val[1], the ramp, is %g s, must be 0 to %g s", c->val[1],
                 RAMP_MAX_S);
    } else {
        return false;
    }
    answer(c, SHCDMSG_COMMAND_ACK_T_BAD_ARG, text, ack);
    return true;
}

/* Fills `ack` with a refusal, or returns false. */
static bool refuse(const shcd_scene *scene, const shcdmsg_command_t *c,
                   shcdmsg_command_ack_t *ack) {
    char text[128];
    if (c->op != SHCDMSG_COMMAND_T_RESET && c->op != SHCDMSG_COMMAND_T_ZERO_FORCE &&
        c->op != SHCDMSG_COMMAND_T_SET_EFFECT) {
        snprintf(text, sizeof text,
                 "op %d is not supported, only RESET (%d), ZERO_FORCE (%d) and SET_EFFECT (%d)",
                 (int)c->op, SHCDMSG_COMMAND_T_RESET, SHCDMSG_COMMAND_T_ZERO_FORCE,
                 SHCDMSG_COMMAND_T_SET_EFFECT);
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
    return c->op == SHCDMSG_COMMAND_T_SET_EFFECT && refuse_effect(scene, c, ack);
}

bool commands_take(command_table *table, const shcdmsg_command_t *command, ring *to_loop,
                   shcdmsg_command_ack_t *ack) {
    command_entry *e = find(table, command->client_id, command->cmd_id);
    if (e != NULL) {
        *ack = e->ack;
        return !e->pending;
    }
    const bool refused = refuse(table->scene, command, ack);
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
    if (command->op == SHCDMSG_COMMAND_T_SET_EFFECT) {
        slot->effect = find_effect(table->scene, command);
        slot->is_on = command->val[0] == 1.0;
        slot->ramp_s = command->n_val > 1 ? fmax(command->val[1], RAMP_MIN_S) : RAMP_S;
    }
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
