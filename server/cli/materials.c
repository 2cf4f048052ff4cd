// impactd materials: the materials of a server, from a shell. A change is based on a state of the
// material: the one that --from names, else the one read just before. Of two clients that change
// the same state one is refused.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/drop_test/evaluation.h"
#include "core/drop_test/pair_parameters.h"
#include "core/formats/force_trace_text.h"
#include "core/scene/buffer.h"
#include "core/scene/damper.h"
#include "core/scene/material.h"
#include "server/cli/client.h"
#include "server/cli/files.h"

typedef struct MaterialsSettings {
    ClientSettings client;
    bool dry_run, confirm, editable, force;
    char *q, *kind, *e, *T_c;
    int status; // CHOICE_ABSENT: any
    char *comment, *reason;
    uint64_t from; // the newest revision that the user saw; COUNT_ABSENT
    Texts trace;
    double interval;
    char *measurements;
    int separation, as; // CHOICE_ABSENT: the server's default
    double damper_mass, structure_mass;
    int identified_for;
} MaterialsSettings;

static const char *const statuses[] = {"draft", "approved", "deprecated", NULL};

// clang-format off
static const Field materials_fields[] = {
    CLIENT_ROWS,
    FIELD_REAL(ClientSettings, wait, "s", AT_MIN(0), 60, "how long to wait for a busy server"),
    FIELD_FLAG(ClientSettings, json, false, "print the answer of the server as JSON"),
    FIELD_TEXT(MaterialsSettings, q, 200, PRESENCE_OPTIONAL, 0, "only materials with these words in slug, name, kind, supplier, source, tags or notes"),
    FIELD_TEXT(MaterialsSettings, kind, 60, PRESENCE_OPTIONAL, 0, "only materials of this kind, such as foam, rubber or metal"),
    FIELD_CHOICE(MaterialsSettings, status, statuses, OPTIONAL, "only materials of this status: draft, approved or deprecated"),
    FIELD_TEXT(MaterialsSettings, e, 60, PRESENCE_OPTIONAL, 0, "only this range of the coefficient of restitution: 0.4..0.7, ..0.3 or 0.9.."),
    FIELD_TEXT(MaterialsSettings, T_c, 60, PRESENCE_OPTIONAL, 0, "only this range of the contact time, in s"),
    FIELD_FLAG(MaterialsSettings, editable, false, "only the contents of the revision, as revise takes them"),
    FIELD_TEXT(MaterialsSettings, comment, 1000, PRESENCE_OPTIONAL, 0, "the reason, for the history"),
    FIELD_COUNT(MaterialsSettings, from, NULL, AT_MIN(1), OPTIONAL, "the newest revision you saw: with a newer one nothing is written"),
    FIELD_TEXT(MaterialsSettings, reason, 1000, PRESENCE_OPTIONAL, 0, "why it is approved or deprecated"),
    FIELD_TEXTS(MaterialsSettings, trace, NULL, NULL, TRACES_MAX, PRESENCE_OPTIONAL, 0, "file of a force trace: time in s and force in N, or the force alone; repeatable"),
    FIELD_REAL(MaterialsSettings, interval, "s", ABOVE(0), OPTIONAL, "between the samples of a trace that has forces alone"),
    FIELD_FLAG(MaterialsSettings, dry_run, false, "show the effect; write nothing"),
    FIELD_TEXT(MaterialsSettings, measurements, 4000, PRESENCE_OPTIONAL, 0, "numbers of those to use, as 1,2 (default: all)"),
    FIELD_CHOICE(MaterialsSettings, separation, separation_names, OPTIONAL, "rule for the end of a contact: zero_penetration, zero_force"),
    FIELD_CHOICE(MaterialsSettings, as, proposal_form_names, OPTIONAL, "constant, or a table over approach speed"),
    FIELD_FLAG(MaterialsSettings, confirm, false, "write the proposal as a revision"),
    FIELD_REAL(MaterialsSettings, damper_mass, "kg", ABOVE(0), OPTIONAL, "mass of the damper"),
    FIELD_REAL(MaterialsSettings, structure_mass, "kg", ABOVE(0), OPTIONAL, "mass of the structure; without it the structure does not move"),
    FIELD_CHOICE(MaterialsSettings, identified_for, identified_for_names, OPTIONAL, "the masses that e and T_c hold for: this pair's (scene), or the test's (rig)"),
    FIELD_FLAG(MaterialsSettings, force, false, "replace an existing FILE"),
    FIELD_END,
};
static const OptionGroup groups[] = {
    {"server", "The server:"},
    {"q", "list:"},
    {"editable", "show:"},
    {"comment", "add, revise, revert, measure, propose --confirm:"},
    {"reason", "approve, deprecate:"},
    {"trace", "measure:"},
    {"dry_run", "measure, import:"},
    {"measurements", "propose:"},
    {"damper_mass", "derived:"},
    {"force", "export:"},
    {NULL, NULL},
};

