// Whatever the server sends: headers and bodies are counted as they arrive, nothing is unpacked, no
// redirect is followed (the token would go with it), and only http and https are used.
#include "server/cli/client.h"

#include <curl/curl.h>
#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/api/app.h"
#include "server/cli/output.h"
#include "server/cli/scene_file.h"
#include "server/json/parse.h"
#include "server/json/table.h"
#include "server/util/clock.h"

static const double forever = 1e9; // [s]

// One exchange with the server.
typedef struct Transfer {
    ApiClient *client;
    const HttpAsk *ask;
    HttpAnswer *answer;
    Problem *problem;
    Status status;  // not STATUS_OK: why the body was refused
    size_t headers; // [B] so far
    uint64_t taken; // [B] given to ask->take
    uint64_t continue_from;
} Transfer;

static Status client_no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory");
}

enum { TOKEN_MAX = 512 };
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

// The bearer token: the first line of the file `path`, or of IMPACTD_TOKEN if that is NULL; NULL if
// there is neither. It is never an argument, which every user of a machine can see, and never part
// of a message.
static Status token_read(const char *path, char **token, Problem *problem) {
    char text[TOKEN_MAX + 64] = "";
    const char *source = path != NULL ? "--token-file" : "IMPACTD_TOKEN";
    const char *given = getenv("IMPACTD_TOKEN");
    if (path != NULL)
        TRY(token_file_read(path, text, sizeof text, problem));
    else
        text_fit(text, sizeof text, given != NULL ? given : "");
    text[strcspn(text, "\r\n")] = '\0';
    const size_t length = strlen(text);
    if (length > TOKEN_MAX || text[strspn(text, token_characters)] != '\0' ||
        (path != NULL && length == 0))
        return problem_add(problem, STATUS_USAGE, source,
                           "must hold a token: 1 to %d letters, digits and -._~+/= on its first "
                           "line",
                           TOKEN_MAX);
    *token = length > 0 ? strdup(text) : NULL;
    return length == 0 || *token != NULL ? STATUS_OK : client_no_memory(problem);
}

static bool host_is_loopback(const char *host) {
    const bool is_number = strspn(host, "0123456789.") == strlen(host);
    return strcasecmp(host, "localhost") == 0 || strcmp(host, "[::1]") == 0 ||
           (is_number && strncmp(host, "127.", 4) == 0);
}

static bool url_has(CURLU *url, CURLUPart part) {
    char *text = NULL;
    const bool has = curl_url_get(url, part, &text, 0) == CURLUE_OK;
    curl_free(text);
    return has;
}

static Status url_check(ApiClient *client, Problem *problem) {
    CURLU *url = curl_url();
    char *scheme = NULL, *host = NULL;
    const char *why = NULL;
    if (url == NULL)
        return client_no_memory(problem);
    for (const char *c = client->url; *c != '\0'; c++)
        if ((unsigned char)*c <= ' ' || *c == 0x7f)
            why = "it contains a blank or a control character";
    if (why == NULL && curl_url_set(url, CURLUPART_URL, client->url, 0) != CURLUE_OK)
        why = "it cannot be parsed";
    else if (why == NULL && (curl_url_get(url, CURLUPART_SCHEME, &scheme, 0) != CURLUE_OK ||
                             (strcmp(scheme, "http") != 0 && strcmp(scheme, "https") != 0)))
        why = "only http and https are supported";
    else if (why == NULL && curl_url_get(url, CURLUPART_HOST, &host, 0) != CURLUE_OK)
        why = "it has no host";
    else if (why == NULL && (url_has(url, CURLUPART_USER) || url_has(url, CURLUPART_PASSWORD) ||
                             url_has(url, CURLUPART_QUERY) || url_has(url, CURLUPART_FRAGMENT)))
        why = "it must not have a user, a query or a fragment; a token is read from IMPACTD_TOKEN "
              "or --token-file";
    if (why == NULL) {
        client->is_tls = strcmp(scheme, "https") == 0;
        client->is_loopback = host_is_loopback(host);
    }
    curl_free(scheme);
    curl_free(host);
    curl_url_cleanup(url);
    return why == NULL
               ? STATUS_OK
               : problem_add(problem, STATUS_USAGE, "--server",
                             "must be like http://127.0.0.1:8080 or https://HOST/PATH, is %.120s: "
                             "%s",
                             client->url, why);
}

