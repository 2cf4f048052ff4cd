// Headers and bodies are counted as they arrive, nothing is unpacked, no redirect is followed (the
// token would go with it), and only http and https are used.
#include "server/cli/client.h"

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

#include "server/api/app.h"
#include "server/cli/files.h"
#include "server/json/parse.h"
#include "server/util/clock.h"

enum {
    DOCUMENT_MAX = 64 << 20, // [B] of a body that is kept in memory
    HEADERS_MAX = 64 << 10,  // [B] of all headers of a response
    SILENCE = 60,            // [s] without a byte, after which a request fails
    TOKEN_MAX = 512,
    PATH_BYTES = 60000,
};
static const double forever = 1e9; // [s]

// One exchange with the server.
typedef struct Transfer {
    ApiClient *client;
    const ApiRequest *request;
    ApiAnswer *answer;
    Problem *problem;
    Status status;   // not STATUS_OK: why the body was refused
    size_t headers;  // [B] so far
    uint64_t stored; // [B] written to the output
    uint64_t continue_from;
} Transfer;

static Status client_no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory");
}

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

static Status url_check(ApiClient *client, Problem *problem) {
    const char *url = client->url, *why = NULL;
    client->is_tls = strncasecmp(url, "https://", 8) == 0;
    const bool is_plain = strncasecmp(url, "http://", 7) == 0;
    const char *host = url + (client->is_tls ? 8 : is_plain ? 7 : 0);
    const size_t size = host[0] == '[' ? strcspn(host, "]") + 1 : strcspn(host, ":/");
    for (const char *c = url; *c != '\0'; c++)
        if ((unsigned char)*c <= ' ' || *c == 0x7f)
            why = "it contains a blank or a control character";
    if (why == NULL && host == url)
        why = "only http and https are supported";
    else if (why == NULL && strpbrk(url, "@?#") != NULL)
        why = "it must not have a user, a query or a fragment; a token is read from IMPACTD_TOKEN "
              "or --token-file";
    else if (why == NULL && size == 0)
        why = "it has no host";
    else if (why == NULL) { // only here, as curl accepts more
        CURLU *parsed = curl_url();
        if (parsed == NULL || curl_url_set(parsed, CURLUPART_URL, url, 0) != CURLUE_OK)
            why = "it cannot be parsed";
        curl_url_cleanup(parsed);
    }
    client->is_loopback = (size == 9 && strncasecmp(host, "localhost", size) == 0) ||
                          (size == 5 && strncmp(host, "[::1]", size) == 0) ||
                          (strncmp(host, "127.", 4) == 0 && strspn(host, "0123456789.") == size);
    return why == NULL ? STATUS_OK
                       : problem_add(problem, STATUS_USAGE, "--server",
                                     "must be like http://127.0.0.1:8080 or https://HOST/PATH, is "
                                     "%.120s: %s",
                                     url, why);
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

double api_client_left(const ApiClient *client) {
    return fmax(0, 1e-9 * (double)(client->until_ns - clock_monotonic_ns()));
}

bool api_client_exposes_token(const ApiClient *client) {
    return client->token != NULL && !client->is_tls && !client->is_loopback;
}

// Prints all faults on stderr, under `about`; returns the exit code.
static int api_refuse(const Command *command, const char *about, Status status,
                      const Problem *problem) {
    const char *pointer = problem->count > 0 ? problem->faults[0].pointer : "";
    // Faults of options and of the environment are at their names.
    if (status == STATUS_USAGE && (pointer[0] == '-' || pointer[0] == 'I'))
        return command_error(command->name, problem);
    command_print_faults(input_name(about), ": ", "\"", problem);
    return command_exit(status);
}

// clang-format off
static const Field fault_fields[] = {
    FIELD_TEXT(ReplyFault, pointer, 0, PRESENCE_OPTIONAL, 0, "place"),
    FIELD_TEXT(ReplyFault, detail, 0, PRESENCE_OPTIONAL, 0, "what is wrong"),
    FIELD_TEXT(ReplyFault, unit, 0, PRESENCE_OPTIONAL, 0, "unit"),
    FIELD_TEXT(ReplyFault, did_you_mean, 0, PRESENCE_OPTIONAL, 0, "suggestion"),
    FIELD_COUNT(ReplyFault, row, NULL, ANY, OPTIONAL, "of a table"),
    FIELD_TEXT(ReplyFault, column, 0, PRESENCE_OPTIONAL, 0, "of that row"),
    FIELD_END,
};
static const Field problem_fields[] = {
    FIELD_TEXT(ProblemReply, type, 0, PRESENCE_OPTIONAL, 0, "kind"),
    FIELD_TEXT(ProblemReply, title, 0, PRESENCE_OPTIONAL, 0, "in short"),
    FIELD_TEXT(ProblemReply, detail, 0, PRESENCE_OPTIONAL, 0, "sentence"),
    FIELD_LIST(ProblemReply, errors, fault_fields, 0, PRESENCE_OPTIONAL, "faults"),
    FIELD_COUNT(ProblemReply, more, NULL, ANY, 0, "faults beyond those"),
    FIELD_END,
};
static const Field review_fields[] = {
    FIELD_FLAG(ReviewReply, self_approved, false, "by the author of the revision"),
    FIELD_END,
};
static const Field name_fields[] = {
    FIELD_TEXT(NameReply, name, 0, PRESENCE_OPTIONAL, 0, "of a record"),
    FIELD_END,
};
static const Field reply_fields[] = {
    FIELD_BASE(ApiReply, self, problem_fields),
    FIELD_TEXT(ApiReply, id, 0, PRESENCE_OPTIONAL, 0, "of a job"),
    FIELD_TEXT(ApiReply, status, 0, PRESENCE_OPTIONAL, 0, "of a job or a revision"),
    FIELD_TEXT(ApiReply, result, 0, PRESENCE_OPTIONAL, 0, "of a job"),
    FIELD_REAL(ApiReply, progress, "%", ANY, OPTIONAL, "of a job"),
    FIELD_ITEM_OR_NULL(ApiReply, problem, problem_fields, PRESENCE_OPTIONAL, "of a failed job"),
    FIELD_TEXT(ApiReply, slug, 0, PRESENCE_OPTIONAL, 0, "of a material"),
    FIELD_COUNT(ApiReply, revision, NULL, ANY, OPTIONAL, "of a material"),
    FIELD_ITEM_OR_NULL(ApiReply, review, review_fields, PRESENCE_OPTIONAL, "the last of a revision"),
    FIELD_TEXT(ApiReply, name, 0, PRESENCE_OPTIONAL, 0, "of a record, as all below"),
    FIELD_TEXT(ApiReply, layout, 0, PRESENCE_OPTIONAL, 0, "of its file"),
    FIELD_REAL(ApiReply, interval, "s", ANY, OPTIONAL, "between samples"),
    FIELD_REAL(ApiReply, peak, "m/s^2", ANY, OPTIONAL, "largest magnitude"),
    FIELD_REAL(ApiReply, peak_time, "s", ANY, OPTIONAL, "of the peak"),
    FIELD_COUNT(ApiReply, count, NULL, ANY, OPTIONAL, "samples"),
    FIELD_LIST(ApiReply, warnings, fault_fields, 0, PRESENCE_OPTIONAL, "doubts"),
    FIELD_LIST(ApiReply, records, name_fields, 0, PRESENCE_OPTIONAL, "list of records"),
    FIELD_END,
};
// clang-format on

// The texts of an item, at any depth.
static void reply_make_printable(const Field *row, void *item) {
    for (; row->kind != FIELD_KIND_END; row++) {
        char *at = (char *)item + row->offset;
        const bool is_list = row->kind == FIELD_KIND_LIST;
        const List one = {at, 1}, *list = is_list ? (const List *)(const void *)at : &one;
        if (row->kind == FIELD_KIND_TEXT)
            text_make_printable(*(char **)(void *)at);
        for (size_t i = 0; row->fields != NULL && i < list->count; i++)
            reply_make_printable(row->fields, (char *)list->at + i * row->size);
    }
}

const ApiReply *api_reply(ApiCall *call) {
    const Bytes *body = &call->answer.body;
    fields_clear(reply_fields, &call->reply);
    // Unknown members are not faults of an answer.
    (void)json_parse(body->at, body->count, reply_fields, &call->reply, NULL);
    reply_make_printable(reply_fields, &call->reply);
    return &call->reply;
}

int api_command(const Command *self, void *settings, const Options *options, Problem *problem) {
    const ApiAction *actions = self->actions;
    ApiCall call = {.settings = settings, .operands = options->operands};
    size_t index = 0;
    call.count = options->operand_count;
    if (actions[0].name != NULL) {
        if (command_action(options, &actions->name, sizeof *actions, &index, problem) != STATUS_OK)
            return command_error(self->name, problem);
        call.operands++;
        call.count--;
    }
    const ApiAction *action = call.action = &actions[index];
    if (call.count < action->min || call.count > action->max) {
        const char *name = action->name != NULL ? action->name : "";
        (void)problem_set(problem, STATUS_USAGE, "%s%stakes %s, is given %zu operands", name,
                          name[0] != '\0' ? " " : "", action->takes, call.count);
        return command_error(self->name, problem);
    }
    for (size_t i = 0; i < action->ids; i++)
        if (!api_is_id(call.operands[i])) {
            (void)problem_set(problem, STATUS_USAGE, "takes %s, is given \"%.80s\"", action->takes,
                              call.operands[i]);
            return command_error(self->name, problem);
        }
    Status status = api_client_open(settings, &call.client, problem);
    call.client.about = call.count > 0 ? call.operands[0] : self->name;
    if (status == STATUS_OK)
        status = action->act(&call, problem);
    const int code =
        status == STATUS_OK ? COMMAND_OK : api_refuse(self, call.client.about, status, problem);
    api_client_close(&call.client);
    bytes_clear(&call.body);
    bytes_clear(&call.answer.body);
    fields_clear(reply_fields, &call.reply);
    return code;
}

// The value of a header of the response, "" if it has none.
static void header_get(const Transfer *transfer, const char *name, char *value, size_t size) {
    struct curl_header *header;
    const bool is_there =
        curl_easy_header(transfer->client->curl, name, 0, CURLH_HEADER, -1, &header) == CURLHE_OK;
    text_fit(value, size, is_there ? header->value : "");
}

static void headers_read(Transfer *transfer) {
    ApiAnswer *answer = transfer->answer;
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
    if (transfer->headers <= HEADERS_MAX)
        return one * count;
    transfer->status =
        problem_set(transfer->problem, STATUS_UNREACHABLE,
                    "%s sends more than %d bytes of headers; is the server really impactd?",
                    transfer->client->url, HEADERS_MAX);
    return 0;
}

static Status body_store(Transfer *transfer, const char *piece, size_t size) {
    const uint64_t max = transfer->request->output_max;
    if (size > max - transfer->stored)
        return problem_set(transfer->problem, STATUS_TOO_LARGE,
                           "the answer is larger than %llu bytes", (unsigned long long)max);
    transfer->stored += size;
    return output_write(piece, size, transfer->problem);
}

static size_t body_read(char *piece, size_t one, size_t count, void *context) {
    Transfer *transfer = context;
    const size_t size = one * count;
    long code = 0;
    (void)curl_easy_getinfo(transfer->client->curl, CURLINFO_RESPONSE_CODE, &code);
    if (transfer->stored == transfer->continue_from)
        headers_read(transfer);
    if (transfer->request->output_max > 0 && (code == 200 || code == 206)) {
        transfer->status = body_store(transfer, piece, size);
        return transfer->status == STATUS_OK ? size : 0;
    }
    bytes_put(&transfer->answer->body, piece, size);
    if (!transfer->answer->body.is_failed)
        return size;
    transfer->status =
        problem_set(transfer->problem, STATUS_UNREACHABLE,
                    "%s answers with a document of more than %d bytes; is the server really "
                    "impactd?",
                    transfer->client->url, DOCUMENT_MAX);
    return 0;
}

static Status transfer_failed(const Transfer *transfer, CURLcode code, Problem *problem) {
    const char *url = transfer->client->url, *reason = curl_easy_strerror(code);
    const char *host = strstr(url, "://") != NULL ? strstr(url, "://") + 3 : url;
    // A TLS server closes a plain connection before it sends a byte.
    const bool may_be_tls = !transfer->client->is_tls && transfer->answer->code == 0 &&
                            transfer->headers == 0 && transfer->stored == 0;
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
    const ApiRequest *request = transfer->request;
    const char *type = request->content_type != NULL ? request->content_type : "application/json";
    return header_add(list, "Expect", "") &&
           header_add(list, "Content-Type", request->body != NULL ? type : NULL) &&
           header_add(list, "If-Match", request->if_match) &&
           header_add(list, "Prefer", request->prefer) &&
           header_add(list, "Idempotency-Key", request->idempotency_key) &&
           header_add(list, "If-Range",
                      transfer->continue_from > 0 ? transfer->answer->etag : NULL);
}

static CURLcode transfer_perform(Transfer *transfer, const char *url, struct curl_slist *headers) {
    const ApiClient *client = transfer->client;
    const ApiRequest *request = transfer->request;
    CURL *curl = client->curl;
    const bool is_stream = request->output_max > 0;
    char agent[64];
    // A server that keeps a document back answers once the wait is over; more silence is a failure.
    const double silence = fmin(api_client_left(client) + 5, SILENCE);
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
                     client->has_patience && !is_stream ? (long)ceil(silence) : (long)SILENCE);
    curl_easy_setopt(curl, CURLOPT_HTTPHEADER, headers);
    curl_easy_setopt(curl, CURLOPT_RESUME_FROM_LARGE, (curl_off_t)transfer->continue_from);
    if (client->token != NULL) {
        curl_easy_setopt(curl, CURLOPT_HTTPAUTH, (long)CURLAUTH_BEARER);
        curl_easy_setopt(curl, CURLOPT_XOAUTH2_BEARER, client->token);
    }
    if (client->is_loopback) // a proxy of the environment is not for this machine
        curl_easy_setopt(curl, CURLOPT_PROXY, "");
    if (client->ca_file != NULL)
        curl_easy_setopt(curl, CURLOPT_CAINFO, client->ca_file);
    if (request->body != NULL) {
        curl_easy_setopt(curl, CURLOPT_POSTFIELDS,
                         request->body->at != NULL ? request->body->at : "");
        curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE_LARGE, (curl_off_t)request->body->count);
    }
    curl_easy_setopt(curl, CURLOPT_CUSTOMREQUEST,
                     request->method != NULL ? request->method
                     : request->body != NULL ? "POST"
                                             : "GET");
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
    return transfer->status == STATUS_OK && transfer->stored > 0 && transfer->continue_from == 0 &&
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
    if (transfer->continue_from > 0 && transfer->stored == transfer->continue_from)
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

