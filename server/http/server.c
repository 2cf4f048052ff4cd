// One thread accepts and gives each connection to the event loop that has the fewest; each loop
// runs a libmicrohttpd of its own. The loops are ours, not the library's: where a multiple of 128
// connections are ready at once, 0.9.75 would wait for more before it serves them, and as many
// threads as keep it below that number cost a third of the speed.
#include "server/http/server.h"

#include <errno.h>
#include <netinet/in.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "server/http/exchange.h"
#include "server/util/clock.h"

enum {
    LOOPS_MAX = 16,
    THREADS = 16,           // that answer what takes a while
    CONNECTIONS_MAX = 8192, // over all loops, where as many files may be open
    FILES_KEPT = 64,        // for everything else
    TOGETHER = 16,          // connections that one loop takes before another does
    CONNECTION_MEMORY = 16 * 1024,
    SILENCE_S = 60, // nothing sent or received; who is kept waiting by us is not silent
    IN_VAIN = 16,   // runs in a row that called nothing, before a pause
};

struct Server {
    ServerShared shared;
    char url[96];
    int descriptor; // the listening socket
    EventFd wakeup; // rung to end the accepting thread
    pthread_t acceptor;
    bool is_accepting;
    size_t connections_most;
    size_t loop_count;
    EventLoop loops[LOOPS_MAX];
};

static void take_arrivals(EventLoop *loop) {
    enum { MOST = 64 };
    int arrivals[MOST];
    size_t count;
    do {
        pthread_mutex_lock(&loop->lock);
        count = loop->arrival_count < MOST ? loop->arrival_count : MOST;
        loop->arrival_count -= count;
        if (count > 0) // a bell may be stale
            memcpy(arrivals, loop->arrivals + loop->arrival_count, count * sizeof *arrivals);
        pthread_mutex_unlock(&loop->lock);
        for (size_t i = 0; i < count; i++) {
            struct sockaddr_storage peer = {.ss_family = AF_INET};
            socklen_t size = sizeof peer;
            (void)getpeername(arrivals[i], (struct sockaddr *)&peer, &size);
            // Closes the descriptor if it fails.
            if (MHD_add_connection(loop->daemon, arrivals[i], (struct sockaddr *)&peer, size) !=
                MHD_YES)
                atomic_fetch_sub(&loop->connections, 1);
        }
    } while (count == MOST);
}

static void *run_loop(void *context) {
    EventLoop *loop = context;
    const union MHD_DaemonInfo *info = MHD_get_daemon_info(loop->daemon, MHD_DAEMON_INFO_EPOLL_FD);
    struct pollfd events[] = {{.fd = info->epoll_fd, .events = POLLIN},
                              {.fd = loop->wakeup.descriptor, .events = POLLIN}};
    size_t idle = 1; // runs in a row that called nothing
    while (!atomic_load(&loop->is_stopping)) {
        // Where there was something to do there mostly is more: no call to wait for it, then.
        if (idle > 0 && !atomic_load(&loop->wakeup.is_rung)) {
            // What is ready in memory shows in no descriptor.
            MHD_UNSIGNED_LONG_LONG left_ms;
            int wait_ms = -1;
            if (MHD_get_timeout(loop->daemon, &left_ms) == MHD_YES)
                wait_ms = left_ms < 1000 ? (int)left_ms : 1000;
            // A chunk's head that fills the connection's memory stays ready until its time is up,
            // and nothing comes of it. An answer that is being sent calls nothing either: no long
            // pauses, therefore.
            if (wait_ms == 0 && loop->reading > 0 && idle % IN_VAIN == 0)
                wait_ms = 1;
            (void)poll(events, 2, wait_ms);
        }
        if (eventfd_read_all(&loop->wakeup))
            take_arrivals(loop);
        const size_t turns = loop->turns;
        MHD_run(loop->daemon);
        idle = loop->turns == turns ? idle + 1 : 0;
    }
    return NULL;
}

size_t server_connections(const Server *server) {
    size_t count = 0;
    for (size_t i = 0; i < server->loop_count; i++)
        count += atomic_load(&server->loops[i].connections);
    return count;
}

