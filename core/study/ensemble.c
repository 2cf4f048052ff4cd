// A run is the scene with another seed and nothing sampled; of what it came to, a row of numbers
// stays and what its spectra add to the fold. A run that fails is a row with its reason.
// The tables of what is asked and answered, and what of it can be judged before anything runs.
#include "core/study/ensemble.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/excitation/random.h"
#include "core/study/spectrum_accumulator.h"
#include "core/study/statistics.h"
#include "core/study/stopping_rule.h"
#include "core/study/study_run.h"

// What the study has at hand.
typedef struct EnsembleWork {
    StudyWork work;
    const EnsembleStudy *study;
    Simulation member; // the scene; its seed is each run's
    bool has_force;
    Ensemble *answer; // whose table has room for all runs
    Status *statuses; // of the table's rows
    SpectrumAccumulator fold;
    Spectrum like; // of any run that ended: the shape
    size_t look;   // ended runs at which the target is looked at next
} EnsembleWork;

Status ensemble_member(const Simulation *simulation, uint64_t seed, Simulation *target,
                       Problem *problem) {
    TRY(study_run_copy(simulation, target, problem));
    ((ExcitationRandom *)(void *)target->scene.excitation)->seed = seed;
    return STATUS_OK;
}

static bool ensemble_has_target(const EnsembleWork *work) {
    return !isnan(work->study->target);
}

static size_t ensemble_finished(const EnsembleWork *work) {
    return (size_t)(work->answer->made - work->answer->failed);
}

// Runs that could end: those that failed are of no population.
static size_t ensemble_population(const EnsembleWork *work) {
    return (size_t)(work->study->runs - work->answer->failed);
}

static Status ensemble_no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
}

static uint64_t ensemble_seed(const EnsembleWork *work, size_t index) {
    return work->study->first_seed + index;
}

static Status ensemble_make(const StudyWork *of, size_t index, const StudyTools *tools, void **made,
                            Problem *problem) {
    const EnsembleWork *work = (const EnsembleWork *)(const void *)of;
    // A view of the scene that all share, with an excitation of its own.
    Simulation member = work->member;
    ExcitationRandom random =
        *(const ExcitationRandom *)(const void *)scene_excitation(&member.scene);
    random.seed = ensemble_seed(work, index);
    member.scene.excitation = (Variant *)(void *)&random;
    StudyPart *part = calloc(1, sizeof *part);
    *made = part;
    return part != NULL ? study_run_make(&member, tools, part, problem)
                        : ensemble_no_memory(problem);
}

static void ensemble_drop(void *part) {
    if (part == NULL)
        return;
    study_run_clear(part);
    free(part);
}

static Status ensemble_add_spectrum(EnsembleWork *work, StudyPart *part, Problem *problem) {
    TRY(spectrum_accumulator_add(&work->fold, &part->spectrum,
                                 ensemble_has_target(work) && work->study->metric == ENSEMBLE_PSD,
                                 problem));
    if (work->like.densities.count == 0) {
        work->like = part->spectrum;
        part->spectrum = (Spectrum){0};
    }
    return STATUS_OK;
}

static Status ensemble_spread(EnsembleWork *work, Spread *spread, Problem *problem) {
    if (work->study->metric != ENSEMBLE_PSD)
        return statistics_spread(&work->answer->table, work->study->metric, spread, problem);
    *spread = spectrum_accumulator_spread(&work->fold, ensemble_population(work));
    return STATUS_OK;
}

// Looks at the error, and foretells how many runs it will take. Those are then made ahead.
static Status ensemble_check_target(EnsembleWork *work, Problem *problem) {
    EnsembleTarget *target = &work->answer->target;
    const size_t count = ensemble_finished(work), all = ensemble_population(work);
    Spread spread;
    TRY(ensemble_spread(work, &spread, problem));
    // A statistic that no run knows has no mean.
    target->estimated_error =
        spread.count > 0 ? stopping_rule_error(&spread, count, all) : (double)NAN;
    // It ends where it is looked at.
    const size_t fewest = stopping_rule_predict(&spread, all, work->study->target);
    size_t foretold = count;
    while (foretold < fewest)
        foretold = stopping_rule_next_check(foretold);
    foretold = foretold < all ? foretold : all;
    if (target->pilot == COUNT_ABSENT && count > 1) {
        target->pilot = count;
        target->predicted_runs = foretold;
    }
    work->look = stopping_rule_next_check(count);
    const bool is_enough = target->estimated_error <= work->study->target;
    work->work.wanted = (is_enough ? count : foretold) + (size_t)work->answer->failed;
    work->work.expected = work->work.wanted;
    return STATUS_OK;
}