// One request. STATUS_OK if the server answered, with any status code.
static Status api_exchange(ApiClient *client, const ApiRequest *request, ApiAnswer *answer,
                           Problem *problem) {
    bytes_clear(&answer->body);
    *answer = (ApiAnswer){.body.most = DOCUMENT_MAX};
    Transfer transfer = {
        .client = client, .request = request, .answer = answer, .problem = problem};
    Bytes url = {0};
    bytes_format(&url, "%s%s", client->url, request->path.at);
    if (url.is_failed)
        return client_no_memory(problem);
    bool is_cut = false;
    Status status = transfer_run(&transfer, url.at, &is_cut);
    if (is_cut) {
        transfer.continue_from = transfer.stored;
        transfer.headers = 0;
        status = transfer_run(&transfer, url.at, &is_cut);
    }
    bytes_clear(&url);
    return status;
}

static void reply_fit(char *target, size_t size, const char *text) {
    text_fit(target, size, text != NULL ? text : "");
}

void problem_reply_put(const ProblemReply *reply, Status status, Problem *problem) {
    for (size_t i = 0; i < reply->errors.count; i++) {
        const ReplyFault *one = &reply->errors.at[i];
        Fault fault = {0};
        char place[sizeof fault.pointer];
        // The place of a fault in a table is its cell, not that of a document.
        snprintf(place, sizeof place, "row %llu%s%.100s", (unsigned long long)one->row,
                 one->column != NULL ? ", column " : "", one->column != NULL ? one->column : "");
        reply_fit(fault.pointer, sizeof fault.pointer,
                  one->row != COUNT_ABSENT ? place : one->pointer);
        reply_fit(fault.detail, sizeof fault.detail, one->detail);
        reply_fit(fault.unit, sizeof fault.unit, one->unit);
        reply_fit(fault.did_you_mean, sizeof fault.did_you_mean, one->did_you_mean);
        (void)problem_add_fault(problem, status, &fault);
    }
    if (reply->more < 1000000000)
        problem->count += problem->count > 0 ? reply->more : 0;
    const char *detail = reply->detail != NULL ? reply->detail : reply->title;
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
static Status problem_reply_read(ApiCall *call, Problem *problem) {
    const ProblemReply *reply = &api_reply(call)->self;
    const int code = call->answer.code;
    const Status status = http_status(code, reply->type);
    if (reply->detail != NULL || reply->title != NULL || reply->errors.count > 0)
        problem_reply_put(reply, status, problem);
    else
        (void)problem_set(problem, status, "the server answers %d without a reason", code);
    return status;
}

Status api_ask(ApiCall *call, ApiRequest *request, Problem *problem) {
    ApiAnswer *answer = &call->answer;
    Status status = STATUS_OK;
    if (request->path.is_failed)
        status = problem_set(problem, STATUS_USAGE, "asks for too much at once");
    while (status == STATUS_OK &&
           (status = api_exchange(&call->client, request, answer, problem)) == STATUS_OK) {
        const int code = answer->code;
        if (code == 200 || code == 201 || code == 202 || code == 204)
            break;
        const int pause = answer->retry_after > 0 ? answer->retry_after : 1;
        if ((code != 503 && code != 429) || pause > api_client_left(&call->client))
            status = problem_reply_read(call, problem);
        else
            (void)poll(NULL, 0, 1000 * pause);
    }
    bytes_clear(&request->path);
    return status;
}

Status api_get(ApiCall *call, Bytes path, Problem *problem) {
    return api_ask(call, &(ApiRequest){.path = path}, problem);
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

void api_print(const ApiCall *call) {
    (void)fwrite(call->answer.body.at, 1, call->answer.body.count, stdout);
}

Status api_print_tables(ApiCall *call, const PrintTableView *view, Problem *problem) {
    const Bytes *body = &call->answer.body;
    call->rows = SIZE_MAX;
    if (!((const ClientSettings *)call->settings)->json)
        return print_table_print_json(body->at, body->count, view, stdout, &call->rows, problem);
    api_print(call);
    return STATUS_OK;
}

bool api_is_id(const char *text) {
    const size_t length = strlen(text);
    return length > 0 && length <= 80 &&
           strspn(text, "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-") ==
               length;
}

Status api_unexpected(const char *wanted, Problem *problem) {
    return problem_set(problem, STATUS_UNREACHABLE,
                       "the answer is not %s; is the server really impactd?", wanted);
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

void api_query(Bytes *path, const char *name, const char *value) {
    if (value == NULL)
        return;
    bytes_format(path, "%s%s=", path->at == NULL || strchr(path->at, '?') == NULL ? "?" : "&",
                 name);
    bytes_percent(path, value);
}

void api_query_rows(Bytes *path, const Field *fields, const void *settings, const char *names) {
    char name[64], text[32];
    for (; *names != '\0'; names += strspn(names, " ")) {
        size_t offset = 0;
        snprintf(name, sizeof name, "%.*s", (int)strcspn(names, " "), names);
        names += strlen(name);
        const Field *row = fields_find(fields, name, &offset);
        const void *at = (const char *)settings + offset + row->offset;
        if (row->kind == FIELD_KIND_FLAG)
            api_query(path, name, *(const bool *)at ? "1" : NULL);
        else if (field_is_absent(row, settings))
            continue;
        else if (row->kind == FIELD_KIND_CHOICE)
            api_query(path, name, row->choices[*(const int *)at]);
        else if (row->kind == FIELD_KIND_TEXT)
            api_query(path, name, *(char *const *)at);
        else
            api_query(path, name,
                      text_real(text, row->kind == FIELD_KIND_REAL
                                          ? *(const double *)at
                                          : (double)*(const uint64_t *)at));
    }
}
