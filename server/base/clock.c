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

// `count` digits at *text as a number within [least, most]; moves on. -1 for anything else.
static int read_digits(const char **text, int count, int least, int most) {
    int number = 0;
    for (int i = 0; i < count; i++, (*text)++) {
        if (**text < '0' || **text > '9')
            return -1;
        number = 10 * number + (**text - '0');
    }
    return number >= least && number <= most ? number : -1;
}

static bool skip(const char **text, const char *any) {
    if (**text == '\0' || strchr(any, **text) == NULL)
        return false;
    (*text)++;
    return true;
}

// Days since 1970 of the proleptic Gregorian calendar, counted in years that begin in March.
static int64_t days_of(int year, int month, int day) {
    const int64_t y = year - (month <= 2);
    const int64_t of_year = (153 * (month + (month > 2 ? -3 : 9)) + 2) / 5 + day - 1;
    return 365 * y + y / 4 - y / 100 + y / 400 + of_year - 719468;
}

static int days_in(int year, int month) {
    static const int days[] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
    const bool is_leap = (year % 4 == 0 && year % 100 != 0) || year % 400 == 0;
    return days[month - 1] + (month == 2 && is_leap);
}

// Minutes east of Greenwich.
static bool read_offset(const char **text, int *minutes) {
    *minutes = 0;
    if (skip(text, "Zz"))
        return true;
    const bool is_west = **text == '-';
    if (!skip(text, "+- "))
        return false;
    const int hour = read_digits(text, 2, 0, 23);
    if (hour < 0 || !skip(text, ":"))
        return false;
    const int minute = read_digits(text, 2, 0, 59);
    *minutes = (is_west ? -1 : 1) * (60 * hour + minute);
    return minute >= 0;
}

bool clock_read(const char *text, int64_t *unix_ms) {
    const int year = read_digits(&text, 4, 1, 9999);
    if (year < 0 || !skip(&text, "-"))
        return false;
    const int month = read_digits(&text, 2, 1, 12);
    if (month < 0 || !skip(&text, "-"))
        return false;
    const int day = read_digits(&text, 2, 1, days_in(year, month));
    if (day < 0)
        return false;
    *unix_ms = days_of(year, month, day) * 86400000;
    if (*text == '\0')
        return true;
    if (!skip(&text, "Tt "))
        return false;
    const int hour = read_digits(&text, 2, 0, 23);
    if (hour < 0 || !skip(&text, ":"))
        return false;
    const int minute = read_digits(&text, 2, 0, 59);
    if (minute < 0 || !skip(&text, ":"))
        return false;
    const int second = read_digits(&text, 2, 0, 60);
    if (second < 0)
        return false;
    int ms = 0;
    if (skip(&text, ".")) {
        if (*text < '0' || *text > '9')
            return false;
        for (int share = 100; *text >= '0' && *text <= '9'; text++, share /= 10)
            ms += share * (*text - '0');
    }
    int offset;
    if (!read_offset(&text, &offset) || *text != '\0')
        return false;
    *unix_ms += ((int64_t)(60 * hour + minute - offset) * 60 + second) * 1000 + ms;
    return true;
}
