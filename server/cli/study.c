// impactd study, tradeoff, ensemble, sweep SCENE.json: studies made here as the daemon makes them,
// printed as tables or as JSON and written to files.
#include <stdio.h>
#include <string.h>

#include "core/study/ensemble.h"
#include "core/study/study.h"
#include "core/study/sweep.h"
#include "core/study/tradeoff.h"
#include "server/cli/command.h"
#include "server/cli/output.h"
#include "server/cli/scene_file.h"
#include "server/formats/study_formats.h"
#include "server/jobs/jobs.h"
#include "server/jobs/study_engine.h"
#include "server/json/table.h"

enum { OUTPUTS_MAX = 8, SOLVERS_MAX = 32 };

typedef struct StudyCommand StudyCommand;

// Of all four commands; each has rows for its own members.
typedef struct StudySettings {
    const StudyCommand *command;
    Texts output;
    bool json;
    double max_cpu_seconds;
    int metric; // of the study's own names; CHOICE_ABSENT
    double error, point_steps;
    uint64_t repeats;
    Texts solver;
    uint64_t runs, first_seed;
    double target;
} StudySettings;

struct StudyCommand {
    const StudyKind *kind; // NULL: the document's own study, whatever it is; it must have one
    // Puts what the flags say into the document's own study of this kind, or into a new one; may
    // take what `settings` own. NULL: the document alone counts.
    void (*choose)(void *study, StudySettings *settings);
    void (*print)(const Variant *answer); // a table for people; NULL: JSON
};

#define OUTPUT_ROW(formats)                                                                        \
    FIELD_TEXTS(StudySettings, output, NULL, NULL, OUTPUTS_MAX, PRESENCE_OPTIONAL, 0,              \
                "write to this file, " formats "; may be given again")
#define JSON_ROW FIELD_FLAG(StudySettings, json, false, "print the document, as the daemon has it")

// The format that a path ends in, NULL if there is none.
static const StudyFormat *study_format(const StudyCommand *command, const char *path) {
    const char *extension = strrchr(path, '.');
    if (extension == NULL || extension == path || extension[-1] == '/')
        return NULL;
    return study_format_find(study_formats(command->kind->answer), extension + 1);
}

static Status study_check_outputs(const StudyCommand *command, const Texts *outputs,
                                  Problem *problem) {
    Status status = STATUS_OK;
    char names[64];
    study_formats_names(study_formats(command->kind->answer), ".", names, sizeof names);
    for (size_t i = 0; i < outputs->count; i++)
        if (study_format(command, outputs->at[i]) == NULL)
            status = problem_add(problem, STATUS_USAGE, "--output",
                                 "must end in one of %s, is %.200s", names, outputs->at[i]);
    return status;
}

static Status study_write(const StudyCommand *command, const char *path, const Variant *answer,
                          Problem *problem) {
    Bytes bytes = {0};
    const StudyFormat *format = study_format(command, path);
    format->write(answer, format->extension, &bytes);
    Status status = bytes.is_failed
                        ? problem_set(problem, STATUS_NO_MEMORY, "no memory for the answer")
                        : output_open(path, problem);
    if (status == STATUS_OK)
        status = output_write(bytes.at, bytes.count, problem);
    if (status == STATUS_OK)
        status = output_close(problem);
    output_drop();
    bytes_clear(&bytes);
    return status;
}

// As JSON, the first format of every study.
static void study_print_json(const Variant *answer) {
    Bytes bytes = {0};
    const StudyFormat *json = study_formats(answer->kind);
    json->write(answer, json->extension, &bytes);
    if (bytes.at != NULL)
        (void)fwrite(bytes.at, 1, bytes.count, stdout);
    bytes_clear(&bytes);
}

static Status study_make(const StudyCommand *command, const StudyRequest *inquiry,
                         const StudySettings *settings, const SimulationLimits *limits,
                         Problem *problem) {
    const Texts *outputs = &settings->output;
    ProgressBar bar;
    Variant *answer = NULL;
    progress_bar_start(&bar);
    const Progress watch = progress_bar_watch(&bar);
    Status status =
        study_engine_run(inquiry->study, &inquiry->simulation, limits, &watch, &answer, problem);
    progress_bar_stop(&bar);
    // The document's own study prints nothing where it is written to files.
    const bool is_quiet = command->print == NULL && outputs->count > 0 && !settings->json;
    if (status == STATUS_OK && (command->print == NULL || settings->json) && !is_quiet)
        study_print_json(answer);
    else if (status == STATUS_OK && !is_quiet)
        command->print(answer);
    for (size_t i = 0; i < outputs->count && status == STATUS_OK; i++)
        status = study_write(command, outputs->at[i], answer, problem);
    variant_free(answer);
    return status;
}

