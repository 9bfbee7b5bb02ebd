/* SPDX-License-Identifier: BSD-3-Clause */
/* What queries of these tests cost on the fitted bodies: means over a test's points. Caps and
 * tolerances do not see a search that becomes twice as dear; these do.
 *
 * Figures: the largest of several runs (closest: three seeds, 1 100 points each; deformed: four
 * seeds of 300 points and one of 1 250, organ and hook 3 200; in motion: two seeds, 1 400 points).
 * The bound is 1.5 times that. closest and in motion the seeds agree within a third. On deformed
 * shapes a few that cut themselves cost most of the mean, and runs differ by a factor of up to
 * five: there only the largest changes show. A change that makes queries cheaper should lower the
 * figures.
 */
#ifndef SHCD_TESTS_USUAL_H
#define SHCD_TESTS_USUAL_H

#include "support/check.h"

#include <string.h>

#define USUAL_MARGIN 1.5
/* with fewer points (sanitizers) one hard one weighs too much */
#define USUAL_POINTS_MIN 200

enum usual_test { USUAL_CLOSEST, USUAL_DEFORMED, USUAL_MOVING, USUAL_TESTS };

static const struct {
    const char *body; /* file name without its ending */
    struct {
        double evaluations, patches;
    } mean[USUAL_TESTS];
} usual_bodies[] = {
    {"organ", {{3.7, 40.0}, {590.0, 663.0}, {11.9, 74.0}}},
    {"hook", {{47.5, 90.0}, {770.0, 869.0}, {142.0, 308.0}}},
    {"liver-smooth", {{10.9, 48.0}, {447.0, 517.0}, {28.8, 111.0}}},
    {"liver", {{18.6, 56.0}, {476.0, 548.0}, {45.1, 150.0}}},
    {"Bunny", {{87.2, 126.0}, {616.0, 712.0}, {129.0, 267.0}}},
    {"Armadillo", {{210.0, 256.0}, {819.0, 938.0}, {284.0, 458.0}}},
};

/** `path`: of the body's file. */
static inline void usual_check(enum usual_test test, const char *path, size_t n, double evaluations,
                               double patches) {
    const char *slash = strrchr(path, '/'), *name = slash != NULL ? slash + 1 : path;
    for (size_t i = 0; i < sizeof usual_bodies / sizeof usual_bodies[0]; i++) {
        const size_t length = strlen(usual_bodies[i].body);
        if (strncmp(name, usual_bodies[i].body, length) == 0 && name[length] == '.') {
            if (n >= USUAL_POINTS_MIN) {
                assert_at_most(evaluations / (double)n,
                               USUAL_MARGIN * usual_bodies[i].mean[test].evaluations);
                assert_at_most(patches / (double)n,
                               USUAL_MARGIN * usual_bodies[i].mean[test].patches);
            }
            return;
        }
    }
    fail_msg("%s: no figures of this body in tests/property/usual.h", path);
}

#endif
