// Response spectra against an independent integrator: Runge-Kutta in many small steps, its peaks by
// the parabola through three points.
#include "core/excitation/response_spectrum.h"

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/philox.h"
#include "core/formats/ground_motion_text.h"
#include "tests/support/test.h"

static const double TWO_PI = 6.28318530717958647693;

typedef struct Oscillator {
    double omega, xi;
} Oscillator;

static double pull(const Oscillator *one, double x, double v, double a) {
    return -a - 2 * one->xi * one->omega * v - one->omega * one->omega * x;
}

static void step(const Oscillator *one, double *x, double *v, double a, double slope, double h) {
    const double k1 = pull(one, *x, *v, a), v2 = *v + h / 2 * k1;
    const double k2 = pull(one, *x + h / 2 * *v, v2, a + slope * h / 2), v3 = *v + h / 2 * k2;
    const double k3 = pull(one, *x + h / 2 * v2, v3, a + slope * h / 2), v4 = *v + h * k3;
    const double k4 = pull(one, *x + h * v3, v4, a + slope * h);
    *x += h / 6 * (*v + 2 * v2 + 2 * v3 + v4);
    *v += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
}

static double peak_of(const double x[3]) {
    const double bend = x[0] - 2 * x[1] + x[2], tilt = (x[2] - x[0]) / 2;
    const bool is_peak = (x[1] - x[0]) * (x[2] - x[1]) <= 0 && bend != 0;
    return fmax(fabs(x[1]), is_peak ? fabs(x[1] - tilt * tilt / (2 * bend)) : 0);
}

// With a period of still base at the end.
static double reference(const Reals *samples, double interval, double xi, double period) {
    const Oscillator one = {TWO_PI / period, xi};
    const size_t parts = (size_t)fmax(ceil(interval / period * 400), 40);
    const double h = interval / (double)parts;
    double x = 0, v = 0, last[3] = {0}, most = 0;
    for (size_t i = 0;
         i + 1 < samples->count || (double)(i + 1 - samples->count) * interval < period; i++) {
        const bool is_over = i + 1 >= samples->count;
        const double a = is_over ? 0 : samples->at[i];
        const double slope = is_over ? 0 : (samples->at[i + 1] - a) / interval;
        for (size_t k = 0; k < parts; k++) {
            step(&one, &x, &v, a + slope * (double)k * h, slope, h);
            memmove(last, last + 1, 2 * sizeof *last);
            last[2] = x;
            most = fmax(most, peak_of(last));
        }
    }
    return most;
}

static void compare(const Reals *samples, double interval, double xi, const double *periods,
                    size_t count) {
    double found[64];
    assert_int_equal(response_spectrum_make(samples, interval, xi, periods, count, NULL, found),
                     STATUS_OK);
    for (size_t i = 0; i < count; i++) {
        const double is = reference(samples, interval, xi, periods[i]);
        if (!(fabs(found[i] / is - 1) < 1e-6))
            print_error("period %g s, damping ratio %g: %.17g, not %.17g\n", periods[i], xi,
                        found[i], is);
        assert_true(fabs(found[i] / is - 1) < 1e-6);
    }
}

TEST(a_spectrum_is_that_of_an_independent_integrator) {
    enum { COUNT_MAX = 400 };
    double values[COUNT_MAX], periods[24];
    const Reals samples = {values, COUNT_MAX};
    philox_normal_pairs(5, 0, 0, COUNT_MAX / 2, values);
    for (size_t i = 0; i < COUNT_MAX; i++)
        values[i] *= sin(3.14 * (double)i / COUNT_MAX);
    response_spectrum_periods(0.02, 10, COUNT(periods), periods);
    assert_true(periods[0] == 0.02 && periods[COUNT(periods) - 1] == 10);
    for (size_t k = 0; k < 3; k++)
        compare(&samples, 0.02, (double[]){0, 0.05, 0.7}[k], periods, COUNT(periods));
}

// x = -(a / omega^2) (1 - cos(omega t)) under a constant a, then a free vibration.
TEST(a_spectrum_of_a_step_has_its_closed_form) {
    const double values[] = {2, 2, 2};
    const Reals samples = {(double *)values, COUNT(values)};
    const double periods[] = {0.3, 1, 4, 40};
    double found[COUNT(periods)];
    assert_int_equal(response_spectrum_make(&samples, 0.5, 0, periods, COUNT(periods), NULL, found),
                     STATUS_OK);
    for (size_t i = 0; i < COUNT(periods); i++) {
        const double omega = TWO_PI / periods[i], rest = 2 / (omega * omega);
        const double end = periods[i] <= 2 ? 2 * rest : 2 * rest * fabs(sin(omega / 2));
        assert_true(fabs(found[i] / end - 1) < 1e-13);
    }
}

TEST(a_base_at_rest_has_a_spectrum_of_zeros) {
    const double values[] = {0, 0, 0}, period = 1;
    double found = 1;
    for (size_t count = 1; count <= COUNT(values); count++) {
        const Reals samples = {(double *)values, count};
        assert_int_equal(response_spectrum_make(&samples, 0.1, 0.05, &period, 1, NULL, &found),
                         STATUS_OK);
        assert_true(found == 0);
    }
}

static bool stop_at_once(void *context, double fraction) {
    (void)context;
    (void)fraction;
    return false;
}

TEST(a_spectrum_stops_when_it_is_asked_to) {
    const double values[] = {1, 2}, period = 1;
    const Reals samples = {(double *)values, COUNT(values)};
    const Progress progress = {NULL, stop_at_once};
    double found;
    assert_int_equal(response_spectrum_make(&samples, 0.1, 0.05, &period, 1, &progress, &found),
                     STATUS_CANCELLED);
}

static Status read_motion(const char *path, GroundMotionText *motion) {
    enum { SIZE_MAX_READ = 1 << 22 };
    const GroundMotionOptions options = {.interval = (double)NAN, .unit = CHOICE_ABSENT};
    FILE *file = fopen(path, "rb");
    char *text = malloc(SIZE_MAX_READ);
    assert_true(file != NULL && text != NULL);
    const size_t size = fread(text, 1, SIZE_MAX_READ - 1, file);
    text[size] = '\0';
    fclose(file);
    const Status status = ground_motion_text_read(text, size, 1 << 20, &options, motion, NULL);
    free(text);
    return status;
}

// The records of the folder IMPACTD_RECORDS, of which there are none in the repository.
TEST(spectra_of_real_records_are_those_of_an_independent_integrator) {
    const char *folder = getenv("IMPACTD_RECORDS");
    DIR *directory = folder != NULL ? opendir(folder) : NULL;
    if (directory == NULL)
        skip();
    double periods[12];
    response_spectrum_periods(0.03, 8, COUNT(periods), periods);
    size_t read = 0;
    for (struct dirent *entry; (entry = readdir(directory)) != NULL;) {
        char path[1024];
        GroundMotionText motion = {0};
        snprintf(path, sizeof path, "%s/%s", folder, entry->d_name);
        if (entry->d_name[0] == '.' || strstr(entry->d_name, ".md") != NULL ||
            read_motion(path, &motion) != STATUS_OK)
            continue;
        compare(&motion.samples, motion.interval, 0.05, periods, COUNT(periods));
        print_message("%s: %zu samples\n", entry->d_name, motion.samples.count);
        ground_motion_text_clear(&motion);
        read++;
    }
    closedir(directory);
    assert_true(read > 0);
}
