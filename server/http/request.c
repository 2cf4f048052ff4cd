// The target of a request: "/path?name=value&name=value", with escapes. One block of storage holds
// the target as sent, the path as sent, the decoded queries, and room for the path's parameters.
#include "server/http/request.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "server/http/header.h"
#include "server/util/base_path.h"

static int hex_digit(char c) {
    if (c >= '0' && c <= '9')
        return c - '0';
    if (c >= 'a' && c <= 'f')
        return c - 'a' + 10;
    if (c >= 'A' && c <= 'F')
        return c - 'A' + 10;
    return -1;
}

bool request_decode(char *text, bool is_query) {
    char *out = text;
    for (const char *in = text; *in != '\0'; in++) {
        if (*in == '+' && is_query) {
            *out++ = ' ';
        } else if (*in == '%') {
            const int high = hex_digit(in[1]);
            const int low = high < 0 ? -1 : hex_digit(in[2]);
            if (low < 0 || high * 16 + low == 0)
                return false;
            *out++ = (char)(high * 16 + low);
            in += 2;
        } else {
            *out++ = *in;
        }
    }
    *out = '\0';
    return true;
}

static Status add_query(Request *request, char *pair, Problem *problem) {
    char *value = strchr(pair, '=');
    if (value != NULL)
        *value++ = '\0';
    else
        value = pair + strlen(pair);
    if (!request_decode(pair, true) || !request_decode(value, true))
        return problem_set(
            problem, STATUS_USAGE,
            "the query holds a broken escape; write %% and two hexadecimal digits, not 00");
    if (request_query(request, pair) != NULL)
        return problem_set(problem, STATUS_USAGE,
                           "the query parameter \"%.40s\" stands twice; give it once", pair);
    if (request->query_count == REQUEST_QUERIES)
        return problem_set(problem, STATUS_USAGE, "more than %d query parameters", REQUEST_QUERIES);
    request->queries[request->query_count++] = (RequestPair){pair, value};
    return STATUS_OK;
}

