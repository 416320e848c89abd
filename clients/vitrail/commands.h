/* SPDX-License-Identifier: MIT */
/* Every command of the program; each is defined in the file of its name. */
#ifndef VITRAIL_CLIENTS_VITRAIL_COMMANDS_H
#define VITRAIL_CLIENTS_VITRAIL_COMMANDS_H

#include "clients/vitrail/options.h"

extern const struct command COMMAND_RENDER;
extern const struct command COMMAND_JOB;
extern const struct command COMMAND_FARM;
extern const struct command COMMAND_EXPLAIN;
extern const struct command COMMAND_TRADEOFF;
extern const struct command COMMAND_VIEW;
extern const struct command COMMAND_ORBIT;
extern const struct command COMMAND_PUSH;
extern const struct command COMMAND_SCENES;
extern const struct command COMMAND_ENVIRONMENTS;
extern const struct command COMMAND_DELETE;
extern const struct command COMMAND_STATS;
extern const struct command COMMAND_CAPABILITIES;
extern const struct command COMMAND_HEALTH;
extern const struct command COMMAND_DEMO_SCENE;
extern const struct command COMMAND_COMPARE;
extern const struct command COMMAND_VERIFY;

#endif
