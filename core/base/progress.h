// The core's only way to call outwards: progress goes out, "stop" comes in.
// Used by everything that may take long. NULL means nobody watches.
#ifndef CORE_BASE_PROGRESS_H
#define CORE_BASE_PROGRESS_H

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

// A part of a journey tells its own 0 to 1; whoever watches the whole sees the whole's, which never
// goes back: two that go side by side may tell in turn.
typedef struct Stage {
    const Watch *whole;
    double from, share;
    double furthest; // of the part, so far
} Stage;

static inline Stage stage_of(const Watch *whole, double from, double share) {
    return (Stage){whole, from, share, 0};
}

static inline bool stage_advance(void *context, double fraction) {
    Stage *stage = context;
    if (fraction > stage->furthest)
        stage->furthest = fraction;
    return watch_advance(stage->whole, stage->from + stage->share * stage->furthest);
}

static inline Watch stage_watch(Stage *stage) {
    return (Watch){stage, stage_advance};
}

#endif
