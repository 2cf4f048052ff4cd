// impactd run SCENE.json: what the daemon does with a job, without the daemon. The scene is judged
// and completed as there, so that equal scenes have equal results by number and by id.
#include "server/cli/command.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/simulation/simulation.h"
#include "server/api/job_json.h"
#include "server/cli/output.h"
#include "server/cli/scene_file.h"
#include "server/formats/table_stream.h"
#include "server/jobs/documents.h"
#include "server/jobs/jobs.h"
#include "server/options.h"
#include "server/util/clock.h"

typedef struct RunSettings {
    char *output;
    double max_cpu_seconds;
    const TableFormat *encoder; // of the output's extension; NULL without output
} RunSettings;

static const Field run_fields[] = {
    FIELD_TEXT(RunSettings, output, 4000, PRESENCE_OPTIONAL, 0,
               "write to this file; its extension says what"),
    SCENE_FILE_CPU_ROW(RunSettings),
    FIELD_END,
};

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

// {job, series, impacts, psd}, each as the daemon sends it.
static Status whole_write(Outcome *outcome, const Bytes *job, Bytes *bytes, Problem *problem) {
    bytes_text(bytes, "{\"job\": ");
    bytes_put(bytes, job->at, job->count);
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
static Status job_write(const StudyRequest *inquiry, const Warnings *warnings,
                        const Outcome *outcome, const int64_t began_unix_ms, double took,
                        Bytes *bytes) {
    Bytes plan = {0}, summary = {0}, work = {0}, told = {0}, notes = {0};
    document_plan(&plan, &outcome->plan);
    document_summary(&summary, outcome);
    document_work(&work, &outcome->work);
    document_warnings(&told, warnings);
    document_warnings(&notes, &outcome->warnings);
    JobView show = {.id = "j-local",
                    .state = JOB_SUCCESSFUL,
                    .progress = 100,
                    .created_unix_ms = began_unix_ms,
                    .started_unix_ms = began_unix_ms,
                    .finished_unix_ms = clock_unix_ms(),
                    .run = took,
                    .total = took,
                    .plan = plan.at,
                    .summary = summary.at,
                    .work = work.at,
                    .warnings = told.at,
                    .notes = notes.at,
                    .title = inquiry->simulation.title};
    jobs_result_id(inquiry, show.result);
    const bool is_failed =
        plan.is_failed || summary.is_failed || work.is_failed || told.is_failed || notes.is_failed;
    if (!is_failed)
        job_json_put(bytes, &show, JOB_PUT_WHOLE);
    bytes_clear(&plan);
    bytes_clear(&summary);
    bytes_clear(&work);
    bytes_clear(&told);
    bytes_clear(&notes);
    return is_failed || bytes->is_failed ? STATUS_NO_MEMORY : STATUS_OK;
}

// Runs and prints or writes.
static Status scene_run(const char *path, const StudyRequest *inquiry, const Warnings *warnings,
                        const RunSettings *settings, Problem *problem) {
    const SimulationLimits limits = scene_file_limits(settings->max_cpu_seconds);
    const char *output = settings->output;
    Outcome *outcome = NULL;
    Bytes job = {0}, bytes = {0};
    ProgressBar bar;
    const int64_t began_unix_ms = clock_unix_ms(), began_ns = clock_monotonic_ns();
    progress_bar_start(&bar);
    const Progress watch = progress_bar_watch(&bar);
    Status status = simulation_run(&inquiry->simulation, &limits, &watch, NULL, &outcome, problem);
    progress_bar_stop(&bar);
    const double took = (double)(clock_monotonic_ns() - began_ns) * 1e-9;
    if (status == STATUS_OK)
        scene_file_warn(path, &outcome->warnings);
    if (status == STATUS_OK)
        status = job_write(inquiry, warnings, outcome, began_unix_ms, took, &job);
    if (status == STATUS_OK && output == NULL) {
        bytes_text(&job, "\n");
        (void)fwrite(job.at, 1, job.count, stdout);
    } else if (status == STATUS_OK) {
        status = settings->encoder == &format_json
                     ? whole_write(outcome, &job, &bytes, problem)
                     : table_write(outcome, settings->encoder, false, table_stream_series, &bytes,
                                   problem);
        if (status == STATUS_OK && bytes.is_failed)
            status = STATUS_NO_MEMORY;
        if (status == STATUS_OK)
            status = output_write(bytes.at, bytes.count, problem);
        if (status == STATUS_OK)
            status = output_close(problem);
    }
    if (status == STATUS_NO_MEMORY)
        (void)problem_set(problem, status, "no memory for the answer");
    bytes_clear(&job);
    bytes_clear(&bytes);
    outcome_unref(outcome);
    return status;
}

static Status scene_prepare_and_run(const char *path, const Bytes *text, void *of,
                                    Problem *problem) {
    const RunSettings *settings = of;
    const SimulationLimits limits = scene_file_limits(settings->max_cpu_seconds);
    Db *db = NULL;
    StudyRequest inquiry = {0};
    Warnings warnings = {0};
    TRY(db_open(NULL, &db, problem));
    Status status = jobs_prepare(db, text->at, text->count, &limits, &inquiry, &warnings, problem);
    db_close(db);
    if (status == STATUS_OK && inquiry.study != NULL)
        status =
            problem_add(problem, STATUS_INVALID, "/study",
                        "is not for `run`, which runs the scene alone: `impactd study` makes it, "
                        "or the daemon; `impactd tradeoff` and `impactd ensemble` print theirs");
    if (status == STATUS_OK) {
        scene_file_warn(path, &warnings);
        // Before the run, so that a wrong folder is reported at once.
        if (settings->output != NULL)
            status = output_open(settings->output, problem);
        if (status == STATUS_OK)
            status = scene_run(path, &inquiry, &warnings, settings, problem);
        output_drop();
    }
    study_request_clear(&inquiry);
    warnings_clear(&warnings);
    return status;
}

// The encoder by the output's extension, NULL where there is no output.
static Status encoder_choose(const char *output, const TableFormat **encoder, Problem *problem) {
    *encoder = NULL;
    if (output == NULL)
        return STATUS_OK;
    const char *file = strrchr(output, '/') != NULL ? strrchr(output, '/') + 1 : output;
    const char *dot = strrchr(file, '.');
    if (dot != NULL)
        *encoder = format_find(dot + 1);
    if (*encoder != NULL)
        return STATUS_OK;
    char known[128] = "";
    for (size_t i = 0; table_formats[i] != NULL; i++) {
        char ending[16];
        snprintf(ending, sizeof ending, ".%s", table_formats[i]->extension);
        text_list(known, sizeof known, ending);
    }
    return problem_add(problem, STATUS_USAGE, "--output", "must end in one of %s, is %.200s", known,
                       output);
}

static int run(const Command *self, void *of, const Options *options, Problem *problem) {
    RunSettings *settings = of;
    return encoder_choose(settings->output, &settings->encoder, problem) == STATUS_OK
               ? scene_file_command(self, "scene", options, settings, scene_prepare_and_run,
                                    problem)
               : command_error(self->name, problem);
}

const Command command_run = {
    .name = "run",
    .operands = "SCENE.json",
    .summary = "run one scene here, without a daemon",
    .help =
        "  impactd run scene.json                 print the finished job\n"
        "  impactd run scene.json -o out.csv      write the time series, as a table\n"
        "  impactd run scene.json -o out.npy      the same for numpy.load; .npz by names\n"
        "  impactd run scene.json -o out.mat      the same for MATLAB and Octave\n"
        "  impactd run scene.json -o out.svg      the same as a chart\n"
        "  impactd run scene.json -o out.json     job, series, impacts and psd in one document\n"
        "  impactd run - < scene.json             from standard input\n"
        "\n"
        "The output appears whole or not at all. Ctrl-C stops at once (exit code 130).\n"
        "Exit code 3 if the scene has faults, 1 if the run failed.\n",
    .options = run_fields,
    .size = sizeof(RunSettings),
    .run = run,
};
