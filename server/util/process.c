#include "server/util/process.h"

#include <dirent.h>
#include <malloc.h>
#include <poll.h>
#include <pthread.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

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
