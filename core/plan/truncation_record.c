// A record is integrated mode by mode, being linear between its samples; of long records some of
// the modes are, and the others lie between these.
#include <math.h>

#include "core/math/matrix_exponential.h"
#include "core/plan/truncation_mode.h"

// What one mode makes of a record, share 1.
typedef struct Integrated {
    double peak, rms;        // of q
    double stray, stray_rms; // of q + a_g / w^2
    double accelerated;      // rms of q'' over the record's intervals
} Integrated;

static Integrated integrate(const Mode *mode, const ExcitationRecord *base) {
    enum { Q, P, A, B, SIZE };
    const double omega = omega_of(mode, mode->time), wave = 1 / square(omega);
    const double interval = record_interval(base);
    const Reals *samples = record_samples(base);
    long double system[SIZE * SIZE] = {0}, gain[SIZE * SIZE];
    system[Q * SIZE + P] = system[A * SIZE + B] = 1;
    system[P * SIZE + Q] = -(long double)omega * omega;
    system[P * SIZE + P] = -2 * (long double)mode->slack;
    system[P * SIZE + A] = -1;
    exponential_increment(system, SIZE, interval, gain);
    double g[2][4];
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 4; j++)
            g[i][j] = (double)gain[i * SIZE + j];
    const double last = floor(mode->time / interval);
    const size_t count = last + 1 < (double)samples->count ? (size_t)last + 1 : samples->count;
    double q = 0, p = 0, peak = 0, stray = 0, sums[3] = {0};
    for (size_t i = 0; i + 1 < count; i++) {
        const double a = samples->at[i] * base->scale;
        const double b = (samples->at[i + 1] * base->scale - a) / interval;
        const double dq = g[0][0] * q + g[0][1] * p + g[0][2] * a + g[0][3] * b;
        const double dp = g[1][0] * q + g[1][1] * p + g[1][2] * a + g[1][3] * b;
        q += dq;
        p += dp;
        const double off = q + wave * (a + b * interval);
        peak = fmax(peak, fabs(q));
        stray = fmax(stray, fabs(off));
        sums[0] += q * q;
        sums[1] += off * off;
        sums[2] += dp * dp;
    }
    const double rest = hypot(q, p / omega);
    const double after = fmax(mode->time - (double)(count - 1) * interval, 0);
    const double left = square(rest) / 2 * kept(mode->slack, after) * after;
    const bool goes_on = after > interval;
    return (Integrated){
        .peak = fmax(peak, goes_on ? rest : 0),
        .rms = sqrt((sums[0] * interval + left) / mode->time),
        .stray = fmax(stray, goes_on ? rest : 0),
        .stray_rms = sqrt((sums[1] * interval + left) / mode->time),
        .accelerated = sqrt((sums[2] / interval + left * square(square(omega))) / mode->time),
    };
}

static void record_level(Level *level, const Mode *mode, const Integrated *at, double highest) {
    const double share = fabs(mode->share), wave = 1 / square(omega_of(mode, mode->time));
    const bool is_stiff = at->stray < at->peak;
    if (is_stiff)
        level->pushed[0] = -mode->share * wave * highest;
    level->peak += share * (is_stiff ? at->stray : at->peak);
    level->rms = hypot(level->rms, share * (is_stiff ? at->stray_rms : at->rms));
    level->accelerated =
        hypot(level->accelerated,
              share * fmax(at->accelerated, mean_of(mode->omega, mode->interval) / wave *
                                                (is_stiff ? at->stray_rms : at->rms)));
    level->least = fmax(level->least, share * at->peak);
}

static double between(double a, double b, double part) {
    return a > 0 && b > 0 ? exp(log(a) + part * (log(b) - log(a))) : fmax(a, b);
}

void levels_of_record(const Plan *plan, const ExcitationRecord *base, Level *levels, Wave *wave) {
    static const double steps_max = 2e6; // about what the modes themselves take to be found
    static const double doubt = 1.5;     // of what lies between
    const size_t n = plan->modes.count;
    const double interval = record_interval(base);
    const Reals *samples = record_samples(base);
    double highest = 0, sum = 0;
    for (size_t i = 0; i < samples->count; i++) {
        highest = fmax(highest, fabs(samples->at[i] * base->scale));
        sum += square(samples->at[i] * base->scale) * interval;
    }
    *wave = (Wave){highest > 0 ? fmin(sqrt(sum / plan->duration) / highest, 1) : 0, 1, 0};
    const double fit = steps_max / (double)samples->count;
    const size_t stride = fit < (double)n ? (size_t)ceil((double)n / fmax(fit, 6)) : 1;
    size_t from = 0;
    Mode mode = mode_of(plan, 0);
    Integrated before = integrate(&mode, base), next = before;
    record_level(&levels[0], &mode, &before, highest);
    for (size_t to = 0; to + 1 < n; from = to, before = next) {
        to = from + stride < n ? from + stride : n - 1;
        const Mode last = mode_of(plan, to), first = mode_of(plan, from);
        next = integrate(&last, base);
        record_level(&levels[to], &last, &next, highest);
        for (size_t k = from + 1; k < to; k++) {
            mode = mode_of(plan, k);
            const double part = log(fmax(mode.omega / fmax(first.omega, 1e-300), 1)) /
                                fmax(log(last.omega / fmax(first.omega, 1e-300)), 1e-12);
            const Integrated at = {
                doubt * between(before.peak, next.peak, part),
                doubt * between(before.rms, next.rms, part),
                doubt * between(before.stray, next.stray, part),
                doubt * between(before.stray_rms, next.stray_rms, part),
                doubt * between(before.accelerated, next.accelerated, part),
            };
            record_level(&levels[k], &mode, &at, highest);
        }
    }
}
