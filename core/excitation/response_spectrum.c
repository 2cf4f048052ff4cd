// Over a piece in which a_g is linear the state (x, x', a_g, a_g') has an exact transition, the
// exponential of its matrix (the closed form of which is that of Nigam and Jennings, Bulletin of
// the Seismological Society of America 59 (1969) 909-922). A sample interval is one piece, or so
// many that the phase omega h of a piece is at most PHASE_MAX.
//
// A peak inside a piece needs x' = 0 there. With E = |x'| + omega |x| at its start, A the largest
// |a_g| and S the largest |a_g'|
//
//   |x|    <= max(|x_0|, |x_1|) + h^2/8 ((1 + 2 xi) omega (E + h A) + A),
//   |x'''| <= (1 + 2 xi (1 + 2 xi)) omega^2 (E + h A) + 2 xi omega A + S,
//
// because E grows by |a_g| at most. Where x' keeps its sign by more than h^2/8 |x'''|, or |x| stays
// below the peak so far, nothing is to be found; otherwise the roots of the Taylor series of x'
// are.
#include "core/excitation/response_spectrum.h"

#include <math.h>
#include <string.h>

#include "core/math/matrix_exponential.h"
#include "core/math/polynomial_root.h"

enum { SIDE_BY_SIDE = 8, STATES = 4, ORDER = 18, CHECK_STEPS = 1 << 17 };

static const double PHASE_MAX = 0.5;
static const double TWO_PI = 6.28318530717958647693;

// Oscillators that advance together, by the pieces that the fastest of them needs.
typedef struct Oscillators {
    size_t count, pieces; // pieces of a sample interval
    double length;        // of a piece [s]
    double damping_ratio, omega[SIDE_BY_SIDE];
    double gain[2][STATES][SIDE_BY_SIDE]; // of x and x', from (x, x', a_g, a_g')
    double rise[2][SIDE_BY_SIDE];         // of |x| inside a piece, from E and alone
    double bend[2][SIDE_BY_SIDE];         // of x' inside a piece, likewise
    double x[SIDE_BY_SIDE], v[SIDE_BY_SIDE], peak[SIDE_BY_SIDE];
} Oscillators;

static size_t oscillators_pieces(double period, double interval) {
    return (size_t)fmax(ceil(TWO_PI / period * interval / PHASE_MAX), 1);
}

static void oscillators_make(Oscillators *all, const double *periods, size_t count,
                             double damping_ratio, double interval, double a_max,
                             double slope_max) {
    *all = (Oscillators){.count = count, .pieces = 1, .damping_ratio = damping_ratio};
    for (size_t l = 0; l < count; l++) {
        const size_t pieces = oscillators_pieces(periods[l], interval);
        all->pieces = pieces > all->pieces ? pieces : all->pieces;
    }
    const double h = all->length = interval / (double)all->pieces;
    const double xi = damping_ratio, sag = h * h / 8;
    for (size_t l = 0; l < count; l++) {
        const double omega = all->omega[l] = TWO_PI / periods[l];
        const long double w = omega;
        const long double matrix[STATES * STATES] = {0, 1, 0, 0, -w * w, -2 * xi * w, -1, 0,
                                                     0, 0, 0, 1, 0,      0,           0,  0};
        long double increment[STATES * STATES];
        matrix_exponential_increment(matrix, STATES, h, increment);
        for (size_t i = 0; i < 2; i++)
            for (size_t j = 0; j < STATES; j++)
                all->gain[i][j][l] = (double)increment[i * STATES + j];
        const double third = (1 + 2 * xi * (1 + 2 * xi)) * omega * omega;
        all->rise[0][l] = sag * (1 + 2 * xi) * omega;
        all->rise[1][l] = all->rise[0][l] * h * a_max + sag * a_max;
        all->bend[0][l] = sag * third;
        all->bend[1][l] = all->bend[0][l] * h * a_max + sag * (2 * xi * omega * a_max + slope_max);
    }
}

// Raises the peak of an oscillator by those inside the piece that begins at x, v.
static void oscillators_find_peak(Oscillators *all, size_t l, double x, double v, double a,
                                  double slope) {
    double left = all->length;
    for (int roots = 0; roots < 8 && left > 0; roots++) {
        // In units of what is left of the piece.
        const double phase = all->omega[l] * left, damping = 2 * all->damping_ratio * phase;
        double c[ORDER + 3] = {x, v * left}, speed[ORDER + 2], s;
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
        all->peak[l] = fmax(all->peak[l], fabs(x));
        if (s == 0)
            return;
    }
}

