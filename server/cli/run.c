// impactd run, check, study and the commands of single studies: what the server does with a scene,
// without a server. The scene is validated and completed as there, so that equal scenes have equal
// results by number and by id.
#include <stdio.h>
#include <string.h>

#include "core/study/ensemble.h"
#include "core/study/optimize.h"
#include "core/study/study.h"
#include "core/study/sweep.h"
#include "core/study/tradeoff.h"
#include "server/api/job_json.h"
#include "server/cli/files.h"
#include "server/cli/report.h"
#include "server/formats/study_formats.h"
#include "server/formats/table_stream.h"
#include "server/jobs/documents.h"
#include "server/jobs/jobs.h"
#include "server/json/table.h"
#include "server/util/clock.h"

enum { MAX_SAMPLES = 1 << 25, MAX_IMPACTS = 10000000, OUTPUTS_MAX = 8, SOLVERS_MAX = 32 };

#define CPU_ROW(struct_type)                                                                       \
    FIELD_REAL(struct_type, max_cpu_seconds, "s", WITHIN(1e-6, 1e9), SIMULATION_CPU_SECONDS,       \
               "refuse a scene that is predicted to need more CPU time")

static SimulationLimits scene_limits(double cpu_seconds) {
    return (SimulationLimits){.samples = MAX_SAMPLES,
                              .impacts = MAX_IMPACTS,
                              .steps = cpu_seconds / SOLVER_STEP,
                              .bytes = SIMULATION_BYTES};
}

// An output that is a page is no format of tables.
static const char page_extension[] = "html";

static bool path_is_page(const char *path) {
    return path != NULL && text_same(path_extension(path), page_extension);
}

static void warnings_print(const char *path, const Warnings *warnings) {
    for (size_t i = 0; i < warnings->count; i++)
        command_print_line(stderr, "%s: warning: %s: %s", input_name(path), warnings->at[i].pointer,
                           warnings->at[i].detail);
}

// Reads and resolves a scene. Both outputs are cleared in any case.
static Status scene_prepare(const Bytes *text, const RecordFiles *records,
                            const SimulationLimits *limits, StudyRequest *request,
                            Warnings *warnings, Problem *problem) {
    Db *db = NULL;
    *request = (StudyRequest){0};
    *warnings = (Warnings){0};
    TRY(db_open(NULL, &db, problem));
    Status status = record_files_add(db, records, problem);
    if (status == STATUS_OK)
        status = jobs_prepare(db, text->at, text->count, limits, request, warnings, problem);
    db_close(db);
    return status;
}

// Of run and check.
typedef struct RunSettings {
    char *output;
    bool json;
    Texts record, set, vary;
    int unit;
    double max_cpu_seconds;
    int executor; // of check
    char *shared, *partition;
    Texts sbatch_option;
    const TableFormat *format; // of the output's extension; NULL without output, or for a page
} RunSettings;

// clang-format off
static const Field run_fields[] = {
    FIELD_TEXT(RunSettings, output, 4000, PRESENCE_OPTIONAL, 0, "write to this file; the extension is the format: .json, .csv, .npy, .npz, .mat, .svg, .html"),
    FIELD_FLAG(RunSettings, json, false, "print the finished job as JSON, also on a terminal"),
    SET_ROW(RunSettings),
    VARY_ROW(RunSettings),
    RECORD_ROWS(RunSettings),
    CPU_ROW(RunSettings),
    FIELD_END,
};
// clang-format on

// A table of the outcome, without the line feed of a document if it is `inside` another one.
static Status table_write(Outcome *outcome, const TableFormat *format, bool inside,
                          Status (*fill)(TableStream *stream, Problem *problem), Bytes *bytes,
                          Problem *problem) {
    TableStream *stream = table_stream_new(outcome_ref(outcome));
    Status status = stream != NULL ? fill(stream, problem) : STATUS_NO_MEMORY;
    if (status == STATUS_OK)
        status = format_write(format, &stream->table, bytes, problem);
    table_stream_free(stream);
    if (status == STATUS_OK && inside && bytes->count > 0)
        bytes->count--;
    return status;
}

static Status impacts_fill(TableStream *stream, Problem *problem) {
    return table_stream_impacts(stream, &format_json, NULL, problem);
}

