// Contacts in a force transducer's record: found above baseline and noise, then fitted with the
// model's pulse under a separation rule. Not statistics over several of them (evaluation.h). Used
// by evaluation.c.
#ifndef CORE_MEASURE_TRACE_H
#define CORE_MEASURE_TRACE_H

#include "core/base/field.h"
#include "core/base/watch.h"
#include "core/contact/contact.h"

enum { TRACE_CONTACTS_MOST = 200, TRACE_WHY_MOST = 400 };

// How a trace is read.
typedef struct TraceWay {
    int separation;   // Separation
    double threshold; // of detection [N]; NAN: from the noise
    // What pulls the pair together during contact, 0: nothing [m/s^2]. Only with it are used the
    // approach speeds of the contacts in order, as far as known [m/s], and where one is not known
    // the pair's effective mass [kg], NAN: not known, from which and from the force it follows.
    double gravity;
    double effective_mass;
    const double *approach_speeds;
    size_t approach_speed_count;
    const Watch *watch; // asked before each contact whether to go on; NULL: nobody watches
} TraceWay;

// One contact. What is not known is NAN; uncertainties are standard ones.
typedef struct TraceContact {
    double start, end; // of the fitted pulse, from the first sample on [s]
    double first,
        last; // of the samples in contact, or above the threshold where nothing is fitted [s]
    uint64_t samples; // from the one to the other
    double peak;      // largest force above the baseline, with its sign [N]
    double impulse;   // of the fitted pulse, with its sign [N s]
    // Between the crossings of the threshold on the pressing side, which is short of T_c by so much
    // of it as the fitted pulse has it.
    double crossing_time, crossing_uncertainty;    // [s]
    double crossing_shortfall;                     // [-]
    double contact_time, contact_time_uncertainty; // T_c of an isolated pair, by the fit [s]
    double least_contact_time,
        most_contact_time; // within which it lies, 95 %; also where there is no figure [s]
    double restitution, restitution_uncertainty; // by the pulse's shape
    double misfit;                               // rms of what the fit leaves over the noise
    double misfit_share;                         // and over the peak
    bool is_doubtful;                            // a figure is given, but see why
    char *why;                                   // no figure is given, or it is doubtful; NULL
} TraceContact;
typedef struct TraceContacts {
    TraceContact *at;
    size_t count;
} TraceContacts;

typedef struct TraceReading {
    double baseline, noise, threshold; // [N]
    TraceContacts contacts;
    char *why; // there are none, or not all; NULL
} TraceReading;

extern const Field trace_contact_fields[];

// Whether the trace can be read at all: STATUS_INVALID with the fault at `pointer`.
Status trace_check(double interval, const Reals *force, const char *pointer, Problem *problem);

// STATUS_INVALID as trace_check, STATUS_NO_MEMORY, STATUS_CANCELLED. Cleared by trace_reading_clear
// in any case.
Status trace_read(double interval, const Reals *force, const TraceWay *way, const char *pointer,
                  TraceReading *reading, Problem *problem);
void trace_reading_clear(TraceReading *reading);

// The fitted pulse's force without baseline at `count` times from `start` on, for drawing [N]; 0
// everywhere where there is no figure. `approach_speed` [m/s] is used only with gravity.
void trace_pulse(const TraceContact *contact, const TraceWay *way, double approach_speed,
                 double start, double interval, size_t count, double *force);

#endif
