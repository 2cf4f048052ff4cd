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
#include "server/json/document.h"
#include "server/json/encode.h"
#include "server/json/parse.h"

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

enum { LIST_MAX = 1000, REVISION_DIGITS = 9 };
#define LIMIT "?limit=1000"

static const char *const statuses[] = {"draft", "approved", "deprecated", NULL};

// clang-format off
static const Field materials_fields[] = {
    CLIENT_ROWS,
    FIELD_REAL(ClientSettings, wait, "s", AT_MIN(0), 60, "how long to wait for a busy server"),
    FIELD_FLAG(ClientSettings, json, false, "print the server's answer, as JSON"),
    FIELD_TEXT(MaterialsSettings, q, 200, PRESENCE_OPTIONAL, 0, "words in slug, name, kind, supplier, source, tags or notes"),
    FIELD_TEXT(MaterialsSettings, kind, 60, PRESENCE_OPTIONAL, 0, "those of one kind: foam, rubber, metal ..."),
    FIELD_CHOICE(MaterialsSettings, status, statuses, OPTIONAL, "draft, approved or deprecated"),
    FIELD_TEXT(MaterialsSettings, e, 60, PRESENCE_OPTIONAL, 0, "range of the coefficient of restitution: 0.4..0.7, ..0.3, 0.9.."),
    FIELD_TEXT(MaterialsSettings, T_c, 60, PRESENCE_OPTIONAL, 0, "range of the contact time in s"),
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
     {"slug", "revision", "status", "name", "kind", "restitution", "contact_time", "source"}},
    {"history", {"version", "when", "who", "action", "revision", "measurement", "why"}},
    {"differences", {"pointer", "from", "to", "unit"}},
    {"results", {"id", "created"}},
    {NULL, {NULL}},
};
// clang-format on

static Status materials_number(const char *text, const char *what, Problem *problem) {
    const size_t size = strlen(text);
    return size > 0 && size <= REVISION_DIGITS && text[0] != '0' &&
                   strspn(text, "0123456789") == size
               ? STATUS_OK
               : problem_set(problem, STATUS_USAGE,
                             "%s must be a whole number from 1, is \"%.60s\"", what, text);
}

// Checks an operand: a slug, or where the action allows it SLUG@REVISION.
static Status materials_name(const char *text, bool may_have_revision, Problem *problem) {
    char slug[MATERIAL_SLUG_MAX + 1];
    const size_t length = strcspn(text, "@");
    snprintf(slug, sizeof slug, "%.*s", (int)(length < sizeof slug ? length : 0), text);
    if (!material_slug_is_valid(slug))
        return problem_set(problem, STATUS_USAGE,
                           "the name of a material is 1 to %d lower-case letters, digits, "
                           "underscores and dashes%s, is \"%.80s\"",
                           MATERIAL_SLUG_MAX, may_have_revision ? ", optionally @REVISION" : "",
                           text);
    if (text[length] == '\0')
        return STATUS_OK;
    if (!may_have_revision)
        return problem_set(problem, STATUS_USAGE,
                           "takes a material without a revision: %s, is %.80s", slug, text);
    return materials_number(text + length + 1, "the revision after @", problem);
}

// The answer as tables, or with --json as it came.
static Status materials_print(ApiCall *call, Problem *problem) {
    static const char *const skipped[] = {"links", "test", NULL};
    static const Field *const fields[] = {material_fields, pair_parameters_fields,
                                          evaluation_fields, buffer_fields, NULL};
    static const PrintTableView view = {skipped, columns, fields};
    TRY(api_print_tables(call, &view, problem));
    if (call->rows == 0)
        fputs("impactd materials: nothing fits\n", stderr);
    if (call->rows == LIST_MAX)
        fprintf(stderr, "impactd materials: the first %d; narrow the search to see others\n",
                LIST_MAX);
    return STATUS_OK;
}

// Requests `rest` below the material of the first operand, with options `queries` as its query.
static Status materials_ask(ApiCall *call, bool may_have_revision, const char *rest,
                            const char *queries, Problem *problem) {
    TRY(materials_name(call->operands[0], may_have_revision, problem));
    Bytes path = api_path("/v1/materials/%s%s", call->operands[0], rest);
    api_query_rows(&path, materials_fields, call->settings, queries);
    return api_get(call, path, problem);
}

