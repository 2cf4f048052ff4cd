// The head of a request: the headers that are kept, the refusals in the order in which they are
// tested, and the target "/path?name=value&name=value", with escapes. One block of storage holds
// the target as sent, the path as sent, the decoded queries, and room for the path's parameters.
// libmicrohttpd 0.9.75 accepts all of the refused heads by itself; it does not show a NUL in the
// request line and how a header's line ended.
#include "server/http/request.h"

#include <arpa/inet.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "core/base/spelling.h"
#include "server/http/header.h"
#include "server/json/parse.h"
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
                           "the query parameter \"%.40s\" is given twice; give it once", pair);
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
#define KEPT(name, member, is_single)                                                              \
    { name, offsetof(Request, member), is_single }
static const struct {
    const char *name;
    size_t offset;
    bool is_single; // a second one is a fault
} kept[] = {KEPT("Host", host, true),
            KEPT("Content-Type", content_type, false),
            KEPT("Accept", accept, false),
            KEPT("If-None-Match", if_none_match, false),
            KEPT("If-Range", if_range, false),
            KEPT("Range", range, false),
            KEPT("Expect", expect, false),
            KEPT("Authorization", authorization, true),
            KEPT("Accept-Encoding", accept_encoding, false),
            KEPT("Content-Encoding", content_encoding, false),
            KEPT("If-Match", if_match, false),
            KEPT("Idempotency-Key", idempotency_key, true),
            KEPT("Last-Event-ID", last_event_id, false),
            KEPT("Access-Control-Request-Method", preflight, false),
            KEPT("Content-Length", content_length, true),
            KEPT("Transfer-Encoding", transfer_encoding, false),
            KEPT("Origin", origin, false),
            KEPT("Sec-Fetch-Site", fetch_site, false)};

static bool text_has_control(const char *text, size_t size) {
    for (size_t i = 0; i < size; i++) {
        const unsigned char c = (unsigned char)text[i];
        if ((c < 0x20 && c != '\t') || c == 0x7f)
            return true;
    }
    return false;
}

// Whether every character may stand in a header's name (RFC 9110 token).
static bool text_is_token(const char *text, size_t size) {
    for (size_t i = 0; i < size; i++) {
        const unsigned char c = (unsigned char)text[i];
        const bool is_plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '-';
        if (!is_plain && (c <= 0x20 || c >= 0x7f || strchr("\"(),/:;<=>?@[\\]{}", c) != NULL))
            return false;
    }
    return size > 0;
}

void request_header(Request *request, const char *name, size_t name_size, const char *value,
                    size_t value_size) {
    if (value == NULL)
        value_size = 0;
    value = value_size > 0 ? value : "";
    const bool is_token = text_is_token(name, name_size);
    if (request->faulty[0] == '\0' && (!is_token || text_has_control(value, value_size)))
        snprintf(request->faulty, sizeof request->faulty, "%s",
                 is_token && name_size < sizeof request->faulty ? name : "a header");
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
            if (*target != NULL && kept[i].is_single)
                request->repeated = kept[i].name;
            else if (*target != NULL && target == &request->transfer_encoding)
                *target = ""; // none that is understood
            else if (*target == NULL)
                *target = value;
            return;
        }
}

static const char *const known_methods[] = {"GET",    "HEAD",    "POST", "PUT",
                                            "DELETE", "OPTIONS", "PATCH"};

static const char *const loopback[] = {"localhost", "127.0.0.1", "[::1]", NULL};
const AcceptedHosts loopback_hosts = {loopback, false, NULL};

// The size of the name in "name:port"; 0 where the port is no port. An IPv6 address has brackets.
static size_t host_name_size(const char *host, size_t size) {
    size_t name_size = 0;
    while (name_size < size && host[name_size] != ':')
        if (host[name_size++] == '[')
            while (name_size < size && host[name_size] != ']')
                name_size++;
    if (name_size == size)
        return size;
    const size_t digits = size - name_size - 1;
    for (size_t i = 0; i < digits; i++)
        if (host[name_size + 1 + i] < '0' || host[name_size + 1 + i] > '9')
            return 0;
    return digits <= 5 ? name_size : 0;
}

