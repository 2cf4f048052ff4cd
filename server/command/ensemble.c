// impactd ensemble SCENE.json: the study of the same name, as the daemon makes it, as a table.
#include "server/command/command.h"

#include <stdio.h>
#include <string.h>

#include "core/study/ensemble.h"
#include "server/command/scene_file.h"
#include "server/command/study.h"

typedef struct EnsembleSettings {
    Texts output;
    uint64_t runs, first_seed;
    double target;
    int metric;
    double max_cpu_seconds;
} EnsembleSettings;

// Ranges and defaults are the study's own.
static const Field ensemble_fields[] = {
    FIELD_TEXTS(EnsembleSettings, output, NULL, NULL, STUDY_OUTPUTS, PRESENCE_OPTIONAL, 0,
                "write to this file, .json the whole, .csv the runs or .svg the chart; may be "
                "given again"),
    FIELD_COUNT(EnsembleSettings, runs, NULL, AT_MIN(0), OPTIONAL,
                "runs, under a target at most so many (64)"),
    FIELD_COUNT(EnsembleSettings, first_seed, NULL, AT_MIN(0), OPTIONAL,
                "seed of the first (the scene's own)"),
    FIELD_REAL(EnsembleSettings, target, NULL, ANY, OPTIONAL,
               "relative error wanted of the metric's mean: no more runs than keep it"),
    FIELD_CHOICE(EnsembleSettings, metric, statistics_metric_names, OPTIONAL,
                 "peak_displacement, rms_displacement (usual), peak_acceleration, "
                 "rms_acceleration, impacts, peak_contact_force or psd"),
    SCENE_FILE_CPU_ROW(EnsembleSettings),
    FIELD_END,
};

static void study_choose(void *asked, void *of) {
    const EnsembleSettings *settings = of;
    EnsembleStudy *study = (EnsembleStudy *)(void *)asked;
    if (settings->runs != COUNT_ABSENT)
        study->runs = settings->runs;
    if (settings->first_seed != COUNT_ABSENT)
        study->first_seed = settings->first_seed;
    if (!isnan(settings->target))
        study->target = settings->target;
    if (settings->metric != CHOICE_ABSENT)
        study->metric = settings->metric;
}

static void statistic_print(int metric, const RunStatistic *statistic) {
    char name[48], cell[7][24];
    const bool has_unit = statistic->unit != NULL && strcmp(statistic->unit, "1") != 0;
    snprintf(name, sizeof name, "%s%s%s%s", statistics_metric_names[metric], has_unit ? " [" : "",
             has_unit ? statistic->unit : "", has_unit ? "]" : "");
    printf("  %-25s %10s %8s %8s %9s %9s %9s\n", name,
           study_number(cell[0], "%.5g", statistic->mean),
           study_number(cell[1], "%.2g", statistic->high - statistic->mean),
           study_number(cell[2], "%.2g", statistic->standard_deviation),
           study_number(cell[3], "%.4g", statistic->minimum),
           study_number(cell[4], "%.4g", statistic->median),
           study_number(cell[5], "%.4g", statistic->maximum));
}

static void statistics_print(const Ensemble *ensemble) {
    printf("  %-25s %10s %8s %8s %9s %9s %9s\n", "", "mean", "+-", "s.d.", "smallest", "median",
           "largest");
    for (int metric = 0; metric < STATISTICS_METRICS; metric++)
        statistic_print(metric, &ensemble->statistics.of[metric]);
}

static void spectrum_print(const Ensemble *ensemble, const RunSpectrum *spectrum) {
    size_t peak = 0;
    for (size_t k = 1; k < spectrum->mean.count; k++)
        if (spectrum->mean.at[k] > spectrum->mean.at[peak])
            peak = k;
    if (spectrum->low.count == 0)
        return;
    printf("  psd of %s: largest at %.4g Hz, %.4g %s, between %.4g and %.4g\n", spectrum->channel,
           ensemble->frequency.at[peak], spectrum->mean.at[peak], spectrum->unit,
           spectrum->low.at[peak], spectrum->high.at[peak]);
}

static void failures_print(const StudyFailures *failures) {
    for (size_t i = 0; i < failures->count; i++)
        printf("%llu failed, %s; first seed %llu: %s\n", (unsigned long long)failures->at[i].count,
               failures->at[i].reason, (unsigned long long)failures->at[i].first,
               failures->at[i].detail);
}

static void ensemble_print(const Variant *answer) {
    const Ensemble *ensemble = (const Ensemble *)(const void *)answer;
    const EnsembleTarget *target = &ensemble->target;
    const unsigned long long made = (unsigned long long)ensemble->made;
    printf("%llu run%s, seeds %llu to %llu, %.3g solver steps. Means with their %g %% interval "
           "(Student's t).\n\n",
           made, made == 1 ? "" : "s", (unsigned long long)ensemble->first_seed,
           (unsigned long long)ensemble->first_seed + made - 1, ensemble->steps,
           100 * ensemble->confidence);
    statistics_print(ensemble);
    if (ensemble->spectra.count > 0)
        putchar('\n');
    for (size_t i = 0; i < ensemble->spectra.count; i++)
        spectrum_print(ensemble, &ensemble->spectra.at[i]);
    putchar('\n');
    failures_print(&ensemble->failures);
    if (ensemble->trust.beyond > 0)
        printf("%llu of the runs go on beyond their trust horizon, t = %.4g s at the shortest: "
               "statistics hold there, single motions do not.\n",
               (unsigned long long)ensemble->trust.beyond, ensemble->trust.shortest_horizon);
    if (target->why == NULL)
        return;
    if (target->predicted_runs != COUNT_ABSENT)
        printf("After %llu runs, %llu were foretold to be enough.\n",
               (unsigned long long)target->pilot, (unsigned long long)target->predicted_runs);
    printf("Target %s: %s.\n", target->is_kept ? "kept" : "not kept", target->why);
}

static const StudyCommand study = {&study_ensemble, study_choose, ensemble_print};

static int ensemble(const Command *self, void *of, const Options *options, Problem *problem) {
    EnsembleSettings *settings = of;
    return study_command_run(self, &study, &settings->output, settings->max_cpu_seconds, settings,
                             options, problem);
}

const Command command_ensemble = {
    .name = "ensemble",
    .operands = "SCENE.json",
    .summary = "many seeds of a random base: means with their confidence, and spread",
    .help =
        "  impactd ensemble scene.json                          64 seeds: statistics and spectra\n"
        "  impactd ensemble scene.json --runs 1000 -o out.csv   each run's numbers, by its seed\n"
        "  impactd ensemble scene.json -o out.svg -o out.json   the chart, and all of it\n"
        "  impactd ensemble scene.json --runs 1000 --target 0.01\n"
        "                        no more of the 1000 than tell their mean rms displacement to 1 %\n"
        "  impactd ensemble scene.json --runs 1000 --target 0.05 --metric psd\n"
        "  impactd ensemble - < scene.json                      from standard input\n"
        "\n"
        "The scene's excitation must be random. A run is the scene with one seed, from "
        "--first-seed\n"
        "on; any of them can be run again alone. One that fails is told and left out. The same\n"
        "study gives the same bytes. Ctrl-C stops at once. Exit code 3 if the scene has faults.\n",
    .options = ensemble_fields,
    .size = sizeof(EnsembleSettings),
    .run = ensemble,
};