// Runs that failed put off the next look: more are wanted until then.
static void ensemble_extend(EnsembleWork *of) {
    StudyWork *work = &of->work;
    const size_t made = (size_t)of->answer->made, until = made + of->look - ensemble_finished(of);
    if (work->wanted > made)
        return;
    work->wanted = until < work->members ? until : work->members;
    if (work->expected < work->wanted)
        work->expected = work->wanted;
}

static Status ensemble_fold(StudyWork *of, size_t index, void *made, Problem *problem) {
    EnsembleWork *work = (EnsembleWork *)(void *)of;
    Ensemble *answer = work->answer;
    StudyPart *part = made;
    EnsembleRun *run = &answer->table.at[index];
    *run = (EnsembleRun){ensemble_seed(work, index), part->why, part->steps, part->summary};
    part->why = NULL;
    work->statuses[index] = part->status;
    answer->table.count = index + 1;
    answer->made++;
    if (run->why != NULL) {
        answer->failed++;
    } else {
        answer->steps += run->steps;
        if (!work->has_force)
            run->summary.peak_contact_force = (double)NAN;
        TRY(ensemble_add_spectrum(work, part, problem));
    }
    if (!ensemble_has_target(work))
        return STATUS_OK;
    if (answer->made == answer->runs || ensemble_finished(work) >= work->look)
        return ensemble_check_target(work, problem);
    ensemble_extend(work);
    return STATUS_OK;
}

static Status ensemble_fill_target(const EnsembleWork *work, Problem *problem) {
    EnsembleTarget *target = &work->answer->target;
    if (!ensemble_has_target(work))
        return STATUS_OK;
    const char *name = ensemble_metric_names[work->study->metric];
    const unsigned long long made = (unsigned long long)work->answer->made,
                             all = (unsigned long long)work->study->runs;
    char text[320];
    target->error = work->study->target;
    target->metric = work->study->metric;
    target->confidence = ENSEMBLE_CONFIDENCE;
    target->is_kept = target->estimated_error <= target->error;
    if (isnan(target->estimated_error))
        snprintf(text, sizeof text, "no run of %llu came to an end that tells %s", all, name);
    else if (made == all)
        snprintf(text, sizeof text,
                 "all %llu runs were made: no fewer were sure to keep the mean of %s within %g",
                 all, name, target->error);
    else
        snprintf(text, sizeof text,
                 "%llu of %llu runs keep the mean of %s within %g of that of all: within %.2g with "
                 "%g %% confidence",
                 made, all, name, target->error, target->estimated_error, 100 * target->confidence);
    target->why = strdup(text);
    return target->why != NULL ? STATUS_OK : ensemble_no_memory(problem);
}

static Status ensemble_end(StudyWork *of, const StudyTools *tools, Problem *problem) {
    const EnsembleWork *work = (const EnsembleWork *)(const void *)of;
    Ensemble *answer = work->answer;
    (void)tools;
    TRY(ensemble_fill_target(work, problem));
    for (int metric = 0; metric < ENSEMBLE_STATISTICS; metric++)
        TRY(statistics_fold(&answer->table, metric, ensemble_statistic(&answer->statistics, metric),
                            problem));
    statistics_trust(&answer->table, &answer->trust);
    TRY(statistics_failures(&answer->table, work->statuses, &answer->failures, problem));
    return spectrum_accumulator_report(&work->fold, &work->like, answer, problem);
}

static void ensemble_free(StudyWork *of) {
    EnsembleWork *work = (EnsembleWork *)(void *)of;
    spectrum_clear(&work->like);
    spectrum_accumulator_clear(&work->fold);
    simulation_clear(&work->member);
    free(work->statuses);
    free(work);
}

