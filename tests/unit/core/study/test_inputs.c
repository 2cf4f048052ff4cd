

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/canonical.h"
#include "core/excitation/excitation.h"
#include "core/excitation/recorded_motion.h"
#include "core/study/ensemble.h"
#include "tests/support/paper.h"
#include "tests/support/scenes.h"
#include "tests/support/taken.h"
#include "tests/support/test.h"

static Problem problem;

static EnsembleStudy *study_of(StudyRequest *inquiry) {
    return (EnsembleStudy *)(void *)inquiry->study;
}

// The paper's scene in free vibration, 1 s, and an ensemble of it without inputs.
static StudyRequest make_request(uint64_t runs) {
    StudyRequest inquiry = {0};
    scene_with_damper(&inquiry.simulation, 0.61, 0.025);
    inquiry.simulation.scene.duration = 1;
    inquiry.study = variant_new(&study_ensemble.kind);
    assert_non_null(inquiry.study);
    study_of(&inquiry)->runs = runs;
    problem_clear(&problem);
    return inquiry;
}

static UncertainInput *add(StudyRequest *inquiry, const char *pointer, int distribution, double a,
                           double b, double c) {
    UncertainInput *input = list_append(&study_of(inquiry)->inputs, sizeof *input);
    assert_non_null(input);
    assert_int_equal(fields_default(uncertain_input_fields, input), STATUS_OK);
    assert_int_equal(text_copy(pointer, &input->axis.pointer), STATUS_OK);
    input->distribution = distribution;
    switch (distribution) {
    case INPUT_NORMAL:
        input->mean = a;
        input->deviation = b;
        break;
    case INPUT_LOGNORMAL:
        input->median = a;
        input->log_deviation = b;
        break;
    case INPUT_TRIANGULAR:
        input->mode = c;
        input->axis.from = a;
        input->axis.to = b;
        break;
    case INPUT_UNIFORM:
        input->axis.from = a;
        input->axis.to = b;
        break;
    default:
        input->restitution_deviation = a;
        input->contact_time_deviation = b;
    }
    return input;
}

static void complete(StudyRequest *inquiry) {
    if (study_request_complete(inquiry, NULL, NULL, &problem) != STATUS_OK)
        fail_msg("%s %s", problem.faults[0].pointer, problem.detail);
}

static Ensemble *make(const StudyRequest *inquiry, Workspace *workspace) {
    const StudyTools tools = {.workspace = workspace};
    Variant *answer = NULL;
    if (study_run(inquiry->study, &inquiry->simulation, &tools, &answer, &problem) != STATUS_OK)
        fail_msg("%s", problem.detail);
    return (Ensemble *)(void *)answer;
}

// Mean and standard deviation of a number over the rows.
static void assert_moments(const Ensemble *answer, size_t number, double mean, double deviation) {
    const size_t n = answer->table.count;
    double sum = 0, squares = 0;
    for (size_t i = 0; i < n; i++)
        sum += answer->table.at[i].inputs.at[number] / (double)n;
    for (size_t i = 0; i < n; i++)
        squares += pow(answer->table.at[i].inputs.at[number] - sum, 2) / (double)n;
    if (!(fabs(sum / mean - 1) < 3e-3 && fabs(sqrt(squares) / deviation - 1) < 2e-2))
        fail_msg("number %zu: %g and %g, should be %g and %g", number, sum, sqrt(squares), mean,
                 deviation);
}

TEST(numbers_have_their_distributions) {
    StudyRequest inquiry = make_request(1024);
    inquiry.simulation.scene.duration = 0.02;
    add(&inquiry, "/structure/mass", INPUT_NORMAL, 1.35, 0.1, 0);
    add(&inquiry, "/structure/stiffness", INPUT_LOGNORMAL, 865, 0.2, 0);
    add(&inquiry, "/structure/damping", INPUT_UNIFORM, 0.5, 2, 0);
    add(&inquiry, "/dampers/0/mass", INPUT_TRIANGULAR, 0.05, 0.2, 0.1);
    study_of(&inquiry)->sampling = SAMPLING_SOBOL;
    complete(&inquiry);
    Ensemble *answer = make(&inquiry, NULL);
    assert_true(answer->made.runs == 1024 && answer->made.failed == 0 && answer->inputs.count == 4);
    assert_string_equal(answer->inputs.at[3].pointer, "/dampers/0/mass");
    assert_string_equal(answer->inputs.at[3].unit, "kg");
    assert_moments(answer, 0, 1.35, 0.1);
    assert_moments(answer, 1, 865 * exp(0.02), 865 * exp(0.02) * sqrt(expm1(0.04)));
    assert_moments(answer, 2, 1.25, 1.5 / sqrt(12));
    assert_moments(answer, 3, 0.35 / 3, sqrt((0.0025 + 0.04 + 0.01 - 0.01 - 0.005 - 0.02) / 18));
    variant_free(&answer->variant);
    study_request_clear(&inquiry);
}

