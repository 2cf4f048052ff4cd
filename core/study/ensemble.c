// Each run is the scene with another seed and without sampled channels. Its summary becomes a row
// of the table and its spectra are added up; a run that fails is a row with its reason.
//
// With uncertain inputs it is the scene of a draw, and may have one channel for the displacement
// over time. For Sobol indices each base sample has k + 2 runs (SobolRuns in statistics.h), of
// which the first two, of independent draws, are rows of the table. Under a random base the seed is
// an input like the others: its share of the variance is that of the ground motion.
#include "core/study/ensemble.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/excitation/excitation.h"
#include "core/study/sensitivity.h"

enum {
    RUNS_MAX = 10000,
    MEMBERS_MAX = 100000,  // runs for Sobol indices
    HISTORY_POINTS = 1000, // of the displacement over time
    COST_SAMPLES = 8,
};

// clang-format off
static const Field ensemble_study_fields[] = {
    FIELD_COUNT(EnsembleStudy, runs, NULL, WITHIN(2, RUNS_MAX), 64, "runs, each with its own seed; with a target the largest number of them; with sobol_indices base samples, each of as many runs as there are inputs and two more"),
    FIELD_COUNT(EnsembleStudy, first_seed, NULL, WITHIN(0, 0x1p53 - 1), OPTIONAL, "the seeds are this one and those that follow it; the excitation's own if absent, 1 if it has none. It is also the seed of the inputs' draws"),
    FIELD_REAL(EnsembleStudy, target, NULL, ABOVE(0), OPTIONAL, "wanted relative error of the metric's mean, against its mean over all of the runs: no more runs are made than necessary; all are made if absent"),
    FIELD_CHOICE(EnsembleStudy, metric, statistics_metric_names, OPTIONAL, "metric of the target; psd: norm of the difference of the mean densities over the norm of the density, of the channel with the largest error; rms_displacement if absent"),
    FIELD_LIST(EnsembleStudy, inputs, uncertain_input_fields, INPUTS_MAX, PRESENCE_OPTIONAL, "uncertain members of the scene, drawn independently for each run; with inputs the excitation may be of any kind"),
    FIELD_CHOICE(EnsembleStudy, sampling, sampling_names, OPTIONAL, "points of the draws: independent, a Latin hypercube or a Sobol sequence with a random shift (most uniform if runs is a power of 2). Intervals of means are conservative for the last two; random if absent"),
    FIELD_FLAG(EnsembleStudy, sobol_indices, false, "Sobol indices of the inputs, and of the seed under a random base"),
    FIELD_END
};

#define QUANTILE_ROWS(where)                                                                       \
    FIELD_REALS(RunSpectrum, q05, NULL, ANY, 0, PRESENCE_OPTIONAL, "5 % of the runs are below, " where), \
    FIELD_REALS(RunSpectrum, q16, NULL, ANY, 0, PRESENCE_OPTIONAL, "16 % of the runs are below"),  \
    FIELD_REALS(RunSpectrum, median, NULL, ANY, 0, PRESENCE_OPTIONAL, "half of the runs are below"), \
    FIELD_REALS(RunSpectrum, q84, NULL, ANY, 0, PRESENCE_OPTIONAL, "84 % of the runs are below"),  \
    FIELD_REALS(RunSpectrum, q95, NULL, ANY, 0, PRESENCE_OPTIONAL, "95 % of the runs are below"),  \
    FIELD_COUNT(RunSpectrum, quantile_runs, NULL, AT_MIN(0), OPTIONAL, "runs that the quantiles are of, the first ones: as many as memory allows")

