/* SPDX-License-Identifier: BSD-3-Clause */
/* Numbers as little-endian bytes, whatever the machine's own order. */
#ifndef SHCDI_MODEL_BYTES_H
#define SHCDI_MODEL_BYTES_H

#include <stdint.h>
#include <string.h>

static inline void shcdi_put_u32(unsigned char *p, uint32_t v) {
    for (int i = 0; i < 4; i++) {
        p[i] = (unsigned char)(v >> (8 * i));
    }
}

static inline void shcdi_put_u64(unsigned char *p, uint64_t v) {
    for (int i = 0; i < 8; i++) {
        p[i] = (unsigned char)(v >> (8 * i));
    }
}

static inline void shcdi_put_double(unsigned char *p, double v) {
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits);
    shcdi_put_u64(p, bits);
}

static inline uint32_t shcdi_get_u32(const unsigned char *p) {
    return (uint32_t)p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

static inline uint64_t shcdi_get_u64(const unsigned char *p) {
    return (uint64_t)shcdi_get_u32(p) | (uint64_t)shcdi_get_u32(p + 4) << 32;
}

static inline double shcdi_get_double(const unsigned char *p) {
    const uint64_t bits = shcdi_get_u64(p);
    double v;
    memcpy(&v, &bits, sizeof v);
    return v;
}

#endif
