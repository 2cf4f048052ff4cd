// Headers and bodies are counted as they arrive, nothing is unpacked, and only http and https are
// used. The token would go with a redirect: none is followed but one of a GET on the same server.
#include "server/cli/client.h"

#include <assert.h>
#include <curl/curl.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/scene/material.h"
#include "server/api/app.h"
#include "server/cli/files.h"
#include "server/cli/report.h"
#include "server/db/records.h"
#include "server/http/header.h"
#include "server/util/clock.h"

enum {
    DOCUMENT_MAX = 64 << 20, // [B] of a body that is kept in memory
    HEADERS_MAX = 64 << 10,  // [B] of all headers of a response
    SILENCE = 60,            // [s] without a byte, after which a request fails
    TOKEN_MAX = 512,
    PATH_BYTES = 60000,
    PAGES_MAX = 10000, // of one list
};
static const double forever = 1e9; // [s]

static const char token_characters[] =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~+/=";

// Reads the start of a file into `text`. The file that is checked is the one that is read.
static Status token_file_read(const char *path, char *text, size_t size, Problem *problem) {
    const int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (file < 0)
        return problem_add(problem, STATUS_USAGE, "--token-file", "%.200s cannot be read: %s", path,
                           strerror(errno));
    struct stat facts;
    Status status = STATUS_OK;
    if (fstat(file, &facts) != 0 || !S_ISREG(facts.st_mode))
        status = problem_add(problem, STATUS_USAGE, "--token-file", "%.200s must be a regular file",
                             path);
    else if ((facts.st_mode & 077) != 0)
        status = problem_add(problem, STATUS_USAGE, "--token-file",
                             "%.160s can be read or written by others (mode %03o); correct it by: "
                             "chmod 600 FILE",
                             path, (unsigned)(facts.st_mode & 0777));
    const ssize_t count = status == STATUS_OK ? read(file, text, size - 1) : 0;
    (void)close(file);
    text[count > 0 ? count : 0] = '\0';
    return status;
}

// The bearer token: the first line of the file `path`, or of IMPACTD_TOKEN if that is NULL; "" if
// there is neither. It is never an argument, which every user of a machine can see, and never part
// of a message.
static Status token_read(const char *path, char *token, size_t size, Problem *problem) {
    const char *given = getenv("IMPACTD_TOKEN");
    if (path != NULL)
        TRY(token_file_read(path, token, size, problem));
    else
        text_fit(token, size, given != NULL ? given : "");
    token[strcspn(token, "\r\n")] = '\0';
    if (strlen(token) <= TOKEN_MAX && token[strspn(token, token_characters)] == '\0' &&
        (path == NULL || token[0] != '\0'))
        return STATUS_OK;
    return problem_add(problem, STATUS_USAGE, path != NULL ? "--token-file" : "IMPACTD_TOKEN",
                       "must hold a token: 1 to %d letters, digits and -._~+/= on its first line",
                       TOKEN_MAX);
}

static Status url_check(ApiCall *call, Problem *problem) {
    const char *url = call->url;
    char *host = NULL;
    call->is_tls = strncasecmp(url, "https://", 8) == 0;
    CURLU *parsed = curl_url();
    const bool is_valid = (call->is_tls || strncasecmp(url, "http://", 7) == 0) &&
                          strpbrk(url, "@?#") == NULL && parsed != NULL &&
                          curl_url_set(parsed, CURLUPART_URL, url, 0) == CURLUE_OK &&
                          curl_url_get(parsed, CURLUPART_HOST, &host, 0) == CURLUE_OK;
    if (is_valid)
        call->is_loopback =
            strcasecmp(host, "localhost") == 0 || strcmp(host, "[::1]") == 0 ||
            (strncmp(host, "127.", 4) == 0 && host[strspn(host, "0123456789.")] == '\0');
    curl_free(host);
    curl_url_cleanup(parsed);
    return is_valid ? STATUS_OK
                    : problem_add(problem, STATUS_USAGE,
                                  ((const ClientSettings *)call->settings)->server != NULL
                                      ? "--server"
                                      : "IMPACTD_SERVER",
                                  "must be like http://127.0.0.1:8080 or https://HOST/PATH: only "
                                  "http and https are supported, without user, query, fragment, "
                                  "blanks and control characters; a token is read from "
                                  "IMPACTD_TOKEN or --token-file; is %.120s",
                                  url);
}