static const Field ensemble_statistic_fields[] = {
    FIELD_TEXT(RunStatistic, unit, 0, PRESENCE_OPTIONAL, 0, "of the numbers below"),
    FIELD_COUNT(RunStatistic, count, NULL, AT_MIN(0), 0, "runs in which it is known"),
    FIELD_REAL(RunStatistic, mean, NULL, ANY, OPTIONAL, "mean over these runs"),
    FIELD_REAL(RunStatistic, standard_deviation, NULL, ANY, OPTIONAL, "of one run"),
    FIELD_REAL(RunStatistic, standard_error, NULL, ANY, OPTIONAL, "of the mean"),
    FIELD_REAL(RunStatistic, low, NULL, ANY, OPTIONAL, "lower end of the confidence interval of the mean over all possible seeds, by Student's t"),
    FIELD_REAL(RunStatistic, high, NULL, ANY, OPTIONAL, "upper end of that interval"),
    FIELD_REAL(RunStatistic, minimum, NULL, ANY, OPTIONAL, "the smallest"),
    FIELD_REAL(RunStatistic, q05, NULL, ANY, OPTIONAL, "5 % of the runs are below"),
    FIELD_REAL(RunStatistic, q16, NULL, ANY, OPTIONAL, "16 % of the runs are below"),
    FIELD_REAL(RunStatistic, q25, NULL, ANY, OPTIONAL, "25 % of the runs are below"),
    FIELD_REAL(RunStatistic, median, NULL, ANY, OPTIONAL, "half of the runs are below"),
    FIELD_REAL(RunStatistic, q75, NULL, ANY, OPTIONAL, "75 % of the runs are below"),
    FIELD_REAL(RunStatistic, q84, NULL, ANY, OPTIONAL, "84 % of the runs are below"),
    FIELD_REAL(RunStatistic, q95, NULL, ANY, OPTIONAL, "95 % of the runs are below"),
    FIELD_REAL(RunStatistic, maximum, NULL, ANY, OPTIONAL, "the largest"),
    FIELD_COUNT(RunStatistic, minimum_seed, NULL, AT_MIN(0), OPTIONAL, "seed of the smallest, the first of equal ones"),
    FIELD_COUNT(RunStatistic, maximum_seed, NULL, AT_MIN(0), OPTIONAL, "seed of the largest"),
    FIELD_END
};

#define ENSEMBLE_STATISTIC_ROW(constant, name, unit)                                              \
    FIELD_ITEM(EnsembleStatistics, name, ensemble_statistic_fields, NULL, PRESENCE_DEFAULT, "statistics of this metric of the summary; unknown where the scene has none"),
static const Field ensemble_statistics_fields[] = {
    STUDY_METRICS_SUMMARY(ENSEMBLE_STATISTIC_ROW)
    FIELD_END
};

static const Field ensemble_trust_fields[] = {
    FIELD_COUNT(RunTrust, whole, NULL, AT_MIN(0), 0, "runs whose trajectory can be trusted to the end"),
    FIELD_COUNT(RunTrust, beyond, NULL, AT_MIN(0), 0, "runs that continue beyond their trust horizon, where only statistics are valid"),
    FIELD_COUNT(RunTrust, unknown, NULL, AT_MIN(0), 0, "runs without an error estimate"),
    FIELD_REAL(RunTrust, shortest_horizon, "s", ANY, OPTIONAL, "of the runs that have one"),
    FIELD_REAL(RunTrust, largest_error_estimate, NULL, ANY, OPTIONAL, "of the runs that have one"),
    FIELD_REAL(RunTrust, largest_energy_residual, NULL, ANY, OPTIONAL, "of all runs that ended"),
    FIELD_END
};

static const Field ensemble_failure_fields[] = {STUDY_FAILURE_ROWS("first_seed", "the first of their seeds")};
static const Field ensemble_runs_fields[] = {STUDY_RUNS_ROWS(ensemble_failure_fields)};

static const Field ensemble_spectrum_fields[] = {
    FIELD_TEXT(RunSpectrum, channel, 0, PRESENCE_OPTIONAL, 0, "channel"),
    FIELD_TEXT(RunSpectrum, unit, 0, PRESENCE_OPTIONAL, 0, "of the densities"),
    FIELD_REALS(RunSpectrum, mean, NULL, ANY, 0, PRESENCE_OPTIONAL, "mean of the runs' densities at each frequency"),
    FIELD_REALS(RunSpectrum, standard_deviation, NULL, ANY, 0, PRESENCE_OPTIONAL, "of one run's density"),
    FIELD_REALS(RunSpectrum, low, NULL, ANY, 0, PRESENCE_OPTIONAL, "lower end of the confidence interval of the mean over all possible seeds, at each frequency separately, by Student's t of its logarithm"),
    FIELD_REALS(RunSpectrum, high, NULL, ANY, 0, PRESENCE_OPTIONAL, "upper end of that interval"),
    QUANTILE_ROWS("at each frequency separately, with inputs"),
    FIELD_END
};

static const Field ensemble_displacement_fields[] = {
    FIELD_TEXT(RunSpectrum, channel, 0, PRESENCE_OPTIONAL, 0, "channel"),
    FIELD_TEXT(RunSpectrum, unit, 0, PRESENCE_OPTIONAL, 0, "of the numbers below"),
    FIELD_REALS(RunSpectrum, mean, NULL, ANY, 0, PRESENCE_OPTIONAL, "mean over the runs at each time"),
    QUANTILE_ROWS("at each time separately"),
    FIELD_END
};

