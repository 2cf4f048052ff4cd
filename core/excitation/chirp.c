// A linear sweep, a_g = A sin(p(t)) with p = 2 pi (f0 t + (f1 - f0) t^2 / (2 T)), joined by lines
// between knots h apart. The knots are not the sweep's own values but
//
//   a_g - h^2/12 a_g'',   a_g'' = A (p'' cos p - p'^2 sin p),
//
// so that the mean error over each line is 0 to the fourth order and the largest is (p' h)^2 / 12
// of the amplitude instead of / 8. A structure that is far slower than the knots responds to the
// mean.
#include "core/excitation/excitation.h"

#include "core/base/json_pointer.h"

#include <stdlib.h>

#define PI 3.14159265358979323846264338328L

enum { KNOTS_A_CYCLE = 200, KNOTS_MAX = 1 << 25, KNOTS_WATCHED = 1 << 16 };

// clang-format off
static const Field chirp_fields[] = {
    FIELD_BASE(ExcitationChirp, excitation, excitation_fields),
    FIELD_REAL(ExcitationChirp, start_frequency, "Hz",    AT_MIN(0), REQUIRED, "frequency of the base's motion at the start"),
    FIELD_REAL(ExcitationChirp, end_frequency,   "Hz",    AT_MIN(0), REQUIRED, "frequency at the end of the sweep; linear in time between"),
    FIELD_REAL(ExcitationChirp, amplitude,       "m/s^2", ANY,         REQUIRED, "amplitude of the base's acceleration"),
    FIELD_REAL(ExcitationChirp, sweep_time,      "s",     ABOVE(0),    OPTIONAL, "length of the sweep, the base is still after it; the duration if absent"),
    FIELD_REAL(ExcitationChirp, rate,            "Hz",    ABOVE(0),    OPTIONAL, "knots of the base's acceleration per second, linear between them: within (2 pi f / rate)^2 / 12 of the amplitude; the least multiple of sample_rate with 200 in the shortest cycle if absent"),
    FIELD_END
};
// clang-format on

static const ExcitationChirp *chirp_of(const Excitation *excitation) {
    return (const ExcitationChirp *)(const void *)excitation;
}

static double chirp_highest(const ExcitationChirp *chirp) {
    return fmax(chirp->start_frequency, chirp->end_frequency);
}

// Lines in the whole sweep; a knot ends it.
static double chirp_lines(const ExcitationChirp *chirp) {
    return fmax(ceil(chirp->sweep_time * chirp->rate * (1 - 1e-12)), 1);
}

// Knots up to the end of the sweep, or one past the end of the run where that is earlier.
static double chirp_knots(const ExcitationChirp *chirp, const Span *span) {
    const double lines = chirp_lines(chirp);
    if (chirp->sweep_time < span->duration)
        return lines + 1;
    return floor(span->duration / chirp->sweep_time * lines * (1 + 1e-12)) + 2;
}

static Status chirp_complete(Excitation *excitation, const Span *span, const char *pointer,
                             Problem *problem) {
    ExcitationChirp *chirp = (ExcitationChirp *)(void *)excitation;
    if (isnan(chirp->sweep_time))
        chirp->sweep_time = span->duration;
    if (!(chirp->start_frequency >= 0) || !(chirp->end_frequency >= 0) ||
        !isfinite(chirp_highest(chirp)) || !(chirp->sweep_time > 0) || !isfinite(chirp->sweep_time))
        return STATUS_OK; // the row adds the fault
    if (chirp_highest(chirp) == 0)
        return json_pointer_fault_real(problem, pointer, "end_frequency", chirp->end_frequency,
                                       "Hz",
                                       "must be above 0 Hz where the start frequency is 0 Hz");
    if (isnan(chirp->rate))
        chirp->rate = span->sample_rate *
                      fmax(ceil(KNOTS_A_CYCLE * chirp_highest(chirp) / span->sample_rate), 1);
    const size_t most = span->most != 0 && span->most < KNOTS_MAX ? span->most : KNOTS_MAX;
    if (chirp_highest(chirp) > chirp->rate / 2)
        return json_pointer_fault_real(problem, pointer, "rate", chirp->rate, "Hz",
                                       "must be at least twice the highest frequency, %s Hz, is %s",
                                       real_text(2 * chirp_highest(chirp)).at,
                                       real_text(chirp->rate).at);
    if (!(chirp_knots(chirp, span) - 2 <= (double)most))
        return json_pointer_fault_real(
            problem, pointer, "rate", chirp->rate, "Hz",
            "must make at most %zu knots of the base's acceleration, %s makes "
            "%.0f",
            most, real_text(chirp->rate).at, chirp_knots(chirp, span) - 2);
    return STATUS_OK;
}