TEST(values_out_of_range_are_drawn_again_and_counted) {
    StudyRequest inquiry = make_request(200);
    add(&inquiry, "/dampers/0/buffer/restitution", INPUT_NORMAL, 0.95, 0.1, 0);
    for (int method = SAMPLING_RANDOM; method <= SAMPLING_SOBOL; method++) {
        study_of(&inquiry)->sampling = method;
        complete(&inquiry);
        Ensemble *answer = make(&inquiry, NULL);
        assert_true(answer->made.failed == 0 && answer->inputs.at[0].drawn_again > 40);
        for (size_t i = 0; i < answer->table.count; i++)
            assert_true(answer->table.at[i].inputs.at[0] <= 1);
        variant_free(&answer->variant);
    }
    study_request_clear(&inquiry);
}

TEST(each_row_is_the_scene_with_its_seed_and_its_numbers) {
    StudyRequest inquiry = make_request(6);
    paper_random(&inquiry.simulation, 1, 9);
    inquiry.simulation.output.reduction = false;
    add(&inquiry, "/structure/damping", INPUT_UNIFORM, 0.5, 2, 0);
    UncertainInput *tied = add(&inquiry, NULL, INPUT_TRIANGULAR, 0.5, 0.7, 0.6);
    assert_int_equal(texts_append(&tied->axis.pointers, "/dampers/0/left_buffer/restitution"),
                     STATUS_OK);
    assert_int_equal(texts_append(&tied->axis.pointers, "/dampers/0/right_buffer/restitution"),
                     STATUS_OK);
    complete(&inquiry);
    Ensemble *answer = make(&inquiry, NULL);
    for (size_t i = 0; i < 6; i++) {
        const RunRecord *row = &answer->table.at[i];
        Simulation scene;
        Outcome *outcome;
        assert_int_equal(fields_copy(simulation_fields, &inquiry.simulation, &scene), STATUS_OK);
        SdofStructure *structure = (SdofStructure *)(void *)scene.scene.structure;
        structure->damping = row->inputs.at[0];
        scene.scene.dampers.at[0].buffer.restitution = row->inputs.at[1];
        ((ExcitationRandom *)(void *)scene.scene.excitation)->seed = 9 + i;
        assert_int_equal(simulation_run(&scene, NULL, NULL, NULL, &outcome, &problem), STATUS_OK);
        assert_true(row->number == 9 + i);
        assert_memory_equal(&row->summary, &outcome->summary, sizeof outcome->summary);
        outcome_unref(outcome);
        simulation_clear(&scene);
    }
    // The history is that of the displacement, which is among the usual channels.
    assert_true(answer->displacement.count == 1 && answer->time.count == 501);
    const RunSpectrum *history = &answer->displacement.at[0];
    assert_true(history->quantile_runs == 6 && history->q05.at[250] < history->median.at[250] &&
                history->median.at[250] < history->q84.at[250]);
    assert_true(answer->spectra.at[0].q16.at[3] < answer->spectra.at[0].q95.at[3]);
    variant_free(&answer->variant);
    study_request_clear(&inquiry);
}