static const Field ensemble_input_fields[] = {
    FIELD_TEXT(EnsembleInput, pointer, 0, PRESENCE_OPTIONAL, 0, "the member, of tied ones the first"),
    FIELD_TEXT(EnsembleInput, unit, 0, PRESENCE_OPTIONAL, 0, "of the number"),
    FIELD_FLAG(EnsembleInput, is_factor, false, "the number is a factor of the scene's own"),
    FIELD_COUNT(EnsembleInput, drawn_again, NULL, AT_MIN(0), 0, "draws that were out of the member's range and repeated"),
    FIELD_END
};

static const Field ensemble_index_fields[] = {
    FIELD_TEXT(EnsembleIndex, pointer, 0, PRESENCE_OPTIONAL, 0, "the input, of tied members the first; /excitation/seed represents the random base"),
    FIELD_CHOICE(EnsembleIndex, metric, statistics_metric_names, OPTIONAL, "metric of the summary"),
    FIELD_BASE(EnsembleIndex, sobol, sobol_index_fields),
    FIELD_END
};

static const Field ensemble_run_fields[] = {
    {.name = "seed", .kind = FIELD_KIND_COUNT, .offset = FIELD_AT(RunRecord, number, uint64_t), .range = AT_MIN(0), .presence = PRESENCE_OPTIONAL, .doc = "the scene with this seed, and these inputs, gives this row"},
    FIELD_TEXT(RunRecord, why, 0, PRESENCE_OPTIONAL, 0, "reason of its failure"),
    FIELD_REAL(RunRecord, steps, NULL, ANY, OPTIONAL, "solver steps"),
    FIELD_BASE(RunRecord, summary, summary_fields),
    FIELD_REALS(RunRecord, inputs, NULL, ANY, 0, PRESENCE_OPTIONAL, "drawn numbers, in the order of inputs"),
    FIELD_END
};

static const Field ensemble_target_fields[] = {
    FIELD_REAL(EnsembleTarget, error, NULL, ANY, OPTIONAL, "wanted relative error of the mean, against the mean of all requested runs"),
    FIELD_CHOICE(EnsembleTarget, metric, statistics_metric_names, OPTIONAL, "metric of the error"),
    FIELD_REAL(EnsembleTarget, confidence, NULL, ANY, OPTIONAL, "that the error is no larger than estimated"),
    FIELD_COUNT(EnsembleTarget, pilot, NULL, AT_MIN(0), OPTIONAL, "runs made before the first prediction"),
    FIELD_COUNT(EnsembleTarget, predicted_runs, NULL, AT_MIN(0), OPTIONAL, "predicted number of runs that keep the target, the pilot included"),
    FIELD_REAL(EnsembleTarget, estimated_error, NULL, ANY, OPTIONAL, "of the mean of the runs made; 0 if all were made"),
    FIELD_FLAG(EnsembleTarget, is_kept, false, "the estimated error is within the wanted error"),
    FIELD_TEXT(EnsembleTarget, why, 0, PRESENCE_OPTIONAL, 0, "explanation in words"),
    FIELD_END
};

static const Field ensemble_answer_fields[] = {
    FIELD_BASE(Ensemble, made, ensemble_runs_fields),
    FIELD_COUNT(Ensemble, first_seed, NULL, AT_MIN(0), OPTIONAL, "seed of the first"),
    FIELD_REAL(Ensemble, confidence, NULL, ANY, OPTIONAL, "of the intervals of means"),
    FIELD_ITEM_OR_NULL(Ensemble, target, ensemble_target_fields, PRESENCE_OPTIONAL, "result of the target"),
    FIELD_ITEM(Ensemble, statistics, ensemble_statistics_fields, NULL, PRESENCE_DEFAULT, "over the runs"),
    FIELD_ITEM(Ensemble, trust, ensemble_trust_fields, NULL, PRESENCE_DEFAULT, "accuracy of single trajectories"),
    FIELD_REALS(Ensemble, frequency, "Hz", ANY, 0, PRESENCE_OPTIONAL, "of the spectra"),
    FIELD_LIST(Ensemble, spectra, ensemble_spectrum_fields, 0, PRESENCE_DEFAULT, "mean densities, channel by channel"),
    FIELD_CHOICE(Ensemble, sampling, sampling_names, OPTIONAL, "points of the inputs' draws"),
    FIELD_LIST(Ensemble, inputs, ensemble_input_fields, 0, PRESENCE_DEFAULT, "numbers that are drawn for each run"),
    FIELD_LIST(Ensemble, indices, ensemble_index_fields, 0, PRESENCE_DEFAULT, "Sobol indices, metric by metric"),
    FIELD_REALS(Ensemble, time, "s", ANY, 0, PRESENCE_OPTIONAL, "of the displacement"),
    FIELD_LIST(Ensemble, displacement, ensemble_displacement_fields, 0, PRESENCE_DEFAULT, "with inputs, over time, of the last displacement among the output's channels"),
    FIELD_LIST(Ensemble, table, ensemble_run_fields, 0, PRESENCE_DEFAULT, "every run, in the order of the seeds; with sobol_indices the two independent ones of each base sample"),
    FIELD_END
};
// clang-format on

