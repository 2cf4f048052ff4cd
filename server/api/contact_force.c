// Runs for one request, at once where they are predicted to be quick, else in the background while
// the request waits; and one of them: an impact at full detail, which a result does not have.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/simulation/simulation.h"
#include "server/api/app.h"
#include "server/util/clock.h"

static const double quick_max = 0.005; // predicted CPU time of a run within the request [s]

static void request_run_forget(void *background) {
    background_unref(background);
}

// Takes the reference to the task.
static Status request_run_wait(const Request *request, Reply *reply, const RequestRun *run,
                               BackgroundTask *background, Problem *problem) {
    const Status status =
        columns_wait(request, reply, background, request_run_forget, run->why, problem);
    if (status != STATUS_OK)
        reply->retry_after = 30;
    return status;
}

Status request_run_start(App *app, const Request *request, Reply *reply, const RequestRun *run,
                         void *context, double seconds, Problem *problem) {
    if (seconds <= quick_max) {
        run->run(context, NULL);
        const Status status = run->reply(app, request, reply, context, problem);
        run->release(context);
        return status;
    }
    BackgroundTask *background = NULL;
    const BackgroundWork work = {context, run->run, run->release};
    const Status status =
        background_start(app->background_tasks, &work, request->callback, &background, problem);
    if (status == STATUS_BUSY)
        reply->retry_after = 2;
    return status == STATUS_OK ? request_run_wait(request, reply, run, background, problem)
                               : status;
}

Status request_run_resume(App *app, const Request *request, Reply *reply, const RequestRun *run,
                          Problem *problem) {
    BackgroundTask *background = request->kept;
    if (!background_is_done(background))
        return request_run_wait(request, reply, run, background, problem);
    const Status status = run->reply(app, request, reply, background_context(background), problem);
    background_unref(background);
    return status;
}

// The run of one scene for one impact.
typedef struct ForceRun {
    StudyRequest inquiry;
    SimulationLimits limits;
    size_t number, points;
    ImpactHistory history;
    Status status;
    Problem problem;
} ForceRun;

static void force_free(void *context) {
    ForceRun *force = context;
    impact_history_clear(&force->history);
    study_request_clear(&force->inquiry);
    free(force);
}

static void force_run(void *context, const Progress *watch) {
    ForceRun *force = context;
    force->status =
        impact_history_make(&force->inquiry.simulation, force->number, force->points,
                            &force->limits, watch, NULL, &force->history, &force->problem);
}

// The scene of the result, as this engine would run it again.
static Status force_read_scene(App *app, const char *id, Reply *reply, ForceRun *force,
                               Problem *problem) {
    ResultRow row = {.count = 0};
    Warnings warnings = {NULL, 0};
    Status status = db_result_scene(app->db, id, &row, problem);
    if (status == STATUS_OK && strcmp(row.engine, engine_version) != 0) {
        status = problem_set(problem, STATUS_GONE,
                             "the result was made by %s, this is %s: POST to /again below the "
                             "result, which submits its scene again, to see its impacts",
                             row.engine, engine_version);
        results_link_gone(id, reply);
    }
    if (status == STATUS_OK)
        status = jobs_prepare(app->db, row.scene, strlen(row.scene), NULL, &force->inquiry,
                              &warnings, problem);
    if (status == STATUS_OK && !force->inquiry.simulation.output.impacts)
        status = problem_set(problem, STATUS_NOT_FOUND, "%s", no_impacts);
    warnings_clear(&warnings);
    result_row_clear(&row);
    return status;
}

// A number from 1 in the path, and how many points.
static Status force_read_request(const Request *request, ForceRun *force, Problem *problem) {
    const char *text = request->parameters[1];
    char *end;
    const unsigned long long number = strtoull(text, &end, 10);
    if (*text < '1' || *text > '9' || *end != '\0' || strlen(text) > 12)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "there is no impact \"%.20s\": they are numbered from 1, as "
                           "impacts.json lists them",
                           text);
    force->number = (size_t)number;
    return request_count(request, "points", IMPACT_HISTORY_POINTS_MIN, IMPACT_HISTORY_POINTS_MAX,
                         IMPACT_HISTORY_POINTS, &force->points, problem);
}

// Sets the tag. True: the client has it.
static bool force_is_cached(const Request *request, Reply *reply, const ForceRun *force,
                            const TableFormat *format) {
    char tag[104];
    snprintf(tag, sizeof tag, "%.72s-%zu-force.%s", request->parameters[0], force->number,
             format->extension);
    return reply_immutable(reply, request, tag);
}

// The columns become the stream's.
static Status force_reply(App *app, const Request *request, Reply *reply, void *context,
                          Problem *problem) {
    ForceRun *force = context;
    const TableFormat *format = NULL;
    TRY(columns_format(request, 2, table_formats_without_chart, reply, &format, problem));
    if (force_is_cached(request, reply, force, format))
        return STATUS_OK;
    if (force->status != STATUS_OK)
        return problem_set(problem, force->status, "%s", force->problem.detail);
    TableStream *stream = table_stream_new(NULL);
    Status status = STATUS_OK;
    if (stream != NULL) {
        stream->made = force->history.columns;
        force->history.columns = (Columns){.count = 0};
        status = table_stream_columns(stream, &stream->made, true, problem);
    }
    if (status == STATUS_OK)
        return columns_reply(app, reply, format, stream, problem);
    table_stream_free(stream);
    return status;
}

Status results_force(App *app, const Request *request, Reply *reply, Problem *problem) {
    static const RequestRun run = {force_run, force_free, force_reply,
                                   "to run the scene again takes longer than 60 s: submit a "
                                   "shorter scene that holds the impact"};
    const TableFormat *format = NULL;
    TRY(columns_format(request, 2, table_formats_without_chart, reply, &format, problem));
    if (request->kept != NULL)
        return request_run_resume(app, request, reply, &run, problem);
    ForceRun *force = calloc(1, sizeof *force);
    if (force == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the impact");
    problem_clear(&force->problem);
    // It lists as many impacts as the result, whatever may be listed since.
    force->limits = *jobs_limits(app->manager);
    force->limits.impacts = 0;
    Status status = force_read_request(request, force, problem);
    if (status == STATUS_OK)
        status = force_read_scene(app, request->parameters[0], reply, force, problem);
    if (status == STATUS_OK && !force_is_cached(request, reply, force, format))
        return request_run_start(app, request, reply, &run, force,
                                 impact_history_steps(&force->inquiry.simulation) * SOLVER_STEP,
                                 problem);
    force_free(force);
    return status;
}
