// The daemon reads the file and judges it; here it is sent as it is.
#include "server/cli/command.h"

#include <stdio.h>
#include <string.h>

#include "core/excitation/recorded_motion.h"
#include "core/formats/ground_motion_text.h"
#include "server/cli/client.h"
#include "server/cli/scene_file.h"
#include "server/json/parse.h"
#include "server/json/table.h"

enum { PAGE = 500 }; // records a request, the most that the API allows

typedef struct RecordsSettings {
    char *server, *token_file, *ca_file;
    char *name, *source, *processing, *earthquake, *station, *notes, *q;
    double interval, wait;
    int unit;
    bool json;
} RecordsSettings;

// clang-format off
static const Field records_fields[] = {
    DAEMON_ROWS(RecordsSettings),
    FIELD_TEXT(RecordsSettings, name, RECORD_NAME_SIZE - 1, PRESENCE_OPTIONAL, 0, "add: what scenes call it (the file's name without its extension)"),
    FIELD_REAL(RecordsSettings, interval, "s", ABOVE(0), OPTIONAL, "add: time between samples, where the file does not tell it"),
    FIELD_CHOICE(RecordsSettings, unit, acceleration_unit_names, OPTIONAL, "add: g, m/s^2 or cm/s^2, over what the file tells"),
    FIELD_TEXT(RecordsSettings, source, 1000, PRESENCE_OPTIONAL, 0, "add: where the file comes from"),
    FIELD_TEXT(RecordsSettings, processing, 1000, PRESENCE_OPTIONAL, 0, "add: what was done to it: filters, baseline"),
    FIELD_TEXT(RecordsSettings, earthquake, 200, PRESENCE_OPTIONAL, 0, "add: which one"),
    FIELD_TEXT(RecordsSettings, station, 200, PRESENCE_OPTIONAL, 0, "add: where it was measured, and in which direction"),
    FIELD_TEXT(RecordsSettings, notes, 4000, PRESENCE_OPTIONAL, 0, "add: what else one should know"),
    FIELD_TEXT(RecordsSettings, q, 200, PRESENCE_OPTIONAL, 0, "list: those alone that have this text in their words"),
    FIELD_FLAG(RecordsSettings, json, false, "list and add: print what the daemon answers"),
    FIELD_REAL(RecordsSettings, wait, "s", AT_MIN(0), 0, "wait so long for a busy daemon (0)"),
    FIELD_END,
};
// clang-format on

// What is read of a record that the daemon shows; what is not there is NULL, NAN or COUNT_ABSENT.
typedef struct RecordWarning {
    char *pointer, *detail;
} RecordWarning;
typedef struct RecordReply {
    char *name, *layout;
    double interval, duration, peak, peak_time; // [s], [m/s^2]
    uint64_t count;
    List warnings; // RecordWarning
} RecordReply;
typedef struct RecordsReply {
    List records; // RecordReply
} RecordsReply;

// clang-format off
static const Field doubt_fields[] = {
    FIELD_TEXT(RecordWarning, pointer, 0, PRESENCE_OPTIONAL, 0, "place"),
    FIELD_TEXT(RecordWarning, detail, 0, PRESENCE_OPTIONAL, 0, "what is doubtful"),
    FIELD_END,
};
static const Field reply_fields[] = {
    FIELD_TEXT(RecordReply, name, 0, PRESENCE_OPTIONAL, 0, "name"),
    FIELD_TEXT(RecordReply, layout, 0, PRESENCE_OPTIONAL, 0, "of its file"),
    FIELD_REAL(RecordReply, interval, "s", ANY, OPTIONAL, "between samples"),
    FIELD_REAL(RecordReply, duration, "s", ANY, OPTIONAL, "from the first sample to the last"),
    FIELD_REAL(RecordReply, peak, "m/s^2", ANY, OPTIONAL, "largest magnitude"),
    FIELD_REAL(RecordReply, peak_time, "s", ANY, OPTIONAL, "when"),
    FIELD_COUNT(RecordReply, count, NULL, ANY, OPTIONAL, "samples"),
    {.name = "warnings", .kind = FIELD_KIND_LIST, .offset = offsetof(RecordReply, warnings),
     .fields = doubt_fields, .size = sizeof(RecordWarning), .presence = PRESENCE_OPTIONAL, .doc = "doubts"},
    FIELD_END,
};
static const Field replies_fields[] = {
    {.name = "records", .kind = FIELD_KIND_LIST, .offset = offsetof(RecordsReply, records),
     .fields = reply_fields, .size = sizeof(RecordReply), .presence = PRESENCE_OPTIONAL, .doc = "records"},
    FIELD_END,
};
// clang-format on

