// POST /v1/preview: a scene is run for this answer alone, while someone edits it. Nothing is
// stored. The same functions make the numbers as for a job, so that they are the same to the bit.
#include <stdlib.h>

#include "server/api/app.h"
#include "server/jobs/documents.h"

static const double cpu_max = 0.05; // predicted [s]

enum { POINTS_INITIAL = 2000, POINTS_MAX = 1000000000 };

typedef struct Preview {
    DryRun plan;
    size_t points;
    Outcome *outcome;
    Status status;
    Problem problem;
} Preview;

static void preview_free(void *context) {
    Preview *preview = context;
    dry_run_clear(&preview->plan);
    outcome_unref(preview->outcome);
    free(preview);
}

static void preview_run(void *context, const Progress *watch) {
    Preview *preview = context;
    const SimulationLimits limits = {.steps = cpu_max / SOLVER_STEP};
    preview->status = simulation_run(&preview->plan.inquiry.simulation, &limits, watch, NULL,
                                     &preview->outcome, &preview->problem);
}

// As series.json with points, or impacts.json, without the line's end.
static Status preview_put_table(Bytes *bytes, const Preview *preview, bool is_series,
                                Problem *problem) {
    TableStream *stream = table_stream_new(outcome_ref(preview->outcome));
    if (stream == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a preview");
    Status status = is_series ? table_stream_series(stream, problem)
                              : table_stream_impacts(stream, &format_json, NULL, problem);
    if (status == STATUS_OK && is_series && stream->table.count > 0)
        status = table_stream_downsample(stream, preview->points, problem);
    if (status == STATUS_OK)
        status = table_stream_open(stream, &format_json, problem);
    if (status == STATUS_OK)
        table_stream_write(stream, bytes);
    if (bytes->count > 0)
        bytes->at[--bytes->count] = '\0';
    table_stream_free(stream);
    return status;
}

static Status preview_reply(App *app, const Request *request, Reply *reply, void *context,
                            Problem *problem) {
    const Preview *preview = context;
    Bytes bytes = {.most = app->reply_most};
    (void)request;
    if (preview->status != STATUS_OK) {
        *problem = preview->problem;
        return preview->status;
    }
    ResultRow row = {.count = 0};
    Status status = document_outcome(preview->outcome, &row);
    if (status == STATUS_OK) {
        bytes_json(&bytes, "{\"plan\": %p, \"summary\": %p,\n\"series\": ", row.plan, row.summary);
        status = preview_put_table(&bytes, preview, true, problem);
    } else {
        (void)problem_set(problem, status, "no memory for a preview");
    }
    result_row_clear(&row);
    bytes_text(&bytes, ",\n\"impacts\": ");
    if (preview->outcome->response.is_unlisted)
        bytes_text(&bytes, "null");
    else if (status == STATUS_OK)
        status = preview_put_table(&bytes, preview, false, problem);
    bytes_text(&bytes, "}\n");
    return reply_json(reply, 200, &bytes, status, problem);
}

static Status preview_check(const DryRun *plan, Problem *problem) {
    if (plan->inquiry.study != NULL)
        return problem_add(problem, STATUS_INVALID, "/study",
                           "must be absent: a preview runs one scene; POST /v1/jobs runs studies");
    if (plan->cost.cpu_seconds > cpu_max)
        return problem_set(problem, STATUS_LIMIT,
                           "the scene is predicted to take %.3g s of CPU, a preview at most %g s: "
                           "POST /v1/jobs, or reduce duration, sample_rate or channels",
                           plan->cost.cpu_seconds, cpu_max);
    return STATUS_OK;
}

Status previews_create(App *app, const Request *request, Reply *reply, Problem *problem) {
    static const RequestRun run = {preview_run, preview_free, preview_reply,
                                   "the scene takes longer than predicted: POST /v1/jobs"};
    size_t points = POINTS_INITIAL;
    if (request->kept != NULL)
        return request_run_resume(app, request, reply, &run, problem);
    TRY(request_count(request, "points", 1, POINTS_MAX, POINTS_INITIAL, &points, problem));
    TRY(request_require_json(request, problem));
    Preview *preview = calloc(1, sizeof *preview);
    if (preview == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a preview");
    preview->points = points;
    Status status = jobs_charge(app->manager, request->client, problem);
    if (status == STATUS_OK)
        status =
            jobs_dry_run(app->manager, request->body, request->body_size, &preview->plan, problem);
    if (status == STATUS_OK)
        status = preview_check(&preview->plan, problem);
    if (status == STATUS_OK)
        return request_run_start(app, request, reply, &run, preview, preview->plan.cost.cpu_seconds,
                                 problem);
    preview_free(preview);
    return jobs_refused(app, request, reply, status);
}
