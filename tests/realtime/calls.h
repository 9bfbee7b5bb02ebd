/* SPDX-License-Identifier: BSD-3-Clause */
/* Calls of all functions that the headers mark SHCD_RT (the test rt_calls compares the lists), in
 * the worst places: centres, focal points, far away, deformed, overlapping. */
#ifndef SHCD_TESTS_CALLS_H
#define SHCD_TESTS_CALLS_H

/** Models, maps, shapes, tools, scenes: all that has to be allocated. @return 0, or 1. */
int calls_open(void);
void calls_close(void);

/* Each returns 0, or 1 if a call was refused. */

/** Everything but what follows. */
int calls_queries(void);
/** A scene whose tools are of all kinds, boxes and hulls among them: they approach, turn, press,
 *  slide and go through a rigid and a soft body. */
int calls_step(void);
/** Body against body: apart, close, overlapping. */
int calls_pair(void);

#endif
