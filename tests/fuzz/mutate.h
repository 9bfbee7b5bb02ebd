/* SPDX-License-Identifier: BSD-3-Clause */
/* Random changes of bytes, the same on every machine: the case is its number. */
#ifndef SHCD_TESTS_MUTATE_H
#define SHCD_TESTS_MUTATE_H

#include "support/check.h"

#include <string.h>

/** A content with room to grow. */
typedef struct mutant {
    unsigned char *bytes;
    size_t size, capacity;
} mutant;

/** Pieces that mean something in the format under test. */
typedef struct mutate_tokens {
    const char *const *text;
    size_t n;
} mutate_tokens;

/** Uniform in 0 .. n - 1; 0 if n is 0. */
static inline size_t mutate_below(check_random *r, size_t n) {
    return n > 0 ? (size_t)(check_random_bits(r) % n) : 0;
}

static inline void mutate_remove(mutant *m, size_t at, size_t n) {
    n = n < m->size - at ? n : m->size - at;
    memmove(m->bytes + at, m->bytes + at + n, m->size - at - n);
    m->size -= n;
}

/** `from` must not lie in the mutant. */
static inline void mutate_insert(mutant *m, size_t at, const void *from, size_t n) {
    if (n <= m->capacity - m->size) {
        memmove(m->bytes + at + n, m->bytes + at, m->size - at);
        memcpy(m->bytes + at, from, n);
        m->size += n;
    }
}

/** Copies a short range to another place. */
static inline void mutate_copy(check_random *r, mutant *m, size_t at) {
    unsigned char piece[64];
    size_t n = 1 + mutate_below(r, sizeof piece);
    n = n < m->size - at ? n : m->size - at;
    memcpy(piece, m->bytes + at, n);
    mutate_insert(m, mutate_below(r, m->size + 1), piece, n);
}

/** Removes or doubles the line behind `at`. */
static inline void mutate_line(check_random *r, mutant *m, size_t at) {
    unsigned char line[256];
    size_t n = 0;
    while (at < m->size && m->bytes[at] != '\n') {
        ++at;
    }
    at += at < m->size;
    while (at + n < m->size && n < sizeof line && m->bytes[at + n] != '\n') {
        ++n;
    }
    n += at + n < m->size && n < sizeof line;
    if (mutate_below(r, 2) == 0) {
        mutate_remove(m, at, n);
    } else {
        memcpy(line, m->bytes + at, n);
        mutate_insert(m, at, line, n);
    }
}

static inline void mutate_once(check_random *r, mutant *m, const mutate_tokens *tokens) {
    const size_t at = mutate_below(r, m->size);
    const char *token = tokens->text[mutate_below(r, tokens->n)];
    const size_t kind = mutate_below(r, m->size > 0 ? 16 : 2);
    if (kind < 4) {
        mutate_insert(m, at, token, strlen(token));
    } else if (kind < 6) {
        m->bytes[at] = (unsigned char)(m->bytes[at] ^ 1u << mutate_below(r, 8));
    } else if (kind < 8) {
        m->bytes[at] = (unsigned char)check_random_bits(r);
    } else if (kind < 10) {
        mutate_remove(m, at, 1 + mutate_below(r, 16));
    } else if (kind < 12) {
        mutate_copy(r, m, at);
    } else if (kind < 15) {
        mutate_line(r, m, at);
    } else {
        m->size = at;
    }
}

/** Mostly few changes: many at once are refused for the first of them. */
static inline void mutate(check_random *r, mutant *m, const mutate_tokens *tokens) {
    const size_t n = mutate_below(r, 8) == 0 ? 1 + mutate_below(r, 30) : 1 + mutate_below(r, 4);
    for (size_t i = 0; i < n; ++i) {
        mutate_once(r, m, tokens);
    }
}

#endif