// Bytes of the densities of one run, nearly.
static size_t ensemble_density_bytes(const Simulation *simulation) {
    const SpectrumRequest *psd = &simulation->output.psd;
    return psd->channels.count == 0
               ? 0
               : sizeof(double) * (psd->channels.count + 1) * ((size_t)psd->segment / 2 + 1);
}

static Status ensemble_begin(const Study *asked, const Simulation *simulation,
                             const StudyTools *tools, Variant *told, StudyWork **made,
                             Problem *problem) {
    const EnsembleStudy *study = (const EnsembleStudy *)(const void *)asked;
    Ensemble *answer = (Ensemble *)(void *)told;
    const size_t runs = (size_t)study->runs;
    EnsembleWork *work = calloc(1, sizeof *work);
    (void)tools;
    if (work == NULL)
        return ensemble_no_memory(problem);
    *work = (EnsembleWork){
        .work = {.kind = &study_ensemble,
                 .members = runs,
                 .wanted = runs,
                 .expected = runs,
                 .part_bytes = sizeof(StudyPart) + ensemble_density_bytes(simulation)},
        .study = study,
        .has_force = study_run_has_force(simulation),
        .answer = answer,
        .statuses = calloc(runs, sizeof(Status)),
        .look = ENSEMBLE_PILOT};
    if (ensemble_has_target(work) && runs > ENSEMBLE_PILOT)
        work->work.wanted = ENSEMBLE_PILOT;
    answer->runs = study->runs;
    answer->first_seed = study->first_seed;
    answer->confidence = ENSEMBLE_INTERVAL;
    answer->table.at = calloc(runs, sizeof *answer->table.at);
    Status status = STATUS_OK;
    if (work->statuses == NULL || answer->table.at == NULL)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for %zu runs", runs);
    if (status == STATUS_OK)
        status = ensemble_member(simulation, study->first_seed, &work->member, problem);
    if (status == STATUS_OK)
        *made = &work->work;
    else
        ensemble_free(&work->work);
    return status;
}

static const StudyMembers ensemble_members = {
    .begin = ensemble_begin,
    .make = ensemble_make,
    .fold = ensemble_fold,
    .drop = ensemble_drop,
    .end = ensemble_end,
    .free = ensemble_free,
};

enum { RUNS = 10000 };

const char *const ensemble_metric_names[] = {
    "peak_displacement",
    "rms_displacement",
    "peak_acceleration",
    "rms_acceleration",
    "impacts",
    "peak_contact_force",
    "psd",
    NULL,
};

// clang-format off
static const Field study_fields[] = {
    FIELD_COUNT(EnsembleStudy, runs, NULL, WITHIN(2, RUNS), 64, "runs, each with a seed of its own; under a target at most so many"),
    FIELD_COUNT(EnsembleStudy, first_seed, NULL, WITHIN(0, 0x1p53 - 1), OPTIONAL, "the seeds are this one and those that follow it; the excitation's own if absent"),
    FIELD_REAL(EnsembleStudy, target, NULL, ABOVE(0), OPTIONAL, "relative error wanted of the metric's mean, against its mean over all of the runs: no more of them are made than keep it; if absent, all are"),
    FIELD_CHOICE(EnsembleStudy, metric, ensemble_metric_names, OPTIONAL, "what the target is of; psd: the norm of the difference of the mean densities over the norm of the density, of the channel that is farthest off; rms_displacement if absent"),
    FIELD_END
};

