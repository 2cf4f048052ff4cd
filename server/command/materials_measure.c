// impactd materials measure, measurements, propose: a drop test goes in, and what all tests come to
// becomes a revision once somebody says so.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/drop_test/evaluation.h"
#include "core/formats/force_trace_text.h"
#include "server/codec/json_edit.h"
#include "server/codec/write.h"
#include "server/command/materials_ask.h"
#include "server/command/scene_file.h"

static const OutlineTable tables[] = {
    {"rows",
     {"measurement", "from", "approach_speed", "restitution", "restitution_uncertainty",
      "contact_time", "contact_time_uncertainty", "restitution_is_outlier",
      "contact_time_is_outlier", "excluded", "note"}},
    {"measurements", {"measurement", "created", "author", "comment", "drops", "traces"}},
    {"warnings", {"pointer", "detail"}},
    {NULL, {NULL}},
};

static Status trace_write(const Trace *trace, const char *path, Bytes *json, Problem *problem) {
    const char *slash = strrchr(path, '/');
    char interval[32];
    bytes_format(json, "{\"interval\": %s, \"note\": ", text_real(interval, trace->interval));
    bytes_json_string(json, slash != NULL ? slash + 1 : path);
    bytes_text(json, ", \"force\": [");
    bytes_reals(json, trace->force.at, trace->force.count);
    bytes_text(json, "]}");
    return json->is_failed ? problem_set(problem, STATUS_NO_MEMORY, "no memory for a trace")
                           : STATUS_OK;
}

static Status trace_add(MaterialsCall *call, const char *path, Bytes *body, Problem *problem) {
    Bytes text = {0}, json = {0};
    Trace trace = {.interval = call->settings->interval};
    call->about = path;
    Status status = scene_file_read(path, &text, problem);
    if (status == STATUS_OK)
        status = force_trace_text_read(text.at != NULL ? text.at : "", text.count,
                                       TRACE_SAMPLES_MAX, &trace.interval, &trace.force, problem);
    if (status == STATUS_OK)
        status = trace_write(&trace, path, &json, problem);
    if (status == STATUS_OK)
        status = json_edit_append(body, "traces", &json, problem);
    free(trace.force.at);
    bytes_clear(&text);
    bytes_clear(&json);
    return status;
}

Status materials_measure_act(MaterialsCall *call, Problem *problem) {
    const MaterialsSettings *settings = call->settings;
    const char *slug = call->operands[0];
    Bytes body = {0}, path;
    HttpAnswer answer = {0};
    TRY(materials_name(slug, false, problem));
    Status status = materials_body(call, call->operands[1], &body, problem);
    for (size_t i = 0; i < settings->trace.count && status == STATUS_OK; i++)
        status = trace_add(call, settings->trace.at[i], &body, problem);
    if (status == STATUS_OK) {
        call->about = call->operands[1];
        materials_path(&path, slug, "/measurements");
        materials_query(&path, "dry_run", settings->dry_run ? "1" : NULL);
        status = materials_ask(call, "POST", &path, &body, NULL, &answer, problem);
    }
    if (status == STATUS_OK)
        status = materials_print(call, &answer, tables, problem);
    http_answer_clear(&answer);
    bytes_clear(&body);
    return status;
}

Status materials_measurements_act(MaterialsCall *call, Problem *problem) {
    Bytes path;
    HttpAnswer answer = {0};
    TRY(materials_name(call->operands[0], false, problem));
    materials_path(&path, call->operands[0], "/measurements");
    materials_query(&path, "limit", "100"); // the document tells how many there are
    Status status = materials_ask(call, "GET", &path, NULL, NULL, &answer, problem);
    if (status == STATUS_OK)
        status = materials_print(call, &answer, tables, problem);
    http_answer_clear(&answer);
    return status;
}

// What was shown is what is said, under the comment given, else its own, and of the state that it
// was shown of: whatever was done since is not overwritten.
static Status confirm(MaterialsCall *call, const HttpAnswer *shown, Problem *problem) {
    const char *slug = call->operands[0];
    Bytes body = {0};
    HttpAnswer answer = {0};
    Status status = json_edit_extract(&shown->body, "revision", &body, problem);
    if (status == STATUS_OK && call->settings->comment != NULL)
        status = json_edit_set(&body, "comment", call->settings->comment, problem);
    if (status == STATUS_OK)
        status = materials_write_seen(call, slug, slug, "/revisions", &body, shown->etag, &answer,
                                      problem);
    if (status == STATUS_OK && !call->settings->json)
        putchar('\n');
    if (status == STATUS_OK)
        status = materials_print_revision(call, &answer, problem);
    http_answer_clear(&answer);
    bytes_clear(&body);
    return status;
}

Status materials_propose_act(MaterialsCall *call, Problem *problem) {
    const MaterialsSettings *settings = call->settings;
    Bytes path;
    HttpAnswer answer = {0};
    TRY(materials_name(call->operands[0], false, problem));
    materials_path(&path, call->operands[0], "/proposal");
    materials_query(&path, "measurements", settings->measurements);
    if (settings->separation != CHOICE_ABSENT)
        materials_query(&path, "separation", separation_names[settings->separation]);
    if (settings->as != CHOICE_ABSENT)
        materials_query(&path, "as", proposal_form_names[settings->as]);
    Status status = materials_ask(call, "GET", &path, NULL, NULL, &answer, problem);
    // With --json the revision that was made is the answer.
    if (status == STATUS_OK && !(settings->confirm && settings->json))
        status = materials_print(call, &answer, tables, problem);
    if (status == STATUS_OK && settings->confirm)
        status = confirm(call, &answer, problem);
    http_answer_clear(&answer);
    return status;
}
