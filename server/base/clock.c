// The system's clocks in whole units: 64 bits of nanoseconds last 292 years.
#include "server/base/clock.h"

#include <stdio.h>
#include <time.h>

static int64_t read_ns(clockid_t id) {
    struct timespec now = {0};
    clock_gettime(id, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

int64_t clock_unix_ms(void) {
    return read_ns(CLOCK_REALTIME) / 1000000;
}

int64_t clock_unix_us(void) {
    return read_ns(CLOCK_REALTIME) / 1000;
}

int64_t clock_monotonic_ns(void) {
    return read_ns(CLOCK_MONOTONIC);
}

int64_t clock_thread_cpu_ns(void) {
    return read_ns(CLOCK_THREAD_CPUTIME_ID);
}

void clock_rfc3339(int64_t unix_ms, char target[32]) {
    // Towards the past, also before 1970.
    const int64_t ms = (unix_ms % 1000 + 1000) % 1000;
    const time_t seconds = (time_t)(unix_ms / 1000 - (unix_ms % 1000 < 0));
    struct tm date;
    if (gmtime_r(&seconds, &date) == NULL || date.tm_year < -1900 || date.tm_year > 9999 - 1900) {
        target[0] = '\0';
        return;
    }
    const size_t length = strftime(target, 32, "%Y-%m-%dT%H:%M:%S", &date);
    snprintf(target + length, 32 - length, ".%03dZ", (int)ms);
}
