// impactd materials: the materials database of a daemon, from a shell. A change names the state of
// the material that it is based on (--from); without it the state is read just before. Of two
// clients that change one state at once one is refused.
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
#include "server/json/encode.h"
#include "server/json/json_edit.h"
#include "server/json/parse.h"
#include "server/json/table.h"

typedef struct MaterialsSettings {
    char *server, *token_file, *ca_file;
    double wait;
    bool json, dry_run, confirm;
    char *q, *kind, *e, *T_c;
    int status; // of those listed; CHOICE_ABSENT: any
    char *comment, *reason;
    Texts trace;
    double interval;
    char *measurements;
    int separation, as; // CHOICE_ABSENT: as the daemon has it
    double damper_mass, structure_mass;
    int identified_for;
    bool editable;
    uint64_t from; // the newest revision that its writer saw; COUNT_ABSENT
    bool force;
} MaterialsSettings;

// One action at work.
typedef struct MaterialsCall {
    const MaterialsSettings *settings;
    ApiClient *daemon;
    const char *const *operands; // behind the action's name
    size_t operand_count;
    const char *about; // what messages of faults name; the action may set a file
} MaterialsCall;

enum { MATERIALS_MAX = 1000 }; // of a list that is asked for

static const char *const statuses[] = {"draft", "approved", "deprecated", NULL};

