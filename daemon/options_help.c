/* SPDX-License-Identifier: BSD-3-Clause */
/* The words of `shcdd --help` and of its man page; nothing else lives here. */
#include "options_help.h"

#include <stddef.h>

const command_help options_help = {
    "shcdd",
    "[SCENE.yaml] [options]",
    "serve the forces of soft bodies to haptic tools over LCM",
    "Serves the forces of soft bodies to haptic tools over LCM, by default 1000 times a second. "
    "Without a scene file: an ellipsoid (semi-axes 8, 6, 5 cm), a point tool 0 and a sphere tool 1 "
    "of 3 mm.\n"
    "\n"
    "SIGTERM, SIGINT and SIGHUP let all forces ramp to zero, publish the zero, and end.",
    {{"channel-prefix", OPTIONS_PREFIX, "P",
      "channels P_TOOL, P_FORCE, P_STATUS, P_DEFORM, P_COMMAND, P_ACK; letters, digits and _; "
      "default SHCD"},
     {"lcm-url", OPTIONS_URL, "URL",
      "LCM network; default $LCM_DEFAULT_URL, else LCM's own default"},
     {"duration", OPTIONS_DURATION, "S",
      "end after S seconds; default: run until SIGTERM or SIGINT"},
     {"priority", OPTIONS_PRIORITY, "N", "SCHED_FIFO priority of the loop, 1 to 99; default 80"},
     {"cpu", OPTIONS_CPU, "N", "bind the loop to CPU N; default any"},
     {"require-rt", OPTIONS_REQUIRE_RT, NULL,
      "fail unless SCHED_FIFO, locked memory and the CPU asked for are granted"},
     {"quiet", OPTIONS_QUIET, NULL, "no start-up and no end line"},
     {"version", OPTIONS_VERSION, NULL, "print the version"}}};