static const char *setting(const char *given, const char *name, const char *fallback) {
    const char *found = given != NULL ? given : getenv(name);
    return found != NULL && found[0] != '\0' ? found : fallback;
}

Status api_open(ApiCall *call, Problem *problem) {
    const ClientSettings *settings = call->settings;
    output_guard();
    call->until_ns = clock_monotonic_ns() + (int64_t)(1e9 * fmin(settings->wait, forever));
    TRY(token_read(setting(settings->token_file, "IMPACTD_TOKEN_FILE", NULL), call->token,
                   sizeof call->token, problem));
    call->url = strdup(setting(settings->server, "IMPACTD_SERVER", "http://127.0.0.1:8080"));
    call->curl = curl_easy_init();
    if (call->url == NULL || call->curl == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory");
    TRY(url_check(call, problem));
    for (char *end = strchr(call->url, '\0'); end > call->url && end[-1] == '/'; end--)
        end[-1] = '\0';
    if (api_exposes_token(call))
        command_print_line(stderr, "impactd: warning: the token is sent unencrypted to %s",
                           call->url);
    return STATUS_OK;
}

void api_close(ApiCall *call) {
    curl_easy_cleanup(call->curl);
    free(call->url);
    bytes_clear(&call->body);
    bytes_clear(&call->answer.body);
    json_close(call->reply);
}

double api_left(const ApiCall *call) {
    return fmax(0, 1e-9 * (double)(call->until_ns - clock_monotonic_ns()));
}

bool api_exposes_token(const ApiCall *call) {
    return call->token[0] != '\0' && !call->is_tls && !call->is_loopback;
}

char api_operand_kind(const ApiAction *action, size_t index) {
    const char *kind = action->operands;
    for (; *kind == '?' || (index > 0 && *kind != '\0'); kind++)
        index -= *kind != '?';
    return *kind;
}

static bool number_is_valid(const char *text) {
    const size_t size = strlen(text);
    return size > 0 && size < 10 && text[0] != '0' && strspn(text, "0123456789") == size;
}

static bool operand_is_valid(char kind, const char *text) {
    static_assert(MATERIAL_SLUG_MAX == 63, "a message states it");
    const size_t length = strcspn(text, "@");
    const bool has_revision = text[length] == '@';
    char slug[MATERIAL_SLUG_MAX + 2];
    switch (kind) {
    case 'i':
        return api_is_id(text);
    case 'n':
        return number_is_valid(text);
    case 't':
        return text[0] != '\0' && strcmp(text, "..") != 0;
    case 'p':
    case 'f':
        return true;
    default:
        snprintf(slug, sizeof slug, "%.*s", (int)length, text);
        return material_slug_is_valid(slug) && (has_revision ? kind != 's' : kind != 'v') &&
               (!has_revision || number_is_valid(text + length + 1));
    }
}

static Status operands_check(const ApiCall *call, Problem *problem) {
    const ApiAction *action = call->action;
    const size_t min = strcspn(action->operands, "?");
    const size_t max = strlen(action->operands) - (action->operands[min] == '?');
    const char *name = action->name != NULL ? action->name : "";
    if (call->count < min || call->count > max)
        return problem_set(problem, STATUS_USAGE, "%s%stakes %s, is given %zu operands", name,
                           name[0] != '\0' ? " " : "", action->takes, call->count);
    for (size_t i = 0; i < call->count; i++) {
        const char kind = api_operand_kind(action, i);
        if (!operand_is_valid(kind, call->operands[i]))
            return problem_set(
                problem, STATUS_USAGE, "%s%stakes %s, is given \"%.80s\"%s", name,
                name[0] != '\0' ? " " : "", action->takes, call->operands[i],
                strchr("srvn", kind) == NULL
                    ? ""
                    : "; SLUG is 1 to 63 lower-case letters, digits, underscores and "
                      "dashes, REVISION is a whole number from 1");
    }
    size_t offset = 0;
    const Field *row =
        action->needs != NULL ? fields_find(call->command->options, action->needs, &offset) : NULL;
    if (row != NULL && field_is_absent(row, (const char *)call->settings + offset)) {
        char option[OPTION_NAME];
        (void)option_spell(row, option);
        return problem_add(problem, STATUS_USAGE, option, "is required for %s: %s", name, row->doc);
    }
    return STATUS_OK;
}

int api_command(const Command *self, void *settings, const Options *options, Problem *problem) {
    const ApiAction *actions = self->actions;
    ApiCall call = {.command = self,
                    .settings = settings,
                    .operands = options->operands,
                    .count = options->operand_count};
    size_t index = 0;
    if (actions[0].name != NULL) {
        if (command_action(options, &actions->name, sizeof *actions, &index, problem) != STATUS_OK)
            return command_error(self->name, problem);
        call.operands++;
        call.count--;
    }
    call.action = &actions[index];
    if (operands_check(&call, problem) != STATUS_OK)
        return command_error(self->name, problem);
    call.about = call.count > 0 ? call.operands[0] : self->name;
    Status status = api_open(&call, problem);
    if (status == STATUS_OK)
        status = call.action->act(&call, problem);
    api_close(&call);
    if (status == STATUS_OK)
        return COMMAND_OK;
    // Faults of options and of the environment are at their names.
    const char *pointer = problem->count > 0 ? problem->faults[0].pointer : "";
    if (status == STATUS_USAGE && (pointer[0] == '-' || pointer[0] == 'I'))
        return command_error(self->name, problem);
    scene_edit_name_axes(self, call.settings, problem);
    command_print_faults(input_name(call.about), ": ", "\"", problem);
    return command_exit(status);
}

// One exchange with the server.
typedef struct Transfer {
    ApiCall *call;
    const ApiRequest *request;
    Problem *problem;
    Status status;     // not STATUS_OK: why the response was refused
    size_t headers;    // [B] so far
    uint64_t received; // [B] of the body so far
    bool is_redirected;
    uint64_t continue_from; // [B] that an earlier response had; 0: this is the first
} Transfer;

static Status transfer_refuse(Transfer *transfer, const char *what, uint64_t max) {
    return transfer->status = problem_set(transfer->problem, STATUS_UNREACHABLE,
                                          "%s sends more than %llu bytes of %s; is the server "
                                          "really impactd?",
                                          transfer->call->url, (unsigned long long)max, what);
}

// The value of a header of the response, "" if it has none.
static const char *header_get(const Transfer *transfer, const char *name) {
    struct curl_header *header;
    return curl_easy_header(transfer->call->curl, name, 0, CURLH_HEADER, -1, &header) == CURLHE_OK
               ? header->value
               : "";
}

static void headers_read(const Transfer *transfer) {
    ApiAnswer *answer = &transfer->call->answer;
    curl_off_t seconds = 0;
    const char *etag = header_get(transfer, "ETag"), *link = header_get(transfer, "Link");
    const bool has_next = strstr(link, "rel=\"next\"") != NULL || strstr(link, "rel=next") != NULL;
    const char *query = has_next ? strchr(link, '?') : NULL;
    text_fit(answer->etag, sizeof answer->etag, etag[0] == '"' ? etag : "");
    if (query != NULL)
        snprintf(answer->next, sizeof answer->next, "%.*s", (int)strcspn(query, ">"), query);
    (void)curl_easy_getinfo(transfer->call->curl, CURLINFO_RETRY_AFTER, &seconds);
    answer->retry_after = seconds > 86400 ? 86400 : (int)seconds;
}

// Another program may answer anything with 200: nothing of it is written.
static bool transfer_check_type(Transfer *transfer) {
    const char *wanted = transfer->request->type, *type = header_get(transfer, "Content-Type");
    char shown[60];
    if (wanted == NULL || header_type_is(type, wanted))
        return true;
    text_fit(shown, sizeof shown, type[0] != '\0' ? type : "of no type");
    text_make_printable(shown);
    transfer->status = problem_set(transfer->problem, STATUS_UNREACHABLE,
                                   "the answer is %s, not %s; is the server at %.200s really "
                                   "impactd?",
                                   shown, wanted, transfer->call->url);
    return false;
}

static size_t header_count(char *line, size_t one, size_t count, void *context) {
    Transfer *transfer = context;
    (void)line;
    transfer->headers += one * count;
    if (transfer->headers <= HEADERS_MAX)
        return one * count;
    (void)transfer_refuse(transfer, "headers", HEADERS_MAX);
    return 0;
}

static size_t body_read(char *piece, size_t one, size_t count, void *context) {
    Transfer *transfer = context;
    const uint64_t max = transfer->request->output_max;
    const size_t size = one * count;
    Bytes *body = &transfer->call->answer.body;
    long code = 0;
    (void)curl_easy_getinfo(transfer->call->curl, CURLINFO_RESPONSE_CODE, &code);
    if (transfer->received == 0) // a body that is cut off is continued by its ETag
        headers_read(transfer);
    if (max == 0 || (code != 200 && code != 206)) {
        bytes_put(body, piece, size);
        if (body->is_failed)
            (void)transfer_refuse(transfer, "a document", DOCUMENT_MAX);
    } else if (transfer->received == 0 && !transfer_check_type(transfer)) {
        return 0;
    } else if (size > max - transfer->received) {
        transfer->status =
            problem_set(transfer->problem, STATUS_TOO_LARGE, "the answer is larger than %llu bytes",
                        (unsigned long long)max);
    } else {
        transfer->status = output_write(piece, size, transfer->problem);
        transfer->received += size;
    }
    return transfer->status == STATUS_OK ? size : 0;
}

static Status transfer_failed(const Transfer *transfer, CURLcode code) {
    static const struct {
        CURLcode code;
        const char *what, *hint;
    } rows[] = {
        {CURLE_COULDNT_CONNECT, "no server answers at", NULL},
        {CURLE_COULDNT_RESOLVE_HOST, "no server answers at", NULL},
        {CURLE_COULDNT_RESOLVE_PROXY, "no server answers at", NULL},
        {CURLE_SSL_CONNECT_ERROR, "TLS connection failed to",
         "; if the server speaks plain HTTP, name it as http://"},
        {CURLE_PEER_FAILED_VERIFICATION, "there is no trust in the certificate of",
         "; --ca-file FILE names the certificate that signed it"},
        {CURLE_SSL_CACERT_BADFILE, "there is no trust in the certificate of",
         "; --ca-file FILE names the certificate that signed it"},
        {CURLE_UNSUPPORTED_PROTOCOL, "HTTP is not spoken by the server at", ""},
        {CURLE_WEIRD_SERVER_REPLY, "HTTP is not spoken by the server at", ""},
        {CURLE_OPERATION_TIMEDOUT, "no answer for too long from", ""},
        {CURLE_OUT_OF_MEMORY, "no memory for an answer of", ""},
    };
    const ApiCall *call = transfer->call;
    const char *what = "the connection broke to", *hint = "";
    for (size_t i = 0; i < COUNT(rows); i++)
        if (rows[i].code == code) {
            what = rows[i].what;
            hint = rows[i].hint;
        }
    if (hint == NULL)
        hint = "; start one with \"impactd serve\", or name another by --server URL or "
               "IMPACTD_SERVER";
    // A TLS server closes a plain connection before it sends a byte.
    else if (hint[0] == '\0' && code != CURLE_OPERATION_TIMEDOUT && !call->is_tls &&
             transfer->headers == 0 && transfer->received == 0)
        hint = "; if the server speaks TLS, name it as https://";
    const char *host =
        hint[0] != '\0' && strchr(hint, '\0')[-1] == '/' ? strstr(call->url, "://") : NULL;
    return problem_set(transfer->problem, STATUS_UNREACHABLE, "%s %s (%s)%s%s", what, call->url,
                       curl_easy_strerror(code), hint, host != NULL ? host + 3 : "");
}

// The headers of the request; NULL without memory.
static struct curl_slist *headers_make(const Transfer *transfer) {
    const ApiRequest *request = transfer->request;
    const bool is_post = request->method != NULL && strcmp(request->method, "POST") == 0;
    const char *type = request->content_type != NULL ? request->content_type : "application/json";
    const struct {
        const char *name, *value;
    } rows[] = {{"Content-Type", is_post ? type : NULL},
                {"If-Match", request->if_match},
                {"Prefer", request->prefer},
                {"Idempotency-Key", request->idempotency_key},
                {"If-Range", transfer->continue_from > 0 ? transfer->call->answer.etag : NULL}};
    struct curl_slist *list = curl_slist_append(NULL, "Expect:"), *longer = list;
    for (size_t i = 0; i < COUNT(rows) && longer != NULL; i++) {
        char line[1024];
        snprintf(line, sizeof line, "%s: %s", rows[i].name, rows[i].value);
        if (rows[i].value != NULL && (longer = curl_slist_append(list, line)) != NULL)
            list = longer;
    }
    if (longer == NULL)
        curl_slist_free_all(list);
    return longer != NULL ? list : NULL;
}

static CURLcode transfer_perform(Transfer *transfer, const char *url, struct curl_slist *headers) {
    const ApiCall *call = transfer->call;
    const ClientSettings *settings = call->settings;
    const ApiRequest *request = transfer->request;
    const char *ca_file = setting(settings->ca_file, "IMPACTD_CA_FILE", NULL);
    const char *method = request->method != NULL ? request->method : "GET";
    CURL *curl = call->curl;
    const bool is_stream = request->output_max > 0;
    char agent[64];
    // A server that keeps a document back answers once the wait is over; more silence is a failure.
    const double silence =
        settings->wait > 0 && !is_stream ? fmin(api_left(call) + 5, SILENCE) : SILENCE;
    snprintf(agent, sizeof agent, "impactd/%s", program_version);
    curl_easy_reset(curl); // the connection stays
    curl_easy_setopt(curl, CURLOPT_URL, url);
    curl_easy_setopt(curl, CURLOPT_USERAGENT, agent);
    curl_easy_setopt(curl, CURLOPT_PATH_AS_IS, 1L);
    curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(curl, CURLOPT_HTTP_VERSION, (long)CURL_HTTP_VERSION_1_1);
    curl_easy_setopt(curl, CURLOPT_FOLLOWLOCATION, 0L);
    curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(curl, CURLOPT_BUFFERSIZE, 262144L);
    curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT, 10L);
    curl_easy_setopt(curl, CURLOPT_TIMEOUT_MS, call->answer_ms);
    curl_easy_setopt(curl, CURLOPT_LOW_SPEED_LIMIT, is_stream ? 1L : 100L); // [B/s]
    curl_easy_setopt(curl, CURLOPT_LOW_SPEED_TIME, (long)ceil(silence));
    curl_easy_setopt(curl, CURLOPT_HTTPHEADER, headers);
    curl_easy_setopt(curl, CURLOPT_RESUME_FROM_LARGE, (curl_off_t)transfer->continue_from);
    if (call->token[0] != '\0') {
        curl_easy_setopt(curl, CURLOPT_HTTPAUTH, (long)CURLAUTH_BEARER);
        curl_easy_setopt(curl, CURLOPT_XOAUTH2_BEARER, call->token);
    }
    if (call->is_loopback) // a proxy of the environment is not for this machine
        curl_easy_setopt(curl, CURLOPT_PROXY, "");
    if (ca_file != NULL)
        curl_easy_setopt(curl, CURLOPT_CAINFO, ca_file);
    if (strcmp(method, "POST") == 0) {
        curl_easy_setopt(curl, CURLOPT_POSTFIELDS, call->body.at != NULL ? call->body.at : "");
        curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE_LARGE, (curl_off_t)call->body.count);
    }
    curl_easy_setopt(curl, CURLOPT_CUSTOMREQUEST, method);
    curl_easy_setopt(curl, CURLOPT_HEADERFUNCTION, header_count);
    curl_easy_setopt(curl, CURLOPT_HEADERDATA, transfer);
    curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, body_read);
    curl_easy_setopt(curl, CURLOPT_WRITEDATA, transfer);
    return curl_easy_perform(curl);
}

