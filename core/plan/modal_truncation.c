// Mode by mode from the fastest down, what is left out is added up at every storey: what follows
// the base adds as it stands, what swings at frequencies of its own seldom comes together.
//
// A damper does two things. Its impacts strike the modes left out as they strike the others. And a
// storey that keeps too few modes is too heavy for a blow and too still between blows, so that each
// impulse is off by a part of itself; of what the impacts have done to the motion that part is
// wrong, and each impact after carries it on.
#include "core/plan/modal_truncation.h"

#include <math.h>
#include <stdlib.h>

#include "core/plan/truncation_blows.h"
#include "core/plan/truncation_levels.h"

static const double TOGETHER = 2.5; // swings of many modes come to more than this times their root
                                    // of squares in few runs
static const double ROUGH = 1.25, ROUGHER = 2.3; // displacement and rms; acceleration
static const double TIED = 2;                    // where damping couples the modes
static const double APART = 0.7; // the largest displacement is seldom less than this times that

// At one storey, of the modes left out so far, or of all.
typedef struct Sum {
    double pushed[2];      // the wave
    double start;          // at t = 0
    double peaks, squares; // of the rest: sum of peaks, and of their squares
    double mean;           // mean square of the rest
    double like;           // of that which goes like the motion's largest part for the run's time
    double least;          // sum of squares of what is seldom missed
} Sum;

static void add(Sum *sum, double shape, const Level *level, double like) {
    sum->pushed[0] += shape * level->pushed[0];
    sum->pushed[1] += shape * level->pushed[1];
    sum->start += shape * level->start;
    sum->peaks += fabs(shape) * level->peak;
    sum->squares += shape * shape * level->peak * level->peak;
    sum->mean += shape * shape * level->rms * level->rms;
    sum->like += pow(shape * level->rms * like, 2);
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
        double pull[2] = {0}, swings = 0, calm = 0;
        for (size_t k = 0; k < n; k++) {
            const double shape = modes->shapes[j * n + k],
                         stiff = modes->omega[k] * modes->omega[k];
            add(&sum, shape, &levels[k], 0);
            for (int i = 0; i < 2; i++)
                pull[i] += shape * stiff * levels[k].pushed[i] * wave->rms;
            const double own = shape * levels[k].accelerated * levels[k].sure;
            swings += own * own;
            calm += pow(shape * levels[k].rms * levels[k].sure, 2);
        }
        sum.mean = calm;
        const double least = fmax(wave_of(&sum) * wave->least, APART * sqrt(sum.least));
        whole.displacement = fmax(whole.displacement, fmax(least, fabs(plan->displacement[j])));
        whole.rms = fmax(whole.rms, sqrt(mean_square(&sum, wave)));
        whole.acceleration += pull[0] * pull[0] + pull[1] * pull[1] + swings;
    }
    return whole;
}

// What coupled damping does to the modes kept by those left out, through these: it shifts their
// frequencies, by D_jk^2 / (2 w_k^2) of them, and with time their phases.
typedef struct Shift {
    double part;   // of the frequency
    double turned; // what a whole part of it would come to, times how far the mode moves [m]
} Shift;

static void start_shifts(const Plan *plan, const Level *levels, Shift *shifts) {
    const Modes *modes = &plan->modes;
    const size_t n = modes->count;
    for (size_t j = 0; j < n; j++) {
        const double slack = modes->damping[j * (n + 1)] / 2;
        double widest = 0;
        for (size_t i = 0; i < plan->storeys; i++)
            widest = fmax(widest, fabs(modes->shapes[i * n + j]));
        const double size = levels[j].peak + hypot(levels[j].pushed[0], levels[j].pushed[1]);
        shifts[j] = (Shift){0, widest * size * modes->omega[j] *
                                   fmin(plan->duration, 1 / fmax(slack, 1e-300))};
    }
}

// The modes from k on are left out.
static double shift(const Modes *modes, size_t k, Shift *shifts) {
    const double square = modes->omega[k] * modes->omega[k];
    double most = 0;
    for (size_t j = 0; j < k; j++) {
        const double tie = modes->damping[j * modes->count + k];
        shifts[j].part += tie * tie / (2 * square);
        most += shifts[j].part * shifts[j].turned;
    }
    return most;
}

