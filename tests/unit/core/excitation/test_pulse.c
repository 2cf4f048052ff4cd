// Half-sine and triangular pulses: the base they make, and what is refused or doubted of them.
#include <math.h>
#include <string.h>

#include "core/excitation/excitation.h"
#include "tests/support/base_at.h"
#include "tests/support/fields.h"
#include "tests/support/test.h"

static const Span span = {.duration = 10, .sample_rate = 1000};
static Problem problem;

static ExcitationPulse pulse(const ExcitationKind *kind, double amplitude, double start,
                             double length) {
    problem_clear(&problem);
    return (ExcitationPulse){{.variant.kind = &kind->kind}, amplitude, start, length};
}

static Base make(const ExcitationPulse *pulse) {
    Base base;
    assert_int_equal(excitation_make(&pulse->excitation, &span, NULL, &base, &problem), STATUS_OK);
    return base;
}

TEST(a_half_sine_rises_and_falls_once) {
    const ExcitationPulse half = pulse(&excitation_half_sine, -3, 0.5, 0.25);
    const Base base = make(&half);
    assert_true(base_at(&base, 0) == 0 && base_at(&base, 0.4999) == 0);
    assert_true(base_at(&base, 0.5) == 0);
    assert_true(fabs(base_at(&base, 0.625) + 3) < 1e-15);
    assert_true(fabs(base_at(&base, 0.5 + 0.25 / 6) + 1.5) < 1e-14);
    assert_true(base_at(&base, 0.75) == 0 && base_at(&base, 1e9) == 0);
}

TEST(a_triangle_is_two_lines) {
    const ExcitationPulse triangle = pulse(&excitation_triangular, 8, 0.5, 0.25);
    const Base base = make(&triangle);
    assert_true(base_at(&base, 0.4999) == 0 && base_at(&base, 0.5) == 0);
    assert_true(base_at(&base, 0.5625) == 4 && base_at(&base, 0.625) == 8);
    assert_true(base_at(&base, 0.6875) == 4 && base_at(&base, 0.75) == 0);
    assert_true(base.omega == 0);
}

static Status complete(ExcitationPulse *pulse) {
    return excitation_kind(&pulse->excitation)
        ->complete(&pulse->excitation, &span, "/excitation", &problem);
}

TEST(a_pulse_that_no_clock_can_tell_is_refused) {
    ExcitationPulse late = pulse(&excitation_half_sine, 1, 1e6, 1e-7);
    assert_int_equal(complete(&late), STATUS_INVALID);
    assert_string_equal(detail_at(&problem, "/excitation/length"),
                        "must be at least 1e-06 s, the resolution of time at that start, is 1e-07");
    ExcitationPulse steep = pulse(&excitation_triangular, 1e300, 0, 1e-10);
    assert_int_equal(complete(&steep), STATUS_INVALID);
    assert_string_equal(detail_at(&problem, "/excitation/length"),
                        "must leave the pulse's end and slope finite, is 1e-10");
    ExcitationPulse fine = pulse(&excitation_triangular, 1e3, 1, 1e-9);
    assert_int_equal(complete(&fine), STATUS_OK);
}

TEST(a_pulse_needs_its_amplitude_and_length) {
    ExcitationPulse made;
    assert_int_equal(fields_default(excitation_half_sine.kind.fields, &made), STATUS_OK);
    assert_true(made.start == 0);
    problem_clear(&problem);
    assert_int_equal(fields_validate(excitation_half_sine.kind.fields, &made, "", &problem),
                     STATUS_INVALID);
    assert_int_equal(problem.count, 2);
    made.amplitude = 1;
    made.length = 0;
    made.start = -1;
    problem_clear(&problem);
    assert_int_equal(fields_validate(excitation_half_sine.kind.fields, &made, "", &problem),
                     STATUS_INVALID);
    assert_string_equal(detail_at(&problem, "/length"), "must be above 0 s, is 0");
    assert_string_equal(detail_at(&problem, "/start"), "must be at least 0 s, is -1");
}

TEST(a_pulse_after_the_end_or_between_samples_is_doubted) {
    const ExcitationPulse late = pulse(&excitation_half_sine, 1, 10, 0.5);
    excitation_half_sine.doubt(&late.excitation, &span, "/excitation", &problem);
    assert_int_equal(problem.count, 1);
    assert_string_equal(detail_at(&problem, "/excitation/start"),
                        "is 10 s: the run ends at 10 s, before the pulse begins");
    const ExcitationPulse brief = pulse(&excitation_triangular, 1, 1, 0.0015);
    excitation_triangular.doubt(&brief.excitation, &span, "/excitation", &problem);
    assert_int_equal(problem.count, 1);
    assert_non_null(strstr(detail_at(&problem, "/excitation/length"), "less than two samples"));
    const ExcitationPulse usual = pulse(&excitation_triangular, 1, 1, 0.011);
    excitation_triangular.doubt(&usual.excitation, &span, "/excitation", &problem);
    assert_int_equal(problem.count, 0);
}
