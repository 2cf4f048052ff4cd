#define _GNU_SOURCE // pipe2, posix_spawn_file_actions_addclosefrom_np
#include "server/util/process.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <malloc.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <spawn.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include "server/util/clock.h"

static uint64_t process_resident(void) {
    char text[128] = "";
    FILE *file = fopen("/proc/self/statm", "r");
    if (file == NULL)
        return 0;
    const char *line = fgets(text, sizeof text, file);
    fclose(file);
    // Size and resident pages.
    const char *second = line != NULL ? strchr(line, ' ') : NULL;
    return second == NULL ? 0 : strtoull(second, NULL, 10) * (uint64_t)sysconf(_SC_PAGESIZE);
}

static uint64_t process_open_files(void) {
    DIR *folder = opendir("/proc/self/fd");
    if (folder == NULL)
        return 0;
    uint64_t count = 0;
    for (const struct dirent *entry; (entry = readdir(folder)) != NULL;)
        count += entry->d_name[0] != '.';
    closedir(folder);
    return count - 1; // the folder's own
}

static double process_seconds(struct timeval time) {
    return (double)time.tv_sec + 1e-6 * (double)time.tv_usec;
}

void process_facts(ProcessFacts *facts) {
    struct rusage usage = {0};
    struct rlimit limit = {0};
    *facts =
        (ProcessFacts){.resident_bytes = process_resident(), .open_files = process_open_files()};
    if (getrusage(RUSAGE_SELF, &usage) == 0)
        facts->cpu_seconds = process_seconds(usage.ru_utime) + process_seconds(usage.ru_stime);
    if (getrlimit(RLIMIT_NOFILE, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY)
        facts->open_files_most = limit.rlim_cur;
}

// By default the C library has up to 8 arenas a processor and keeps, for each, twice the largest
// block that was ever freed. More arenas than processors only spread the holes: with 2 for 28
// threads 95 MB stayed resident where 190 MB did.
void process_return_memory(void) {
    enum { KEPT = 8 << 20 };
    const long processors = sysconf(_SC_NPROCESSORS_ONLN);
    mallopt(M_ARENA_MAX, processors > 2 && processors < 1024 ? (int)processors : 2);
    mallopt(M_MMAP_THRESHOLD, KEPT);
    mallopt(M_TRIM_THRESHOLD, KEPT);
}

// Small blocks in use keep the free ones between them from going back by themselves.
void process_trim_memory(uint64_t *taken) {
    enum { PAGES = 4096 }; // 16 MB, in some milliseconds
    struct rusage usage = {0};
    if (getrusage(RUSAGE_SELF, &usage) != 0 || (uint64_t)usage.ru_minflt - *taken < PAGES)
        return;
    malloc_trim(0);
    *taken = (uint64_t)usage.ru_minflt;
}

// One datagram to a socket whose name begins with "/" or, for the abstract ones of Linux, with "@".
void process_notify_systemd(const char *state) {
    const char *path = getenv("NOTIFY_SOCKET");
    struct sockaddr_un name = {.sun_family = AF_UNIX};
    if (path == NULL || (path[0] != '/' && path[0] != '@'))
        return;
    const size_t size = strlen(path);
    if (size < 2 || size >= sizeof name.sun_path)
        return;
    memcpy(name.sun_path, path, size);
    if (path[0] == '@')
        name.sun_path[0] = '\0';
    const int descriptor = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (descriptor < 0)
        return;
    const socklen_t name_size = (socklen_t)(offsetof(struct sockaddr_un, sun_path) + size);
    (void)sendto(descriptor, state, strlen(state), MSG_NOSIGNAL, (const struct sockaddr *)&name,
                 name_size);
    close(descriptor);
}

int64_t process_watchdog_ms(void) {
    const char *period = getenv("WATCHDOG_USEC"), *process = getenv("WATCHDOG_PID");
    if (period == NULL || (process != NULL && strtol(process, NULL, 10) != (long)getpid()))
        return 0;
    const long long us = strtoll(period, NULL, 10);
    return us > 0 ? (us / 2000 > 0 ? us / 2000 : 1) : 0;
}

void log_put(Bytes *bytes, const char *name, const char *text, size_t max) {
    if (text == NULL)
        return;
    bytes_format(bytes, " %s=\"", name);
    for (size_t i = 0; text[i] != '\0' && i < max; i++) {
        const unsigned char c = (unsigned char)text[i];
        if (c < 0x20 || c >= 0x7f || c == '"' || c == '\\')
            bytes_format(bytes, "\\x%02x", c);
        else
            bytes_put(bytes, &text[i], 1);
    }
    bytes_text(bytes, strnlen(text, max + 1) > max ? "...\"" : "\"");
}

// A full pipe must not block the writer: where there is no room the line is dropped.
// The lock keeps the room that was found for the line that it was found for.
void log_write(const Bytes *line) {
    static pthread_mutex_t lock = PTHREAD_MUTEX_INITIALIZER;
    static unsigned long lost;
    if (line->at == NULL)
        return;
    struct pollfd end = {.fd = STDERR_FILENO, .events = POLLOUT};
    pthread_mutex_lock(&lock);
    if (poll(&end, 1, 0) == 0) {
        lost++;
    } else if (lost > 0) {
        fprintf(stderr, "impactd: %lu log lines dropped (stderr blocked)\nimpactd: %s\n", lost,
                line->at);
        lost = 0;
    } else {
        fprintf(stderr, "impactd: %s\n", line->at);
    }
    pthread_mutex_unlock(&lock);
}

// The child has nothing of this process but the pipe, and no signal blocked. It leads a group of
// its own, which ends with it.
static int process_spawn(const char *const *arguments, int pipe, pid_t *child) {
    extern char **environ;
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    sigset_t none;
    (void)sigemptyset(&none);
    (void)posix_spawnattr_init(&attributes);
    (void)posix_spawnattr_setsigmask(&attributes, &none);
    (void)posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETPGROUP);
    (void)posix_spawn_file_actions_init(&actions);
    const int all[] = {
        posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0),
        posix_spawn_file_actions_adddup2(&actions, pipe, STDOUT_FILENO),
        posix_spawn_file_actions_adddup2(&actions, pipe, STDERR_FILENO),
        posix_spawn_file_actions_addclosefrom_np(&actions, STDERR_FILENO + 1)};
    int error = 0;
    for (size_t i = 0; error == 0 && i < COUNT(all); i++)
        error = all[i];
    if (error == 0)
        error = posix_spawnp(child, arguments[0], &actions, &attributes,
                             (char *const *)(uintptr_t)arguments, environ);
    (void)posix_spawnattr_destroy(&attributes);
    (void)posix_spawn_file_actions_destroy(&actions);
    return error;
}

