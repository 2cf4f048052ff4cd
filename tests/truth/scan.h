// Whether a ledger of impacts is whole: the motion is followed anew in long double from one listed
// event to the next, and between them it is proved that no gap closes, no contact opens and no rest
// is pulled at. Not a solver: it looks for nothing, it is told when. Used by test_missed.c.
#ifndef TESTS_TRUTH_SCAN_H
#define TESTS_TRUTH_SCAN_H

#include "core/result/response.h"
#include "tests/truth/reference.h"

typedef struct Scan {
    bool is_whole;
    size_t pieces; // proved one by one
    double worst;  // the largest miss of a listed event, over what is allowed
    char why[240]; // where it is not whole
} Scan;

// Times are taken as listed, so that rounding does not grow from impact to impact: what remains is
// a miss of 1e-11 of the lengths there are, and of an ulp of the time at the speeds there are;
// `reach` is the structure's largest displacement.
void scan_run(const ReferenceScene *scene, const Impacts *impacts, double reach, Scan *scan);

#endif