// A page of the list for people; the name of its last record is what the next page comes after, ""
// behind the last page.
static Status page_print(const HttpAnswer *answer, bool is_json, char after[RECORD_NAME_SIZE],
                         Problem *problem) {
    static const char *const skipped[] = {"links", NULL};
    static const PrintTableColumns columns[] = {
        {"records", {"name", "count", "interval", "duration", "peak", "source"}}, {NULL, {NULL}}};
    static const Field *const fields[] = {reply_fields, NULL};
    static const PrintTableView view = {skipped, columns, fields};
    size_t longest;
    RecordsReply reply = {{NULL, 0}};
    Status status = STATUS_OK;
    (void)json_parse(answer->body.at, answer->body.count, replies_fields, &reply, NULL);
    const RecordReply *last =
        reply.records.count > 0 ? (RecordReply *)reply.records.at + reply.records.count - 1 : NULL;
    const char *name = last != NULL && last->name != NULL ? last->name : "";
    // A server that goes in circles is followed no further.
    if (reply.records.count >= PAGE && strcmp(name, after) <= 0)
        status = problem_set(problem, STATUS_UNREACHABLE, "the list of records has no end");
    text_fit(after, RECORD_NAME_SIZE, reply.records.count >= PAGE ? name : "");
    if (status == STATUS_OK && is_json)
        api_client_print(answer);
    else if (status == STATUS_OK)
        status = print_table_print_json(answer->body.at, answer->body.count, &view, stdout,
                                        &longest, problem);
    fields_clear(replies_fields, &reply);
    return status;
}

static Status list(ApiClient *daemon, const RecordsSettings *settings, const char *operand,
                   Problem *problem) {
    char after[RECORD_NAME_SIZE] = "";
    (void)operand;
    do {
        Bytes path = {.most = 4000};
        HttpAnswer answer;
        bytes_format(&path, "/v1/records?limit=%d", PAGE);
        http_query(&path, "q", settings->q);
        http_query(&path, "after", after[0] != '\0' ? after : NULL);
        Status status =
            api_client_request(daemon, (HttpAsk){.method = "GET"}, &path, &answer, problem);
        if (status == STATUS_OK)
            status = page_print(&answer, settings->json, after, problem);
        http_answer_clear(&answer);
        TRY(status);
    } while (after[0] != '\0');
    return STATUS_OK;
}

// "I-ELC180" of "/data/I-ELC180.AT2", with dashes for what no name may have.
static void name_of(const char *path, char name[RECORD_NAME_SIZE]) {
    const char *slash = strrchr(path, '/'), *from = slash != NULL ? slash + 1 : path;
    const char *point = strrchr(from, '.');
    const size_t length = point != NULL && point > from ? (size_t)(point - from) : strlen(from);
    snprintf(name, RECORD_NAME_SIZE, "%.*s",
             (int)(length < RECORD_NAME_SIZE ? length : RECORD_NAME_SIZE - 1), from);
    for (char *c = name; *c != '\0'; c++)
        if (!((*c >= 'A' && *c <= 'Z') || (*c >= 'a' && *c <= 'z') || (*c >= '0' && *c <= '9') ||
              strchr("._-", *c) != NULL))
            *c = '-';
}

// What the daemon read from the file, and its doubts, on stderr.
static void record_report(const char *path, RecordReply *record, bool is_new) {
    const RecordWarning *warnings = record->warnings.at;
    text_make_printable(record->layout);
    fprintf(stderr, "%s: %s%s, %.0f samples, one every %.6g s; peak %.6g m/s^2 at %.6g s\n", path,
            is_new ? "" : "was there already; ", record->layout != NULL ? record->layout : "-",
            record->count == COUNT_ABSENT ? (double)NAN : (double)record->count, record->interval,
            record->peak, record->peak_time);
    for (size_t i = 0; i < record->warnings.count; i++) {
        text_make_printable(warnings[i].pointer);
        text_make_printable(warnings[i].detail);
        fprintf(stderr, "%s: warning: %s %s\n", path,
                warnings[i].pointer != NULL ? warnings[i].pointer : "",
                warnings[i].detail != NULL ? warnings[i].detail : "");
    }
}

static Status send(ApiClient *daemon, const RecordsSettings *settings, const char *path,
                   const Bytes *text, Problem *problem) {
    char name[RECORD_NAME_SIZE];
    Bytes target = {.most = 60000};
    HttpAnswer answer = {0};
    RecordReply record = {0};
    name_of(path, name);
    bytes_text(&target, "/v1/records");
    http_query(&target, "name", settings->name != NULL ? settings->name : name);
    http_query(&target, "unit",
               settings->unit == CHOICE_ABSENT ? NULL : acceleration_unit_names[settings->unit]);
    http_query(&target, "source", settings->source);
    http_query(&target, "processing", settings->processing);
    http_query(&target, "earthquake", settings->earthquake);
    http_query(&target, "station", settings->station);
    http_query(&target, "notes", settings->notes);
    http_query_real(&target, "interval", settings->interval);
    const HttpAsk ask = {.method = "POST", .body = text, .content_type = "text/plain"};
    Status status = api_client_request(daemon, ask, &target, &answer, problem);
    if (status == STATUS_OK)
        (void)json_parse(answer.body.at, answer.body.count, reply_fields, &record, NULL);
    if (status == STATUS_OK && record.name == NULL)
        status = problem_set(problem, STATUS_UNREACHABLE,
                             "the answer is no record: what answers there is no impactd");
    if (status == STATUS_OK && settings->json) {
        api_client_print(&answer);
    } else if (status == STATUS_OK) {
        record_report(scene_file_name(path), &record, answer.code == 201);
        text_make_printable(record.name);
        printf("%s\n", record.name);
    }
    fields_clear(reply_fields, &record);
    http_answer_clear(&answer);
    return status;
}