static const char *setting(const char *given, const char *name, const char *fallback) {
    const char *found = given != NULL ? given : getenv(name);
    return found != NULL && found[0] != '\0' ? found : fallback;
}

Status api_client_open(const ClientSettings *settings, ApiClient *client, Problem *problem) {
    const double wait = settings->wait < forever ? settings->wait : forever;
    const char *ca_file = setting(settings->ca_file, "IMPACTD_CA_FILE", NULL);
    output_guard();
    *client = (ApiClient){.has_patience = wait > 0,
                          .until_ns = clock_monotonic_ns() + (int64_t)(1e9 * wait)};
    TRY(token_read(setting(settings->token_file, "IMPACTD_TOKEN_FILE", NULL), &client->token,
                   problem));
    client->url = strdup(setting(settings->server, "IMPACTD_SERVER", "http://127.0.0.1:8080"));
    client->ca_file = ca_file != NULL ? strdup(ca_file) : NULL;
    client->curl = curl_easy_init();
    if (client->url == NULL || client->curl == NULL || (ca_file != NULL && client->ca_file == NULL))
        return client_no_memory(problem);
    TRY(url_check(client, problem));
    for (size_t length = strlen(client->url); length > 0 && client->url[length - 1] == '/';
         length--)
        client->url[length - 1] = '\0';
    if (api_client_exposes_token(client))
        fprintf(stderr, "impactd: warning: the token is sent unencrypted to %s\n", client->url);
    return STATUS_OK;
}

void api_client_close(ApiClient *client) {
    curl_easy_cleanup(client->curl);
    free(client->url);
    free(client->token);
    free(client->ca_file);
    *client = (ApiClient){0};
}

int api_client_run(const Command *command, const ClientSettings *settings, const char *about,
                   Status (*act)(ApiClient *client, void *context, Problem *problem), void *context,
                   Problem *problem) {
    ApiClient client;
    Status status = api_client_open(settings, &client, problem);
    client.about = about != NULL ? about : command->name;
    if (status == STATUS_OK)
        status = act(&client, context, problem);
    const int code = status == STATUS_OK
                         ? COMMAND_OK
                         : api_client_refuse(command->name, client.about, status, problem);
    api_client_close(&client);
    return code;
}

bool api_client_exposes_token(const ApiClient *client) {
    return client->token != NULL && !client->is_tls && !client->is_loopback;
}

double api_client_left(const ApiClient *client) {
    return fmax(0, 1e-9 * (double)(client->until_ns - clock_monotonic_ns()));
}

// The value of a header of the response, "" if it has none.
static void header_get(const Transfer *transfer, const char *name, char *value, size_t size) {
    struct curl_header *header;
    const bool is_there =
        curl_easy_header(transfer->client->curl, name, 0, CURLH_HEADER, -1, &header) == CURLHE_OK;
    text_fit(value, size, is_there ? header->value : "");
}

static void headers_read(Transfer *transfer) {
    HttpAnswer *answer = transfer->answer;
    curl_off_t seconds = 0;
    char etag[sizeof answer->etag];
    header_get(transfer, "Content-Type", answer->content_type, sizeof answer->content_type);
    answer->content_type[strcspn(answer->content_type, "; \t")] = '\0';
    header_get(transfer, "ETag", etag, sizeof etag);
    if (transfer->continue_from == 0)
        text_fit(answer->etag, sizeof answer->etag, etag[0] == '"' ? etag : "");
    (void)curl_easy_getinfo(transfer->client->curl, CURLINFO_RETRY_AFTER, &seconds);
    answer->retry_after = seconds > 86400 ? 86400 : (int)seconds;
}

static size_t header_count(char *line, size_t one, size_t count, void *context) {
    Transfer *transfer = context;
    (void)line;
    transfer->headers += one * count;
    if (transfer->headers <= HTTP_HEADERS_MAX)
        return one * count;
    transfer->status =
        problem_set(transfer->problem, STATUS_UNREACHABLE,
                    "%s sends more than %d bytes of headers; is the server really impactd?",
                    transfer->client->url, HTTP_HEADERS_MAX);
    return 0;
}

