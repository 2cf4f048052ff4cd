#include "tests/truth/reference_compare.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/base/field.h"
#include "tests/support/doubles.h"

static const double AUDIBLE = 1e-9; // of the largest approach speed: impacts below are not compared
static const double SILENT = 1e-13; // of the free mass's largest speed: neither are those

const char *const reference_metric_names[MISS_COUNT] = {
    "displacement",        "start",           "velocity",
    "damper_displacement", "damper_velocity", "mean_acceleration",
    "contact_force",       "approach_speed",  "separation_speed",
    "peak_force",          "impulse",         "energy_lost",
    "rest start",          "rest end",        "rest peak_force"};

// Scales of a run.
typedef struct Scale {
    double least; // approach speed that counts
    double speed, peak, impulse, lost, length, rest_peak;
} Scale;

static Scale scale_of(const ReferenceScene *scene, const ReferenceAnswer *answer) {
    Scale scale = {0, 0, 0, 0, 0, scene->clearance, 0};
    scale.length = fmax(scale.length,
                        doubles_largest(answer->channels[REFERENCE_DISPLACEMENT], answer->count));
    for (size_t i = 0; i < answer->impact_count; i++) {
        const ReferenceImpact *impact = &answer->impacts[i];
        if (impact->is_resting) {
            scale.rest_peak = fmax(scale.rest_peak, impact->peak);
            continue;
        }
        scale.speed = fmax(scale.speed, impact->approach);
        scale.peak = fmax(scale.peak, impact->peak);
        scale.impulse = fmax(scale.impulse, impact->impulse);
        scale.lost = fmax(scale.lost, impact->lost);
    }
    scale.least =
        fmax(AUDIBLE * scale.speed,
             SILENT * doubles_largest(answer->channels[REFERENCE_DAMPER_VELOCITY], answer->count));
    return scale;
}

static void miss(ReferenceMisses *misses, ReferenceMetric metric, double value, double truth,
                 double scale) {
    if (isnan(truth) && isnan(value))
        return;
    const double error = value == truth ? 0 : fabs(value - truth) / scale;
    if (!(error <= misses->of[metric]))
        misses->of[metric] = isnan(error) ? INFINITY : error;
}

// Is there an event so near that right and left of it cannot be told apart?
static bool is_near_event(const ReferenceAnswer *truth, double time) {
    for (size_t i = 0; i < truth->impact_count; i++)
        if (fabs(truth->impacts[i].start - time) < 1e-7 ||
            fabs(truth->impacts[i].end - time) < 1e-7)
            return true;
    return false;
}

static const ReferenceImpact *next_impact(const ReferenceAnswer *answer, size_t *i, bool is_resting,
                                          double least) {
    for (; *i < answer->impact_count; (*i)++) {
        const ReferenceImpact *impact = &answer->impacts[*i];
        if (impact->is_resting != is_resting)
            continue;
        if (is_resting ? !(impact->end - impact->start < least) : impact->approach > least)
            return &answer->impacts[(*i)++];
    }
    return NULL;
}

static void compare_impacts(const ReferenceAnswer *answer, const ReferenceAnswer *truth,
                            const Scale *scale, ReferenceMisses *misses) {
    size_t i = 0, j = 0;
    for (size_t number = 0;; number++) {
        const ReferenceImpact *want = next_impact(truth, &j, false, scale->least);
        const ReferenceImpact *have = next_impact(answer, &i, false, 0.99 * scale->least);
        // Speeds that lie astride the threshold.
        while (have != NULL && (want == NULL || have->start < want->start - 1e-9) &&
               have->approach < 1.01 * scale->least)
            have = next_impact(answer, &i, false, 0.99 * scale->least);
        if (want == NULL && have == NULL)
            break;
        if (want == NULL || have == NULL || want->side != have->side ||
            (isnan(want->end) != isnan(have->end))) {
            snprintf(misses->why, sizeof misses->why,
                     "impact %zu: wanted %d %.17g %.3g, got %d %.17g %.3g", number,
                     want != NULL ? want->side : -1, want != NULL ? want->start : NAN,
                     want != NULL ? want->approach : NAN, have != NULL ? have->side : -1,
                     have != NULL ? have->start : NAN, have != NULL ? have->approach : NAN);
            misses->is_same = false;
            return;
        }
        miss(misses, MISS_START, have->start * want->approach, want->start * want->approach,
             scale->length);
        miss(misses, MISS_APPROACH, have->approach, want->approach, scale->speed);
        miss(misses, MISS_SEPARATION, have->separation, want->separation, scale->speed);
        miss(misses, MISS_PEAK, have->peak, want->peak, scale->peak);
        miss(misses, MISS_IMPULSE, have->impulse, want->impulse, scale->impulse);
        miss(misses, MISS_LOST, have->lost, want->lost, scale->lost);
    }
}