static Status add(ApiClient *daemon, const RecordsSettings *settings, const char *operand,
                  Problem *problem) {
    Bytes text;
    Status status = scene_file_read(operand, &text, problem);
    if (status == STATUS_OK)
        status = send(daemon, settings, operand, &text, problem);
    bytes_clear(&text);
    return status;
}

static Status ask_for(ApiClient *daemon, const char *method, const char *name, Problem *problem) {
    Bytes path = {.most = 4000};
    HttpAnswer answer = {0};
    bytes_text(&path, "/v1/records/");
    http_encode(&path, name);
    const Status status =
        api_client_request(daemon, (HttpAsk){.method = method}, &path, &answer, problem);
    if (status == STATUS_OK && answer.body.count > 0)
        api_client_print(&answer);
    http_answer_clear(&answer);
    return status;
}

static Status show(ApiClient *daemon, const RecordsSettings *settings, const char *operand,
                   Problem *problem) {
    (void)settings;
    return ask_for(daemon, "GET", operand, problem);
}

static Status forget(ApiClient *daemon, const RecordsSettings *settings, const char *operand,
                     Problem *problem) {
    (void)settings;
    TRY(ask_for(daemon, "DELETE", operand, problem));
    fprintf(stderr, "The record \"%s\" is deleted.\n", operand);
    return STATUS_OK;
}

static const struct Action {
    const char *name, *operand; // NULL: takes none
    Status (*act)(ApiClient *daemon, const RecordsSettings *settings, const char *operand,
                  Problem *problem);
} actions[] = {
    {"list", NULL, list},
    {"add", "a file", add},
    {"show", "the name of a record", show},
    {"delete", "the name of a record", forget},
};

static const struct Action *choose(const Options *options, Problem *problem) {
    size_t index;
    if (command_action(options, &actions->name, COUNT(actions), sizeof *actions, &index, problem) !=
        STATUS_OK)
        return NULL;
    const struct Action *action = &actions[index];
    const size_t takes = action->operand != NULL ? 2 : 1;
    if (options->operand_count == takes &&
        (takes == 1 ||
         (options->operands[1][0] != '\0' && strcmp(options->operands[1], "..") != 0)))
        return action;
    (void)problem_set(problem, STATUS_USAGE, "%s takes %s", action->name,
                      takes == 2 ? action->operand : "nothing more");
    return NULL;
}

static int records(const Command *self, void *of, const Options *options, Problem *problem) {
    const RecordsSettings *settings = of;
    const struct Action *action = choose(options, problem);
    if (action == NULL)
        return command_error(self->name, problem);
    const char *operand = action->operand != NULL ? options->operands[1] : NULL;
    ApiClient daemon;
    Status status = api_client_open(settings->server, settings->token_file, settings->ca_file,
                                    settings->wait, &daemon, problem);
    if (status == STATUS_OK)
        status = action->act(&daemon, settings, operand, problem);
    api_client_close(&daemon);
    return status == STATUS_OK
               ? COMMAND_OK
               : api_client_refuse(self->name, operand != NULL ? operand : "records", status,
                                   problem);
}

const Command command_records = {
    .name = "records",
    .operands = "list|add|show|delete [FILE-or-NAME]",
    .summary = "ground motions that a daemon keeps, for scenes to name",
    .help =
        "  impactd records add I-ELC180.AT2 --source 'PEER, RSN6' --processing 'as published'\n"
        "  impactd records add column.txt --name tabas --interval 0.02 --unit g\n"
        "  impactd records list --q elcentro\n"
        "  impactd records show I-ELC180                   all that is known of it, as JSON\n"
        "  impactd records delete I-ELC180                 if no result was made with it\n"
        "\n"
        "A scene names it: \"excitation\": {\"kind\": \"record\", \"name\": \"I-ELC180\"}. The "
        "layouts are "
        "those of\n"
        "\"impactd help import\". A record never changes: with other processing it is another one. "
        "Exit code 3\n"
        "if the file has faults, 4 if there is no such record, 1 if it is used or its name is "
        "taken.\n",
    .options = records_fields,
    .size = sizeof(RecordsSettings),
    .run = records,
};