// The document's own study, or a new one, with what the flags say.
static Status study_choose(const StudyCommand *command, StudyRequest *inquiry,
                           StudySettings *settings, Problem *problem) {
    if (inquiry->study == NULL && command->kind == NULL)
        return problem_add(problem, STATUS_INVALID, "/study",
                           "is required: what is to be found out, like {\"kind\": \"%s\"}",
                           studies[0]->kind.name);
    if (command->kind == NULL)
        return STATUS_OK;
    if (inquiry->study != NULL && inquiry->study->kind != &command->kind->kind) {
        variant_free(inquiry->study);
        inquiry->study = NULL;
    }
    if (inquiry->study == NULL)
        inquiry->study = variant_new(&command->kind->kind);
    if (inquiry->study == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
    if (command->choose != NULL)
        command->choose(inquiry->study, settings);
    return STATUS_OK;
}

static Status study_scene(const char *path, const Bytes *text, void *of, Problem *problem) {
    StudySettings *settings = of;
    const StudyCommand *command = settings->command;
    const SimulationLimits limits = scene_file_limits(settings->max_cpu_seconds);
    const Texts *outputs = &settings->output;
    Db *db = NULL;
    StudyRequest inquiry = {0};
    Warnings warnings = {0};
    TRY(db_open(NULL, &db, problem));
    Status status = jobs_prepare(db, text->at, text->count, &limits, &inquiry, &warnings, problem);
    db_close(db);
    if (status == STATUS_OK)
        scene_file_warn(path, &warnings);
    if (status == STATUS_OK)
        status = study_choose(command, &inquiry, settings, problem);
    if (status == STATUS_OK)
        status = study_request_complete(&inquiry, &limits, NULL, problem);
    StudyCommand own = *command;
    if (status == STATUS_OK && own.kind == NULL) {
        own.kind = study_kind(inquiry.study);
        status = study_check_outputs(&own, outputs, problem);
    }
    // Before the runs, so that a wrong folder is reported at once.
    for (size_t i = 0; i < outputs->count && status == STATUS_OK; i++) {
        status = output_open(outputs->at[i], problem);
        output_drop();
    }
    if (status == STATUS_OK)
        status = study_make(&own, &inquiry, settings, &limits, problem);
    study_request_clear(&inquiry);
    warnings_clear(&warnings);
    return status;
}

static int study_command(const Command *self, const StudyCommand *command, StudySettings *settings,
                         const Options *options, Problem *problem) {
    settings->command = command;
    return command->kind == NULL ||
                   study_check_outputs(command, &settings->output, problem) == STATUS_OK
               ? scene_file_command(self, "scene", options, settings, study_scene, problem)
               : command_error(self->name, problem);
}

static void study_heads_add(PrintTable *listing, const char *const *heads) {
    listing->has_heads = true;
    for (size_t i = 0; i < listing->columns; i++)
        print_table_add(listing, "%s", heads[i]);
}

// "rms_displacement [m]"
static void study_metric_add(PrintTable *listing, const char *name, const char *unit) {
    const bool has_unit = unit != NULL && strcmp(unit, "1") != 0;
    print_table_add(listing, "%.40s%s%s%s", name, has_unit ? " [" : "", has_unit ? unit : "",
                    has_unit ? "]" : "");
}

static const Field study_fields[] = {
    OUTPUT_ROW(".json the whole or .csv the table or .svg the chart, where the study has them"),
    JSON_ROW,
    SCENE_FILE_CPU_ROW(StudySettings),
    FIELD_END,
};

static int own_study_run(const Command *self, void *settings, const Options *options,
                         Problem *problem) {
    static const StudyCommand command = {.kind = NULL};
    return study_command(self, &command, settings, options, problem);
}

const Command command_study = {
    .name = "study",
    .operands = "SCENE.json",
    .summary = "make the study that a scene asks for: compare, sensitivity and the others",
    .help =
        "  impactd study scene.json                       the answer as JSON\n"
        "  impactd study scene.json -o out.svg -o out.csv the chart, and the table\n"
        "  impactd study - < scene.json                   from standard input\n"
        "\n"
        "The scene's member \"study\" says what is wanted, like {\"kind\": \"compare\"} for all "
        "contact\n"
        "models side by side. Ctrl-C stops at once. Exit code 3 if the scene has faults or no "
        "study,\n"
        "1 if its run failed.\n",
    .options = study_fields,
    .size = sizeof(StudySettings),
    .run = own_study_run,
};

// Ranges and defaults are the study's own.
static const Field tradeoff_fields[] = {
    OUTPUT_ROW(".json the table or .svg the chart"),
    JSON_ROW,
    FIELD_REAL(StudySettings, error, NULL, ANY, OPTIONAL,
               "error wanted, in the metric's unit (1e-3)"),
    FIELD_CHOICE(StudySettings, metric, metric_names, OPTIONAL,
                 "displacement, mean_acceleration, peak_force, impacts, psd or rms_displacement"),
    FIELD_COUNT(StudySettings, repeats, NULL, AT_MIN(0), OPTIONAL, "timings of each point (5)"),
    FIELD_TEXTS(StudySettings, solver, NULL, NULL, SOLVERS_MAX, PRESENCE_OPTIONAL, 0,
                "try this solver only; may be given again"),
    FIELD_REAL(StudySettings, point_steps, NULL, ANY, OPTIONAL,
               "solver steps a point may be predicted to take (5e7)"),
    SCENE_FILE_CPU_ROW(StudySettings),
    FIELD_END,
};

static void tradeoff_points_print(const Tradeoff *tradeoff) {
    static const char *const heads[] = {"  ",       "CPU [s]", "median",  "steps", "displ.",
                                        "mean acc", "force",   "impacts", "PSD dB"};
    PrintTable listing = {.columns = COUNT(heads)};
    study_heads_add(&listing, heads);
    for (size_t i = 0; i < tradeoff->points.count; i++) {
        const TradeoffPoint *point = &tradeoff->points.at[i];
        const Errors *errors = &point->errors;
        if (point->status != TRADEOFF_MEASURED)
            continue;
        print_table_add(&listing, "%c %s",
                        tradeoff->recommendation.point == i + 1 ? '>'
                        : point->is_best                        ? '*'
                                                                : ' ',
                        point->name);
        print_table_number(&listing, "%.2e", point->cpu_minimum);
        print_table_number(&listing, "%.2e", point->cpu_median);
        print_table_number(&listing, "%.2e", point->steps);
        print_table_number(&listing, "%.1e", errors->displacement);
        print_table_number(&listing, "%.1e", errors->mean_acceleration);
        print_table_number(&listing, "%.1e", errors->peak_force);
        print_table_number(&listing, "%.0f", errors->impacts);
        print_table_number(&listing, "%.2g", errors->psd);
    }
    print_table_print(&listing, stdout);
    for (size_t i = 0; i < tradeoff->points.count; i++) {
        const TradeoffPoint *point = &tradeoff->points.at[i];
        if (point->status != TRADEOFF_MEASURED)
            printf("  %s  %s: %s\n", point->name, tradeoff_status_names[point->status],
                   point->why != NULL ? point->why : "");
    }
}

static void tradeoff_print(const Variant *answer) {
    const Tradeoff *tradeoff = (const Tradeoff *)(const void *)answer;
    const ReferenceSummary *reference = &tradeoff->reference.yardstick;
    char estimate[24];
    snprintf(estimate, sizeof estimate, isnan(reference->error_estimate) ? "-" : "%.1e",
             reference->error_estimate);
    printf("Errors against %s, whose own is %s; ", tradeoff->reference.solver, estimate);
    if (isnan(reference->trust_horizon))
        puts("samples and impacts compared over the whole run.");
    else
        printf("samples and impacts compared to t = %.4g s, beyond which rounding decides.\n",
               reference->trust_horizon);
    if (!isnan(reference->psd_to))
        printf("Spectra compared from %.3g to %.4g Hz. ", reference->psd_from, reference->psd_to);
    printf("CPU times are the smallest and the median of %llu.\n\n",
           (unsigned long long)tradeoff->repeats);
    tradeoff_points_print(tradeoff);
    printf("\n* no other is both cheaper and closer in %s; > the one to take:\n%s.\n",
           metric_names[tradeoff->metric], tradeoff->recommendation.why);
}

static void tradeoff_choose(void *asked, StudySettings *settings) {
    TradeoffStudy *study = (TradeoffStudy *)(void *)asked;
    if (settings->metric != CHOICE_ABSENT && settings->metric != study->metric) {
        study->metric = settings->metric;
        study->error = (double)NAN; // the usual one of another metric
    }
    if (!isnan(settings->error))
        study->error = settings->error;
    if (settings->repeats != COUNT_ABSENT)
        study->repeats = settings->repeats;
    if (!isnan(settings->point_steps))
        study->point_steps = settings->point_steps;
    if (settings->solver.count > 0) {
        const Texts own = study->solvers;
        study->solvers = settings->solver;
        settings->solver = own;
    }
}

static int tradeoff_run(const Command *self, void *settings, const Options *options,
                        Problem *problem) {
    static const StudyCommand command = {&study_tradeoff, tradeoff_choose, tradeoff_print};
    return study_command(self, &command, settings, options, problem);
}

const Command command_tradeoff = {
    .name = "tradeoff",
    .operands = "SCENE.json",
    .summary = "try solvers and steps on a scene: error against CPU time",
    .help =
        "  impactd tradeoff scene.json                          the table, and what to take\n"
        "  impactd tradeoff scene.json --error 1e-6             for a displacement right to 1e-6\n"
        "  impactd tradeoff scene.json --metric psd --error 0.5 for spectra right to half a dB\n"
        "  impactd tradeoff scene.json -o out.svg -o out.json   the chart, and the table whole\n"
        "  impactd tradeoff scene.json --solver exact --solver rk4\n"
        "  impactd tradeoff - < scene.json                      from standard input\n"
        "\n"
        "Every solver is run at steps or tolerances a decade or two apart, and the exact one also\n"
        "with less: impulses for contacts, fewer modes or samples, shorter segments. Errors are "
        "the\n"
        "same each time; CPU times are measured and differ a little. Ctrl-C stops at once.\n"
        "Exit code 3 if the scene has faults, 1 if its exact run failed.\n",
    .options = tradeoff_fields,
    .size = sizeof(StudySettings),
    .run = tradeoff_run,
};

// Ranges and defaults are the study's own.
static const Field ensemble_fields[] = {
    OUTPUT_ROW(".json the whole, .csv the runs or .svg the chart"),
    JSON_ROW,
    FIELD_COUNT(StudySettings, runs, NULL, AT_MIN(0), OPTIONAL,
                "runs, under a target at most so many (64)"),
    FIELD_COUNT(StudySettings, first_seed, NULL, AT_MIN(0), OPTIONAL,
                "seed of the first (the scene's own)"),
    FIELD_REAL(StudySettings, target, NULL, ANY, OPTIONAL,
               "relative error wanted of the metric's mean: no more runs than keep it"),
    FIELD_CHOICE(StudySettings, metric, statistics_metric_names, OPTIONAL,
                 "peak_displacement, rms_displacement (usual), peak_acceleration, "
                 "rms_acceleration, impacts, peak_contact_force or psd"),
    SCENE_FILE_CPU_ROW(StudySettings),
    FIELD_END,
};

static void ensemble_choose(void *asked, StudySettings *settings) {
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

static void ensemble_statistics_print(const Ensemble *ensemble) {
    static const char *const heads[] = {"", "mean", "+-", "s.d.", "smallest", "median", "largest"};
    PrintTable listing = {.columns = COUNT(heads)};
    study_heads_add(&listing, heads);
    for (int metric = 0; metric < STATISTICS_METRICS; metric++) {
        const RunStatistic *statistic = &ensemble->statistics.of[metric];
        study_metric_add(&listing, statistics_metric_names[metric], statistic->unit);
        print_table_number(&listing, "%.5g", statistic->mean);
        print_table_number(&listing, "%.2g", statistic->high - statistic->mean);
        print_table_number(&listing, "%.2g", statistic->standard_deviation);
        print_table_number(&listing, "%.4g", statistic->minimum);
        print_table_number(&listing, "%.4g", statistic->median);
        print_table_number(&listing, "%.4g", statistic->maximum);
    }
    print_table_print(&listing, stdout);
}

static void ensemble_spectrum_print(const Ensemble *ensemble, const RunSpectrum *spectrum) {
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

static void ensemble_failures_print(const StudyFailures *failures) {
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
    ensemble_statistics_print(ensemble);
    if (ensemble->spectra.count > 0)
        putchar('\n');
    for (size_t i = 0; i < ensemble->spectra.count; i++)
        ensemble_spectrum_print(ensemble, &ensemble->spectra.at[i]);
    putchar('\n');
    ensemble_failures_print(&ensemble->failures);
    if (ensemble->trust.beyond > 0)
        printf("%llu of the runs go on beyond their trust horizon, t = %.4g s at the shortest: "
               "statistics hold there, single motions do not.\n",
               (unsigned long long)ensemble->trust.beyond, ensemble->trust.shortest_horizon);
    if (target->why == NULL)
        return;
    if (target->predicted_runs != COUNT_ABSENT)
        printf("After %llu runs, %llu were predicted to be enough.\n",
               (unsigned long long)target->pilot, (unsigned long long)target->predicted_runs);
    printf("Target %s: %s.\n", target->is_kept ? "kept" : "not kept", target->why);
}

static int ensemble_run(const Command *self, void *settings, const Options *options,
                        Problem *problem) {
    static const StudyCommand command = {&study_ensemble, ensemble_choose, ensemble_print};
    return study_command(self, &command, settings, options, problem);
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
        "on; any of them can be run again alone. One that fails is reported and left out. The "
        "same\n"
        "study gives the same bytes. Ctrl-C stops at once. Exit code 3 if the scene has faults.\n",
    .options = ensemble_fields,
    .size = sizeof(StudySettings),
    .run = ensemble_run,
};

static const Field sweep_fields[] = {
    OUTPUT_ROW(".json, .csv, .npy, .npz or .mat the table or .svg the chart"),
    JSON_ROW,
    SCENE_FILE_CPU_ROW(StudySettings),
    FIELD_END,
};

// The extremes of a metric, and where they are.
static void sweep_extremes_add(PrintTable *listing, const Sweep *sweep, size_t metric) {
    const SweepTable *table = &sweep->table;
    const size_t metrics = sweep->metrics.count, none = table->points.count;
    size_t ends[2] = {none, none}; // the smallest and the largest
    for (size_t i = 0; i < table->points.count; i++) {
        const double value = table->values.at[i * metrics + metric];
        if (isnan(value))
            continue;
        if (ends[0] == none || value < table->values.at[ends[0] * metrics + metric])
            ends[0] = i;
        if (ends[1] == none || value > table->values.at[ends[1] * metrics + metric])
            ends[1] = i;
    }
    study_metric_add(listing, sweep->metrics.at[metric],
                     sweep_metric_unit(sweep->metrics.at[metric]));
    for (size_t k = 0; k < COUNT(ends); k++) {
        const bool is_known = ends[k] != none;
        print_table_number(listing, "%.6g",
                           is_known ? table->values.at[ends[k] * metrics + metric] : (double)NAN);
        print_table_number(listing, "%.0f", is_known ? (double)ends[k] : (double)NAN);
    }
}

static void sweep_print(const Variant *answer) {
    const Sweep *sweep = (const Sweep *)(const void *)answer;
    static const char *const heads[] = {"", "smallest", "at point", "largest", "at point"};
    const SweepTable *table = &sweep->table;
    PrintTable listing = {.columns = COUNT(heads)};
    printf("%llu points", (unsigned long long)sweep->points);
    for (size_t i = 0; i < sweep->axes.count; i++)
        printf("%s %s (%zu)", i > 0 ? "," : ":", sweep->axes.at[i].pointer,
               sweep->axes.at[i].values.count);
    puts("\n");
    study_heads_add(&listing, heads);
    for (size_t i = 0; i < sweep->metrics.count; i++)
        sweep_extremes_add(&listing, sweep, i);
    print_table_print(&listing, stdout);
    for (size_t i = 0; i < table->failures.count; i++)
        printf("\n%llu failed, %s; point %llu: %s\n",
               (unsigned long long)table->failures.at[i].count,
               sweep_status_names[table->failures.at[i].status],
               (unsigned long long)table->failures.at[i].first, table->failures.at[i].detail);
}

static int sweep_run(const Command *self, void *settings, const Options *options,
                     Problem *problem) {
    static const StudyCommand command = {&study_sweep, NULL, sweep_print};
    return study_command(self, &command, settings, options, problem);
}

const Command command_sweep = {
    .name = "sweep",
    .operands = "SCENE.json",
    .summary = "the scene at many points: a grid or a list of values of its members",
    .help =
        "  impactd sweep scene.json                             smallest and largest of each "
        "metric\n"
        "  impactd sweep scene.json -o out.csv -o out.svg       every point, and the chart\n"
        "  impactd sweep - < scene.json                         from standard input\n"
        "\n"
        "The scene says what varies, by JSON Pointers into itself:\n"
        "\n"
        "  \"study\": {\"kind\": \"sweep\", \"axes\": [\n"
        "    {\"pointer\": \"/dampers/0/clearance\", \"from\": 0.005, \"to\": 0.03, \"count\": "
        "26},\n"
        "    {\"pointer\": \"/dampers/0/buffer\", \"values\": [\"sponge\", \"aluminium\"]}]}\n"
        "\n"
        "Every point is judged before the first runs. The same sweep gives the same bytes, here\n"
        "and by the daemon, which uses all its workers. Exit code 3 if the scene has faults.\n",
    .options = sweep_fields,
    .size = sizeof(StudySettings),
    .run = sweep_run,
};
