// Each run is the scene with another seed and without sampled channels. Its summary becomes a row
// of the table and its spectra are added up; a run that fails is a row with its reason.
#include "core/study/ensemble.h"

#include <math.h>

#include "core/excitation/excitation.h"

enum { RUNS_MAX = 10000 };

// clang-format off
static const Field ensemble_study_fields[] = {
    FIELD_COUNT(EnsembleStudy, runs, NULL, WITHIN(2, RUNS_MAX), 64, "runs, each with its own seed; with a target the largest number of them"),
    FIELD_COUNT(EnsembleStudy, first_seed, NULL, WITHIN(0, 0x1p53 - 1), OPTIONAL, "the seeds are this one and those that follow it; the excitation's own if absent"),
    FIELD_REAL(EnsembleStudy, target, NULL, ABOVE(0), OPTIONAL, "wanted relative error of the metric's mean, against its mean over all of the runs: no more runs are made than necessary; all are made if absent"),
    FIELD_CHOICE(EnsembleStudy, metric, statistics_metric_names, OPTIONAL, "metric of the target; psd: norm of the difference of the mean densities over the norm of the density, of the channel with the largest error; rms_displacement if absent"),
    FIELD_END
};

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
    FIELD_REAL(RunStatistic, q25, NULL, ANY, OPTIONAL, "25 % of the runs are below"),
    FIELD_REAL(RunStatistic, median, NULL, ANY, OPTIONAL, "half of the runs are below"),
    FIELD_REAL(RunStatistic, q75, NULL, ANY, OPTIONAL, "75 % of the runs are below"),
    FIELD_REAL(RunStatistic, q95, NULL, ANY, OPTIONAL, "95 % of the runs are below"),
    FIELD_REAL(RunStatistic, maximum, NULL, ANY, OPTIONAL, "the largest"),
    FIELD_COUNT(RunStatistic, minimum_seed, NULL, AT_MIN(0), OPTIONAL, "seed of the smallest, the first of equal ones"),
    FIELD_COUNT(RunStatistic, maximum_seed, NULL, AT_MIN(0), OPTIONAL, "seed of the largest"),
    FIELD_END
};

