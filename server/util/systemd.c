// sd_notify's protocol: one datagram to a socket whose name begins with "/" or, for the abstract
// ones of Linux, with "@".
#include "server/util/systemd.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

void systemd_notify(const char *state) {
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
    const int door = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (door < 0)
        return;
    const socklen_t name_size = (socklen_t)(offsetof(struct sockaddr_un, sun_path) + size);
    (void)sendto(door, state, strlen(state), MSG_NOSIGNAL, (const struct sockaddr *)&name,
                 name_size);
    close(door);
}

int64_t systemd_watchdog_ms(void) {
    const char *period = getenv("WATCHDOG_USEC"), *process = getenv("WATCHDOG_PID");
    if (period == NULL || (process != NULL && strtol(process, NULL, 10) != (long)getpid()))
        return 0;
    const long long us = strtoll(period, NULL, 10);
    return us > 0 ? (us / 2000 > 0 ? us / 2000 : 1) : 0;
}
