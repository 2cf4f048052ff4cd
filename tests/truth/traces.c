// y'' + 2 Z w y' + w^2 y = 0 solved by the textbook, with k_b and c_b from e and T_c by the
// identification: F = k_b y + c_b y' until T_c.
#include "traces.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/philox.h"
#include "core/contact/identification.h"
#include "core/drop_test/force_trace.h"

static double force_of(const Identification *pair, double contact_time, double time) {
    if (time < 0 || time > contact_time)
        return 0;
    const double w = sqrt(pair->stiffness), Z = pair->damping_ratio;
    const double root = w * sqrt(fabs(1 - Z * Z)), fall = exp(-Z * w * time);
    const double sine = Z < 1 ? sin(root * time) : sinh(root * time);
    const double cosine = Z < 1 ? cos(root * time) : cosh(root * time);
    const double y = fall * sine / root, speed = fall * (cosine - Z * w / root * sine);
    return pair->stiffness * y + pair->damping * speed;
}

static double peak_of(const Identification *pair, double contact_time) {
    double peak = 0;
    for (int i = 0; i <= 2000; i++)
        peak = fmax(peak, force_of(pair, contact_time, contact_time * i / 2000));
    return peak;
}

double traces_force(double restitution, double contact_time, int separation, double time) {
    const Identification pair =
        identification_from_restitution(1, restitution, contact_time, (Separation)separation);
    return force_of(&pair, contact_time, time);
}

double traces_peak(double restitution, double contact_time, int separation) {
    const Identification pair =
        identification_from_restitution(1, restitution, contact_time, (Separation)separation);
    return peak_of(&pair, contact_time);
}

static double uniform(uint64_t seed, uint64_t trial, uint32_t which) {
    const uint32_t counter[4] = {(uint32_t)trial, (uint32_t)(trial >> 32), which, 0x7ace};
    const uint32_t key[2] = {(uint32_t)seed, (uint32_t)(seed >> 32)};
    uint32_t out[4];
    philox_words(counter, key, out);
    return (out[0] + 0.5) / 4294967296.0;
}

double *traces_draw(const TraceCell *cell, uint64_t seed, uint64_t trial, size_t *count) {
    const double interval = cell->contact_time / cell->samples;
    const double before = fmax(cell->before * cell->samples, 4);
    *count = (size_t)ceil(2 * before + cell->samples) + 2;
    const size_t pairs = (*count + 1) / 2;
    double *force = calloc(2 * pairs, sizeof *force);
    if (force == NULL)
        return NULL;
    philox_normal_pairs(seed, trial, 0, pairs, force);
    // Just before the sample, so that an end on a sample is over there.
    const double phase = cell->is_on_grid ? -1e-9 : uniform(seed, trial, 1);
    const double start = (ceil(before) + phase) * interval;
    const Identification pair = identification_from_restitution(
        1, cell->restitution, cell->contact_time, (Separation)cell->separation);
    const double peak = peak_of(&pair, cell->contact_time);
    const double scale = cell->scale != 0 ? cell->scale : 1;
    for (size_t i = 0; i < *count; i++) {
        const double pulse = force_of(&pair, cell->contact_time, (double)i * interval - start);
        force[i] = scale * (cell->noise * force[i] + pulse / peak + cell->offset +
                            cell->drift * (double)i / (double)*count);
    }
    return force;
}

TraceScore traces_score(const TraceCell *cell, uint64_t seed, size_t trials) {
    TraceScore score = {.trials = trials};
    const double T = cell->contact_time, interval = T / cell->samples;
    double error = 0, square = 0, stated = 0;
    for (uint64_t trial = 0; trial < trials; trial++) {
        Reals force;
        force.at = traces_draw(cell, seed, trial, &force.count);
        const TraceOptions way = {.separation = cell->separation, .threshold = (double)NAN};
        TraceAnalysis reading;
        if (force.at != NULL &&
            trace_analysis_run(interval, &force, &way, "", &reading, NULL) == STATUS_OK) {
            score.found += reading.contacts.count == 1;
            const TraceContact *contact = NULL;
            for (size_t i = 0; i < reading.contacts.count; i++)
                if (contact == NULL ||
                    fabs(reading.contacts.at[i].seen.peak) > fabs(contact->seen.peak))
                    contact = &reading.contacts.at[i];
            if (contact != NULL) {
                const bool is_figure = !isnan(contact->contact_time);
                const bool is_covered =
                    contact->least_contact_time <= T && T <= contact->most_contact_time;
                score.covered_all += is_covered;
                score.below += contact->most_contact_time < T;
                score.above += contact->least_contact_time > T;
                score.figures += is_figure;
                score.doubtful += is_figure && contact->why != NULL;
                if (is_figure) {
                    const double off = contact->contact_time / T - 1;
                    score.covered += is_covered;
                    error += off;
                    square += off * off;
                    stated += pow(contact->contact_time_uncertainty / T, 2);
                    score.worst = fmax(score.worst, fabs(off));
                    score.worst_restitution = fmax(score.worst_restitution,
                                                   fabs(contact->restitution - cell->restitution));
                }
            }
            trace_analysis_clear(&reading);
        }
        free(force.at);
    }
    const double n = (double)trials, figures = (double)score.figures;
    score.covered /= figures;
    score.covered_all /= n;
    score.below /= n;
    score.above /= n;
    score.bias = error / figures;
    score.rms = sqrt(square / figures);
    score.stated = sqrt(stated / figures);
    return score;
}
