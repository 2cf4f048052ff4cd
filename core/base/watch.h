// The core's only way to call outwards: progress goes out, "stop" comes in.
// Used by everything that may take long. NULL means nobody watches.
#ifndef CORE_BASE_WATCH_H
#define CORE_BASE_WATCH_H

#include <stdbool.h>
#include <stddef.h>

typedef struct Watch {
    void *context;
    // Called every few 10,000 steps with the fraction done, 0 to 1. False asks the run to stop.
    bool (*advance)(void *context, double fraction);
} Watch;

static inline bool watch_advance(const Watch *watch, double fraction) {
    return watch == NULL || watch->advance == NULL || watch->advance(watch->context, fraction);
}

#endif