static const Field statistic_fields[] = {
    FIELD_TEXT(EnsembleStatistic, unit, 0, PRESENCE_OPTIONAL, 0, "of all that follows"),
    FIELD_COUNT(EnsembleStatistic, count, NULL, AT_MIN(0), 0, "runs that know it"),
    FIELD_REAL(EnsembleStatistic, mean, NULL, ANY, OPTIONAL, "mean over those"),
    FIELD_REAL(EnsembleStatistic, standard_deviation, NULL, ANY, OPTIONAL, "of one run"),
    FIELD_REAL(EnsembleStatistic, standard_error, NULL, ANY, OPTIONAL, "of the mean"),
    FIELD_REAL(EnsembleStatistic, low, NULL, ANY, OPTIONAL, "the interval of the mean over all seeds there are begins here, by Student's t"),
    FIELD_REAL(EnsembleStatistic, high, NULL, ANY, OPTIONAL, "and ends here"),
    FIELD_REAL(EnsembleStatistic, minimum, NULL, ANY, OPTIONAL, "the smallest"),
    FIELD_REAL(EnsembleStatistic, q05, NULL, ANY, OPTIONAL, "5 % of the runs are below"),
    FIELD_REAL(EnsembleStatistic, q25, NULL, ANY, OPTIONAL, "25 % are"),
    FIELD_REAL(EnsembleStatistic, median, NULL, ANY, OPTIONAL, "half of them are"),
    FIELD_REAL(EnsembleStatistic, q75, NULL, ANY, OPTIONAL, "75 % are"),
    FIELD_REAL(EnsembleStatistic, q95, NULL, ANY, OPTIONAL, "95 % are"),
    FIELD_REAL(EnsembleStatistic, maximum, NULL, ANY, OPTIONAL, "the largest"),
    FIELD_COUNT(EnsembleStatistic, minimum_seed, NULL, AT_MIN(0), OPTIONAL, "seed of the smallest, the first of equal ones"),
    FIELD_COUNT(EnsembleStatistic, maximum_seed, NULL, AT_MIN(0), OPTIONAL, "seed of the largest"),
    FIELD_END
};

static const Field statistics_fields[] = {
    FIELD_ITEM(EnsembleStatistics, peak_displacement, statistic_fields, NULL, PRESENCE_DEFAULT, "of the summary's number of this name"),
    FIELD_ITEM(EnsembleStatistics, rms_displacement, statistic_fields, NULL, PRESENCE_DEFAULT, "likewise"),
    FIELD_ITEM(EnsembleStatistics, peak_acceleration, statistic_fields, NULL, PRESENCE_DEFAULT, "likewise"),
    FIELD_ITEM(EnsembleStatistics, rms_acceleration, statistic_fields, NULL, PRESENCE_DEFAULT, "likewise"),
    FIELD_ITEM(EnsembleStatistics, impacts, statistic_fields, NULL, PRESENCE_DEFAULT, "likewise"),
    FIELD_ITEM(EnsembleStatistics, peak_contact_force, statistic_fields, NULL, PRESENCE_DEFAULT, "likewise; unknown where contacts have no force"),
    FIELD_END
};

static const Field trust_fields[] = {
    FIELD_COUNT(EnsembleTrust, whole, NULL, AT_MIN(0), 0, "runs whose trajectory is their scene's own to the end"),
    FIELD_COUNT(EnsembleTrust, beyond, NULL, AT_MIN(0), 0, "runs that go on beyond their trust horizon: there only statistics hold"),
    FIELD_COUNT(EnsembleTrust, unknown, NULL, AT_MIN(0), 0, "runs whose error nothing estimates"),
    FIELD_REAL(EnsembleTrust, shortest_horizon, "s", ANY, OPTIONAL, "of those that have one"),
    FIELD_REAL(EnsembleTrust, largest_error_estimate, NULL, ANY, OPTIONAL, "of those that have one"),
    FIELD_REAL(EnsembleTrust, largest_energy_residual, NULL, ANY, OPTIONAL, "of all that came to an end"),
    FIELD_END
};

static const Field failure_fields[] = {
    FIELD_TEXT(EnsembleFailure, reason, 0, PRESENCE_OPTIONAL, 0, "in a word"),
    FIELD_COUNT(EnsembleFailure, count, NULL, AT_MIN(1), 0, "runs that failed so"),
    FIELD_COUNT(EnsembleFailure, first_seed, NULL, AT_MIN(0), OPTIONAL, "the first of their seeds"),
    FIELD_TEXT(EnsembleFailure, detail, 0, PRESENCE_OPTIONAL, 0, "what that one said"),
    FIELD_END
};

static const Field spectrum_fields[] = {
    FIELD_TEXT(EnsembleSpectrum, channel, 0, PRESENCE_OPTIONAL, 0, "channel"),
    FIELD_TEXT(EnsembleSpectrum, unit, 0, PRESENCE_OPTIONAL, 0, "of the densities"),
    FIELD_REALS(EnsembleSpectrum, mean, NULL, ANY, 0, PRESENCE_OPTIONAL, "mean of the runs' densities at each frequency"),
    FIELD_REALS(EnsembleSpectrum, standard_deviation, NULL, ANY, 0, PRESENCE_OPTIONAL, "of one run's density"),
    FIELD_REALS(EnsembleSpectrum, low, NULL, ANY, 0, PRESENCE_OPTIONAL, "the interval of the mean over all seeds there are begins here, at each frequency for itself, by Student's t of its logarithm"),
    FIELD_REALS(EnsembleSpectrum, high, NULL, ANY, 0, PRESENCE_OPTIONAL, "and ends here"),
    FIELD_END
};

