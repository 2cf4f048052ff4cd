#include "server/http/reply.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/http/header.h"
#include "server/json/encode.h"
#include "server/util/gzip.h"

#define PRETTY "-p"  // likewise of indented JSON
#define PACKED "-gz" // behind the tag of a compressed body: other bytes, another tag

const char type_json[] = "application/json";
static const char type_problem[] = "application/problem+json";
static const char no_memory[] =
    "{\"type\": \"/problems/no-memory\", \"title\": \"Out of memory\", \"status\": 503, "
    "\"detail\": \"no memory for the answer; send the request again\"}\n";

const char reply_policy[] =
    "default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
const char reply_drawing_policy[] =
    "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; "
    "form-action 'none'; frame-ancestors 'none'";
const char reply_page_policy[] =
    "default-src 'none'; script-src 'self'; style-src 'self'; font-src 'self'; "
    "img-src 'self' blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'; require-trusted-types-for 'script'; trusted-types 'none'";

void reply_default(Reply *reply) {
    memset(reply, 0, sizeof *reply);
    reply->retry_after = -1;
}

void reply_clear(Reply *reply) {
    if (reply->release != NULL)
        reply->release(reply->context);
    reply_default(reply);
}

void reply_borrow(Reply *reply, int code, const char *content_type, const void *body, size_t size) {
    reply->code = code;
    reply->content_type = content_type;
    reply->body = body;
    reply->body_size = size;
}

Status reply_bytes(Reply *reply, int code, const char *content_type, Bytes *bytes,
                   Problem *problem) {
    const bool is_failed = bytes->is_failed, is_over = bytes->is_over;
    const size_t most = bytes->most;
    size_t size = 0;
    char *body = bytes_take(bytes, &size);
    if (is_failed || body == NULL) {
        free(body);
        if (is_over)
            return problem_set(problem, STATUS_LIMIT,
                               "the answer would be larger than %zu bytes; ask for fewer "
                               "channels or a shorter time",
                               most);
        return problem_set(problem, STATUS_NO_MEMORY,
                           "no memory for the answer; what it reports may have been stored");
    }
    reply_borrow(reply, code, content_type, body, size);
    reply->release = free;
    reply->context = body;
    return STATUS_OK;
}

Status reply_json(Reply *reply, int code, Bytes *bytes, Status status, Problem *problem) {
    if (status == STATUS_OK)
        return reply_bytes(reply, code, type_json, bytes, problem);
    bytes_clear(bytes);
    return status;
}

// Puts `bytes`, which are whole, in the place of the body.
static void reply_replace_body(Reply *reply, Bytes *bytes) {
    if (reply->release != NULL)
        reply->release(reply->context);
    reply->body = reply->context = bytes_take(bytes, &reply->body_size);
    reply->release = free;
}

static bool reply_tag(Reply *reply, const Request *request, const char *text,
                      const char *cache_control) {
    snprintf(reply->etag, sizeof reply->etag, "\"%s%s\"", text, request->is_pretty ? PRETTY : "");
    snprintf(reply->cache_control, sizeof reply->cache_control, "%s", cache_control);
    return reply_is_known(reply, request);
}

bool reply_is_known(Reply *reply, const Request *request) {
    if (request->if_none_match == NULL)
        return false;
    char packed[sizeof reply->etag + 8];
    // The client may have it as it is, or packed.
    snprintf(packed, sizeof packed, "%.*s" PACKED "\"", (int)strlen(reply->etag) - 1, reply->etag);
    const bool has_plain = header_etag_matches(request->if_none_match, reply->etag);
    const bool has_packed = !has_plain && header_etag_matches(request->if_none_match, packed);
    if (!has_plain && !has_packed)
        return false;
    // The tag sent is that of the form that the client has: its cache refreshes that one.
    char etag[sizeof packed], cache_control[sizeof reply->cache_control];
    snprintf(etag, sizeof etag, "%s", has_packed ? packed : reply->etag);
    memcpy(cache_control, reply->cache_control, sizeof cache_control);
    const bool varies_by_accept = reply->varies_by_accept;
    const char *policy = reply->policy; // the cached page gets the headers of this answer
    reply_clear(reply);
    reply->policy = policy;
    text_fit(reply->etag, sizeof reply->etag, etag);
    memcpy(reply->cache_control, cache_control, sizeof cache_control);
    reply->varies_by_encoding = true; // whether it would be compressed shows only when it is made
    reply->varies_by_accept = varies_by_accept || request_is_pretty_by_accept(request);
    reply->code = 304;
    return true;
}