// The mode with most of the motion.
static size_t find_largest(const Plan *plan, const Level *levels) {
    const Modes *modes = &plan->modes;
    size_t largest = 0;
    double most = 0;
    for (size_t k = 0; k < modes->count; k++) {
        double widest = 0;
        for (size_t j = 0; j < plan->storeys; j++)
            widest = fmax(widest, fabs(modes->shapes[j * modes->count + k]));
        if (widest * levels[k].rms > most) {
            most = widest * levels[k].rms;
            largest = k;
        }
    }
    return largest;
}

// How alike two modes swing on the whole: hardly, where their frequencies part in the time there
// is.
static double alike(const Plan *plan, size_t k, size_t of) {
    const Modes *modes = &plan->modes;
    const size_t next = modes->count + 1;
    const double slack = (modes->damping[k * next] + modes->damping[of * next]) / 2;
    const double time = fmin(plan->duration, 1 / fmax(slack, 1e-300));
    return fmin(1, 3 / fmax(fabs(modes->omega[k] - modes->omega[of]) * time, 1e-300));
}

// a / b, at most 1, which is also what cannot be told; 0 where there is nothing.
static double part(double a, double b) {
    return a == 0 ? 0 : b > 0 && a < b ? a / b : 1;
}

static Status predict(const Plan *plan, const Level *levels, const Wave *wave,
                      TruncationError *errors) {
    const Modes *modes = &plan->modes;
    const size_t n = modes->count;
    const Whole whole = whole_of(plan, levels, wave);
    const double tied = modes->is_classical ? 1 : TIED;
    Sum *sums = calloc(plan->storeys, sizeof *sums);
    Shift *shifts = calloc(n, sizeof *shifts);
    Blows *blows = calloc(plan->damper_count + 1, sizeof *blows);
    if (sums == NULL || shifts == NULL || blows == NULL) {
        free(sums);
        free(shifts);
        free(blows);
        return STATUS_NO_MEMORY;
    }
    start_shifts(plan, levels, shifts);
    size_t struck = 0; // dampers
    for (size_t d = 0; d < plan->damper_count; d++)
        struck += blows_start(&blows[struck], plan, d, levels, wave);
    const size_t largest = find_largest(plan, levels);
    double swings = 0;
    errors[n - 1] = (TruncationError){0};
    for (size_t k = n - 1; k > 0; k--) {
        double most = 0, rms = 0, pushed = 0;
        const double like = alike(plan, k, largest);
        for (size_t j = 0; j < plan->storeys; j++) {
            const double shape = modes->shapes[j * n + k];
            add(&sums[j], shape, &levels[k], like);
            swings += shape * shape * levels[k].accelerated * levels[k].accelerated;
            most = fmax(most, most_of(&sums[j]));
            // What goes like the rest adds to its rms; what does not, to its square.
            rms = fmax(rms, hypot(wave_of(&sums[j]) * wave->rms, sqrt(sums[j].like)) +
                                sums[j].mean / (2 * whole.rms));
            const double moved = wave_of(&sums[j]) * wave->rms * wave->accelerated;
            pushed += moved * moved;
        }
        Blow blow = {0};
        for (size_t d = 0; d < struck; d++) {
            const Blow one = blows_leave(&blows[d], k);
            blow.displacement += one.displacement;
            blow.acceleration = hypot(blow.acceleration, one.acceleration);
            blow.rms += one.rms;
        }
        const double shifted = modes->is_classical ? 0 : shift(modes, k, shifts);
        errors[k - 1] = (TruncationError){
            .displacement = part(ROUGH * (most + shifted) + blow.displacement, whole.displacement),
            .mean_acceleration = part(ROUGHER * tied * sqrt(pushed + swings) + blow.acceleration,
                                      sqrt(whole.acceleration)),
            .rms_displacement = part(ROUGH * rms + blow.rms, whole.rms),
        };
    }
    free(blows);
    free(shifts);
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