static const PrintTableColumns columns[] = {
    {"rows",
     {"measurement", "from", "approach_speed", "restitution", "restitution_uncertainty",
      "contact_time", "contact_time_uncertainty", "restitution_is_outlier",
      "contact_time_is_outlier", "excluded", "note"}},
    {"measurements", {"measurement", "created", "author", "comment", "drops", "traces"}},
    {"warnings", {"pointer", "detail"}},
    {"materials",
     {"slug", "revision", "status", "restitution", "contact_time", "kind", "name", "source"}},
    {"history", {"version", "when", "who", "action", "revision", "measurement", "why"}},
    {"differences", {"pointer", "from", "to", "unit"}},
    {"results", {"id", "created"}},
    {NULL, {NULL}},
};
static const PrintTableView materials_view = {
    .skipped = (const char *const[]){"links", "test", NULL},
    .lists = columns,
    .fields = (const Field *const[]){material_fields, pair_parameters_fields, evaluation_fields, buffer_fields, NULL},
};
// clang-format on

// "sponge@2 draft" of an answer that is a revision.
static Status materials_print_revision(ApiCall *call, Problem *problem) {
    const JsonDocument *reply = api_reply(call);
    const char *slug = json_get_text(reply, "slug"), *status = json_get_text(reply, "status");
    const double revision = json_get_number(reply, "revision");
    if (((const ClientSettings *)call->settings)->json) {
        return api_print(call, problem);
    }
    if (slug == NULL || status == NULL || isnan(revision))
        return api_unexpected(call, "a revision", problem);
    const bool is_own = json_get_flag(json_get_object(reply, "review"), "self_approved");
    printf("%s@%.0f %s%s\n", slug, revision, status, is_own ? ", by its own author" : "");
    return STATUS_OK;
}

static Status materials_add_comment(ApiCall *call, Problem *problem) {
    const MaterialsSettings *settings = call->settings;
    return settings->comment == NULL
               ? STATUS_OK
               : json_edit_set(&call->body, "comment", settings->comment, problem);
}

// The body from a JSON file, with --comment in it.
static Status materials_read_body(ApiCall *call, const char *path, Problem *problem) {
    call->about = path;
    TRY(input_read(path, &call->body, problem));
    return materials_add_comment(call, problem);
}

// Explains a conflict: what to do now.
static Status materials_error_stale(const char *slug, Problem *problem) {
    char detail[sizeof problem->detail];
    text_fit(detail, sizeof detail, problem->detail);
    problem_clear(problem);
    return problem_set(problem, STATUS_STALE,
                       "conflict, nothing was written: %.250s; see \"impactd materials history "
                       "%.63s\" and try again",
                       detail, slug);
}

