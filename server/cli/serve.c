// impactd serve: the server. Opens the database, the job manager and the HTTP server in this order
// and waits for SIGTERM or SIGINT. Then it stops requests, jobs and background tasks before it
// closes what they use.
#include <errno.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "core/math/fft.h"
#include "core/study/sweep.h"
#include "server/api/app.h"
#include "server/cli/files.h"
#include "server/http/server.h"
#include "server/options.h"
#include "server/util/clock.h"
#include "server/util/process.h"

typedef struct ServeSettings {
    char *listen, *data, *config, *base_url, *tls_cert, *tls_key;
    Texts host, allow_origin;
    uint64_t workers, queue, queue_bytes, max_body, max_samples, max_impacts, max_run_bytes,
        max_points, cache_bytes, store_bytes;
    uint64_t quota, keep_jobs, keep_bytes;
    double max_cpu_seconds, max_study_seconds, rate, keep_days;
    int executor;
    char *shared, *partition;
    Texts sbatch_option;
    double cluster_seconds, cluster_poll;
    int journal;
    bool require_tokens, print_config;
} ServeSettings;

// BACKGROUND_TASKS at the same time; 1/RESPONSE_SHARE of the cache is for responses.
enum { GRACE_MS = 1500, BACKGROUND_TASKS = 2, RESPONSE_SHARE = 4 };

#define MIB ((double)(1 << 20))

// clang-format off
static const Field serve_fields[] = {
    FIELD_TEXT(ServeSettings, listen, 255, PRESENCE_OPTIONAL, 0, "HOST:PORT, a numeric address or localhost; port 0: any free port; other than loopback requires a token (127.0.0.1:8080)"),
    FIELD_TEXT(ServeSettings, data, 4000, PRESENCE_OPTIONAL, 0, "directory of the database ($XDG_STATE_HOME/impactd, else ~/.local/state/impactd)"),
    FIELD_COUNT(ServeSettings, workers, NULL, WITHIN(0, 256), 0, "number of concurrent simulations; 0: number of processors"),
    FIELD_COUNT(ServeSettings, queue, NULL, WITHIN(1, 1e6), 10000, "maximum number of unfinished jobs; more are answered 503"),
    FIELD_COUNT(ServeSettings, queue_bytes, "B", WITHIN(1024, 1099511627776.0), 256 * MIB, "maximum size of the scenes of all unfinished jobs; more are answered 503"),
    FIELD_COUNT(ServeSettings, quota, NULL, WITHIN(0, 1e6), 0, "maximum number of unfinished jobs per token, more are answered 429; 0: no limit"),
    FIELD_REAL(ServeSettings, rate, "1/min", WITHIN(0, 1e9), 0, "rate limit of jobs per token, more are answered 429; 0: no limit"),
    FIELD_COUNT(ServeSettings, max_body, "B", WITHIN(1024, 1024 * MIB), 16 * MIB, "maximum size of a request body, a larger one is answered 413"),
    FIELD_COUNT(ServeSettings, max_samples, NULL, WITHIN(2, 1073741824.0), 33554432, "maximum number of samples per channel of a scene"),
    FIELD_COUNT(ServeSettings, max_impacts, NULL, WITHIN(1, 1e9), 5e5, "maximum number of impacts of a run; it is stopped beyond"),
    FIELD_REAL(ServeSettings, max_cpu_seconds, "s", WITHIN(1e-6, 1e9), SIMULATION_CPU_SECONDS, "reject scenes predicted to need more CPU time; running jobs are stopped at about 3 times this"),
    FIELD_REAL(ServeSettings, max_study_seconds, "s", WITHIN(0, 1e9), 3600, "reject studies predicted to need more CPU time; 0: no limit"),
    FIELD_COUNT(ServeSettings, max_run_bytes, "B", WITHIN(1 << 20, 1099511627776.0), SIMULATION_BYTES, "reject scenes predicted to need more memory"),
    FIELD_COUNT(ServeSettings, max_points, NULL, WITHIN(1, 1e8), SWEEP_POINTS, "maximum number of points of a sweep"),
    FIELD_COUNT(ServeSettings, cache_bytes, "B", WITHIN(0, 1099511627776.0), 256 * MIB, "in-memory cache: 1/4 for responses, 3/4 for results"),
    FIELD_COUNT(ServeSettings, store_bytes, "B", WITHIN(0, 1099511627776.0), 1024 * MIB, "disk space for series that are expensive to compute"),
    FIELD_REAL(ServeSettings, keep_days, "d", WITHIN(0, 36500), 0, "delete jobs that finished longer ago; a result is deleted with its last job; 0: never"),
    FIELD_COUNT(ServeSettings, keep_jobs, NULL, WITHIN(0, 1e12), 0, "number of finished jobs to keep, the oldest are deleted first; 0: all"),
    FIELD_COUNT(ServeSettings, keep_bytes, "B", WITHIN(0, 1e18), 0, "size of the database beyond which the oldest finished jobs are deleted; 0: no limit"),
    CLUSTER_ROWS(ServeSettings, "what makes the members of long sweeps, ensembles and fragility studies: threads of this server, or slurm"),
    FIELD_REAL(ServeSettings, cluster_seconds, "s", WITHIN(0, 1e12), 60, "studies that are predicted to need less CPU time are made by this server's threads"),
    FIELD_REAL(ServeSettings, cluster_poll, "s", WITHIN(0.05, 3600), 5, "shortest time between two questions to Slurm"),
    FIELD_TEXTS(ServeSettings, host, NULL, NULL, 64, PRESENCE_OPTIONAL, 0, "additional accepted Host name; repeatable, or a list separated by commas"),
    FIELD_TEXTS(ServeSettings, allow_origin, NULL, NULL, 64, PRESENCE_OPTIONAL, 0, "another site whose pages may use the API, as https://lab.example.org; may be repeated, or a list with commas"),
    FIELD_TEXT(ServeSettings, base_url, 255, PRESENCE_OPTIONAL, 0, "URL for clients behind a proxy, as https://sim.example.org/impactd; links begin with it"),
    FIELD_FLAG(ServeSettings, require_tokens, false, "require a token on loopback too, also if none exists"),
    FIELD_TEXT(ServeSettings, tls_cert, 4000, PRESENCE_OPTIONAL, 0, "PEM file of the certificate, for HTTPS"),
    FIELD_TEXT(ServeSettings, tls_key, 4000, PRESENCE_OPTIONAL, 0, "PEM file of its key"),
    FIELD_CHOICE(ServeSettings, journal, log_mode_names, LOG_ERRORS, "requests to log on standard error: off, errors or all"),
    FIELD_TEXT(ServeSettings, config, 4000, PRESENCE_OPTIONAL, 0, "file of settings, one \"name = value\" per line"),
    FIELD_FLAG(ServeSettings, print_config, false, "print each setting and its origin, and exit"),
    FIELD_END,
};
// clang-format on