static Status transfer_run(Transfer *transfer, const char *url, CURLcode *code) {
    ApiAnswer *answer = &transfer->call->answer;
    struct curl_slist *headers = headers_make(transfer);
    *code = headers != NULL ? transfer_perform(transfer, url, headers) : CURLE_OUT_OF_MEMORY;
    curl_slist_free_all(headers);
    if (transfer->status != STATUS_OK)
        return transfer->status;
    if (*code != CURLE_OK)
        return transfer_failed(transfer, *code);
    // libcurl regards a response as whole whose length is that of the first part.
    if (transfer->continue_from > 0 && transfer->received == transfer->continue_from)
        return problem_set(transfer->problem, STATUS_UNREACHABLE,
                           "the answer was cut off after %llu bytes and cannot be continued",
                           (unsigned long long)transfer->received);
    long status = 0;
    const char *location = NULL;
    headers_read(transfer);
    (void)curl_easy_getinfo(transfer->call->curl, CURLINFO_RESPONSE_CODE, &status);
    (void)curl_easy_getinfo(transfer->call->curl, CURLINFO_REDIRECT_URL, &location);
    answer->code = transfer->continue_from > 0 && status == 206 ? 200 : (int)status;
    // A shortened id: the server gives the path with the whole one.
    const size_t own = strlen(transfer->call->url);
    if (status == 307 && !transfer->is_redirected && transfer->request->method == NULL &&
        location != NULL && strncmp(location, transfer->call->url, own) == 0 &&
        location[own] == '/') {
        char *path = strdup(location);
        transfer->is_redirected = true;
        transfer->headers = 0;
        bytes_clear(&answer->body);
        const Status again = path != NULL ? transfer_run(transfer, path, code) : STATUS_NO_MEMORY;
        free(path);
        return again;
    }
    if (status >= 300 && status < 400)
        return problem_set(transfer->problem, STATUS_UNREACHABLE,
                           "%s answers %ld and points to %.200s; redirects are not followed: give "
                           "the address itself by --server",
                           transfer->call->url, status, location != NULL ? location : "nothing");
    return STATUS_OK;
}

