// The study "response": the steady motion under a sine while one number varies: periodic orbits
// with their stability, followed through folds on request, and sections of motions without a
// period.
#ifndef CORE_STUDY_RESPONSE_CURVE_H
#define CORE_STUDY_RESPONSE_CURVE_H

#include "core/study/axis.h"

enum {
    CURVE_VALUES = 10000,
    CURVE_CYCLES = 100000,
    CURVE_SECTION = 4096, // points
    CURVE_STATE = 60,     // numbers in the state
    CURVE_ROWS = 1 << 20, // pairs of numbers in the answer
};

typedef enum CurveDirection { CURVE_UP, CURVE_DOWN, CURVE_BOTH } CurveDirection;

typedef struct ResponseStudy {
    Variant variant;
    StudyAxis axis; // a range
    int direction;  // CurveDirection
    uint64_t settle_cycles, max_period;
    bool continuation;
    uint64_t section_points;
    StudyNames names;
} ResponseStudy;

// One point of a curve; numbers that are unknown are absent.
typedef struct ResponsePoint {
    uint64_t index, branch; // from 0, from 1
    double value;
    int direction;   // CurveDirection; CHOICE_ABSENT: of a continuation
    uint64_t period; // cycles; COUNT_ABSENT: no periodic orbit found
    uint64_t impacts_per_period;
    int stable;       // 0, 1 or CHOICE_ABSENT
    Rows multipliers; // real and imaginary part of each
    double peak_displacement, rms_displacement, undamped_peak_displacement; // [m]
    Rows section;    // displacement and velocity
    double lyapunov; // [1/s]
} ResponsePoint;
extern const Field response_point_fields[];

typedef struct ResponsePoints {
    ResponsePoint *at;
    size_t count;
} ResponsePoints;

// The answer.
typedef struct ResponseCurve {
    Variant variant;
    StudyMember member; // of the axis
    char *unit;         // of the first member; NULL: none
    StudyRuns made;     // points, but for the first ones of continuations
    ResponsePoints points;
} ResponseCurve;

#endif
