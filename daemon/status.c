/* SPDX-License-Identifier: BSD-3-Clause */
#include "status.h"

/* Position of the highest bit, v > 0, by halving: constant cost without a compiler builtin. */
static unsigned log2_floor(uint64_t v) {
    unsigned k = 0;
    for (unsigned step = 32; step > 0; step /= 2) {
        if (v >> step != 0) {
            v >>= step;
            k += step;
        }
    }
    return k;
}

static size_t bin_of(int64_t value_ns) {
    if (value_ns < HISTOGRAM_PARTS) {
        return value_ns > 0 ? (size_t)value_ns : 0;
    }
    const uint64_t v = (uint64_t)value_ns;
    const unsigned octave = log2_floor(v);
    if (octave >= HISTOGRAM_OCTAVES) {
        return HISTOGRAM_BINS - 1;
    }
    return (size_t)(octave - 2) * HISTOGRAM_PARTS + ((v >> (octave - 3)) & (HISTOGRAM_PARTS - 1));
}

/* Largest value of a bin. */
static int64_t bin_edge_ns(size_t bin) {
    if (bin < 2 * HISTOGRAM_PARTS) {
        return (int64_t)bin;
    }
    const size_t octave = bin / HISTOGRAM_PARTS + 2;
    const int64_t width = (int64_t)1 << (octave - 3);
    return ((int64_t)1 << octave) + (int64_t)(bin % HISTOGRAM_PARTS + 1) * width - 1;
}

void histogram_add(histogram *h, int64_t value_ns) {
    h->n++;
    h->bins[bin_of(value_ns)]++;
    if (value_ns > h->max_ns) {
        h->max_ns = value_ns;
    }
}

int64_t histogram_quantile_ns(const histogram *h, double q) {
    const double wanted = q * (double)h->n;
    int64_t seen = 0;
    for (size_t i = 0; i < HISTOGRAM_BINS; i++) {
        seen += h->bins[i];
        if (seen > 0 && (double)seen >= wanted) {
            const int64_t edge = bin_edge_ns(i);
            return i == HISTOGRAM_BINS - 1 || edge > h->max_ns ? h->max_ns : edge;
        }
    }
    return 0;
}

void histogram_octaves(const histogram *h, int64_t octaves[HISTOGRAM_OCTAVES]) {
    for (size_t k = 0; k < HISTOGRAM_OCTAVES; k++) {
        octaves[k] = 0;
    }
    for (size_t i = 0; i < HISTOGRAM_BINS; i++) {
        const int64_t edge = bin_edge_ns(i);
        octaves[edge > 0 ? log2_floor((uint64_t)edge) : 0] += h->bins[i];
    }
}