static const Field ensemble_statistics_fields[] = {
    FIELD_ITEM(EnsembleStatistics, peak_displacement, ensemble_statistic_fields, NULL, PRESENCE_DEFAULT, "statistics of this metric of the summary"),
    FIELD_ITEM(EnsembleStatistics, rms_displacement, ensemble_statistic_fields, NULL, PRESENCE_DEFAULT, "likewise"),
    FIELD_ITEM(EnsembleStatistics, peak_acceleration, ensemble_statistic_fields, NULL, PRESENCE_DEFAULT, "likewise"),
    FIELD_ITEM(EnsembleStatistics, rms_acceleration, ensemble_statistic_fields, NULL, PRESENCE_DEFAULT, "likewise"),
    FIELD_ITEM(EnsembleStatistics, impacts, ensemble_statistic_fields, NULL, PRESENCE_DEFAULT, "likewise"),
    FIELD_ITEM(EnsembleStatistics, peak_contact_force, ensemble_statistic_fields, NULL, PRESENCE_DEFAULT, "likewise; unknown if contacts have no force"),
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

static const Field ensemble_failure_fields[] = {
    FIELD_TEXT(StudyFailure, reason, 0, PRESENCE_OPTIONAL, 0, "reason"),
    FIELD_COUNT(StudyFailure, count, NULL, AT_MIN(1), 0, "runs that failed for this reason"),
    {.name = "first_seed", .kind = FIELD_KIND_COUNT, .offset = FIELD_AT(StudyFailure, first, uint64_t), .range = AT_MIN(0), .presence = PRESENCE_OPTIONAL, .doc = "the first of their seeds"},
    FIELD_TEXT(StudyFailure, detail, 0, PRESENCE_OPTIONAL, 0, "reason of the first of them"),
    FIELD_END
};

static const Field ensemble_spectrum_fields[] = {
    FIELD_TEXT(RunSpectrum, channel, 0, PRESENCE_OPTIONAL, 0, "channel"),
    FIELD_TEXT(RunSpectrum, unit, 0, PRESENCE_OPTIONAL, 0, "of the densities"),
    FIELD_REALS(RunSpectrum, mean, NULL, ANY, 0, PRESENCE_OPTIONAL, "mean of the runs' densities at each frequency"),
    FIELD_REALS(RunSpectrum, standard_deviation, NULL, ANY, 0, PRESENCE_OPTIONAL, "of one run's density"),
    FIELD_REALS(RunSpectrum, low, NULL, ANY, 0, PRESENCE_OPTIONAL, "lower end of the confidence interval of the mean over all possible seeds, at each frequency separately, by Student's t of its logarithm"),
    FIELD_REALS(RunSpectrum, high, NULL, ANY, 0, PRESENCE_OPTIONAL, "upper end of that interval"),
    FIELD_END
};

static const Field ensemble_run_fields[] = {
    {.name = "seed", .kind = FIELD_KIND_COUNT, .offset = FIELD_AT(RunRecord, number, uint64_t), .range = AT_MIN(0), .presence = PRESENCE_OPTIONAL, .doc = "the scene with this seed gives this row"},
    FIELD_TEXT(RunRecord, why, 0, PRESENCE_OPTIONAL, 0, "reason of its failure"),
    FIELD_REAL(RunRecord, steps, NULL, ANY, OPTIONAL, "solver steps"),
    FIELD_BASE(RunRecord, summary, summary_fields),
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
    FIELD_COUNT(Ensemble, runs, NULL, AT_MIN(1), OPTIONAL, "runs requested"),
    FIELD_COUNT(Ensemble, first_seed, NULL, AT_MIN(0), OPTIONAL, "seed of the first"),
    FIELD_COUNT(Ensemble, made, NULL, AT_MIN(0), 0, "runs made"),
    FIELD_COUNT(Ensemble, failed, NULL, AT_MIN(0), 0, "runs that failed; all numbers below are of the others"),
    FIELD_REAL(Ensemble, steps, NULL, ANY, 0, "solver steps of all runs"),
    FIELD_REAL(Ensemble, confidence, NULL, ANY, OPTIONAL, "of the intervals of means"),
    FIELD_ITEM_OR_NULL(Ensemble, target, ensemble_target_fields, PRESENCE_OPTIONAL, "result of the target"),
    FIELD_ITEM(Ensemble, statistics, ensemble_statistics_fields, NULL, PRESENCE_DEFAULT, "over the runs"),
    FIELD_ITEM(Ensemble, trust, ensemble_trust_fields, NULL, PRESENCE_DEFAULT, "accuracy of single trajectories"),
    FIELD_LIST(Ensemble, failures, ensemble_failure_fields, 0, PRESENCE_DEFAULT, "runs that failed, by their reason"),
    FIELD_REALS(Ensemble, frequency, "Hz", ANY, 0, PRESENCE_OPTIONAL, "of the spectra"),
    FIELD_LIST(Ensemble, spectra, ensemble_spectrum_fields, 0, PRESENCE_DEFAULT, "mean densities, channel by channel"),
    FIELD_LIST(Ensemble, table, ensemble_run_fields, 0, PRESENCE_DEFAULT, "every run, in the order of the seeds"),
    FIELD_END
};
// clang-format on

static Status ensemble_check_seeds(const EnsembleStudy *study, Problem *problem) {
    if (!((double)study->first_seed + (double)(study->runs - 1) > 0x1p53 - 1))
        return STATUS_OK;
    char max[32];
    return problem_add_real(problem, STATUS_INVALID, "/study/first_seed", (double)study->first_seed,
                            NULL, "must be at most %s for %llu runs: seeds end at 2^53 - 1",
                            text_real(max, 0x1p53 - (double)study->runs),
                            (unsigned long long)study->runs);
}

static Status ensemble_complete(void *request, const Simulation *simulation,
                                const SimulationLimits *limits, Problem *problem) {
    EnsembleStudy *study = request;
    const Excitation *excitation = scene_excitation(&simulation->scene);
    const ExcitationKind *kind = excitation_kind(excitation);
    (void)limits;
    if (kind != &excitation_random)
        return problem_add(problem, STATUS_INVALID, "/study/kind",
                           "ensemble runs many seeds of a random base: /excitation/kind must be "
                           "random, is %s",
                           kind->kind.name);
    if (study->first_seed == COUNT_ABSENT)
        study->first_seed = ((const ExcitationRandom *)(const void *)excitation)->seed;
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
    return study_first_failure(study_first_failure(seeds, metric), densities);
}

// Of all runs: how many of them a target needs is unknown before the first are made.
static Status ensemble_cost(const void *request, const Simulation *simulation,
                            const SimulationLimits *limits, double *steps) {
    const EnsembleStudy *study = request;
    Simulation member = *simulation; // a borrowed view
    (void)limits;
    member.output.channels = (Texts){NULL, 0};
    member.output.reduction = false;
    *steps = (double)study->runs * simulation_cost(&member).steps;
    return STATUS_OK;
}

typedef struct EnsembleWork {
    StudyWork work;
    const EnsembleStudy *study;
    Ensemble *answer;
    bool has_force;
    SpectrumAccumulator sums;
    Spectrum like; // of the first run that ended
    size_t check;  // ended runs at the next check of the target
} EnsembleWork;

static Status ensemble_scene(const void *of, size_t member, Simulation *scene, StudyPart *part,
                             Problem *problem) {
    const EnsembleWork *work = of;
    (void)part;
    (void)problem;
    TRY(study_run_copy(work->work.simulation, scene));
    ((ExcitationRandom *)(void *)scene->scene.excitation)->seed = work->study->first_seed + member;
    return STATUS_OK;
}

static bool ensemble_has_target(const EnsembleWork *work) {
    return !isnan(work->study->target);
}

static size_t ensemble_ended(const EnsembleWork *work) {
    return (size_t)(work->answer->made - work->answer->failed);
}

// Checks the error and predicts the number of runs, all of which are then wanted. Runs that failed
// do not belong to the population.
static Status ensemble_check_target(EnsembleWork *work) {
    EnsembleTarget *target = &work->answer->target;
    const size_t failed = (size_t)work->answer->failed, count = ensemble_ended(work),
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
    const size_t made = (size_t)ensemble->answer->made;
    const size_t until = made + ensemble->check - ensemble_ended(ensemble);
    if (work->wanted > made)
        return;
    work->wanted = until < work->members ? until : work->members;
    if (work->expected < work->wanted)
        work->expected = work->wanted;
}

static Status ensemble_fold(void *of, size_t member, StudyPart *part) {
    EnsembleWork *work = of;
    Ensemble *answer = work->answer;
    const uint64_t seed = work->study->first_seed + member;
    TRY(run_table_add(&answer->table, &part->run, seed));
    RunRecord *run = &answer->table.at[member];
    answer->made++;
    if (run->why != NULL) {
        answer->failed++;
        TRY(study_failures_add(&answer->failures, (int)run->status, status_slug(run->status), seed,
                               run->why));
    } else {
        answer->steps += run->steps;
        if (!work->has_force)
            run->summary.peak_contact_force = (double)NAN;
        const size_t kept = work->study->metric == STATISTICS_PSD ? SPECTRUM_ACCUMULATOR_FIRST : 0;
        TRY(spectrum_accumulator_add(&work->sums, &part->spectrum, kept));
        if (work->like.densities.count == 0) {
            work->like = part->spectrum;
            part->spectrum = (Spectrum){0};
        }
    }
    if (!ensemble_has_target(work))
        return STATUS_OK;
    if (answer->made == answer->runs || ensemble_ended(work) >= work->check)
        return ensemble_check_target(work);
    ensemble_extend(work);
    return STATUS_OK;
}

static Status ensemble_fill_target(const EnsembleWork *work) {
    EnsembleTarget *target = &work->answer->target;
    const char *name = statistics_metric_names[work->study->metric];
    const unsigned long long made = (unsigned long long)work->answer->made,
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

static Status ensemble_end(void *of, const StudyTools *tools, Problem *problem) {
    const EnsembleWork *work = of;
    Ensemble *answer = work->answer;
    (void)tools;
    if (ensemble_has_target(work))
        TRY(ensemble_fill_target(work));
    for (int metric = 0; metric < STATISTICS_METRICS; metric++)
        TRY(statistics_fill(&answer->table, metric, &answer->statistics.of[metric]));
    statistics_trust(&answer->table, &answer->trust);
    return spectrum_accumulator_report(&work->sums, &work->like, false, NULL, &answer->frequency,
                                       &answer->spectra, problem);
}

static void ensemble_free(void *of) {
    EnsembleWork *work = of;
    spectrum_clear(&work->like);
    spectrum_accumulator_clear(&work->sums);
}

static Status ensemble_begin(void *of, const StudyTools *tools, Problem *problem) {
    EnsembleWork *work = of;
    const EnsembleStudy *study = work->study = work->work.study;
    Ensemble *answer = work->answer = work->work.answer;
    (void)tools;
    (void)problem;
    work->has_force = simulation_has_force(work->work.simulation);
    work->check = STOPPING_RULE_PILOT;
    work->work.members = (size_t)study->runs;
    if (ensemble_has_target(work) && study->runs > STOPPING_RULE_PILOT)
        work->work.wanted = STOPPING_RULE_PILOT;
    work->work.part_bytes =
        sizeof(StudyPart) + sizeof(double) * (size_t)study_run_densities(work->work.simulation);
    answer->runs = study->runs;
    answer->first_seed = study->first_seed;
    answer->confidence = STATISTICS_CONFIDENCE;
    return STATUS_OK;
}

const StudyKind study_ensemble = {
    .kind = {"ensemble", "many seeds of a random base: means with their confidence, and spread",
             ensemble_study_fields, sizeof(EnsembleStudy)},
    .answer = &(const Kind){"ensemble", "results of many seeds", ensemble_answer_fields,
                            sizeof(Ensemble)},
    .shorten = "ask for fewer runs",
    .complete = ensemble_complete,
    .cost = ensemble_cost,
    .work_size = sizeof(EnsembleWork),
    .part_size = sizeof(StudyPart),
    .begin = ensemble_begin,
    .scene = ensemble_scene,
    .fold = ensemble_fold,
    .end = ensemble_end,
    .free = ensemble_free,
};
