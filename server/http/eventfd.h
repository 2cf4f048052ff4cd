// Wakes a thread that polls: a descriptor that is readable from the first ring until it is
// answered. Carries no news. Used by listener.c and exchange.c.
#ifndef SERVER_HTTP_EVENTFD_H
#define SERVER_HTTP_EVENTFD_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>
#include <sys/eventfd.h>
#include <unistd.h>

typedef struct EventFd {
    int descriptor;
    atomic_bool is_rung; // since it was answered last: whoever rings again need not
} EventFd;

// False and errno if it fails. To be closed.
static inline bool eventfd_open(EventFd *wakeup) {
    atomic_init(&wakeup->is_rung, false);
    wakeup->descriptor = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    return wakeup->descriptor >= 0;
}

static inline void eventfd_close(EventFd *wakeup) { // one that is not open: no harm
    close(wakeup->descriptor);
    wakeup->descriptor = -1;
}

static inline void eventfd_signal(EventFd *wakeup) {
    const uint64_t one = 1;
    if (!atomic_exchange(&wakeup->is_rung, true))
        (void)!write(wakeup->descriptor, &one, sizeof one);
}

// Whether it was rung. One who rings meanwhile is heard now or is_rung next time.
static inline bool eventfd_read_all(EventFd *wakeup) {
    uint64_t count;
    if (!atomic_exchange(&wakeup->is_rung, false))
        return false;
    (void)!read(wakeup->descriptor, &count, sizeof count);
    return true;
}

#endif
