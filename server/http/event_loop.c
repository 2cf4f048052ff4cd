// Each event loop runs a libmicrohttpd of its own. The loops are ours, not the library's: where a
// multiple of 128 connections are ready at once, 0.9.75 would wait for more before it serves them,
// and as many threads as keep it below that number cost a third of the speed. One loop accepts; it
// passes this role on to the loop that has the fewest connections.
#include "server/http/server.h"

#include <errno.h>
#include <netinet/in.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "server/http/connection.h"
#include "server/util/clock.h"
#include "server/util/thread_pool.h"

enum {
    THREADS_MAX = 16,       // that run handlers which may take a while
    CONNECTIONS_MAX = 8192, // over all loops, if as many files may be open
    FILES_KEPT = 64,        // for everything else
    TOGETHER = 16,          // connections that one loop takes before another does: fewer wake-ups
    SILENCE_S = 60,         // nothing sent or received; a client that waits for us is not silent
    BUSY_RUNS = 16,         // in a row, before a loop looks for new connections
    RETRY_MS = 5,           // until accepting is tried again
    IDLE_MIN_MS = 500,      // then a connection between two requests may be closed for a new one
};

size_t server_connections(const Server *server) {
    size_t count = 0;
    for (size_t i = 0; i < server->loop_count; i++)
        count += atomic_load(&server->loops[i].connections);
    return count;
}

static void loop_pass_accepting(Server *server, size_t index) {
    atomic_store(&server->acceptor, index);
    loop_wake(&server->loops[index]);
}

// The first loop with few connections, else the one with the fewest.
static size_t server_next_acceptor(const Server *server) {
    size_t least = 0;
    for (size_t i = 1;
         i < server->loop_count && atomic_load(&server->loops[least].connections) >= TOGETHER; i++)
        if (atomic_load(&server->loops[i].connections) <
            atomic_load(&server->loops[least].connections))
            least = i;
    return least;
}

// Beyond the limit new connections wait in the kernel's queue until another one closes: the one
// that has been idle for longest is made to.
static void loop_make_room(EventLoop *loop, int64_t now_ns) {
    Server *server = loop->server;
    timer_list_close_idle(loop->timers, IDLE_MIN_MS);
    loop->accept_ns = now_ns + RETRY_MS * 1000000LL;
    if (server->loop_count > 1)
        loop_pass_accepting(server, (loop->index + 1) % server->loop_count);
}

static void loop_accept(EventLoop *loop, int64_t now_ns) {
    Server *server = loop->server;
    for (size_t next = loop->index; next == loop->index;) {
        struct sockaddr_storage peer = {.ss_family = AF_INET};
        socklen_t size = sizeof peer;
        const bool is_full = server_connections(server) >= server->connections_max;
        const int descriptor =
            is_full ? -1 : accept(server->descriptor, (struct sockaddr *)&peer, &size);
        if (descriptor < 0) {
            if (is_full || errno == EMFILE || errno == ENFILE || errno == ENOMEM ||
                errno == ENOBUFS)
                loop_make_room(loop, now_ns);
            return;
        }
        atomic_fetch_add(&loop->connections, 1);
        // Closes the descriptor if it fails.
        if (MHD_add_connection(loop->daemon, descriptor, (struct sockaddr *)&peer, size) != MHD_YES)
            atomic_fetch_sub(&loop->connections, 1);
        next = server_next_acceptor(server);
        if (next != loop->index)
            loop_pass_accepting(server, next);
    }
}

// How long the loop may sleep [ms].
static int loop_timeout(const EventLoop *loop, int64_t now_ns, int64_t next_ns) {
    enum { LONGEST_MS = 1000 };
    MHD_UNSIGNED_LONG_LONG library_ms; // what is ready in memory shows in no descriptor
    int64_t ms = next_ns == INT64_MAX ? LONGEST_MS : (next_ns - now_ns) / 1000000 + 1;
    if (MHD_get_timeout(loop->daemon, &library_ms) == MHD_YES && (int64_t)library_ms < ms)
        ms = (int64_t)library_ms;
    return ms > LONGEST_MS ? LONGEST_MS : ms > 0 ? (int)ms : 0;
}

