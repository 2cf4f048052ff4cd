// impactd serve: the daemon. Opens store, intake and listener in this order, waits for SIGTERM or
// SIGINT, and closes them so that nobody meets a room that is gone: first no more requests, then no
// more work, then what sleepers used.
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/math/fourier.h"
#include "core/study/sweep.h"
#include "server/api/app.h"
#include "server/base/clock.h"
#include "server/command/serve.h"
#include "server/http/dispatch.h"
#include "server/http/listener.h"
#include "server/options.h"

typedef struct ServeSettings {
    char *listen, *data, *config;
    uint64_t workers, queue, max_body, max_samples, max_impacts, max_run_bytes, max_points,
        cache_bytes;
    double max_cpu_seconds;
    bool print_config;
} ServeSettings;

enum { GRACE_MS = 1500 };

#define MIB ((double)(1 << 20))

// clang-format off
static const Field serve_fields[] = {
    FIELD_TEXT(ServeSettings, listen, 255, PRESENCE_OPTIONAL, 0, "HOST:PORT on loopback; port 0 takes any free one (127.0.0.1:8080)"),
    FIELD_TEXT(ServeSettings, data, 4000, PRESENCE_OPTIONAL, 0, "folder of the database ($XDG_STATE_HOME/impactd, else ~/.local/state/impactd)"),
    FIELD_COUNT(ServeSettings, workers, NULL, WITHIN(0, 256), 0, "simulations at once; 0 takes the number of processors"),
    FIELD_COUNT(ServeSettings, queue, NULL, WITHIN(1, 1e6), 10000, "unfinished jobs at most; more are answered 503"),
    FIELD_COUNT(ServeSettings, max_body, "B", WITHIN(1024, 1024 * MIB), 16 * MIB, "a larger request body is answered 413"),
    FIELD_COUNT(ServeSettings, max_samples, NULL, WITHIN(2, 1073741824.0), 33554432, "samples per channel a scene may ask for"),
    FIELD_COUNT(ServeSettings, max_impacts, NULL, WITHIN(1, 1e9), 5e5, "impacts a run may have before it is stopped"),
    FIELD_REAL(ServeSettings, max_cpu_seconds, "s", WITHIN(1e-6, 1e9), SIMULATION_CPU_SECONDS, "CPU time a scene may be foretold to take; it is refused beyond, and stopped at about three times as much"),
    FIELD_COUNT(ServeSettings, max_run_bytes, "B", WITHIN(1 << 20, 1099511627776.0), SIMULATION_BYTES, "memory a scene may be foretold to take; it is refused beyond"),
    FIELD_COUNT(ServeSettings, max_points, NULL, WITHIN(1, 1e7), SWEEP_POINTS, "points a sweep may have"),
    FIELD_COUNT(ServeSettings, cache_bytes, "B", WITHIN(0, 1099511627776.0), 256 * MIB, "memory for finished results"),
    FIELD_TEXT(ServeSettings, config, 4000, PRESENCE_OPTIONAL, 0, "a file of settings, one \"name = value\" a line"),
    FIELD_FLAG(ServeSettings, print_config, false, "print each setting and where it came from, and stop"),
    FIELD_END,
};
// clang-format on

static Status set_text(char **target, const char *text) {
    if (*target != NULL)
        return STATUS_OK;
    *target = strdup(text);
    return *target != NULL ? STATUS_OK : STATUS_NO_MEMORY;
}

