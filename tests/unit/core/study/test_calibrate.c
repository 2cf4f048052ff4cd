#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/philox.h"
#include "core/study/calibrate_search.h"
#include "tests/support/fields.h"
#include "tests/support/paper.h"
#include "tests/support/scenes.h"
#include "tests/support/test.h"

static Problem problem;

static CalibrateStudy *study_of(const StudyRequest *request) {
    return (CalibrateStudy *)(void *)request->study;
}

static void parameter_add(StudyRequest *request, const char *pointer, double from, double to) {
    StudyAxis *axis = list_append(&study_of(request)->parameters, sizeof *axis);
    assert_non_null(axis);
    *axis = (StudyAxis){.pointer = strdup(pointer),
                        .from = from,
                        .to = to,
                        .count = COUNT_ABSENT,
                        .spacing = CHOICE_ABSENT};
}

// The displacement of a scene with noise of this part of its rms, every 5 ms.
static MeasuredChannel *measure(StudyRequest *request, const Simulation *scene, double noise) {
    Simulation made;
    Outcome *outcome = NULL;
    assert_int_equal(fields_copy(simulation_fields, scene, &made), STATUS_OK);
    made.scene.sample_rate = 200;
    problem_clear(&problem);
    if (simulation_complete(&made, NULL, NULL, &problem) != STATUS_OK ||
        simulation_run(&made, NULL, NULL, NULL, &outcome, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    MeasuredChannel *measured = list_append(&study_of(request)->measured, sizeof *measured);
    assert_non_null(measured);
    const Column *column = columns_find(&outcome->response.series, "displacement");
    *measured = (MeasuredChannel){.channel = strdup("displacement"), .interval = 0.005};
    measured->samples = reals_of(outcome->response.count, column->values);
    measured->deviation = noise * measured_rms(measured);
    for (size_t i = 0; i < measured->samples.count; i++) {
        double normal[2];
        philox_normal_pair(5, 0, i, normal);
        measured->samples.at[i] += measured->deviation * normal[0];
    }
    outcome_unref(outcome);
    simulation_clear(&made);
    return measured;
}

// The paper's sponge scene for 2 s and a calibration of it without parameters.
static StudyRequest request_make(void) {
    StudyRequest request = {0};
    scene_with_damper(&request.simulation, 0.61, 0.025);
    request.simulation.scene.duration = 2;
    request.study = variant_new(&study_calibrate.kind);
    assert_non_null(request.study);
    return request;
}

static Calibration *calibrate(StudyRequest *request) {
    Variant *answer = NULL;
    problem_clear(&problem);
    if (study_request_complete(request, NULL, NULL, &problem) != STATUS_OK ||
        study_run(request->study, &request->simulation, &(StudyTools){.limits = NULL}, &answer,
                  &problem) != STATUS_OK)
        fail_msg("%s %s", problem.faults[0].pointer, problem.detail);
    return (Calibration *)(void *)answer;
}

typedef bool (*FailingRuns)(const CalibrateWork *work, const CalibrateRun *run);

// The same with some runs that fail.
static Calibration *calibrate_failing(StudyRequest *request, FailingRuns fails) {
    const StudyTools tools = {0};
    Variant *answer = NULL;
    StudyWork *work = NULL;
    problem_clear(&problem);
    assert_int_equal(study_request_complete(request, NULL, NULL, &problem), STATUS_OK);
    Status status =
        study_begin(request->study, &request->simulation, &tools, &answer, &work, &problem);
    assert_true(status == STATUS_OK && work->expected < 1000);
    const CalibrateWork *search = (const CalibrateWork *)(const void *)work;
    for (size_t i = 1; i < search->windows; i++)
        assert_true(search->ends[i] > search->ends[i - 1]);
    for (size_t i = 0; i < work->wanted && status == STATUS_OK; i++) {
        StudyPart *part = NULL;
        status = study_part_make(work, i, &tools, &part, &problem);
        CalibratePart *made = (CalibratePart *)(void *)part;
        if (status == STATUS_OK && fails(search, made->run)) {
            part->run.status = STATUS_UNSTABLE;
            free(made->residual);
            made->residual = NULL;
        }
        if (status == STATUS_OK)
            status = study_part_fold(work, i, part, &problem);
        study_part_free(work, part);
    }
    if (status == STATUS_OK)
        status = study_end(work, &tools, &problem);
    assert_int_equal(status, STATUS_OK);
    study_free(work);
    return (Calibration *)(void *)answer;
}

static void assert_contains(const CalibratedParameter *parameter, double truth) {
    if (parameter->identifiable != 1 || !(parameter->interval_95.at[0] <= truth) ||
        !(truth <= parameter->interval_95.at[1]))
        fail_msg("%s: %g +- %g, true %g", parameter->member.pointer, parameter->value,
                 parameter->standard_error, truth);
}

TEST(restitution_and_contact_time_are_found_in_a_noisy_motion) {
    StudyRequest request = request_make();
    MeasuredChannel *measured = measure(&request, &request.simulation, 0.03);
    study_of(&request)->starts = 4;
    parameter_add(&request, "/dampers/0/buffer/restitution", 0.4, 0.9);
    parameter_add(&request, "/dampers/0/buffer/contact_time", 0.01, 0.05);
    Calibration *answer = calibrate(&request);
    assert_int_equal(answer->verdict, CALIBRATE_EXPLAINED);
    assert_contains(&answer->parameters.at[0], 0.61);
    assert_contains(&answer->parameters.at[1], 0.025);
    assert_true(answer->parameters.at[0].standard_error < 0.02);
    assert_true(answer->made.failed == 0 && answer->made.runs > 50 && answer->history.count > 4);
    assert_true(fabs(answer->chi_square / (double)answer->freedom - 1) < 0.2);
    assert_true(fabs(answer->correlation.at[0].at[1]) < 1 && answer->correlation.at[1].at[1] == 1);
    assert_true(fabs(answer->residuals.at[0].rms / measured->deviation - 1) < 0.1);
    // Again, with a deviation that has to be estimated.
    const double deviation = measured->deviation;
    measured->deviation = (double)NAN;
    Calibration *again = calibrate(&request);
    assert_int_equal(again->verdict, CALIBRATE_EXPLAINED);
    assert_true(isnan(again->chi_square));
    assert_true(fabs(again->residuals.at[0].deviation / deviation - 1) < 0.1);
    assert_contains(&again->parameters.at[0], 0.61);
    variant_free(&again->variant);
    variant_free(&answer->variant);
    study_request_clear(&request);
}

static bool run_never_fails(const CalibrateWork *work, const CalibrateRun *run) {
    (void)work;
    (void)run;
    return false;
}

static bool run_fails_behind(const CalibrateWork *work, const CalibrateRun *run) {
    return work->stage == STAGE_COVARIANCE && run->is_second;
}

static bool run_fails_beyond_the_first_window(const CalibrateWork *work, const CalibrateRun *run) {
    (void)run;
    return work->window > 0;
}

TEST(runs_that_fail_take_nothing_from_the_others) {
    StudyRequest request = request_make();
    measure(&request, &request.simulation, 0.03);
    study_of(&request)->starts = 1;
    parameter_add(&request, "/structure/stiffness", 700, 1000);
    Calibration *whole = calibrate_failing(&request, run_never_fails);
    Calibration *one_sided = calibrate_failing(&request, run_fails_behind);
    Calibration *first = calibrate_failing(&request, run_fails_beyond_the_first_window);
    const double error = whole->parameters.at[0].standard_error;
    assert_true(one_sided->made.failed > 0);
    assert_true(fabs(one_sided->parameters.at[0].standard_error / error - 1) < 0.1);
    assert_true(first->made.failed > 0 && first->verdict != CALIBRATE_NOT_EXPLAINED);
    assert_true(fabs(first->parameters.at[0].value - 865) < 50);
    assert_non_null(strstr(first->made.warnings.at[0].detail, "failed"));
    variant_free(&whole->variant);
    variant_free(&one_sided->variant);
    variant_free(&first->variant);
    study_request_clear(&request);
}

TEST(chi_square_is_of_all_channels_with_a_given_deviation) {
    StudyRequest request = request_make();
    measure(&request, &request.simulation, 0.02)->deviation = (double)NAN;
    measure(&request, &request.simulation, 0.02);
    request.simulation.scene.dampers.at[0].clearance = 1; // explains neither
    study_of(&request)->starts = 1;
    parameter_add(&request, "/structure/stiffness", 700, 1000);
    Calibration *answer = calibrate(&request);
    assert_int_equal(answer->verdict, CALIBRATE_NOT_EXPLAINED);
    assert_int_equal(answer->freedom, answer->residuals.at[1].samples - 1);
    assert_true(answer->chi_square > 2 * (double)answer->freedom);
    variant_free(&answer->variant);
    study_request_clear(&request);
}

TEST(the_clock_of_a_measurement_may_be_wrong) {
    StudyRequest request = request_make();
    MeasuredChannel *measured = measure(&request, &request.simulation, 0.02);
    // The first sample is in truth at 0.02 s.
    memmove(measured->samples.at, measured->samples.at + 4,
            (measured->samples.count - 4) * sizeof(double));
    measured->samples.count -= 4;
    study_of(&request)->starts = 2;
    study_of(&request)->max_shift = 0.03;
    parameter_add(&request, "/structure/stiffness", 700, 1000);
    Calibration *answer = calibrate(&request);
    assert_true(fabs(answer->shift - 0.02) < 3 * answer->shift_error);
    assert_contains(&answer->parameters.at[0], 865);
    variant_free(&answer->variant);
    study_request_clear(&request);
}

TEST(parameters_of_which_only_a_ratio_matters_are_not_identifiable) {
    StudyRequest request = request_make();
    scene_start(&request.simulation, 0.015, 0);
    request.simulation.scene.dampers.at[0].clearance = 1;
    measure(&request, &request.simulation, 0.03);
    study_of(&request)->starts = 4;
    parameter_add(&request, "/structure/mass", 1, 2);
    parameter_add(&request, "/structure/stiffness", 600, 1200);
    parameter_add(&request, "/structure/damping", 0.5, 2);
    Calibration *answer = calibrate(&request);
    assert_int_equal(answer->verdict, CALIBRATE_NOT_IDENTIFIABLE);
    assert_non_null(strstr(answer->detail, "/structure/mass"));
    assert_true(answer->parameters.at[0].identifiable == 0 &&
                isnan(answer->parameters.at[0].standard_error));
    variant_free(&answer->variant);
    study_request_clear(&request);
}

TEST(a_model_without_the_damper_does_not_explain_a_motion_with_it) {
    StudyRequest request = request_make();
    measure(&request, &request.simulation, 0.02);
    request.simulation.scene.dampers.at[0].clearance = 1;
    study_of(&request)->starts = 2;
    parameter_add(&request, "/structure/stiffness", 700, 1000);
    Calibration *answer = calibrate(&request);
    assert_int_equal(answer->verdict, CALIBRATE_NOT_EXPLAINED);
    assert_non_null(strstr(answer->detail, "chi square"));
    assert_int_equal(answer->parameters.at[0].identifiable, CHOICE_ABSENT);
    variant_free(&answer->variant);
    study_request_clear(&request);
}

TEST(residuals_that_are_no_noise_are_not_explained_unless_a_deviation_includes_them) {
    StudyRequest request = request_make();
    MeasuredChannel *measured = measure(&request, &request.simulation, 0.002);
    const double deviation = 10 * measured->deviation;
    measured->deviation = (double)NAN;
    request.simulation.scene.dampers.at[0].clearance *= 1.02; // the model's own error
    study_of(&request)->starts = 2;
    parameter_add(&request, "/structure/stiffness", 700, 1000);
    Calibration *answer = calibrate(&request);
    assert_int_equal(answer->verdict, CALIBRATE_NOT_EXPLAINED);
    assert_non_null(strstr(answer->detail, "a deviation that includes the error of the model"));
    variant_free(&answer->variant);
    study_of(&request)->measured.at[0].deviation = deviation;
    answer = calibrate(&request);
    assert_int_equal(answer->verdict, CALIBRATE_EXPLAINED);
    variant_free(&answer->variant);
    study_request_clear(&request);
}

TEST(spectra_are_fitted_on_request) {
    StudyRequest request = request_make();
    request.simulation.scene.duration = 8;
    measure(&request, &request.simulation, 0.01);
    study_of(&request)->fit = CALIBRATE_PSD;
    study_of(&request)->starts = 2;
    parameter_add(&request, "/structure/stiffness", 700, 1000);
    Calibration *answer = calibrate(&request);
    assert_true(answer->fit == CALIBRATE_PSD && answer->motions.at[0].is_spectrum);
    assert_contains(&answer->parameters.at[0], 865);
    // 1.7 with the same weight for all frequencies, most of which are noise.
    assert_true(answer->parameters.at[0].standard_error < 0.2);
    variant_free(&answer->variant);
    study_request_clear(&request);
}

TEST(a_spectrum_whose_peak_no_value_gives_is_not_explained) {
    StudyRequest request = request_make();
    request.simulation.scene.duration = 16;
    measure(&request, &request.simulation, 0.01)->deviation = (double)NAN;
    study_of(&request)->fit = CALIBRATE_PSD;
    study_of(&request)->starts = 1;
    parameter_add(&request, "/structure/stiffness", 400, 450);
    Calibration *answer = calibrate(&request);
    assert_int_equal(answer->verdict, CALIBRATE_NOT_EXPLAINED);
    assert_non_null(strstr(answer->detail, "exceeds the noise"));
    variant_free(&answer->variant);
    study_request_clear(&request);
}

TEST(a_chaotic_motion_is_fitted_by_its_spectrum_with_an_interval_that_allows_for_its_scatter) {
    StudyRequest request = request_make();
    ExcitationSine *sine = (ExcitationSine *)(void *)variant_new(&excitation_sine.kind);
    assert_non_null(sine);
    sine->frequency = 4.85;
    sine->amplitude = 1;
    variant_free(request.simulation.scene.excitation);
    request.simulation.scene.excitation = (Variant *)(void *)sine;
    request.simulation.scene.duration = 60;
    measure(&request, &request.simulation, 0.02);
    study_of(&request)->fit = CALIBRATE_PSD;
    study_of(&request)->starts = 1;
    request.simulation.output.psd.segment = 512;
    parameter_add(&request, "/structure/stiffness", 750, 1100);
    Calibration *answer = calibrate(&request);
    assert_contains(&answer->parameters.at[0], 865);
    assert_non_null(strstr(answer->made.warnings.at[0].detail, "cannot be predicted to the end"));
    assert_true(answer->parameters.at[0].standard_error > 0.1);
    variant_free(&answer->variant);
    study_request_clear(&request);
}

TEST(spectra_that_are_fitted_in_place_of_motions_give_no_shift) {
    StudyRequest request = request_make();
    paper_sine(&request.simulation, 1, 4.85);
    request.simulation.scene.duration = 30;
    measure(&request, &request.simulation, 0.3)->samples.count -= 20;
    study_of(&request)->max_shift = 0.5;
    study_of(&request)->starts = 1;
    request.simulation.output.psd.segment = 512;
    parameter_add(&request, "/dampers/0/buffer/restitution", 0.61 - 1e-9, 0.61 + 1e-9);
    Calibration *answer = calibrate_failing(&request, run_never_fails);
    assert_int_equal(answer->fit, CALIBRATE_PSD);
    assert_true(isnan(answer->shift) && isnan(answer->shift_error));
    for (size_t i = 0; i < answer->history.count; i++)
        assert_true(isfinite(answer->history.at[i].cost));
    variant_free(&answer->variant);
    study_request_clear(&request);
}

static void assert_refused(StudyRequest *request, const char *pointer, const char *detail) {
    problem_clear(&problem);
    if (study_request_complete(request, NULL, NULL, &problem) != STATUS_INVALID)
        fail_msg("accepted: %s", pointer);
    if (strstr(detail_at(&problem, pointer), detail) == NULL)
        fail_msg("%s: %s, not at %s", problem.faults[0].pointer, problem.detail, pointer);
    study_request_clear(request);
}

TEST(what_cannot_be_fitted_is_refused) {
    StudyRequest request = request_make();
    parameter_add(&request, "/structure/stiffness", 700, 1000);
    assert_refused(&request, "/study/measured", "at least one");
    request = request_make();
    measure(&request, &request.simulation, 0.02);
    assert_refused(&request, "/study/parameters", "at least one");
    request = request_make();
    measure(&request, &request.simulation, 0.02);
    parameter_add(&request, "/structure/stiffness", 1000, 700);
    assert_refused(&request, "/study/parameters/0", "from must be below to");
    request = request_make();
    measure(&request, &request.simulation, 0.02);
    parameter_add(&request, "/duration", 1, 2);
    assert_refused(&request, "/study/parameters/0/pointer", "must be a member of the structure");
    request = request_make();
    measure(&request, &request.simulation, 0.02);
    parameter_add(&request, "/structure/mass", -1, 2);
    assert_refused(&request, "/study/parameters/0/from", "/structure/mass");
    request = request_make();
    free(measure(&request, &request.simulation, 0.02)->channel);
    study_of(&request)->measured.at[0].channel = strdup("displacemen");
    parameter_add(&request, "/structure/stiffness", 700, 1000);
    assert_refused(&request, "/study/measured/0/channel", "");
    request = request_make();
    free(measure(&request, &request.simulation, 0.02)->channel);
    study_of(&request)->measured.at[0].channel = strdup("usual");
    parameter_add(&request, "/structure/stiffness", 700, 1000);
    assert_refused(&request, "/study/measured/0/channel", "one channel");
    request = request_make();
    measure(&request, &request.simulation, 0.02)->start = 1;
    parameter_add(&request, "/structure/stiffness", 700, 1000);
    assert_refused(&request, "/study/measured/0/samples", "end at");
    request = request_make();
    MeasuredChannel *still = measure(&request, &request.simulation, 0.02);
    for (size_t i = 0; i < still->samples.count; i++)
        still->samples.at[i] = i % 2 == 0 ? 1e-300 : -1e-300;
    parameter_add(&request, "/structure/stiffness", 700, 1000);
    assert_refused(&request, "/study/measured/0/samples", "differ by less than 1e-100");
    request = request_make();
    measure(&request, &request.simulation, 0.02)->deviation = 1e-300;
    parameter_add(&request, "/structure/stiffness", 700, 1000);
    assert_refused(&request, "/study/measured/0/deviation", "at least 1e-100");
    request = request_make();
    measure(&request, &request.simulation, 0.02)->interval = 1e-300;
    parameter_add(&request, "/structure/stiffness", 700, 1000);
    problem_clear(&problem);
    assert_int_equal(
        study_request_complete(&request, &(SimulationLimits){.samples = 1000000}, NULL, &problem),
        STATUS_INVALID);
    assert_non_null(strstr(detail_at(&problem, "/study/measured/0/interval"), "not valid"));
    assert_int_equal(problem.count, 1);
    study_request_clear(&request);
    request = request_make();
    measure(&request, &request.simulation, 0.02);
    study_of(&request)->fit = CALIBRATE_PSD;
    study_of(&request)->max_shift = 0.1;
    parameter_add(&request, "/structure/stiffness", 700, 1000);
    assert_refused(&request, "/study/max_shift", "spectra");
}
