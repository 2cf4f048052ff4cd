// Every excitation's own file beside what all of them share.
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/excitation/excitation.h"
#include "core/excitation/recorded_motion.h"
#include "tests/support/fields.h"
#include "tests/support/test.h"

static Problem problem;
static const Span span = {.duration = 10, .sample_rate = 1000};

static Excitation *excitation_new(const char *name) {
    const Kind *kind = kind_find(&excitation_kinds, name);
    assert_non_null(kind);
    problem_clear(&problem);
    return (Excitation *)(void *)variant_new(kind);
}

static double *real_of(Excitation *excitation, const char *name) {
    return variant_member(&excitation->variant, name);
}

static Status complete(Excitation *excitation) {
    return excitation_kind(excitation)->complete(excitation, &span, "/excitation", &problem);
}

static Base make(const Excitation *excitation) {
    Base base;
    memset(&base, 0x5A, sizeof base);
    assert_int_equal(excitation_make(excitation, &span, NULL, &base, &problem), STATUS_OK);
    return base;
}

TEST(the_list_begins_with_free_and_every_kind_takes_an_initial_state) {
    size_t i = 0;
    for (; excitations[i] != NULL; i++) {
        assert_ptr_equal(excitation_kinds.at(i), &excitations[i]->kind);
        Excitation *excitation = (Excitation *)(void *)variant_new(&excitations[i]->kind);
        assert_ptr_equal(real_of(excitation, "displacement"), &excitation->displacement);
        assert_ptr_equal(real_of(excitation, "velocity"), &excitation->velocity);
        assert_true(excitation->displacement.count == 0 && excitation->velocity.count == 0);
        assert_int_equal(excitations[i]->make != NULL, excitations[i]->interval != NULL);
        variant_free(&excitation->variant);
    }
    assert_null(excitation_kinds.at(i));
    assert_ptr_equal(excitations[0], &excitation_free);
}

TEST(free_vibration_has_a_still_base) {
    Excitation *excitation = excitation_new("free");
    Base base = make(excitation);
    assert_int_equal(base.form, BASE_STILL);
    base_clear(&base);
    variant_free(&excitation->variant);
}

TEST(a_sine_of_acceleration_is_taken_as_it_is) {
    Excitation *excitation = excitation_new("sine");
    *real_of(excitation, "frequency") = 1.5;
    *real_of(excitation, "amplitude") = 2;
    assert_int_equal(complete(excitation), STATUS_OK);
    Base base = make(excitation);
    assert_int_equal(base.form, BASE_SINE);
    assert_true(base.amplitude == 2);
    assert_true(fabs(base.omega - 9.42477796076938) < 1e-14);
    base_clear(&base);
    variant_free(&excitation->variant);
}

TEST(a_sine_of_displacement_is_differentiated_twice) {
    Excitation *excitation = excitation_new("sine");
    *real_of(excitation, "frequency") = 1;
    *real_of(excitation, "amplitude") = 0.01;
    *(int *)variant_member(&excitation->variant, "quantity") = 1;
    assert_int_equal(complete(excitation), STATUS_OK);
    Base base = make(excitation);
    assert_true(fabs(base.amplitude + 0.01 * 39.47841760435743) < 1e-15);
    base_clear(&base);
    variant_free(&excitation->variant);
}

TEST(a_sine_beyond_numbers_is_refused) {
    Excitation *excitation = excitation_new("sine");
    *real_of(excitation, "frequency") = 1e200;
    *real_of(excitation, "amplitude") = 1;
    *(int *)variant_member(&excitation->variant, "quantity") = 1;
    assert_int_equal(complete(excitation), STATUS_INVALID);
    assert_string_equal(problem.faults[0].pointer, "/excitation/amplitude");
    problem_clear(&problem);
    *real_of(excitation, "frequency") = 1e308;
    assert_int_equal(complete(excitation), STATUS_INVALID);
    assert_string_equal(problem.faults[0].pointer, "/excitation/frequency");
    variant_free(&excitation->variant);
}