static bool ensemble_is_random(const Simulation *simulation) {
    return excitation_kind(scene_excitation(&simulation->scene)) == &excitation_random;
}

// Inputs that have indices.
static size_t ensemble_indexed(const EnsembleStudy *study, const Simulation *simulation) {
    return study->inputs.count + (ensemble_is_random(simulation) ? 1 : 0);
}

// Runs of one base sample.
static size_t ensemble_sample_runs(const EnsembleStudy *study, const Simulation *simulation) {
    return study->sobol_indices ? ensemble_indexed(study, simulation) + 2 : 1;
}

// Rows of the table.
static size_t ensemble_rows(const EnsembleStudy *study) {
    return (size_t)study->runs * (study->sobol_indices ? 2 : 1);
}

static Status ensemble_check_seeds(const EnsembleStudy *study, Problem *problem) {
    const size_t seeds = ensemble_rows(study);
    if (!((double)study->first_seed + (double)(seeds - 1) > 0x1p53 - 1))
        return STATUS_OK;
    char max[32];
    return problem_add_real(problem, STATUS_INVALID, "/study/first_seed", (double)study->first_seed,
                            NULL, "must be at most %s for %zu runs: seeds end at 2^53 - 1",
                            text_real(max, 0x1p53 - (double)seeds), seeds);
}

// What the options of inputs need of each other.
static Status ensemble_check_inputs(const EnsembleStudy *study, const Simulation *simulation,
                                    size_t numbers, Problem *problem) {
    const size_t each = ensemble_sample_runs(study, simulation),
                 dimensions = numbers * (study->sobol_indices ? 2 : 1);
    Status status = STATUS_OK;
    if (!isnan(study->target) && study->sobol_indices)
        status = problem_add(problem, STATUS_INVALID, "/study/target",
                             "must be left out with sobol_indices, which need all runs");
    else if (!isnan(study->target) && study->sampling != SAMPLING_RANDOM)
        status = problem_add(problem, STATUS_INVALID, "/study/target",
                             "needs sampling random: its rule is that of independent runs");
    if (study->sampling == SAMPLING_SOBOL && dimensions > SAMPLING_SOBOL_DIMENSIONS)
        status = problem_add(problem, STATUS_INVALID, "/study/sampling",
                             "sobol has %d dimensions, the draws need %zu: take fewer inputs, or "
                             "latin_hypercube",
                             (int)SAMPLING_SOBOL_DIMENSIONS, dimensions);
    if ((size_t)study->runs * each > MEMBERS_MAX)
        status = problem_add_real(problem, STATUS_INVALID, "/study/runs", (double)study->runs, NULL,
                                  "must be at most %zu: each base sample of sobol_indices has %zu "
                                  "runs, of which %d are allowed in all",
                                  MEMBERS_MAX / each, each, (int)MEMBERS_MAX);
    return status;
}

// Completes inputs and their options.
static Status ensemble_complete_inputs(EnsembleStudy *study, const Simulation *simulation,
                                       const SimulationLimits *limits, Problem *problem) {
    if (study->inputs.count == 0) {
        if (study->sampling != CHOICE_ABSENT || study->sobol_indices)
            return problem_add(problem, STATUS_INVALID,
                               study->sobol_indices ? "/study/sobol_indices" : "/study/sampling",
                               "must be left out without inputs");
        return STATUS_OK;
    }
    if (study->sampling == CHOICE_ABSENT)
        study->sampling = SAMPLING_RANDOM;
    size_t numbers;
    TRY(uncertain_inputs_complete(&study->inputs, simulation, limits, &numbers, problem));
    return ensemble_check_inputs(study, simulation, numbers, problem);
}

