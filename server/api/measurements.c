// Drop tests of a material: kept as they were done, each shown with what it comes to. What a
// dry run shows is what would be kept.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/materials.h"
#include "server/api/query.h"
#include "server/http/reply.h"
#include "server/json/encode.h"
#include "server/json/material_bodies.h"
#include "server/json/parse.h"
#include "server/materials/material.h"
#include "server/materials/measurement.h"
#include "server/util/base_path.h"
#include "server/util/clock.h"

enum { LIST_INITIAL = 20, LIST_MAX = 100 };

Status material_separation(App *app, const Request *request, int *separation, Problem *problem) {
    const char *slug = request->parameters[0];
    TRY(query_choice(request, "separation", separation_names, CHOICE_ABSENT, separation, problem));
    if (*separation != CHOICE_ABSENT)
        return STATUS_OK;
    MaterialRevision head = {0};
    TRY(material_latest(app, slug, &head, problem));
    *separation = head.material.separation != CHOICE_ABSENT ? head.material.separation
                                                            : (int)SEPARATION_ZERO_PENETRATION;
    material_revision_clear(&head);
    return STATUS_OK;
}

Status material_latest(App *app, const char *slug, MaterialRevision *revision, Problem *problem) {
    MaterialState state;
    TRY(db_material_state(app->db, slug, &state, problem));
    Status status = material_find(app->db, slug, 0, revision, NULL);
    if (status == STATUS_NOT_FOUND) { // all are deprecated
        material_revision_clear(revision);
        status = material_find(app->db, slug, state.latest, revision, NULL);
    }
    if (status == STATUS_OK)
        return STATUS_OK;
    material_revision_clear(revision);
    return problem_set(problem, status, "the material \"%.63s\" cannot be read", slug);
}

Status material_evaluate(CpuBudget *budget, const Measurement *tests, size_t count, int separation,
                         Evaluation *evaluation, Reply *reply, Problem *problem) {
    const Progress watch = {budget, cpu_budget_lasts};
    Status status =
        evaluation_run(tests, count, (Separation)separation, &watch, evaluation, problem);
    if (status == STATUS_CANCELLED)
        status = cpu_budget_report(budget, problem);
    if (status == STATUS_BUSY)
        reply->retry_after = 10;
    return status;
}

