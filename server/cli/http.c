// Whatever answers at the other end may be anything: headers and bodies are counted as they come,
// nothing is unpacked, no redirect is followed (the token would go with it), and only http and
// https are spoken.
#include "server/cli/http.h"

#include <curl/curl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "server/api/app.h"

struct Http {
    CURL *curl;
    char *url, *token, *ca_file;
    bool is_loopback, is_tls;
};

// One exchange while it goes on.
typedef struct Transfer {
    Http *http;
    const HttpAsk *ask;
    HttpAnswer *answer;
    Problem *problem;
    Status status;  // not OK: the body is not wanted any more, and why
    size_t headers; // [B] so far
    uint64_t taken; // [B] handed to ask->take
    uint64_t continue_from;
} Transfer;

static char *copy(const char *text) {
    return text != NULL ? strdup(text) : NULL;
}

static bool host_is_loopback(const char *host) {
    const bool is_number = strspn(host, "0123456789.") == strlen(host);
    return strcasecmp(host, "localhost") == 0 || strcmp(host, "[::1]") == 0 ||
           (is_number && strncmp(host, "127.", 4) == 0);
}

static Status url_refuse(const char *url, const char *why, Problem *problem) {
    return problem_add(problem, STATUS_USAGE, "--server",
                       "must be like http://127.0.0.1:8080 or https://HOST/PATH, is %.120s: %s",
                       url, why);
}

