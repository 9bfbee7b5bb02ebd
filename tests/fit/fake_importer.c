/* SPDX-License-Identifier: BSD-3-Clause */
/* Loaded in front of Assimp: an importer that dies, hangs, eats memory or writes where it should
 * not, as SHCD_FAKE_IMPORTER says. */
#define _POSIX_C_SOURCE 200809L /* nanosleep, write */

#include <assimp/cimport.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

__attribute__((visibility("default"))) const struct aiScene *
aiImportFileFromMemory(const char *bytes, unsigned length, unsigned flags, const char *hint);

static void loop(void) {
    static volatile unsigned counter;
    for (;;) {
        ++counter;
    }
}

static void sleep_long(void) {
    const struct timespec hour = {3600, 0};
    (void)nanosleep(&hour, NULL);
}

/* Until there is no more; then what Assimp does: it reports std::bad_alloc. */
static void eat_memory(void) {
    enum { PIECE = 1 << 20 };
    char *piece;
    while ((piece = malloc(PIECE)) != NULL) {
        memset(piece, 1, PIECE);
    }
}

/* Somewhere among these is the pipe to the parent. */
static void write_everywhere(int byte) {
    static char bytes[4096];
    memset(bytes, byte, sizeof bytes);
    for (int descriptor = 3; descriptor < 64; ++descriptor) {
        if (write(descriptor, bytes, sizeof bytes) < 0) {
            continue;
        }
    }
    _exit(0);
}

const struct aiScene *aiImportFileFromMemory(const char *bytes, unsigned length, unsigned flags,
                                             const char *hint) {
    const char *how = getenv("SHCD_FAKE_IMPORTER");
    (void)bytes;
    (void)length;
    (void)flags;
    (void)hint;
    if (how == NULL || strcmp(how, "abort") == 0) {
        abort();
    }
    if (strcmp(how, "crash") == 0) {
        (void)raise(SIGSEGV);
    }
    if (strcmp(how, "exit") == 0) {
        _exit(0);
    }
    if (strcmp(how, "print") == 0) {
        (void)fprintf(stdout, "noise\n");
        (void)fflush(stdout);
        (void)fprintf(stderr, "more noise\n");
        abort();
    }
    if (strcmp(how, "loop") == 0) {
        loop();
    }
    if (strcmp(how, "sleep") == 0) {
        sleep_long();
    }
    if (strcmp(how, "memory") == 0) {
        eat_memory();
    }
    if (strcmp(how, "zeros") == 0 || strcmp(how, "noise") == 0) {
        write_everywhere(how[0] == 'z' ? 0 : 0xaa);
    }
    return NULL;
}

__attribute__((visibility("default"))) const char *aiGetErrorString(void);

const char *aiGetErrorString(void) {
    return "std::bad_alloc";
}