// {job, series, impacts, psd}, each as the server sends it.
static Status whole_write(Outcome *outcome, const Bytes *job, Bytes *bytes, Problem *problem) {
    bytes_text(bytes, "{\"job\": ");
    bytes_put(bytes, job->at, job->count - 1); // without its line feed
    bytes_text(bytes, ",\n\"series\": ");
    TRY(table_write(outcome, &format_json, false, table_stream_series, bytes, problem));
    bytes_text(bytes, ",\n\"impacts\": ");
    if (outcome->response.is_unlisted)
        bytes_text(bytes, "null");
    else
        TRY(table_write(outcome, &format_json, true, impacts_fill, bytes, problem));
    bytes_text(bytes, ",\n\"psd\": ");
    if (outcome->spectrum.densities.count == 0)
        bytes_text(bytes, "null");
    else
        TRY(table_write(outcome, &format_json, true, table_stream_psd, bytes, problem));
    bytes_text(bytes, "}\n");
    return STATUS_OK;
}

// A finished job that was in no queue.
static Status job_write(const StudyRequest *request, const Warnings *warnings,
                        const Outcome *outcome, const int64_t began_unix_ms, double took,
                        Bytes *bytes) {
    ResultRow row = {.count = 0};
    Bytes warned = {0};
    Status status = document_outcome(outcome, &row);
    document_warnings(&warned, warnings);
    JobView show = {.row = {.id = "j-local",
                            .state = JOB_SUCCESSFUL,
                            .has_result = true,
                            .created_unix_ms = began_unix_ms,
                            .started_unix_ms = began_unix_ms,
                            .finished_unix_ms = clock_unix_ms(),
                            .run = took,
                            .total = took,
                            .warnings = warned.at,
                            .title = request->simulation.title},
                    .progress = 100,
                    .plan = row.plan,
                    .summary = row.summary,
                    .work = row.work,
                    .notes = row.notes};
    if (status == STATUS_OK)
        status = jobs_result_id(request, show.row.result, NULL);
    if (warned.is_failed)
        status = STATUS_NO_MEMORY;
    if (status == STATUS_OK)
        job_json_put(bytes, &show, JOB_PUT_WHOLE);
    bytes_clear(&warned);
    result_row_clear(&row);
    return bytes->is_failed ? STATUS_NO_MEMORY : status;
}

// What a run or a study leaves for its report; one of outcome and answer.
typedef struct Finding {
    const char *path; // of the scene
    const StudyRequest *request;
    const Warnings *warnings;
    const Outcome *outcome;
    const Variant *answer;
    double took;    // [s]
    bool is_edited; // the path alone is not the scene: --set, --vary or --record
} Finding;

static void finding_report(const Finding *finding, Report *report) {
    report_title(report, finding->request->simulation.title);
    if (finding->answer != NULL)
        report_of_study(report, finding->answer, finding->took);
    else
        report_of_run(report, &finding->request->simulation, finding->outcome, finding->took);
    report_notes(report, finding->warnings);
}

static Status finding_write_page(const Finding *finding, Bytes *bytes, Problem *problem) {
    Report report = {.is_page = true};
    Bytes scene = {0};
    char result[72];
    TRY(jobs_result_id(finding->request, result, problem));
    document_scene(&scene, finding->request);
    finding_report(finding, &report);
    if (!scene.is_failed)
        report_write_page(&report, &(ReportPage){input_name(finding->path), result, &scene}, bytes);
    if (scene.is_failed || bytes->is_failed || report.is_failed)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the page");
    report_clear(&report);
    bytes_clear(&scene);
    return STATUS_OK;
}

static void finding_print(const Finding *finding, const char *name, const Terminal *terminal,
                          const Texts *files) {
    Report report = {.is_page = false};
    finding_report(finding, &report);
    if (report.next != NULL)
        report_next(&report, "impactd run %s %s", finding->path, report.next);
    else if (files->count == 0 && finding->is_edited)
        report_next(&report, "the same command with -o report.html");
    else if (files->count == 0)
        report_next(&report, "impactd %s %s -o report.html", name, finding->path);
    report_print(&report, terminal, files);
    report_clear(&report);
}

