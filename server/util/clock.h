// Wall clock, monotonic clock and CPU time.
#ifndef SERVER_UTIL_CLOCK_H
#define SERVER_UTIL_CLOCK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

int64_t clock_unix_ms(void);
int64_t clock_unix_us(void);
int64_t clock_monotonic_ns(void);
int64_t clock_thread_cpu_ns(void);
// RFC 3339 UTC with milliseconds, "2026-11-21T09:00:00.000Z", for an argument:
// clock_rfc3339(unix_ms).at.
typedef struct ClockText {
    char at[32];
} ClockText;
ClockText clock_rfc3339(int64_t unix_ms);

#endif
