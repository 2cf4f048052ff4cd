// How far one outcome is from another: the numbers of a tradeoff study's points. Samples are
// compared within the reference's trust horizon only; beyond it statistics alone mean something.
// Used by tradeoff.c.
#ifndef CORE_STUDY_TRADEOFF_ERRORS_H
#define CORE_STUDY_TRADEOFF_ERRORS_H

#include "core/study/tradeoff.h"

// An outcome whose series holds `storeys` columns of displacement, then as many of
// mean_acceleration.
typedef struct Compared {
    const Outcome *outcome;
    size_t storeys;
    bool has_motion; // false: its samples answer something else, and only its spectra count
    bool has_force;  // a contact force is known of every impact
} Compared;

// What the reference has, with the horizon known: its band and ledger. The texts are left alone.
void errors_reference(const Compared *reference, TradeoffReference *told);

TradeoffErrors errors_measure(const Compared *reference, const Compared *point);

#endif
