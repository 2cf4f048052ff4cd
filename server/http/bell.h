// Wakes a thread that polls: a descriptor that is readable from the first ring until it is
// silenced. Carries no news. Used by listener.c and exchange.c.
#ifndef SERVER_HTTP_BELL_H
#define SERVER_HTTP_BELL_H

#include <stdint.h>
#include <sys/eventfd.h>
#include <unistd.h>

static inline int bell_new(void) { // -1 and errno if it fails; to be closed
    return eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
}

static inline void bell_ring(int bell) {
    const uint64_t one = 1;
    (void)!write(bell, &one, sizeof one);
}

static inline void bell_silence(int bell) {
    uint64_t count;
    (void)!read(bell, &count, sizeof count);
}

#endif
