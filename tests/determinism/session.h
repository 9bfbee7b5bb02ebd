/* SPDX-License-Identifier: BSD-3-Clause */
/* A session of 10 000 ticks that every build on every machine has to reproduce bit by bit.
 *
 * Four bodies (an ellipsoid, degrees 15 and 9, the last of them soft and with every effect that
 * gets along with the others, a small sphere) and six tools (points, spheres, a
 * capsule and a point shell) that press, slide, plunge through the middle, strike, wander off,
 * vanish and send nonsense. All input comes from integers by +, -, *, / and sqrt, which IEEE 754
 * rounds correctly: no library function of mathematics has a say in it. */
#ifndef SHCD_TESTS_SESSION_H
#define SHCD_TESTS_SESSION_H

#include "shcd/shcd.h"

#define SESSION_TICKS ((size_t)10000)
#define SESSION_PART ((size_t)1000) /* ticks between two marks */
#define SESSION_MARKS (SESSION_TICKS / SESSION_PART + 1)
#define SESSION_BODIES 4
#define SESSION_TOOLS 6

typedef struct session {
    shcd_model *models[SESSION_BODIES];
    shcd_tool_geometry *capsule, *shell;
    shcd_scene *scene;
} session;

/** What a session went through: whether it tests anything. */
typedef struct session_tally {
    size_t n_contact[SESSION_TOOLS][SESSION_BODIES]; /* ticks with this body the nearest */
    size_t n_inactive, n_bad, n_truncated, n_unsure;
    double deepest_m;
} session_tally;

/** Builds the models and the scene. @return 0, or 1 after a message on stderr. */
int session_open(session *s);
void session_close(session *s);

/** A state in memory of its own, aligned as needed; released with free(). NULL if out of memory. */
shcd_state *session_state(const session *s);

/** Runs ticks [first, last) and continues the hash (FNV-1a 64) over the bytes of all outputs.
 *  @param[out] marks  if not NULL: marks[i] is the hash after tick (i + 1) SESSION_PART
 *  @param[out] tally  added to, if not NULL
 *  @return 0, or 1 if a tick was refused. */
int session_run(const session *s, shcd_state *state, size_t first, size_t last, uint64_t *hash,
                uint64_t *marks, session_tally *tally);

#define SESSION_HASH_START 0xcbf29ce484222325u
uint64_t session_hash(uint64_t hash, const void *bytes, size_t n);
uint64_t session_hash_state(const session *s, const shcd_state *state);

/** A whole session: the marks after each part, then the hash of the final state.
 *  @return 0, or 1 after a message. */
int session_marks(const session *s, uint64_t marks[SESSION_MARKS], session_tally *tally);

/** Reads the committed marks. @return 0, or 1 after a message. */
int session_read(const char *path, uint64_t marks[SESSION_MARKS]);

/** @return 0 if equal, else 1 after a message that names the first part that differs. */
int session_compare(const uint64_t found[SESSION_MARKS], const uint64_t expected[SESSION_MARKS]);

#endif