// Dotted decimal, or something in brackets that only an address may be.
static bool host_is_address(const char *name, size_t size) {
    char text[64];
    unsigned char ignored[16];
    const bool has_brackets = size > 2 && name[0] == '[' && name[size - 1] == ']';
    const size_t inner = has_brackets ? size - 2 : size;
    if (inner >= sizeof text)
        return false;
    memcpy(text, name + has_brackets, inner);
    text[inner] = '\0';
    return inet_pton(has_brackets ? AF_INET6 : AF_INET, text, ignored) == 1;
}

bool host_is_ours(const AcceptedHosts *hosts, const char *host) {
    const size_t size = host_name_size(host, strlen(host));
    for (size_t i = 0; size > 0 && hosts->names[i] != NULL; i++)
        if (strlen(hosts->names[i]) == size && strncasecmp(host, hosts->names[i], size) == 0)
            return true;
    return size > 0 && hosts->takes_addresses && host_is_address(host, size);
}

static int head_refuse(Problem *problem, int code, const char *detail) {
    problem_set(problem, STATUS_USAGE, "%s", detail);
    return code;
}

// Whether the path holds an escaped NUL, or a segment that becomes "." or ".." only when decoded;
// plain dot segments are refused as well, because clients take them out before sending and proxies
// differ.
static const char *target_fault(const char *target) {
    const size_t size = strcspn(target, "?");
    size_t dots = 0, others = 0;
    for (size_t i = 0; i <= size; i++) {
        if (i == size || target[i] == '/') {
            if (others == 0 && (dots == 1 || dots == 2))
                return "the path holds a dot segment; write it without \".\" and \"..\"";
            dots = others = 0;
        } else if (target[i] == '.') {
            dots++;
        } else if (target[i] == '%' && strncasecmp(target + i, "%2e", 3) == 0) {
            dots++;
            i += 2;
        } else {
            others++;
        }
    }
    return strstr(target, "%00") != NULL ? "the target holds an escaped NUL" : NULL;
}

static int head_refuse_host(const char *host, const AcceptedHosts *hosts, Problem *problem) {
    char list[256] = "", shown[64];
    for (size_t i = 0; hosts->names[i] != NULL; i++) {
        const size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s",
                 i == 0                        ? ""
                 : hosts->names[i + 1] == NULL ? " or "
                                               : ", ",
                 hosts->names[i]);
    }
    text_fit(shown, sizeof shown, host);
    problem_set(
        problem, STATUS_USAGE,
        "the Host must be %s%s, with any port, is \"%s\"; the server's --host NAME adds one", list,
        hosts->takes_addresses ? ", or an address in digits" : "", shown);
    return 421;
}

// Whether an Origin header names this server: the authority of the Host header, or a name given by
// --host or --base-url, for a proxy that changes the Host.
static bool origin_is_ours(const Request *request, const AcceptedHosts *hosts) {
    const char *mark = strstr(request->origin, "://");
    const AcceptedHosts named = {hosts->names, false, NULL};
    return mark != NULL &&
           ((request->host != NULL && strcasecmp(mark + 3, request->host) == 0) ||
            (host_is_ours(&named, mark + 3) && !host_is_ours(&loopback_hosts, mark + 3)));
}

const char *request_allowed_origin(const Request *request, const AcceptedHosts *hosts) {
    const char *const *origin = hosts->origins;
    if (request->origin == NULL || origin == NULL)
        return NULL;
    while (*origin != NULL && strcmp(*origin, request->origin) != 0)
        origin++;
    return *origin;
}

// Another site's page may send requests with the rights of this machine (CSRF); browsers mark them.
static bool request_is_from_other_site(const Request *request, const AcceptedHosts *hosts) {
    const char *method = request->method, *site = request->fetch_site;
    if (strcmp(method, "GET") == 0 || strcmp(method, "HEAD") == 0 ||
        strcmp(method, "OPTIONS") == 0 || request_allowed_origin(request, hosts) != NULL)
        return false;
    return (site != NULL &&
            (strcasecmp(site, "cross-site") == 0 || strcasecmp(site, "same-site") == 0)) ||
           (request->origin != NULL && !origin_is_ours(request, hosts));
}

