// The sweep's knots, its defaults, and what is refused or doubted of it.
#include <math.h>
#include <string.h>

#include "core/excitation/excitation.h"
#include "tests/support/base_at.h"
#include "tests/support/fields.h"
#include "tests/support/test.h"

static const double TURN = 6.283185307179586;
static const Span span = {.duration = 4, .sample_rate = 1000};
static Problem problem;

static ExcitationChirp sweep(double start, double end, double time, double rate) {
    problem_clear(&problem);
    return (ExcitationChirp){{.variant.kind = &excitation_chirp.kind}, start, end, 2, time, rate};
}

static Status complete(ExcitationChirp *chirp) {
    return excitation_chirp.complete(&chirp->excitation, &span, "/excitation", &problem);
}

static Base make(const ExcitationChirp *chirp) {
    Base base = {0};
    assert_int_equal(excitation_chirp.make(&chirp->excitation, &span, NULL, &base, &problem),
                     STATUS_OK);
    return base;
}

// The largest distance from 2 sin(2 pi (f0 t + (f1 - f0) t^2 / (2 T))) and the mean one, up to
// `end`.
static double distance(const Base *base, const ExcitationChirp *chirp, double end, double *mean) {
    double most = 0, sum = 0;
    const int count = 100000;
    for (int i = 0; i < count; i++) {
        const double t = end * (i + 0.5) / count;
        const double climb = (chirp->end_frequency - chirp->start_frequency) / chirp->sweep_time;
        const double wanted = 2 * sin(TURN * (chirp->start_frequency * t + climb * t * t / 2));
        most = fmax(most, fabs(base_at(base, t) - wanted));
        sum += (base_at(base, t) - wanted) * wanted;
    }
    *mean = sum / count;
    return most;
}

TEST(the_knots_keep_the_error_they_state) {
    static const double ends[][2] = {{1, 10}, {20, 0}, {7, 7}};
    for (size_t i = 0; i < COUNT(ends); i++) {
        ExcitationChirp chirp = sweep(ends[i][0], ends[i][1], NAN, NAN);
        double mean;
        assert_int_equal(complete(&chirp), STATUS_OK);
        assert_true(chirp.sweep_time == 4);
        const double highest = fmax(ends[i][0], ends[i][1]);
        assert_true(fmod(chirp.rate, 1000) == 0 && chirp.rate >= 200 * highest);
        Base base = make(&chirp);
        const double bound = 2 * pow(TURN * highest / chirp.rate, 2) / 12;
        const double most = distance(&base, &chirp, 4, &mean);
        assert_true(most < 1.02 * bound && most > 0.5 * bound);
        // In step with the sweep there is next to nothing left of it.
        assert_true(fabs(mean) < 0.01 * bound);
        base_clear(&base);
    }
}

TEST(the_base_is_still_after_the_sweep) {
    ExcitationChirp chirp = sweep(1, 3.3, 1.2345, 700);
    double mean;
    assert_int_equal(complete(&chirp), STATUS_OK);
    Base base = make(&chirp);
    assert_true(distance(&base, &chirp, 1.2344999, &mean) <
                2 * pow(TURN * 3.3 / 700, 2) / 12 * 1.1);
    assert_true(base_at(&base, 1.2345001) == 0 && base_at(&base, 4) == 0);
    base_clear(&base);
}

TEST(a_sweep_as_long_as_the_run_moves_at_its_end) {
    const double times[] = {4, 4.0000001, 9.3};
    for (size_t i = 0; i < COUNT(times); i++) {
        ExcitationChirp chirp = sweep(2, 2.03125, times[i], 333);
        double mean;
        assert_int_equal(complete(&chirp), STATUS_OK);
        Base base = make(&chirp);
        assert_true(distance(&base, &chirp, 4.000001, &mean) < 1e-3);
        assert_true((double)base.count < 4 * 333 + 4);
        base_clear(&base);
    }
}

TEST(sweeps_that_cannot_be_made_are_refused) {
    ExcitationChirp still = sweep(0, 0, NAN, NAN), coarse = sweep(1, 40, NAN, 79),
                    fine = sweep(1, 40, NAN, 1e9), fast = sweep(1, 1e300, NAN, NAN);
    assert_int_equal(complete(&still), STATUS_INVALID);
    assert_string_equal(detail_at(&problem, "/excitation/end_frequency"),
                        "must be above 0 Hz where the start frequency is 0 Hz");
    problem_clear(&problem);
    assert_int_equal(complete(&coarse), STATUS_INVALID);
    assert_string_equal(detail_at(&problem, "/excitation/rate"),
                        "must be at least twice the highest frequency, 80 Hz, is 79");
    problem_clear(&problem);
    assert_int_equal(complete(&fine), STATUS_INVALID);
    assert_string_equal(
        detail_at(&problem, "/excitation/rate"),
        "must make at most 33554432 knots of the base's acceleration, 1000000000 makes 4000000000");
    problem_clear(&problem);
    assert_int_equal(complete(&fast), STATUS_INVALID);
    assert_true(problem_concerns(&problem, "/excitation/rate"));
}

TEST(a_sweep_the_output_cannot_show_is_doubted) {
    ExcitationChirp fast = sweep(501, 1, NAN, NAN);
    assert_int_equal(complete(&fast), STATUS_OK);
    excitation_chirp.doubt(&fast.excitation, &span, "/excitation", &problem);
    assert_int_equal(problem.count, 1);
    assert_string_equal(detail_at(&problem, "/excitation/start_frequency"),
                        "is 501 Hz, above half the sample rate, 500 Hz: the output's samples do "
                        "not show the motion");
    ExcitationChirp coarse = sweep(1, 10, NAN, 100);
    assert_int_equal(complete(&coarse), STATUS_OK);
    excitation_chirp.doubt(&coarse.excitation, &span, "/excitation", &problem);
    assert_int_equal(problem.count, 1);
    assert_non_null(strstr(detail_at(&problem, "/excitation/rate"), "by up to 0.033 of its"));
}

static bool stop_at_once(void *data, double part) {
    (void)data;
    (void)part;
    return false;
}

TEST(making_a_sweep_can_be_stopped) {
    const Progress progress = {.advance = stop_at_once};
    ExcitationChirp chirp = sweep(1, 2, NAN, NAN);
    Base base = {0};
    assert_int_equal(complete(&chirp), STATUS_OK);
    assert_int_equal(excitation_chirp.make(&chirp.excitation, &span, &progress, &base, &problem),
                     STATUS_CANCELLED);
    assert_null(base.values);
}