void reply_indent_json(Bytes *bytes, const char *text, size_t size) {
    static const char blanks[] = " \n\r\t";
    size_t depth = 0;
    bool is_flat = false; // within a list that stays on one line
    for (size_t i = 0; i < size && !bytes->is_failed; i++) {
        const char c = text[i];
        if (c == '"') {
            size_t end = i + 1;
            while (end < size && text[end] != '"')
                end += text[end] == '\\' ? 2 : 1;
            bytes_put(bytes, text + i, (end < size ? end + 1 : size) - i);
            i = end;
        } else if (c == '{' || c == '[') {
            const size_t next = i + 1 + strspn(text + i + 1, blanks);
            const bool is_empty = text[next] == '}' || text[next] == ']';
            is_flat = is_empty || (c == '[' && text[next + strcspn(text + next, "[]{")] == ']');
            depth++;
            bytes_put(bytes, &c, 1);
            if (!is_flat)
                bytes_format(bytes, "\n%*s", (int)(2 * depth), "");
        } else if (c == '}' || c == ']') {
            depth -= depth > 0;
            if (!is_flat)
                bytes_format(bytes, "\n%*s", (int)(2 * depth), "");
            is_flat = false;
            bytes_put(bytes, &c, 1);
        } else if (c == ',' && !is_flat) {
            bytes_format(bytes, ",\n%*s", (int)(2 * depth), "");
        } else if (c == ',' || c == ':') {
            bytes_put(bytes, (const char[]){c, ' '}, 2);
        } else if (strchr(blanks, c) == NULL) {
            bytes_put(bytes, &c, 1);
        }
    }
    bytes_text(bytes, "\n");
}

Status reply_indent(Reply *reply, const Request *request) {
    enum { INDENT_MAX = 64 << 20 };
    const bool is_json = reply->content_type != NULL && strstr(reply->content_type, "json") != NULL;
    if (!is_json || reply->stream.next != NULL || reply->body_size == 0)
        return STATUS_OK;
    reply->varies_by_accept = reply->varies_by_accept || request_is_pretty_by_accept(request);
    if (!request->is_pretty || reply->body_size > INDENT_MAX)
        return STATUS_OK;
    Bytes source = {0}, indented = {0}; // a body need not have a NUL behind it
    bytes_put(&source, reply->body, reply->body_size);
    if (source.at != NULL)
        reply_indent_json(&indented, source.at, source.count);
    bytes_clear(&source);
    const bool is_made = indented.count > 0;
    if (is_made)
        reply_replace_body(reply, &indented);
    bytes_clear(&indented);
    return status_made(is_made);
}

static bool reply_is_text(const char *type) {
    return type != NULL && (strncmp(type, "text/", 5) == 0 || strstr(type, "json") != NULL ||
                            strstr(type, "xml") != NULL);
}

bool reply_pack(Reply *reply, const Request *request) {
    enum { LEAST = 1024, MOST = 64 << 20 };
    if (!reply_is_text(reply->content_type) || reply->stream.next != NULL ||
        reply->body_size < LEAST || reply->code == 206 || reply->content_encoding != NULL)
        return false;
    reply->varies_by_encoding = true;
    if (reply->body_size > MOST || !header_accepts_gzip(request->accept_encoding))
        return false;
    Bytes packed = {0};
    if (!gzip_compress(&packed, reply->body, reply->body_size) ||
        packed.count >= reply->body_size) {
        bytes_clear(&packed);
        return false;
    }
    reply_replace_body(reply, &packed);
    reply->content_encoding = "gzip";
    const size_t length = strlen(reply->etag);
    if (length > 0 && length + sizeof PACKED <= sizeof reply->etag)
        memcpy(reply->etag + length - 1, PACKED "\"", sizeof PACKED + 1);
    return true;
}

bool reply_immutable(Reply *reply, const Request *request, const char *text) {
    reply->is_immutable = true;
    return reply_tag(reply, request, text, "private, max-age=31536000, immutable");
}

