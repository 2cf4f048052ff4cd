// Contacts in the record of a force transducer: detected above baseline and noise, then fitted with
// the pulse of the model under a separation rule.
#ifndef CORE_DROP_TEST_FORCE_TRACE_H
#define CORE_DROP_TEST_FORCE_TRACE_H

#include "core/base/field.h"
#include "core/base/progress.h"
#include "core/contact/contact.h"

enum { TRACE_PULSE = 33, TRACE_CONTACTS_MAX = 200 };

// How a trace is evaluated.
typedef struct TraceOptions {
    int separation;   // Separation
    double threshold; // of detection [N]; NAN: from the noise
    // Gravity that presses the pair together during contact; 0: none [m/s^2]. Only with gravity are
    // the approach speeds of the contacts in order used, as far as known [m/s]; where one is
    // unknown it follows from the force and the pair's effective mass [kg] (NAN: unknown).
    double gravity;
    double effective_mass;
    const double *approach_speeds;
    size_t approach_speed_count;
    const Progress *progress; // called before each contact; may be NULL
} TraceOptions;

// Position of a contact in its trace, for charts. Unknown values are NAN.
typedef struct TraceDetection {
    double baseline, noise, threshold; // of the trace; threshold above the baseline [N]
    double first, last; // samples in contact, or above the threshold where no pulse is fitted,
                        // after the first sample of the trace [s]
    uint64_t samples;   // from first to last
    double peak;        // largest force above the baseline, with its sign [N]
    // Time between the crossings of the threshold, without the tensile part; crossing_shortfall is
    // the part of T_c by which it is too short, according to the fitted pulse.
    double crossing_time, crossing_uncertainty; // [s]
    double crossing_shortfall;                  // [-]
    double impulse;                             // of the best pulse, with its sign [N s]
    double start, end;   // of the fitted pulse, also where other pulses fit equally well [s]
    Reals pulse;         // TRACE_PULSE forces of it on the baseline, from start to end [N]
    double misfit;       // rms of the residuals over the noise
    double misfit_share; // and over the peak
} TraceDetection;
extern const Field trace_detection_fields[];

// One contact. Unknown values are NAN; uncertainties are standard uncertainties.
typedef struct TraceContact {
    TraceDetection seen;
    double contact_time, contact_time_uncertainty; // T_c of the isolated pair [s]
    double least_contact_time, most_contact_time;  // 95 % interval, also without a figure [s]
    double restitution, restitution_uncertainty;   // by the shape of the pulse
    char *why; // why there is no figure, or a doubtful one; NULL: it is good
} TraceContact;
typedef struct TraceContacts {
    TraceContact *at;
    size_t count;
} TraceContacts;

typedef struct TraceAnalysis {
    TraceContacts contacts;
    char *why; // why there are none, or not all; NULL
} TraceAnalysis;

// Whether the trace can be evaluated: STATUS_INVALID with the fault at `pointer`.
Status trace_validate(double interval, const Reals *force, const char *pointer, Problem *problem);

// STATUS_INVALID as trace_validate, STATUS_NO_MEMORY, STATUS_CANCELLED. Released by
// trace_analysis_clear in any case.
Status trace_analysis_run(double interval, const Reals *force, const TraceOptions *options,
                          const char *pointer, TraceAnalysis *analysis, Problem *problem);
void trace_analysis_clear(TraceAnalysis *analysis);

#endif