// One request. STATUS_OK if the server answered, with any status code.
static Status api_exchange(ApiCall *call, const ApiRequest *request, Problem *problem) {
    Bytes url = {0};
    CURLcode code;
    bytes_clear(&call->answer.body);
    call->answer = (ApiAnswer){.body.most = DOCUMENT_MAX};
    bytes_format(&url, "%s%s", call->url, request->path.at);
    if (url.is_failed)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory");
    Transfer transfer = {.call = call, .request = request, .problem = problem};
    Status status = transfer_run(&transfer, url.at, &code);
    // A body that was cut off is continued if it still is the same.
    if (transfer.status == STATUS_OK && transfer.received > 0 && call->answer.etag[0] != '\0' &&
        (code == CURLE_PARTIAL_FILE || code == CURLE_RECV_ERROR || code == CURLE_GOT_NOTHING)) {
        transfer.continue_from = transfer.received;
        transfer.headers = 0;
        problem_clear(problem);
        status = transfer_run(&transfer, url.at, &code);
    }
    bytes_clear(&url);
    return status;
}

static void fault_fit(char *target, size_t size, const char *text) {
    text_fit(target, size, text != NULL ? text : "");
}

void api_add_faults(const JsonDocument *document, Status status, Problem *problem) {
    const JsonDocument *error;
    for (size_t i = 0; (error = json_get_item(document, "errors", i)) != NULL; i++) {
        Fault fault = {0};
        const char *column = json_get_text(error, "column");
        const double row = json_get_number(error, "row");
        fault_fit(fault.pointer, sizeof fault.pointer, json_get_text(error, "pointer"));
        // The place of a fault in a table is its cell, not that of a document.
        if (row > 0)
            snprintf(fault.pointer, sizeof fault.pointer, "row %.0f%s%.100s", row,
                     column != NULL ? ", column " : "", column != NULL ? column : "");
        fault_fit(fault.detail, sizeof fault.detail, json_get_text(error, "detail"));
        fault_fit(fault.unit, sizeof fault.unit, json_get_text(error, "unit"));
        fault_fit(fault.did_you_mean, sizeof fault.did_you_mean,
                  json_get_text(error, "did_you_mean"));
        (void)problem_add_fault(problem, status, &fault);
    }
    const double more = json_get_number(document, "more");
    if (problem->count > 0 && more > 0 && more < 1e9)
        problem->count += (size_t)more;
    const char *detail = json_get_text(document, "detail");
    detail = detail != NULL && detail[0] != '\0' ? detail : json_get_text(document, "title");
    (void)problem_set(problem, status, "%s",
                      detail != NULL && detail[0] != '\0' ? detail : "no reason is given");
}

