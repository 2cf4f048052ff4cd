// Drop tests of a material: kept as they were done, each shown with what it comes to. What a
// dry run shows is what would be kept.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/api/materials.h"
#include "server/api/query.h"
#include "server/base/clock.h"
#include "server/base/link.h"
#include "server/codec/material_bodies.h"
#include "server/codec/read.h"
#include "server/codec/write.h"
#include "server/http/body.h"
#include "server/http/reply.h"
#include "server/materials/catalogue.h"
#include "server/materials/measurement.h"

enum { LIST_INITIAL = 20, LIST_MOST = 100 };
enum { PAGE_MOST = 32 << 20 }; // bytes of documents that are read for one page

// Of evaluations: samples in traces that take a moment, and how many longer ones go at once.
enum { SAMPLES_QUICK = 20000, LONG_MOST = 4 };
static const double patience_most = 30; // [s]

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
    TRY(store_material_state(app->store, slug, &state, problem));
    Status status = catalogue_find(app->store, slug, 0, revision, NULL);
    if (status == STATUS_NOT_FOUND) { // all are deprecated
        material_revision_clear(revision);
        status = catalogue_find(app->store, slug, state.latest, revision, NULL);
    }
    if (status == STATUS_OK)
        return STATUS_OK;
    material_revision_clear(revision);
    return problem_set(problem, status, "the material \"%.63s\" cannot be read", slug);
}

typedef struct Patience {
    App *app;
    int64_t until_ns; // monotonic
} Patience;

static bool is_patient(void *context, double fraction) {
    const Patience *patience = context;
    (void)fraction;
    return !atomic_load(&patience->app->is_stopping) && clock_monotonic_ns() < patience->until_ns;
}

static Status evaluate(App *app, const Measurement *tests, size_t count, int separation,
                       Evaluation *evaluation, Problem *problem) {
    Patience patience = {app, clock_monotonic_ns() + (int64_t)(1e9 * patience_most)};
    const Watch watch = {&patience, is_patient};
    const Status status =
        evaluation_make(tests, count, (Separation)separation, &watch, evaluation, problem);
    if (status != STATUS_CANCELLED)
        return status;
    if (atomic_load(&app->is_stopping))
        return problem_set(problem, STATUS_BUSY, "the daemon is stopping");
    return problem_set(problem, STATUS_LIMIT,
                       "to find all contacts of these traces takes more than %g s: cut the traces, "
                       "or take in fewer measurements at a time",
                       patience_most);
}

Status material_evaluate(App *app, const Measurement *tests, size_t count, int separation,
                         Evaluation *evaluation, Reply *reply, Problem *problem) {
    *evaluation = (Evaluation){.separation = separation};
    if (evaluation_samples(tests, count) <= SAMPLES_QUICK)
        return evaluate(app, tests, count, separation, evaluation, problem);
    Status status = STATUS_BUSY;
    if (atomic_fetch_add(&app->evaluations, 1) < LONG_MOST) {
        status = evaluate(app, tests, count, separation, evaluation, problem);
    } else {
        reply->retry_after = 10;
        (void)problem_set(problem, STATUS_BUSY,
                          "other long force traces are being evaluated: ask again");
    }
    atomic_fetch_sub(&app->evaluations, 1);
    return status;
}

// The body, judged. Cleared by fields_clear in any case.
static Status read_body(const Request *request, MeasurementBody *body, Problem *problem) {
    TRY(body_require_json(request, problem));
    problem->whose = "measurement";
    const Status status =
        read_json(request->body, request->body_size, measurement_body_fields, body, problem);
    if (status != STATUS_OK && status != STATUS_INVALID)
        return status;
    const Status all[] = {status, fields_check(measurement_body_fields, body, "", problem),
                          drop_test_check(&body->test, "", problem)};
    for (size_t i = 0; i < COUNT(all); i++)
        TRY(all[i]);
    return STATUS_OK;
}

static void write_test(Bytes *bytes, const DropTest *test, const Evaluation *evaluation) {
    bytes_text(bytes, ", \"test\": ");
    write_item(bytes, drop_test_fields, test, WRITE_SCENE);
    bytes_text(bytes, ", ");
    evaluation_write(bytes, evaluation);
    bytes_text(bytes, ", ");
}

