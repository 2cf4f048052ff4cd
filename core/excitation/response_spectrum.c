// Over a piece in which a_g is linear the state (x, x', a_g, a_g') has an exact transition, the
// exponential of its matrix (the closed form of which is that of Nigam and Jennings, Bulletin of
// the Seismological Society of America 59 (1969) 909-922). A sample interval is one piece, or so
// many that the phase omega h of a piece is at most PHASE_MAX.
//
// E = |x'_0| + omega |x_0| at the start of a piece is at least sqrt(x'^2 + (omega x)^2), which
// grows by at most |a_g| per time; with A the largest |a_g|
//
//   |x| <= max(|x_0|, |x_1|) + h^2/8 ((1 + 2 xi) omega (E + h A) + A).
//
// Where that is below the peak so far nothing is to be found; otherwise the roots of the Taylor
// series of x' are.
#include "core/excitation/response_spectrum.h"

#include <math.h>

#include "core/math/matrix_exponential.h"
#include "core/math/polynomial_root.h"

enum { STATES = 4, ORDER = 18, CHECK_STEPS = 1 << 17 };

static const double PHASE_MAX = 0.5;
static const double TWO_PI = 6.28318530717958647693;

static double oscillator_pieces(double period, double interval) {
    return fmax(ceil(TWO_PI / period * interval / PHASE_MAX), 1);
}

typedef struct Oscillator {
    double omega, damping_ratio;
    size_t pieces;          // of a sample interval
    double length;          // of a piece [s]
    double gain[2][STATES]; // of x and x', from (x, x', a_g, a_g')
    double rise[2];         // of |x| inside a piece, from E and alone
    double x, v, peak;
} Oscillator;

static Oscillator oscillator_make(double period, double damping_ratio, double interval,
                                  double a_max) {
    const double omega = TWO_PI / period, xi = damping_ratio;
    Oscillator one = {.omega = omega, .damping_ratio = xi};
    one.pieces = (size_t)oscillator_pieces(period, interval);
    const double h = one.length = interval / (double)one.pieces, sag = h * h / 8;
    const long double w = omega;
    const long double matrix[STATES * STATES] = {0, 1, 0, 0, -w * w, -2 * xi * w, -1, 0,
                                                 0, 0, 0, 1, 0,      0,           0,  0};
    long double increment[STATES * STATES];
    matrix_exponential_increment(matrix, STATES, h, increment);
    for (size_t i = 0; i < 2 * STATES; i++)
        one.gain[i / STATES][i % STATES] = (double)increment[i];
    one.rise[0] = sag * (1 + 2 * xi) * omega;
    one.rise[1] = one.rise[0] * h * a_max + sag * a_max;
    return one;
}

// Raises the peak by those inside the piece that begins with a base acceleration of `a`.
static void oscillator_find_peak(Oscillator *one, double a, double slope) {
    double left = one->length, x = one->x, v = one->v, s = 1;
    for (int roots = 0; roots < 8 && left > 0 && s > 0; roots++) {
        // In units of what is left of the piece.
        const double phase = one->omega * left, damping = 2 * one->damping_ratio * phase;
        double c[ORDER + 3] = {x, v * left}, speed[ORDER + 2];
        for (size_t k = 0; k <= ORDER; k++) {
            const double base = k == 0 ? a : k == 1 ? slope * left : 0;
            const double n = (double)k + 1;
            c[k + 2] = -(damping * n * c[k + 1] + phase * phase * c[k] + left * left * base) /
                       (n * (n + 1));
        }
        const double sign = v < 0 || (v == 0 && c[2] < 0) ? -1 : 1;
        for (size_t k = 0; k <= ORDER + 1; k++)
            speed[k] = sign * (double)(k + 1) * c[k + 1];
        if (!polynomial_root_first(speed, ORDER + 1, &s))
            return;
        x = polynomial_value(c, ORDER + 2, s);
        v = 0;
        a += slope * s * left;
        left -= s * left;
        one->peak = fmax(one->peak, fabs(x));
    }
}

// One piece.
static void oscillator_advance(Oscillator *one, double a, double slope) {
    const double *g = one->gain[0], *f = one->gain[1];
    const double x = one->x + ((g[0] * one->x + g[1] * one->v) + (g[2] * a + g[3] * slope));
    const double v = one->v + ((f[0] * one->x + f[1] * one->v) + (f[2] * a + f[3] * slope));
    const double reach = fabs(one->v) + one->omega * fabs(one->x);
    const double before = fabs(one->x), after = fabs(x), end = before > after ? before : after;
    if (end + (one->rise[0] * reach + one->rise[1]) > one->peak) {
        one->peak = fmax(one->peak, end);
        oscillator_find_peak(one, a, slope);
    }
    one->x = x;
    one->v = v;
}

// The first peak of the free vibration after the last sample; those that follow are no higher.
static double oscillator_end(const Oscillator *one) {
    const double xi = one->damping_ratio, damped = sqrt(1 - xi * xi);
    const double x = one->x, v = one->v / one->omega;
    double angle = atan2(v * damped, x + xi * v); // where x' is 0
    if (angle <= 0)
        angle += TWO_PI / 2;
    return fabs(exp(-xi / damped * angle) * (x * cos(angle) + (v + xi * x) / damped * sin(angle)));
}

void response_spectrum_periods(double from, double to, size_t count, double *periods) {
    for (size_t i = 0; i < count; i++)
        periods[i] = i == 0           ? from
                     : i + 1 == count ? to
                                      : from * pow(to / from, (double)i / (double)(count - 1));
}

double response_spectrum_steps(const double *periods, size_t period_count, size_t sample_count,
                               double interval) {
    double steps = 0;
    for (size_t i = 0; i < period_count; i++)
        steps += oscillator_pieces(periods[i], interval) * (double)sample_count;
    return steps;
}

Status response_spectrum_make(const Reals *samples, double interval, double damping_ratio,
                              const double *periods, size_t period_count, const Progress *progress,
                              double *displacement) {
    double a_max = 0;
    size_t steps = CHECK_STEPS;
    for (size_t i = 0; i < samples->count; i++)
        a_max = fmax(a_max, fabs(samples->at[i]));
    for (size_t l = 0; l < period_count; l++) {
        Oscillator one = oscillator_make(periods[l], damping_ratio, interval, a_max);
        for (size_t i = 0; i + 1 < samples->count; i++) {
            const double a = samples->at[i], slope = (samples->at[i + 1] - a) / interval;
            for (size_t k = 0; k < one.pieces; k++)
                oscillator_advance(&one, a + slope * ((double)k * one.length), slope);
            if ((steps += one.pieces) < CHECK_STEPS)
                continue;
            steps = 0;
            if (!progress_advance(progress, (double)l / (double)period_count))
                return STATUS_CANCELLED;
        }
        displacement[l] = fmax(one.peak, oscillator_end(&one));
    }
    return STATUS_OK;
}
