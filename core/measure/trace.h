// Contacts in a force transducer's record: found above baseline and noise, then fitted with the
// model's pulse under a separation rule. Not statistics over several of them (evaluation.h). Used
// by evaluation.c.
#ifndef CORE_MEASURE_TRACE_H
#define CORE_MEASURE_TRACE_H

#include "core/base/field.h"
#include "core/contact/contact.h"

enum { TRACE_CONTACTS_MOST = 1000 };

// How a trace is read.
typedef struct TraceWay {
    int separation;                // Separation
    double threshold;              // of detection [N]; NAN: from the noise
    double effective_mass;         // of the pair, used only with gravity; NAN: not known [kg]
    double gravity;                // that pulls the pair together during contact; 0: none [m/s^2]
    const double *approach_speeds; // of the contacts in order, used only with gravity [m/s]
    size_t approach_speed_count;
} TraceWay;

// One contact. What is not known is NAN; uncertainties are standard ones.
typedef struct TraceContact {
    double start, end;                             // of the fitted pulse [s]
    double first, last;                            // of the samples in contact [s]
    uint64_t samples;                              // in contact
    double peak;                                   // largest force above the baseline [N]
    double impulse;                                // [N s]
    double crossing_time, crossing_uncertainty;    // between crossings of the threshold [s]
    double contact_time, contact_time_uncertainty; // of an isolated pair, by the fit [s]
    double least_contact_time,
        most_contact_time; // within which it lies, 95 %; also where there is no figure [s]
    double restitution, restitution_uncertainty; // by the pulse's shape
    double misfit; // rms of what the fit leaves over the noise; large: the trace is not the model's
    char *why;     // no figure is given, or it is doubtful; NULL
} TraceContact;
typedef struct TraceContacts {
    TraceContact *at;
    size_t count;
} TraceContacts;

typedef struct TraceReading {
    double baseline, noise, threshold; // [N]
    TraceContacts contacts;
    char *why; // there are none
} TraceReading;

extern const Field trace_contact_fields[];

// Faults only where the trace cannot be read at all (STATUS_INVALID at `pointer`),
// STATUS_NO_MEMORY. Cleared by trace_reading_clear in any case.
Status trace_read(double interval, const Reals *force, const TraceWay *way, const char *pointer,
                  TraceReading *reading, Problem *problem);
void trace_reading_clear(TraceReading *reading);

// The fitted pulse's force without baseline at `count` times from `start` on, for drawing [N].
void trace_pulse(const TraceContact *contact, const TraceWay *way, double start, double interval,
                 size_t count, double *force);

#endif
