#include "core/base/rfc3339.h"

#include <string.h>

// Reads `count` digits at *text as a number within [min, max] and advances. -1 if there is none.
static int rfc3339_digits(const char **text, int count, int min, int max) {
    int number = 0;
    for (int i = 0; i < count; i++, (*text)++) {
        if (**text < '0' || **text > '9')
            return -1;
        number = 10 * number + (**text - '0');
    }
    return number >= min && number <= max ? number : -1;
}

static bool rfc3339_skip(const char **text, const char *any) {
    if (**text == '\0' || strchr(any, **text) == NULL)
        return false;
    (*text)++;
    return true;
}

// Days since 1970-01-01 in the proleptic Gregorian calendar; y counts years that begin in March.
static int64_t rfc3339_days(int year, int month, int day) {
    const int64_t y = year - (month <= 2);
    const int64_t of_year = (153 * (month + (month > 2 ? -3 : 9)) + 2) / 5 + day - 1;
    return 365 * y + y / 4 - y / 100 + y / 400 + of_year - 719468;
}

static int rfc3339_month_days(int year, int month) {
    static const int days[] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
    const bool is_leap = (year % 4 == 0 && year % 100 != 0) || year % 400 == 0;
    return days[month - 1] + (month == 2 && is_leap);
}

// Minutes east of Greenwich.
static bool rfc3339_offset(const char **text, int *minutes) {
    *minutes = 0;
    if (rfc3339_skip(text, "Zz"))
        return true;
    const bool is_west = **text == '-';
    if (!rfc3339_skip(text, "+- "))
        return false;
    const int hour = rfc3339_digits(text, 2, 0, 23);
    if (hour < 0 || !rfc3339_skip(text, ":"))
        return false;
    const int minute = rfc3339_digits(text, 2, 0, 59);
    *minutes = (is_west ? -1 : 1) * (60 * hour + minute);
    return minute >= 0;
}

bool rfc3339_read(const char *text, int64_t *unix_ms) {
    const int year = rfc3339_digits(&text, 4, 1, 9999);
    if (year < 0 || !rfc3339_skip(&text, "-"))
        return false;
    const int month = rfc3339_digits(&text, 2, 1, 12);
    if (month < 0 || !rfc3339_skip(&text, "-"))
        return false;
    const int day = rfc3339_digits(&text, 2, 1, rfc3339_month_days(year, month));
    if (day < 0)
        return false;
    *unix_ms = rfc3339_days(year, month, day) * 86400000;
    if (*text == '\0')
        return true;
    if (!rfc3339_skip(&text, "Tt "))
        return false;
    const int hour = rfc3339_digits(&text, 2, 0, 23);
    if (hour < 0 || !rfc3339_skip(&text, ":"))
        return false;
    const int minute = rfc3339_digits(&text, 2, 0, 59);
    if (minute < 0 || !rfc3339_skip(&text, ":"))
        return false;
    const int second = rfc3339_digits(&text, 2, 0, 60);
    if (second < 0)
        return false;
    int ms = 0;
    if (rfc3339_skip(&text, ".")) {
        if (*text < '0' || *text > '9')
            return false;
        for (int share = 100; *text >= '0' && *text <= '9'; text++, share /= 10)
            ms += share * (*text - '0');
    }
    int offset;
    if (!rfc3339_offset(&text, &offset) || *text != '\0')
        return false;
    *unix_ms += ((int64_t)(60 * hour + minute - offset) * 60 + second) * 1000 + ms;
    return true;
}