static Status ensemble_complete(void *request, const Simulation *simulation,
                                const SimulationLimits *limits, Problem *problem) {
    EnsembleStudy *study = request;
    const Excitation *excitation = scene_excitation(&simulation->scene);
    const bool is_random = ensemble_is_random(simulation);
    if (!is_random && study->inputs.count == 0)
        return problem_add(problem, STATUS_INVALID, "/study/kind",
                           "ensemble runs many seeds of a random base: /excitation/kind must be "
                           "random, is %s; or give inputs",
                           excitation_kind(excitation)->kind.name);
    if (study->first_seed == COUNT_ABSENT)
        study->first_seed =
            is_random ? ((const ExcitationRandom *)(const void *)excitation)->seed : 1;
    if (isnan(study->target))
        study->metric = CHOICE_ABSENT;
    else if (study->metric == CHOICE_ABSENT)
        study->metric = STATISTICS_RMS_DISPLACEMENT;
    const Status seeds = ensemble_check_seeds(study, problem);
    const Status metric =
        study->metric == CHOICE_ABSENT
            ? STATUS_OK
            : simulation_check_metric(simulation, statistics_metric_names[study->metric],
                                      "/study/metric", problem);
    const Status densities =
        study_run_check_densities(simulation, study_run_densities(simulation), problem);
    return study_first_failure(study_first_failure(study_first_failure(seeds, metric), densities),
                               ensemble_complete_inputs(study, simulation, limits, problem));
}

// The scene that all runs start from, with inputs with the last displacement among its channels.
static Status ensemble_base(const EnsembleStudy *study, const Simulation *simulation,
                            Simulation *base) {
    const Texts *names = &simulation->output.channels;
    TRY(fields_copy(simulation_fields, simulation, base)); // each run meets an accuracy target
    texts_clear(&base->output.channels);
    base->output.reduction = false;
    for (size_t i = 0; i < names->count && study->inputs.count > 0; i++) {
        size_t number;
        if (channel_find(names->at[i], &number) != &channels[CHANNEL_DISPLACEMENT])
            continue;
        texts_clear(&base->output.channels);
        TRY(texts_append(&base->output.channels, names->at[i]));
    }
    return STATUS_OK;
}

typedef struct EnsembleWork {
    StudyWork work;
    const EnsembleStudy *study;
    Ensemble *answer;
    bool is_random;
    SpectrumAccumulator sums;
    size_t kept;  // runs whose spectra are kept
    size_t check; // ended runs at the next check of the target
    Simulation base;
    InputModel model;
    size_t each, indexed;        // runs of one base sample, and its inputs
    double *values;              // metrics of each member, for Sobol indices
    SpectrumAccumulator history; // displacements over time, as if they were spectra
} EnsembleWork;

// Position of a member. Runs 0 and 1 of a base sample are rows of the table.
typedef struct EnsemblePlace {
    size_t sample, run;
    int mixed; // the input from the second table
    uint64_t seed;
} EnsemblePlace;

static EnsemblePlace ensemble_place(const EnsembleWork *work, size_t member) {
    EnsemblePlace place = {member / work->each, member % work->each, INPUTS_NONE,
                           work->study->first_seed + member};
    if (!work->study->sobol_indices)
        return place;
    place.mixed = place.run == 0 ? INPUTS_NONE : place.run == 1 ? INPUTS_ALL : (int)place.run - 2;
    // The seed is the last input.
    place.seed = work->study->first_seed + 2 * place.sample +
                 (place.run == 1 || place.mixed == (int)work->study->inputs.count ? 1 : 0);
    return place;
}

static Status ensemble_scene(const void *of, size_t member, Simulation *scene, StudyPart *part,
                             Problem *problem) {
    const EnsembleWork *work = of;
    const EnsemblePlace place = ensemble_place(work, member);
    if (work->model.count == 0) {
        TRY(fields_copy(simulation_fields, &work->base, scene));
    } else {
        double values[INPUT_NUMBERS_MAX];
        uint64_t again[INPUT_NUMBERS_MAX] = {0};
        const Status drawn =
            input_model_draw(&work->model, place.sample, place.mixed, values, again, problem);
        for (size_t i = 0; i < work->model.count; i++)
            TRY(study_add_real((double)again[i], &part->drawn_again));
        TRY(drawn);
        if (place.run < 2)
            TRY(study_copy_reals(values, work->model.count, &part->run.inputs));
        TRY(input_model_scene(&work->model, values, &work->base, work->work.limits, scene,
                              problem));
    }
    if (work->is_random)
        ((ExcitationRandom *)(void *)scene->scene.excitation)->seed = place.seed;
    return STATUS_OK;
}

