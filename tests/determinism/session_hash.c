/* SPDX-License-Identifier: BSD-3-Clause */
/* Runs the session once: session_hash FILE compares with the committed hashes, without an argument
 * a new file of them is printed. Linked into several builds of the run-time library. */
#include "session.h"

#include <inttypes.h>
#include <stdio.h>

static const char *const heading =
    "# The session of session.h: FNV-1a 64 over the bytes of all outputs (little-endian doubles)\n"
    "# after so many ticks, and over the final state. Every build has to reproduce them; they\n"
    "# change only with a change that is meant to change results, and together with it: this file\n"
    "# is what BUILD/tests/determinism/session_hash_library prints.\n";

int main(int argc, char **argv) {
    uint64_t marks[SESSION_MARKS], expected[SESSION_MARKS];
    session s;
    int failed = session_open(&s) != 0 || session_marks(&s, marks, NULL) != 0;
    if (!failed && argc > 1) {
        failed = session_read(argv[1], expected) != 0 || session_compare(marks, expected) != 0;
    } else if (!failed) {
        fputs(heading, stdout);
        for (size_t i = 0; i + 1 < SESSION_MARKS; i++) {
            printf("%zu %016" PRIx64 "\n", (i + 1) * SESSION_PART, marks[i]);
        }
        printf("state %016" PRIx64 "\n", marks[SESSION_MARKS - 1]);
    }
    session_close(&s);
    return failed;
}
