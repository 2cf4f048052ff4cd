// The system's clocks in whole units: 64 bits of nanoseconds last 292 years.
#include "server/util/clock.h"

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

ClockText clock_rfc3339(int64_t unix_ms) {
    const int64_t first_ms = -62162035200000, last_ms = 253402300799999; // of 0000-03-01, of 9999
    ClockText text = {""};
    if (unix_ms < first_ms || unix_ms > last_ms)
        return text;
    const int64_t ms = (unix_ms % 1000 + 1000) % 1000;
    const time_t seconds = (time_t)((unix_ms - ms) / 1000);
    struct tm utc;
    if (gmtime_r(&seconds, &utc) == NULL)
        return text;
    snprintf(text.at, sizeof text.at, "%04d-", utc.tm_year + 1900); // %Y has no leading zeros
    strftime(text.at + 5, 27, "%m-%dT%H:%M:%S", &utc);
    snprintf(text.at + 19, 13, ".%03dZ", (int)ms);
    return text;
}