Status request_open(Request *request, const char *target, Problem *problem) {
    const size_t size = strlen(target) + 1;
    request->storage = malloc(4 * size);
    if (request->storage == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the request's target");
    char *path = request->storage + size, *queries = path + size;
    memcpy(request->storage, target, size);
    memcpy(path, target, size);
    request->target = request->storage;
    request->parameter_storage = queries + size;
    request->query_count = 0;

    char *question = strchr(path, '?');
    if (question != NULL)
        *question = '\0';
    request->path = base_path_strip(path);
    if (question == NULL)
        return STATUS_OK;
    memcpy(queries, question + 1, strlen(question + 1) + 1);
    char *next = queries;
    while (next != NULL) {
        char *pair = next;
        next = strchr(pair, '&');
        if (next != NULL)
            *next++ = '\0';
        if (*pair != '\0')
            TRY(add_query(request, pair, problem));
    }
    return STATUS_OK;
}

void request_close(Request *request) {
    free(request->storage);
    request->storage = NULL;
}

// Of these the first value is kept.
#define KEPT(name, member)                                                                         \
    { name, offsetof(Request, member) }
static const struct {
    const char *name;
    size_t offset;
} kept[] = {KEPT("Host", host),
            KEPT("Content-Type", content_type),
            KEPT("Accept", accept),
            KEPT("If-None-Match", if_none_match),
            KEPT("If-Range", if_range),
            KEPT("Range", range),
            KEPT("Expect", expect),
            KEPT("Authorization", authorization),
            KEPT("Accept-Encoding", accept_encoding),
            KEPT("Content-Encoding", content_encoding),
            KEPT("If-Match", if_match),
            KEPT("Idempotency-Key", idempotency_key),
            KEPT("Last-Event-ID", last_event_id),
            KEPT("Access-Control-Request-Method", preflight)};

void request_header(Request *request, const char *name, const char *value) {
    if (strcasecmp(name, "Prefer") == 0) {
        // One preference may stand in several headers (RFC 7240, section 2).
        const size_t used = strlen(request->prefers);
        snprintf(request->prefers + used, sizeof request->prefers - used, "%s%s",
                 used > 0 ? ", " : "", value);
        request->prefer = request->prefers;
        return;
    }
    if (strcasecmp(name, "X-Request-Id") == 0 && request->id[0] == '\0') {
        static const char allowed[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                      "0123456789._-";
        const size_t size = strlen(value);
        if (size < sizeof request->id && strspn(value, allowed) == size)
            memcpy(request->id, value, size + 1);
        return;
    }
    for (size_t i = 0; i < COUNT(kept); i++)
        if (((name[0] ^ kept[i].name[0]) & 0xDF) == 0 && strcasecmp(name, kept[i].name) == 0) {
            const char **target = (const char **)(void *)((char *)request + kept[i].offset);
            if (*target == NULL)
                *target = value;
            return;
        }
}

const char *request_query(const Request *request, const char *name) {
    for (size_t i = 0; i < request->query_count; i++)
        if (strcmp(request->queries[i].name, name) == 0)
            return request->queries[i].value;
    return NULL;
}

Status request_number(const Request *request, const char *name, double least, double most,
                      double initial, double *value, Problem *problem) {
    const char *text = request_query(request, name);
    *value = initial;
    if (text == NULL)
        return STATUS_OK;
    char *end = NULL;
    // strtod would also take leading blanks, "inf", "nan" and hexadecimal digits: none is a number
    // here.
    const bool is_plain = *text != '\0' && text[strspn(text, "0123456789+-.eE")] == '\0';
    const double number = is_plain ? strtod(text, &end) : NAN;
    char low[32], high[32];
    if (!is_plain || *end != '\0' || !(number >= least && number <= most))
        return problem_set(
            problem, STATUS_USAGE,
            "the query parameter \"%s\" must be a number within [%s, %s], is \"%.40s\"", name,
            text_real(low, least), text_real(high, most), text);
    *value = number;
    return STATUS_OK;
}

Status request_count(const Request *request, const char *name, size_t least, size_t most,
                     size_t initial, size_t *value, Problem *problem) {
    double number;
    TRY(request_number(request, name, (double)least, (double)most, (double)initial, &number,
                       problem));
    if (number != floor(number))
        return problem_set(problem, STATUS_USAGE,
                           "the query parameter \"%s\" must be a whole number, is \"%.40s\"", name,
                           request_query(request, name));
    *value = (size_t)number;
    return STATUS_OK;
}

Status request_flag(const Request *request, const char *name, bool *flag, Problem *problem) {
    const char *text = request_query(request, name);
    *flag = text != NULL && (strcmp(text, "1") == 0 || strcmp(text, "true") == 0);
    if (text == NULL || *flag || strcmp(text, "0") == 0 || strcmp(text, "false") == 0)
        return STATUS_OK;
    return problem_set(problem, STATUS_USAGE,
                       "the query parameter \"%s\" must be 1 or 0, is \"%.40s\"", name, text);
}

Status request_error_large(size_t max, Problem *problem) {
    return problem_set(problem, STATUS_TOO_LARGE,
                       "the body is larger than %zu bytes; impactd serve --max-body lets in more",
                       max);
}

Status request_require_body(const Request *request, Problem *problem) {
    const char *encoding = request->content_encoding;
    if (encoding != NULL && encoding[0] != '\0' && strcasecmp(encoding, "identity") != 0)
        return problem_set(problem, STATUS_UNSUPPORTED_TYPE,
                           "the body must be sent as it is, without Content-Encoding, is encoded "
                           "as %.60s",
                           encoding);
    if (request->is_too_large)
        return request_error_large(request->body_most, problem);
    if (request->body == NULL || request->body_size == 0)
        return problem_set(problem, STATUS_UNREADABLE, "there is no body; send the scene as JSON");
    return STATUS_OK;
}

Status request_require_json(const Request *request, Problem *problem) {
    if (!header_type_is(request->content_type, "application/json"))
        return problem_set(
            problem, STATUS_UNSUPPORTED_TYPE,
            "the body must be application/json, is %.60s; with curl use --json @scene.json, or "
            "-H 'Content-Type: application/json'",
            request->content_type != NULL ? request->content_type : "of no given type");
    return request_require_body(request, problem);
}

bool request_is_empty(const Request *request) {
    return request->body_size == 0;
}

bool request_is_pretty_by_accept(const Request *request) {
    return !request->is_pretty_asked && strcmp(request->method, "GET") == 0 &&
           strncmp(request->path, "/v1/", 4) == 0;
}
