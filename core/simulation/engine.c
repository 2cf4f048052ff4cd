#include "core/simulation/simulation.h"

// Raise it with any change that may change any bit of any result: it is part of every result's id.
const char engine_version[] = "impactd-4";