// Runs and prints or writes.
static Status scene_run(const char *path, const StudyRequest *request, const Warnings *warnings,
                        const RunSettings *settings, Problem *problem) {
    const SimulationLimits limits = scene_limits(settings->max_cpu_seconds);
    const bool is_page = path_is_page(settings->output);
    Terminal terminal;
    const bool has_report = !settings->json && terminal_find(&terminal);
    Outcome *outcome = NULL;
    Bytes job = {0}, table = {0};
    ProgressBar bar;
    const int64_t began_unix_ms = clock_unix_ms(), began_ns = clock_monotonic_ns();
    progress_bar_start(&bar);
    const Progress watch = progress_bar_watch(&bar);
    Status status = simulation_run(&request->simulation, &limits, &watch, NULL, &outcome, problem);
    progress_bar_stop(&bar);
    const double took = (double)(clock_monotonic_ns() - began_ns) * 1e-9;
    const Finding finding = {path,
                             request,
                             warnings,
                             outcome,
                             NULL,
                             took,
                             settings->set.count + settings->record.count > 0};
    if (status == STATUS_OK && !has_report) {
        warnings_print(path, warnings);
        warnings_print(path, &outcome->warnings);
    }
    if (status == STATUS_OK)
        status = job_write(request, warnings, outcome, began_unix_ms, took, &job);
    bytes_text(&job, "\n");
    if (status == STATUS_OK && is_page)
        status = finding_write_page(&finding, &table, problem);
    else if (status == STATUS_OK && settings->format == &format_json)
        status = whole_write(outcome, &job, &table, problem);
    else if (status == STATUS_OK && settings->format != NULL)
        status =
            table_write(outcome, settings->format, false, table_stream_series, &table, problem);
    if (status == STATUS_NO_MEMORY || job.is_failed || table.is_failed)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the answer");
    if (status == STATUS_OK && settings->output != NULL)
        status = output_write(table.at, table.count, problem);
    if (status == STATUS_OK)
        status = output_close(problem);
    if (status == STATUS_OK && has_report)
        finding_print(&finding, "run", &terminal,
                      &(Texts){(char **)(uintptr_t)&settings->output, settings->output != NULL});
    else if (status == STATUS_OK && (settings->json || settings->output == NULL))
        status = output_write(job.at, job.count, problem);
    bytes_clear(&job);
    bytes_clear(&table);
    outcome_unref(outcome);
    return status;
}

static Status run_scene(const char *path, const Bytes *text, void *of, Problem *problem) {
    const RunSettings *settings = of;
    const SimulationLimits limits = scene_limits(settings->max_cpu_seconds);
    StudyRequest request;
    Warnings warnings;
    Status status = scene_prepare(text, &(RecordFiles){settings->record, settings->unit}, &limits,
                                  &request, &warnings, problem);
    if (status == STATUS_OK && request.study != NULL)
        status = problem_add(problem, STATUS_INVALID, "/study",
                             "is not for `run`, which runs the scene alone: `impactd study` makes "
                             "it, or a server");
    // Before the run, so that a wrong folder is reported at once.
    if (status == STATUS_OK)
        status = output_open(settings->output, problem);
    if (status == STATUS_OK)
        status = scene_run(path, &request, &warnings, settings, problem);
    output_drop();
    study_request_clear(&request);
    warnings_clear(&warnings);
    return status;
}

static Status output_refuse(const char *path, const char *names, Problem *problem) {
    return problem_add(problem, STATUS_USAGE, "--output", "must end in one of %s, is %.200s", names,
                       path);
}

static int run(const Command *self, void *of, const Options *options, Problem *problem) {
    RunSettings *settings = of;
    const char *extension = settings->output != NULL ? path_extension(settings->output) : NULL;
    settings->format = extension != NULL ? format_find(extension) : NULL;
    if (settings->output == NULL || settings->format != NULL || path_is_page(settings->output))
        return input_command(self, "scene", options, settings, run_scene, problem);
    char names[128] = "";
    for (size_t i = 0; table_formats[i] != NULL; i++) {
        char ending[16];
        snprintf(ending, sizeof ending, ".%s", table_formats[i]->extension);
        text_list(names, sizeof names, ending);
    }
    text_list(names, sizeof names, ".html");
    (void)output_refuse(settings->output, names, problem);
    return command_error(self->name, problem);
}