// The status that leads to the exit code of an HTTP status code.
static Status http_status(int code, const char *type) {
    static const struct {
        int code;
        Status status;
    } rows[] = {{400, STATUS_USAGE},       {401, STATUS_FORBIDDEN},   {403, STATUS_FORBIDDEN},
                {404, STATUS_NOT_FOUND},   {409, STATUS_CONFLICT},    {410, STATUS_NOT_FOUND},
                {412, STATUS_STALE},       {413, STATUS_INVALID},     {415, STATUS_INVALID},
                {422, STATUS_INVALID},     {429, STATUS_UNREACHABLE}, {502, STATUS_UNREACHABLE},
                {503, STATUS_UNREACHABLE}, {504, STATUS_UNREACHABLE}};
    if (code == 400 && type != NULL && strstr(type, "unreadable") != NULL)
        return STATUS_UNREADABLE;
    for (size_t i = 0; i < COUNT(rows); i++)
        if (rows[i].code == code)
            return rows[i].status;
    return STATUS_INTERNAL;
}

// The problem document of the answer; returns what its code means, never STATUS_OK.
static Status problem_read(ApiCall *call, Problem *problem) {
    const JsonDocument *reply = api_reply(call);
    const Status status = http_status(call->answer.code, json_get_text(reply, "type"));
    if (json_get_text(reply, "detail") == NULL && json_get_text(reply, "title") == NULL &&
        json_get_item(reply, "errors", 0) == NULL)
        return problem_set(problem, status, "the server answers %d without a reason",
                           call->answer.code);
    const char *detail = json_get_text(reply, "detail");
    detail = detail != NULL ? detail : json_get_text(reply, "title");
    if (call->answer.code == 401 && call->token[0] == '\0' && detail != NULL)
        return problem_set(problem, status, "%.300s; set IMPACTD_TOKEN or give --token-file FILE",
                           detail);
    api_add_faults(reply, status, problem);
    return status;
}