static const Field run_fields[] = {
    FIELD_COUNT(EnsembleRun, seed, NULL, AT_MIN(0), OPTIONAL, "the scene with this seed gives this row"),
    FIELD_TEXT(EnsembleRun, why, 0, PRESENCE_OPTIONAL, 0, "it failed for this reason"),
    FIELD_REAL(EnsembleRun, steps, NULL, ANY, OPTIONAL, "solver steps, counted"),
    FIELD_BASE(EnsembleRun, summary, summary_fields),
    FIELD_END
};

static const Field ensemble_target_fields[] = {
    FIELD_REAL(EnsembleTarget, error, NULL, ANY, OPTIONAL, "relative error wanted of the mean, against the mean of all runs asked for"),
    FIELD_CHOICE(EnsembleTarget, metric, ensemble_metric_names, OPTIONAL, "of what"),
    FIELD_REAL(EnsembleTarget, confidence, NULL, ANY, OPTIONAL, "that the error is no larger than estimated"),
    FIELD_COUNT(EnsembleTarget, pilot, NULL, AT_MIN(0), OPTIONAL, "runs that were made before any were foretold"),
    FIELD_COUNT(EnsembleTarget, predicted_runs, NULL, AT_MIN(0), OPTIONAL, "runs foretold after those to keep the target, themselves among them"),
    FIELD_REAL(EnsembleTarget, estimated_error, NULL, ANY, OPTIONAL, "of the mean of the runs made; 0 where all were"),
    FIELD_FLAG(EnsembleTarget, is_kept, false, "the estimated error is within the one wanted"),
    FIELD_TEXT(EnsembleTarget, why, 0, PRESENCE_OPTIONAL, 0, "in words"),
    FIELD_END
};

static const Field answer_fields[] = {
    FIELD_COUNT(Ensemble, runs, NULL, AT_MIN(1), OPTIONAL, "runs asked for"),
    FIELD_COUNT(Ensemble, first_seed, NULL, AT_MIN(0), OPTIONAL, "seed of the first"),
    FIELD_COUNT(Ensemble, made, NULL, AT_MIN(0), 0, "runs made"),
    FIELD_COUNT(Ensemble, failed, NULL, AT_MIN(0), 0, "those of them that failed; the others alone are counted in all that follows"),
    FIELD_REAL(Ensemble, steps, NULL, ANY, 0, "solver steps of all, counted"),
    FIELD_REAL(Ensemble, confidence, NULL, ANY, OPTIONAL, "of the intervals of means"),
    FIELD_ITEM_OR_NULL(Ensemble, target, ensemble_target_fields, PRESENCE_OPTIONAL, "what became of the target"),
    FIELD_ITEM(Ensemble, statistics, statistics_fields, NULL, PRESENCE_DEFAULT, "over the runs"),
    FIELD_ITEM(Ensemble, trust, trust_fields, NULL, PRESENCE_DEFAULT, "how far single trajectories can be trusted"),
    FIELD_LIST(Ensemble, failures, failure_fields, 0, PRESENCE_DEFAULT, "runs that failed, by their reason"),
    FIELD_REALS(Ensemble, frequency, "Hz", ANY, 0, PRESENCE_OPTIONAL, "of the spectra"),
    FIELD_LIST(Ensemble, spectra, spectrum_fields, 0, PRESENCE_DEFAULT, "mean densities, channel by channel"),
    FIELD_LIST(Ensemble, table, run_fields, 0, PRESENCE_DEFAULT, "every run, in the order of the seeds"),
    FIELD_END
};
// clang-format on

static Status ensemble_check_seeds(const EnsembleStudy *study, Problem *problem) {
    if (!((double)study->first_seed + (double)(study->runs - 1) > 0x1p53 - 1))
        return STATUS_OK;
    char most[32];
    return problem_add_real(problem, STATUS_INVALID, "/study/first_seed", (double)study->first_seed,
                            NULL, "must be at most %s for %llu runs: seeds end at 2^53 - 1",
                            text_real(most, 0x1p53 - (double)study->runs),
                            (unsigned long long)study->runs);
}

