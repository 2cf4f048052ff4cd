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
static inline bool eventfd_open(EventFd *bell) {
    atomic_init(&bell->is_rung, false);
    bell->descriptor = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    return bell->descriptor >= 0;
}

static inline void eventfd_close(EventFd *bell) { // one that is not open: no harm
    close(bell->descriptor);
    bell->descriptor = -1;
}

static inline void eventfd_signal(EventFd *bell) {
    const uint64_t one = 1;
    if (!atomic_exchange(&bell->is_rung, true))
        (void)!write(bell->descriptor, &one, sizeof one);
}

// Whether it was rung. One who rings meanwhile is heard now or is_rung next time.
static inline bool eventfd_read_all(EventFd *bell) {
    uint64_t count;
    if (!atomic_exchange(&bell->is_rung, false))
        return false;
    (void)!read(bell->descriptor, &count, sizeof count);
    return true;
}

#endif