static Status url_judge(Http *http, const char *url, Problem *problem) {
    CURLU *parts = curl_url();
    char *scheme = NULL, *host = NULL, *other = NULL;
    if (parts == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory");
    const char *why = NULL;
    for (const char *c = url; *c != '\0'; c++)
        if ((unsigned char)*c <= ' ' || *c == 0x7f)
            why = "it holds a blank or a control character";
    if (why == NULL && curl_url_set(parts, CURLUPART_URL, url, 0) != CURLUE_OK)
        why = "it cannot be read";
    else if (why == NULL && (curl_url_get(parts, CURLUPART_SCHEME, &scheme, 0) != CURLUE_OK ||
                             (strcmp(scheme, "http") != 0 && strcmp(scheme, "https") != 0)))
        why = "only http and https are spoken";
    else if (why == NULL && curl_url_get(parts, CURLUPART_HOST, &host, 0) != CURLUE_OK)
        why = "it names no host";
    const CURLUPart unwanted[] = {CURLUPART_USER, CURLUPART_PASSWORD, CURLUPART_QUERY,
                                  CURLUPART_FRAGMENT};
    for (size_t i = 0; why == NULL && i < COUNT(unwanted); i++)
        if (curl_url_get(parts, unwanted[i], &other, 0) == CURLUE_OK) {
            curl_free(other);
            why = "a user, a query or a fragment has no place in it; a token is read from "
                  "IMPACTD_TOKEN or --token-file";
        }
    if (why == NULL) {
        http->is_tls = strcmp(scheme, "https") == 0;
        http->is_loopback = host_is_loopback(host);
    }
    curl_free(scheme);
    curl_free(host);
    curl_url_cleanup(parts);
    return why == NULL ? STATUS_OK : url_refuse(url, why, problem);
}

Status http_open(const HttpServer *server, Http **http, Problem *problem) {
    *http = calloc(1, sizeof **http);
    if (*http == NULL || curl_global_init(CURL_GLOBAL_DEFAULT) != CURLE_OK) {
        free(*http);
        *http = NULL;
        return problem_set(problem, STATUS_NO_MEMORY, "no memory");
    }
    Http *own = *http;
    own->curl = curl_easy_init();
    own->url = copy(server->url);
    own->token = copy(server->token);
    own->ca_file = copy(server->ca_file);
    Status status = STATUS_OK;
    if (own->curl == NULL || own->url == NULL || (own->token == NULL) != (server->token == NULL) ||
        (own->ca_file == NULL) != (server->ca_file == NULL))
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory");
    if (status == STATUS_OK)
        status = url_judge(own, own->url, problem);
    if (status != STATUS_OK) {
        http_close(own);
        *http = NULL;
        return status;
    }
    for (size_t length = strlen(own->url); length > 0 && own->url[length - 1] == '/'; length--)
        own->url[length - 1] = '\0';
    return STATUS_OK;
}

void http_close(Http *http) {
    if (http == NULL)
        return;
    curl_easy_cleanup(http->curl);
    free(http->url);
    free(http->token);
    free(http->ca_file);
    free(http);
    curl_global_cleanup();
}

bool http_exposes_token(const Http *http) {
    return http->token != NULL && !http->is_tls && !http->is_loopback;
}

// The value of a header of the answer, "" where it has none.
static void header_get(const Http *http, const char *name, char *value, size_t room) {
    struct curl_header *header;
    const bool is_there =
        curl_easy_header(http->curl, name, 0, CURLH_HEADER, -1, &header) == CURLHE_OK;
    text_fit(value, room, is_there ? header->value : "");
}

// What is kept of the headers, once they are all there.
static void headers_read(Transfer *transfer) {
    HttpAnswer *answer = transfer->answer;
    curl_off_t seconds = 0;
    char etag[sizeof answer->etag];
    header_get(transfer->http, "Content-Type", answer->content_type, sizeof answer->content_type);
    answer->content_type[strcspn(answer->content_type, "; \t")] = '\0';
    header_get(transfer->http, "ETag", etag, sizeof etag);
    if (transfer->continue_from == 0)
        text_fit(answer->etag, sizeof answer->etag, etag[0] == '"' ? etag : "");
    (void)curl_easy_getinfo(transfer->http->curl, CURLINFO_RETRY_AFTER, &seconds);
    answer->retry_after = seconds > 86400 ? 86400 : (int)seconds;
}

// Whether the rest of a body begins where the first part ended.
static bool is_right_range(const Transfer *transfer) {
    char expected[64], value[64];
    snprintf(expected, sizeof expected, "bytes %llu-", (unsigned long long)transfer->continue_from);
    header_get(transfer->http, "Content-Range", value, sizeof value);
    return strncasecmp(value, expected, strlen(expected)) == 0;
}

static size_t header_take(char *line, size_t one, size_t count, void *of) {
    Transfer *transfer = of;
    (void)line;
    transfer->headers += one * count;
    if (transfer->headers <= HTTP_HEADERS_MAX)
        return one * count;
    transfer->status = problem_set(transfer->problem, STATUS_UNREACHABLE,
                                   "%s answers with more than %d bytes of headers: this is "
                                   "no impactd",
                                   transfer->http->url, HTTP_HEADERS_MAX);
    return 0;
}

static size_t body_take(char *piece, size_t one, size_t count, void *of) {
    Transfer *transfer = of;
    const size_t size = one * count;
    long code = 0;
    (void)curl_easy_getinfo(transfer->http->curl, CURLINFO_RESPONSE_CODE, &code);
    if (transfer->taken == transfer->continue_from)
        headers_read(transfer);
    if (transfer->continue_from > 0 && (code != 206 || !is_right_range(transfer))) {
        transfer->status = problem_set(transfer->problem, STATUS_UNREACHABLE,
                                       "the answer was cut off after %llu bytes and cannot be "
                                       "gone on with",
                                       (unsigned long long)transfer->continue_from);
        return 0;
    }
    if (transfer->ask->take != NULL && (code == 200 || transfer->continue_from > 0)) {
        if (size > transfer->ask->most - transfer->taken) {
            transfer->status = problem_set(transfer->problem, STATUS_TOO_LARGE,
                                           "the answer is larger than %llu bytes",
                                           (unsigned long long)transfer->ask->most);
            return 0;
        }
        transfer->status =
            transfer->ask->take(transfer->ask->context, piece, size, transfer->problem);
        transfer->taken += size;
        return transfer->status == STATUS_OK ? size : 0;
    }
    bytes_put(&transfer->answer->body, piece, size);
    if (!transfer->answer->body.is_failed)
        return size;
    transfer->status = problem_set(transfer->problem, STATUS_UNREACHABLE,
                                   "%s answers with a document of more than %d bytes",
                                   transfer->http->url, HTTP_DOCUMENT_MAX);
    return 0;
}

static const char *behind_scheme(const char *url) {
    return strstr(url, "://") != NULL ? strstr(url, "://") + 3 : url;
}

static Status failure_tell(const Transfer *transfer, CURLcode code, Problem *problem) {
    const char *url = transfer->http->url;
    // A TLS server closes on whoever speaks plainly, before a byte of an answer.
    const bool may_be_tls = !transfer->http->is_tls && transfer->answer->code == 0 &&
                            transfer->headers == 0 && transfer->taken == 0;
    const char *hint = may_be_tls ? "; if the server speaks TLS, name it as https://" : "";
    const char *hinted = may_be_tls ? behind_scheme(url) : "";
    switch (code) {
    case CURLE_COULDNT_CONNECT:
    case CURLE_COULDNT_RESOLVE_HOST:
    case CURLE_COULDNT_RESOLVE_PROXY:
        return problem_set(
            problem, STATUS_UNREACHABLE,
            "no server answers at %s (%s); start one with \"impactd serve\", or name "
            "another by --server URL or IMPACTD_SERVER",
            url, curl_easy_strerror(code));
    case CURLE_SSL_CONNECT_ERROR:
        return problem_set(problem, STATUS_UNREACHABLE,
                           "no TLS connection to %s can be made (%s); if the server speaks plain "
                           "HTTP, name it as http://%s",
                           url, curl_easy_strerror(code), behind_scheme(url));
    case CURLE_PEER_FAILED_VERIFICATION:
    case CURLE_SSL_CACERT_BADFILE:
        return problem_set(problem, STATUS_UNREACHABLE,
                           "%s cannot be trusted (%s); --ca-file FILE names the certificate that "
                           "signed the server's",
                           url, curl_easy_strerror(code));
    case CURLE_UNSUPPORTED_PROTOCOL:
    case CURLE_WEIRD_SERVER_REPLY:
        return problem_set(problem, STATUS_UNREACHABLE,
                           "what answers at %s does not speak HTTP%s%s", url, hint, hinted);
    case CURLE_OPERATION_TIMEDOUT:
        return problem_set(problem, STATUS_UNREACHABLE, "%s has been silent for too long", url);
    case CURLE_OUT_OF_MEMORY:
        return problem_set(problem, STATUS_NO_MEMORY, "no memory");
    default:
        return problem_set(problem, STATUS_UNREACHABLE, "the connection to %s broke: %s%s%s", url,
                           curl_easy_strerror(code), hint, hinted);
    }
}

static bool header_put(struct curl_slist **list, const char *name, const char *value) {
    Bytes line = {.most = 8192};
    bytes_format(&line, "%s: %s", name, value);
    struct curl_slist *longer = line.is_failed ? NULL : curl_slist_append(*list, line.at);
    bytes_clear(&line);
    if (longer != NULL)
        *list = longer;
    return longer != NULL;
}

static bool headers_put(const Transfer *transfer, struct curl_slist **list) {
    const HttpAsk *ask = transfer->ask;
    char token[600], range[64], agent[64];
    snprintf(agent, sizeof agent, "impactd/%s", program_version);
    snprintf(token, sizeof token, "Bearer %s",
             transfer->http->token != NULL ? transfer->http->token : "");
    snprintf(range, sizeof range, "bytes=%llu-", (unsigned long long)transfer->continue_from);
    bool is_well = header_put(list, "User-Agent", agent) && header_put(list, "Expect", "");
    if (transfer->http->token != NULL)
        is_well = is_well && header_put(list, "Authorization", token);
    if (ask->body != NULL)
        is_well = is_well &&
                  header_put(list, "Content-Type",
                             ask->content_type != NULL ? ask->content_type : "application/json");
    if (ask->if_match != NULL)
        is_well = is_well && header_put(list, "If-Match", ask->if_match);
    if (ask->prefer != NULL)
        is_well = is_well && header_put(list, "Prefer", ask->prefer);
    if (ask->idempotency_key != NULL)
        is_well = is_well && header_put(list, "Idempotency-Key", ask->idempotency_key);
    if (transfer->continue_from > 0)
        is_well = is_well && header_put(list, "Range", range) &&
                  header_put(list, "If-Range", transfer->answer->etag);
    return is_well;
}

static CURLcode exchange(Transfer *transfer, const char *url, struct curl_slist *headers) {
    const Http *http = transfer->http;
    const HttpAsk *ask = transfer->ask;
    CURL *curl = http->curl;
    curl_easy_reset(curl); // the connection stays
    curl_easy_setopt(curl, CURLOPT_URL, url);
    curl_easy_setopt(curl, CURLOPT_PATH_AS_IS, 1L);
    curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https");
    curl_easy_setopt(curl, CURLOPT_HTTP_VERSION, (long)CURL_HTTP_VERSION_1_1);
    curl_easy_setopt(curl, CURLOPT_FOLLOWLOCATION, 0L);
    curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
    curl_easy_setopt(curl, CURLOPT_BUFFERSIZE, 262144L);
    curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT, 10L);
    curl_easy_setopt(curl, CURLOPT_LOW_SPEED_LIMIT, 1L);
    curl_easy_setopt(curl, CURLOPT_LOW_SPEED_TIME, (long)HTTP_SILENCE);
    curl_easy_setopt(curl, CURLOPT_HTTPHEADER, headers);
    if (ask->within > 0)
        curl_easy_setopt(curl, CURLOPT_TIMEOUT_MS,
                         ask->within < 1e6 ? (long)(1000 * ask->within) + 1 : 0L);
    if (http->is_loopback) // a proxy of the environment is not meant for these
        curl_easy_setopt(curl, CURLOPT_PROXY, "");
    if (http->ca_file != NULL)
        curl_easy_setopt(curl, CURLOPT_CAINFO, http->ca_file);
    if (ask->body != NULL) {
        curl_easy_setopt(curl, CURLOPT_POSTFIELDS, ask->body->at != NULL ? ask->body->at : "");
        curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE_LARGE, (curl_off_t)ask->body->count);
    }
    curl_easy_setopt(curl, CURLOPT_CUSTOMREQUEST, ask->method);
    curl_easy_setopt(curl, CURLOPT_HEADERFUNCTION, header_take);
    curl_easy_setopt(curl, CURLOPT_HEADERDATA, transfer);
    curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, body_take);
    curl_easy_setopt(curl, CURLOPT_WRITEDATA, transfer);
    return curl_easy_perform(curl);
}

