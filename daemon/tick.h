/* SPDX-License-Identifier: BSD-3-Clause */
/* One tick of the daemon without threads and without a clock: mailboxes and commands in, shcd_step,
 * the safety chain, a record out. Time is an argument, so a test can run it on a virtual clock, and
 * the loop thread has nothing to add but waiting and counting. */
#ifndef SHCDD_TICK_H
#define SHCDD_TICK_H

#include "config.h"
#include "deform.h"
#include "exchange.h"
#include "messages.h"
#include "passivity.h"
#include "safety.h"
#include "status.h"

#include <stdbool.h>
#include <stdint.h>

/* More grid points missed in a row than this, and the forces ramp to zero ... */
#define TICK_MISSED_MAX 20
/* ... until no such gap has been seen for this long; then they start softly. */
#define TICK_RECOVERY_NS 500000000
/* A tool that is inactive is published this often only, and whenever something changes. */
#define TICK_IDLE_NS 100000000

/** Flags of tool_result beside those of safety_flag; the values of tool_force_t on the wire. */
typedef enum tick_flag {
    TICK_STALE = 1,
    TICK_CONTACT = 64,
    TICK_INACTIVE = 128,
    TICK_DISABLED = 256,
    TICK_DEGRADED = 512,
    TICK_TRUNCATED = 1024,
    TICK_SIGN_UNSURE = 2048,
    TICK_LATE = 4096,
    TICK_FINAL = 8192,
    TICK_EXTRAPOLATED = 16384,
    TICK_YIELDING = 32768
} tick_flag;

/** A command that needs the loop. */
typedef struct tick_command {
    int64_t client_id, cmd_id;
    int32_t op;    /* COMMAND_T_RESET, _ZERO_FORCE or _SET_EFFECT */
    size_t effect; /* of the scene; the rest is of SET_EFFECT, too */
    bool is_on;
    double ramp_s;
} tick_command;

/** Its confirmation. */
typedef struct tick_applied {
    int64_t client_id, cmd_id;
    int64_t tick;
} tick_applied;

/** What is published about one tool. */
typedef struct tool_result {
    int32_t tool_id;
    uint32_t flags;
    int64_t seq; /* -1: no pose yet */
    int64_t utime;
    int64_t recv_ns;
    int64_t age_ns; /* -1: no pose yet */
    shcd_wrench wrench;
    shcd_vec3 proxy_m;
    shcd_vec3 normal;
    double penetration_m;
    double displacement_m;
    int32_t body; /* -1: none */
    bool due;     /* false: nobody needs this one, see TICK_IDLE_NS */
} tool_result;

typedef struct tick_record {
    int64_t tick;
    int64_t utime_ns;
    float compute_us; /* filled in by the loop */
    size_t n_tools;
    tool_result tools[SHCD_TOOLS_MAX];
} tick_record;

/** Between ticks, for one tool. */
typedef struct tick_tool {
    safety_state safety;
    passivity_state passivity;
    shcd_ledger ledger;
    int64_t counted_ns; /* when the last pose of the ledger arrived */
    bool in_debt;       /* more was taken than the reserve: fades out, starts anew */
    bool is_starting;   /* the gain was below 1 */
    bool zeroed;        /* zero-force command holds */
    bool was_disabled;  /* FORCE_ENABLE was seen off since then */
    uint32_t flags_published;
    int64_t published_ns;
} tick_tool;

typedef struct tick_core {
    const daemon_config *config;
    mailbox *poses; /* of tool_sample, one for each tool */
    ring *commands; /* of tick_command, in */
    ring *applied;  /* of tick_applied, out */
    safety_limits limits;
    passivity_limits passivity;
    int64_t passivity_ticks;
    size_t n_effects;
    shcd_effect_output *effects; /* of the last tick */
    effect_time *effect_times;
    shcd_vec3 *effect_forces_n; /* of the last tick, [tool * n_effects + effect] */
    double *effect_energy_j;    /* that each effect's force took up from the hands */
    double stored_j;            /* by all effects */
    double driven_j;            /* brought in by all effects */
    deform_boxes *deforms;      /* NULL: nobody looks */
    size_t deform_body;         /* the next one */
    int64_t deform_ns[SHCD_BODIES_MAX];
    int64_t period_ns;
    size_t n_tools;
    void *memory; /* of the state */
    size_t memory_size;
    shcd_state *state;
    int64_t tick;
    int64_t degraded_until_ns;
    bool degraded;
    bool resetting; /* forces fade out first */
    tick_command reset;
    tick_tool tools[SHCD_TOOLS_MAX];
    tool_sample samples[SHCD_TOOLS_MAX];
    shcd_tool_input inputs[SHCD_TOOLS_MAX];
    shcd_tool_output outputs[SHCD_TOOLS_MAX];
} tick_core;

/** Allocates the state and prepares the first tick; `config` and the exchanges are borrowed. */
bool tick_init(tick_core *core, const daemon_config *config, mailbox poses[], ring *commands,
               ring *applied);
void tick_free(tick_core *core);

/** Runs one tick at `now_ns`, after `missed` grid points without one. With `stop` the forces fade
 *  out; @return true once they are zero: `record` then is the last one and marked FINAL. Real-time
 *  safe. */
bool tick_run(tick_core *core, int64_t now_ns, int64_t missed, bool stop, tick_record *record);

/** Sums the tools' accounts. Real-time safe. */
tick_energy tick_energy_of(const tick_core *core);

#endif
