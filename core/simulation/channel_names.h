// Which channels a request means: the usual ones by name, numbers where a scene has several storeys
// or dampers. Not what they hold: that is result/channel.h. Used by request.c.
#ifndef CORE_SIMULATION_CHANNEL_NAMES_H
#define CORE_SIMULATION_CHANNEL_NAMES_H

#include "core/result/channel.h"
#include "core/scene/scene.h"

enum { CHANNEL_NAME = 64 };

// The one name that a channel has in a completed scene, of storey or damper `number`, from 1.
void request_channel_name(const Scene *scene, ChannelId channel, size_t number,
                          char target[CHANNEL_NAME]);

// Puts the names of the usual channels, or of the usual spectrum's one, in place of CHANNEL_USUAL;
// then judges all names, below `pointer`. Says nothing of numbers where a fault leaves the storeys
// or dampers unknown.
Status request_channels(const Scene *scene, Texts *names, bool is_spectrum, const char *pointer,
                        Problem *problem);

// How many channels CHANNEL_USUAL stands for, in a completed scene.
size_t request_usual_count(const Scene *scene);

#endif
