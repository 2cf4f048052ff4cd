// Contacts in a force transducer's record: found above baseline and noise, then fitted with the
// model's pulse under a separation rule. Not statistics over several of them (evaluation.h). Used
// by evaluation.c.
#ifndef CORE_DROP_TEST_FORCE_TRACE_H
#define CORE_DROP_TEST_FORCE_TRACE_H

#include "core/base/field.h"
#include "core/base/progress.h"
#include "core/contact/contact.h"

enum { TRACE_CONTACTS_MAX = 200, TRACE_WHY_MAX = 400, TRACE_PULSE = 33 };

// How a trace is read.
typedef struct TraceOptions {
    int separation;   // Separation
    double threshold; // of detection [N]; NAN: from the noise
    // What pulls the pair together during contact, 0: nothing [m/s^2]. Only with it are used the
    // approach speeds of the contacts in order, as far as known [m/s], and where one is not known
    // the pair's effective mass [kg], NAN: not known, from which and from the force it follows.
    double gravity;
    double effective_mass;
    const double *approach_speeds;
    size_t approach_speed_count;
    const Progress *progress; // asked before each contact whether to go on; NULL: nobody watches
} TraceOptions;

// Where a contact is in its trace, as it is shown and drawn. What is not known is NAN.
typedef struct TraceDetection {
    double baseline, noise, threshold; // of the trace; the threshold is above the baseline [N]
    double first, last; // of the samples in contact, or above the threshold where nothing is
                        // fitted, from the first sample of the trace on [s]
    uint64_t samples;   // from the one to the other
    double peak;        // largest force above the baseline, with its sign [N]
    // Between the crossings of the threshold on the pressing side, which is short of T_c by so much
    // of it as the fitted pulse has it.
    double crossing_time, crossing_uncertainty; // [s]
    double crossing_shortfall;                  // [-]
    double impulse;                             // of the pulse that fits best, with its sign [N s]
    double start, end;   // of the fitted pulse, also where others fit as well [s]
    Reals pulse;         // TRACE_PULSE forces of it as the trace has them, from start to end [N]
    double misfit;       // rms of what the fit leaves over the noise
    double misfit_share; // and over the peak
} TraceDetection;
extern const Field trace_detection_fields[];

// One contact. What is not known is NAN; uncertainties are standard ones.
typedef struct TraceContact {
    TraceDetection seen;
    double contact_time, contact_time_uncertainty; // T_c of an isolated pair, by the fit [s]
    double least_contact_time,
        most_contact_time; // within which it lies, 95 %; also where there is no figure [s]
    double restitution, restitution_uncertainty; // by the pulse's shape
    char *why; // no figure is given, or a doubtful one; NULL: it is good
} TraceContact;
typedef struct TraceContacts {
    TraceContact *at;
    size_t count;
} TraceContacts;

typedef struct TraceAnalysis {
    TraceContacts contacts;
    char *why; // there are none, or not all; NULL
} TraceAnalysis;

// Whether the trace can be read at all: STATUS_INVALID with the fault at `pointer`.
Status trace_validate(double interval, const Reals *force, const char *pointer, Problem *problem);

// STATUS_INVALID as trace_validate, STATUS_NO_MEMORY, STATUS_CANCELLED. Cleared by
// trace_analysis_clear in any case.
Status trace_analysis_run(double interval, const Reals *force, const TraceOptions *way,
                          const char *pointer, TraceAnalysis *reading, Problem *problem);
void trace_analysis_clear(TraceAnalysis *reading);

#endif