static void hand_on(Server *server, int descriptor) {
    // A few together wake a loop less often for each.
    EventLoop *least = &server->loops[0];
    for (size_t i = 1; i < server->loop_count && atomic_load(&least->connections) >= TOGETHER; i++)
        if (atomic_load(&server->loops[i].connections) < atomic_load(&least->connections))
            least = &server->loops[i];
    pthread_mutex_lock(&least->lock);
    if (least->arrival_count == least->arrival_room) {
        const size_t room = 2 * least->arrival_room + 64;
        int *grown = realloc(least->arrivals, room * sizeof *grown);
        if (grown == NULL) {
            pthread_mutex_unlock(&least->lock);
            close(descriptor);
            return;
        }
        least->arrivals = grown;
        least->arrival_room = room;
    }
    least->arrivals[least->arrival_count++] = descriptor;
    atomic_fetch_add(&least->connections, 1);
    pthread_mutex_unlock(&least->lock);
    eventfd_signal(&least->wakeup);
}

static void *accept_all(void *context) {
    Server *server = context;
    const struct timespec moment = {.tv_nsec = 5000000};
    struct pollfd events[] = {{.fd = server->descriptor, .events = POLLIN},
                              {.fd = server->wakeup.descriptor, .events = POLLIN}};
    for (;;) {
        (void)poll(events, 2, -1);
        if (events[1].revents != 0)
            return NULL;
        // Beyond the limit newcomers wait in the kernel's queue until someone leaves.
        const bool is_full = server_connections(server) >= server->connections_most;
        const int descriptor = is_full ? -1 : accept(server->descriptor, NULL, NULL);
        if (descriptor >= 0)
            hand_on(server, descriptor);
        else if (is_full || errno == EMFILE || errno == ENFILE || errno == ENOMEM ||
                 errno == ENOBUFS)
            nanosleep(&moment, NULL);
    }
}

static Status loop_start(EventLoop *loop, ServerShared *shared, size_t most, Problem *problem) {
    const ServerSettings *settings = &shared->settings;
    loop->shared = shared;
    const bool is_tls = settings->certificate != NULL;
    const unsigned flags = MHD_USE_EPOLL | MHD_USE_NO_LISTEN_SOCKET | MHD_ALLOW_SUSPEND_RESUME |
                           MHD_USE_TURBO | (is_tls ? (unsigned)MHD_USE_TLS : 0);
    // -RSA: no key exchange without forward secrecy.
    const struct MHD_OptionItem tls[] = {
        {MHD_OPTION_HTTPS_PRIORITIES, 0,
         (void *)(uintptr_t) "SECURE128:-VERS-ALL:+VERS-TLS1.2:+VERS-TLS1.3:-RSA"},
        {MHD_OPTION_END, 0, NULL}};
    const struct MHD_OptionItem none[] = {{MHD_OPTION_END, 0, NULL}};
    loop->daemon = MHD_start_daemon(
        flags, 0, NULL, NULL, exchange_go_on, loop, MHD_OPTION_CONNECTION_LIMIT, (unsigned)most,
        MHD_OPTION_CONNECTION_MEMORY_LIMIT, (size_t)CONNECTION_MEMORY,
        MHD_OPTION_CONNECTION_TIMEOUT, (unsigned)SILENCE_S, MHD_OPTION_STRICT_FOR_CLIENT, 0,
        MHD_OPTION_URI_LOG_CALLBACK, exchange_open, loop, MHD_OPTION_NOTIFY_CONNECTION,
        exchange_connection, loop, MHD_OPTION_NOTIFY_COMPLETED, exchange_close, loop,
        MHD_OPTION_ARRAY, is_tls ? tls : none,
        is_tls ? MHD_OPTION_HTTPS_CERT_CALLBACK : MHD_OPTION_END, settings->certificate,
        MHD_OPTION_END);
    if (loop->daemon == NULL)
        return problem_set(problem, STATUS_INTERNAL, "the HTTP library cannot start%s",
                           is_tls ? " with this certificate and key" : "");
    const bool has_bell = eventfd_open(&loop->wakeup);
    pthread_mutex_init(&loop->lock, NULL);
    const int code = has_bell ? pthread_create(&loop->thread, NULL, run_loop, loop) : errno;
    if (code == 0)
        return STATUS_OK;
    MHD_stop_daemon(loop->daemon);
    pthread_mutex_destroy(&loop->lock);
    eventfd_close(&loop->wakeup);
    return problem_set(problem, STATUS_INTERNAL, "an event loop cannot be started: %s",
                       strerror(code));
}

