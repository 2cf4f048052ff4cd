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
#include "server/cli/command.h"
#include "server/cli/output.h"
#include "server/cli/scene_file.h"
#include "server/json/document.h"
#include "server/json/encode.h"
#include "server/json/parse.h"
#include "server/json/table.h"

typedef struct MaterialsSettings {
    ClientSettings client;
    bool json, dry_run, confirm, editable, force;
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

// An action in progress. Path, body and answer are those of its last request, or of its next one.
typedef struct MaterialsCall {
    const MaterialsSettings *settings;
    ApiClient *client;
    const struct MaterialsAction *action;
    const char *const *operands; // after the action's name
    size_t count;
    Bytes path, body;
    HttpAnswer answer;
} MaterialsCall;

enum { LIST_MAX = 1000, REVISION_DIGITS = 9 };

static const char *const statuses[] = {"draft", "approved", "deprecated", NULL};

// clang-format off
static const Field materials_fields[] = {
    DAEMON_ROWS(ClientSettings),
    FIELD_REAL(ClientSettings, wait, "s", AT_MIN(0), 60, "how long to wait for a busy server"),
    FIELD_FLAG(MaterialsSettings, json, false, "print the server's answer, as JSON"),
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

// Operands.

static Status materials_number(const char *text, const char *what, Problem *problem) {
    const size_t size = strlen(text);
    return size > 0 && size <= REVISION_DIGITS && text[0] != '0' &&
                   strspn(text, "0123456789") == size
               ? STATUS_OK
               : problem_set(problem, STATUS_USAGE,
                             "%s must be a whole number from 1, is \"%.60s\"", what, text);
}

// The first operand: a slug, or where the action allows it SLUG@REVISION.
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

// Requests.

// "/v1/materials/NAME" and the rest.
static void materials_path(MaterialsCall *call, const char *name, const char *rest) {
    bytes_clear(&call->path);
    call->path.most = 8000;
    bytes_format(&call->path, "/v1/materials/%s%s", name, rest);
}

static void materials_choice(MaterialsCall *call, const char *name, const char *const *names,
                             int choice) {
    http_query(&call->path, name, choice != CHOICE_ABSENT ? names[choice] : NULL);
}

// Sends the path, with the body if `posts`, and clears the path. `tag` (NULL: none) is the state
// that the change is based on.
static Status materials_ask(MaterialsCall *call, bool posts, const char *tag, Problem *problem) {
    HttpAnswer answer;
    const HttpAsk ask = {
        .method = posts ? "POST" : "GET", .body = posts ? &call->body : NULL, .if_match = tag};
    const Status status = api_client_request(call->client, ask, &call->path, &answer, problem);
    http_answer_clear(&call->answer);
    call->answer = answer;
    return status;
}

// The answer as tables, or with --json as it came.
static Status materials_print(const MaterialsCall *call, Problem *problem) {
    static const char *const skipped[] = {"links", "test", NULL};
    static const Field *const fields[] = {material_fields, pair_parameters_fields,
                                          evaluation_fields, buffer_fields, NULL};
    static const PrintTableView view = {skipped, columns, fields};
    const Bytes *body = &call->answer.body;
    size_t longest;
    if (call->settings->json) {
        api_client_print(&call->answer);
        return STATUS_OK;
    }
    TRY(print_table_print_json(body->at, body->count, &view, stdout, &longest, problem));
    if (longest == 0)
        fputs("impactd materials: nothing fits\n", stderr);
    if (longest == LIST_MAX)
        fprintf(stderr, "impactd materials: the first %d; narrow the search to see others\n",
                LIST_MAX);
    return STATUS_OK;
}

static Status materials_get(MaterialsCall *call, Problem *problem) {
    TRY(materials_ask(call, false, NULL, problem));
    return materials_print(call, problem);
}

typedef struct ReviewReply {
    bool self_approved;
} ReviewReply;
typedef struct RevisionReply {
    char *slug, *status;
    uint64_t revision;
    ReviewReply review;
} RevisionReply;

// clang-format off
static const Field review_reply_fields[] = {
    FIELD_FLAG(ReviewReply, self_approved, false, "by the author of the revision"),
    FIELD_END,
};
static const Field revision_reply_fields[] = {
    FIELD_TEXT(RevisionReply, slug, 0, PRESENCE_OPTIONAL, 0, "slug"),
    FIELD_TEXT(RevisionReply, status, 0, PRESENCE_OPTIONAL, 0, "status"),
    FIELD_COUNT(RevisionReply, revision, NULL, ANY, OPTIONAL, "revision"),
    FIELD_ITEM_OR_NULL(RevisionReply, review, review_reply_fields, PRESENCE_OPTIONAL, "last review"),
    FIELD_END,
};
// clang-format on

// "sponge@2 draft" of an answer that is a revision.
static Status materials_print_revision(const MaterialsCall *call, Problem *problem) {
    const Bytes *body = &call->answer.body;
    RevisionReply reply = {0};
    Status status = STATUS_OK;
    if (call->settings->json) {
        api_client_print(&call->answer);
        return STATUS_OK;
    }
    (void)json_parse(body->at, body->count, revision_reply_fields, &reply, NULL);
    if (reply.slug == NULL || reply.status == NULL || reply.revision == COUNT_ABSENT) {
        status = api_client_unexpected("a revision", problem);
    } else {
        text_make_printable(reply.slug);
        text_make_printable(reply.status);
        printf("%s@%llu %s%s\n", reply.slug, (unsigned long long)reply.revision, reply.status,
               reply.review.self_approved ? ", by its own author" : "");
    }
    fields_clear(revision_reply_fields, &reply);
    return status;
}

// The body from a JSON file, with --comment in it.
static Status materials_read_body(MaterialsCall *call, const char *path, Problem *problem) {
    call->client->about = path;
    TRY(scene_file_read(path, &call->body, problem));
    return call->settings->comment == NULL
               ? STATUS_OK
               : json_edit_set(&call->body, "comment", call->settings->comment, problem);
}

// Writing.

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
static Status materials_write(MaterialsCall *call, const char *slug, const char *name,
                              const char *rest, const char *tag, Problem *problem) {
    char state[sizeof call->answer.etag];
    const char *at = strrchr(tag, '@');
    const unsigned long long latest = at != NULL ? strtoull(at + 1, NULL, 10) : 0;
    const uint64_t from = call->settings->from;
    if (tag[0] == '\0')
        return api_client_unexpected("a material with an ETag", problem);
    if (from != COUNT_ABSENT && from != latest) {
        (void)problem_set(problem, STATUS_STALE,
                          "the newest revision is %.63s@%llu, not %.63s@%llu", slug, latest, slug,
                          (unsigned long long)from);
        return materials_error_stale(slug, problem);
    }
    snprintf(state, sizeof state, "%s", tag); // the answer is replaced
    materials_path(call, name, rest);
    const Status status = materials_ask(call, true, state, problem);
    if (status == STATUS_STALE)
        return materials_error_stale(slug, problem);
    return status == STATUS_OK ? materials_print_revision(call, problem) : status;
}

// The same, based on the present state.
static Status materials_write_now(MaterialsCall *call, const char *slug, const char *name,
                                  const char *rest, Problem *problem) {
    // The history has an ETag also if all revisions are deprecated.
    materials_path(call, slug, "/history?limit=1");
    TRY(materials_ask(call, false, NULL, problem));
    return materials_write(call, slug, name, rest, call->answer.etag, problem);
}

// Actions. The first operand, if it is a material, is valid.

static Status materials_list(MaterialsCall *call, Problem *problem) {
    const MaterialsSettings *settings = call->settings;
    Bytes *path = &call->path;
    bytes_text(path, "/v1/materials");
    http_query(path, "q", settings->q);
    http_query(path, "kind", settings->kind);
    materials_choice(call, "status", statuses, settings->status);
    http_query(path, "e", settings->e);
    http_query(path, "T_c", settings->T_c);
    http_query_real(path, "limit", LIST_MAX);
    return materials_get(call, problem);
}

// The contents of a revision, one member a line, as revise takes them.
static Status materials_print_editable(MaterialsCall *call, Problem *problem) {
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
    return is_whole ? STATUS_OK : api_client_unexpected("a material", problem);
}

static Status materials_show(MaterialsCall *call, Problem *problem) {
    materials_path(call, call->operands[0], "");
    if (!call->settings->editable)
        return materials_get(call, problem);
    TRY(materials_ask(call, false, NULL, problem));
    return materials_print_editable(call, problem);
}

static Status materials_history(MaterialsCall *call, Problem *problem) {
    materials_path(call, call->operands[0], "/history");
    http_query_real(&call->path, "limit", LIST_MAX);
    return materials_get(call, problem);
}

static Status materials_diff(MaterialsCall *call, Problem *problem) {
    static const char *const ends[] = {"from", "to"};
    materials_path(call, call->operands[0], "/diff");
    for (size_t i = 1; i < call->count; i++) {
        TRY(materials_number(call->operands[i], "a revision", problem));
        http_query(&call->path, ends[i - 1], call->operands[i]);
    }
    return materials_get(call, problem);
}

static Status materials_used_by(MaterialsCall *call, Problem *problem) {
    materials_path(call, call->operands[0], "/used-by");
    if (strchr(call->operands[0], '@') != NULL)
        http_query_real(&call->path, "limit", LIST_MAX);
    return materials_get(call, problem);
}

static Status materials_derived(MaterialsCall *call, Problem *problem) {
    const MaterialsSettings *settings = call->settings;
    if (isnan(settings->damper_mass))
        return problem_set(problem, STATUS_USAGE,
                           "needs --damper-mass M in kg, and --structure-mass M unless the "
                           "structure does not move");
    materials_path(call, call->operands[0], "/derived");
    http_query_real(&call->path, "damper_mass", settings->damper_mass);
    http_query_real(&call->path, "structure_mass", settings->structure_mass);
    materials_choice(call, "identified_for", identified_for_names, settings->identified_for);
    materials_choice(call, "separation", separation_names, settings->separation);
    return materials_get(call, problem);
}

static Status materials_add(MaterialsCall *call, Problem *problem) {
    TRY(materials_read_body(call, call->operands[0], problem));
    bytes_text(&call->path, "/v1/materials");
    TRY(materials_ask(call, true, NULL, problem));
    return materials_print_revision(call, problem);
}

static Status materials_revise(MaterialsCall *call, Problem *problem) {
    const char *slug = call->operands[0];
    TRY(materials_read_body(call, call->operands[1], problem));
    return materials_write_now(call, slug, slug, "/revisions", problem);
}

static Status materials_revert(MaterialsCall *call, Problem *problem) {
    const char *slug = call->operands[0], *to = call->operands[1];
    TRY(materials_number(to, "the revision to go back to", problem));
    if (call->settings->comment == NULL)
        return problem_set(problem, STATUS_USAGE, "needs --comment TEXT, the reason");
    bytes_format(&call->body, "{\"to\": %s, \"comment\": ", to);
    bytes_json_string(&call->body, call->settings->comment);
    bytes_text(&call->body, "}");
    return materials_write_now(call, slug, slug, "/revert", problem);
}

static Status materials_review(MaterialsCall *call, const char *verdict, Problem *problem) {
    const char *name = call->operands[0], *at = strchr(name, '@');
    char slug[MATERIAL_SLUG_MAX + 1];
    if (at == NULL)
        return problem_set(problem, STATUS_USAGE, "takes one revision, as %.63s@1", name);
    if (call->settings->reason == NULL)
        return problem_set(problem, STATUS_USAGE, "needs --reason TEXT");
    snprintf(slug, sizeof slug, "%.*s", (int)(at - name), name);
    bytes_format(&call->body, "{\"status\": \"%s\", \"reason\": ", verdict);
    bytes_json_string(&call->body, call->settings->reason);
    bytes_text(&call->body, "}");
    return materials_write_now(call, slug, name, "/review", problem);
}

static Status materials_approve(MaterialsCall *call, Problem *problem) {
    return materials_review(call, "approved", problem);
}

static Status materials_deprecate(MaterialsCall *call, Problem *problem) {
    return materials_review(call, "deprecated", problem);
}

// Appends a file of forces to the body's traces.
static Status materials_add_trace(MaterialsCall *call, const char *path, Problem *problem) {
    const char *slash = strrchr(path, '/');
    Bytes text = {0}, json = {0};
    Trace trace = {.interval = call->settings->interval};
    call->client->about = path;
    Status status = scene_file_read(path, &text, problem);
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

static Status materials_measure(MaterialsCall *call, Problem *problem) {
    const MaterialsSettings *settings = call->settings;
    TRY(materials_read_body(call, call->operands[1], problem));
    for (size_t i = 0; i < settings->trace.count; i++)
        TRY(materials_add_trace(call, settings->trace.at[i], problem));
    call->client->about = call->operands[1];
    materials_path(call, call->operands[0], "/measurements");
    http_query(&call->path, "dry_run", settings->dry_run ? "1" : NULL);
    TRY(materials_ask(call, true, NULL, problem));
    return materials_print(call, problem);
}

static Status materials_measurements(MaterialsCall *call, Problem *problem) {
    materials_path(call, call->operands[0], "/measurements");
    http_query(&call->path, "limit", "100"); // the answer has their count
    return materials_get(call, problem);
}

// --confirm writes the proposal that was shown, based on the state that it was shown of.
static Status materials_propose(MaterialsCall *call, Problem *problem) {
    const MaterialsSettings *settings = call->settings;
    const char *slug = call->operands[0];
    materials_path(call, slug, "/proposal");
    http_query(&call->path, "measurements", settings->measurements);
    materials_choice(call, "separation", separation_names, settings->separation);
    materials_choice(call, "as", proposal_form_names, settings->as);
    TRY(materials_ask(call, false, NULL, problem));
    if (!settings->confirm)
        return materials_print(call, problem);
    if (!settings->json)
        TRY(materials_print(call, problem));
    TRY(json_edit_extract(&call->answer.body, "revision", &call->body, problem));
    if (settings->comment != NULL)
        TRY(json_edit_set(&call->body, "comment", settings->comment, problem));
    if (!settings->json)
        putchar('\n');
    return materials_write(call, slug, slug, "/revisions", call->answer.etag, problem);
}

// Whether FILE is a table, by its name.
static Status materials_format(MaterialsCall *call, bool *is_table, Problem *problem) {
    const char *file = call->operands[0], *dot = strrchr(file, '.');
    *is_table = dot != NULL && strcmp(dot, ".csv") == 0;
    call->client->about = file;
    return *is_table || (dot != NULL && strcmp(dot, ".json") == 0)
               ? STATUS_OK
               : problem_set(problem, STATUS_USAGE, "the file must end in .json or .csv, is %.200s",
                             file);
}

static Status materials_export(MaterialsCall *call, Problem *problem) {
    bool is_table;
    TRY(materials_format(call, &is_table, problem));
    if (!call->settings->force && access(call->operands[0], F_OK) == 0)
        return problem_set(problem, STATUS_CONFLICT,
                           "exists: name another file, or replace it with --force");
    const HttpAsk ask = {.method = "GET",
                         .path = is_table ? "/v1/materials.csv" : "/v1/materials.json",
                         .take = output_take,
                         .most = UINT64_MAX};
    Status status = output_open(call->operands[0], problem);
    if (status == STATUS_OK)
        status = api_client_ask(call->client, &ask, &call->answer, problem);
    if (status == STATUS_OK)
        status = output_close(problem);
    output_drop();
    return status;
}

static Status materials_import(MaterialsCall *call, Problem *problem) {
    bool is_table;
    TRY(materials_format(call, &is_table, problem));
    TRY(scene_file_read(call->operands[0], &call->body, problem));
    const HttpAsk ask = {.method = "POST",
                         .path = call->settings->dry_run ? "/v1/materials/import?dry_run=1"
                                                         : "/v1/materials/import",
                         .body = &call->body,
                         .content_type = is_table ? "text/csv" : "application/json"};
    TRY(api_client_ask(call->client, &ask, &call->answer, problem));
    return materials_print(call, problem);
}

typedef enum FirstOperand {
    OPERAND_NONE,
    OPERAND_FILE,
    OPERAND_SLUG,
    OPERAND_REVISION
} FirstOperand;

static const struct MaterialsAction {
    const char *name, *takes;
    size_t min, max; // operands
    FirstOperand first;
    Status (*act)(MaterialsCall *call, Problem *problem);
} actions[] = {
    {"list", "no operands", 0, 0, OPERAND_NONE, materials_list},
    {"show", "SLUG or SLUG@REVISION", 1, 1, OPERAND_REVISION, materials_show},
    {"add", "FILE.json", 1, 1, OPERAND_FILE, materials_add},
    {"revise", "SLUG FILE.json", 2, 2, OPERAND_SLUG, materials_revise},
    {"revert", "SLUG REVISION", 2, 2, OPERAND_SLUG, materials_revert},
    {"approve", "SLUG@REVISION", 1, 1, OPERAND_REVISION, materials_approve},
    {"deprecate", "SLUG@REVISION", 1, 1, OPERAND_REVISION, materials_deprecate},
    {"history", "SLUG", 1, 1, OPERAND_SLUG, materials_history},
    {"diff", "SLUG [FROM [TO]]", 1, 3, OPERAND_SLUG, materials_diff},
    {"used-by", "SLUG or SLUG@REVISION", 1, 1, OPERAND_REVISION, materials_used_by},
    {"measure", "SLUG TEST.json", 2, 2, OPERAND_SLUG, materials_measure},
    {"measurements", "SLUG", 1, 1, OPERAND_SLUG, materials_measurements},
    {"propose", "SLUG", 1, 1, OPERAND_SLUG, materials_propose},
    {"derived", "SLUG or SLUG@REVISION", 1, 1, OPERAND_REVISION, materials_derived},
    {"export", "FILE.json or FILE.csv", 1, 1, OPERAND_FILE, materials_export},
    {"import", "FILE.json or FILE.csv", 1, 1, OPERAND_FILE, materials_import},
};

static Status materials_act(ApiClient *client, void *context, Problem *problem) {
    MaterialsCall *call = context;
    const struct MaterialsAction *action = call->action;
    call->client = client;
    if (action->first == OPERAND_SLUG || action->first == OPERAND_REVISION)
        TRY(materials_name(call->operands[0], action->first == OPERAND_REVISION, problem));
    return action->act(call, problem);
}

static int materials(const Command *self, void *of, const Options *options, Problem *problem) {
    const MaterialsSettings *settings = of;
    size_t index;
    if (command_action(options, &actions->name, COUNT(actions), sizeof *actions, &index, problem) !=
        STATUS_OK)
        return command_error(self->name, problem);
    MaterialsCall call = {.settings = settings,
                          .action = &actions[index],
                          .operands = options->operands + 1,
                          .count = options->operand_count - 1};
    if (call.count < call.action->min || call.count > call.action->max) {
        (void)problem_set(problem, STATUS_USAGE, "%s takes %s, is given %zu operands",
                          call.action->name, call.action->takes, call.count);
        return command_error(self->name, problem);
    }
    const int code =
        api_client_run(self, &settings->client, call.count > 0 ? call.operands[0] : "materials",
                       materials_act, &call, problem);
    bytes_clear(&call.path);
    bytes_clear(&call.body);
    http_answer_clear(&call.answer);
    return code;
}

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
        "FILE.json of add: {\"slug\": \"foam\", \"name\": \"Foam, 12 mm\", \"restitution\": 0.55, "
        "\"contact_time\":\n"
        "0.02, \"source\": \"drop test of 12 May\"}; /schemas/material has all members. A revision "
        "never "
        "changes;\n"
        "a correction is a new revision. Exit codes: 3 faults in a file (all are reported), 4 no "
        "such "
        "material,\n"
        "5 permission denied, 1 conflict (another client has changed it first).\n",
    .options = materials_fields,
    .groups = groups,
    .size = sizeof(MaterialsSettings),
    .run = materials,
};