TEST(a_material_spreads_all_rows_of_a_table_by_one_factor) {
    StudyRequest inquiry = make_request(40);
    Buffer *buffer = &inquiry.simulation.scene.dampers.at[0].buffer;
    assert_int_equal(text_copy("sponge@3", &buffer->material), STATUS_OK);
    buffer->restitution = buffer->contact_time = (double)NAN;
    for (size_t i = 0; i < 2; i++) {
        ContactRow *row = list_append(&buffer->table, sizeof *row);
        *row = (ContactRow){0.1 + 0.4 * (double)i, 0.9 - 0.3 * (double)i, 0.02};
    }
    buffer->test.restitution_deviation = 0.2;
    buffer->test.contact_time_deviation = 0.1;
    add(&inquiry, "/dampers/0/buffer", INPUT_MATERIAL, (double)NAN, (double)NAN, 0);
    study_of(&inquiry)->sampling = SAMPLING_LATIN_HYPERCUBE;
    complete(&inquiry);
    assert_true(study_of(&inquiry)->inputs.at[0].restitution_deviation == 0.2);
    Ensemble *answer = make(&inquiry, NULL);
    assert_true(answer->made.failed == 0 && answer->inputs.count == 2);
    assert_string_equal(answer->inputs.at[1].pointer, "/dampers/0/buffer/contact_time");
    assert_true(answer->inputs.at[0].is_factor && answer->inputs.at[0].drawn_again > 0);
    for (size_t i = 0; i < 40; i++) // the largest e, 0.9, stays below 1
        assert_true(answer->table.at[i].inputs.at[0] <= 1 / 0.9);
    variant_free(&answer->variant);
    study_request_clear(&inquiry);
}