const Command command_run = {
    .name = "run",
    .operands = "SCENE.json",
    .summary = "run a scene here, without a server",
    .help = "  impactd run scene.json                   # numbers and charts\n"
            "  impactd run scene.json --json            # the finished job as JSON\n"
            "  impactd run scene.json -o report.html    # a page with charts\n"
            "  impactd run scene.json -o out.csv        # time series; .npy, .npz, .mat, .svg\n"
            "  impactd run scene.json -o out.json       # job, series, impacts and spectra\n"
            "  impactd run scene.json --set dampers.0.clearance=10mm\n"
            "  impactd run scene.json --vary dampers.0.clearance=5mm:30mm:26\n"
            "  impactd run - < scene.json               # from standard input\n"
            "\n"
            "Where standard output is no terminal, the job is printed as JSON. The output\n"
            "file is written completely or not at all. Ctrl-C stops the run (exit code 130).\n"
            "Exit code 3 if the scene has faults, 1 if the run failed.\n"
            "\n"
            "A path of --set is that of a member, with dots or as a JSON Pointer. A number\n"
            "may have a unit: mm, cm, m, g, kg, t, us, ms, s, min, Hz, kHz, N, kN, N/m, N/mm,\n"
            "kN/m, N s/m, mm/s, m/s, m/s^2, cm/s^2 or %. For an acceleration, g is 9.80665\n"
            "m/s^2. Without a unit it is in SI. Other values are JSON or text; null removes a\n"
            "member. \"impactd help sweep\" explains --vary.\n",
    .options = run_fields,
    .size = sizeof(RunSettings),
    .run = run,
};

static const Field check_fields[] = {
    FIELD_FLAG(RunSettings, json, false,
               "print the plan as JSON, as POST /v1/jobs?dry_run=1 answers, also on a terminal"),
    SET_ROW(RunSettings),
    VARY_ROW(RunSettings),
    RECORD_ROWS(RunSettings),
    CPU_ROW(RunSettings),
    CLUSTER_ROWS(RunSettings, "slurm: check the set-up of a cluster instead of a scene"),
    FIELD_END,
};

// The plan for people. The title, as all of it, is text of the file that must not control a
// terminal.
static void plan_print(const char *path, const DryRun *run, const RunSettings *settings,
                       const Terminal *terminal) {
    Report report = {.is_page = false};
    const StudyRequest *request = &run->inquiry;
    report_title(&report, request->simulation.title);
    report_of_check(&report, request, &run->plan, &run->cost);
    report_notes(&report, &run->warnings);
    if (settings->set.count + settings->vary.count + settings->record.count == 0)
        report_next(&report, "impactd %s %s", request->study != NULL ? "study" : "run", path);
    report_print(&report, terminal, &(Texts){.count = 0});
    report_clear(&report);
}

static Status plan_show(const char *path, const Bytes *text, void *of, Problem *problem) {
    const RunSettings *asked = of;
    const JobManagerSettings settings = {
        .workers = 1, .queue_most = 1, .limits = scene_limits(asked->max_cpu_seconds)};
    Db *db = NULL;
    JobManager *manager = NULL;
    DryRun run = {0};
    Bytes bytes = {0};
    Terminal terminal;
    TRY(db_open(NULL, &db, problem));
    Status status = record_files_add(db, &(RecordFiles){asked->record, asked->unit}, problem);
    if (status == STATUS_OK)
        status = jobs_open(db, &settings, &manager, problem);
    if (status == STATUS_OK)
        status = jobs_dry_run(manager, text->at, text->count, &run, problem);
    if (status == STATUS_OK)
        job_json_put_dry_run(&bytes, &run);
    if (bytes.is_failed)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the plan");
    else if (status == STATUS_OK && !asked->json && terminal_find(&terminal))
        plan_print(path, &run, asked, &terminal);
    else if (status == STATUS_OK)
        printf("%s\n", bytes.at);
    bytes_clear(&bytes);
    dry_run_clear(&run);
    jobs_close(manager);
    db_close(db);
    return status;
}

static int check(const Command *self, void *settings, const Options *options, Problem *problem) {
    const RunSettings *asked = settings;
    const ClusterSettings cluster = {.shared = asked->shared,
                                     .slurm = {asked->partition, asked->sbatch_option}};
    if (asked->executor == EXECUTOR_SLURM)
        return command_end(self, cluster_check(&cluster, problem), problem);
    return input_command(self, "scene", options, settings, plan_show, problem);
}

const Command command_check = {
    .name = "check",
    .operands = "SCENE.json",
    .summary = "report the faults of a scene, or show its plan",
    .help = "  impactd check scene.json                 # all faults, or the plan\n"
            "  impactd check scene.json --json          # the plan as JSON\n"
            "  impactd check scene.json --set contact.model=impulse\n"
            "  impactd check - < scene.json             # from standard input\n"
            "  impactd check --executor slurm --shared /home/lab/impactd\n"
            "\n"
            "The plan has the choices of the program with their reasons, the stiffness and\n"
            "damping of each stop, and the estimated cost. Nothing is run. Where standard\n"
            "output is no terminal, the plan is printed as JSON. Exit code 3 if the scene has\n"
            "faults.\n"
            "\n"
            "With --executor slurm it checks whether a cluster can make studies: the shared\n"
            "folder, Slurm, and a small study on a node.\n",
    .options = check_fields,
    .size = sizeof(RunSettings),
    .run = check,
};