// Gives a piece of the body to its reader.
static Status body_hand_on(Transfer *transfer, const char *piece, size_t size) {
    const HttpAsk *ask = transfer->ask;
    if (size > ask->most - transfer->taken)
        return problem_set(transfer->problem, STATUS_TOO_LARGE,
                           "the answer is larger than %llu bytes", (unsigned long long)ask->most);
    transfer->taken += size;
    return ask->take(ask->context, piece, size, transfer->problem);
}

static size_t body_read(char *piece, size_t one, size_t count, void *context) {
    Transfer *transfer = context;
    const size_t size = one * count;
    long code = 0;
    (void)curl_easy_getinfo(transfer->client->curl, CURLINFO_RESPONSE_CODE, &code);
    if (transfer->taken == transfer->continue_from)
        headers_read(transfer);
    if (transfer->ask->take != NULL && (code == 200 || code == 206)) {
        transfer->status = body_hand_on(transfer, piece, size);
        return transfer->status == STATUS_OK ? size : 0;
    }
    bytes_put(&transfer->answer->body, piece, size);
    if (!transfer->answer->body.is_failed)
        return size;
    transfer->status =
        problem_set(transfer->problem, STATUS_UNREACHABLE,
                    "%s answers with a document of more than %d bytes; is the server really "
                    "impactd?",
                    transfer->client->url, HTTP_DOCUMENT_MAX);
    return 0;
}

static Status transfer_failed(const Transfer *transfer, CURLcode code, Problem *problem) {
    const char *url = transfer->client->url, *reason = curl_easy_strerror(code);
    const char *host = strstr(url, "://") != NULL ? strstr(url, "://") + 3 : url;
    // A TLS server closes a plain connection before it sends a byte.
    const bool may_be_tls = !transfer->client->is_tls && transfer->answer->code == 0 &&
                            transfer->headers == 0 && transfer->taken == 0;
    const char *hint = may_be_tls ? "; if the server speaks TLS, name it as https://" : "";
    switch (code) {
    case CURLE_COULDNT_CONNECT:
    case CURLE_COULDNT_RESOLVE_HOST:
    case CURLE_COULDNT_RESOLVE_PROXY:
        return problem_set(problem, STATUS_UNREACHABLE,
                           "no server answers at %s (%s); start one with \"impactd serve\", or "
                           "name another by --server URL or IMPACTD_SERVER",
                           url, reason);
    case CURLE_SSL_CONNECT_ERROR:
        return problem_set(problem, STATUS_UNREACHABLE,
                           "TLS connection to %s failed (%s); if the server speaks plain HTTP, "
                           "name it as http://%s",
                           url, reason, host);
    case CURLE_PEER_FAILED_VERIFICATION:
    case CURLE_SSL_CACERT_BADFILE:
        return problem_set(problem, STATUS_UNREACHABLE,
                           "the certificate of %s is not trusted (%s); --ca-file FILE names the "
                           "certificate that signed it",
                           url, reason);
    case CURLE_UNSUPPORTED_PROTOCOL:
    case CURLE_WEIRD_SERVER_REPLY:
        return problem_set(problem, STATUS_UNREACHABLE, "the server at %s does not speak HTTP%s%s",
                           url, hint, may_be_tls ? host : "");
    case CURLE_OPERATION_TIMEDOUT:
        return problem_set(problem, STATUS_UNREACHABLE, "no answer from %s for too long", url);
    case CURLE_OUT_OF_MEMORY:
        return client_no_memory(problem);
    default:
        return problem_set(problem, STATUS_UNREACHABLE, "the connection to %s broke: %s%s%s", url,
                           reason, hint, may_be_tls ? host : "");
    }
}

// Appends the header unless its value is NULL. False without memory.
static bool header_add(struct curl_slist **list, const char *name, const char *value) {
    Bytes line = {.most = 8192};
    if (value == NULL)
        return true;
    bytes_format(&line, "%s: %s", name, value);
    struct curl_slist *longer = line.is_failed ? NULL : curl_slist_append(*list, line.at);
    bytes_clear(&line);
    *list = longer != NULL ? longer : *list;
    return longer != NULL;
}

static bool headers_add(const Transfer *transfer, struct curl_slist **list) {
    const HttpAsk *ask = transfer->ask;
    const char *type = ask->content_type != NULL ? ask->content_type : "application/json";
    return header_add(list, "Expect", "") &&
           header_add(list, "Content-Type", ask->body != NULL ? type : NULL) &&
           header_add(list, "If-Match", ask->if_match) && header_add(list, "Prefer", ask->prefer) &&
           header_add(list, "Idempotency-Key", ask->idempotency_key) &&
           header_add(list, "If-Range",
                      transfer->continue_from > 0 ? transfer->answer->etag : NULL);
}

