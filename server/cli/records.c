// Ground motions: `impactd import` makes an excitation of a file; `impactd records` keeps files on
// a server, which reads and checks them.
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/excitation/recorded_motion.h"
#include "core/formats/ground_motion_text.h"
#include "server/cli/client.h"
#include "server/cli/files.h"
#include "server/db/records.h"
#include "server/json/encode.h"

#define G 9.80665 // [m/s^2]

typedef struct ImportSettings {
    double interval;
    int unit;
    double scale;
    char *output;
} ImportSettings;

static void import_report(const char *path, const GroundMotionText *import,
                          const ImportSettings *settings) {
    const RecordLook look = record_look(&import->samples, import->interval, settings->scale);
    const double peak = fmax(look.highest, -look.lowest);
    const char *unit = acceleration_unit_names[import->unit];
    command_print_line(stderr, "%s: %s, %zu samples, interval %s s, duration %.6g s; unit %s", path,
                       import->layout, import->samples.count, real_text(import->interval).at,
                       (double)(import->samples.count - 1) * import->interval, unit);
    command_print_line(
        stderr,
        "%s: peak %.6g m/s^2 (%.6g g) at %.6g s; velocity: peak %.3g m/s, at the end %.3g m/s",
        path, peak, peak / G, (double)look.peak_at * import->interval, look.peak_velocity,
        look.end_velocity);
    if (import->stated_unit == CHOICE_ABSENT && settings->unit == CHOICE_ABSENT)
        command_print_line(stderr, "%s: warning: the file states no unit, %s is assumed", path,
                           unit);
    else if (import->stated_unit != CHOICE_ABSENT && import->stated_unit != import->unit)
        command_print_line(stderr, "%s: warning: the file states %s, %s is used", path,
                           acceleration_unit_names[import->stated_unit], unit);
}

static void import_warn(const char *path, const Excitation *excitation, Problem *doubts) {
    const Span span = {0};
    excitation_record.doubt(excitation, &span, "", doubts);
    for (size_t i = 0; i < doubts->count; i++)
        command_print_line(stderr, "%s: warning: %s %s", path, doubts->faults[i].pointer + 1,
                           doubts->faults[i].detail);
}

static Status excitation_write(const ExcitationRecord *record, const char *output,
                               Problem *problem) {
    Bytes bytes = {0};
    bytes_text(&bytes, "{\"kind\": \"record\", ");
    (void)encode_members(&bytes, excitation_record.kind.fields, record, WRITE_SCENE);
    bytes_text(&bytes, "}\n");
    const Status status = bytes.is_failed
                              ? problem_set(problem, STATUS_NO_MEMORY, "no memory for it")
                              : output_put(output, &bytes, problem);
    bytes_clear(&bytes);
    return status;
}

static Status import_act(const char *path, const Bytes *text, void *of, Problem *problem) {
    const ImportSettings *settings = of;
    const GroundMotionOptions options = {.interval = settings->interval, .unit = settings->unit};
    GroundMotionText import;
    TRY(ground_motion_text_read(text->at != NULL ? text->at : "", text->count, RECORD_SAMPLES,
                                &options, &import, problem));
    char source[1000], named[2000];
    const char *name = input_name(path), *slash = strrchr(path, '/');
    snprintf(named, sizeof named, "%.200s%s%s", slash != NULL ? slash + 1 : name,
             import.header[0] != '\0' ? ": " : "", import.header);
    text_fit(source, sizeof source, named);
    ExcitationRecord record = {.excitation.variant.kind = &excitation_record.kind,
                               .samples = import.samples,
                               .interval = import.interval,
                               .scale = settings->scale,
                               .source = source};
    // Checked as a part of a scene.
    const Span span = {.duration = 1, .sample_rate = 1};
    Status status = excitation_record.complete(&record.excitation, &span, "", problem);
    if (status == STATUS_OK)
        status = excitation_write(&record, settings->output, problem);
    if (status == STATUS_OK) {
        import_report(name, &import, settings);
        problem_clear(problem);
        import_warn(name, &record.excitation, problem);
    }
    ground_motion_text_clear(&import);
    return status;
}

static int import_run(const Command *self, void *settings, const Options *options,
                      Problem *problem) {
    return input_command(self, "file", options, settings, import_act, problem);
}

typedef struct RecordsSettings {
    ClientSettings client;
    char *name, *source, *processing, *earthquake, *station, *notes, *q;
    double interval;
    int unit;
} RecordsSettings;