// Posts the body to `path`, which it clears, based on the state that the last answer has as its
// ETag, "SLUG@REVISION-VERSION" in quotes. STATUS_STALE: another client has changed it.
static Status materials_write(ApiCall *call, Bytes path, Problem *problem) {
    char state[sizeof call->answer.etag], slug[MATERIAL_SLUG_MAX + 1];
    snprintf(state, sizeof state, "%s", call->answer.etag); // the answer is replaced
    snprintf(slug, sizeof slug, "%.*s", (int)strcspn(call->operands[0], "@"), call->operands[0]);
    const char *at = strrchr(state, '@');
    const unsigned long long latest = at != NULL ? strtoull(at + 1, NULL, 10) : 0;
    const uint64_t from = ((const MaterialsSettings *)call->settings)->from;
    ApiRequest request = {.method = "POST", .path = path, .if_match = state};
    Status status = STATUS_STALE;
    if (state[0] == '\0')
        status = api_unexpected(call, "a material with an ETag", problem);
    else if (from != COUNT_ABSENT && from != latest)
        (void)problem_set(problem, status, "the newest revision is %.63s@%llu, not %.63s@%llu",
                          slug, latest, slug, (unsigned long long)from);
    else
        status = api_ask(call, &request, problem);
    bytes_clear(&request.path);
    if (status == STATUS_STALE)
        return materials_error_stale(slug, problem);
    return status == STATUS_OK ? materials_print_revision(call, problem) : status;
}

// The same for the action, based on the present state.
static Status materials_write_now(ApiCall *call, Problem *problem) {
    const char *name = call->operands[0];
    // The history has an ETag also if all revisions are deprecated.
    TRY(api_get(call, api_path("/v1/materials/%.*s/history?limit=1", (int)strcspn(name, "@"), name),
                problem));
    return materials_write(call, api_action_path(call), problem);
}

// Shows a revision, with --editable its contents as revise takes them.
static Status materials_show(ApiCall *call, Problem *problem) {
    if (!((const MaterialsSettings *)call->settings)->editable)
        return api_show(call, problem);
    Bytes text = {0};
    TRY(api_send(call, problem));
    const bool is_material = json_edit_pick(&call->answer.body, material_fields, &text);
    if (is_material)
        fputs(text.at, stdout);
    bytes_clear(&text);
    return is_material ? STATUS_OK : api_unexpected(call, "a material", problem);
}

static Status materials_add(ApiCall *call, Problem *problem) {
    TRY(materials_read_body(call, call->operands[0], problem));
    TRY(api_send(call, problem));
    return materials_print_revision(call, problem);
}

static Status materials_revise(ApiCall *call, Problem *problem) {
    TRY(materials_read_body(call, call->operands[1], problem));
    return materials_write_now(call, problem);
}

static Status materials_revert(ApiCall *call, Problem *problem) {
    bytes_format(&call->body, "{\"to\": %s}", call->operands[1]);
    TRY(materials_add_comment(call, problem));
    return materials_write_now(call, problem);
}

// The detail of the action is the status that it sets.
static Status materials_review(ApiCall *call, Problem *problem) {
    const MaterialsSettings *settings = call->settings;
    bytes_format(&call->body, "{\"status\": \"%s\"}", call->action->detail);
    TRY(json_edit_set(&call->body, "reason", settings->reason, problem));
    return materials_write_now(call, problem);
}

// Appends a file of forces to the body's traces.
static Status materials_add_trace(ApiCall *call, const char *path, Problem *problem) {
    const char *slash = strrchr(path, '/');
    Bytes text = {0}, json = {0};
    Trace trace = {.interval = ((const MaterialsSettings *)call->settings)->interval};
    call->about = path;
    Status status = input_read(path, &text, problem);
    if (status == STATUS_OK)
        status = force_trace_text_read(text.at != NULL ? text.at : "", text.count,
                                       TRACE_SAMPLES_MAX, &trace.interval, &trace.force, problem);
    if (status == STATUS_OK) {
        bytes_format(&json, "{\"interval\": %s, \"note\": ", real_text(trace.interval).at);
        bytes_json_string(&json, slash != NULL ? slash + 1 : path);
        bytes_text(&json, ", \"force\": [");
        bytes_reals(&json, trace.force.at, trace.force.count);
        bytes_text(&json, "]}");
        status = json.is_failed ? problem_set(problem, STATUS_NO_MEMORY, "no memory for a trace")
                                : json_edit_append(&call->body, "traces", &json, problem);
    }
    free(trace.force.at);
    bytes_clear(&text);
    bytes_clear(&json);
    return status;
}