// clang-format off
static const Field materials_fields[] = {
    DAEMON_ROWS(MaterialsSettings),
    FIELD_REAL(MaterialsSettings, wait, "s", AT_MIN(0), 60, "wait so long for a busy daemon"),
    FIELD_FLAG(MaterialsSettings, json, false, "print what the daemon answers, as JSON"),
    FIELD_TEXT(MaterialsSettings, q, 200, PRESENCE_OPTIONAL, 0, "words in slug, name, kind, supplier, source, tags or notes"),
    FIELD_TEXT(MaterialsSettings, kind, 60, PRESENCE_OPTIONAL, 0, "those of one kind: foam, rubber, metal ..."),
    FIELD_CHOICE(MaterialsSettings, status, statuses, OPTIONAL, "draft, approved or deprecated"),
    FIELD_TEXT(MaterialsSettings, e, 60, PRESENCE_OPTIONAL, 0, "those whose coefficient of restitution lies in a range: 0.4..0.7, ..0.3, 0.9.."),
    FIELD_TEXT(MaterialsSettings, T_c, 60, PRESENCE_OPTIONAL, 0, "those whose contact time in s lies in a range"),
    FIELD_FLAG(MaterialsSettings, editable, false, "what the revision says and nothing else, as revise takes it"),
    FIELD_TEXT(MaterialsSettings, comment, 1000, PRESENCE_OPTIONAL, 0, "why, for those who come later"),
    FIELD_COUNT(MaterialsSettings, from, NULL, AT_MIN(1), OPTIONAL, "the newest revision you saw: nothing is written if there is a newer one"),
    FIELD_TEXT(MaterialsSettings, reason, 1000, PRESENCE_OPTIONAL, 0, "why it is approved or deprecated"),
    FIELD_TEXTS(MaterialsSettings, trace, NULL, NULL, TRACES_MAX, PRESENCE_OPTIONAL, 0, "a force trace's file: a time in s and a force in N, or the force alone; may be given again"),
    FIELD_REAL(MaterialsSettings, interval, "s", ABOVE(0), OPTIONAL, "between samples, where a trace has forces alone"),
    FIELD_FLAG(MaterialsSettings, dry_run, false, "show what would come of it; keep nothing"),
    FIELD_TEXT(MaterialsSettings, measurements, 4000, PRESENCE_OPTIONAL, 0, "the numbers of those that count, as 1,2 (all)"),
    FIELD_CHOICE(MaterialsSettings, separation, separation_names, OPTIONAL, "the rule by which a contact ends: zero_penetration, zero_force"),
    FIELD_CHOICE(MaterialsSettings, as, proposal_form_names, OPTIONAL, "constant, or a table over approach speed"),
    FIELD_FLAG(MaterialsSettings, confirm, false, "make it a revision"),
    FIELD_REAL(MaterialsSettings, damper_mass, "kg", ABOVE(0), OPTIONAL, "the free mass of a pair"),
    FIELD_REAL(MaterialsSettings, structure_mass, "kg", ABOVE(0), OPTIONAL, "what it strikes; without, that does not move"),
    FIELD_CHOICE(MaterialsSettings, identified_for, identified_for_names, OPTIONAL, "whose e and T_c they are: this pair's (scene), or the test's (rig)"),
    FIELD_FLAG(MaterialsSettings, force, false, "replace FILE if it is there"),
    FIELD_END,
};
static const OptionGroup groups[] = {
    {"server", "The daemon:"},
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

enum { NUMBER_MAX = 9 }; // digits of a revision

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

static bool is_number(const char *text) {
    const size_t size = strlen(text);
    return size > 0 && size <= NUMBER_MAX && text[0] != '0' && strspn(text, "0123456789") == size;
}

// "1", "12": a revision's number.
static Status materials_number(const char *text, const char *what, Problem *problem) {
    return is_number(text)
               ? STATUS_OK
               : problem_set(problem, STATUS_USAGE,
                             "%s must be a whole number from 1 on, is \"%.60s\"", what, text);
}

// Whether `text` is a slug, or where that is allowed SLUG@REVISION.
static Status materials_name(const char *text, bool may_have_revision, Problem *problem) {
    char slug[MATERIAL_SLUG_MAX + 1];
    const size_t length = strcspn(text, "@");
    snprintf(slug, sizeof slug, "%.*s", (int)(length < sizeof slug ? length : 0), text);
    const bool has_revision = text[length] == '@';
    if (!material_slug_is_valid(slug))
        return problem_set(problem, STATUS_USAGE,
                           "a material is named by 1 to %d lower-case letters, digits, underscores "
                           "and dashes%s, is \"%.80s\"",
                           MATERIAL_SLUG_MAX, may_have_revision ? ", perhaps with @REVISION" : "",
                           text);
    if (!has_revision)
        return STATUS_OK;
    if (!may_have_revision)
        return problem_set(problem, STATUS_USAGE,
                           "takes a material without a revision: %s, is %.80s", slug, text);
    return materials_number(text + length + 1, "the revision behind @", problem);
}

// "/v1/materials/sponge@2" and what follows.
static void materials_path(Bytes *path, const char *name, const char *rest) {
    *path = (Bytes){.most = 8000};
    bytes_format(path, "/v1/materials/%s%s", name, rest);
}

// Asks and clears `path`. `body` (NULL: none) is JSON, `tag` (NULL: none) the state that it holds
// for. The answer is cleared by http_answer_clear in any case.
static Status materials_ask(MaterialsCall *call, const char *method, Bytes *path, const Bytes *body,
                            const char *tag, HttpAnswer *answer, Problem *problem) {
    const HttpAsk ask = {.method = method, .body = body, .if_match = tag};
    return api_client_request(call->daemon, ask, path, answer, problem);
}

// The answer for people, or with --json as it came.
static Status materials_print(const MaterialsCall *call, const HttpAnswer *answer,
                              Problem *problem) {
    static const char *const skipped[] = {"links", "test", NULL};
    static const Field *const fields[] = {material_fields, pair_parameters_fields,
                                          evaluation_fields, buffer_fields, NULL};
    static const PrintTableView view = {skipped, columns, fields};
    size_t longest;
    if (call->settings->json) {
        api_client_print(answer);
        return STATUS_OK;
    }
    TRY(print_table_print_json(answer->body.at, answer->body.count, &view, stdout, &longest, problem));
    if (longest == 0)
        fputs("impactd materials: nothing fits\n", stderr);
    if (longest == MATERIALS_MAX)
        fprintf(stderr, "impactd materials: the first %d; narrow it down to see others\n",
                MATERIALS_MAX);
    return STATUS_OK;
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
static Status materials_print_revision(const MaterialsCall *call, const HttpAnswer *answer,
                                       Problem *problem) {
    RevisionReply told = {0};
    Status status = STATUS_OK;
    if (call->settings->json) {
        api_client_print(answer);
        return STATUS_OK;
    }
    (void)json_parse(answer->body.at, answer->body.count, revision_reply_fields, &told, NULL);
    if (told.slug == NULL || told.status == NULL || told.revision == COUNT_ABSENT) {
        status = problem_set(problem, STATUS_UNREACHABLE,
                             "the answer is no revision: what answers there is no impactd");
    } else {
        text_make_printable(told.slug);
        text_make_printable(told.status);
        printf("%s@%llu %s%s\n", told.slug, (unsigned long long)told.revision, told.status,
               told.review.self_approved ? ", by its own author" : "");
    }
    fields_clear(revision_reply_fields, &told);
    return status;
}

// A JSON object from a file, with the comment in it if there is one.
static Status materials_body(MaterialsCall *call, const char *path, Bytes *body, Problem *problem) {
    call->about = path;
    Status status = scene_file_read(path, body, problem);
    if (status == STATUS_OK && call->settings->comment != NULL)
        status = json_edit_set(body, "comment", call->settings->comment, problem);
    return status;
}

static Status materials_get(MaterialsCall *call, Bytes *path, Problem *problem) {
    HttpAnswer answer;
    Status status = materials_ask(call, "GET", path, NULL, NULL, &answer, problem);
    if (status == STATUS_OK)
        status = materials_print(call, &answer, problem);
    http_answer_clear(&answer);
    return status;
}

static void materials_limit(Bytes *path) {
    char most[16];
    snprintf(most, sizeof most, "%d", MATERIALS_MAX);
    http_query(path, "limit", most);
}

static Status materials_list_act(MaterialsCall *call, Problem *problem) {
    const MaterialsSettings *settings = call->settings;
    Bytes path = {.most = 8000};
    bytes_text(&path, "/v1/materials");
    http_query(&path, "q", settings->q);
    http_query(&path, "kind", settings->kind);
    http_query(&path, "status",
               settings->status != CHOICE_ABSENT ? statuses[settings->status] : NULL);
    http_query(&path, "e", settings->e);
    http_query(&path, "T_c", settings->T_c);
    materials_limit(&path);
    return materials_get(call, &path, problem);
}

// What the revision says, a line a member, as `revise` takes it.
static Status materials_print_editable(HttpAnswer *answer, Problem *problem) {
    Material material = {0};
    const char *between = "{\n  ";
    TRY(json_edit_remove_nulls(&answer->body, problem));
    // What is beside it (who, when, links) is no fault here.
    (void)json_parse(answer->body.at, answer->body.count, material_fields, &material, NULL);
    Bytes text = {0};
    for (const Field *row = material_fields; row->kind != FIELD_KIND_END; row++) {
        const Field alone[] = {*row, FIELD_END};
        Bytes member = {0};
        if (encode_members(&member, alone, &material, WRITE_SCENE) > 0) {
            bytes_text(&text, between);
            bytes_put(&text, member.at, member.count);
            between = ",\n  ";
        }
        text.is_failed = text.is_failed || member.is_failed;
        bytes_clear(&member);
    }
    fields_clear(material_fields, &material);
    const bool is_whole = !text.is_failed && text.count > 0;
    if (is_whole)
        printf("%s\n}\n", text.at);
    bytes_clear(&text);
    return is_whole ? STATUS_OK
                    : problem_set(problem, STATUS_UNREACHABLE,
                                  "the answer is no material: what answers there is no impactd");
}

static Status materials_show_act(MaterialsCall *call, Problem *problem) {
    Bytes path;
    TRY(materials_name(call->operands[0], true, problem));
    materials_path(&path, call->operands[0], "");
    if (!call->settings->editable)
        return materials_get(call, &path, problem);
    HttpAnswer answer;
    Status status = materials_ask(call, "GET", &path, NULL, NULL, &answer, problem);
    if (status == STATUS_OK)
        status = materials_print_editable(&answer, problem);
    http_answer_clear(&answer);
    return status;
}

static Status materials_history_act(MaterialsCall *call, Problem *problem) {
    Bytes path;
    TRY(materials_name(call->operands[0], false, problem));
    materials_path(&path, call->operands[0], "/history");
    materials_limit(&path);
    return materials_get(call, &path, problem);
}

static Status materials_diff_act(MaterialsCall *call, Problem *problem) {
    static const char *const ends[] = {"from", "to"};
    Bytes path;
    TRY(materials_name(call->operands[0], false, problem));
    for (size_t i = 1; i < call->operand_count; i++)
        TRY(materials_number(call->operands[i], "a revision", problem));
    materials_path(&path, call->operands[0], "/diff");
    for (size_t i = 1; i < call->operand_count; i++)
        http_query(&path, ends[i - 1], call->operands[i]);
    return materials_get(call, &path, problem);
}

static Status materials_used_by_act(MaterialsCall *call, Problem *problem) {
    Bytes path;
    TRY(materials_name(call->operands[0], true, problem));
    materials_path(&path, call->operands[0], "/used-by");
    if (strchr(call->operands[0], '@') != NULL)
        materials_limit(&path);
    return materials_get(call, &path, problem);
}

static Status materials_derived_act(MaterialsCall *call, Problem *problem) {
    const MaterialsSettings *settings = call->settings;
    Bytes path;
    TRY(materials_name(call->operands[0], true, problem));
    if (isnan(settings->damper_mass))
        return problem_set(
            problem, STATUS_USAGE,
            "needs --damper-mass M in kg, and --structure-mass M unless the structure "
            "does not move");
    materials_path(&path, call->operands[0], "/derived");
    http_query_real(&path, "damper_mass", settings->damper_mass);
    http_query_real(&path, "structure_mass", settings->structure_mass);
    if (settings->identified_for != CHOICE_ABSENT)
        http_query(&path, "identified_for", identified_for_names[settings->identified_for]);
    if (settings->separation != CHOICE_ABSENT)
        http_query(&path, "separation", separation_names[settings->separation]);
    return materials_get(call, &path, problem);
}

static Status materials_add_act(MaterialsCall *call, Problem *problem) {
    Bytes path = {.most = 8000}, body = {0};
    HttpAnswer answer = {0};
    bytes_text(&path, "/v1/materials");
    Status status = materials_body(call, call->operands[0], &body, problem);
    if (status == STATUS_OK)
        status = materials_ask(call, "POST", &path, &body, NULL, &answer, problem);
    if (status == STATUS_OK)
        status = materials_print_revision(call, &answer, problem);
    http_answer_clear(&answer);
    bytes_clear(&path);
    bytes_clear(&body);
    return status;
}

// The revision that the tag "SLUG@REVISION-VERSION" names must be the one that was begun with.
static Status materials_check_from(const MaterialsCall *call, const char *slug, const char *tag,
                                   Problem *problem) {
    const char *at = strrchr(tag, '@');
    const unsigned long long latest = at != NULL ? strtoull(at + 1, NULL, 10) : 0;
    if (call->settings->from == COUNT_ABSENT || call->settings->from == latest)
        return STATUS_OK;
    return problem_set(problem, STATUS_STALE, "the newest revision is %.63s@%llu, not %.63s@%llu",
                       slug, latest, slug, (unsigned long long)call->settings->from);
}

// Somebody was faster: says so, in words that tell what to do now.
static Status materials_report_stale(const char *slug, Status status, Problem *problem) {
    char said[sizeof problem->detail];
    if (status != STATUS_STALE)
        return status;
    snprintf(said, sizeof said, "%s", problem->detail);
    problem_clear(problem);
    return problem_set(problem, STATUS_STALE,
                       "somebody was faster, nothing was written: %.250s; \"impactd materials "
                       "history %.63s\" shows who; look at it and do it again",
                       said, slug);
}

// Writes to `name` of the material `slug` in the state that `tag` tells: that of what its writer
// was shown. STATUS_STALE where somebody was faster, with what to do.
static Status materials_write_seen(MaterialsCall *call, const char *slug, const char *name,
                                   const char *rest, const Bytes *body, const char *tag,
                                   HttpAnswer *answer, Problem *problem) {
    Bytes path;
    *answer = (HttpAnswer){0};
    Status status = STATUS_OK;
    if (tag[0] == '\0')
        status = problem_set(problem, STATUS_UNREACHABLE,
                             "the answer tells no state: what answers there is no impactd");
    if (status == STATUS_OK)
        status = materials_check_from(call, slug, tag, problem);
    if (status == STATUS_OK) {
        materials_path(&path, name, rest);
        status = materials_ask(call, "POST", &path, body, tag, answer, problem);
    }
    return materials_report_stale(slug, status, problem);
}

// In the state as it is now, or, with --from, as its writer saw it.
static Status materials_write_now(MaterialsCall *call, const char *slug, const char *name,
                                  const char *rest, const Bytes *body, HttpAnswer *answer,
                                  Problem *problem) {
    // The history has a tag whatever became of the revisions.
    Bytes path;
    HttpAnswer history;
    *answer = (HttpAnswer){0};
    materials_path(&path, slug, "/history?limit=1");
    Status status = materials_ask(call, "GET", &path, NULL, NULL, &history, problem);
    if (status == STATUS_OK)
        status = materials_write_seen(call, slug, name, rest, body, history.etag, answer, problem);
    http_answer_clear(&history);
    return status;
}

static Status materials_write(MaterialsCall *call, const char *slug, const char *name,
                              const char *rest, const Bytes *body, Problem *problem) {
    HttpAnswer answer;
    Status status = materials_write_now(call, slug, name, rest, body, &answer, problem);
    if (status == STATUS_OK)
        status = materials_print_revision(call, &answer, problem);
    http_answer_clear(&answer);
    return status;
}

static Status materials_revise_act(MaterialsCall *call, Problem *problem) {
    const char *slug = call->operands[0];
    Bytes body = {0};
    TRY(materials_name(slug, false, problem));
    Status status = materials_body(call, call->operands[1], &body, problem);
    if (status == STATUS_OK)
        status = materials_write(call, slug, slug, "/revisions", &body, problem);
    bytes_clear(&body);
    return status;
}

static Status materials_revert_act(MaterialsCall *call, Problem *problem) {
    const char *slug = call->operands[0], *to = call->operands[1];
    Bytes body = {.most = 1 << 16};
    TRY(materials_name(slug, false, problem));
    TRY(materials_number(to, "the revision to go back to", problem));
    if (call->settings->comment == NULL)
        return problem_set(problem, STATUS_USAGE, "needs --comment TEXT: why it goes back");
    bytes_format(&body, "{\"to\": %s, \"comment\": ", to);
    bytes_json_string(&body, call->settings->comment);
    bytes_text(&body, "}");
    const Status status = materials_write(call, slug, slug, "/revert", &body, problem);
    bytes_clear(&body);
    return status;
}

static Status materials_review(MaterialsCall *call, const char *verdict, Problem *problem) {
    const char *name = call->operands[0], *at = strchr(name, '@');
    char slug[80];
    Bytes body = {.most = 1 << 16};
    TRY(materials_name(name, true, problem));
    if (at == NULL)
        return problem_set(problem, STATUS_USAGE,
                           "takes one revision, like %.63s@1: a review is of what it says", name);
    if (call->settings->reason == NULL)
        return problem_set(problem, STATUS_USAGE, "needs --reason TEXT, for those who come later");
    snprintf(slug, sizeof slug, "%.*s", (int)(at - name), name);
    bytes_format(&body, "{\"status\": \"%s\", \"reason\": ", verdict);
    bytes_json_string(&body, call->settings->reason);
    bytes_text(&body, "}");
    const Status status = materials_write(call, slug, name, "/review", &body, problem);
    bytes_clear(&body);
    return status;
}

static Status materials_approve_act(MaterialsCall *call, Problem *problem) {
    return materials_review(call, "approved", problem);
}

static Status materials_deprecate_act(MaterialsCall *call, Problem *problem) {
    return materials_review(call, "deprecated", problem);
}

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

static Status materials_measure_act(MaterialsCall *call, Problem *problem) {
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
        http_query(&path, "dry_run", settings->dry_run ? "1" : NULL);
        status = materials_ask(call, "POST", &path, &body, NULL, &answer, problem);
    }
    if (status == STATUS_OK)
        status = materials_print(call, &answer, problem);
    http_answer_clear(&answer);
    bytes_clear(&body);
    return status;
}

static Status materials_measurements_act(MaterialsCall *call, Problem *problem) {
    Bytes path;
    TRY(materials_name(call->operands[0], false, problem));
    materials_path(&path, call->operands[0], "/measurements");
    http_query(&path, "limit", "100"); // the document has their number
    return materials_get(call, &path, problem);
}

// What was shown is what is said, under the comment given, else its own, and of the state that it
// was shown of: whatever was done since is not overwritten.
static Status materials_confirm(MaterialsCall *call, const HttpAnswer *shown, Problem *problem) {
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

static Status materials_propose_act(MaterialsCall *call, Problem *problem) {
    const MaterialsSettings *settings = call->settings;
    Bytes path;
    HttpAnswer answer = {0};
    TRY(materials_name(call->operands[0], false, problem));
    materials_path(&path, call->operands[0], "/proposal");
    http_query(&path, "measurements", settings->measurements);
    if (settings->separation != CHOICE_ABSENT)
        http_query(&path, "separation", separation_names[settings->separation]);
    if (settings->as != CHOICE_ABSENT)
        http_query(&path, "as", proposal_form_names[settings->as]);
    Status status = materials_ask(call, "GET", &path, NULL, NULL, &answer, problem);
    // With --json the revision that was made is the answer.
    if (status == STATUS_OK && !(settings->confirm && settings->json))
        status = materials_print(call, &answer, problem);
    if (status == STATUS_OK && settings->confirm)
        status = materials_confirm(call, &answer, problem);
    http_answer_clear(&answer);
    return status;
}

static const struct Format {
    const char *ending, *path, *type;
} formats[] = {
    {".json", "/v1/materials.json", "application/json"},
    {".csv", "/v1/materials.csv", "text/csv"},
};

static const struct Format *exchange_format(const char *path, Problem *problem) {
    const size_t length = strlen(path);
    for (size_t i = 0; i < COUNT(formats); i++) {
        const size_t ending = strlen(formats[i].ending);
        if (length > ending && strcmp(path + length - ending, formats[i].ending) == 0)
            return &formats[i];
    }
    (void)problem_set(problem, STATUS_USAGE, "the file must end in .json or .csv, is %.200s", path);
    return NULL;
}

static Status exchange_take(void *context, const void *bytes, size_t size, Problem *problem) {
    (void)context;
    return output_write(bytes, size, problem);
}

static Status materials_export_act(MaterialsCall *call, Problem *problem) {
    const char *file = call->operands[0];
    const struct Format *format = exchange_format(file, problem);
    HttpAnswer answer = {0};
    if (format == NULL)
        return STATUS_USAGE;
    call->about = file;
    if (!call->settings->force && access(file, F_OK) == 0)
        return problem_set(problem, STATUS_CONFLICT,
                           "is there already: name another file, or --force replaces it");
    const HttpAsk ask = {
        .method = "GET", .path = format->path, .take = exchange_take, .most = UINT64_MAX};
    Status status = output_open(file, problem);
    if (status == STATUS_OK)
        status = api_client_ask(call->daemon, &ask, &answer, problem);
    if (status == STATUS_OK)
        status = output_close(problem);
    output_drop();
    http_answer_clear(&answer);
    return status;
}

static Status materials_import_act(MaterialsCall *call, Problem *problem) {
    const char *file = call->operands[0];
    const struct Format *format = exchange_format(file, problem);
    Bytes body = {0};
    HttpAnswer answer = {0};
    if (format == NULL)
        return STATUS_USAGE;
    call->about = file;
    Status status = scene_file_read(file, &body, problem);
    const HttpAsk ask = {.method = "POST",
                         .path = call->settings->dry_run ? "/v1/materials/import?dry_run=1"
                                                         : "/v1/materials/import",
                         .body = &body,
                         .content_type = format->type};
    if (status == STATUS_OK)
        status = api_client_ask(call->daemon, &ask, &answer, problem);
    if (status == STATUS_OK)
        status = materials_print(call, &answer, problem);
    http_answer_clear(&answer);
    bytes_clear(&body);
    return status;
}

static const struct Action {
    const char *name, *takes;
    size_t least, most; // operands
    Status (*act)(MaterialsCall *call, Problem *problem);
} actions[] = {
    {"list", "nothing more", 0, 0, materials_list_act},
    {"show", "SLUG or SLUG@REVISION", 1, 1, materials_show_act},
    {"add", "FILE.json", 1, 1, materials_add_act},
    {"revise", "SLUG FILE.json", 2, 2, materials_revise_act},
    {"revert", "SLUG REVISION", 2, 2, materials_revert_act},
    {"approve", "SLUG@REVISION", 1, 1, materials_approve_act},
    {"deprecate", "SLUG@REVISION", 1, 1, materials_deprecate_act},
    {"history", "SLUG", 1, 1, materials_history_act},
    {"diff", "SLUG, and perhaps two revisions", 1, 3, materials_diff_act},
    {"used-by", "SLUG or SLUG@REVISION", 1, 1, materials_used_by_act},
    {"measure", "SLUG TEST.json", 2, 2, materials_measure_act},
    {"measurements", "SLUG", 1, 1, materials_measurements_act},
    {"propose", "SLUG", 1, 1, materials_propose_act},
    {"derived", "SLUG or SLUG@REVISION", 1, 1, materials_derived_act},
    {"export", "FILE.json or FILE.csv", 1, 1, materials_export_act},
    {"import", "FILE.json or FILE.csv", 1, 1, materials_import_act},
};
// clang-format on

static int materials(const Command *self, void *of, const Options *options, Problem *problem) {
    const MaterialsSettings *settings = of;
    size_t index;
    if (command_action(options, &actions->name, COUNT(actions), sizeof *actions, &index, problem) !=
        STATUS_OK)
        return command_error(self->name, problem);
    const struct Action *action = &actions[index];
    const size_t count = options->operand_count - 1;
    ApiClient daemon;
    MaterialsCall call = {settings, &daemon, options->operands + 1, count,
                          count > 0 ? options->operands[1] : "materials"};
    Status status = STATUS_OK;
    if (count < action->least || count > action->most)
        status = problem_set(problem, STATUS_USAGE, "%s takes %s, is given %zu operands",
                             action->name, action->takes, count);
    if (status != STATUS_OK)
        return command_error(self->name, problem);
    const ClientSettings client = {settings->server, settings->token_file, settings->ca_file,
                                   settings->wait};
    status = api_client_open(&client, &daemon, problem);
    if (status == STATUS_OK)
        status = action->act(&call, problem);
    api_client_close(&daemon);
    if (status == STATUS_USAGE && problem->count == 0)
        return command_error(self->name, problem);
    return status == STATUS_OK ? COMMAND_OK
                               : api_client_refuse(self->name, call.about, status, problem);
}

const Command command_materials = {
    .name = "materials",
    .operands =
        "list|show|add|revise|revert|approve|deprecate|history|diff|used-by|measure|measurements|"
        "propose|derived|export|import [...]",
    .summary = "the lab's materials: measure, revise, approve, trace, share",
    .help =
        "  impactd materials list --kind rubber --e 0.4..0.7      what there is\n"
        "  impactd materials show sponge                          the revision in use; sponge@1\n"
        "  impactd materials add foam.json                        a new material, a draft\n"
        "  impactd materials measure foam test.json --trace a.csv a drop test, and what it comes "
        "to\n"
        "  impactd materials measurements foam                    those that are kept, by number\n"
        "  impactd materials propose foam                         what all its tests come to\n"
        "  impactd materials propose foam --confirm --comment 'six drops'   and a revision of it\n"
        "  impactd materials show foam --editable > foam.json     to change by hand what it says\n"
        "  impactd materials revise foam foam.json --from 2 --comment 'thickness was 12 mm'\n"
        "  impactd materials diff foam 1 3                        in what two revisions differ\n"
        "  impactd materials revert foam 1 --comment 'wrong test' as it was, as a new revision\n"
        "  impactd materials approve foam@3 --reason 'checked'    scenes take it from now on\n"
        "  impactd materials deprecate foam@2 --reason 'wet'      with a reason that all see\n"
        "  impactd materials history foam                         who did what, when and why\n"
        "  impactd materials used-by foam@2                       results that it went into\n"
        "  impactd materials derived foam --damper-mass 0.11 --structure-mass 1.35   k_b and c_b\n"
        "  impactd materials export lab.csv                       all of it, also as .json\n"
        "  impactd materials import lab.csv --dry-run             judge it; keep nothing\n"
        "\n"
        "FILE.json of add: {\"slug\": \"foam\", \"name\": \"Foam, 12 mm\", \"restitution\": 0.55, "
        "\"contact_time\":\n"
        "0.02, \"source\": \"drop test of 12 May\"}; /schemas/material has all members. What is "
        "written stays:\n"
        "a revision never changes, a new one says better. Exit code 3 if a file has faults (all "
        "are told),\n"
        "4 if there is no such material, 5 if you may not, 1 if somebody was faster.\n",
    .options = materials_fields,
    .groups = groups,
    .size = sizeof(MaterialsSettings),
    .run = materials,
};