int request_validate(Request *request, const AcceptedHosts *hosts, const char *target,
                     const char *version, Problem *problem) {
    const char *length = request->content_length, *encoding = request->transfer_encoding;
    const bool is_1_0 = strcmp(version, "HTTP/1.0") == 0;
    bool is_known = false;
    for (size_t i = 0; i < COUNT(known_methods) && !is_known; i++)
        is_known = strcmp(request->method, known_methods[i]) == 0;
    request->is_chunked = encoding != NULL && strcasecmp(encoding, "chunked") == 0;
    if (strcmp(version, "HTTP/1.1") != 0 && !is_1_0)
        return head_refuse(problem, 505, "this server speaks HTTP/1.1 and HTTP/1.0");
    if (!is_known)
        return head_refuse(
            problem, 501,
            "unknown method; known are GET, HEAD, POST, PUT, PATCH, DELETE and OPTIONS");
    if (target[0] != '/')
        return head_refuse(problem, 400, "the target must be a path that begins with \"/\"");
    if (strlen(target) > REQUEST_TARGET_MAX)
        return head_refuse(problem, 414, "the target is longer than 4096 bytes");
    if (text_has_control(target, strlen(target)))
        return head_refuse(problem, 400, "the target holds a control character");
    if (strchr(target, ' ') != NULL)
        return head_refuse(problem, 400, "the target holds a space; write it as %20");
    const char *fault = target_fault(target);
    if (fault != NULL)
        return head_refuse(problem, 400, fault);
    if (request->has_hidden_lines)
        return head_refuse(problem, 400,
                           "the head holds a header that is continued on a second line, a header "
                           "without a name, or blanks behind its last header");
    if (request->faulty[0] != '\0') {
        problem_set(problem, STATUS_USAGE,
                    "the head holds a control character, or a name that is none (in %s)",
                    request->faulty);
        return 400;
    }
    if (request->repeated != NULL) {
        problem_set(problem, STATUS_USAGE, "more than one %s", request->repeated);
        return 400;
    }
    if (request->host == NULL && !is_1_0)
        return head_refuse(problem, 400, "HTTP/1.1 needs a Host");
    if (request->host != NULL && !host_is_ours(hosts, request->host))
        return head_refuse_host(request->host, hosts, problem);
    if (length != NULL &&
        (length[0] == '\0' || strlen(length) > 18 || length[strspn(length, "0123456789")] != '\0'))
        return head_refuse(problem, 400, "Content-Length must be a plain number");
    if (length != NULL && encoding != NULL)
        return head_refuse(problem, 400, "Content-Length together with Transfer-Encoding");
    if (encoding != NULL && !request->is_chunked)
        return head_refuse(problem, 501, "the only Transfer-Encoding understood is \"chunked\"");
    if (encoding != NULL && is_1_0)
        return head_refuse(problem, 400, "HTTP/1.0 has no Transfer-Encoding");
    if (request_is_from_other_site(request, hosts))
        return head_refuse(
            problem, 403,
            "a page of another site may not send this: Origin must be this server's, and "
            "Sec-Fetch-Site same-origin or none");
    request->length = length != NULL ? strtoull(length, NULL, 10) : 0;
    return 0;
}

const char *request_query(const Request *request, const char *name) {
    for (size_t i = 0; i < request->query_count; i++)
        if (strcmp(request->queries[i].name, name) == 0)
            return request->queries[i].value;
    return NULL;
}

bool request_read_real(const char *text, size_t size, double *value) {
    // strtod would also take leading blanks, "inf", "nan" and hexadecimal digits: none is a number
    // here.
    char *end;
    if (size == 0 || size >= 64 || strspn(text, "0123456789+-.eE") < size)
        return false;
    *value = strtod(text, &end);
    return end >= text + size && isfinite(*value);
}