// No callback runs any more.
static void loop_halt(EventLoop *loop) {
    atomic_store(&loop->is_stopping, true);
    eventfd_signal(&loop->wakeup);
    pthread_join(loop->thread, NULL);
}

static void loop_end(EventLoop *loop) {
    for (size_t i = 0; i < loop->arrival_count; i++)
        close(loop->arrivals[i]);
    free(loop->arrivals);
    MHD_stop_daemon(loop->daemon);
    response_forget(loop->shared_response);
    exchange_forget(loop);
    pthread_mutex_destroy(&loop->lock);
    eventfd_close(&loop->wakeup);
}

// As many files as we may, and how many connections that allows.
static size_t connections_allowed(void) {
    struct rlimit files;
    if (getrlimit(RLIMIT_NOFILE, &files) != 0)
        return 512;
    if (files.rlim_cur < files.rlim_max) {
        files.rlim_cur = files.rlim_max;
        (void)setrlimit(RLIMIT_NOFILE, &files);
        (void)getrlimit(RLIMIT_NOFILE, &files);
    }
    const size_t room = files.rlim_cur > 2 * FILES_KEPT ? files.rlim_cur - FILES_KEPT : FILES_KEPT;
    return room < CONNECTIONS_MAX ? room : CONNECTIONS_MAX;
}

static Status start(Server *server, Problem *problem) {
    ServerShared *shared = &server->shared;
    ServerSettings *settings = &shared->settings;
    TRY(timer_wheel_open(&exchange_calls, &shared->wheel, problem));
    TRY(thread_pool_open(THREADS, &shared->pool, problem));
    TRY(address_open(&settings->address, &server->descriptor, problem));
    address_url(&settings->address, settings->certificate != NULL, server->url);
    shared->url = server->url;
    shared->first_id = (uint64_t)clock_unix_ms() << 16;
    const long processors = sysconf(_SC_NPROCESSORS_ONLN);
    const size_t most = processors < 1           ? 1
                        : processors > LOOPS_MAX ? LOOPS_MAX
                                                 : (size_t)processors;
    server->connections_most = connections_allowed();
    for (; server->loop_count < most; server->loop_count++)
        TRY(loop_start(&server->loops[server->loop_count], shared, server->connections_most,
                       problem));
    const int code = eventfd_open(&server->wakeup)
                         ? pthread_create(&server->acceptor, NULL, accept_all, server)
                         : errno;
    server->is_accepting = code == 0;
    if (!server->is_accepting)
        return problem_set(problem, STATUS_INTERNAL, "the accepting thread cannot be started: %s",
                           strerror(code));
    return STATUS_OK;
}

Status server_open(const ServerSettings *settings, Server **server, Problem *problem) {
    *server = NULL;
    Server *made = calloc(1, sizeof *made);
    if (made == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the listener");
    made->shared.settings = *settings;
    made->descriptor = made->wakeup.descriptor = -1;
    const Status status = start(made, problem);
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
    if (server == NULL || server->shared.pool == NULL)
        return;
    ServerShared *shared = &server->shared;
    if (server->is_accepting) {
        eventfd_signal(&server->wakeup);
        pthread_join(server->acceptor, NULL);
        server->is_accepting = false;
    }
    close(server->descriptor); // -1: no harm
    server->descriptor = -1;
    timer_wheel_wake_all(shared->wheel);
    const int64_t until = clock_monotonic_ns() + (int64_t)grace_ms * 1000000;
    const struct timespec pause = {.tv_nsec = 5000000};
    while (atomic_load(&shared->exchanges) > 0 && clock_monotonic_ns() < until)
        nanosleep(&pause, NULL);
    for (size_t i = 0; i < server->loop_count; i++)
        loop_halt(&server->loops[i]);
    // The library takes no end while a connection is suspended: what is in the pool is done.
    thread_pool_close(shared->pool);
    shared->pool = NULL;
    while (server->loop_count > 0)
        loop_end(&server->loops[--server->loop_count]);
    eventfd_close(&server->wakeup);
}

void server_free(Server *server) {
    if (server == NULL)
        return;
    server_stop(server, 0);
    timer_wheel_close(server->shared.wheel);
    free(server);
}
