// Drop tests of a material: stored as they were done, each shown with its evaluation. A dry run
// shows what would be stored.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/materials.h"
#include "server/json/encode.h"
#include "server/json/schema.h"
#include "server/materials/material.h"
#include "server/util/base_path.h"
#include "server/util/clock.h"

enum { LIST_INITIAL = 20, LIST_MAX = 100 };
enum { LONG_MAX = 4 };                             // evaluations at once that take longer
static const double cpu_quick = 0.5, cpu_max = 30; // [s]

Status measurement_separation(App *app, const Request *request, int *separation, Problem *problem) {
    MaterialRevision latest;
    TRY(request_choice(request, "separation", separation_names, CHOICE_ABSENT, separation,
                       problem));
    if (*separation != CHOICE_ABSENT)
        return STATUS_OK;
    TRY(material_latest(app, request->parameters[0], &latest, problem));
    *separation = latest.material.separation != CHOICE_ABSENT ? latest.material.separation
                                                              : (int)SEPARATION_ZERO_PENETRATION;
    material_revision_clear(&latest);
    return STATUS_OK;
}

Status material_latest(App *app, const char *slug, MaterialRevision *revision, Problem *problem) {
    MaterialState state;
    TRY(db_material_state(app->db, slug, &state, problem));
    Status status = db_material(app->db, slug, 0, revision, NULL);
    if (status == STATUS_NOT_FOUND) { // all are deprecated
        material_revision_clear(revision);
        status = db_material(app->db, slug, state.latest, revision, NULL);
    }
    if (status == STATUS_OK)
        return STATUS_OK;
    material_revision_clear(revision);
    return problem_set(problem, status, "the material \"%.63s\" cannot be read", slug);
}

typedef struct CpuBudget {
    App *app;
    int64_t from_ns; // of this thread's CPU time
    bool has_place;  // among those that take long
    bool is_crowded; // there was none
} CpuBudget;

// Of a Progress. False: stop.
static bool cpu_budget_lasts(void *context, double fraction) {
    CpuBudget *budget = context;
    App *app = budget->app;
    const double spent = 1e-9 * (double)(clock_thread_cpu_ns() - budget->from_ns);
    (void)fraction;
    if (spent > cpu_quick && !budget->has_place) {
        budget->has_place = atomic_fetch_add(&app->evaluations, 1) < LONG_MAX;
        budget->is_crowded = !budget->has_place;
        if (budget->is_crowded)
            atomic_fetch_sub(&app->evaluations, 1);
    }
    return !budget->is_crowded && spent < cpu_max && !atomic_load(&app->is_stopping);
}

Status measurements_evaluate(App *app, const Measurement *tests, size_t count, int separation,
                             Evaluation *evaluation, Reply *reply, Problem *problem) {
    CpuBudget budget = {.app = app, .from_ns = clock_thread_cpu_ns()};
    const Progress watch = {&budget, cpu_budget_lasts};
    const Status status =
        evaluation_run(tests, count, (Separation)separation, &watch, evaluation, problem);
    if (budget.has_place)
        atomic_fetch_sub(&app->evaluations, 1);
    if (status != STATUS_CANCELLED)
        return status;
    const bool is_stopping = atomic_load(&app->is_stopping);
    if (!is_stopping && !budget.is_crowded)
        return problem_set(problem, STATUS_LIMIT,
                           "to evaluate this takes more than %g s: cut the traces, or take in "
                           "fewer measurements at a time",
                           cpu_max);
    reply->retry_after = 10;
    return problem_set(problem, STATUS_BUSY, "%s",
                       is_stopping ? "the server is stopping"
                                   : "other long measurements are being evaluated: ask again");
}

