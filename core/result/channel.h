// The output channels by name and unit.
#ifndef CORE_RESULT_CHANNEL_H
#define CORE_RESULT_CHANNEL_H

#include <stddef.h>

typedef enum ChannelId {
    CHANNEL_DISPLACEMENT,
    CHANNEL_VELOCITY,
    CHANNEL_ACCELERATION,
    CHANNEL_MEAN_ACCELERATION,
    CHANNEL_DAMPER_DISPLACEMENT,
    CHANNEL_DAMPER_VELOCITY,
    CHANNEL_PENETRATION,
    CHANNEL_CONTACT_FORCE,
    CHANNEL_BASE_ACCELERATION,
    CHANNEL_STOREY_DRIFT, // of frames only
    CHANNEL_BASE_SHEAR,
    CHANNEL_COUNT
} ChannelId;

typedef enum ChannelOwner { CHANNEL_OF_STOREY, CHANNEL_OF_DAMPER, CHANNEL_OF_BASE } ChannelOwner;

typedef struct Channel {
    const char *name, *unit, *psd_unit, *doc;
    ChannelOwner owner;
} Channel;

extern const Channel channels[CHANNEL_COUNT];
// The names that a request may contain: CHANNEL_USUAL, the default selection, then all channels.
// NULL-terminated.
extern const char *const channel_requests[];
#define CHANNEL_USUAL "usual"

// The channel of a name like "displacement" or "displacement_2", or NULL; *number is the number in
// the name, from 1, or 0.
const Channel *channel_find(const char *name, size_t *number);

#endif