// One piece.
static void oscillators_advance(Oscillators *all, double a, double slope) {
    double x[SIDE_BY_SIDE], v[SIDE_BY_SIDE], excess[SIDE_BY_SIDE], most = 0;
    for (size_t l = 0; l < SIDE_BY_SIDE; l++) {
        double(*const g)[SIDE_BY_SIDE] = all->gain[0], (*const f)[SIDE_BY_SIDE] = all->gain[1];
        x[l] = all->x[l] +
               ((g[0][l] * all->x[l] + g[1][l] * all->v[l]) + (g[2][l] * a + g[3][l] * slope));
        v[l] = all->v[l] +
               ((f[0][l] * all->x[l] + f[1][l] * all->v[l]) + (f[2][l] * a + f[3][l] * slope));
        const double reach = fabs(all->v[l]) + all->omega[l] * fabs(all->x[l]);
        const double before = fabs(all->x[l]), after = fabs(x[l]);
        const double end = before > after ? before : after;
        all->peak[l] = after > all->peak[l] ? after : all->peak[l];
        excess[l] = end + (all->rise[0][l] * reach + all->rise[1][l]) - all->peak[l];
        most = excess[l] > most ? excess[l] : most;
    }
    for (size_t l = 0; l < all->count && most > 0; l++) {
        const double from = all->v[l], to = v[l];
        const double reach = fabs(from) + all->omega[l] * fabs(all->x[l]);
        if (excess[l] > 0 && (from * to <= 0 || fmin(fabs(from), fabs(to)) <=
                                                    all->bend[0][l] * reach + all->bend[1][l]))
            oscillators_find_peak(all, l, all->x[l], from, a, slope);
    }
    memcpy(all->x, x, sizeof x);
    memcpy(all->v, v, sizeof v);
}

// The first peak of the free vibration after the last sample; those that follow are no higher.
static void oscillators_end(Oscillators *all) {
    const double xi = all->damping_ratio, damped = sqrt(1 - xi * xi);
    for (size_t l = 0; l < all->count; l++) {
        const double omega = all->omega[l], x = all->x[l], v = all->v[l] / omega;
        double angle = atan2(v * damped, x + xi * v); // where x' is 0
        if (angle <= 0)
            angle += TWO_PI / 2;
        const double at =
            exp(-xi / damped * angle) * (x * cos(angle) + (v + xi * x) / damped * sin(angle));
        all->peak[l] = fmax(all->peak[l], fabs(at));
    }
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
        steps += fmax(ceil(TWO_PI / periods[i] * interval / PHASE_MAX), 1) * (double)sample_count;
    return steps;
}

Status response_spectrum_make(const Reals *samples, double interval, double damping_ratio,
                              const double *periods, size_t period_count, const Progress *progress,
                              double *displacement) {
    double a_max = 0, change = 0;
    for (size_t i = 0; i < samples->count; i++) {
        a_max = fmax(a_max, fabs(samples->at[i]));
        if (i > 0)
            change = fmax(change, fabs(samples->at[i] - samples->at[i - 1]));
    }
    size_t steps = CHECK_STEPS;
    for (size_t first = 0; first < period_count; first += SIDE_BY_SIDE) {
        const size_t left = period_count - first, count = left < SIDE_BY_SIDE ? left : SIDE_BY_SIDE;
        Oscillators all;
        oscillators_make(&all, periods + first, count, damping_ratio, interval, a_max,
                         change / interval);
        for (size_t i = 0; i + 1 < samples->count; i++) {
            const double a = samples->at[i], slope = (samples->at[i + 1] - a) / interval;
            for (size_t k = 0; k < all.pieces; k++) {
                oscillators_advance(&all, a + slope * ((double)k * all.length), slope);
                if (++steps < CHECK_STEPS)
                    continue;
                steps = 0;
                if (!progress_advance(progress, (double)first / (double)period_count))
                    return STATUS_CANCELLED;
            }
        }
        oscillators_end(&all);
        memcpy(displacement + first, all.peak, count * sizeof *displacement);
    }
    return STATUS_OK;
}

Status response_spectrum_acceleration(const Reals *samples, double interval, double damping_ratio,
                                      double period, const Progress *progress,
                                      double *acceleration) {
    const double omega = TWO_PI / period;
    double displacement;
    TRY(response_spectrum_make(samples, interval, damping_ratio, &period, 1, progress,
                               &displacement));
    *acceleration = omega * omega * displacement;
    return STATUS_OK;
}