// Of a test that is kept whatever it comes to. Given up, the evaluation is clear and its warnings
// say why.
static Status evaluate_kept(CpuBudget *budget, const Measurement *test, int separation,
                            Evaluation *evaluation, bool *is_there, Reply *reply,
                            Problem *problem) {
    Problem *why = calloc(1, sizeof *why);
    *evaluation = (Evaluation){.separation = separation};
    *is_there = false;
    if (why == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the evaluation");
    Status status = material_evaluate(budget, test, 1, separation, evaluation, reply, why);
    *is_there = status == STATUS_OK;
    if (status == STATUS_NO_MEMORY) {
        (void)problem_set(problem, status, "%s", why->detail);
    } else if (status != STATUS_OK) {
        evaluation_clear(evaluation);
        *evaluation = (Evaluation){.separation = separation};
        reply->retry_after = -1; // that is of a refusal
        status = warnings_add(&evaluation->warnings, "", "it is not evaluated: %s", why->detail);
        if (status != STATUS_OK)
            (void)problem_set(problem, status, "no memory for the evaluation");
    }
    free(why);
    return status;
}

// The body, judged. Cleared by fields_clear in any case.
static Status read_body(const Request *request, MeasurementBody *body, Problem *problem) {
    TRY(request_require_json(request, problem));
    problem->whose = "measurement";
    const Status status =
        json_parse(request->body, request->body_size, measurement_body_fields, body, problem);
    if (status != STATUS_OK && status != STATUS_INVALID)
        return status;
    const Status all[] = {status, fields_validate(measurement_body_fields, body, "", problem),
                          drop_test_validate(&body->test, "", problem)};
    for (size_t i = 0; i < COUNT(all); i++)
        TRY(all[i]);
    return STATUS_OK;
}

static void write_test(Bytes *bytes, const DropTest *test, const Evaluation *evaluation,
                       bool is_there) {
    bytes_text(bytes, ", \"test\": ");
    encode_item(bytes, drop_test_fields, test, WRITE_SCENE);
    bytes_text(bytes, ", ");
    if (is_there)
        evaluation_write(bytes, evaluation);
    else
        evaluation_write_none(bytes, evaluation);
    bytes_text(bytes, ", ");
}

static Status tell_dry(App *app, const char *slug, const DropTest *test,
                       const Evaluation *evaluation, Reply *reply, Problem *problem) {
    Bytes bytes = {.most = app->reply_most};
    bytes_format(&bytes, "{\"dry_run\": true, \"slug\": \"%s\"", slug);
    write_test(&bytes, test, evaluation, true);
    bytes_format(&bytes,
                 "\"links\": {\"material\": \"%s/v1/materials/%s\", \"measurements\": "
                 "\"%s/v1/materials/%s/measurements\"}}\n",
                 base_path(), slug, base_path(), slug);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

static Status tell(App *app, const MaterialMeasurement *row, const DropTest *test,
                   const Evaluation *evaluation, bool is_there, int code, Reply *reply,
                   Problem *problem) {
    Bytes bytes = {.most = app->reply_most};
    bytes_text(&bytes, "{");
    measurement_write_row(&bytes, row);
    write_test(&bytes, test, evaluation, is_there);
    measurement_write_links(&bytes, row->slug, row->measurement);
    bytes_text(&bytes, "}\n");
    if (code == 201)
        snprintf(reply->location, sizeof reply->location, "/v1/materials/%.63s/measurements/%llu",
                 row->slug, (unsigned long long)row->measurement);
    return reply_bytes(reply, code, type_json, &bytes, problem);
}

// The tag that is told is that of the writer's own state: of what others have written since they
// know nothing.
static Status keep(App *app, const Request *request, const MeasurementBody *body,
                   const MaterialState *state, uint64_t seen, const Evaluation *evaluation,
                   bool is_there, Reply *reply, Problem *problem) {
    Bytes document = {0};
    encode_item(&document, drop_test_fields, &body->test, WRITE_SCENE);
    char *text = bytes_take(&document, NULL);
    if (text == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the measurement");
    static char silent[] = "drop test";
    MaterialMeasurement row = {.slug = (char *)request->parameters[0],
                               .author = (char *)request->client,
                               .comment = body->comment != NULL ? body->comment : silent,
                               .created_unix_ms = clock_unix_ms(),
                               .document = text};
    Status status = db_material_measure(app->db, &row, seen, problem);
    free(text);
    if (status != STATUS_OK)
        return status;
    char tag[MATERIAL_TAG];
    material_tag(row.slug, state->latest, state->version + 1, tag);
    snprintf(reply->etag, sizeof reply->etag, "\"%s\"", tag);
    return tell(app, &row, &body->test, evaluation, is_there, 201, reply, problem);
}

static Status create(App *app, const Request *request, const MeasurementBody *body,
                     const MaterialState *state, uint64_t seen, Reply *reply, Problem *problem) {
    bool is_dry, is_there = true;
    int separation;
    TRY(request_flag(request, "dry_run", &is_dry, problem));
    TRY(material_separation(app, request, &separation, problem));
    const Measurement test = {COUNT_ABSENT, &body->test};
    Evaluation evaluation;
    CpuBudget budget;
    cpu_budget_begin(app, &budget);
    Status status =
        is_dry ? material_evaluate(&budget, &test, 1, separation, &evaluation, reply, problem)
               : evaluate_kept(&budget, &test, separation, &evaluation, &is_there, reply, problem);
    cpu_budget_end(&budget);
    if (status == STATUS_OK && is_dry)
        status = tell_dry(app, request->parameters[0], &body->test, &evaluation, reply, problem);
    else if (status == STATUS_OK)
        status = keep(app, request, body, state, seen, &evaluation, is_there, reply, problem);
    evaluation_clear(&evaluation);
    return status;
}

Status measurements_create(App *app, const Request *request, Reply *reply, Problem *problem) {
    MeasurementBody body = {.comment = NULL};
    MaterialState state;
    uint64_t seen;
    TRY(request_require_json(request, problem));
    TRY(material_condition(app, request, request->parameters[0], false, &seen, &state, problem));
    Status status = read_body(request, &body, problem);
    if (status == STATUS_OK)
        status = create(app, request, &body, &state, seen, reply, problem);
    fields_clear(measurement_body_fields, &body);
    return status;
}

Status measurements_list(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *slug = request->parameters[0];
    MaterialState state;
    size_t limit, before;
    TRY(db_material_state(app->db, slug, &state, problem));
    const size_t count = (size_t)state.measurements;
    TRY(request_count(request, "limit", 1, LIST_MAX, LIST_INITIAL, &limit, problem));
    TRY(request_count(request, "before", 1, (size_t)1 << 53, count + 1, &before, problem));
    char tag[MATERIAL_TAG];
    material_tag(slug, state.latest, state.version, tag);
    if (reply_tagged(reply, request, tag))
        return STATUS_OK;
    MeasurementSummaries page;
    Status status = db_measurement_summaries(app->db, slug, before, limit, &page, problem);
    Bytes bytes = {.most = app->reply_most};
    bytes_format(&bytes, "{\"slug\": \"%s\", \"count\": %zu, \"measurements\": [", slug, count);
    for (size_t i = 0; i < page.count && status == STATUS_OK; i++) {
        bytes_text(&bytes, i > 0 ? ",\n " : "");
        status = measurement_write_brief(&bytes, &page.at[i], problem);
    }
    const uint64_t next = page.count > 0 ? page.at[page.count - 1].row.measurement : 0;
    measurement_summaries_clear(&page);
    bytes_text(&bytes, "]}\n");
    if (status != STATUS_OK) {
        bytes_clear(&bytes);
        return status;
    }
    char number[24];
    snprintf(number, sizeof number, "%llu", (unsigned long long)next);
    if (next > 1)
        query_link_next(request, reply, "before", number);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

static Status measurement_number(const char *text, uint64_t *number, Problem *problem) {
    const size_t size = strlen(text);
    *number = 0;
    if (size > 0 && size <= 9 && strspn(text, "0123456789") == size)
        *number = strtoull(text, NULL, 10);
    if (*number > 0)
        return STATUS_OK;
    return problem_set(problem, STATUS_NOT_FOUND,
                       "there is no measurement \"%.20s\"; they count from 1", text);
}

Status measurements_show(App *app, const Request *request, Reply *reply, Problem *problem) {
    const char *slug = request->parameters[0];
    MaterialState state;
    uint64_t number;
    int separation;
    TRY(measurement_number(request->parameters[1], &number, problem));
    TRY(material_separation(app, request, &separation, problem));
    TRY(db_material_state(app->db, slug, &state, problem));
    // What was measured never changes, and what it comes to only with the program.
    char tag[MATERIAL_TAG];
    snprintf(tag, sizeof tag, "%.63s#%llu-%s-%s", slug, (unsigned long long)number,
             separation_names[separation], program_version);
    if (number <= state.measurements && reply_tagged(reply, request, tag))
        return STATUS_OK;
    StoredTest stored = {.row = {.slug = NULL}};
    CpuBudget budget;
    cpu_budget_begin(app, &budget);
    Status status = stored_test_load(app->db, slug, number, &stored, problem);
    if (status == STATUS_OK) {
        const Measurement test = {COUNT_ABSENT, &stored.test};
        Evaluation evaluation;
        bool is_there;
        status = evaluate_kept(&budget, &test, separation, &evaluation, &is_there, reply, problem);
        if (!is_there) // another time it may be
            reply->etag[0] = '\0';
        if (status == STATUS_OK)
            status =
                tell(app, &stored.row, &stored.test, &evaluation, is_there, 200, reply, problem);
        evaluation_clear(&evaluation);
    }
    cpu_budget_end(&budget);
    stored_test_clear(&stored);
    return status;
}
