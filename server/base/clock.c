// The system's clocks in whole units: 64 bits of nanoseconds last 292 years.
#include "server/base/clock.h"

#include <stdio.h>
#include <string.h>
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

static char *put_digits(char *target, int count, int64_t number, char behind) {
    for (int i = count - 1; i >= 0; i--, number /= 10)
        target[i] = (char)('0' + number % 10);
    target[count] = behind;
    return target + count + 1;
}

// By hand: a known answer needs it, and the library's way takes a lock and longer than all the
// rest.
void clock_rfc3339(int64_t unix_ms, char target[32]) {
    enum { DAY_MS = 86400000, ERA_DAYS = 146097 }; // an era: 400 years
    // Counted from 0000-03-01, so that the leap day is a year's last.
    const int64_t first_ms = (int64_t)-719468 * DAY_MS;
    const int64_t last_ms = 253402300799999; // of 9999
    target[0] = '\0';
    if (unix_ms < first_ms || unix_ms > last_ms)
        return;
    const int64_t ms = (unix_ms - first_ms) % DAY_MS, days = (unix_ms - first_ms) / DAY_MS;
    const int64_t of_era = days % ERA_DAYS;
    const int64_t years = (of_era - of_era / 1460 + of_era / 36524 - of_era / 146096) / 365;
    const int64_t of_year = of_era - (365 * years + years / 4 - years / 100);
    const int64_t month = (5 * of_year + 2) / 153; // 0 is March
    char *at = put_digits(target, 4, days / ERA_DAYS * 400 + years + (month >= 10), '-');
    at = put_digits(at, 2, month < 10 ? month + 3 : month - 9, '-');
    at = put_digits(at, 2, of_year - (153 * month + 2) / 5 + 1, 'T');
    at = put_digits(at, 2, ms / 3600000, ':');
    at = put_digits(at, 2, ms / 60000 % 60, ':');
    at = put_digits(at, 2, ms / 1000 % 60, '.');
    at = put_digits(at, 3, ms % 1000, 'Z');
    *at = '\0';
}
