/* SPDX-License-Identifier: BSD-3-Clause */
/* The subcommands. Each gets its own command line, argv[0] being its name, and returns the exit
 * status; what went wrong has been reported. */
#ifndef SHCD_TOOLS_COMMANDS_H
#define SHCD_TOOLS_COMMANDS_H

int command_fit(int argc, char **argv);
int command_modes(int argc, char **argv);
int command_train(int argc, char **argv);
int command_effects(int argc, char **argv);
int command_info(int argc, char **argv);
int command_query(int argc, char **argv);
int command_surface(int argc, char **argv);
int command_coefficients(int argc, char **argv);
int command_create(int argc, char **argv);
int command_cost(int argc, char **argv);

/** One line for --version: whether this build can fit, and what that means. */
extern const char command_fit_build[];

#endif