// Whether the rest of a body that was cut off may be asked for.
static bool can_go_on(const Transfer *transfer, CURLcode code) {
    char ranges[16];
    header_get(transfer->http, "Accept-Ranges", ranges, sizeof ranges);
    return transfer->status == STATUS_OK && transfer->taken > 0 &&
           transfer->answer->etag[0] != '\0' && strcasecmp(ranges, "bytes") == 0 &&
           (code == CURLE_PARTIAL_FILE || code == CURLE_RECV_ERROR || code == CURLE_GOT_NOTHING);
}

static Status attempt(Transfer *transfer, const char *url, bool *is_cut, Problem *problem) {
    struct curl_slist *headers = NULL;
    CURLcode code = CURLE_OUT_OF_MEMORY;
    if (headers_put(transfer, &headers))
        code = exchange(transfer, url, headers);
    curl_slist_free_all(headers);
    *is_cut = code != CURLE_OK && transfer->continue_from == 0 && can_go_on(transfer, code);
    if (transfer->status != STATUS_OK)
        return transfer->status;
    if (code != CURLE_OK)
        return *is_cut ? STATUS_UNREACHABLE : failure_tell(transfer, code, problem);
    long status = 0;
    const char *location = NULL;
    headers_read(transfer);
    (void)curl_easy_getinfo(transfer->http->curl, CURLINFO_RESPONSE_CODE, &status);
    (void)curl_easy_getinfo(transfer->http->curl, CURLINFO_REDIRECT_URL, &location);
    // The rest of a body that was cut off makes it whole.
    transfer->answer->code = transfer->continue_from > 0 && status == 206 ? 200 : (int)status;
    if (status >= 300 && status < 400)
        return problem_set(problem, STATUS_UNREACHABLE,
                           "%s answers %ld and points to %.200s; redirects are not followed: give "
                           "the address itself by --server",
                           transfer->http->url, status, location != NULL ? location : "nothing");
    return STATUS_OK;
}

