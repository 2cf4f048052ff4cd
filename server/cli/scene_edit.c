// --set and --vary: the scene's text with other values, before it is read or sent, so that a server
// and this program get the same scene. The Field row at a path decides what a value is.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/study/study.h"
#include "server/cli/command.h"
#include "server/json/document.h"
#include "server/json/parse.h"
#include "server/util/units.h"

enum { PLACE_SIZE = sizeof((Fault){0}.pointer) };

// One option, "PATH=VALUE".
typedef struct SceneEdit {
    char place[PLACE_SIZE]; // "--set PATH", for faults
    char pointer[PLACE_SIZE];
    const char *value;
} SceneEdit;

// "dampers.0.clearance=10mm", or with a JSON Pointer.
static Status scene_edit_split(const char *option, const char *text, SceneEdit *edit,
                               Problem *problem) {
    const char *equals = strchr(text, '=');
    const size_t size = equals != NULL ? (size_t)(equals - text) : 0;
    if (size == 0 || size > PLACE_SIZE - 16)
        return problem_add(problem, STATUS_USAGE, option,
                           "must be PATH=VALUE, as dampers.0.clearance=10mm, is %.100s", text);
    const bool is_pointer = text[0] == '/';
    snprintf(edit->place, sizeof edit->place, "%s %.*s", option, (int)size, text);
    snprintf(edit->pointer, sizeof edit->pointer, "%s%.*s", is_pointer ? "" : "/", (int)size, text);
    for (char *c = edit->pointer; *c != '\0' && !is_pointer; c++)
        *c = *c == '.' ? '/' : *c;
    edit->value = equals + 1;
    return STATUS_OK;
}

// The unit of a row; that of a sine's amplitude depends on its quantity.
static const char *scene_edit_unit(const Field *row, const Bytes *text) {
    if (row->unit == NULL || strcmp(row->unit, "m/s^2 or m") != 0)
        return row->unit;
    JsonDocument *scene = json_open(text);
    const char *quantity = json_get_text(json_get_object(scene, "excitation"), "quantity");
    const bool is_length = quantity != NULL && strcmp(quantity, "displacement") == 0;
    json_close(scene);
    return is_length ? "m" : "m/s^2";
}

// Appends one value as JSON: a number in the unit of the row, JSON as it is, else a text.
static Status scene_edit_value(const SceneEdit *edit, const Field *row, bool is_tag,
                               const char *unit, const char *value, Bytes *json, Problem *problem) {
    char reason[QUANTITY_REASON];
    double number;
    const bool is_number =
        !is_tag && (row->kind == FIELD_KIND_REAL || row->kind == FIELD_KIND_COUNT ||
                    row->kind == FIELD_KIND_REALS || row->kind == FIELD_KIND_ROWS);
    const bool is_json = strchr("[{\"", value[0]) != NULL || strcmp(value, "null") == 0 ||
                         strcmp(value, "true") == 0 || strcmp(value, "false") == 0;
    if (value[0] == '\0')
        return problem_add(problem, STATUS_USAGE, edit->place, "needs a value behind \"=\"");
    if (is_json)
        bytes_text(json, value);
    else if (!is_number && (is_tag || (row->fields == NULL && row->kinds == NULL) ||
                            !quantity_read(value, NULL, &number, reason)))
        bytes_json_string(json, value);
    else if (!is_number || quantity_read(value, unit, &number, reason))
        bytes_real(json, number);
    else
        return problem_add(problem, STATUS_USAGE, edit->place, "%s", reason);
    return STATUS_OK;
}

// Whether an end of a range has a unit: 1 or 0; -1 for zero and texts, where it does not matter.
static int scene_edit_has_unit(const char *value) {
    char *end;
    const double number = strtod(value, &end);
    return end == value || number == 0 ? -1 : *end != '\0';
}