static const OptionGroup serve_groups[] = {
    {"listen", "Address and data"},  {"workers", "Jobs"},
    {"max_body", "Limits"},          {"cache_bytes", "Cache and retention"},
    {"executor", "Cluster"},         {"host", "Network and access"},
    {"journal", "Log and settings"}, {NULL, NULL},
};

// Defaults that depend on the machine.
static Status serve_complete(ServeSettings *settings, Problem *problem) {
    TRY(command_data_folder(&settings->data, problem));
    if (settings->listen == NULL && (settings->listen = strdup("127.0.0.1:8080")) == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory");
    if (settings->workers == 0) {
        const long processors = sysconf(_SC_NPROCESSORS_ONLN);
        settings->workers = processors > 0 ? (uint64_t)processors : 1;
    }
    return STATUS_OK;
}

static Status setting_too_small(Problem *problem, const char *small, uint64_t value,
                                const char *large, uint64_t other, const char *why) {
    return problem_add(problem, STATUS_USAGE, small, "must be at least %s, %llu, is %llu: %s",
                       large, (unsigned long long)other, (unsigned long long)value, why);
}

// Checks settings against each other.
static Status serve_check(const ServeSettings *settings, Problem *problem) {
    Status status = STATUS_OK;
    if (settings->queue_bytes < settings->max_body)
        status = setting_too_small(problem, "--queue-bytes", settings->queue_bytes, "--max-body",
                                   settings->max_body,
                                   "the queue must have space for the largest scene");
    if (settings->queue < settings->workers)
        status =
            setting_too_small(problem, "--queue", settings->queue, "--workers", settings->workers,
                              "more workers than --queue slots would stay idle");
    if (settings->quota > settings->queue)
        status =
            problem_add(problem, STATUS_USAGE, "--quota", "must be at most --queue, %llu, is %llu",
                        (unsigned long long)settings->queue, (unsigned long long)settings->quota);
    if (settings->executor == EXECUTOR_SLURM &&
        cluster_check_folder(settings->shared, problem) != STATUS_OK)
        status = STATUS_USAGE;
    if (settings->keep_bytes > 0 && settings->keep_bytes < 1 << 20)
        status = problem_add(problem, STATUS_USAGE, "--keep-bytes",
                             "must be at least %.0f B, the size of an empty database, or 0 for no "
                             "limit, is %llu",
                             MIB, (unsigned long long)settings->keep_bytes);
    return status;
}

static bool is_host(const char *name) {
    static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-._";
    const size_t size = strlen(name);
    return name[0] == '[' ? size > 2 && strcspn(name, "]") == size - 1
                          : size < 200 && strspn(name, plain) == size;
}

// As browsers send it: scheme and host in lower case, perhaps a port, nothing else.
static bool is_origin(const char *text) {
    const char *host = strstr(text, "://");
    if (host == NULL || (strncmp(text, "http://", 7) != 0 && strncmp(text, "https://", 8) != 0))
        return false;
    const size_t size = strspn(host + 3, "abcdefghijklmnopqrstuvwxyz0123456789-._[]:");
    return size > 0 && host[3 + size] == '\0';
}

// Adds each item of "a.example.org, b.example.org" once.
static Status serve_add_list(Texts *texts, const char *list, bool (*is_valid)(const char *text),
                             Problem *problem) {
    Status status = STATUS_OK;
    for (size_t size; *(list += strspn(list, ", ")) != '\0'; list += size) {
        char text[256];
        size_t i = 0;
        size = strcspn(list, ", ");
        snprintf(text, sizeof text, "%.*s", (int)(size < 255 ? size : 255), list);
        while (i < texts->count && strcmp(texts->at[i], text) != 0)
            i++;
        if (!is_valid(text))
            status = problem_add(
                problem, STATUS_USAGE, is_valid == is_host ? "--host" : "--allow-origin",
                is_valid == is_host
                    ? "must be a name without port or http://, is \"%.80s\""
                    : "must be as browsers send it, https://lab.example.org or with a port, in "
                      "lower case and without a path, is \"%.80s\"",
                text);
        else if (i == texts->count && texts_append(texts, text) != STATUS_OK)
            return problem_set(problem, STATUS_NO_MEMORY, "no memory for names of hosts");
    }
    return status;
}

// The origins of --allow-origin, and the Host names that requests may have: those of loopback, of
// the address, of --host and of the base URL. Both end with NULL.
static Status hosts_set(const ServeSettings *settings, const Address *address, const BaseUrl *url,
                        Texts *hosts, Texts *origins, Problem *problem) {
    Status status = STATUS_OK;
    char name[80];
    const bool is_any = address_is_any(address), is_v6 = strchr(address->host, ':') != NULL;
    snprintf(name, sizeof name, "%s%s%s", is_v6 ? "[" : "", address->host, is_v6 ? "]" : "");
    if (is_any || address_is_loopback(address))
        for (size_t i = 0; loopback_hosts.names[i] != NULL; i++)
            TRY(serve_add_list(hosts, loopback_hosts.names[i], is_host, problem));
    TRY(serve_add_list(hosts, is_any ? "" : name, is_host, problem));
    for (size_t i = 0; i < settings->host.count; i++)
        if (serve_add_list(hosts, settings->host.at[i], is_host, problem) != STATUS_OK)
            status = problem->status;
    for (size_t i = 0; i < settings->allow_origin.count; i++)
        if (serve_add_list(origins, settings->allow_origin.at[i], is_origin, problem) != STATUS_OK)
            status = problem->status;
    TRY(serve_add_list(hosts, url->host, is_host, problem));
    return list_append(hosts, sizeof *hosts->at) != NULL &&
                   list_append(origins, sizeof *origins->at) != NULL
               ? status
               : problem_set(problem, STATUS_NO_MEMORY, "no memory for names of hosts");
}

// `is_again`: at a signal, where a pipe would keep the server waiting for its writer.
static Status pem_read(const char *option, const char *path, bool is_secret, bool is_again,
                       Bytes *text, Problem *problem) {
    enum { PEM_MAX = 1 << 20 };
    struct stat facts;
    errno = 0;
    if (is_again && stat(path, &facts) == 0 && S_ISFIFO(facts.st_mode))
        return problem_add(problem, STATUS_USAGE, option,
                           "is a pipe, which cannot be read again: %s", path);
    if (input_read(path, text, NULL) != STATUS_OK && errno != 0)
        return problem_add(problem, STATUS_USAGE, option, "cannot be read: %s: %s", path,
                           strerror(errno));
    if (is_secret && stat(path, &facts) == 0 && (facts.st_mode & S_IROTH) != 0)
        return problem_add(problem, STATUS_USAGE, option,
                           "can be read by everyone on this machine; chmod 600 %s", path);
    if (text->at == NULL || text->count == 0 || text->count > PEM_MAX ||
        strlen(text->at) != text->count)
        return problem_add(problem, STATUS_USAGE, option,
                           "%s is not a PEM file of at most a megabyte", path);
    return STATUS_OK;
}

// Uses the certificate of the settings, if there is one. STATUS_USAGE: the one in use stays.
static Status certificate_read(const ServeSettings *settings, bool is_again, Problem *problem) {
    const char *cert = settings->tls_cert, *key = settings->tls_key;
    Bytes cert_text = {0}, key_text = {0};
    if (cert == NULL && key == NULL)
        return STATUS_OK;
    if (cert == NULL || key == NULL)
        return problem_add(problem, STATUS_USAGE, cert != NULL ? "--tls-cert" : "--tls-key",
                           "needs %s FILE too", cert != NULL ? "--tls-key" : "--tls-cert");
    const Status all[] = {pem_read("--tls-cert", cert, false, is_again, &cert_text, problem),
                          pem_read("--tls-key", key, true, is_again, &key_text, problem)};
    Status status = status_first(all, COUNT(all));
    if (status == STATUS_OK)
        status = tls_use(cert_text.at, cert, key_text.at, key, problem);
    bytes_clear(&cert_text);
    bytes_clear(&key_text);
    return status;
}

// STATUS_FORBIDDEN if tokens are required and none is valid.
static Status tokens_require(const Address *address, size_t valid, Problem *problem) {
    const bool is_loopback = address_is_loopback(address);
    if (valid > 0)
        return STATUS_OK;
    return problem_set(problem, STATUS_FORBIDDEN,
                       "does not listen on %s%s: there is no valid token; create one with impactd "
                       "token create --name NAME --scopes read,submit, and the same --data DIR if "
                       "it is given here%s",
                       address->host, is_loopback ? " with --require-tokens" : "",
                       is_loopback ? "" : ", or listen on 127.0.0.1");
}

static void serve_greet(const Server *server, const ServeSettings *settings, const App *app,
                        bool needs_token) {
    const char *url = app->base_url[0] != '\0' ? app->base_url : server_url(server);
    printf("impactd %s listens on %s\n", program_version, server_url(server));
    printf("data in %s, %llu workers; Ctrl-C stops\n\n", settings->data,
           (unsigned long long)settings->workers);
    const char *header = needs_token ? "-H \"Authorization: Bearer $IMPACTD_TOKEN\" " : "";
    printf("curl -s %s%s/v1/examples/paper_free_sponge | curl -s %s--json @- %s/v1/jobs\n", header,
           url, header, url);
    fflush(stdout);
}

static void forget_answers(void *response_cache) {
    response_cache_clear(response_cache);
}

// SIGHUP: reads a renewed certificate.
static void serve_reload(const ServeSettings *settings, Problem *problem) {
    problem_clear(problem);
    if (settings->tls_cert == NULL)
        fprintf(stderr, "impactd: SIGHUP: without TLS there is nothing to reload\n");
    else if (certificate_read(settings, true, problem) == STATUS_OK)
        fprintf(stderr, "impactd: SIGHUP: the certificate in %s is in use\n", settings->tls_cert);
    else
        fprintf(stderr, "impactd: SIGHUP: the certificate is unchanged: %s\n", problem->detail);
}

// Waits for a signal that ends the program and notifies the watchdog of systemd meanwhile. A
// terminal that is closed ends the program that was started in it.
static int serve_wait(const sigset_t *signals, const ServeSettings *settings, Problem *problem) {
    const bool has_terminal = isatty(STDIN_FILENO) != 0;
    const int64_t period_ms = process_watchdog_ms();
    const struct timespec period = {.tv_sec = (time_t)(period_ms / 1000),
                                    .tv_nsec = (long)(period_ms % 1000) * 1000000};
    for (;;) {
        const int signal =
            period_ms > 0 ? sigtimedwait(signals, NULL, &period) : sigwaitinfo(signals, NULL);
        if (signal == SIGHUP && (!has_terminal || isatty(STDIN_FILENO) != 0))
            serve_reload(settings, problem);
        else if (signal > 0)
            return signal;
        else if (errno == EAGAIN)
            process_notify_systemd("WATCHDOG=1");
    }
}

// From here on a second signal kills the program; acknowledged jobs are in the database.
static void signals_unblock(const sigset_t *signals) {
    signal(SIGHUP, SIG_IGN);
    signal(SIGTERM, SIG_DFL);
    signal(SIGINT, SIG_DFL);
    pthread_sigmask(SIG_UNBLOCK, signals, NULL);
}

// What serve opens, in this order, and closes in the opposite one.
typedef struct Serving {
    App app;
    AccessControl access;
    Router router;
    ServerSettings http;
    Texts hosts, origins;
    AcceptedHosts accepted;
    Server *server;
} Serving;

static void serve_until_stopped(Serving *serving, const ServeSettings *settings,
                                const sigset_t *signals, Problem *problem) {
    atomic_store(&serving->app.server, serving->server);
    serve_greet(serving->server, settings, &serving->app,
                tokens_usable(serving->access.tokens) > 0);
    process_notify_systemd("READY=1");
    const int signal = serve_wait(signals, settings, problem);
    process_notify_systemd("STOPPING=1");
    atomic_store(&serving->app.is_stopping, true);
    signals_unblock(signals);
    Bytes line = {0};
    bytes_format(&line, "%s, stopping",
                 signal == SIGINT   ? "interrupted"
                 : signal == SIGHUP ? "terminal closed"
                                    : "terminated");
    log_write(&line);
    bytes_clear(&line);
}

static Status serve_open_jobs(App *app, const ServeSettings *settings, Problem *problem) {
    const JobManagerSettings job_settings = {
        .workers = settings->workers,
        .queue_most = settings->queue,
        .queue_bytes = settings->queue_bytes,
        .cache_bytes = settings->cache_bytes - settings->cache_bytes / RESPONSE_SHARE,
        .store_bytes = settings->store_bytes,
        .quota = settings->quota,
        .rate = settings->rate,
        .study_seconds = settings->max_study_seconds,
        .memory_bytes = 2 * settings->max_run_bytes,
        .deleted = {app->response_cache, forget_answers},
        .limits = {.samples = settings->max_samples,
                   .impacts = settings->max_impacts,
                   .steps = settings->max_cpu_seconds / SOLVER_STEP,
                   .bytes = (double)settings->max_run_bytes,
                   .document_bytes = DOCUMENT_BYTES,
                   .points = settings->max_points},
        .has_maintenance = true,
        .keep = {settings->keep_days, settings->keep_jobs, settings->keep_bytes},
        .cluster = {.shared = settings->executor == EXECUTOR_SLURM ? settings->shared : NULL,
                    .data = settings->data,
                    .slurm = {settings->partition, settings->sbatch_option},
                    .seconds = settings->cluster_seconds,
                    .poll_seconds = settings->cluster_poll,
                    .attempts = 5}};
    return jobs_open(app->db, &job_settings, &app->manager, problem);
}

static Status serve_open(Serving *serving, const ServeSettings *settings, Problem *problem) {
    App *app = &serving->app;
    AccessControl *access = &serving->access;
    ServerSettings *http = &serving->http;
    const Address *address = &http->address;
    BaseUrl url = {.host = ""};
    TRY(address_read(settings->listen, &http->address, problem));
    const bool needs_tokens = settings->require_tokens || !address_is_loopback(address);
    const Status url_status =
        settings->base_url != NULL ? base_url_read(settings->base_url, &url, problem) : STATUS_OK;
    const Status all[] = {
        url_status, serve_check(settings, problem),
        hosts_set(settings, address, &url, &serving->hosts, &serving->origins, problem),
        certificate_read(settings, false, problem)};
    TRY(status_first(all, COUNT(all)));
    access->log_mode = (LogMode)settings->journal;
    app->request_metrics = access->request_metrics = request_metrics_new(routes);
    app->response_cache = response_cache_new(settings->cache_bytes / RESPONSE_SHARE);
    if (access->request_metrics == NULL || app->response_cache == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the server");
    TRY(db_open(settings->data, &app->db, problem));
    TRY(tokens_open(app->db, needs_tokens, &access->tokens, problem));
    if (needs_tokens)
        TRY(tokens_require(address, tokens_usable(access->tokens), problem));
    TRY(serve_open_jobs(app, settings, problem));
    TRY(background_open(BACKGROUND_TASKS, &app->background_tasks, problem));
    serving->accepted = (AcceptedHosts){
        (const char *const *)serving->hosts.at, address_is_any(address),
        serving->origins.count > 1 ? (const char *const *)serving->origins.at : NULL};
    base_path_set(url.path);
    text_fit(app->base_url, sizeof app->base_url, url.text);
    app->has_tls = tls_source() != NULL;
    serving->router = (Router){app, routes, app->response_cache, access, short_ids_redirect};
    http->body_most = settings->max_body;
    http->router = &serving->router;
    http->hosts = &serving->accepted;
    http->certificate = tls_source();
    return server_open(http, &serving->server, problem);
}

static void serve_close(Serving *serving) {
    App *app = &serving->app;
    server_stop(serving->server, GRACE_MS);
    background_close(app->background_tasks);
    if (app->manager != NULL)
        jobs_stop(app->manager);
    server_free(serving->server);
    jobs_close(app->manager);
    response_cache_free(app->response_cache);
    tokens_close(serving->access.tokens);
    db_close(app->db);
    request_metrics_free(serving->access.request_metrics);
    texts_clear(&serving->hosts);
    texts_clear(&serving->origins);
    tls_forget();
}

static Status serve(const ServeSettings *settings, const sigset_t *signals, Problem *problem) {
    Serving serving = {.app = {.reply_most = (size_t)1 << 30, .started_unix_ms = clock_unix_ms()}};
    process_return_memory();
    fft_start();
    const Status status = serve_open(&serving, settings, problem);
    if (status == STATUS_OK)
        serve_until_stopped(&serving, settings, signals, problem);
    serve_close(&serving);
    return status;
}

// Called before any thread starts, so that only sigwait receives them, and after the settings have
// been read: until then a signal kills the program.
static void signals_block(sigset_t *signals) {
    sigemptyset(signals);
    sigaddset(signals, SIGTERM);
    sigaddset(signals, SIGINT);
    sigaddset(signals, SIGHUP);
    pthread_sigmask(SIG_BLOCK, signals, NULL);
    signal(SIGPIPE, SIG_IGN);
    signal(SIGXFSZ, SIG_IGN); // a limit on a file's size is an error of writing like any other
}

static int serve_run(const Command *self, void *of, const Options *options, Problem *problem) {
    ServeSettings *settings = of;
    Status status = serve_complete(settings, problem);
    if (status == STATUS_OK && settings->print_config) {
        options_print(serve_fields, settings, options, stdout);
    } else if (status == STATUS_OK) {
        sigset_t signals;
        signals_block(&signals);
        status = serve(settings, &signals, problem);
    }
    // Of several faults the last one may have another status.
    if (status != STATUS_OK && problem->status == STATUS_USAGE)
        status = STATUS_USAGE;
    return command_end(self, status, problem);
}

const Command command_serve = {
    .name = "serve",
    .summary = "start a server, with a dashboard and an HTTP interface",
    .help = "  impactd serve\n"
            "  impactd serve --listen 127.0.0.1:0 --data /tmp/trial\n"
            "  impactd serve --print-config\n"
            "  impactd token create --name lab\n"
            "  impactd serve --listen 0.0.0.0:8443 --tls-cert c.pem --tls-key k.pem\n"
            "\n"
            "Prints the URL and a curl command. SIGTERM or Ctrl-C stops the server within 5\n"
            "seconds; unfinished jobs continue at the next start. SIGHUP reads the\n"
            "certificate and its key again; if they have faults, the present ones stay in\n"
            "use. Each setting is also a variable of the environment, IMPACTD_MAX_BODY for\n"
            "--max-body, and a line of the file of --config.\n",
    .options = serve_fields,
    .groups = serve_groups,
    .size = sizeof(ServeSettings),
    .environment = "IMPACTD_",
    .run = serve_run,
};
