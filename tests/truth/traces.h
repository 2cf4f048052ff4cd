// Force traces of drop tests whose e and T_c are known: the closed form of one contact, sampled,
// with noise and baseline, and how often what is read from many of them covers the truth. Not the
// reading (core/drop_test/force_trace.h). Used by test_traces.c.
#ifndef TESTS_TRUTH_TRACES_H
#define TESTS_TRUTH_TRACES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct TraceCell {
    int separation;
    double restitution, contact_time;
    double samples;       // T_c over the interval
    double noise;         // standard deviation over the peak
    double before;        // baseline before and after the contact, in T_c
    double offset, drift; // of the baseline, over the peak; the latter over the trace
    double scale;         // of the force, either sign [N]; 0: 1
    bool is_on_grid;      // the contact begins on a sample, which has its force already
} TraceCell;

// Shares of the trials, and means over those with a figure.
typedef struct TraceScore {
    size_t trials, figures, doubtful, found; // found: one contact, as there is
    double covered,
        covered_all;     // the truth within the stated interval: of those with a figure, of all
    double below, above; // the interval lies below the truth, above it; of all
    double bias, rms, stated; // of T_c over T_c: mean error, rms error, rms stated uncertainty
    double worst;             // largest error of T_c over T_c
    double worst_restitution; // of e
} TraceScore;

// The force between a pair of effective mass 1 that meets at speed 1, at a time since it touched.
double traces_force(double restitution, double contact_time, int separation, double time);

// The largest of it.
double traces_peak(double restitution, double contact_time, int separation);

// One trace with one contact, of *count samples; freed by the caller. The phase of the first
// sample, unless on grid, and the noise follow from `seed` and `trial`.
double *traces_draw(const TraceCell *cell, uint64_t seed, uint64_t trial, size_t *count);

TraceScore traces_score(const TraceCell *cell, uint64_t seed, size_t trials);

#endif