static double chirp_interval(const Excitation *excitation) {
    const ExcitationChirp *chirp = chirp_of(excitation);
    return chirp->sweep_time / chirp_lines(chirp);
}

static double chirp_lasts(const Excitation *excitation) {
    return chirp_of(excitation)->sweep_time;
}

static Status chirp_make(const Excitation *excitation, const Span *span, const Progress *progress,
                         Base *base, Problem *problem) {
    const ExcitationChirp *chirp = chirp_of(excitation);
    const double wanted = chirp_knots(chirp, span);
    if (!(wanted <= KNOTS_MAX + 2))
        return problem_set(problem, STATUS_LIMIT, "the base may have at most %d knots, not %.0f",
                           KNOTS_MAX, wanted);
    const size_t count = (size_t)wanted;
    double *values = malloc(count * sizeof *values);
    if (values == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a sweep of %zu knots", count);
    const double interval = chirp_interval(excitation);
    const long double f0 = chirp->start_frequency, f1 = chirp->end_frequency;
    const long double climb = (f1 - f0) / chirp->sweep_time;
    const double bend = (double)(2 * PI * climb), share = interval * interval / 12;
    for (size_t i = 0; i < count; i++) {
        if (i % KNOTS_WATCHED == 0 && !progress_advance(progress, (double)i / (double)count)) {
            free(values);
            return problem_set(problem, STATUS_CANCELLED,
                               "stopped while the base's motion was made");
        }
        const long double t = (long double)i * interval, cycles = t * (f0 + climb * t / 2);
        const double phase = (double)(2 * PI * (cycles - floorl(cycles)));
        const double omega = (double)(2 * PI * (f0 + climb * t));
        values[i] = chirp->amplitude *
                    ((1 + share * omega * omega) * sin(phase) - share * bend * cos(phase));
    }
    *base = (Base){.form = BASE_SAMPLED, .values = values, .count = count, .interval = interval};
    return STATUS_OK;
}

static double chirp_band(const Excitation *excitation, double band[2]) {
    const ExcitationChirp *chirp = chirp_of(excitation);
    band[0] = 2 * (double)PI * fmin(chirp->start_frequency, chirp->end_frequency);
    band[1] = 2 * (double)PI * chirp_highest(chirp);
    return fabs(chirp->amplitude);
}

static void chirp_doubt(const Excitation *excitation, const Span *span, const char *pointer,
                        Problem *doubts) {
    const ExcitationChirp *chirp = chirp_of(excitation);
    const double omega = 2 * (double)PI * chirp_highest(chirp), turn = omega / chirp->rate;
    if (turn * turn / 12 > 1e-3)
        (void)json_pointer_fault(
            doubts, pointer, "rate",
            "is %s Hz, too few for %s Hz: the lines between the knots miss the sweep "
            "by up to %.2g of its amplitude",
            real_text(chirp->rate).at, real_text(chirp_highest(chirp)).at, turn * turn / 12);
    const bool is_end = chirp->end_frequency >= chirp->start_frequency;
    excitation_doubt_frequency(chirp_highest(chirp), span, pointer,
                               is_end ? "end_frequency" : "start_frequency", doubts);
}

const ExcitationKind excitation_chirp = {
    .kind = {"chirp", "a sine of the base's acceleration whose frequency sweeps evenly",
             chirp_fields, sizeof(ExcitationChirp)},
    .complete = chirp_complete,
    .band = chirp_band,
    .interval = chirp_interval,
    .lasts = chirp_lasts,
    .effort = 1.5,
    .make = chirp_make,
    .doubt = chirp_doubt,
};