Status api_ask(ApiCall *call, ApiRequest *request, Problem *problem) {
    const ApiAnswer *answer = &call->answer;
    Status status = STATUS_OK;
    if (request->path.is_failed)
        status = problem_set(problem, STATUS_USAGE, "asks for too much at once");
    while (status == STATUS_OK && (status = api_exchange(call, request, problem)) == STATUS_OK) {
        const int code = answer->code;
        if (code == 200 || code == 201 || code == 202 || code == 204)
            break;
        const int pause = answer->retry_after > 0 ? answer->retry_after : 1;
        if ((code != 503 && code != 429) || pause > api_left(call))
            status = problem_read(call, problem);
        else
            (void)poll(NULL, 0, 1000 * pause);
    }
    bytes_clear(&request->path);
    return status;
}

Status api_get(ApiCall *call, Bytes path, Problem *problem) {
    return api_ask(call, &(ApiRequest){.path = path}, problem);
}

Status api_send(ApiCall *call, Problem *problem) {
    return api_ask(call,
                   &(ApiRequest){.method = call->action->method, .path = api_action_path(call)},
                   problem);
}

// An answer without its list must not count as an empty one.
static Status api_check_list(ApiCall *call, Problem *problem) {
    const char *list = call->action->list;
    char wanted[80];
    snprintf(wanted, sizeof wanted, "an object with a list \"%.40s\"", list != NULL ? list : "");
    return list == NULL || json_has_list(api_reply(call), list)
               ? STATUS_OK
               : api_unexpected(call, wanted, problem);
}