static CURLcode transfer_perform(Transfer *transfer, const char *url, struct curl_slist *headers) {
    const ApiClient *client = transfer->client;
    const HttpAsk *ask = transfer->ask;
    CURL *curl = client->curl;
    const bool is_stream = ask->take != NULL;
    char agent[64];
    // A server that keeps a document back answers once the wait is over; more silence is a failure.
    const double silence = fmin(api_client_left(client) + 5, HTTP_SILENCE);
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
    curl_easy_setopt(curl, CURLOPT_LOW_SPEED_LIMIT, is_stream ? 1L : 100L); // [B/s]
    curl_easy_setopt(curl, CURLOPT_LOW_SPEED_TIME,
                     client->has_patience && !is_stream ? (long)ceil(silence) : (long)HTTP_SILENCE);
    curl_easy_setopt(curl, CURLOPT_HTTPHEADER, headers);
    curl_easy_setopt(curl, CURLOPT_RESUME_FROM_LARGE, (curl_off_t)transfer->continue_from);
    if (client->token != NULL) {
        curl_easy_setopt(curl, CURLOPT_HTTPAUTH, (long)CURLAUTH_BEARER);
        curl_easy_setopt(curl, CURLOPT_XOAUTH2_BEARER, client->token);
    }
    if (ask->within > 0 && ask->within < 1e6)
        curl_easy_setopt(curl, CURLOPT_TIMEOUT_MS, (long)(1000 * ask->within) + 1);
    if (client->is_loopback) // a proxy of the environment is not for this machine
        curl_easy_setopt(curl, CURLOPT_PROXY, "");
    if (client->ca_file != NULL)
        curl_easy_setopt(curl, CURLOPT_CAINFO, client->ca_file);
    if (ask->body != NULL) {
        curl_easy_setopt(curl, CURLOPT_POSTFIELDS, ask->body->at != NULL ? ask->body->at : "");
        curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE_LARGE, (curl_off_t)ask->body->count);
    }
    curl_easy_setopt(curl, CURLOPT_CUSTOMREQUEST, ask->method);
    curl_easy_setopt(curl, CURLOPT_HEADERFUNCTION, header_count);
    curl_easy_setopt(curl, CURLOPT_HEADERDATA, transfer);
    curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, body_read);
    curl_easy_setopt(curl, CURLOPT_WRITEDATA, transfer);
    return curl_easy_perform(curl);
}

// Whether a body that was cut off can be continued.
static bool transfer_can_continue(const Transfer *transfer, CURLcode code) {
    char ranges[16];
    header_get(transfer, "Accept-Ranges", ranges, sizeof ranges);
    return transfer->status == STATUS_OK && transfer->taken > 0 && transfer->continue_from == 0 &&
           transfer->answer->etag[0] != '\0' && strcasecmp(ranges, "bytes") == 0 &&
           (code == CURLE_PARTIAL_FILE || code == CURLE_RECV_ERROR || code == CURLE_GOT_NOTHING);
}

static Status transfer_run(Transfer *transfer, const char *url, bool *is_cut) {
    struct curl_slist *headers = NULL;
    CURLcode code = CURLE_OUT_OF_MEMORY;
    if (headers_add(transfer, &headers))
        code = transfer_perform(transfer, url, headers);
    curl_slist_free_all(headers);
    *is_cut = code != CURLE_OK && transfer_can_continue(transfer, code);
    if (transfer->status != STATUS_OK)
        return transfer->status;
    if (code != CURLE_OK)
        return *is_cut ? STATUS_UNREACHABLE : transfer_failed(transfer, code, transfer->problem);
    long status = 0;
    const char *location = NULL;
    headers_read(transfer);
    (void)curl_easy_getinfo(transfer->client->curl, CURLINFO_RESPONSE_CODE, &status);
    (void)curl_easy_getinfo(transfer->client->curl, CURLINFO_REDIRECT_URL, &location);
    if (transfer->continue_from > 0 && transfer->taken == transfer->continue_from)
        return problem_set(transfer->problem, STATUS_UNREACHABLE,
                           "the answer was cut off after %llu bytes and cannot be continued",
                           (unsigned long long)transfer->continue_from);
    transfer->answer->code = transfer->continue_from > 0 && status == 206 ? 200 : (int)status;
    if (status >= 300 && status < 400)
        return problem_set(transfer->problem, STATUS_UNREACHABLE,
                           "%s answers %ld and points to %.200s; redirects are not followed: give "
                           "the address itself by --server",
                           transfer->client->url, status, location != NULL ? location : "nothing");
    return STATUS_OK;
}

