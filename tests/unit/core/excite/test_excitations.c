// Every excitation's own file beside what all of them share.
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "core/excite/excitation.h"
#include "tests/support/fields.h"

static Problem problem;
static const Span span = {10, 1000, 0};

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
    assert_int_equal(excitation_kind(excitation)->make(excitation, &span, NULL, &base, &problem),
                     STATUS_OK);
    return base;
}

static void the_list_begins_with_free_and_every_kind_takes_an_initial_state(void **state) {
    (void)state;
    size_t i = 0;
    for (; excitations[i] != NULL; i++) {
        assert_ptr_equal(excitation_kinds.at(i), &excitations[i]->kind);
        Excitation *excitation = (Excitation *)(void *)variant_new(&excitations[i]->kind);
        assert_ptr_equal(real_of(excitation, "displacement"), &excitation->displacement);
        assert_ptr_equal(real_of(excitation, "velocity"), &excitation->velocity);
        assert_true(excitation->displacement.count == 0 && excitation->velocity.count == 0);
        assert_non_null(excitations[i]->make);
        variant_free(&excitation->variant);
    }
    assert_null(excitation_kinds.at(i));
    assert_ptr_equal(excitations[0], &excitation_free);
}

static void free_vibration_has_a_still_base(void **state) {
    (void)state;
    Excitation *excitation = excitation_new("free");
    Base base = make(excitation);
    assert_int_equal(base.form, BASE_STILL);
    base_clear(&base);
    variant_free(&excitation->variant);
}

static void a_sine_of_acceleration_is_taken_as_it_is(void **state) {
    (void)state;
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

static void a_sine_of_displacement_is_differentiated_twice(void **state) {
    (void)state;
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

static void a_sine_beyond_numbers_is_refused(void **state) {
    (void)state;
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

static void a_sine_needs_its_frequency_and_amplitude(void **state) {
    (void)state;
    Excitation *excitation = excitation_new("sine");
    assert_int_equal(fields_check(excitation->variant.kind->fields, excitation, "", &problem),
                     STATUS_INVALID);
    assert_int_equal(problem.count, 2);
    *real_of(excitation, "frequency") = 0;
    problem_clear(&problem);
    fields_check(excitation->variant.kind->fields, excitation, "", &problem);
    assert_string_equal(detail_at(&problem, "/frequency"), "must be above 0 Hz, is 0");
    variant_free(&excitation->variant);
}

static void a_record_is_scaled_and_copied(void **state) {
    (void)state;
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

static void a_record_needs_samples_that_stay_finite(void **state) {
    (void)state;
    Excitation *excitation = excitation_new("record");
    assert_int_equal(fields_check(excitation->variant.kind->fields, excitation, "", &problem),
                     STATUS_INVALID);
    assert_string_equal(detail_at(&problem, "/samples"),
                        "is required, with at least one: base acceleration from the start on "
                        "[m/s^2]");
    problem_clear(&problem);
    *(Reals *)variant_member(&excitation->variant, "samples") =
        reals_of(2, (const double[]){1, 1e200});
    *real_of(excitation, "scale") = 1e200;
    assert_int_equal(complete(excitation), STATUS_INVALID);
    assert_string_equal(detail_at(&problem, "/excitation/scale"),
                        "must leave every sample finite, sample 1 is not");
    variant_free(&excitation->variant);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_list_begins_with_free_and_every_kind_takes_an_initial_state),
        cmocka_unit_test(free_vibration_has_a_still_base),
        cmocka_unit_test(a_sine_of_acceleration_is_taken_as_it_is),
        cmocka_unit_test(a_sine_of_displacement_is_differentiated_twice),
        cmocka_unit_test(a_sine_beyond_numbers_is_refused),
        cmocka_unit_test(a_sine_needs_its_frequency_and_amplitude),
        cmocka_unit_test(a_record_is_scaled_and_copied),
        cmocka_unit_test(a_record_needs_samples_that_stay_finite),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