// What scenes need; cleared by the next.
static Status ensemble_work_make(EnsembleWork *work, const EnsembleStudy *study,
                                 const Simulation *simulation, const SimulationLimits *limits) {
    work->study = study;
    work->work.limits = limits;
    work->is_random = ensemble_is_random(simulation);
    work->each = ensemble_sample_runs(study, simulation);
    work->work.members = (size_t)study->runs * work->each;
    TRY(ensemble_base(study, simulation, &work->base));
    work->model =
        input_model_make(&study->inputs, &work->base,
                         (Sampling){study->sampling, study->first_seed, (size_t)study->runs});
    return STATUS_OK;
}

static void ensemble_free(void *of) {
    EnsembleWork *work = of;
    spectrum_accumulator_clear(&work->sums);
    spectrum_accumulator_clear(&work->history);
    simulation_clear(&work->base);
    free(work->values);
}

static Status ensemble_scene_of(const void *work, size_t member, const SimulationLimits *limits,
                                Simulation *scene) {
    StudyPart part = {.is_refused = false};
    (void)limits;
    const Status status = ensemble_scene(work, member, scene, &part, NULL);
    free(part.run.inputs.at);
    free(part.drawn_again.at);
    return status;
}

// Of all runs: how many of them a target needs is unknown before the first are made.
static Status ensemble_cost(const void *request, const Simulation *simulation,
                            const SimulationLimits *limits, double *steps) {
    EnsembleWork work = {.check = 0};
    Status status = ensemble_work_make(&work, request, simulation, limits);
    if (status == STATUS_OK)
        status = study_sample_cost(ensemble_scene_of, &work, work.work.members,
                                   work.model.count > 0 ? COST_SAMPLES : 1, limits, steps);
    ensemble_free(&work);
    return status;
}

// Keeps the displacement at equally spaced times.
static Status ensemble_keep(const void *of, const Outcome *outcome, const StudyTools *tools,
                            StudyPart *part, Problem *problem) {
    const Response *response = &outcome->response;
    (void)of;
    (void)tools;
    if (response->series.count == 0 || response->count == 0)
        return STATUS_OK;
    const Column *column = &response->series.at[0];
    const size_t stride = (response->count + HISTORY_POINTS - 1) / HISTORY_POINTS,
                 points = (response->count - 1) / stride + 1;
    part->history.frequency = calloc(points, sizeof *part->history.frequency);
    TRY(status_made(part->history.frequency != NULL));
    TRY(columns_allocate(&part->history.densities, 1, points, 0, problem));
    columns_name(&part->history.densities, 0, column->name, column->unit);
    for (size_t i = 0; i < points; i++) {
        part->history.frequency[i] = (double)(i * stride) / response->sample_rate;
        part->history.densities.at[0].values[i] = column->values[i * stride];
    }
    return STATUS_OK;
}

static bool ensemble_has_target(const EnsembleWork *work) {
    return !isnan(work->study->target);
}

static size_t ensemble_ended(const EnsembleWork *work) {
    return (size_t)(work->answer->made.runs - work->answer->made.failed);
}

// Checks the error and predicts the number of runs, all of which are then wanted. Runs that failed
// do not belong to the population.
static Status ensemble_check_target(EnsembleWork *work) {
    EnsembleTarget *target = &work->answer->target;
    const size_t failed = (size_t)work->answer->made.failed, count = ensemble_ended(work),
                 all = (size_t)work->study->runs - failed;
    RunSpread spread;
    if (work->study->metric == STATISTICS_PSD)
        spread = spectrum_accumulator_spread(&work->sums, all);
    else
        TRY(statistics_spread(&work->answer->table, work->study->metric, &spread));
    // A metric that is unknown in every run has no mean.
    target->estimated_error =
        spread.count > 0 ? stopping_rule_error(&spread, count, all) : (double)NAN;
    // The study ends at a check.
    const size_t min = stopping_rule_predict(&spread, all, work->study->target);
    size_t predicted = count;
    while (predicted < min)
        predicted = stopping_rule_next_check(predicted);
    predicted = predicted < all ? predicted : all;
    if (target->pilot == COUNT_ABSENT && count > 1) {
        target->pilot = count;
        target->predicted_runs = predicted;
    }
    work->check = stopping_rule_next_check(count);
    const bool is_enough = target->estimated_error <= work->study->target;
    work->work.wanted = (is_enough ? count : predicted) + failed;
    work->work.expected = work->work.wanted;
    return STATUS_OK;
}

