#include "server/api/query.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/util/bytes.h"

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
static bool read_end(const char *text, size_t size, double *value) {
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
    const bool is_read = read_end(text, first, &range->least) &&
                         read_end(second, strlen(second), &range->most) && strcmp(text, "..") != 0;
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