Status request_number(const Request *request, const char *name, double least, double most,
                      double initial, double *value, Problem *problem) {
    const char *text = request_query(request, name);
    double number;
    *value = initial;
    if (text == NULL)
        return STATUS_OK;
    if (!request_read_real(text, strlen(text), &number) || !(number >= least && number <= most))
        return problem_set(
            problem, STATUS_USAGE,
            "the query parameter \"%s\" must be a number within [%s, %s], is \"%.40s\"", name,
            real_text(least).at, real_text(most).at, text);
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

Status request_text(const Request *request, const char *name, const char **text, Problem *problem) {
    *text = request_query(request, name);
    if (*text != NULL && strlen(*text) > REQUEST_TEXT_MAX)
        return problem_set(problem, STATUS_USAGE,
                           "the query parameter \"%s\" may have %d bytes, has %zu", name,
                           REQUEST_TEXT_MAX, strlen(*text));
    if (*text != NULL && **text == '\0')
        *text = NULL;
    return STATUS_OK;
}

Status request_choice(const Request *request, const char *name, const char *const *names,
                      int initial, int *choice, Problem *problem) {
    const char *text;
    TRY(request_text(request, name, &text, problem));
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

Status request_read_fields(const Request *request, const Field *fields, void *item,
                           Problem *problem) {
    Status status = STATUS_OK;
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        void *member = (char *)item + field->offset;
        const char *text = request_query(request, field->name);
        if (field->kind == FIELD_KIND_BASE) {
            TRY(request_read_fields(request, field->fields, member, problem));
        } else if (field->kind == FIELD_KIND_TEXT && text != NULL && *text != '\0') {
            if (text_copy(text, (char **)member) != STATUS_OK)
                return problem_set(problem, STATUS_NO_MEMORY, "no memory for a query");
        } else if (field->kind == FIELD_KIND_CHOICE && text != NULL) {
            char pointer[80];
            int choice = 0;
            while (field->choices[choice] != NULL && strcmp(field->choices[choice], text) != 0)
                choice++;
            snprintf(pointer, sizeof pointer, "/%s", field->name);
            if (field->choices[choice] != NULL)
                *(int *)member = choice;
            else
                status = spelling_reject(field->choices, text, pointer, problem);
        }
    }
    return status;
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
    if (request->body_size == 0)
        return problem_set(problem, STATUS_UNREADABLE, "there is no body");
    return STATUS_OK;
}

Status request_require_type(const Request *request, const char *const *texts, const char *wanted,
                            const char *hint, bool *is_json, Problem *problem) {
    *is_json = header_type_is(request->content_type, "application/json");
    bool is_known = *is_json;
    for (size_t i = 0; texts[i] != NULL; i++)
        is_known = is_known || header_type_is(request->content_type, texts[i]);
    if (!is_known)
        return problem_set(
            problem, STATUS_UNSUPPORTED_TYPE, "the body must be %s, is %.60s%s", wanted,
            request->content_type != NULL ? request->content_type : "of no given type", hint);
    return request_require_body(request, problem);
}

Status request_require_json(const Request *request, Problem *problem) {
    static const char *const none[] = {NULL};
    bool is_json;
    return request_require_type(request, none, "application/json",
                                "; with curl use --json @scene.json, or -H 'Content-Type: "
                                "application/json'",
                                &is_json, problem);
}

Status request_read_document(const Request *request, const Field *fields, void *item,
                             Problem *problem) {
    if (request->query_count > 0)
        return problem_set(problem, STATUS_USAGE,
                           "a JSON body allows no query: \"%.40s\" is a member of the document",
                           request->queries[0].name);
    return json_parse(request->body, request->body_size, fields, item, problem);
}

bool request_is_empty(const Request *request) {
    return request->body_size == 0;
}

bool request_is_pretty_by_accept(const Request *request) {
    return !request->is_pretty_asked && strcmp(request->method, "GET") == 0 &&
           strncmp(request->path, "/v1/", 4) == 0;
}