Status http_ask(ApiClient *client, const HttpAsk *ask, HttpAnswer *answer, Problem *problem) {
    *answer = (HttpAnswer){.body.most = HTTP_DOCUMENT_MAX};
    Transfer transfer = {.client = client, .ask = ask, .answer = answer, .problem = problem};
    Bytes url = {.most = 16384};
    bytes_text(&url, client->url);
    bytes_text(&url, ask->path);
    if (url.is_failed)
        return problem_set(problem, STATUS_USAGE, "the address would be longer than 16384 bytes");
    bool is_cut = false;
    Status status = transfer_run(&transfer, url.at, &is_cut);
    if (is_cut) {
        transfer.continue_from = transfer.taken;
        transfer.headers = 0;
        status = transfer_run(&transfer, url.at, &is_cut);
    }
    bytes_clear(&url);
    return status;
}

void http_answer_clear(HttpAnswer *answer) {
    bytes_clear(&answer->body);
    *answer = (HttpAnswer){0};
}

Status api_client_ask(ApiClient *client, const HttpAsk *ask, HttpAnswer *answer, Problem *problem) {
    for (;;) {
        TRY(http_ask(client, ask, answer, problem));
        if (answer->code == 200 || answer->code == 201 || answer->code == 202 ||
            answer->code == 204)
            return STATUS_OK;
        const int pause = answer->retry_after > 0 ? answer->retry_after : 1;
        const bool is_busy = answer->code == 503 || answer->code == 429;
        if (!is_busy || pause > api_client_left(client))
            return problem_reply_read(answer, problem);
        http_answer_clear(answer);
        (void)poll(NULL, 0, 1000 * pause);
    }
}

Status api_client_request(ApiClient *client, HttpAsk ask, Bytes *path, HttpAnswer *answer,
                          Problem *problem) {
    ask.path = path->at;
    *answer = (HttpAnswer){0};
    const Status status = path->is_failed
                              ? problem_set(problem, STATUS_USAGE, "asks for too much at once")
                              : api_client_ask(client, &ask, answer, problem);
    bytes_clear(path);
    return status;
}

void api_client_print(const HttpAnswer *answer) {
    (void)fwrite(answer->body.at, 1, answer->body.count, stdout);
}

