// One scene from the edges, run and judged: was it refused or did it fail in words, does it mark
// what it cannot vouch for, and does what it states hold against a closer solver? Draws no scenes
// (extremes.h). Used by test_extremes.c.
#ifndef TESTS_TRUTH_EXTREMES_JUDGE_H
#define TESTS_TRUTH_EXTREMES_JUDGE_H

#include <stdint.h>

enum { EXTREMES_REASON = 200 };

typedef enum ExtremesVerdict {
    EXTREME_KEPT,      // the error stated holds against something closer
    EXTREME_UNJUDGED,  // an error is stated, and nothing closer came to an end in time
    EXTREME_UNTRUSTED, // the run says itself that its error is large or not known
    EXTREME_REFUSED,
    EXTREME_FAILED,
    EXTREME_FIRST_DEFECT,
    EXTREME_SILENT = EXTREME_FIRST_DEFECT, // wrong, and did not say so
    EXTREME_NAN,
    EXTREME_MUTE,   // no result, and no reason
    EXTREME_SLOW,   // much more CPU than was predicted or allowed
    EXTREME_DEAF,   // asked too rarely whether to stop
    EXTREME_GREEDY, // more memory than was predicted
    EXTREME_HANG,
    EXTREME_CRASH,
    EXTREME_VERDICTS
} ExtremesVerdict;
extern const char *const extremes_verdicts[EXTREME_VERDICTS];

enum {
    EXTREMES_NOBODY,
    EXTREMES_QUAD,
    EXTREMES_EXACT,
    EXTREMES_ADAPTIVE,
    EXTREMES_RK4,
    EXTREMES_JUDGES
};
extern const char *const extremes_judges[EXTREMES_JUDGES];

typedef struct ExtremesRecord {
    uint64_t number;
    int verdict, judge;
    double predicted, cpu; // [s]
    double steps, samples, impacts;
    double told, found; // error of displacement, of its largest value
    double gap;         // CPU time between two looks at the progress, the longest [s]
    double bytes;       // predicted
    char solver[16], what[64], reason[EXTREMES_REASON];
} ExtremesRecord;

void extremes_judge(const char *text, uint64_t number, double most_seconds, ExtremesRecord *record);

#endif
