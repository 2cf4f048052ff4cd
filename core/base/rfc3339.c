#include "core/base/rfc3339.h"

#include <ctype.h>
#include <string.h>

// Whether the text begins like `shape`, with any digit in place of a 0.
static bool rfc3339_begins(const char *text, const char *shape) {
    for (; *shape != '\0'; shape++, text++)
        if (*shape == '0' ? !isdigit((unsigned char)*text) : *text != *shape)
            return false;
    return true;
}

static int rfc3339_digits(const char *text, int count) {
    int number = 0;
    for (int i = 0; i < count; i++)
        number = 10 * number + (text[i] - '0');
    return number;
}

// Days since 1970-01-01 in the proleptic Gregorian calendar; y counts years that begin in March.
static int64_t rfc3339_days(int year, int month, int day) {
    const int64_t y = year - (month <= 2);
    const int64_t of_year = (153 * (month + (month > 2 ? -3 : 9)) + 2) / 5 + day - 1;
    return 365 * y + y / 4 - y / 100 + y / 400 + of_year - 719468;
}

// The day of the month is checked by the first day of the next one.
static bool rfc3339_read_date(const char *text, int64_t *days) {
    if (!rfc3339_begins(text, "0000-00-00"))
        return false;
    const int year = rfc3339_digits(text, 4), month = rfc3339_digits(text + 5, 2),
              day = rfc3339_digits(text + 8, 2);
    if (year < 1 || month < 1 || month > 12 || day < 1)
        return false;
    *days = rfc3339_days(year, month, day);
    return *days < rfc3339_days(year + month / 12, month % 12 + 1, 1);
}

// "Z" or an offset up to the end of the text, in minutes east of Greenwich.
static bool rfc3339_read_offset(const char *text, int *minutes) {
    *minutes = 0;
    if (strcmp(text, "Z") == 0 || strcmp(text, "z") == 0)
        return true;
    if (*text == '\0' || strchr("+- ", *text) == NULL || !rfc3339_begins(text + 1, "00:00"))
        return false;
    const int hour = rfc3339_digits(text + 1, 2), minute = rfc3339_digits(text + 4, 2);
    *minutes = (*text == '-' ? -1 : 1) * (60 * hour + minute);
    return hour <= 23 && minute <= 59 && text[6] == '\0';
}

bool rfc3339_read(const char *text, int64_t *unix_ms) {
    int64_t days;
    int ms = 0, offset;
    if (!rfc3339_read_date(text, &days))
        return false;
    *unix_ms = days * 86400000;
    text += strlen("0000-00-00");
    if (*text == '\0')
        return true;
    if (strchr("Tt ", *text) == NULL || !rfc3339_begins(text + 1, "00:00:00"))
        return false;
    const int hour = rfc3339_digits(text + 1, 2), minute = rfc3339_digits(text + 4, 2),
              second = rfc3339_digits(text + 7, 2);
    text += strlen("T00:00:00");
    if (rfc3339_begins(text, ".0"))
        for (int share = 100; isdigit((unsigned char)*++text); share /= 10)
            ms += share * (*text - '0');
    if (hour > 23 || minute > 59 || second > 60 || !rfc3339_read_offset(text, &offset))
        return false;
    *unix_ms += ((int64_t)(60 * hour + minute - offset) * 60 + second) * 1000 + ms;
    return true;
}