// Reads the pipe to its end or to the deadline.
static void process_read(int pipe, int64_t end_ns, Bytes *output) {
    char block[4096];
    for (int64_t left_ms; (left_ms = (end_ns - clock_monotonic_ns()) / 1000000) > 0;) {
        struct pollfd wait = {pipe, POLLIN, 0};
        if (poll(&wait, 1, (int)(left_ms < 60000 ? left_ms : 60000)) <= 0)
            continue;
        const ssize_t count = read(pipe, block, sizeof block);
        if (count > 0)
            bytes_put(output, block, (size_t)count);
        else if (count == 0 || errno != EINTR)
            return;
    }
}

static Status process_result(const char *name, int state, const Bytes *output, Problem *problem) {
    const char *text = output->at != NULL ? output->at : "";
    const size_t length = strcspn(text, "\n");
    if (output->is_failed)
        return problem_set(problem, output->is_over ? STATUS_IO : STATUS_NO_MEMORY,
                           "%s prints more than %zu bytes, or than memory has", name, output->most);
    if (WIFEXITED(state) && WEXITSTATUS(state) == 0)
        return STATUS_OK;
    return length > 0
               ? problem_set(problem, STATUS_IO, "%.*s", (int)(length < 300 ? length : 300), text)
               : problem_set(problem, STATUS_IO, "%s failed and does not say why", name);
}

Status process_run(const char *const *arguments, double seconds, Bytes *output, Problem *problem) {
    const int64_t end_ns = clock_monotonic_ns() + (int64_t)(1e9 * seconds);
    int ends[2], state = 1 << 8; // where its end is not seen, as if it had failed
    pid_t child;
    bool is_late = false;
    if (pipe2(ends, O_CLOEXEC) != 0)
        return problem_set(problem, STATUS_IO, "%s: no pipe: %s", arguments[0], strerror(errno));
    const int error = process_spawn(arguments, ends[1], &child);
    (void)close(ends[1]);
    if (error == 0)
        process_read(ends[0], end_ns, output);
    (void)close(ends[0]);
    // Its end, which may come long after that of the pipe.
    while (error == 0 && waitpid(child, &state, WNOHANG) == 0) {
        if ((is_late = clock_monotonic_ns() + 1000000 >= end_ns))
            (void)kill(-child, SIGKILL);
        (void)poll(NULL, 0, 1);
    }
    if (error == ENOENT)
        return problem_set(problem, STATUS_NOT_FOUND, "there is no program %s", arguments[0]);
    if (error != 0)
        return problem_set(problem, STATUS_IO, "%s cannot be started: %s", arguments[0],
                           strerror(error));
    if (is_late)
        return problem_set(problem, STATUS_TIMEOUT, "%s did not answer within %g s", arguments[0],
                           seconds);
    return process_result(arguments[0], state, output, problem);
}