static void *loop_run(void *context) {
    EventLoop *loop = context;
    Server *server = loop->server;
    const union MHD_DaemonInfo *info = MHD_get_daemon_info(loop->daemon, MHD_DAEMON_INFO_EPOLL_FD);
    struct pollfd events[] = {{.fd = info->epoll_fd, .events = POLLIN},
                              {.fd = loop->wakeup, .events = POLLIN},
                              {.events = POLLIN}};
    size_t busy = 0; // runs in a row that called something: then there is probably more to do
    while (!atomic_load(&loop->is_stopping)) {
        const int64_t now_ns = clock_monotonic_ns();
        const int64_t next_ns = timer_list_run(loop->timers, now_ns);
        connection_close_stalled(loop, now_ns);
        if (busy % BUSY_RUNS == 0) {
            const bool may_accept =
                atomic_load(&server->is_accepting) && atomic_load(&server->acceptor) == loop->index;
            const bool accepts = may_accept && now_ns >= loop->accept_ns;
            int wait_ms =
                busy > 0 || atomic_load(&loop->is_woken) ? 0 : loop_timeout(loop, now_ns, next_ns);
            if (may_accept && !accepts && wait_ms > RETRY_MS)
                wait_ms = RETRY_MS;
            events[2].fd = accepts ? server->descriptor : -1;
            if (poll(events, COUNT(events), wait_ms) > 0 && (events[2].revents & POLLIN) != 0 &&
                atomic_load(&server->is_accepting))
                loop_accept(loop, now_ns);
        }
        uint64_t count;
        if (atomic_exchange(&loop->is_woken, false))
            (void)!read(loop->wakeup, &count, sizeof count);
        const size_t calls = loop->calls;
        MHD_run(loop->daemon);
        busy = loop->calls != calls ? busy + 1 : 0;
    }
    return NULL;
}

static Status loop_start(EventLoop *loop, Server *server, Problem *problem) {
    const ServerSettings *settings = &server->settings;
    loop->server = server;
    loop->index = server->loop_count;
    const bool is_tls = settings->certificate != NULL;
    const unsigned flags = MHD_USE_EPOLL | MHD_USE_NO_LISTEN_SOCKET | MHD_ALLOW_SUSPEND_RESUME |
                           MHD_USE_TURBO | (is_tls ? (unsigned)MHD_USE_TLS : 0);
    // -RSA: no key exchange without forward secrecy.
    const struct MHD_OptionItem tls[] = {
        {MHD_OPTION_HTTPS_PRIORITIES, 0,
         (void *)(uintptr_t) "SECURE128:-VERS-ALL:+VERS-TLS1.2:+VERS-TLS1.3:-RSA"},
        {MHD_OPTION_END, 0, NULL}};
    const struct MHD_OptionItem none[] = {{MHD_OPTION_END, 0, NULL}};
    loop->timers = timer_list_new(&connection_timer_calls, loop);
    if (loop->timers == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for an event loop");
    loop->daemon = MHD_start_daemon(
        flags, 0, NULL, NULL, exchange_continue, loop, MHD_OPTION_CONNECTION_LIMIT,
        (unsigned)server->connections_max, MHD_OPTION_CONNECTION_MEMORY_LIMIT,
        (size_t)CONNECTION_MEMORY, MHD_OPTION_CONNECTION_TIMEOUT, (unsigned)SILENCE_S,
        MHD_OPTION_STRICT_FOR_CLIENT, 0, MHD_OPTION_URI_LOG_CALLBACK, exchange_open, loop,
        MHD_OPTION_NOTIFY_CONNECTION, connection_notify, loop, MHD_OPTION_NOTIFY_COMPLETED,
        exchange_close, loop, MHD_OPTION_ARRAY, is_tls ? tls : none,
        is_tls ? MHD_OPTION_HTTPS_CERT_CALLBACK : MHD_OPTION_END, settings->certificate,
        MHD_OPTION_END);
    loop->wakeup = loop->daemon != NULL ? eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK) : -1;
    Status status =
        loop->wakeup < 0
            ? problem_set(problem, STATUS_INTERNAL, "the HTTP library cannot start%s: %s",
                          is_tls ? " with this certificate and key" : "", strerror(errno))
            : thread_start(&loop->thread, loop_run, loop, "an event loop", problem);
    if (status == STATUS_OK)
        return STATUS_OK;
    if (loop->daemon != NULL)
        MHD_stop_daemon(loop->daemon);
    close(loop->wakeup); // -1 is harmless
    timer_list_free(loop->timers);
    return status;
}

