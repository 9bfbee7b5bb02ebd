/* SPDX-License-Identifier: BSD-3-Clause */
/* How the daemon's threads hand data over without a lock: neither side ever waits for the other.
 *
 * mailbox: latest value, one writer, one reader. Three slots: the writer fills its own and swaps it
 * with the shared one, the reader swaps its own with the shared one if that is fresh. A swap moves
 * ownership of a slot, so no slot is ever touched by both sides and no value can be torn.
 *
 * ring: first in, first out, one producer, one consumer. A full ring refuses; it overwrites
 * nothing.
 *
 * Payload bytes are plain memory: the release/acquire pair on the index orders them. The caller
 * owns all memory; slots start at multiples of the stride, which keeps any payload aligned. */
#ifndef SHCDD_EXCHANGE_H
#define SHCDD_EXCHANGE_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#define EXCHANGE_LINE 64u /* bytes of a cache line: the two sides must not share one */

/** Bytes of one slot for a payload of `size` bytes. */
#define EXCHANGE_STRIDE(size) (((size) + EXCHANGE_LINE - 1u) / EXCHANGE_LINE * EXCHANGE_LINE)
#define MAILBOX_BYTES(size) (3u * EXCHANGE_STRIDE(size))
#define RING_BYTES(size, count) ((count)*EXCHANGE_STRIDE(size))

/* ---- latest value --------------------------------------------------------------------------- */

#define MAILBOX_FRESH 4u /* bit beside the slot index: not read yet */

typedef struct mailbox {
    _Alignas(EXCHANGE_LINE) _Atomic unsigned shared; /* slot index, MAILBOX_FRESH */
    _Alignas(EXCHANGE_LINE) unsigned back;           /* the writer's slot */
    _Alignas(EXCHANGE_LINE) unsigned front;          /* the reader's slot */
    unsigned char *memory;
    size_t stride;
} mailbox;

/** `memory`: MAILBOX_BYTES(size), aligned to EXCHANGE_LINE. The first read gives zero bytes, not
 *  fresh. */
static inline void mailbox_init(mailbox *m, void *memory, size_t size) {
    m->memory = memory;
    m->stride = EXCHANGE_STRIDE(size);
    memset(memory, 0, 3 * m->stride);
    m->back = 0;
    atomic_init(&m->shared, 1u);
    m->front = 2;
}

/** Writer: the slot to fill before mailbox_publish(); its old content is undefined. */
static inline void *mailbox_back(mailbox *m) {
    return m->memory + m->back * m->stride;
}

static inline void mailbox_publish(mailbox *m) {
    const unsigned old =
        atomic_exchange_explicit(&m->shared, m->back | MAILBOX_FRESH, memory_order_acq_rel);
    m->back = old & ~MAILBOX_FRESH;
}

/** Reader: the latest value; it stays untouched until the next call. */
static inline const void *mailbox_front(mailbox *m, bool *fresh) {
    *fresh = (atomic_load_explicit(&m->shared, memory_order_relaxed) & MAILBOX_FRESH) != 0;
    if (*fresh) {
        const unsigned old = atomic_exchange_explicit(&m->shared, m->front, memory_order_acq_rel);
        m->front = old & ~MAILBOX_FRESH;
    }
    return m->memory + m->front * m->stride;
}

/* ---- first in, first out -------------------------------------------------------------------- */

typedef struct ring {
    _Alignas(EXCHANGE_LINE) _Atomic size_t head; /* records ever produced */
    _Alignas(EXCHANGE_LINE) _Atomic size_t tail; /* records ever consumed */
    _Alignas(EXCHANGE_LINE) unsigned char *memory;
    size_t stride;
    size_t mask;
} ring;

/** `memory`: RING_BYTES(size, count), aligned to EXCHANGE_LINE; count is a power of two. */
static inline void ring_init(ring *r, void *memory, size_t size, size_t count) {
    atomic_init(&r->head, 0);
    atomic_init(&r->tail, 0);
    r->memory = memory;
    r->stride = EXCHANGE_STRIDE(size);
    r->mask = count - 1;
}

/** Producer: the slot to fill before ring_commit(), or NULL if the ring is full. */
static inline void *ring_reserve(ring *r) {
    const size_t head = atomic_load_explicit(&r->head, memory_order_relaxed);
    const size_t tail = atomic_load_explicit(&r->tail, memory_order_acquire);
    return head - tail > r->mask ? NULL : r->memory + (head & r->mask) * r->stride;
}

static inline void ring_commit(ring *r) {
    const size_t head = atomic_load_explicit(&r->head, memory_order_relaxed);
    atomic_store_explicit(&r->head, head + 1, memory_order_release);
}

/** Consumer: the oldest record, valid until ring_release(), or NULL if the ring is empty. */
static inline const void *ring_peek(ring *r) {
    const size_t tail = atomic_load_explicit(&r->tail, memory_order_relaxed);
    const size_t head = atomic_load_explicit(&r->head, memory_order_acquire);
    return head == tail ? NULL : r->memory + (tail & r->mask) * r->stride;
}

static inline void ring_release(ring *r) {
    const size_t tail = atomic_load_explicit(&r->tail, memory_order_relaxed);
    atomic_store_explicit(&r->tail, tail + 1, memory_order_release);
}

#endif