bool api_client_is_id(const char *text) {
    const size_t length = strlen(text);
    return length > 0 && length <= 80 &&
           strspn(text, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") ==
               length;
}

int api_client_refuse(const char *command, const char *name, Status status,
                      const Problem *problem) {
    const char *pointer = problem->count > 0 ? problem->faults[0].pointer : "";
    // Faults of options and of the environment are at their names.
    if (status == STATUS_USAGE && (pointer[0] == '-' || pointer[0] == 'I'))
        return command_error(command, problem);
    scene_file_refuse(name, problem);
    return command_exit(status);
}

Status api_client_unexpected(const char *wanted, Problem *problem) {
    return problem_set(problem, STATUS_UNREACHABLE,
                       "the answer is not %s; is the server really impactd?", wanted);
}

typedef struct FaultReply {
    char *pointer, *detail, *unit, *did_you_mean;
    uint64_t row;
    char *column;
} FaultReply;

// clang-format off
static const Field fault_fields[] = {
    FIELD_TEXT(FaultReply, pointer, 0, PRESENCE_OPTIONAL, 0, "place"),
    FIELD_TEXT(FaultReply, detail, 0, PRESENCE_OPTIONAL, 0, "what is wrong"),
    FIELD_TEXT(FaultReply, unit, 0, PRESENCE_OPTIONAL, 0, "unit"),
    FIELD_TEXT(FaultReply, did_you_mean, 0, PRESENCE_OPTIONAL, 0, "suggestion"),
    FIELD_COUNT(FaultReply, row, NULL, ANY, OPTIONAL, "of a table"),
    FIELD_TEXT(FaultReply, column, 0, PRESENCE_OPTIONAL, 0, "of that row"),
    FIELD_END,
};
const Field problem_reply_fields[] = {
    FIELD_TEXT(ProblemReply, type, 0, PRESENCE_OPTIONAL, 0, "kind"),
    FIELD_TEXT(ProblemReply, title, 0, PRESENCE_OPTIONAL, 0, "in short"),
    FIELD_TEXT(ProblemReply, detail, 0, PRESENCE_OPTIONAL, 0, "sentence"),
    {.name = "errors", .kind = FIELD_KIND_LIST, .offset = offsetof(ProblemReply, errors),
     .fields = fault_fields, .size = sizeof(FaultReply), .presence = PRESENCE_OPTIONAL, .doc = "faults"},
    FIELD_COUNT(ProblemReply, more, NULL, ANY, 0, "faults beyond those"),
    FIELD_END,
};
// clang-format on

static void text_put(char *target, size_t size, const char *text) {
    text_fit(target, size, text != NULL ? text : "");
    text_make_printable(target);
}

void problem_reply_put(const ProblemReply *reply, Status status, Problem *problem) {
    const FaultReply *faults = reply->errors.at;
    for (size_t i = 0; i < reply->errors.count && problem != NULL; i++) {
        const FaultReply *one = &faults[i];
        Fault fault = {0};
        char place[sizeof fault.pointer];
        // The place of a fault in a table is its cell, not that of a document.
        snprintf(place, sizeof place, "row %llu%s%.100s", (unsigned long long)one->row,
                 one->column != NULL ? ", column " : "", one->column != NULL ? one->column : "");
        text_put(fault.pointer, sizeof fault.pointer,
                 one->row != COUNT_ABSENT ? place : one->pointer);
        text_put(fault.detail, sizeof fault.detail, one->detail);
        text_put(fault.unit, sizeof fault.unit, one->unit);
        text_put(fault.did_you_mean, sizeof fault.did_you_mean, one->did_you_mean);
        (void)problem_add_fault(problem, status, &fault);
    }
    if (problem != NULL && reply->more < 1000000000)
        problem->count += problem->count > 0 ? reply->more : 0;
    char detail[400];
    text_put(detail, sizeof detail, reply->detail != NULL ? reply->detail : reply->title);
    (void)problem_set(problem, status, "%s", detail[0] != '\0' ? detail : "no reason is given");
}

// The status that leads to the exit code of an HTTP status code.
static Status status_of(int code, const char *type) {
    switch (code) {
    case 400:
        return type != NULL && strstr(type, "unreadable") != NULL ? STATUS_UNREADABLE
                                                                  : STATUS_USAGE;
    case 401:
    case 403:
        return STATUS_FORBIDDEN;
    case 404:
    case 410:
        return STATUS_NOT_FOUND;
    case 413:
    case 415:
    case 422:
        return STATUS_INVALID;
    case 429:
    case 502:
    case 503:
    case 504:
        return STATUS_UNREACHABLE;
    case 409:
        return STATUS_CONFLICT;
    case 412:
        return STATUS_STALE;
    default:
        return STATUS_INTERNAL;
    }
}

Status problem_reply_read(const HttpAnswer *answer, Problem *problem) {
    ProblemReply reply = {0};
    // Unknown members are not faults of an answer.
    (void)json_parse(answer->body.at, answer->body.count, problem_reply_fields, &reply, NULL);
    const Status status = status_of(answer->code, reply.type);
    if (reply.detail != NULL || reply.title != NULL || reply.errors.count > 0)
        problem_reply_put(&reply, status, problem);
    else
        (void)problem_set(problem, status, "the server answers %d without a reason", answer->code);
    fields_clear(problem_reply_fields, &reply);
    return status;
}

void http_query(Bytes *path, const char *name, const char *value) {
    if (value == NULL)
        return;
    bytes_format(path, "%s%s=", path->at == NULL || strchr(path->at, '?') == NULL ? "?" : "&",
                 name);
    bytes_percent(path, value);
}

void http_query_real(Bytes *path, const char *name, double value) {
    char text[32];
    if (!isnan(value))
        http_query(path, name, text_real(text, value));
}