// clang-format off
static const Field records_fields[] = {
    CLIENT_ROWS,
    FIELD_TEXT(RecordsSettings, name, RECORD_NAME_SIZE - 1, PRESENCE_OPTIONAL, 0, "add: name for scenes (name of the file without its extension)"),
    FIELD_REAL(RecordsSettings, interval, "s", ABOVE(0), OPTIONAL, "add: time between samples, if the file does not state it"),
    FIELD_CHOICE(RecordsSettings, unit, acceleration_unit_names, OPTIONAL, "add: unit, in place of the one the file states: g, m/s^2 or cm/s^2"),
    FIELD_TEXT(RecordsSettings, source, 1000, PRESENCE_OPTIONAL, 0, "add: origin of the file"),
    FIELD_TEXT(RecordsSettings, processing, 1000, PRESENCE_OPTIONAL, 0, "add: processing, such as filters and baseline correction"),
    FIELD_TEXT(RecordsSettings, earthquake, 200, PRESENCE_OPTIONAL, 0, "add: earthquake"),
    FIELD_TEXT(RecordsSettings, station, 200, PRESENCE_OPTIONAL, 0, "add: station and direction"),
    FIELD_TEXT(RecordsSettings, notes, 4000, PRESENCE_OPTIONAL, 0, "add: remarks"),
    FIELD_TEXT(RecordsSettings, q, 200, PRESENCE_OPTIONAL, 0, "list: only records with this text"),
    FIELD_FLAG(ClientSettings, json, false, "list and add: print the answer of the server as JSON"),
    FIELD_REAL(ClientSettings, wait, "s", AT_MIN(0), 0, "how long to wait for a busy server (0)"),
    FIELD_END,
};
// clang-format on