// The pages that follow are added to the first one.
Status api_send_pages(ApiCall *call, size_t more, Problem *problem) {
    Bytes all = {0};
    char last[sizeof call->answer.next] = "";
    TRY(api_send(call, problem));
    Status status = api_check_list(call, problem);
    for (size_t page = 0; call->answer.next[0] != '\0' && page < more && status == STATUS_OK;
         page++) {
        Bytes path = api_action_path(call);
        if (page == PAGES_MAX || strcmp(last, call->answer.next) == 0) {
            bytes_clear(&path);
            status = problem_set(problem, STATUS_UNREACHABLE, "the list has no end");
            break;
        }
        if (page == 0)
            bytes_put(&all, call->answer.body.at, call->answer.body.count);
        text_fit(last, sizeof last, call->answer.next);
        path.count = path.at != NULL ? strcspn(path.at, "?") : 0;
        bytes_text(&path, call->answer.next);
        status = api_get(call, path, problem);
        if (status == STATUS_OK)
            status = api_check_list(call, problem);
        if (status == STATUS_OK)
            status = json_edit_extend(&all, &call->answer.body, problem);
    }
    if (status == STATUS_OK && all.count > 0) {
        bytes_clear(&call->answer.body);
        call->answer.body = all;
        all = (Bytes){0};
    }
    bytes_clear(&all);
    return status;
}

Status api_show(ApiCall *call, Problem *problem) {
    TRY(api_send_pages(call, SIZE_MAX, problem));
    return api_print_tables(call, problem);
}

Status api_download(ApiCall *call, ApiRequest *request, const char *path, Problem *problem) {
    Status status = output_open(path, problem);
    if (status == STATUS_OK)
        status = api_ask(call, request, problem);
    if (status == STATUS_OK)
        status = output_close(problem);
    output_drop();
    bytes_clear(&request->path);
    return status;
}

const JsonDocument *api_reply(ApiCall *call) {
    json_close(call->reply);
    return call->reply = json_open(&call->answer.body);
}

Status api_print(const ApiCall *call, Problem *problem) {
    return output_write(call->answer.body.at, call->answer.body.count, problem);
}