// Stops the loop's thread; none of its callbacks runs afterwards.
static void loop_stop(EventLoop *loop) {
    atomic_store(&loop->is_stopping, true);
    loop_wake(loop);
    pthread_join(loop->thread, NULL);
}

static void loop_close(EventLoop *loop) {
    MHD_stop_daemon(loop->daemon);
    close(loop->wakeup);
    loop->wakeup = -1;
}

// As many files as permitted, and how many connections that allows.
static size_t server_connections_max(void) {
    struct rlimit files = {512, 512};
    (void)getrlimit(RLIMIT_NOFILE, &files);
    if (files.rlim_cur < files.rlim_max) {
        files.rlim_cur = files.rlim_max;
        (void)setrlimit(RLIMIT_NOFILE, &files);
        (void)getrlimit(RLIMIT_NOFILE, &files);
    }
    const size_t room = files.rlim_cur > 2 * FILES_KEPT ? files.rlim_cur - FILES_KEPT : FILES_KEPT;
    return room < CONNECTIONS_MAX ? room : CONNECTIONS_MAX;
}

static Status server_start(Server *server, Problem *problem) {
    ServerSettings *settings = &server->settings;
    TRY(thread_pool_open(THREADS_MAX, &server->pool, problem));
    TRY(address_open(&settings->address, &server->descriptor, problem));
    address_url(&settings->address, settings->certificate != NULL, server->url);
    server->first_id = (uint64_t)clock_unix_ms() << 16;
    server->connections_max = server_connections_max();
    const long processors = sysconf(_SC_NPROCESSORS_ONLN);
    const size_t count = processors < 1           ? 1
                         : processors > LOOPS_MAX ? LOOPS_MAX
                                                  : (size_t)processors;
    for (; server->loop_count < count; server->loop_count++)
        TRY(loop_start(&server->loops[server->loop_count], server, problem));
    atomic_store(&server->is_accepting, true);
    loop_pass_accepting(server, 0);
    return STATUS_OK;
}

Status server_open(const ServerSettings *settings, Server **server, Problem *problem) {
    *server = NULL;
    Server *made = calloc(1, sizeof *made);
    if (made == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the server");
    made->settings = *settings;
    made->descriptor = -1;
    const Status status = server_start(made, problem);
    if (status != STATUS_OK) {
        server_free(made);
        return status;
    }
    *server = made;
    return STATUS_OK;
}

const char *server_url(const Server *server) {
    return server->url;
}

void server_stop(Server *server, int grace_ms) {
    if (server == NULL || server->pool == NULL)
        return;
    atomic_store(&server->is_accepting, false);
    // From here on connections are refused; a loop may still be polling it.
    shutdown(server->descriptor, SHUT_RDWR);
    for (size_t i = 0; i < server->loop_count; i++) {
        loop_wake(&server->loops[i]);
        timer_list_wake_all(server->loops[i].timers);
    }
    const int64_t until = clock_monotonic_ns() + (int64_t)grace_ms * 1000000;
    const struct timespec pause = {.tv_nsec = 5000000};
    while (atomic_load(&server->exchanges) > 0 && clock_monotonic_ns() < until)
        nanosleep(&pause, NULL);
    for (size_t i = 0; i < server->loop_count; i++)
        loop_stop(&server->loops[i]);
    // The library cannot be stopped while a connection is suspended: the pool ends its work first.
    thread_pool_close(server->pool);
    server->pool = NULL;
    for (size_t i = 0; i < server->loop_count; i++)
        loop_close(&server->loops[i]);
    close(server->descriptor); // -1 is harmless
    server->descriptor = -1;
}

void server_free(Server *server) {
    if (server == NULL)
        return;
    server_stop(server, 0);
    for (size_t i = 0; i < server->loop_count; i++)
        timer_list_free(server->loops[i].timers);
    free(server);
}
