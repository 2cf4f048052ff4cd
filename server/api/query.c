// What queries select: texts, choices, ranges, formats, and the link to the next page of a list.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/spelling.h"
#include "server/api/app.h"
#include "server/http/header.h"
#include "server/json/parse.h"

Status query_text(const Request *request, const char *name, const char **text, Problem *problem) {
    *text = request_query(request, name);
    if (*text != NULL && strlen(*text) > QUERY_TEXT_MAX)
        return problem_set(problem, STATUS_USAGE,
                           "the query parameter \"%s\" may have %d bytes, has %zu", name,
                           QUERY_TEXT_MAX, strlen(*text));
    if (*text != NULL && **text == '\0')
        *text = NULL;
    return STATUS_OK;
}

Status query_choice(const Request *request, const char *name, const char *const *names, int initial,
                    int *choice, Problem *problem) {
    const char *text;
    TRY(query_text(request, name, &text, problem));
    *choice = initial;
    if (text == NULL)
        return STATUS_OK;
    char list[160] = "";
    for (int i = 0; names[i] != NULL; i++) {
        if (strcmp(names[i], text) == 0) {
            *choice = i;
            return STATUS_OK;
        }
        text_list(list, sizeof list, names[i]);
    }
    return problem_set(problem, STATUS_USAGE,
                       "the query parameter \"%s\" must be one of %s, is \"%.40s\"", name, list,
                       text);
}

// One end of a range, which may be left out. strtod alone would also take blanks, "inf" and "nan".
static bool query_read_end(const char *text, size_t size, double *value) {
    char copy[64];
    if (size == 0)
        return true;
    if (size >= sizeof copy)
        return false;
    memcpy(copy, text, size);
    copy[size] = '\0';
    char *end;
    const double number = strtod(copy, &end);
    if (copy[strspn(copy, "0123456789+-.eE")] != '\0' || *end != '\0' || !isfinite(number))
        return false;
    *value = number;
    return true;
}

Status query_range(const Request *request, const char *name, QueryRange *range, Problem *problem) {
    const char *text;
    *range = (QueryRange){(double)-INFINITY, (double)INFINITY, false};
    TRY(query_text(request, name, &text, problem));
    if (text == NULL)
        return STATUS_OK;
    const char *dots = strstr(text, "..");
    const size_t first = dots != NULL ? (size_t)(dots - text) : strlen(text);
    const char *second = dots != NULL ? dots + 2 : text;
    const bool is_read = query_read_end(text, first, &range->least) &&
                         query_read_end(second, strlen(second), &range->most) &&
                         strcmp(text, "..") != 0;
    if (!is_read || range->least > range->most)
        return problem_set(problem, STATUS_USAGE,
                           "the query parameter \"%s\" must be a number or a rising range, as "
                           "0.4..0.7, 0.4.. or ..0.7, is \"%.40s\"",
                           name, text);
    range->is_asked = true;
    return STATUS_OK;
}

bool query_range_has(const QueryRange *range, double value) {
    return !range->is_asked || (value >= range->least && value <= range->most);
}

void query_link_next(const Request *request, Reply *reply, const char *name, const char *value) {
    Bytes bytes = {.most = sizeof reply->link - 1};
    bytes_format(&bytes, "<%s?", request->path);
    for (size_t i = 0; i < request->query_count; i++)
        if (strcmp(request->queries[i].name, name) != 0) {
            bytes_format(&bytes, "%s=", request->queries[i].name);
            bytes_percent(&bytes, request->queries[i].value);
            bytes_text(&bytes, "&");
        }
    bytes_format(&bytes, "%s=", name);
    bytes_percent(&bytes, value);
    bytes_text(&bytes, ">; rel=\"next\"");
    if (!bytes.is_failed)
        snprintf(reply->link, sizeof reply->link, "%s", bytes.at);
    bytes_clear(&bytes);
}

Status query_format(const Request *request, size_t parameter, const QueryFormat *at, size_t count,
                    Reply *reply, size_t *choice, Problem *problem) {
    const char *extension = request->parameters[parameter];
    const char *types[QUERY_FORMATS_MAX + 1] = {NULL};
    char names[96] = "";
    int found = -1;
    for (size_t i = 0; i < count && i < QUERY_FORMATS_MAX; i++) {
        text_list(names, sizeof names, at[i].extension);
        types[i] = at[i].content_type;
        if (extension != NULL && strcmp(extension, at[i].extension) == 0)
            found = (int)i;
    }
    reply->varies_by_accept = extension == NULL;
    if (extension == NULL)
        found = header_accept(request->accept, types);
    if (found < 0)
        return extension != NULL
                   ? problem_set(problem, STATUS_NOT_FOUND,
                                 "there is no format \"%.20s\"; there are %s", extension, names)
                   : problem_set(problem, STATUS_NOT_ACCEPTABLE,
                                 "none of the formats fits Accept; there are %s, by extension too",
                                 names);
    if (strcmp(types[found], chart_type) == 0)
        reply->policy = reply_drawing_policy;
    *choice = (size_t)found;
    return STATUS_OK;
}

Status reply_json(Reply *reply, int code, Bytes *bytes, Status status, Problem *problem) {
    if (status == STATUS_OK)
        return reply_bytes(reply, code, type_json, bytes, problem);
    bytes_clear(bytes);
    return status;
}

Status query_copy(const Request *request, const char *name, char **target, Problem *problem) {
    const char *text = request_query(request, name);
    *target = text != NULL && *text != '\0' ? strdup(text) : NULL;
    return *target != NULL || text == NULL || *text == '\0'
               ? STATUS_OK
               : problem_set(problem, STATUS_NO_MEMORY, "no memory for a query");
}

Status query_spelled(const Request *request, const char *name, const char *pointer,
                     const char *const *names, int *choice, Problem *problem) {
    const char *text = request_query(request, name);
    for (int i = 0; text != NULL && names[i] != NULL; i++)
        if (strcmp(names[i], text) == 0) {
            *choice = i;
            return STATUS_OK;
        }
    return text == NULL ? STATUS_OK : spelling_reject(names, text, pointer, problem);
}

Status query_body_type(const Request *request, const char *const *texts, const char *wanted,
                       const char *hint, bool *is_json, Problem *problem) {
    *is_json = header_type_is(request->content_type, type_json);
    bool is_known = *is_json;
    for (size_t i = 0; texts[i] != NULL; i++)
        is_known = is_known || header_type_is(request->content_type, texts[i]);
    if (!is_known)
        return problem_set(
            problem, STATUS_UNSUPPORTED_TYPE, "the body must be %s, is %.60s%s", wanted,
            request->content_type != NULL ? request->content_type : "of no given type", hint);
    return request_require_body(request, problem);
}

Status query_read_document(const Request *request, const Field *fields, void *item,
                           Problem *problem) {
    if (request->query_count > 0)
        return problem_set(problem, STATUS_USAGE,
                           "beside JSON there is no query: \"%.40s\" is a member of the document",
                           request->queries[0].name);
    return json_parse(request->body, request->body_size, fields, item, problem);
}