// Evaluates a test that is stored whatever comes of it: on failure the evaluation is empty, and its
// warnings say why.
static Status evaluate_stored(App *app, const Measurement *test, int separation,
                              Evaluation *evaluation, bool *has_evaluation, Reply *reply,
                              Problem *problem) {
    Problem *why = calloc(1, sizeof *why);
    *evaluation = (Evaluation){.separation = separation};
    *has_evaluation = false;
    if (why == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the evaluation");
    Status status = measurements_evaluate(app, test, 1, separation, evaluation, reply, why);
    *has_evaluation = status == STATUS_OK;
    if (status == STATUS_NO_MEMORY) {
        (void)problem_set(problem, status, "%s", why->detail);
    } else if (status != STATUS_OK) {
        evaluation_clear(evaluation);
        *evaluation = (Evaluation){.separation = separation};
        reply->retry_after = -1; // it belongs to an error
        status = warnings_add(&evaluation->warnings, "", "it is not evaluated: %s", why->detail);
        if (status != STATUS_OK)
            (void)problem_set(problem, status, "no memory for the evaluation");
    }
    free(why);
    return status;
}

static void write_test(Bytes *bytes, const DropTest *test, const Evaluation *evaluation,
                       bool has_evaluation) {
    bytes_text(bytes, ", \"test\": ");
    encode_item(bytes, drop_test_fields, test, WRITE_SCENE);
    bytes_text(bytes, ", ");
    evaluation_write(bytes, evaluation, has_evaluation);
    bytes_text(bytes, ", ");
}

static Bytes measurement_body(const App *app, const MaterialMeasurement *row, const DropTest *test,
                              const Evaluation *evaluation, bool has_evaluation) {
    Bytes bytes = {.most = app->reply_most};
    bytes_text(&bytes, "{");
    measurement_write_row(&bytes, row);
    write_test(&bytes, test, evaluation, has_evaluation);
    measurement_write_links(&bytes, row->slug, row->measurement);
    bytes_text(&bytes, "}\n");
    return bytes;
}

static Status measurement_reply_dry(App *app, const char *slug, const DropTest *test,
                                    const Evaluation *evaluation, Reply *reply, Problem *problem) {
    Bytes bytes = {.most = app->reply_most};
    bytes_format(&bytes, "{\"dry_run\": true, \"slug\": \"%s\"", slug);
    write_test(&bytes, test, evaluation, true);
    bytes_format(&bytes,
                 "\"links\": {\"material\": \"%s/v1/materials/%s\", \"measurements\": "
                 "\"%s/v1/materials/%s/measurements\"}}\n",
                 base_path(), slug, base_path(), slug);
    return reply_json(reply, 200, &bytes, STATUS_OK, problem);
}

// The body of the reply is made first: if that fails nothing is written. The tag is that of the
// client's own write: what others have written since the client has not seen.
static Status measurement_save(App *app, const Request *request, const MeasurementBody *body,
                               const MaterialState *state, uint64_t seen,
                               const Evaluation *evaluation, bool has_evaluation, Reply *reply,
                               Problem *problem) {
    static char comment[] = "drop test";
    const uint64_t expected = state->measurements + 1;
    MaterialMeasurement row = {.slug = (char *)request->parameters[0],
                               .measurement = expected,
                               .author = (char *)request->client,
                               .comment = body->comment != NULL ? body->comment : comment,
                               .created_unix_ms = clock_unix_ms()};
    Bytes document = {.most = 0};
    Bytes bytes = measurement_body(app, &row, &body->test, evaluation, has_evaluation);
    encode_item(&document, drop_test_fields, &body->test, WRITE_SCENE);
    row.document = document.at;
    Status status = bytes.is_failed ? reply_json(reply, 201, &bytes, STATUS_OK, problem)
                    : document.is_failed
                        ? problem_set(problem, STATUS_NO_MEMORY, "no memory for the measurement")
                        : db_material_measure(app->db, &row, seen, problem);
    bytes_clear(&document);
    if (status == STATUS_OK && row.measurement != expected) { // another client was first
        bytes_clear(&bytes);
        bytes = measurement_body(app, &row, &body->test, evaluation, has_evaluation);
    }
    if (status == STATUS_OK) {
        char tag[MATERIAL_TAG];
        material_tag(row.slug, state->latest, state->version + 1, tag);
        snprintf(reply->etag, sizeof reply->etag, "\"%s\"", tag);
        snprintf(reply->location, sizeof reply->location, "/v1/materials/%.63s/measurements/%llu",
                 row.slug, (unsigned long long)row.measurement);
    }
    return reply_json(reply, 201, &bytes, status, problem);
}

static Status measurement_create(App *app, const Request *request, const MeasurementBody *body,
                                 const MaterialState *state, uint64_t seen, Reply *reply,
                                 Problem *problem) {
    bool is_dry, has_evaluation = true;
    int separation;
    TRY(request_flag(request, "dry_run", &is_dry, problem));
    TRY(measurement_separation(app, request, &separation, problem));
    const Measurement test = {COUNT_ABSENT, &body->test};
    Evaluation evaluation;
    Status status =
        is_dry
            ? measurements_evaluate(app, &test, 1, separation, &evaluation, reply, problem)
            : evaluate_stored(app, &test, separation, &evaluation, &has_evaluation, reply, problem);
    if (status == STATUS_OK)
        status = is_dry ? measurement_reply_dry(app, request->parameters[0], &body->test,
                                                &evaluation, reply, problem)
                        : measurement_save(app, request, body, state, seen, &evaluation,
                                           has_evaluation, reply, problem);
    evaluation_clear(&evaluation);
    return status;
}

Status measurements_create(App *app, const Request *request, Reply *reply, Problem *problem) {
    MeasurementBody body = {.comment = NULL};
    MaterialState state;
    uint64_t seen;
    TRY(request_require_json(request, problem));
    TRY(material_condition(app, request, false, &seen, &state, problem));
    Status status =
        material_body_read(request, "measurement", measurement_body_fields, &body, problem);
    if (status == STATUS_OK) {
        (void)drop_test_validate(&body.test, "", problem);
        status = problem->count > 0 ? STATUS_INVALID : STATUS_OK;
    }
    if (status == STATUS_OK)
        status = measurement_create(app, request, &body, &state, seen, reply, problem);
    fields_clear(measurement_body_fields, &body);
    return status;
}

Status measurements_list(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *slug = request->parameters[0];
    MaterialMeasurements heads;
    MaterialState state;
    MaterialPage page;
    TRY(db_material_state(app->db, slug, &state, problem));
    TRY(material_page_read(request, LIST_INITIAL, LIST_MAX, state.measurements, &page, problem));
    if (material_is_cached(request, reply, &state))
        return STATUS_OK;
    Status status = db_measurement_heads(app->db, slug, page.before, page.limit, &heads, problem);
    Bytes bytes = {.most = app->reply_most};
    bytes_format(&bytes, "{\"slug\": \"%s\", \"count\": %llu, \"measurements\": [", slug,
                 (unsigned long long)state.measurements);
    for (size_t i = 0; i < heads.count && status == STATUS_OK; i++) {
        bytes_text(&bytes, i > 0 ? ",\n " : "");
        status = measurement_write_head(&bytes, &heads.at[i], problem);
    }
    bytes_text(&bytes, "]}\n");
    if (status == STATUS_OK && heads.count > 0)
        material_page_link(request, reply, heads.at[heads.count - 1].measurement, &bytes);
    material_measurements_clear(&heads);
    return reply_json(reply, 200, &bytes, status, problem);
}

Status measurements_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *slug = request->parameters[0];
    MaterialState state;
    uint64_t number;
    int separation;
    TRY(material_number(request->parameters[1], "measurement", &number, problem));
    TRY(measurement_separation(app, request, &separation, problem));
    TRY(db_material_state(app->db, slug, &state, problem));
    // A measurement never changes, its evaluation only with the program.
    char tag[MATERIAL_TAG];
    snprintf(tag, sizeof tag, "%.63s#%llu-%s-%s", slug, (unsigned long long)number,
             separation_names[separation], program_version);
    if (number <= state.measurements && reply_tagged(reply, request, tag))
        return STATUS_OK;
    StoredTest stored = {.row = {.slug = NULL}};
    Status status = stored_test_load(app->db, slug, number, &stored, problem);
    if (status == STATUS_OK) {
        const Measurement test = {COUNT_ABSENT, &stored.test};
        Evaluation evaluation;
        bool has_evaluation;
        status =
            evaluate_stored(app, &test, separation, &evaluation, &has_evaluation, reply, problem);
        if (!has_evaluation) // the next request may succeed
            reply->etag[0] = '\0';
        if (status == STATUS_OK) {
            Bytes bytes =
                measurement_body(app, &stored.row, &stored.test, &evaluation, has_evaluation);
            status = reply_json(reply, 200, &bytes, STATUS_OK, problem);
        }
        evaluation_clear(&evaluation);
    }
    stored_test_clear(&stored);
    return status;
}