// "I-ELC180" of "/data/I-ELC180.AT2", with dashes for characters that a name may not have.
static void record_name(const char *path, char name[RECORD_NAME_SIZE]) {
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

// Adds the ground motion of a file to a database that only this process has.
static Status record_file_add(Db *db, const char *path, int unit, Problem *problem) {
    char name[RECORD_NAME_SIZE];
    const GroundMotionOptions options = {.interval = (double)NAN, .unit = unit};
    GroundMotionText motion = {0};
    Bytes text = {0};
    bool is_there;
    record_name(path, name);
    Status status = input_read(path, &text, problem);
    if (status == STATUS_OK)
        status = ground_motion_text_read(text.at != NULL ? text.at : "", text.count, RECORD_SAMPLES,
                                         &options, &motion, problem);
    RecordRow row = {.name = strdup(name),
                     .layout = motion.layout != NULL ? strdup(motion.layout) : NULL,
                     .interval = motion.interval};
    if (status == STATUS_OK &&
        (row.name == NULL || row.layout == NULL ||
         record_row_measure(&row, &motion.samples, motion.unit) != STATUS_OK))
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for the record");
    if (status == STATUS_OK)
        status = db_record_add(db, &row, &motion.samples, &is_there, problem);
    record_row_clear(&row);
    ground_motion_text_clear(&motion);
    bytes_clear(&text);
    return status;
}

Status record_files_add(Db *db, const RecordFiles *files, Problem *problem) {
    const Texts *paths = &files->record;
    for (size_t i = 0; i < paths->count; i++) {
        const Status status = record_file_add(db, paths->at[i], files->unit, problem);
        if (status == STATUS_OK)
            continue;
        command_print_faults(paths->at[i], ", ", "", problem);
        problem_clear(problem);
        return problem_add(problem, status, "--record", "%.200s is not read as a ground motion",
                           paths->at[i]);
    }
    return STATUS_OK;
}

static void record_report(const char *path, const JsonDocument *record, bool is_new) {
    const char *layout = json_get_text(record, "layout");
    const JsonDocument *warning;
    command_print_line(stderr, "%s: %s%s, %.0f samples, interval %.6g s; peak %.6g m/s^2 at %.6g s",
                       path, is_new ? "" : "already stored; ", layout != NULL ? layout : "-",
                       json_get_number(record, "count"), json_get_number(record, "interval"),
                       json_get_number(record, "peak"), json_get_number(record, "peak_time"));
    for (size_t i = 0; (warning = json_get_item(record, "warnings", i)) != NULL; i++) {
        const char *pointer = json_get_text(warning, "pointer");
        const char *detail = json_get_text(warning, "detail");
        command_print_line(stderr, "%s: warning: %s %s", path, pointer != NULL ? pointer : "",
                           detail != NULL ? detail : "");
    }
}

static Status records_add(ApiCall *call, Problem *problem) {
    const RecordsSettings *settings = call->settings;
    const char *path = call->operands[0];
    char name[RECORD_NAME_SIZE];
    TRY(input_read(path, &call->body, problem));
    record_name(path, name);
    ApiRequest request = {
        .method = "POST", .path = api_path("/v1/records"), .content_type = "text/plain"};
    api_query(&request.path, "name", settings->name != NULL ? settings->name : name);
    api_query_options(&request.path, call,
                      "unit source processing earthquake station notes interval");
    TRY(api_ask(call, &request, problem));
    const JsonDocument *record = api_reply(call);
    if (json_get_text(record, "name") == NULL)
        return api_unexpected(call, "a record", problem);
    if (settings->client.json) {
        return api_print(call, problem);
    }
    record_report(input_name(path), record, call->answer.code == 201);
    printf("%s\n", json_get_text(record, "name"));
    return STATUS_OK;
}

static Status records_show(ApiCall *call, Problem *problem) {
    TRY(api_send(call, problem));
    if (json_get_text(api_reply(call), "name") == NULL)
        return api_unexpected(call, "a record", problem);
    return api_print(call, problem);
}

static Status records_delete(ApiCall *call, Problem *problem) {
    TRY(api_send(call, problem));
    command_print_line(stderr, "The record \"%s\" is deleted.", call->operands[0]);
    return STATUS_OK;
}

// clang-format off
static const ApiAction records_actions[] = {
    {"list", "no operand", "", api_show, NULL, "/v1/records?limit=500", "q", NULL, NULL, "records"},
    {"add", "a file", "f", records_add, NULL, NULL, NULL, NULL, NULL, NULL},
    {"show", "the name of a record", "t", records_show, NULL, "/v1/records/{}", NULL, NULL, NULL, NULL},
    {"delete", "the name of a record", "t", records_delete, "DELETE", "/v1/records/{}", NULL, NULL, NULL, NULL},
    {.name = NULL},
};
// clang-format on

static const PrintTableView records_view = {
    .skipped = (const char *const[]){"links", NULL},
    .lists =
        (const PrintTableColumns[]){
            {"records", {"name", "count", "interval", "duration", "peak", "source"}},
            {NULL, {NULL}}},
    .fields = (const Field *const[]){
        (const Field[]){{.name = "interval", .kind = FIELD_KIND_REAL, .unit = "s"},
                        {.name = "duration", .kind = FIELD_KIND_REAL, .unit = "s"},
                        {.name = "peak", .kind = FIELD_KIND_REAL, .unit = "m/s^2"},
                        FIELD_END},
        NULL}};

// clang-format off
static const Field import_fields[] = {
    FIELD_REAL(ImportSettings, interval, "s", ABOVE(0), OPTIONAL, "time between samples, if the file does not state it"),
    FIELD_CHOICE(ImportSettings, unit, acceleration_unit_names, OPTIONAL, "unit, in place of the one the file states: g, m/s^2 or cm/s^2"),
    FIELD_REAL(ImportSettings, scale, NULL, ANY, 1, "factor on the samples"),
    FIELD_TEXT(ImportSettings, output, 4000, PRESENCE_OPTIONAL, 0, "write to this file"),
    FIELD_END,
};
// clang-format on

const Command command_import = {
    .name = "import",
    .operands = "FILE",
    .summary = "convert a ground motion file to an excitation",
    .help = "  impactd import motion.AT2                   # print an excitation for a scene\n"
            "  impactd import motion.AT2 -o motion.json\n"
            "  impactd import column.txt --interval 0.02 --unit g\n"
            "  impactd import motion.AT2 --scale 2         # double the acceleration\n"
            "  impactd import - < motion.AT2               # from standard input\n"
            "\n"
            "Formats: PEER AT2, old and new; a count and an interval before one column; times\n"
            "and accelerations in two columns; accelerations alone. Blanks separate columns.\n"
            "--interval and --unit are needed if the file does not state them. A summary is\n"
            "printed on standard error. The acceleration in a table with commas, as\n"
            "\"impactd run -o out.csv\" writes it:\n"
            "\n"
            "  cut -d , -f 1,4 out.csv | tr , ' ' | impactd import - -o motion.json\n"
            "\n"
            "Exit code 3 if the file has faults.\n",
    .options = import_fields,
    .size = sizeof(ImportSettings),
    .run = import_run,
};

const Command command_records = {
    .name = "records",
    .operands = "list|add|show|delete [FILE-or-NAME]",
    .summary = "ground motions of a server, for scenes to name",
    .help = "  impactd records add I-ELC180.AT2 --source 'PEER, RSN6'\n"
            "  impactd records add column.txt --name tabas --interval 0.02 --unit g\n"
            "  impactd records list --q elcentro\n"
            "  impactd records show I-ELC180\n"
            "  impactd records delete I-ELC180             # if no result uses it\n"
            "\n"
            "In a scene: \"excitation\": {\"kind\": \"record\", \"name\": \"I-ELC180\"}. \"impactd "
            "help\n"
            "import\" lists the formats. A record never changes; add a processed version under\n"
            "another name. Exit code 3 if the file has faults, 4 if there is no such record,\n"
            "1 if it is in use or its name is taken.\n",
    .options = records_fields,
    .size = sizeof(RecordsSettings),
    .run = api_command,
    .actions = records_actions,
    .view = &records_view,
};