static Status ensemble_check_metric(const EnsembleStudy *study, const Simulation *simulation,
                                    Problem *problem) {
    static const char pointer[] = "/study/metric";
    if (study->metric == ENSEMBLE_PSD && simulation->output.psd.channels.count == 0)
        return problem_add(problem, STATUS_INVALID, pointer,
                           "psd needs spectra: ask for some in /output/psd");
    if (study->metric == ENSEMBLE_PEAK_CONTACT_FORCE && !study_run_has_force(simulation))
        return problem_add(
            problem, STATUS_INVALID, pointer, "peak_contact_force needs contacts with a force: %s",
            simulation->scene.dampers.count > 0 ? "impulses have none, choose another contact model"
                                                : "the scene has no damper");
    if (study->metric == ENSEMBLE_IMPACTS && simulation->scene.dampers.count == 0)
        return problem_add(problem, STATUS_INVALID, pointer,
                           "impacts needs a damper: the scene has none");
    return STATUS_OK;
}

// Mean, deviation and interval of each density are kept and told.
static Status ensemble_check_densities(const Simulation *simulation, Problem *problem) {
    const SpectrumRequest *psd = &simulation->output.psd;
    if (psd->channels.count == 0)
        return STATUS_OK;
    const double values = (double)psd->channels.count * ((double)(psd->segment / 2) + 1);
    if (values <= STUDY_DENSITIES_MAX)
        return STATUS_OK;
    return problem_add(problem, STATUS_INVALID, "/output/psd/segment",
                       "%zu spectra of segments of %llu samples are %.0f densities, an ensemble "
                       "takes at most %d: ask for shorter segments or fewer channels",
                       psd->channels.count, (unsigned long long)psd->segment, values,
                       STUDY_DENSITIES_MAX);
}

static Status ensemble_complete(Study *asked, const Simulation *simulation,
                                const SimulationLimits *limits, Problem *problem) {
    (void)limits;
    EnsembleStudy *study = (EnsembleStudy *)(void *)asked;
    const ExcitationKind *kind = excitation_kind(scene_excitation(&simulation->scene));
    if (kind != &excitation_random)
        return problem_add(problem, STATUS_INVALID, "/study/kind",
                           "ensemble runs many seeds of a random base: /excitation/kind must be "
                           "random, is %s",
                           kind->kind.name);
    if (study->first_seed == COUNT_ABSENT)
        study->first_seed =
            ((const ExcitationRandom *)(const void *)scene_excitation(&simulation->scene))->seed;
    if (isnan(study->target))
        study->metric = CHOICE_ABSENT;
    else if (study->metric == CHOICE_ABSENT)
        study->metric = ENSEMBLE_RMS_DISPLACEMENT;
    const Status seeds = ensemble_check_seeds(study, problem);
    const Status metric = ensemble_check_metric(study, simulation, problem);
    const Status densities = ensemble_check_densities(simulation, problem);
    return seeds != STATUS_OK ? seeds : metric != STATUS_OK ? metric : densities;
}

// Under a target fewer may do: what they are is not known before some were made.
static Status ensemble_cost(const Study *asked, const Simulation *simulation,
                            const SimulationLimits *limits, double *steps, Problem *problem) {
    (void)limits;
    (void)problem;
    Simulation member = *simulation; // a borrowed view
    member.output.channels = (Texts){NULL, 0};
    *steps =
        (double)((const EnsembleStudy *)(const void *)asked)->runs * simulation_cost(&member).steps;
    return STATUS_OK;
}

static const Kind ensemble_answer = {"ensemble", "what many seeds came to", answer_fields,
                                     sizeof(Ensemble)};

const StudyKind study_ensemble = {
    .kind = {"ensemble", "many seeds of a random base: means with their confidence, and spread",
             study_fields, sizeof(EnsembleStudy)},
    .answer = &ensemble_answer,
    .lessen = "ask for fewer runs",
    .complete = ensemble_complete,
    .cost = ensemble_cost,
    .members = &ensemble_members,
};
