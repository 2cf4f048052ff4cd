// From touch to release, stretch by stretch: as far as surely nothing happens that is not seen.
#include "core/solve/exact_press.h"

#include <math.h>

#include "core/solve/exact_events.h"
#include "core/solve/exact_ride.h"
#include "core/solve/exact_stride.h"
#include "core/solve/press_bounds.h"

// How far the fast oscillation turns in one step of a walk, and steps to an interval: stiffer
// buffers are not for this.
static const double STEP = 0.6;
static const double LONG_STEP = 2;
static const double STEPS_MAX = 1024;
enum { RIDE_AGAIN = 8, SEARCH_STEPS = 12 };

// Angles of the fast oscillation: the square of the first is below rounding; what the second leaves
// of a largest force's fifth power is.
static const double HERE = 1e-8;
static const double NEAR = 4e-3;

typedef enum Outcome { GOES_ON, ENDS, UNCLEAR } Outcome;

#define NAME(name) name##_plain
#define TARGET
#include "core/solve/press_run.inc"

#define NAME(name) name##_wide
#define TARGET WIDE
#include "core/solve/press_run.inc"

bool press_find_peak(Press *press, double guess, double length) {
    return press->exact->lanes.width == LANES_PLAIN ? find_peak_plain(press, guess, length)
                                                    : find_peak_wide(press, guess, length);
}

size_t exact_press(Exact *exact, size_t most) {
    return exact->lanes.width == LANES_PLAIN ? press_all_plain(exact, most)
                                             : press_all_wide(exact, most);
}