// Failed runs postpone the next check: more runs are wanted until then.
static void ensemble_extend(EnsembleWork *ensemble) {
    StudyWork *work = &ensemble->work;
    const size_t made = (size_t)ensemble->answer->made.runs;
    const size_t until = made + ensemble->check - ensemble_ended(ensemble);
    if (work->wanted > made)
        return;
    work->wanted = until < work->members ? until : work->members;
    if (work->expected < work->wanted)
        work->expected = work->wanted;
}

// Runs whose spectra are kept for quantiles, or for the spread of a target.
static size_t ensemble_kept(const EnsembleStudy *study, double densities) {
    const size_t rows = ensemble_rows(study),
                 min = study->metric == STATISTICS_PSD ? SPECTRUM_ACCUMULATOR_FIRST : 0,
                 max = (size_t)(SPECTRUM_ACCUMULATOR_MAX / fmax(densities, 1));
    const size_t kept = study->inputs.count == 0 ? 0 : rows < max ? rows : max;
    return kept > min ? kept : min;
}

// Adds a row, after a run that may have failed.
static Status ensemble_fold_row(EnsembleWork *work, uint64_t seed, StudyPart *part) {
    Ensemble *answer = work->answer;
    const bool has_failed = part->run.why != NULL;
    for (size_t i = 0; i < part->drawn_again.count; i++)
        answer->inputs.at[i].drawn_again += (uint64_t)part->drawn_again.at[i];
    TRY(run_table_add(&answer->table, &part->run, seed));
    if (has_failed)
        return STATUS_OK;
    TRY(spectrum_accumulator_add(&work->history, &part->history,
                                 ensemble_kept(work->study, HISTORY_POINTS)));
    return spectrum_accumulator_add(&work->sums, &part->spectrum, work->kept);
}

static Status ensemble_fold(void *of, size_t member, StudyPart *part) {
    EnsembleWork *work = of;
    Ensemble *answer = work->answer;
    const EnsemblePlace place = ensemble_place(work, member);
    RunRecord *run = &part->run;
    TRY(study_runs_add(&answer->made, run, place.seed));
    for (int metric = 0; metric < STATISTICS_METRICS && work->values != NULL; metric++)
        work->values[member * STATISTICS_METRICS + (size_t)metric] =
            statistics_value(&run->summary, metric);
    if (place.run < 2)
        TRY(ensemble_fold_row(work, place.seed, part));
    if (!ensemble_has_target(work))
        return STATUS_OK;
    if (answer->made.runs == work->study->runs || ensemble_ended(work) >= work->check)
        return ensemble_check_target(work);
    ensemble_extend(work);
    return STATUS_OK;
}

static Status ensemble_fill_target(const EnsembleWork *work) {
    EnsembleTarget *target = &work->answer->target;
    const char *name = statistics_metric_names[work->study->metric];
    const unsigned long long made = (unsigned long long)work->answer->made.runs,
                             all = (unsigned long long)work->study->runs;
    target->error = work->study->target;
    target->metric = work->study->metric;
    target->confidence = STOPPING_RULE_CONFIDENCE;
    target->is_kept = target->estimated_error <= target->error;
    return status_made(
        isnan(target->estimated_error)
            ? text_format(&target->why, "none of the %llu runs ended with a known %s", all, name)
        : made == all
            ? text_format(&target->why,
                          "all %llu runs were made: with fewer, the mean of %s might not be "
                          "within %g",
                          all, name, target->error)
            : text_format(&target->why,
                          "%llu of %llu runs keep the mean of %s within %g of that of all: within "
                          "%.2g with %g %% confidence",
                          made, all, name, target->error, target->estimated_error,
                          100 * target->confidence));
}

static Status ensemble_add_index(const EnsembleWork *work, int metric, size_t input) {
    const UncertainInputs *inputs = &work->study->inputs;
    const SobolRuns runs = {work->values + metric, STATISTICS_METRICS, (size_t)work->study->runs,
                            work->indexed};
    EnsembleIndex *index = list_append(&work->answer->indices, sizeof *index);
    TRY(status_made(index != NULL));
    index->metric = metric;
    TRY(text_copy(input < inputs->count ? study_axis_pointer(&inputs->at[input].axis, 0)
                                        : "/excitation/seed",
                  &index->pointer));
    return sobol_index_estimate(&runs, input, &index->sobol);
}