// Of all these commands; each has rows for its own members.
typedef struct StudySettings {
    const Command *command;
    Texts output;
    Texts record, set, vary;
    int unit;
    bool json;
    double max_cpu_seconds; // of the whole study; NAN: only each run is limited
    int metric;             // of the study's own names; CHOICE_ABSENT
    double error, point_steps;
    uint64_t repeats;
    Texts solver;
    uint64_t runs, first_seed;
    double target;
} StudySettings;

typedef struct StudyCommand {
    const StudyKind *kind; // NULL: the study of the document, which must have one
    // Puts the flags into the document's study of this kind, or into a new one; may take what
    // `settings` own. NULL: there are no flags.
    void (*choose)(void *study, StudySettings *settings);
} StudyCommand;

#define OUTPUT_ROW(formats)                                                                        \
    FIELD_TEXTS(StudySettings, output, NULL, NULL, OUTPUTS_MAX, PRESENCE_OPTIONAL, 0,              \
                "write to this file: " formats " or .html, a page; repeatable")
#define STUDY_CPU_ROW                                                                              \
    FIELD_REAL(StudySettings, max_cpu_seconds, "s", WITHIN(1e-6, 1e9), OPTIONAL,                   \
               "refuse a study that is predicted to need more CPU time in all (60 for each run)")
#define JSON_ROW FIELD_FLAG(StudySettings, json, false, "print the complete result as JSON")

// The format of a path's extension; NULL if the study has none such.
static const TableFormat *study_format(const StudyKind *kind, const char *path) {
    const char *extension = path_extension(path);
    return extension != NULL ? study_format_find(kind->answer, extension) : NULL;
}

static Status study_check_outputs(const StudyKind *kind, const Texts *outputs, Problem *problem) {
    Status status = STATUS_OK;
    char names[64];
    study_formats_names(study_formats(kind->answer), ".", names, sizeof names);
    text_list(names, sizeof names, ".html");
    for (size_t i = 0; i < outputs->count; i++)
        if (study_format(kind, outputs->at[i]) == NULL && !path_is_page(outputs->at[i]))
            status = output_refuse(outputs->at[i], names, problem);
    return status;
}

// `path` NULL: to standard output, as JSON.
static Status study_write(const Finding *finding, const char *path, const StudyDocument *document,
                          Problem *problem) {
    Bytes bytes = {0};
    Status status = STATUS_OK;
    if (path_is_page(path))
        status = finding_write_page(finding, &bytes, problem);
    else
        study_format_write(path != NULL ? study_format(study_kind(finding->request->study), path)
                                        : &format_json,
                           document, &bytes);
    if (status == STATUS_OK)
        status = bytes.is_failed
                     ? problem_set(problem, STATUS_NO_MEMORY, "no memory for the answer")
                     : output_put(path, &bytes, problem);
    bytes_clear(&bytes);
    return status;
}

static Status study_make(const char *path, const StudyRequest *request, const Warnings *warnings,
                         const StudySettings *settings, const SimulationLimits *limits,
                         Problem *problem) {
    const Texts *outputs = &settings->output;
    Terminal terminal;
    const bool has_report = !settings->json && terminal_find(&terminal);
    ProgressBar bar;
    Variant *answer = NULL;
    const int64_t began_ns = clock_monotonic_ns();
    if (!has_report)
        warnings_print(path, warnings);
    progress_bar_start(&bar);
    const Progress watch = progress_bar_watch(&bar);
    Status status =
        jobs_run_study(request->study, &request->simulation, limits, &watch, &answer, problem);
    progress_bar_stop(&bar);
    const double took = (double)(clock_monotonic_ns() - began_ns) * 1e-9;
    const Finding finding = {path,
                             request,
                             warnings,
                             NULL,
                             answer,
                             took,
                             settings->set.count + settings->vary.count + settings->record.count >
                                 0};
    char result[72];
    Bytes scene = {0};
    if (status == STATUS_OK)
        status = jobs_result_id(request, result, problem);
    document_scene(&scene, request);
    if (status == STATUS_OK && scene.is_failed)
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the answer");
    const StudyDocument document = {answer, result, scene.at};
    // First, so that they are there where the reader of the standard output ends early.
    for (size_t i = 0; i < outputs->count && status == STATUS_OK; i++)
        status = study_write(&finding, outputs->at[i], &document, problem);
    if (status == STATUS_OK && has_report)
        finding_print(&finding, settings->command->name, &terminal, outputs);
    else if (status == STATUS_OK && (settings->json || outputs->count == 0))
        status = study_write(&finding, NULL, &document, problem);
    bytes_clear(&scene);
    variant_free(answer);
    return status;
}

