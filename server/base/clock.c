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