static Status ensemble_add_indices(const EnsembleWork *work, const StudyTools *tools,
                                   Problem *problem) {
    for (int metric = 0; metric < STATISTICS_METRICS; metric++)
        for (size_t i = 0; i < work->indexed && work->values != NULL; i++) {
            if (work->answer->statistics.of[metric].count == 0)
                continue;
            TRY(study_advance(tools->progress, 1, problem));
            TRY(ensemble_add_index(work, metric, i));
        }
    return STATUS_OK;
}

static Status ensemble_end(void *of, const StudyTools *tools, Problem *problem) {
    const EnsembleWork *work = of;
    Ensemble *answer = work->answer;
    if (ensemble_has_target(work))
        TRY(ensemble_fill_target(work));
    for (int metric = 0; metric < STATISTICS_METRICS; metric++)
        TRY(statistics_fill(&answer->table, metric, &answer->statistics.of[metric]));
    statistics_trust(&answer->table, &answer->trust);
    TRY(study_runs_warn(&answer->made));
    TRY(ensemble_add_indices(work, tools, problem));
    TRY(spectrum_accumulator_report(&work->history, NULL, SPECTRUM_QUANTILES, tools->progress,
                                    &answer->time, &answer->displacement, problem));
    return spectrum_accumulator_report(
        &work->sums, NULL, SPECTRUM_INTERVALS | (work->model.count > 0 ? SPECTRUM_QUANTILES : 0),
        tools->progress, &answer->frequency, &answer->spectra, problem);
}

// What the answer says of uncertain inputs; nothing without.
static Status ensemble_begin_inputs(EnsembleWork *work) {
    const EnsembleStudy *study = work->study;
    Ensemble *answer = work->answer;
    answer->sampling = study->sampling;
    for (size_t i = 0; i < work->model.count; i++) {
        const InputNumber *number = &work->model.numbers[i];
        const char *pointer = study_axis_pointer(&number->input->axis, 0),
                   *name =
                       sensitivity_parameter_names[number->parameter < 0 ? 0 : number->parameter];
        EnsembleInput *input = list_append(&answer->inputs, sizeof *input);
        TRY(status_made(input != NULL));
        input->is_factor = number->parameter >= 0;
        TRY(text_copy(input->is_factor ? json_pointer_of(pointer, name).at : pointer,
                      &input->pointer));
        TRY(text_copy(number->unit, &input->unit));
    }
    if (!study->sobol_indices)
        return STATUS_OK;
    work->indexed = ensemble_indexed(study, work->work.simulation);
    work->values = calloc(work->work.members * STATISTICS_METRICS, sizeof *work->values);
    return status_made(work->values != NULL);
}

static Status ensemble_begin(void *of, const StudyTools *tools, Problem *problem) {
    EnsembleWork *work = of;
    const EnsembleStudy *study = work->work.study;
    Ensemble *answer = work->answer = work->work.answer;
    const double densities = study_run_densities(work->work.simulation);
    (void)problem;
    work->check = STOPPING_RULE_PILOT;
    work->kept = ensemble_kept(study, densities);
    TRY(ensemble_work_make(work, study, work->work.simulation, tools->limits));
    TRY(ensemble_begin_inputs(work));
    if (ensemble_has_target(work) && study->runs > STOPPING_RULE_PILOT)
        work->work.wanted = STOPPING_RULE_PILOT;
    const size_t history = work->base.output.channels.count > 0 ? 2 * HISTORY_POINTS : 0;
    work->work.part_bytes = sizeof(StudyPart) + sizeof(double) * ((size_t)densities + history);
    answer->first_seed = study->first_seed;
    answer->confidence = STATISTICS_CONFIDENCE;
    return STATUS_OK;
}

const StudyKind study_ensemble = {
    .kind = {"ensemble",
             "many seeds of a random base, or draws of uncertain inputs: means with their "
             "confidence, spread, and shares of the inputs in it",
             ensemble_study_fields, sizeof(EnsembleStudy)},
    .answer = &(const Kind){"ensemble", "results of many seeds or draws", ensemble_answer_fields,
                            sizeof(Ensemble)},
    .shorten = "ask for fewer runs",
    .complete = ensemble_complete,
    .cost = ensemble_cost,
    .work_size = sizeof(EnsembleWork),
    .part_size = sizeof(StudyPart),
    .begin = ensemble_begin,
    .scene = ensemble_scene,
    .keep = ensemble_keep,
    .fold = ensemble_fold,
    .end = ensemble_end,
    .free = ensemble_free,
};
