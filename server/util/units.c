// A unit is a power of ten of the SI unit, so that its exponent is added to that of the number
// before the digits are converted; only minutes and the standard gravity need a factor.
#include "server/util/units.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/status.h"

enum { NUMBER_SIZE = 64 };

// Units of the same `si` unit stand together, the one that messages suggest first. A symbol may
// stand for several dimensions: that of the row decides.
static const struct {
    const char *symbol, *si;
    int exponent;  // of ten
    double factor; // beside it
} units[] = {
    {"mm", "m", -3, 1},         {"cm", "m", -2, 1},
    {"um", "m", -6, 1},         {"m", "m", 0, 1},
    {"g", "kg", -3, 1},         {"kg", "kg", 0, 1},
    {"t", "kg", 3, 1},          {"ms", "s", -3, 1},
    {"us", "s", -6, 1},         {"s", "s", 0, 1},
    {"min", "s", 0, 60},        {"kHz", "Hz", 3, 1},
    {"Hz", "Hz", 0, 1},         {"kN", "N", 3, 1},
    {"N", "N", 0, 1},           {"N/mm", "N/m", 3, 1},
    {"kN/mm", "N/m", 6, 1},     {"kN/m", "N/m", 3, 1},
    {"MN/m", "N/m", 6, 1},      {"N/m", "N/m", 0, 1},
    {"kN s/m", "N s/m", 3, 1},  {"N s/mm", "N s/m", 3, 1},
    {"N s/m", "N s/m", 0, 1},   {"mm/s", "m/s", -3, 1},
    {"cm/s", "m/s", -2, 1},     {"m/s", "m/s", 0, 1},
    {"g", "m/s^2", 0, 9.80665}, {"gn", "m/s^2", 0, 9.80665},
    {"cm/s^2", "m/s^2", -2, 1}, {"mm/s^2", "m/s^2", -3, 1},
    {"m/s^2", "m/s^2", 0, 1},   {"%", NULL, -2, 1},
};

static const struct {
    const char *si, *name;
} dimensions[] = {
    {"m", "a length"},      {"kg", "a mass"},   {"s", "a time"},
    {"Hz", "a frequency"},  {"N", "a force"},   {"N/m", "a stiffness"},
    {"N s/m", "a damping"}, {"m/s", "a speed"}, {"m/s^2", "an acceleration"},
};

static const char *dimension_name(const char *si) {
    for (size_t i = 0; si != NULL && i < COUNT(dimensions); i++)
        if (strcmp(dimensions[i].si, si) == 0)
            return dimensions[i].name;
    return "a number";
}

// Whether two units are the same but for blanks and asterisks between factors; U+00B5 and U+03BC
// in `b` are "u".
static bool unit_same(const char *a, const char *b) {
    static const char between[] = " *";
    for (;; a++, b++) {
        a += strspn(a, between);
        b += strspn(b, between);
        if (*a == 'u' && (strncmp(b, "\xC2\xB5", 2) == 0 || strncmp(b, "\xCE\xBC", 2) == 0)) {
            b++;
            continue;
        }
        if (*a != *b || *a == '\0')
            return *a == *b;
    }
}

// The unit of that symbol, if possible one of `si`; COUNT(units): there is none.
static size_t unit_find(const char *symbol, const char *si) {
    size_t found = COUNT(units);
    for (size_t i = 0; i < COUNT(units); i++)
        if (unit_same(units[i].symbol, symbol) &&
            (found == COUNT(units) || text_same(units[i].si, si)))
            found = i;
    return found;
}

// Why a number with a unit is no value of a row in `si`; `number` is its text.
static void reason_write(const char *text, const char *number, const char *symbol, const char *si,
                         char reason[QUANTITY_REASON]) {
    const size_t found = unit_find(symbol, si);
    char known[100] = "", is[80];
    size_t first = 0;
    while (first < COUNT(units) && !text_same(units[first].si, si))
        first++;
    for (size_t i = first; i < COUNT(units) && text_same(units[i].si, si); i++)
        text_list(known, sizeof known, units[i].symbol);
    if (si == NULL)
        snprintf(is, sizeof is, "has no unit");
    else
        snprintf(is, sizeof is, "is %.20s in %.20s", dimension_name(si), si);
    if (found == COUNT(units))
        snprintf(reason, QUANTITY_REASON, "%s, \"%.24s\" is not a unit; write %.70s", is, symbol,
                 known[0] != '\0' ? known : si);
    else
        snprintf(reason, QUANTITY_REASON, "%s, %.30s is %s; write %.30s%.20s", is, text,
                 units[found].si != NULL ? dimension_name(units[found].si) : "a ratio", number,
                 si == NULL             ? ""
                 : first < COUNT(units) ? units[first].symbol
                                        : si);
}

bool quantity_read(const char *text, const char *unit, double *value,
                   char reason[QUANTITY_REASON]) {
    // The digits and the exponent of ten; strtod accepts more, such as "inf" and hexadecimals.
    char number[NUMBER_SIZE], scaled[NUMBER_SIZE + 24], *end;
    const size_t size = strspn(text, "+-.0123456789");
    const bool has_exponent =
        (text[size] == 'e' || text[size] == 'E') && strspn(text + size + 1, "+-0123456789") > 0;
    const size_t whole = size + (has_exponent ? 1 + strspn(text + size + 1, "+-0123456789") : 0);
    snprintf(number, sizeof number, "%.*s", (int)(whole < NUMBER_SIZE ? whole : 0), text);
    *value = strtod(number, &end);
    if (number[0] == '\0' || *end != '\0' || !isfinite(*value)) {
        snprintf(reason, QUANTITY_REASON, "must be a number%s%s%s, is %.60s",
                 unit != NULL ? " [" : "", unit != NULL ? unit : "", unit != NULL ? "]" : "", text);
        return false;
    }
    const char *symbol = text + whole + strspn(text + whole, " ");
    if (*symbol == '\0' || (unit != NULL && unit_same(symbol, unit)))
        return true;
    const size_t found = unit_find(symbol, unit);
    if (found == COUNT(units) || !text_same(units[found].si, unit)) {
        reason_write(text, number, symbol, unit, reason);
        return false;
    }
    const long exponent = has_exponent ? strtol(text + size + 1, NULL, 10) : 0;
    number[size] = '\0';
    snprintf(scaled, sizeof scaled, "%se%ld", number, exponent + units[found].exponent);
    *value = strtod(scaled, NULL) * units[found].factor;
    return true;
}
