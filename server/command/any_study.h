// The command "study": the study that a scene asks for itself, without a daemon. Used by
// commands.c.
#ifndef SERVER_COMMAND_ANY_STUDY_H
#define SERVER_COMMAND_ANY_STUDY_H

#include "server/command/command.h"

extern const Command command_study;

#endif