// The document's own study, or a new one, with the values of the flags.
static Status study_choose(StudyRequest *request, StudySettings *settings, Problem *problem) {
    const StudyCommand *command = settings->command->study;
    if (request->study == NULL && command->kind == NULL)
        return problem_add(problem, STATUS_INVALID, "/study",
                           "is required: what is to be found out, like {\"kind\": \"%s\"}",
                           studies[0]->kind.name);
    if (command->kind == NULL)
        return STATUS_OK;
    if (request->study == NULL)
        request->study = variant_new(&command->kind->kind);
    else if (request->study->kind != &command->kind->kind)
        return problem_add(problem, STATUS_INVALID, "/study/kind",
                           "is %s, not %s: `impactd study` makes it", request->study->kind->name,
                           command->kind->kind.name);
    if (request->study == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the study");
    if (command->choose != NULL)
        command->choose(request->study, settings);
    return STATUS_OK;
}

static Status study_scene(const char *path, const Bytes *text, void *of, Problem *problem) {
    StudySettings *settings = of;
    const double max = settings->max_cpu_seconds;
    const SimulationLimits limits = scene_limits(isnan(max) ? SIMULATION_CPU_SECONDS : max);
    const Texts *outputs = &settings->output;
    StudyRequest request;
    Warnings warnings;
    Status status = scene_prepare(text, &(RecordFiles){settings->record, settings->unit}, &limits,
                                  &request, &warnings, problem);
    if (status == STATUS_OK)
        status = study_choose(&request, settings, problem);
    if (status == STATUS_OK)
        status = study_request_complete(&request, &limits, NULL, problem);
    if (status == STATUS_OK)
        status = jobs_limit_study(&request, &limits, max, "--max-cpu-seconds", problem);
    if (status == STATUS_OK)
        status = study_check_outputs(study_kind(request.study), outputs, problem);
    // Before the runs, so that a wrong folder is reported at once.
    for (size_t i = 0; i < outputs->count && status == STATUS_OK; i++)
        status = output_check(outputs->at[i], problem);
    if (status == STATUS_OK)
        status = study_make(path, &request, &warnings, settings, &limits, problem);
    study_request_clear(&request);
    warnings_clear(&warnings);
    return status;
}

static int study_command_run(const Command *self, void *of, const Options *options,
                             Problem *problem) {
    ((StudySettings *)of)->command = self;
    return input_command(self, "scene", options, of, study_scene, problem);
}

// The members of a command that all of these have alike.
#define STUDY_COMMAND(name_text, kind, choose)                                                     \
    .name = name_text, .operands = "SCENE.json", .size = sizeof(StudySettings),                    \
    .run = study_command_run, .study = &(const StudyCommand) {                                     \
        kind, choose                                                                               \
    }

// Of the studies whose request is all in the scene.
static const Field study_fields[] = {
    OUTPUT_ROW(".json, complete; .csv or .npz, a table; .svg, a chart;"),
    JSON_ROW,
    SET_ROW(StudySettings),
    RECORD_ROWS(StudySettings),
    STUDY_CPU_ROW,
    FIELD_END,
};

const Command command_study = {
    STUDY_COMMAND("study", NULL, NULL),
    .summary = "run the study that a scene asks for",
    .help = "  impactd study scene.json                          # its result\n"
            "  impactd study scene.json -o out.svg -o out.csv    # as a chart and a table\n"
            "  impactd study - < scene.json                      # from standard input\n"
            "\n"
            "The scene's member \"study\" describes the study, such as {\"kind\": \"compare\"},\n"
            "which runs the scene with several contact models. Ctrl-C stops the study. Exit\n"
            "code 3 if the scene has faults or no study, 1 if a run failed.\n",
    .options = study_fields,
};

// Ranges and defaults are the study's own.
// clang-format off
static const Field tradeoff_fields[] = {
    OUTPUT_ROW(".json, a table; .svg, a chart;"),
    JSON_ROW,
    FIELD_REAL(StudySettings, error, NULL, ANY, OPTIONAL, "largest acceptable error, in the unit of the metric (1e-3)"),
    FIELD_CHOICE(StudySettings, metric, metric_names, OPTIONAL, "displacement, mean_acceleration, peak_force, impacts, psd or rms_displacement"),
    FIELD_COUNT(StudySettings, repeats, NULL, AT_MIN(0), OPTIONAL, "number of timings of each point (5)"),
    FIELD_TEXTS(StudySettings, solver, NULL, NULL, SOLVERS_MAX, PRESENCE_OPTIONAL, 0, "compare only this solver; repeatable"),
    FIELD_REAL(StudySettings, point_steps, NULL, ANY, OPTIONAL, "skip points that are predicted to need more solver steps (5e7)"),
    SET_ROW(StudySettings),
    RECORD_ROWS(StudySettings),
    STUDY_CPU_ROW,
    FIELD_END,
};
// clang-format on

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

const Command command_tradeoff = {
    STUDY_COMMAND("tradeoff", &study_tradeoff, tradeoff_choose),
    .summary = "compare solvers and step sizes: error against CPU time",
    .help = "  impactd tradeoff scene.json\n"
            "  impactd tradeoff scene.json --error 1e-6          # of the displacement\n"
            "  impactd tradeoff scene.json --metric psd --error 0.5    # of spectra, in dB\n"
            "  impactd tradeoff scene.json -o out.svg -o out.json\n"
            "  impactd tradeoff scene.json --solver exact --solver rk4\n"
            "  impactd tradeoff - < scene.json                   # from standard input\n"
            "\n"
            "Each solver runs at several step sizes or tolerances. The exact solver also runs\n"
            "simplified scenes: impulses instead of contacts, fewer modes, fewer samples and\n"
            "shorter segments. The cheapest settings within the error are recommended. The\n"
            "errors are reproducible; the CPU times are measured and vary a little. Ctrl-C\n"
            "stops the study. Exit code 3 if the scene has faults, 1 if its exact run failed.\n",
    .options = tradeoff_fields,
};

// Ranges and defaults are the study's own.
// clang-format off
static const Field ensemble_fields[] = {
    OUTPUT_ROW(".json, complete; .csv or .npz, all runs; .svg, a chart;"),
    JSON_ROW,
    FIELD_COUNT(StudySettings, runs, NULL, AT_MIN(0), OPTIONAL, "number of runs; with --target the largest number (64)"),
    FIELD_COUNT(StudySettings, first_seed, NULL, AT_MIN(0), OPTIONAL, "seed of the first run (that of the scene)"),
    FIELD_REAL(StudySettings, target, NULL, ANY, OPTIONAL, "stop when the mean of the metric is known to this relative error"),
    FIELD_CHOICE(StudySettings, metric, statistics_metric_names, OPTIONAL, "peak_displacement, rms_displacement (default), peak_acceleration, rms_acceleration, impacts, peak_contact_force, peak_storey_drift, peak_base_shear or psd"),
    SET_ROW(StudySettings),
    RECORD_ROWS(StudySettings),
    STUDY_CPU_ROW,
    FIELD_END,
};
// clang-format on

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

const Command command_ensemble = {
    STUDY_COMMAND("ensemble", &study_ensemble, ensemble_choose),
    .summary = "statistics over random seeds or uncertain inputs",
    .help = "  impactd ensemble scene.json                       # 64 seeds\n"
            "  impactd ensemble scene.json --runs 1000 -o out.csv      # a row for each run\n"
            "  impactd ensemble scene.json -o out.svg -o out.json\n"
            "  impactd ensemble scene.json --runs 1000 --target 0.01\n"
            "  impactd ensemble scene.json --runs 1000 --target 0.05 --metric psd\n"
            "  impactd ensemble - < scene.json                   # from standard input\n"
            "\n"
            "The excitation must be random, or the study must have uncertain inputs. A run is\n"
            "the scene with one seed and one sample of the inputs. --target stops when the\n"
            "mean of the metric is known to this relative error. A run that fails is reported\n"
            "and left out. The same study gives the same bytes. Ctrl-C stops the study. Exit\n"
            "code 3 if the scene has faults.\n",
    .options = ensemble_fields,
};

static const Field sweep_fields[] = {
    OUTPUT_ROW(".json, .csv, .npy, .npz or .mat, a table; .svg, a chart;"),
    JSON_ROW,
    SET_ROW(StudySettings),
    VARY_ROW(StudySettings),
    RECORD_ROWS(StudySettings),
    STUDY_CPU_ROW,
    FIELD_END,
};

const Command command_sweep = {
    STUDY_COMMAND("sweep", &study_sweep, NULL),
    .summary = "run a scene at a grid or a list of parameter values",
    .help = "  impactd sweep scene.json --vary dampers.0.clearance=5mm:30mm:26\n"
            "  impactd sweep scene.json --vary dampers.0.buffer=sponge,aluminium\n"
            "  impactd sweep scene.json -o out.csv -o out.svg    # every point, and the chart\n"
            "  impactd sweep - < scene.json                      # from standard input\n"
            "\n"
            "FROM:TO:COUNT is a range, equally spaced; with :log at its end the ratios are\n"
            "equal. Several --vary are a grid. Units are those of --set, see \"impactd help\n"
            "run\". Without --vary the scene describes the sweep by JSON Pointers:\n"
            "\n"
            "  \"study\": {\"kind\": \"sweep\", \"axes\": [\n"
            "    {\"pointer\": \"/dampers/0/clearance\",\n"
            "     \"from\": 0.005, \"to\": 0.03, \"count\": 26},\n"
            "    {\"pointer\": \"/dampers/0/buffer\", \"values\": [\"sponge\", \"aluminium\"]}]}\n"
            "\n"
            "--vary replaces these axes, and a study of another kind. All points are\n"
            "validated before the first run. The same sweep gives the same bytes, here and on\n"
            "a server, which uses all its workers. Exit code 3 if the scene has faults.\n",
    .options = sweep_fields,
};

// A study whose request is all in the scene; `example` is a scene of the program that has one.
#define SCENE_STUDY(name_text, kind, summary_text, example, prints)                                \
    const Command command_##name_text = {                                                          \
        STUDY_COMMAND(#name_text, kind, NULL),                                                     \
        .summary = summary_text,                                                                   \
        .help = "  impactd examples " example " -o scene.json\n"                                   \
                "  impactd " #name_text " scene.json\n"                                            \
                "  impactd " #name_text " scene.json -o out.svg -o out.csv\n"                      \
                "  impactd " #name_text " scene.json --json    # the complete result\n"            \
                "\n" prints                                                                        \
                "The member \"study\" of the scene describes the study, as that of the example\n"  \
                "does. Exit code 3 if the scene has faults.\n",                                    \
        .options = study_fields,                                                                   \
    }

SCENE_STUDY(optimize, &study_optimize, "find parameter values that minimize or maximize a metric",
            "optimize_clearance",
            "Prints the best values, the gain, and other values that are nearly as good. With\n"
            "two objectives it prints the front and the best compromise: the point nearest to\n"
            "the best values of both.\n");

SCENE_STUDY(calibrate, &study_calibrate, "fit parameters of a scene to measured motions",
            "calibrate_free_sponge",
            "Prints the parameters with their intervals, and whether they explain the\n"
            "measurement.\n");

SCENE_STUDY(response, &study_response,
            "steady motion under a sine over one parameter: response curve", "response_sponge",
            "Prints period, stability and peaks at each point. The excitation of the scene\n"
            "must be a sine.\n");

const Command command_fragility = {
    STUDY_COMMAND("fragility", &study_fragility, NULL),
    .summary = "probability of exceeding limits under ground motions",
    .help = "  impactd fragility scene.json --record a.AT2 --record b.AT2\n"
            "  impactd fragility scene.json --record a.AT2 -o out.svg -o out.csv\n"
            "  impactd fragility scene.json --record a.AT2 --json    # the complete result\n"
            "\n"
            "Prints median and dispersion of each limit. The scene names each record by its\n"
            "file without the extension, and describes the study:\n"
            "\n"
            "  \"study\": {\"kind\": \"fragility\", \"records\": [\"a\", \"b\"], \"intensity\": "
            "\"pga\",\n"
            "    \"levels\": {\"from\": 0.5, \"to\": 10, \"count\": 20},\n"
            "    \"limits\": [{\"metric\": \"peak_displacement\", \"value\": 0.02}]}\n"
            "\n"
            "Exit code 3 if the scene has faults.\n",
    .options = study_fields,
};