static Status tell_dry(App *app, const char *slug, const DropTest *test,
                       const Evaluation *evaluation, Reply *reply, Problem *problem) {
    Bytes bytes = {.most = app->reply_most};
    bytes_format(&bytes, "{\"dry_run\": true, \"slug\": \"%s\"", slug);
    write_test(&bytes, test, evaluation);
    bytes_format(&bytes,
                 "\"links\": {\"material\": \"%s/v1/materials/%s\", \"measurements\": "
                 "\"%s/v1/materials/%s/measurements\"}}\n",
                 link_base(), slug, link_base(), slug);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

static Status tell(App *app, const MaterialMeasurement *row, const DropTest *test,
                   const Evaluation *evaluation, int code, Reply *reply, Problem *problem) {
    Bytes bytes = {.most = app->reply_most};
    bytes_text(&bytes, "{");
    measurement_write_row(&bytes, row);
    write_test(&bytes, test, evaluation);
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
                   Reply *reply, Problem *problem) {
    Bytes document = {0};
    write_item(&document, drop_test_fields, &body->test, WRITE_SCENE);
    char *text = bytes_take(&document, NULL);
    if (text == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the measurement");
    static char silent[] = "drop test";
    MaterialMeasurement row = {.slug = (char *)request->parameters[0],
                               .author = (char *)request->client,
                               .comment = body->comment != NULL ? body->comment : silent,
                               .created_unix_ms = clock_unix_ms(),
                               .document = text};
    Status status = store_material_measure(app->store, &row, seen, problem);
    free(text);
    if (status != STATUS_OK)
        return status;
    char tag[MATERIAL_TAG];
    material_tag(row.slug, state->latest, state->version + 1, tag);
    snprintf(reply->etag, sizeof reply->etag, "\"%s\"", tag);
    return tell(app, &row, &body->test, evaluation, 201, reply, problem);
}

static Status create(App *app, const Request *request, const MeasurementBody *body,
                     const MaterialState *state, uint64_t seen, Reply *reply, Problem *problem) {
    size_t is_dry;
    int separation;
    TRY(request_count(request, "dry_run", 0, 1, 0, &is_dry, problem));
    TRY(material_separation(app, request, &separation, problem));
    const Measurement test = {COUNT_ABSENT, &body->test};
    Evaluation evaluation;
    Status status = material_evaluate(app, &test, 1, separation, &evaluation, reply, problem);
    if (status == STATUS_OK && is_dry == 1)
        status = tell_dry(app, request->parameters[0], &body->test, &evaluation, reply, problem);
    else if (status == STATUS_OK)
        status = keep(app, request, body, state, seen, &evaluation, reply, problem);
    evaluation_clear(&evaluation);
    return status;
}

Status measurements_create(App *app, const Request *request, Reply *reply, Problem *problem) {
    MeasurementBody body = {.comment = NULL};
    MaterialState state;
    uint64_t seen;
    TRY(body_require_json(request, problem));
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
    TRY(store_material_state(app->store, slug, &state, problem));
    const size_t count = (size_t)state.measurements;
    TRY(request_count(request, "limit", 1, LIST_MOST, LIST_INITIAL, &limit, problem));
    TRY(request_count(request, "before", 1, (size_t)1 << 53, count + 1, &before, problem));
    const size_t beyond = before <= count ? before : count + 1;
    const size_t least = beyond > limit ? beyond - limit : 1;
    char tag[MATERIAL_TAG];
    material_tag(slug, state.latest, state.version, tag);
    if (reply_tagged(reply, request, tag))
        return STATUS_OK;
    Bytes bytes = {.most = app->reply_most};
    bytes_format(&bytes, "{\"slug\": \"%s\", \"count\": %zu, \"measurements\": [", slug, count);
    Status status = STATUS_OK;
    size_t next = beyond, size = 0;
    while (next > least && status == STATUS_OK && size < PAGE_MOST) {
        StoredTest stored = {.row = {.slug = NULL}};
        status = stored_test_load(app->store, slug, --next, &stored, problem);
        bytes_text(&bytes, next + 1 < beyond ? ",\n " : "");
        if (status == STATUS_OK)
            measurement_write_brief(&bytes, &stored);
        size += stored.row.document != NULL ? strlen(stored.row.document) : 0;
        stored_test_clear(&stored);
    }
    bytes_text(&bytes, "]}\n");
    if (status != STATUS_OK) {
        bytes_clear(&bytes);
        return status;
    }
    char number[24];
    snprintf(number, sizeof number, "%zu", next);
    if (next > 1)
        query_link_next(request, reply, "before", number);
    return reply_bytes(reply, 200, type_json, &bytes, problem);
}

Status measurement_number(const char *text, uint64_t *number, Problem *problem) {
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
    uint64_t number;
    int separation;
    TRY(measurement_number(request->parameters[1], &number, problem));
    TRY(material_separation(app, request, &separation, problem));
    StoredTest stored = {.row = {.slug = NULL}};
    Status status = stored_test_load(app->store, slug, number, &stored, problem);
    if (status == STATUS_OK) {
        const Measurement test = {COUNT_ABSENT, &stored.test};
        Evaluation evaluation;
        status = material_evaluate(app, &test, 1, separation, &evaluation, reply, problem);
        if (status == STATUS_OK)
            status = tell(app, &stored.row, &stored.test, &evaluation, 200, reply, problem);
        evaluation_clear(&evaluation);
    }
    stored_test_clear(&stored);
    return status;
}