// "sponge@2 draft" of an answer that is a revision.
static Status materials_print_revision(ApiCall *call, Problem *problem) {
    const ApiReply *reply = api_reply(call);
    if (((const ClientSettings *)call->settings)->json) {
        api_print(call);
        return STATUS_OK;
    }
    if (reply->slug == NULL || reply->status == NULL || reply->revision == COUNT_ABSENT)
        return api_unexpected("a revision", problem);
    printf("%s@%llu %s%s\n", reply->slug, (unsigned long long)reply->revision, reply->status,
           reply->review.self_approved ? ", by its own author" : "");
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
    call->client.about = path;
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

// Posts the body to `rest` below `name` of the material `slug`, based on the state in `tag`, which
// is "SLUG@REVISION-VERSION" in quotes. STATUS_STALE: another client has changed it.
static Status materials_write(ApiCall *call, const char *slug, const char *name, const char *rest,
                              const char *tag, Problem *problem) {
    char state[sizeof call->answer.etag];
    const char *at = strrchr(tag, '@');
    const unsigned long long latest = at != NULL ? strtoull(at + 1, NULL, 10) : 0;
    const uint64_t from = ((const MaterialsSettings *)call->settings)->from;
    if (tag[0] == '\0')
        return api_unexpected("a material with an ETag", problem);
    if (from != COUNT_ABSENT && from != latest) {
        (void)problem_set(problem, STATUS_STALE,
                          "the newest revision is %.63s@%llu, not %.63s@%llu", slug, latest, slug,
                          (unsigned long long)from);
        return materials_error_stale(slug, problem);
    }
    snprintf(state, sizeof state, "%s", tag); // the answer is replaced
    ApiRequest request = {
        .path = api_path("/v1/materials/%s%s", name, rest), .body = &call->body, .if_match = state};
    const Status status = api_ask(call, &request, problem);
    if (status == STATUS_STALE)
        return materials_error_stale(slug, problem);
    return status == STATUS_OK ? materials_print_revision(call, problem) : status;
}

// The same, based on the present state.
static Status materials_write_now(ApiCall *call, const char *slug, const char *name,
                                  const char *rest, Problem *problem) {
    // The history has an ETag also if all revisions are deprecated.
    TRY(api_get(call, api_path("/v1/materials/%s/history?limit=1", slug), problem));
    return materials_write(call, slug, name, rest, call->answer.etag, problem);
}

static Status materials_list(ApiCall *call, Problem *problem) {
    Bytes path = api_path("/v1/materials" LIMIT);
    api_query_rows(&path, materials_fields, call->settings, "q kind status e T_c");
    TRY(api_get(call, path, problem));
    return materials_print(call, problem);
}

// The contents of a revision, one member a line, as revise takes them.
static Status materials_print_editable(ApiCall *call, Problem *problem) {
    Bytes *body = &call->answer.body, text = {0};
    Material material = {0};
    TRY(json_edit_remove_nulls(body, problem));
    // Other members (author, links ...) are faults here, and left out.
    (void)json_parse(body->at, body->count, material_fields, &material, NULL);
    for (const Field *row = material_fields; row->kind != FIELD_KIND_END; row++) {
        const Field alone[] = {*row, FIELD_END};
        Bytes member = {0};
        if (encode_members(&member, alone, &material, WRITE_SCENE) > 0) {
            bytes_text(&text, text.count == 0 ? "{\n  " : ",\n  ");
            bytes_put(&text, member.at, member.count);
        }
        text.is_failed = text.is_failed || member.is_failed;
        bytes_clear(&member);
    }
    fields_clear(material_fields, &material);
    const bool is_whole = !text.is_failed && text.count > 0;
    if (is_whole)
        printf("%s\n}\n", text.at);
    bytes_clear(&text);
    return is_whole ? STATUS_OK : api_unexpected("a material", problem);
}

static Status materials_show(ApiCall *call, Problem *problem) {
    const MaterialsSettings *settings = call->settings;
    TRY(materials_ask(call, true, "", "", problem));
    return settings->editable ? materials_print_editable(call, problem)
                              : materials_print(call, problem);
}

// Shows what is below the material at the path that is the action's detail.
static Status materials_show_part(ApiCall *call, Problem *problem) {
    TRY(materials_ask(call, false, call->action->detail, "", problem));
    return materials_print(call, problem);
}

static Status materials_diff(ApiCall *call, Problem *problem) {
    char rest[80] = "/diff";
    for (size_t i = 1; i < call->count; i++) {
        TRY(materials_number(call->operands[i], "a revision", problem));
        const size_t used = strlen(rest);
        snprintf(rest + used, sizeof rest - used, "%s%.20s",
                 i == 1 ? "?from=" : "&to=", call->operands[i]);
    }
    TRY(materials_ask(call, false, rest, "", problem));
    return materials_print(call, problem);
}

static Status materials_used_by(ApiCall *call, Problem *problem) {
    const bool is_revision = strchr(call->operands[0], '@') != NULL;
    TRY(materials_ask(call, true, is_revision ? "/used-by" LIMIT : "/used-by", "", problem));
    return materials_print(call, problem);
}

static Status materials_derived(ApiCall *call, Problem *problem) {
    const MaterialsSettings *settings = call->settings;
    if (isnan(settings->damper_mass))
        return problem_set(problem, STATUS_USAGE,
                           "needs --damper-mass M in kg, and --structure-mass M unless the "
                           "structure does not move");
    TRY(materials_ask(call, true, "/derived",
                      "damper_mass structure_mass identified_for separation", problem));
    return materials_print(call, problem);
}

static Status materials_add(ApiCall *call, Problem *problem) {
    TRY(materials_read_body(call, call->operands[0], problem));
    ApiRequest request = {.path = api_path("/v1/materials"), .body = &call->body};
    TRY(api_ask(call, &request, problem));
    return materials_print_revision(call, problem);
}

static Status materials_revise(ApiCall *call, Problem *problem) {
    const char *slug = call->operands[0];
    TRY(materials_name(slug, false, problem));
    TRY(materials_read_body(call, call->operands[1], problem));
    return materials_write_now(call, slug, slug, "/revisions", problem);
}

static Status materials_revert(ApiCall *call, Problem *problem) {
    const MaterialsSettings *settings = call->settings;
    const char *slug = call->operands[0], *to = call->operands[1];
    TRY(materials_name(slug, false, problem));
    TRY(materials_number(to, "the revision to go back to", problem));
    if (settings->comment == NULL)
        return problem_set(problem, STATUS_USAGE, "needs --comment TEXT, the reason");
    bytes_format(&call->body, "{\"to\": %s}", to);
    TRY(materials_add_comment(call, problem));
    return materials_write_now(call, slug, slug, "/revert", problem);
}

// The detail of the action is the status that it sets.
static Status materials_review(ApiCall *call, Problem *problem) {
    const MaterialsSettings *settings = call->settings;
    const char *name = call->operands[0], *at = strchr(name, '@');
    char slug[MATERIAL_SLUG_MAX + 1];
    TRY(materials_name(name, true, problem));
    if (at == NULL)
        return problem_set(problem, STATUS_USAGE, "takes one revision, as %.63s@1", name);
    if (settings->reason == NULL)
        return problem_set(problem, STATUS_USAGE, "needs --reason TEXT");
    snprintf(slug, sizeof slug, "%.*s", (int)(at - name), name);
    bytes_format(&call->body, "{\"status\": \"%s\"}", call->action->detail);
    TRY(json_edit_set(&call->body, "reason", settings->reason, problem));
    return materials_write_now(call, slug, name, "/review", problem);
}

// Appends a file of forces to the body's traces.
static Status materials_add_trace(ApiCall *call, const char *path, Problem *problem) {
    const char *slash = strrchr(path, '/');
    Bytes text = {0}, json = {0};
    Trace trace = {.interval = ((const MaterialsSettings *)call->settings)->interval};
    call->client.about = path;
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

// Sends the body to `path`, with --dry-run, and prints the answer.
static Status materials_send(ApiCall *call, ApiRequest *request, Problem *problem) {
    request->body = &call->body;
    api_query_rows(&request->path, materials_fields, call->settings, "dry_run");
    TRY(api_ask(call, request, problem));
    return materials_print(call, problem);
}

static Status materials_measure(ApiCall *call, Problem *problem) {
    const MaterialsSettings *settings = call->settings;
    TRY(materials_name(call->operands[0], false, problem));
    TRY(materials_read_body(call, call->operands[1], problem));
    for (size_t i = 0; i < settings->trace.count; i++)
        TRY(materials_add_trace(call, settings->trace.at[i], problem));
    call->client.about = call->operands[1];
    return materials_send(
        call, &(ApiRequest){.path = api_path("/v1/materials/%s/measurements", call->operands[0])},
        problem);
}

// --confirm writes the proposal that was shown, based on the state that it was shown of.
static Status materials_propose(ApiCall *call, Problem *problem) {
    const MaterialsSettings *settings = call->settings;
    const char *slug = call->operands[0];
    TRY(materials_ask(call, false, "/proposal", "measurements separation as", problem));
    if (!settings->client.json || !settings->confirm)
        TRY(materials_print(call, problem));
    if (!settings->confirm)
        return STATUS_OK;
    TRY(json_edit_extract(&call->answer.body, "revision", &call->body, problem));
    TRY(materials_add_comment(call, problem));
    if (!settings->client.json)
        putchar('\n');
    return materials_write(call, slug, slug, "/revisions", call->answer.etag, problem);
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
    return materials_send(call,
                          &(ApiRequest){.path = api_path("/v1/materials/import"),
                                        .content_type = is_table ? "text/csv" : NULL},
                          problem);
}

static const ApiAction actions[] = {
    {"list", "no operands", 0, 0, materials_list, 0, NULL},
    {"show", "SLUG or SLUG@REVISION", 1, 1, materials_show, 0, NULL},
    {"add", "FILE.json", 1, 1, materials_add, 0, NULL},
    {"revise", "SLUG FILE.json", 2, 2, materials_revise, 0, NULL},
    {"revert", "SLUG REVISION", 2, 2, materials_revert, 0, NULL},
    {"approve", "SLUG@REVISION", 1, 1, materials_review, 0, "approved"},
    {"deprecate", "SLUG@REVISION", 1, 1, materials_review, 0, "deprecated"},
    {"history", "SLUG", 1, 1, materials_show_part, 0, "/history" LIMIT},
    {"diff", "SLUG [FROM [TO]]", 1, 3, materials_diff, 0, NULL},
    {"used-by", "SLUG or SLUG@REVISION", 1, 1, materials_used_by, 0, NULL},
    {"measure", "SLUG TEST.json", 2, 2, materials_measure, 0, NULL},
    {"measurements", "SLUG", 1, 1, materials_show_part, 0, "/measurements?limit=100"},
    {"propose", "SLUG", 1, 1, materials_propose, 0, NULL},
    {"derived", "SLUG or SLUG@REVISION", 1, 1, materials_derived, 0, NULL},
    {"export", "FILE.json or FILE.csv", 1, 1, materials_export, 0, NULL},
    {"import", "FILE.json or FILE.csv", 1, 1, materials_import, 0, NULL},
    {.name = NULL},
};

const Command command_materials = {
    .name = "materials",
    .operands =
        "list|show|add|revise|revert|approve|deprecate|history|diff|used-by|measure|measurements|"
        "propose|derived|export|import [...]",
    .summary = "the materials database: measure, revise, review, export, import",
    .help =
        "  impactd materials list --kind rubber --e 0.4..0.7      all materials, or a search\n"
        "  impactd materials show sponge                          the revision in use; sponge@1\n"
        "  impactd materials add foam.json                        a new material, a draft\n"
        "  impactd materials measure foam test.json --trace a.csv a drop test, and its evaluation\n"
        "  impactd materials measurements foam                    all drop tests, by number\n"
        "  impactd materials propose foam                         a revision from all drop tests\n"
        "  impactd materials propose foam --confirm --comment 'six drops'   and write it\n"
        "  impactd materials show foam --editable > foam.json     its contents, to edit\n"
        "  impactd materials revise foam foam.json --from 2 --comment 'thickness was 12 mm'\n"
        "  impactd materials diff foam 1 3                        differences of two revisions\n"
        "  impactd materials revert foam 1 --comment 'wrong test' a new revision equal to the "
        "first\n"
        "  impactd materials approve foam@3 --reason 'checked'    scenes use it from now on\n"
        "  impactd materials deprecate foam@2 --reason 'wet'      scenes that name it get a "
        "warning\n"
        "  impactd materials history foam                         who changed what, when and why\n"
        "  impactd materials used-by foam@2                       results that used it\n"
        "  impactd materials derived foam --damper-mass 0.11 --structure-mass 1.35   k_b and c_b\n"
        "  impactd materials export lab.csv                       the whole database, also as "
        ".json\n"
        "  impactd materials import lab.csv --dry-run             validate a file; write nothing\n"
        "\n"
        "FILE.json of add: {\"slug\": \"foam\", \"name\": \"Foam, 12 mm\", \"restitution\": 0.55,\n"
        "\"contact_time\": 0.02, \"source\": \"drop test of 12 May\"}; /schemas/material has\n"
        "all members. A revision never changes; a correction is a new revision. Exit\n"
        "codes: 3 faults in a file (all are reported), 4 no such material, 5 permission\n"
        "denied, 1 conflict (another client has changed it first).\n",
    .options = materials_fields,
    .groups = groups,
    .size = sizeof(MaterialsSettings),
    .run = api_command,
    .actions = actions,
};