Status http_ask(Http *http, const HttpAsk *ask, HttpAnswer *answer, Problem *problem) {
    *answer = (HttpAnswer){.body.most = HTTP_DOCUMENT_MAX};
    Transfer transfer = {.http = http, .ask = ask, .answer = answer, .problem = problem};
    Bytes url = {.most = 16384};
    bytes_text(&url, http->url);
    bytes_text(&url, ask->path);
    if (url.is_failed)
        return problem_set(problem, STATUS_USAGE, "the address would be longer than 16384 bytes");
    bool is_cut = false;
    Status status = attempt(&transfer, url.at, &is_cut, problem);
    if (is_cut) {
        transfer.continue_from = transfer.taken;
        transfer.headers = 0;
        status = attempt(&transfer, url.at, &is_cut, problem);
    }
    bytes_clear(&url);
    return status;
}

void http_answer_clear(HttpAnswer *answer) {
    bytes_clear(&answer->body);
    *answer = (HttpAnswer){0};
}

void http_encode(Bytes *bytes, const char *text) {
    static const char plain[] =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~,";
    for (const char *c = text; *c != '\0'; c++)
        if (strchr(plain, *c) != NULL)
            bytes_put(bytes, c, 1);
        else
            bytes_format(bytes, "%%%02X", (unsigned)(unsigned char)*c);
}

void http_query(Bytes *path, const char *name, const char *value) {
    if (value == NULL)
        return;
    bytes_format(path, "%s%s=", path->at == NULL || strchr(path->at, '?') == NULL ? "?" : "&",
                 name);
    http_encode(path, value);
}

void http_query_real(Bytes *path, const char *name, double value) {
    char text[32];
    if (!isnan(value))
        http_query(path, name, text_real(text, value));
}