static Status materials_measure(ApiCall *call, Problem *problem) {
    const MaterialsSettings *settings = call->settings;
    TRY(materials_read_body(call, call->operands[1], problem));
    for (size_t i = 0; i < settings->trace.count; i++)
        TRY(materials_add_trace(call, settings->trace.at[i], problem));
    call->about = call->operands[1];
    return api_show(call, problem);
}

// --confirm writes the proposal that was shown, based on the state that it was shown of.
static Status materials_propose(ApiCall *call, Problem *problem) {
    const MaterialsSettings *settings = call->settings;
    TRY(api_send(call, problem));
    if (!settings->client.json || !settings->confirm)
        TRY(api_print_tables(call, problem));
    if (!settings->confirm)
        return STATUS_OK;
    TRY(json_edit_extract(&call->answer.body, "revision", &call->body, problem));
    TRY(materials_add_comment(call, problem));
    if (!settings->client.json)
        putchar('\n');
    return materials_write(call, api_path("/v1/materials/%s/revisions", call->operands[0]),
                           problem);
}

// Whether FILE is a table, by its name.
static Status materials_format(ApiCall *call, bool *is_table, Problem *problem) {
    const char *file = call->operands[0], *extension = path_extension(file);
    *is_table = extension != NULL && strcmp(extension, "csv") == 0;
    return *is_table || (extension != NULL && strcmp(extension, "json") == 0)
               ? STATUS_OK
               : problem_set(problem, STATUS_USAGE, "the file must end in .json or .csv, is %.200s",
                             file);
}

static Status materials_export(ApiCall *call, Problem *problem) {
    const MaterialsSettings *settings = call->settings;
    bool is_table;
    TRY(materials_format(call, &is_table, problem));
    if (!settings->force && access(call->operands[0], F_OK) == 0)
        return problem_set(problem, STATUS_CONFLICT,
                           "exists: name another file, or replace it with --force");
    ApiRequest request = {.path = api_path("/v1/materials.%s", is_table ? "csv" : "json"),
                          .output_max = UINT64_MAX};
    return api_download(call, &request, call->operands[0], problem);
}

static Status materials_import(ApiCall *call, Problem *problem) {
    bool is_table;
    TRY(materials_format(call, &is_table, problem));
    TRY(input_read(call->operands[0], &call->body, problem));
    ApiRequest request = {.method = "POST",
                          .path = api_action_path(call),
                          .content_type = is_table ? "text/csv" : NULL};
    TRY(api_ask(call, &request, problem));
    return api_print_tables(call, problem);
}