bool reply_tagged(Reply *reply, const Request *request, const char *text) {
    return reply_tag(reply, request, text, "no-cache");
}

Status reply_embedded(Reply *reply, const Request *request, const EmbeddedFile *file,
                      const char *content_type) {
    if (!reply_tagged(reply, request, file->digest))
        reply_borrow(reply, 200, content_type, file->bytes, file->size);
    return STATUS_OK;
}

Status reply_range(Reply *reply, const Request *request, Problem *problem) {
    if (!reply->accepts_ranges || reply->code != 200 || strcmp(request->method, "GET") != 0)
        return STATUS_OK;
    // If-Range: a part only of what the client already has the other parts of.
    if (request->if_range != NULL && strcmp(request->if_range, reply->etag) != 0)
        return STATUS_OK;
    Stream *stream = &reply->stream;
    size_t first = 0, last = 0;
    const size_t size = stream->next != NULL ? (size_t)stream->size : reply->body_size;
    switch (header_range(request->range, size, &first, &last)) {
    case RANGE_WHOLE:
        return STATUS_OK;
    case RANGE_PART:
        reply->code = 206;
        if (stream->next != NULL) {
            stream->size = last - first + 1;
            stream->cut(reply->context, first, stream->size);
        } else {
            reply->body = (const char *)reply->body + first;
            reply->body_size = last - first + 1;
        }
        snprintf(reply->content_range, sizeof reply->content_range, "bytes %zu-%zu/%zu", first,
                 last, size);
        return STATUS_OK;
    case RANGE_UNSATISFIABLE:
        break;
    }
    reply_clear(reply);
    reply->code = 416;
    snprintf(reply->content_range, sizeof reply->content_range, "bytes */%zu", size);
    return problem_set(problem, STATUS_USAGE, "the range is outside the %zu bytes there are", size);
}

void reply_link_next(const Request *request, Reply *reply, const char *name, const char *value,
                     Bytes *body) {
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
    if (bytes.is_failed)
        body->is_failed = true;
    else
        snprintf(reply->link, sizeof reply->link, "%s", bytes.at);
    bytes_clear(&bytes);
}

Status reply_format(const Request *request, size_t parameter, const ReplyFormat *at, size_t count,
                    Reply *reply, size_t *choice, Problem *problem) {
    const char *extension = request->parameters[parameter];
    const char *types[REPLY_FORMATS_MAX + 1] = {NULL};
    char names[96] = "";
    int found = -1;
    for (size_t i = 0; i < count && i < REPLY_FORMATS_MAX; i++) {
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
    if (strcmp(types[found], "image/svg+xml") == 0)
        reply->policy = reply_drawing_policy;
    *choice = (size_t)found;
    return STATUS_OK;
}

void reply_wait(Reply *reply, int wait_ms, void *keep, void (*forget)(void *keep)) {
    reply->wait_ms = wait_ms > 0 ? wait_ms : 1;
    reply->keep = keep;
    reply->forget = forget;
}

void reply_problem(Reply *reply, const Problem *problem, int code, const char *instance,
                   const char *request_id) {
    if (code == 0)
        code = encode_problem_code(problem->status);
    if (reply->release != NULL)
        reply->release(reply->context);
    reply->release = NULL;
    Bytes bytes = {.most = 1 << 20};
    encode_problem(&bytes, problem, code, instance);
    if (request_id != NULL && bytes.count > 0) {
        bytes.count--; // the closing brace
        bytes_text(&bytes, ", \"request_id\": ");
        bytes_json_string(&bytes, request_id);
        bytes_text(&bytes, "}");
    }
    bytes_text(&bytes, "\n");
    if (reply_bytes(reply, code, type_problem, &bytes, NULL) != STATUS_OK)
        reply_borrow(reply, 503, type_problem, no_memory, sizeof no_memory - 1);
    if (code == 503 && reply->retry_after < 0)
        reply->retry_after = 1;
    if (code == 401)
        reply->authenticate = "Bearer realm=\"impactd\"";
    reply->etag[0] = '\0';
    reply->cache_control[0] = '\0'; // of the answer it would have been
    reply->accepts_ranges = false;
    reply->location[0] = '\0';
    reply->preference_applied[0] = '\0';
}
