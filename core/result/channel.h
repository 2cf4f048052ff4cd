// The quantities a run can be asked for, by name and unit. The solver fills them, the table drives
// everything else. Used by simulation/, solve/ and docs.
#ifndef CORE_RESULT_CHANNEL_H
#define CORE_RESULT_CHANNEL_H

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
    CHANNEL_COUNT
} ChannelId;

typedef enum ChannelOwner { CHANNEL_OF_STOREY, CHANNEL_OF_DAMPER, CHANNEL_OF_BASE } ChannelOwner;

typedef struct Channel {
    const char *name, *unit, *psd_unit, *doc;
    ChannelOwner owner;
} Channel;

extern const Channel channels[CHANNEL_COUNT];
extern const char *const channel_names[]; // NULL-terminated

// The channel of that name, NULL if there is none.
const Channel *channel_find(const char *name);

#endif
