// Names of channels in a request: the default ones, and numbers where a scene has several storeys
// or dampers.
#ifndef CORE_SIMULATION_CHANNEL_NAMES_H
#define CORE_SIMULATION_CHANNEL_NAMES_H

#include "core/result/channel.h"
#include "core/scene/scene.h"

enum { CHANNEL_NAME = 64 };

// The one name of a channel in a completed scene; `number` is that of the storey or damper, from 1.
void channel_names_write(const Scene *scene, ChannelId channel, size_t number,
                         char target[CHANNEL_NAME]);

// Appends that name to a list that does not have it yet. STATUS_OK or STATUS_NO_MEMORY.
Status channel_names_add(const Scene *scene, ChannelId channel, size_t number, Texts *names);

// Replaces CHANNEL_USUAL by the names of the default channels, or of the default spectrum's one,
// and validates all names; their pointers are below `pointer`. Names are not compared with the
// numbers of storeys and dampers where a fault leaves these unknown.
Status channel_names_complete(const Scene *scene, Texts *names, bool is_spectrum,
                              const char *pointer, Problem *problem);

// Number of channels that CHANNEL_USUAL stands for in a completed scene.
size_t channel_names_usual_count(const Scene *scene);

#endif
