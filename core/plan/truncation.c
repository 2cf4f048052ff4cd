// Mode by mode from the fastest down, what is left out is added up at every storey: what follows
// the base adds as it stands, what swings at frequencies of its own seldom comes together.
//
// A damper does two things. Its impacts strike the modes left out as they strike the others. And a
// storey that keeps too few modes is too heavy for a blow and too still between blows, so that each
// impulse is off by a part of itself; of what the impacts have done to the motion that part is
// wrong, and each impact after carries it on.
#include "core/plan/truncation.h"

#include <math.h>
#include <stdlib.h>

#include "core/plan/truncation_levels.h"

static const double TOGETHER = 2.5; // swings of many modes come to more than this times their root
                                    // of squares in few runs
static const double APART = 0.7; // the largest displacement is seldom less than this times that

// At one storey, of the modes left out so far, or of all.
typedef struct Sum {
    double pushed[2];      // the wave
    double start;          // at t = 0
    double peaks, squares; // of the rest: sum of peaks, and of their squares
    double mean;           // mean square of the rest
    double least;          // sum of squares of what is seldom missed
} Sum;

static void add(Sum *sum, double shape, const Level *level) {
    sum->pushed[0] += shape * level->pushed[0];
    sum->pushed[1] += shape * level->pushed[1];
    sum->start += shape * level->start;
    sum->peaks += fabs(shape) * level->peak;
    sum->squares += shape * shape * level->peak * level->peak;
    sum->mean += shape * shape * level->rms * level->rms;
    sum->least += shape * shape * level->least * level->least;
}

static double wave_of(const Sum *sum) {
    return hypot(sum->pushed[0], sum->pushed[1]);
}

// Displacement, seldom more.
static double most_of(const Sum *sum) {
    return wave_of(sum) + fmin(sum->peaks, fmax(TOGETHER * sqrt(sum->squares), fabs(sum->start)));
}

static double mean_square(const Sum *sum, const Wave *wave) {
    const double pushed = wave_of(sum) * wave->rms;
    return pushed * pushed + sum->mean;
}

// What all modes make of the scene.
typedef struct Whole {
    double displacement; // largest, seldom less
    double rms;          // of the storey where it is largest
    double acceleration; // sum over storeys of mean squares, absolute
} Whole;

static Whole whole_of(const Plan *plan, const Level *levels, const Wave *wave) {
    const Modes *modes = &plan->modes;
    const size_t n = modes->count;
    Whole whole = {0};
    for (size_t j = 0; j < plan->storeys; j++) {
        Sum sum = {0};
        double pull[2] = {0}, swings = 0;
        for (size_t k = 0; k < n; k++) {
            const double shape = modes->shapes[j * n + k],
                         stiff = modes->omega[k] * modes->omega[k];
            add(&sum, shape, &levels[k]);
            for (int i = 0; i < 2; i++)
                pull[i] += shape * stiff * levels[k].pushed[i] * wave->rms;
            swings += shape * shape * levels[k].accelerated * levels[k].accelerated;
        }
        const double least = fmax(wave_of(&sum) * wave->least, APART * sqrt(sum.least));
        whole.displacement = fmax(whole.displacement, fmax(least, fabs(plan->displacement[j])));
        whole.rms = fmax(whole.rms, sqrt(mean_square(&sum, wave)));
        whole.acceleration += pull[0] * pull[0] + pull[1] * pull[1] + swings;
    }
    return whole;
}

// a / b, at most 1; 0 where there is nothing.
static double part(double a, double b) {
    return a > 0 ? (b > 0 && a < b ? a / b : 1) : 0;
}

static Status predict(const Plan *plan, const Level *levels, const Wave *wave,
                      TruncationError *errors) {
    const Modes *modes = &plan->modes;
    const size_t n = modes->count;
    const Whole whole = whole_of(plan, levels, wave);
    Sum *sums = calloc(plan->storeys, sizeof *sums);
    if (sums == NULL)
        return STATUS_NO_MEMORY;
    double swings = 0;
    errors[n - 1] = (TruncationError){0};
    for (size_t k = n - 1; k > 0; k--) {
        double most = 0, rms = 0, pushed = 0;
        for (size_t j = 0; j < plan->storeys; j++) {
            const double shape = modes->shapes[j * n + k];
            add(&sums[j], shape, &levels[k]);
            swings += shape * shape * levels[k].accelerated * levels[k].accelerated;
            most = fmax(most, most_of(&sums[j]));
            rms = fmax(rms, sqrt(mean_square(&sums[j], wave)));
            const double moved = wave_of(&sums[j]) * wave->rms * wave->accelerated;
            pushed += moved * moved;
        }
        errors[k - 1] = (TruncationError){
            .displacement = part(most, whole.displacement),
            .mean_acceleration = part(sqrt(pushed + swings), sqrt(whole.acceleration)),
            .rms_displacement = part(rms, whole.rms),
        };
    }
    free(sums);
    return STATUS_OK;
}

Status truncation_predict(const Plan *plan, const Scene *scene, TruncationError *errors) {
    const size_t n = plan->modes.count;
    if (n == 0)
        return STATUS_OK;
    Wave wave;
    Level *levels = malloc(n * sizeof *levels);
    Status status = levels == NULL ? STATUS_NO_MEMORY : levels_make(plan, scene, levels, &wave);
    if (status == STATUS_OK)
        status = predict(plan, levels, &wave, errors);
    free(levels);
    return status;
}

double truncation_moved_mass(const Plan *plan, size_t kept) {
    const Modes *modes = &plan->modes;
    double sum = 0, all = 0;
    for (size_t k = 0; k < modes->count; k++) {
        const double mass = modes->participation[k] * modes->participation[k];
        all += mass;
        sum += k < kept ? mass : 0;
    }
    return all > 0 ? sum / all : 1;
}