static void compare_rests(const ReferenceAnswer *answer, const ReferenceAnswer *truth,
                          const Scale *scale, ReferenceMisses *misses) {
    size_t i = 0, j = 0;
    for (size_t number = 0;; number++) {
        const ReferenceImpact *want = next_impact(truth, &j, true, 1e-6);
        const ReferenceImpact *have = next_impact(answer, &i, true, 1e-6);
        if (want == NULL && have == NULL)
            break;
        if (want == NULL || have == NULL || want->side != have->side ||
            isnan(want->end) != isnan(have->end)) {
            snprintf(misses->why, sizeof misses->why,
                     "rest %zu: wanted %d %.17g %.17g, got %d %.17g %.17g", number,
                     want != NULL ? want->side : -1, want != NULL ? want->start : NAN,
                     want != NULL ? want->end : NAN, have != NULL ? have->side : -1,
                     have != NULL ? have->start : NAN, have != NULL ? have->end : NAN);
            misses->is_same = false;
            return;
        }
        miss(misses, MISS_REST_START, have->start, want->start, 1);
        miss(misses, MISS_REST_END, have->end, want->end, 1);
        miss(misses, MISS_REST_PEAK, have->peak, want->peak, scale->rest_peak);
        miss(misses, MISS_IMPULSE, have->impulse, want->impulse,
             fmax(want->impulse, scale->impulse));
    }
}

void reference_compare(const ReferenceScene *scene, const ReferenceAnswer *answer,
                       const ReferenceAnswer *truth, ReferenceMisses *misses) {
    memset(misses, 0, sizeof *misses);
    misses->is_same = true;
    const Scale scale = scale_of(scene, truth);
    const struct {
        ReferenceMetric metric;
        int channel;
    } of[] = {{MISS_DISPLACEMENT, REFERENCE_DISPLACEMENT},
              {MISS_VELOCITY, REFERENCE_VELOCITY},
              {MISS_DAMPER_DISPLACEMENT, REFERENCE_DAMPER_DISPLACEMENT},
              {MISS_DAMPER_VELOCITY, REFERENCE_DAMPER_VELOCITY},
              {MISS_MEAN_ACCELERATION, REFERENCE_MEAN_ACCELERATION},
              {MISS_FORCE, REFERENCE_FORCE}};
    if (answer->count != truth->count) {
        snprintf(misses->why, sizeof misses->why, "%zu samples, not %zu", answer->count,
                 truth->count);
        misses->is_same = false;
        return;
    }
    for (size_t i = 0; i < COUNT(of); i++) {
        const double *a = answer->channels[of[i].channel], *b = truth->channels[of[i].channel];
        const double most = doubles_largest(b, truth->count);
        for (size_t n = 0; n < truth->count; n++) {
            if (a[n] == b[n] || (i > 0 && is_near_event(truth, (double)n / scene->sample_rate)))
                continue;
            miss(misses, of[i].metric, a[n], b[n], most > 0 ? most : 1);
        }
    }
    compare_impacts(answer, truth, &scale, misses);
    if (misses->is_same)
        compare_rests(answer, truth, &scale, misses);
}