// Appends {"pointer", "from", "to", "count", "spacing"} for "5mm:30mm:26" or "5mm:30mm:26:log",
// {"pointer", "values"} for "5mm,10mm".
static Status scene_edit_axis(const SceneEdit *edit, const Field *row, bool is_tag,
                              const char *unit, Bytes *json, Problem *problem) {
    static const char *const names[] = {", \"from\": ", ", \"to\": ", ", \"count\": "};
    static const Field count_row = {.kind = FIELD_KIND_COUNT};
    char value[PLACE_SIZE];
    const bool is_range = strchr(edit->value, ':') != NULL;
    bytes_text(json, "{\"pointer\": ");
    bytes_json_string(json, edit->pointer);
    bytes_text(json, is_range ? "" : ", \"values\": [");
    const char *at = edit->value;
    int has_unit = -1; // that of the values before
    for (size_t i = 0;; i++) {
        const size_t size = strcspn(at, is_range ? ":" : ",");
        const bool is_last = at[size] == '\0';
        if (size >= PLACE_SIZE)
            return problem_add(problem, STATUS_USAGE, edit->place,
                               "must have values of less than %d characters", (int)PLACE_SIZE);
        snprintf(value, sizeof value, "%.*s", (int)size, at);
        if (is_range && i == COUNT(names) && is_last && strcmp(value, "log") == 0) {
            bytes_text(json, ", \"spacing\": \"logarithmic\"");
            break;
        }
        if (is_range && (i >= COUNT(names) || (is_last && i + 1 < COUNT(names))))
            return problem_add(problem, STATUS_USAGE, edit->place,
                               "must be FROM:TO:COUNT or FROM:TO:COUNT:log, as 5mm:30mm:26, is "
                               "%.100s",
                               edit->value);
        const bool is_count = is_range && i == 2;
        if (is_count && value[strspn(value, "0123456789")] != '\0')
            return problem_add(
                problem, STATUS_USAGE, edit->place,
                "must have a whole number as its COUNT, as in 5mm:30mm:26, is %.100s", edit->value);
        bytes_text(json, is_range ? names[i] : i > 0 ? ", " : "");
        TRY(scene_edit_value(edit, is_count ? &count_row : row, !is_count && is_tag,
                             is_count ? NULL : unit, value, json, problem));
        const int marked = !is_range || is_count ? -1 : scene_edit_has_unit(value);
        if (unit != NULL && has_unit >= 0 && marked >= 0 && marked != has_unit)
            return problem_add(problem, STATUS_USAGE, edit->place,
                               "must have a unit at both ends or at none: write 5mm:30mm:26, is "
                               "%.100s",
                               edit->value);
        has_unit = marked >= 0 ? marked : has_unit;
        if (is_last)
            break;
        at += size + 1;
    }
    bytes_text(json, is_range ? "}" : "]}");
    return STATUS_OK;
}

// Sets the member of one --set or, with `axes`, appends an axis for one --vary. A text that cannot
// be read as a scene at all is left to its reader.
static Status scene_edit_one(const char *option, const char *given, Bytes *text, Bytes *axes,
                             Problem *problem) {
    SceneEdit edit;
    StudyRequest request;
    Bytes json = {0};
    char message[JSON_POINTER_MESSAGE_MAX];
    bool is_tag;
    TRY(scene_edit_split(option, given, &edit, problem));
    const bool is_read = json_parse(text->at, text->count, study_request_fields, &request, NULL) !=
                         STATUS_UNREADABLE;
    const Field *row =
        json_pointer_row(study_request_fields, &request, edit.pointer, &is_tag, message);
    const char *unit = row != NULL ? scene_edit_unit(row, text) : NULL;
    Status status = STATUS_OK;
    if (is_read && row == NULL)
        status = problem_add(problem, STATUS_USAGE, edit.place, "names no member: %s", message);
    else if (is_read && axes != NULL)
        status = scene_edit_axis(&edit, row, is_tag, unit, axes, problem);
    else if (is_read)
        status = scene_edit_value(&edit, row, is_tag, unit, edit.value, &json, problem);
    // Where null is no value of the member, it removes the member.
    const bool is_null =
        strcmp(edit.value, "null") == 0 && row != NULL && (row->flags & FIELD_NULL_IS_EMPTY) == 0;
    if (status == STATUS_OK && json.count > 0)
        status = json_edit_put(text, edit.pointer, is_null ? NULL : &json, edit.place, problem);
    bytes_clear(&json);
    study_request_clear(&request);
    return status;
}

