// One impact at full detail. The result does not keep it: the scene is run again
// (core/simulation/impact_history.c), at once where that is predicted to be quick, else beside the
// workers while the request sleeps.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/simulation/simulation.h"
#include "server/api/columns.h"
#include "server/api/results.h"
#include "server/http/reply.h"
#include "server/util/clock.h"

static const double quick = 0.005;  // foretold CPU that a request itself may take [s]
static const double wait_most = 60; // [s]

typedef struct Look {
    StudyRequest inquiry;
    size_t number, points;
    ImpactHistory closeup;
    Status status;
    Problem problem;
} Look;

static void look_free(void *context) {
    Look *look = context;
    impact_history_clear(&look->closeup);
    study_request_clear(&look->inquiry);
    free(look);
}

// Nobody's limits: the scene was within them when its result was made.
static void look_run(void *context, const Progress *watch) {
    Look *look = context;
    look->status = impact_history_make(&look->inquiry.simulation, look->number, look->points, NULL,
                                       watch, NULL, &look->closeup, &look->problem);
}

// The scene of the result, as this engine would run it again.
static Status read_scene(App *app, const char *id, Reply *reply, Look *look, Problem *problem) {
    ResultRow row = {.count = 0};
    Warnings warnings = {NULL, 0};
    Status status = db_result_scene(app->db, id, &row, problem);
    if (status == STATUS_OK && strcmp(row.engine, engine_version) != 0) {
        status = problem_set(problem, STATUS_GONE,
                             "the result was made by %s, this is %s: POST to /again below the "
                             "result, which submits its scene anew, to see its impacts",
                             row.engine, engine_version);
        results_link_gone(id, reply);
    }
    if (status == STATUS_OK)
        status = jobs_prepare(app->db, row.scene, strlen(row.scene), NULL, &look->inquiry,
                              &warnings, problem);
    if (status == STATUS_OK && !look->inquiry.simulation.output.impacts)
        status = problem_set(problem, STATUS_NOT_FOUND, "%s", no_impacts);
    warnings_clear(&warnings);
    result_row_clear(&row);
    return status;
}

// What is asked: a whole number from 1 in the path, and how many points.
static Status read_what(const Request *request, Look *look, Problem *problem) {
    const char *text = request->parameters[1];
    char *end;
    const unsigned long long number = strtoull(text, &end, 10);
    if (*text < '1' || *text > '9' || *end != '\0' || strlen(text) > 12)
        return problem_set(problem, STATUS_NOT_FOUND,
                           "there is no impact \"%.20s\": they are numbered from 1, as "
                           "impacts.json lists them",
                           text);
    look->number = (size_t)number;
    return request_count(request, "points", IMPACT_HISTORY_POINTS_MIN, IMPACT_HISTORY_POINTS_MAX,
                         IMPACT_HISTORY_POINTS, &look->points, problem);
}

// Of a look that has been taken; its columns become the sheet's.
static Status reply_look(App *app, Reply *reply, const TableFormat *encoder, Look *look,
                         Problem *problem) {
    if (look->status != STATUS_OK)
        return problem_set(problem, look->status, "%s", look->problem.detail);
    ColumnReply column_reply = {.own = look->closeup.columns};
    look->closeup.columns = (Columns){.count = 0};
    const Status status = column_reply_own_axis(&column_reply, problem);
    if (status != STATUS_OK) {
        column_reply_clear(&column_reply);
        return status;
    }
    return columns_reply(app, reply, encoder, &column_reply, problem);
}

static void forget(void *kept) {
    background_unref(kept);
}

// Takes the aside.
static Status wait_on(const Request *request, Reply *reply, BackgroundTask *background,
                      Problem *problem) {
    const double left = wait_most - 1e-9 * (double)(clock_monotonic_ns() - request->started_ns);
    if (left <= 0 || request->is_expired) {
        background_unref(background);
        reply->retry_after = 30;
        return problem_set(problem, STATUS_BUSY,
                           "to run the scene again takes longer than %g s: submit a shorter scene "
                           "that holds the impact",
                           wait_most);
    }
    reply_wait(reply, (int)(1000 * left) + 1, background, forget);
    return STATUS_OK;
}

// Takes the aside of a request that slept.
static Status go_on(App *app, const Request *request, Reply *reply, const TableFormat *encoder,
                    BackgroundTask *background, Problem *problem) {
    if (!background_is_done(background))
        return wait_on(request, reply, background, problem);
    const Status status = reply_look(app, reply, encoder, background_context(background), problem);
    background_unref(background);
    return status;
}

static Status look_begin(App *app, const Request *request, Reply *reply, const TableFormat *encoder,
                         Look *look, Problem *problem) {
    if (impact_history_steps(&look->inquiry.simulation) * SOLVER_STEP <= quick) {
        look_run(look, NULL);
        const Status status = reply_look(app, reply, encoder, look, problem);
        look_free(look);
        return status;
    }
    BackgroundTask *background = NULL;
    const BackgroundWork work = {look, look_run, look_free};
    const Status status =
        background_start(app->background_tasks, &work, request->callback, &background, problem);
    if (status == STATUS_BUSY)
        reply->retry_after = 2;
    return status == STATUS_OK ? wait_on(request, reply, background, problem) : status;
}

// False: the client has it.
static bool has_to_send(const Request *request, Reply *reply, const Look *look,
                        const TableFormat *encoder) {
    char tag[104];
    snprintf(tag, sizeof tag, "%.72s-%zu-force.%s", request->parameters[0], look->number,
             encoder->extension);
    return !reply_immutable(reply, request, tag);
}

Status results_force(App *app, const Request *request, Reply *reply, Problem *problem) {
    const TableFormat *encoder = NULL;
    TRY(columns_format(request, 2, false, reply, &encoder, problem));
    if (request->kept != NULL) {
        BackgroundTask *background = request->kept;
        if (background_is_done(background))
            (void)has_to_send(request, reply, background_context(background), encoder);
        return go_on(app, request, reply, encoder, background, problem);
    }
    Look *look = calloc(1, sizeof *look);
    if (look == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the impact");
    problem_clear(&look->problem);
    Status status = read_what(request, look, problem);
    if (status == STATUS_OK)
        status = read_scene(app, request->parameters[0], reply, look, problem);
    if (status == STATUS_OK && has_to_send(request, reply, look, encoder))
        return look_begin(app, request, reply, encoder, look, problem);
    look_free(look);
    return status;
}