// The defaults that depend on where we run.
static Status complete(ServeSettings *settings, Problem *problem) {
    char folder[4096];
    const char *state = getenv("XDG_STATE_HOME"), *home = getenv("HOME");
    int size = -1;
    // The specification of XDG has relative paths ignored.
    if (state != NULL && state[0] == '/')
        size = snprintf(folder, sizeof folder, "%s/impactd", state);
    else if (home != NULL && home[0] == '/')
        size = snprintf(folder, sizeof folder, "%s/.local/state/impactd", home);
    if (settings->data == NULL && (size < 0 || (size_t)size >= sizeof folder))
        return problem_set(
            problem, STATUS_USAGE,
            "no place for the data: neither XDG_STATE_HOME nor HOME is set; use --data DIR");
    if (set_text(&settings->data, folder) != STATUS_OK ||
        set_text(&settings->listen, "127.0.0.1:8080") != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory");
    if (settings->workers == 0) {
        const long processors = sysconf(_SC_NPROCESSORS_ONLN);
        settings->workers = processors > 0 ? (uint64_t)processors : 1;
    }
    return STATUS_OK;
}

static void greet(const Listener *listener, const ServeSettings *settings) {
    const char *url = listener_url(listener);
    printf("impactd %s listens on %s\n", program_version, url);
    printf("data in %s, %llu workers; Ctrl-C stops\n\n", settings->data,
           (unsigned long long)settings->workers);
    printf("curl -s %s/v1/examples/paper_free_sponge | curl -s --json @- %s/v1/jobs\n", url, url);
    fflush(stdout);
}

static Status serve(const ServeSettings *settings, const sigset_t *stops, Problem *problem) {
    App app = {.reply_most = (size_t)1 << 30, .started_unix_ms = clock_unix_ms()};
    Dispatcher dispatcher = {&app, routes, quick_handlers, hot_new((size_t)64 << 20)};
    ListenerSettings door = {.body_most = settings->max_body,
                             .answer_at_once = dispatch_at_once,
                             .answer = dispatch,
                             .context = &dispatcher};
    const IntakeSettings work = {.workers = settings->workers,
                                 .queue_most = settings->queue,
                                 .cache_bytes = settings->cache_bytes,
                                 .limits = {.samples = settings->max_samples,
                                            .impacts = settings->max_impacts,
                                            .steps = settings->max_cpu_seconds / SOLVER_STEP,
                                            .bytes = (double)settings->max_run_bytes,
                                            .points = settings->max_points}};
    Listener *listener = NULL;
    fourier_start();
    TRY(address_read(settings->listen, &door.address, problem));
    TRY(store_open(settings->data, &app.store, problem));
    Status status = intake_open(app.store, &work, &app.intake, problem);
    if (status == STATUS_OK)
        status = listener_open(&door, &listener, problem);
    if (status == STATUS_OK) {
        int signal = 0;
        greet(listener, settings);
        sigwait(stops, &signal);
        atomic_store(&app.is_stopping, true);
        fprintf(stderr, "impactd: %s, stopping\n",
                signal == SIGINT ? "interrupted" : "asked to end");
    }
    listener_stop(listener, GRACE_MS);
    if (app.intake != NULL)
        intake_close(app.intake);
    listener_free(listener);
    hot_free(dispatcher.hot);
    store_close(app.store);
    return status;
}

static int run(int argc, char *const *argv) {
    ServeSettings settings;
    Options options = {0};
    Problem *problem = malloc(sizeof *problem);
    if (problem == NULL)
        return command_exit(STATUS_NO_MEMORY);
    problem_clear(problem);

    // Blocked before any thread starts, so that only sigwait sees them.
    sigset_t stops;
    sigemptyset(&stops);
    sigaddset(&stops, SIGTERM);
    sigaddset(&stops, SIGINT);
    pthread_sigmask(SIG_BLOCK, &stops, NULL);
    signal(SIGPIPE, SIG_IGN);

    int code;
    Status status = fields_default(serve_fields, &settings);
    if (status == STATUS_OK)
        status = options_read(serve_fields, &settings, argc, argv, "IMPACTD_", &options, problem);
    if (status == STATUS_OK && options.operand_count > 0)
        status = problem_set(problem, STATUS_USAGE, "takes no operands, \"%.60s\" is one",
                             options.operands[0]);
    if (status == STATUS_OK)
        status = complete(&settings, problem);
    if (status == STATUS_OK && settings.print_config)
        options_print(serve_fields, &settings, &options, stdout);
    else if (status == STATUS_OK)
        status = serve(&settings, &stops, problem);
    if (status == STATUS_OK) {
        code = COMMAND_OK;
    } else if (problem->status == STATUS_USAGE) {
        code = command_refuse("serve", problem);
    } else {
        fprintf(stderr, "impactd serve: %s\n",
                problem->detail[0] != '\0' ? problem->detail : status_title(status));
        code = command_exit(status);
    }
    fields_clear(serve_fields, &settings);
    free(problem);
    return code;
}

const Command command_serve = {
    .name = "serve",
    .summary = "the daemon: takes scenes over HTTP, keeps jobs and results",
    .help = "  impactd serve\n"
            "  impactd serve --listen 127.0.0.1:0 --data /tmp/trial\n"
            "  impactd serve --print-config\n"
            "\n"
            "Prints its URL and a curl line. SIGTERM or Ctrl-C ends it within 5 seconds; "
            "unfinished jobs go on at\n"
            "the next start. GET / of the URL shows what it can do.\n",
    .options = serve_fields,
    .run = run,
};
