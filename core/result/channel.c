// All channels in the order of ChannelId.
#include "core/result/channel.h"

#include <string.h>

#include "core/base/field.h"

// clang-format off
const Channel channels[CHANNEL_COUNT] = {
    [CHANNEL_DISPLACEMENT]        = {"displacement", "m", "m^2/Hz", "of the structure, relative to the base", CHANNEL_OF_STOREY},
    [CHANNEL_VELOCITY]            = {"velocity", "m/s", "(m/s)^2/Hz", "of the structure, relative to the base", CHANNEL_OF_STOREY},
    [CHANNEL_ACCELERATION]        = {"acceleration", "m/s^2", "(m/s^2)^2/Hz", "of the structure, absolute, at the instant", CHANNEL_OF_STOREY},
    [CHANNEL_MEAN_ACCELERATION]   = {"mean_acceleration", "m/s^2", "(m/s^2)^2/Hz", "of the structure, absolute, mean over the sample interval before, impulses included", CHANNEL_OF_STOREY},
    [CHANNEL_DAMPER_DISPLACEMENT] = {"damper_displacement", "m", "m^2/Hz", "of the free mass, relative to the base", CHANNEL_OF_DAMPER},
    [CHANNEL_DAMPER_VELOCITY]     = {"damper_velocity", "m/s", "(m/s)^2/Hz", "of the free mass, relative to the base", CHANNEL_OF_DAMPER},
    [CHANNEL_PENETRATION]         = {"penetration", "m", "m^2/Hz", "of the buffer in contact", CHANNEL_OF_DAMPER},
    [CHANNEL_CONTACT_FORCE]       = {"contact_force", "N", "N^2/Hz", "on the structure, positive to the right", CHANNEL_OF_DAMPER},
    [CHANNEL_BASE_ACCELERATION]   = {"base_acceleration", "m/s^2", "(m/s^2)^2/Hz", "of the base", CHANNEL_OF_BASE},
    [CHANNEL_STOREY_DRIFT]        = {"storey_drift", "m", "m^2/Hz", "displacement of a frame's storey less that of the storey below, of the first one relative to the base", CHANNEL_OF_STOREY},
    [CHANNEL_BASE_SHEAR]          = {"base_shear", "N", "N^2/Hz", "force of the structure's springs and dashpots on the base, positive to the right; modes that accuracy.modes leaves out move with the base and load it with their mass", CHANNEL_OF_BASE},
};

const char *const channel_requests[] = {
    CHANNEL_USUAL,
    [1 + CHANNEL_DISPLACEMENT       ] = "displacement",
    [1 + CHANNEL_VELOCITY           ] = "velocity",
    [1 + CHANNEL_ACCELERATION       ] = "acceleration",
    [1 + CHANNEL_MEAN_ACCELERATION  ] = "mean_acceleration",
    [1 + CHANNEL_DAMPER_DISPLACEMENT] = "damper_displacement",
    [1 + CHANNEL_DAMPER_VELOCITY    ] = "damper_velocity",
    [1 + CHANNEL_PENETRATION        ] = "penetration",
    [1 + CHANNEL_CONTACT_FORCE      ] = "contact_force",
    [1 + CHANNEL_BASE_ACCELERATION  ] = "base_acceleration",
    [1 + CHANNEL_STOREY_DRIFT       ] = "storey_drift",
    [1 + CHANNEL_BASE_SHEAR         ] = "base_shear",
    [1 + CHANNEL_COUNT              ] = NULL,
};
// clang-format on

const Channel *channel_find(const char *name, size_t *number) {
    size_t length;
    *number = field_name_number(name, &length);
    for (size_t i = 0; i < CHANNEL_COUNT; i++)
        if (strlen(channels[i].name) == length && memcmp(channels[i].name, name, length) == 0)
            return &channels[i];
    return NULL;
}