TEST(a_sine_between_the_samples_is_doubted) {
    Excitation *excitation = excitation_new("sine");
    *real_of(excitation, "frequency") = 500;
    excitation_sine.doubt(excitation, &span, "/excitation", &problem);
    assert_int_equal(problem.count, 0);
    *real_of(excitation, "frequency") = 500.5;
    excitation_sine.doubt(excitation, &span, "/excitation", &problem);
    assert_string_equal(detail_at(&problem, "/excitation/frequency"),
                        "is 500.5 Hz, above half the sample rate, 500 Hz: the output's samples do "
                        "not show the motion");
    variant_free(&excitation->variant);
}

TEST(a_sine_needs_its_frequency_and_amplitude) {
    Excitation *excitation = excitation_new("sine");
    assert_int_equal(fields_validate(excitation->variant.kind->fields, excitation, "", &problem),
                     STATUS_INVALID);
    assert_int_equal(problem.count, 2);
    *real_of(excitation, "frequency") = 0;
    problem_clear(&problem);
    fields_validate(excitation->variant.kind->fields, excitation, "", &problem);
    assert_string_equal(detail_at(&problem, "/frequency"), "must be above 0 Hz, is 0");
    variant_free(&excitation->variant);
}

TEST(a_record_is_scaled_and_copied) {
    Excitation *excitation = excitation_new("record");
    Reals *samples = variant_member(&excitation->variant, "samples");
    *samples = reals_of(3, (const double[]){1, -2, 0.5});
    *real_of(excitation, "interval") = 0.02;
    *real_of(excitation, "scale") = 9.81;
    assert_int_equal(complete(excitation), STATUS_OK);
    Base base = make(excitation);
    variant_free(&excitation->variant);
    assert_int_equal(base.form, BASE_SAMPLED);
    assert_int_equal(base.count, 3);
    assert_true(base.interval == 0.02);
    assert_true(base.values[1] == -2 * 9.81);
    base_clear(&base);
}

TEST(a_record_needs_samples_that_stay_finite) {
    Excitation *excitation = excitation_new("record");
    assert_int_equal(excitation_record.check(excitation, "/excitation", &problem), STATUS_INVALID);
    assert_string_equal(detail_at(&problem, "/excitation/samples"),
                        "is required, with at least one: base acceleration from the start on "
                        "[m/s^2]; or the name of an uploaded record");
    assert_string_equal(detail_at(&problem, "/excitation/interval"),
                        "is required: time between samples [s]");
    problem_clear(&problem);
    *(Reals *)variant_member(&excitation->variant, "samples") =
        reals_of(2, (const double[]){1, 1e200});
    *real_of(excitation, "scale") = 1e200;
    assert_int_equal(complete(excitation), STATUS_INVALID);
    assert_string_equal(detail_at(&problem, "/excitation/scale"),
                        "must leave every sample finite, sample 1 is not");
    variant_free(&excitation->variant);
}

static void doubts_of(double peak, double offset, const char *said) {
    Excitation *excitation = excitation_new("record");
    double samples[200];
    for (size_t i = 0; i < COUNT(samples); i++)
        samples[i] = peak * (i % 2 == 0 ? 1 : -1) + offset;
    *(Reals *)variant_member(&excitation->variant, "samples") = reals_of(COUNT(samples), samples);
    *real_of(excitation, "interval") = 0.02;
    excitation_kind(excitation)->doubt(excitation, &span, "/excitation", &problem);
    assert_int_equal(problem.count, said != NULL);
    if (said != NULL && strstr(detail_at(&problem, "/excitation/samples"), said) == NULL)
        fail_msg("%s", detail_at(&problem, "/excitation/samples"));
    variant_free(&excitation->variant);
}

TEST(a_record_is_doubted_for_its_size_and_its_drift) {
    doubts_of(3, 0, NULL);
    doubts_of(50, 0, "reach 50 m/s^2 (sample 0), more than 5 g");
    doubts_of(5e-5, 0, "reach only 5e-05 m/s^2");
    doubts_of(3, 0.1, "leave the base with 0.398 m/s at their end");
    doubts_of(0, 1, NULL); // a pulse: it goes one way only
}

TEST(what_a_record_adds_up_to) {
    double values[] = {0, 2, -4, 1, 1};
    const Reals samples = {values, 5};
    const RecordLook look = record_look(&samples, 0.5, -2);
    assert_true(look.highest == 8 && look.lowest == -4 && look.peak_at == 2);
    assert_true(look.peak_velocity == 1.5 && look.end_velocity == 0.5);
}
