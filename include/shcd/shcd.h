/* SPDX-License-Identifier: BSD-3-Clause */
/** @file
 *  Umbrella of the run-time library. The offline part is separate: shcd/fit.h.
 */
#ifndef SHCD_SHCD_H
#define SHCD_SHCD_H

#include "shcd/accuracy.h"
#include "shcd/base.h"
#include "shcd/energy.h"
#include "shcd/learned.h"
#include "shcd/map.h"
#include "shcd/model.h"
#include "shcd/pair.h"
#include "shcd/query.h"
#include "shcd/scene.h"
#include "shcd/shape.h"
#include "shcd/sweep.h"
#include "shcd/tool.h"
#include "shcd/vec.h"

#endif