// Makes the axes those of the scene's sweep, or of a new one in the place of any other study.
static Status scene_edit_sweep(const Bytes *axes, Bytes *text, Problem *problem) {
    JsonDocument *scene = json_open(text);
    const char *kind = json_get_text(json_get_object(scene, "study"), "kind");
    const bool is_sweep = kind != NULL && strcmp(kind, "sweep") == 0;
    json_close(scene);
    Bytes study = {0};
    bytes_format(&study, is_sweep ? "[%s]" : "{\"kind\": \"sweep\", \"axes\": [%s]}", axes->at);
    const Status status =
        json_edit_put(text, is_sweep ? "/study/axes" : "/study", &study, "--vary", problem);
    bytes_clear(&study);
    return status;
}

// Whether `later` is the kind or the model of the object that has the member `given`.
static bool scene_edit_is_kind_of(const char *later, const char *given) {
    static const char *const names[] = {"kind=", "model="};
    size_t parent = strcspn(given, "=");
    while (parent > 0 && strchr("./", given[parent - 1]) == NULL)
        parent--;
    for (size_t i = 0; i < COUNT(names) && strncmp(later, given, parent) == 0; i++)
        if (strncmp(later + parent, names[i], strlen(names[i])) == 0)
            return parent > 1;
    return false;
}

Status scene_edit(const Command *self, const void *settings, Bytes *text, Problem *problem) {
    Bytes axes = {0};
    Status status = STATUS_OK;
    for (const Field *row = self->options; row != NULL && row->kind != FIELD_KIND_END; row++) {
        const bool is_vary = strcmp(row->name, "vary") == 0;
        const bool is_edit = is_vary || strcmp(row->name, "set") == 0;
        const Texts *given = (const void *)((const char *)settings + row->offset);
        for (size_t i = 0; is_edit && i < given->count; i++) {
            // A kind decides which members there are: it is set before them, and again in its turn.
            for (size_t k = i + 1; !is_vary && k < given->count; k++)
                if (scene_edit_is_kind_of(given->at[k], given->at[i]))
                    (void)scene_edit_one("--set", given->at[k], text, NULL, NULL);
            bytes_text(&axes, axes.count > 0 ? ", " : "");
            const Status one = scene_edit_one(is_vary ? "--vary" : "--set", given->at[i], text,
                                              is_vary ? &axes : NULL, problem);
            status = status == STATUS_OK ? one : status;
        }
    }
    if (status == STATUS_OK && axes.count > 0)
        status = scene_edit_sweep(&axes, text, problem);
    bytes_clear(&axes);
    return status;
}

void scene_edit_name_axes(const Command *self, const void *settings, Problem *problem) {
    static const char prefix[] = "/study/axes/";
    for (const Field *row = self->options; row != NULL && row->kind != FIELD_KIND_END; row++) {
        const Texts *given = (const void *)((const char *)settings + row->offset);
        if (strcmp(row->name, "vary") != 0)
            continue;
        for (size_t i = 0; i < problem->count && i < PROBLEM_FAULTS; i++) {
            Fault *fault = &problem->faults[i];
            if (strncmp(fault->pointer, prefix, strlen(prefix)) != 0)
                continue;
            const size_t at = strtoul(fault->pointer + strlen(prefix), NULL, 10);
            if (at < given->count)
                snprintf(fault->pointer, sizeof fault->pointer, "--vary %.*s",
                         (int)strcspn(given->at[at], "="), given->at[at]);
        }
    }
}