// At the start the acceleration is k x / m, the largest of the motion. A product of independent
// log-normal numbers has the indices (q_i - 1) / (Q - 1) and (q_i - 1) Q / q_i / (Q - 1), with
// q = exp(s^2), s the deviations of their logarithms, and Q the product of all q.
TEST(sobol_indices_of_a_scene_with_known_variances_are_within_their_intervals) {
    static const double s[] = {0.3, 0.2, 0.5};
    StudyRequest inquiry = make_request(400);
    fields_clear(damper_fields, &inquiry.simulation.scene.dampers.at[0]);
    inquiry.simulation.scene.dampers.count = 0;
    inquiry.simulation.scene.duration = 0.02;
    add(&inquiry, "/structure/stiffness", INPUT_LOGNORMAL, 865, s[0], 0);
    add(&inquiry, "/structure/mass", INPUT_LOGNORMAL, 1.35, s[1], 0);
    add(&inquiry, "/excitation/displacement", INPUT_LOGNORMAL, 0.01, s[2], 0);
    study_of(&inquiry)->sobol_indices = true;
    complete(&inquiry);
    Ensemble *answer = make(&inquiry, NULL);
    assert_true(answer->made.runs == 2000 && answer->made.failed == 0 &&
                answer->table.count == 800);
    assert_int_equal(answer->statistics.peak_acceleration.count, 800);
    const double q = exp(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
    size_t found = 0;
    for (size_t i = 0; i < answer->indices.count; i++) {
        const EnsembleIndex *index = &answer->indices.at[i];
        if (index->metric != STATISTICS_PEAK_ACCELERATION)
            continue;
        const double own = exp(s[found] * s[found]), first = (own - 1) / (q - 1),
                     total = (own - 1) * q / own / (q - 1);
        assert_true(index->sobol.samples == 400 && index->sobol.first_interval_95.count == 2);
        if (!(index->sobol.first_interval_95.at[0] < first &&
              first < index->sobol.first_interval_95.at[1] &&
              index->sobol.total_interval_95.at[0] < total &&
              total < index->sobol.total_interval_95.at[1]))
            fail_msg("%s: %g %g, should be %g %g", index->pointer, index->sobol.first,
                     index->sobol.total, first, total);
        found++;
    }
    assert_int_equal(found, 3);
    variant_free(&answer->variant);
    study_request_clear(&inquiry);
}

TEST(under_a_random_base_the_seed_is_an_input_of_the_indices) {
    StudyRequest inquiry = make_request(16);
    paper_random(&inquiry.simulation, 1, 4);
    add(&inquiry, "/structure/damping", INPUT_UNIFORM, 1, 1.001, 0);
    study_of(&inquiry)->sobol_indices = true;
    complete(&inquiry);
    Ensemble *answer = make(&inquiry, NULL);
    assert_true(answer->made.runs == 16 * 4 && answer->table.count == 32);
    assert_true(answer->table.at[31].number == 4 + 31);
    for (size_t i = 0; i < answer->indices.count; i++) {
        const EnsembleIndex *index = &answer->indices.at[i];
        if (index->metric != STATISTICS_RMS_DISPLACEMENT)
            continue;
        const bool is_seed = strcmp(index->pointer, "/excitation/seed") == 0;
        assert_true(is_seed ? index->sobol.total > 0.5 : index->sobol.total < 0.1);
    }
    variant_free(&answer->variant);
    study_request_clear(&inquiry);
}

TEST(a_draw_without_a_valid_scene_is_a_failed_run) {
    StudyRequest inquiry = make_request(60);
    add(&inquiry, "/dampers/0/position", INPUT_UNIFORM, -0.01, 0.01, 0); // stops are at 0.0075
    complete(&inquiry);
    Ensemble *answer = make(&inquiry, NULL);
    assert_true(answer->made.runs == 60 && answer->made.failed > 5 && answer->made.failed < 30);
    assert_int_equal(answer->made.failures.count, 1);
    assert_true(answer->made.failures.at[0].count == answer->made.failed);
    for (size_t i = 0; i < 60; i++) {
        const RunRecord *row = &answer->table.at[i];
        assert_true(row->inputs.count == 1);
        assert_true((row->why != NULL) == (fabs(row->inputs.at[0]) > 0.0075));
    }
    variant_free(&answer->variant);
    study_request_clear(&inquiry);
}

static bool count_down(void *context, double fraction) {
    (void)fraction;
    return (*(int *)context)-- > 0;
}

TEST(the_same_study_has_the_same_bytes_and_can_be_stopped_wherever_it_is) {
    StudyRequest inquiry = make_request(12);
    add(&inquiry, "/structure/stiffness", INPUT_NORMAL, 865, 50, 0);
    add(&inquiry, "/dampers/0/buffer", INPUT_MATERIAL, 0.1, 0.1, 0);
    study_of(&inquiry)->sampling = SAMPLING_LATIN_HYPERCUBE;
    study_of(&inquiry)->sobol_indices = true;
    complete(&inquiry);
    Workspace workspace = {0};
    Taken taken[2] = {{NULL, 0}};
    for (size_t i = 0; i < 2; i++) {
        Ensemble *answer = make(&inquiry, i > 0 ? &workspace : NULL);
        canonical_write(study_ensemble.answer->fields, answer, take, &taken[i]);
        variant_free(&answer->variant);
    }
    assert_int_equal(taken[0].count, taken[1].count);
    assert_memory_equal(taken[0].bytes, taken[1].bytes, taken[0].count);
    const int all = 1 << 30;
    int left = all;
    const Progress progress = {&left, count_down};
    const StudyTools tools = {.progress = &progress};
    Variant *answer;
    assert_int_equal(study_run(inquiry.study, &inquiry.simulation, &tools, &answer, &problem),
                     STATUS_OK);
    variant_free(answer);
    const int whole = all - left;
    for (int at = 0; at < whole; at += 1 + whole / 20) {
        left = at;
        problem_clear(&problem);
        assert_int_equal(study_run(inquiry.study, &inquiry.simulation, &tools, &answer, &problem),
                         STATUS_CANCELLED);
        assert_null(answer);
    }
    free(taken[0].bytes);
    free(taken[1].bytes);
    workspace_clear(&workspace);
    study_request_clear(&inquiry);
}

static void assert_refused(StudyRequest *inquiry, const char *pointer, const char *says) {
    problem_clear(&problem);
    assert_int_equal(study_request_complete(inquiry, NULL, NULL, &problem), STATUS_INVALID);
    if (strcmp(problem.faults[0].pointer, pointer) != 0 ||
        strstr(problem.faults[0].detail, says) == NULL)
        fail_msg("%s: %s", problem.faults[0].pointer, problem.faults[0].detail);
    study_request_clear(inquiry);
}

TEST(senseless_inputs_are_refused) {
    static const struct {
        const char *pointer;
        int distribution;
        double a, b, c;
        const char *fault, *says;
    } cases[] = {
        {"/structure/mas", INPUT_UNIFORM, 1, 2, 0, "/study/inputs/0/pointer",
         "there is no \"mas\""},
        {"/duration", INPUT_UNIFORM, 1, 2, 0, "/study/inputs/0/pointer",
         "must be a member of the structure"},
        {"/dampers/0/storey", INPUT_UNIFORM, 1, 2, 0, "/study/inputs/0/pointer", "a real number"},
        {"/dampers/0/buffer", INPUT_UNIFORM, 1, 2, 0, "/study/inputs/0/pointer", "material"},
        {"/structure/mass", INPUT_MATERIAL, NAN, NAN, 0, "/study/inputs/0/pointer",
         "a given buffer"},
        {"/dampers/0/buffer", INPUT_MATERIAL, NAN, NAN, 0, "/study/inputs/0", "has no spread"},
        {"/dampers/9/buffer", INPUT_MATERIAL, 0.1, NAN, 0, "/study/inputs/0/pointer",
         "given buffer"},
        {"/structure/mass", INPUT_UNIFORM, 2, 1, 0, "/study/inputs/0/to", "must be above from, 2"},
        {"/structure/mass", INPUT_UNIFORM, 2, NAN, 0, "/study/inputs/0/to", "is required by"},
        {"/structure/mass", INPUT_TRIANGULAR, 1, 2, 3, "/study/inputs/0/mode",
         "within from and to"},
        {"/structure/mass", INPUT_NORMAL, 1, -2, 0, "/study/inputs/0/deviation", "above 0"},
        {"/structure/mass", INPUT_UNIFORM, -2, -1, 0, "/study/inputs",
         "no valid scene: /structure/mass"},
        {"/structure/mass", INPUT_UNIFORM, -1e308, 1e308, 0, "/study/inputs", "no valid scene"},
        {"/dampers/0/position", INPUT_UNIFORM, 1, 2, 0, "/study/inputs", "no valid scene"},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        StudyRequest inquiry = make_request(20);
        add(&inquiry, cases[i].pointer, cases[i].distribution, cases[i].a, cases[i].b, cases[i].c);
        assert_refused(&inquiry, cases[i].fault, cases[i].says);
    }
    StudyRequest inquiry = make_request(20);
    add(&inquiry, "/structure/mass", INPUT_UNIFORM, 1, 2, 0)->mean = 1;
    assert_refused(&inquiry, "/study/inputs/0/mean", "must be left out");
    inquiry = make_request(20);
    add(&inquiry, NULL, INPUT_UNIFORM, 1, 2, 0);
    assert_refused(&inquiry, "/study/inputs/0", "needs a pointer");
    inquiry = make_request(20);
    add(&inquiry, NULL, INPUT_MATERIAL, 0.1, NAN, 0);
    assert_refused(&inquiry, "/study/inputs/0", "needs a pointer");
    inquiry = make_request(20);
    add(&inquiry, "/dampers/0/buffer/restitution", INPUT_UNIFORM, 0.2, 0.8, 0);
    add(&inquiry, "/dampers/0/buffer", INPUT_MATERIAL, 0.1, NAN, 0);
    assert_refused(&inquiry, "/study/inputs/1/pointer", "is also set by entry 0");
}

TEST(options_that_do_not_fit_are_refused) {
    StudyRequest inquiry = make_request(20);
    paper_random(&inquiry.simulation, 1, 1);
    study_of(&inquiry)->sobol_indices = true;
    assert_refused(&inquiry, "/study/sobol_indices", "without inputs");
    inquiry = make_request(20);
    add(&inquiry, "/structure/mass", INPUT_UNIFORM, 1, 2, 0);
    study_of(&inquiry)->target = 0.1;
    study_of(&inquiry)->sampling = SAMPLING_SOBOL;
    assert_refused(&inquiry, "/study/target", "needs sampling random");
    inquiry = make_request(20);
    add(&inquiry, "/structure/mass", INPUT_UNIFORM, 1, 2, 0);
    study_of(&inquiry)->target = 0.1;
    study_of(&inquiry)->sobol_indices = true;
    assert_refused(&inquiry, "/study/target", "left out with sobol_indices");
    inquiry = make_request(10000);
    for (size_t i = 0; i < INPUTS_MAX; i++) {
        char pointer[64];
        snprintf(pointer, sizeof pointer, "/excitation/samples/%zu", i);
        add(&inquiry, pointer, INPUT_UNIFORM, 1, 2, 0);
    }
    variant_free(inquiry.simulation.scene.excitation);
    inquiry.simulation.scene.excitation = variant_new(&excitation_record.kind);
    ExcitationRecord *record = (ExcitationRecord *)(void *)inquiry.simulation.scene.excitation;
    assert_true(reals_allocate(&record->samples, 200));
    record->interval = 0.01;
    study_of(&inquiry)->sobol_indices = true;
    assert_refused(&inquiry, "/study/runs", "must be at most 5555");
}
