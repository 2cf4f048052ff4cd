// Into what is kept while the request sleeps, for a body is gone by then.
#include "server/api/compare_upload.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/spelling.h"
#include "core/excitation/recorded_motion.h"
#include "core/formats/ground_motion_text.h"
#include "server/http/header.h"
#include "server/http/reply.h"
#include "server/json/parse.h"

const char *const statistic_names[] = {"acceleration", "velocity", "displacement", NULL};
const char *const align_names[] = {"given", "auto", NULL};

// clang-format off
static const Field measured_fields[] = {
    FIELD_REALS(MeasuredUpload, samples, NULL, ANY, RECORD_SAMPLES, PRESENCE_REQUIRED, "what was measured, in SI units"),
    FIELD_REAL(MeasuredUpload, interval, "s", WITHIN(1e-9, 1e6), REQUIRED, "from one sample to the next"),
    FIELD_REAL(MeasuredUpload, start, "s", WITHIN(-1e9, 1e9), 0, "time of the first sample; the result's first is at 0"),
    FIELD_CHOICE(MeasuredUpload, quantity, statistic_names, QUANTITY_ACCELERATION, "what was measured"),
    FIELD_END
};

static const Field request_fields[] = {
    FIELD_TEXT(MeasuredRequest, a, 80, PRESENCE_REQUIRED, 0, "a result or a finished job"),
    FIELD_TEXT(MeasuredRequest, channel, 64, PRESENCE_OPTIONAL, 0, "the result's channel; if absent the quantity's, or for an acceleration mean_acceleration where that alone was sampled"),
    FIELD_ITEM(MeasuredRequest, measured, measured_fields, NULL, PRESENCE_DEFAULT, "the measurement"),
    FIELD_CHOICE(MeasuredRequest, align, align_names, ALIGN_GIVEN, "given: by shift; auto: the shift at which both correlate best"),
    FIELD_REAL(MeasuredRequest, shift, "s", WITHIN(-1e9, 1e9), 0, "that the measured samples are moved by to later times, under given"),
    FIELD_REAL(MeasuredRequest, most_shift, "s", ABOVE(0), OPTIONAL, "under auto, within which it is sought; anywhere if absent"),
    FIELD_END
};
// clang-format on

void measured_upload_free(void *asked) {
    if (asked != NULL)
        fields_clear(request_fields, asked);
    free(asked);
}

static Status read_document(const Request *request, MeasuredRequest *asked, Problem *problem) {
    if (request->query_count > 0)
        return problem_set(problem, STATUS_USAGE,
                           "beside JSON there is no query: \"%.40s\" is a member of the document",
                           request->queries[0].name);
    return json_parse(request->body, request->body_size, request_fields, asked, problem);
}

static Status read_name(const Request *request, const char *name, char **target, Problem *problem) {
    const char *text = request_query(request, name);
    *target = text != NULL && *text != '\0' ? strdup(text) : NULL;
    return *target == NULL && text != NULL && *text != '\0'
               ? problem_set(problem, STATUS_NO_MEMORY, "no memory for the measurement")
               : STATUS_OK;
}

static Status read_choice(const Request *request, const char *name, const char *pointer,
                          const char *const *names, int *choice, Problem *problem) {
    const char *text = request_query(request, name);
    for (int i = 0; text != NULL && names[i] != NULL; i++)
        if (strcmp(names[i], text) == 0) {
            *choice = i;
            return STATUS_OK;
        }
    return text == NULL ? STATUS_OK : spelling_reject(names, text, pointer, problem);
}

// The table; `text` is the caller's.
static Status read_table(const char *text, size_t size, const GroundMotionOptions *wanted,
                         MeasuredRequest *asked, Problem *problem) {
    GroundMotionText import = {0};
    Problem *fault = calloc(1, sizeof *fault);
    if (fault == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the measurement");
    const Status status =
        ground_motion_text_read(text, size, RECORD_SAMPLES, wanted, &import, fault);
    if (status != STATUS_OK && fault->count > 0) // its places are lines, no pointers
        (void)problem_add(problem, status, "", "%s: %s", fault->faults[0].pointer,
                          fault->faults[0].detail);
    else if (status != STATUS_OK)
        (void)problem_set(problem, status, "%s", fault->detail);
    free(fault);
    asked->measured.samples = import.samples;
    asked->measured.interval = import.interval;
    asked->measured.start = import.start;
    import.samples = (Reals){NULL, 0};
    ground_motion_text_clear(&import);
    return status;
}

// A table of accelerations as `impactd import` reads them, and everything else in the query.
static Status read_text(const Request *request, MeasuredRequest *asked, Problem *problem) {
    GroundMotionOptions wanted = {.interval = (double)NAN, .unit = CHOICE_ABSENT};
    TRY(read_name(request, "a", &asked->a, problem));
    TRY(read_name(request, "channel", &asked->channel, problem));
    TRY(read_choice(request, "align", "/align", align_names, &asked->align, problem));
    TRY(read_choice(request, "unit", "/unit", acceleration_unit_names, &wanted.unit, problem));
    TRY(request_number(request, "shift", -1e9, 1e9, 0, &asked->shift, problem));
    TRY(request_number(request, "most_shift", 1e-12, 1e9, (double)NAN, &asked->most_shift,
                       problem));
    TRY(request_number(request, "interval", 1e-9, 1e6, (double)NAN, &wanted.interval, problem));
    char *text = malloc(request->body_size + 1);
    if (text == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the measurement");
    memcpy(text, request->body, request->body_size + 1);
    // In text/csv a comma parts two cells; elsewhere it might be a decimal one and is a fault.
    const bool has_commas = header_type_is(request->content_type, "text/csv");
    for (size_t i = 0; has_commas && i < request->body_size; i++)
        if (text[i] == ',')
            text[i] = ' ';
    const Status status = read_table(text, request->body_size, &wanted, asked, problem);
    free(text);
    return status;
}

static Status require_type(const Request *request, bool *is_text, Problem *problem) {
    *is_text = header_type_is(request->content_type, "text/csv") ||
               header_type_is(request->content_type, "text/plain");
    if (!*is_text && !header_type_is(request->content_type, type_json))
        return problem_set(
            problem, STATUS_UNSUPPORTED_TYPE,
            "the body must be application/json, or a table of times and accelerations as text/csv "
            "or text/plain with ?a=RESULT, is %.60s",
            request->content_type != NULL ? request->content_type : "of no given type");
    return *is_text ? request_require_body(request, problem)
                    : request_require_json(request, problem);
}

Status measured_upload_read(const Request *request, MeasuredRequest **made, Problem *problem) {
    bool is_text;
    TRY(require_type(request, &is_text, problem));
    MeasuredRequest *asked = *made = calloc(1, sizeof *asked);
    if (asked == NULL || fields_default(request_fields, asked) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the measurement");
    TRY(is_text ? read_text(request, asked, problem) : read_document(request, asked, problem));
    TRY(fields_validate(request_fields, asked, "", problem));
    if (asked->measured.samples.count < MEASURED_MIN)
        return problem_add(problem, STATUS_INVALID, "/measured/samples",
                           "must be at least %d samples, are %zu", MEASURED_MIN,
                           asked->measured.samples.count);
    return STATUS_OK;
}