// clang-format off
#define MATERIAL "/v1/materials/{}"
static const ApiAction materials_actions[] = {
    {"list", "no operands", "", api_show, NULL, "/v1/materials?limit=1000", "q kind status e T_c", NULL, NULL, "materials"},
    {"show", "SLUG or SLUG@REVISION", "r", materials_show, NULL, MATERIAL, NULL, NULL, NULL, NULL},
    {"add", "FILE.json", "f", materials_add, "POST", "/v1/materials", NULL, NULL, NULL, NULL},
    {"revise", "SLUG without a revision and FILE.json", "sf", materials_revise, "POST", MATERIAL "/revisions", NULL, NULL, NULL, NULL},
    {"revert", "SLUG without a revision and REVISION", "sn", materials_revert, "POST", MATERIAL "/revert", NULL, "comment", NULL, NULL},
    {"approve", "SLUG@REVISION, as sponge@1", "v", materials_review, "POST", MATERIAL "/review", NULL, "reason", "approved", NULL},
    {"deprecate", "SLUG@REVISION, as sponge@1", "v", materials_review, "POST", MATERIAL "/review", NULL, "reason", "deprecated", NULL},
    {"history", "SLUG without a revision", "s", api_show, NULL, MATERIAL "/history?limit=1000", NULL, NULL, NULL, "history"},
    {"diff", "SLUG [FROM [TO]], without a revision after SLUG", "s?nn", api_show, NULL, MATERIAL "/diff?from={}&to={}", NULL, NULL, NULL, "differences"},
    {"used-by", "SLUG or SLUG@REVISION", "r", api_show, NULL, MATERIAL "/used-by", NULL, NULL, NULL, NULL},
    {"measure", "SLUG without a revision and TEST.json", "sf", materials_measure, "POST", MATERIAL "/measurements", "dry_run", NULL, NULL, NULL},
    {"measurements", "SLUG without a revision", "s", api_show, NULL, MATERIAL "/measurements?limit=100", NULL, NULL, NULL, "measurements"},
    {"propose", "SLUG without a revision", "s", materials_propose, NULL, MATERIAL "/proposal", "measurements separation as", NULL, NULL, NULL},
    {"derived", "SLUG or SLUG@REVISION", "r", api_show, NULL, MATERIAL "/derived", "damper_mass structure_mass identified_for separation", "damper_mass", NULL, NULL},
    {"export", "FILE.json or FILE.csv", "f", materials_export, NULL, NULL, NULL, NULL, NULL, NULL},
    {"import", "FILE.json or FILE.csv", "f", materials_import, "POST", "/v1/materials/import", "dry_run", NULL, NULL, NULL},
    {.name = NULL},
};
// clang-format on

const Command command_materials = {
    .name = "materials",
    .operands = "ACTION [OPERAND]...",
    .summary = "the materials of a server: measure, revise, review, export",
    .help = "  impactd materials list --kind rubber --e 0.4..0.7\n"
            "  impactd materials show sponge                   # or a revision, sponge@1\n"
            "  impactd materials add foam.json                 # a new material, a draft\n"
            "  impactd materials measure foam test.json --trace a.csv   # a drop test\n"
            "  impactd materials measurements foam             # all drop tests\n"
            "  impactd materials propose foam                  # a revision from drop tests\n"
            "  impactd materials propose foam --confirm --comment 'six drops'\n"
            "  impactd materials show foam --editable > foam.json\n"
            "  impactd materials revise foam foam.json --from 2 --comment '12 mm'\n"
            "  impactd materials diff foam 1 3                 # between two revisions\n"
            "  impactd materials revert foam 1 --comment 'wrong test'\n"
            "  impactd materials approve foam@3 --reason 'checked'\n"
            "  impactd materials deprecate foam@2 --reason 'wet'\n"
            "  impactd materials history foam                  # all changes\n"
            "  impactd materials used-by foam@2                # results that used it\n"
            "  impactd materials derived foam --damper-mass 0.11 --structure-mass 1.35\n"
            "  impactd materials export lab.csv                # all materials, or .json\n"
            "  impactd materials import lab.csv --dry-run      # check a file; write nothing\n"
            "\n"
            "Actions: list, show, add, revise, revert, approve, deprecate, history, diff,\n"
            "used-by, measure, measurements, propose, derived, export, import. A revision\n"
            "never changes; a correction is a new revision. Scenes that name a material use\n"
            "its newest approved revision. A file for add:\n"
            "\n"
            "  {\"slug\": \"foam\", \"name\": \"Foam, 12 mm\", \"restitution\": 0.55,\n"
            "   \"contact_time\": 0.02, \"source\": \"drop test of 12 May\"}\n"
            "\n"
            "/schemas/material of a server describes all members. Exit code 3 if a file has\n"
            "faults, 4 if there is no such material, 5 if it is not permitted, 1 if another\n"
            "client has changed the material meanwhile.\n",
    .options = materials_fields,
    .groups = groups,
    .size = sizeof(MaterialsSettings),
    .run = api_command,
    .actions = materials_actions,
    .view = &materials_view,
};
