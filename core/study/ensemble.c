// The tables of what is asked and answered, and what of it can be judged before anything runs.
#include "core/study/ensemble.h"

#include "core/excitation/random.h"
#include "core/study/candidate_settings.h"
#include "core/study/ensemble_run.h"
#include "core/study/spectrum_accumulator.h"

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

static const Field kept_fields[] = {
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
    FIELD_ITEM_OR_NULL(Ensemble, target, kept_fields, PRESENCE_OPTIONAL, "what became of the target"),
    FIELD_ITEM(Ensemble, statistics, statistics_fields, NULL, PRESENCE_DEFAULT, "over the runs"),
    FIELD_ITEM(Ensemble, trust, trust_fields, NULL, PRESENCE_DEFAULT, "how far single trajectories can be trusted"),
    FIELD_LIST(Ensemble, failures, failure_fields, 0, PRESENCE_DEFAULT, "runs that failed, by their reason"),
    FIELD_REALS(Ensemble, frequency, "Hz", ANY, 0, PRESENCE_OPTIONAL, "of the spectra"),
    FIELD_LIST(Ensemble, spectra, spectrum_fields, 0, PRESENCE_DEFAULT, "mean densities, channel by channel"),
    FIELD_LIST(Ensemble, table, run_fields, 0, PRESENCE_DEFAULT, "every run, in the order of the seeds"),
    FIELD_END
};
// clang-format on

static Status check_seeds(const EnsembleStudy *study, Problem *problem) {
    if (!((double)study->first_seed + (double)(study->runs - 1) > 0x1p53 - 1))
        return STATUS_OK;
    char most[32];
    return problem_add_real(problem, STATUS_INVALID, "/study/first_seed", (double)study->first_seed,
                            NULL, "must be at most %s for %llu runs: seeds end at 2^53 - 1",
                            text_real(most, 0x1p53 - (double)study->runs),
                            (unsigned long long)study->runs);
}

static Status check_metric(const EnsembleStudy *study, const Simulation *simulation,
                           Problem *problem) {
    static const char pointer[] = "/study/metric";
    if (study->metric == ENSEMBLE_PSD && simulation->output.psd.channels.count == 0)
        return problem_add(problem, STATUS_INVALID, pointer,
                           "psd needs spectra: ask for some in /output/psd");
    if (study->metric == ENSEMBLE_PEAK_CONTACT_FORCE && !ladder_has_force(simulation))
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
static Status check_densities(const Simulation *simulation, Problem *problem) {
    const SpectrumRequest *psd = &simulation->output.psd;
    if (psd->channels.count == 0)
        return STATUS_OK;
    const double values = (double)psd->channels.count * ((double)(psd->segment / 2) + 1);
    if (values <= SPECTRA_VALUES)
        return STATUS_OK;
    return problem_add(problem, STATUS_INVALID, "/output/psd/segment",
                       "%zu spectra of segments of %llu samples are %.0f densities, an ensemble "
                       "takes at most %d: ask for shorter segments or fewer channels",
                       psd->channels.count, (unsigned long long)psd->segment, values,
                       SPECTRA_VALUES);
}

static Status study_complete(Study *asked, const Simulation *simulation,
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
    const Status seeds = check_seeds(study, problem);
    const Status metric = check_metric(study, simulation, problem);
    const Status densities = check_densities(simulation, problem);
    return seeds != STATUS_OK ? seeds : metric != STATUS_OK ? metric : densities;
}

// Under a target fewer may do: what they are is not known before some were made.
static Status study_cost(const Study *asked, const Simulation *simulation,
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
    .complete = study_complete,
    .cost = study_cost,
    .members = &ensemble_members,
};