Status api_print_tables(ApiCall *call, Problem *problem) {
    const PrintTableView *view = call->command->view;
    const char *action = call->action->name;
    PrintTableForm form = terminal_table_form();
    size_t rows = 1;
    if (action != NULL && strcmp(action, "list") != 0)
        form.width = 0; // only lists and comparisons are cut
    if (view == NULL || ((const ClientSettings *)call->settings)->json)
        return api_print(call, problem);
    if (api_reply(call) == NULL)
        return api_unexpected(call, "an object", problem);
    TRY(print_table_print_json(&call->answer.body, view, form, stdout, &rows, problem));
    if (rows == 0 && call->action->list == NULL)
        return api_unexpected(call, "what was requested", problem);
    if (rows == 0)
        command_print_line(stderr, "impactd %s: none found", call->command->name);
    return STATUS_OK;
}

void api_print_names(const Command *self, void *settings, const char *path, const char *list,
                     const char *const *members, Problem *problem) {
    ApiCall call = {.command = self, .settings = settings, .answer_ms = 300};
    const JsonDocument *item;
    if (api_open(&call, problem) == STATUS_OK &&
        api_get(&call, api_path("%s", path), problem) == STATUS_OK) {
        (void)api_reply(&call);
        for (size_t i = 0; (item = json_get_item(call.reply, list, i)) != NULL; i++)
            for (const char *const *member = members; *member != NULL; member++) {
                const char *name = json_get_text(item, *member);
                if (name != NULL && name[0] != '-' &&
                    (api_is_id(name) || record_name_is_sound(name))) // slugs are ids
                    puts(name);
            }
    }
    api_close(&call);
}

bool api_is_id(const char *text) {
    const size_t length = strlen(text);
    return length > 0 && length <= 80 &&
           strspn(text, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") ==
               length;
}

Status api_unexpected(const ApiCall *call, const char *wanted, Problem *problem) {
    const Bytes *body = &call->answer.body;
    char start[41];
    snprintf(start, sizeof start, "%.*s", body->count < 40 ? (int)body->count : 40,
             body->count > 0 ? body->at : "");
    for (char *c = start; *c != '\0'; c++) // may be no text, and is cut
        *c = *c < ' ' || *c > '~' ? '?' : *c;
    return problem_set(problem, STATUS_UNREACHABLE,
                       "the answer is not %s, but begins with \"%s\"; is the server at %.200s "
                       "really impactd?",
                       wanted, start, call->url);
}

Bytes api_path(const char *format, ...) {
    char text[400];
    Bytes path = {.most = PATH_BYTES};
    va_list arguments;
    va_start(arguments, format);
    path.is_failed = (size_t)vsnprintf(text, sizeof text, format, arguments) >= sizeof text;
    va_end(arguments);
    bytes_text(&path, text);
    return path;
}

Bytes api_action_path(const ApiCall *call) {
    const char *piece = call->action->path, *end;
    Bytes path = {.most = PATH_BYTES};
    for (size_t i = 0; (end = strstr(piece, "{}")) != NULL; i++, piece = end + 2) {
        const bool is_last = i >= call->count;
        bytes_put(&path, piece, is_last ? strcspn(piece, "?&") : (size_t)(end - piece));
        if (is_last) {
            piece = "";
            break;
        }
        if (api_operand_kind(call->action, i) == 't')
            bytes_percent(&path, call->operands[i]);
        else
            bytes_text(&path, call->operands[i]);
    }
    bytes_text(&path, piece);
    api_query_options(&path, call, call->action->query != NULL ? call->action->query : "");
    return path;
}

void api_query(Bytes *path, const char *name, const char *value) {
    if (value == NULL)
        return;
    bytes_format(path, "%s%s=", path->at == NULL || strchr(path->at, '?') == NULL ? "?" : "&",
                 name);
    bytes_percent(path, value);
}

void api_query_options(Bytes *path, const ApiCall *call, const char *names) {
    char name[64];
    for (; *names != '\0'; names += strspn(names, " ")) {
        size_t offset = 0;
        snprintf(name, sizeof name, "%.*s", (int)strcspn(names, " "), names);
        names += strlen(name);
        const Field *row = fields_find(call->command->options, name, &offset);
        const void *item = (const char *)call->settings + offset;
        Bytes value = {0};
        if (row->kind == FIELD_KIND_FLAG && *(const bool *)((const char *)item + row->offset))
            bytes_text(&value, "1");
        else if (row->kind != FIELD_KIND_FLAG && !field_is_absent(row, item))
            option_value(row, item, &value);
        path->is_failed = path->is_failed || value.is_failed;
        api_query(path, name, value.at);
        bytes_clear(&value);
    }
}
