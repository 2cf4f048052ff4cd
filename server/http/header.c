// Header values are lists of items with parameters: `item;name=value;name="value", item`. Every
// function here walks them through `header_item_next`, which respects quotes.
#include "server/http/header.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

typedef struct Span {
    const char *at;
    size_t size;
} Span;

static Span span_trimmed(const char *at, size_t size) {
    while (size > 0 && (*at == ' ' || *at == '\t')) {
        at++;
        size--;
    }
    while (size > 0 && (at[size - 1] == ' ' || at[size - 1] == '\t'))
        size--;
    return (Span){at, size};
}

// The next piece up to an unquoted `separator`; *text goes on behind it. False at the end.
static bool header_item_next(const char **text, const char *end, char separator, Span *item) {
    if (*text >= end)
        return false;
    const char *at = *text;
    bool is_quoted = false;
    for (; at < end && (is_quoted || *at != separator); at++) {
        if (*at == '"')
            is_quoted = !is_quoted;
        else if (*at == '\\' && is_quoted && at + 1 < end)
            at++;
    }
    *item = span_trimmed(*text, (size_t)(at - *text));
    *text = at < end ? at + 1 : end;
    return true;
}

static bool span_is(Span span, const char *text) {
    return span.size == strlen(text) && strncasecmp(span.at, text, span.size) == 0;
}

// Splits "name=value" (quotes taken off); without '=' the value is empty.
static void header_split(Span item, Span *name, Span *value) {
    const char *equals = memchr(item.at, '=', item.size);
    if (equals == NULL) {
        *name = item;
        *value = (Span){item.at + item.size, 0};
        return;
    }
    *name = span_trimmed(item.at, (size_t)(equals - item.at));
    *value = span_trimmed(equals + 1, (size_t)(item.at + item.size - equals - 1));
    if (value->size >= 2 && value->at[0] == '"' && value->at[value->size - 1] == '"')
        *value = (Span){value->at + 1, value->size - 2};
}

static bool span_number(Span span, double *number) {
    char text[32];
    if (span.size == 0 || span.size >= sizeof text)
        return false;
    memcpy(text, span.at, span.size);
    text[span.size] = '\0';
    if (text[strspn(text, "0123456789.")] != '\0')
        return false;
    char *end;
    *number = strtod(text, &end);
    return *end == '\0';
}

// How well `range` ("*/*", "text/*", "text/csv") fits `type`: 0 not at all, 3 exactly.
static int header_fit(Span range, Span type) {
    if (range.size == type.size && strncasecmp(range.at, type.at, type.size) == 0)
        return 3;
    if (span_is(range, "*/*"))
        return 1;
    const size_t main = strcspn(type.at, "/") + 1;
    if (range.size == main + 1 && range.at[main] == '*' &&
        strncasecmp(range.at, type.at, main) == 0)
        return 2;
    return 0;
}

// The next item of a list with weights, "item;q=0.5, item". False at the end.
static bool header_weighted_next(const char **text, Span *item, double *weight) {
    Span whole, parameter, name, value;
    while (header_item_next(text, *text + strlen(*text), ',', &whole)) {
        const char *piece = whole.at, *end = whole.at + whole.size;
        if (!header_item_next(&piece, end, ';', item))
            continue;
        *weight = 1;
        while (header_item_next(&piece, end, ';', &parameter)) {
            header_split(parameter, &name, &value);
            if (span_is(name, "q") && !span_number(value, weight))
                *weight = 0;
        }
        return true;
    }
    return false;
}

// The weight that the most specific fitting range gives to `type`; *fit says how specific it was.
static double header_quality(const char *accept, const char *type, int *fit) {
    const Span bare = span_trimmed(type, strcspn(type, ";"));
    double quality = 0, q;
    Span range;
    *fit = 0;
    while (header_weighted_next(&accept, &range, &q)) {
        const int this_fit = header_fit(range, bare);
        if (this_fit > *fit) {
            *fit = this_fit;
            quality = q > 1 ? 1 : q;
        }
    }
    return quality;
}

int header_accept(const char *accept, const char *const *types) {
    if (accept == NULL || *accept == '\0')
        return 0;
    int best = -1;
    double best_quality = 0;
    for (int i = 0; types[i] != NULL; i++) {
        int fit;
        const double quality = header_quality(accept, types[i], &fit);
        if (fit > 0 && quality > best_quality) {
            best = i;
            best_quality = quality;
        }
    }
    return best;
}

bool header_accepts_gzip(const char *accept_encoding) {
    double any = 0, named = -1, q;
    Span coding;
    while (accept_encoding != NULL && header_weighted_next(&accept_encoding, &coding, &q)) {
        if (span_is(coding, "gzip") || span_is(coding, "x-gzip"))
            named = q;
        else if (span_is(coding, "*"))
            any = q;
    }
    return (named >= 0 ? named : any) > 0;
}

Prefer header_prefer(const char *prefer) {
    Prefer result = {0};
    if (prefer == NULL)
        return result;
    const char *end = prefer + strlen(prefer), *text = prefer;
    Span item, name, value;
    while (header_item_next(&text, end, ',', &item)) {
        const char *piece = item.at;
        Span first;
        if (!header_item_next(&piece, item.at + item.size, ';', &first))
            continue;
        header_split(first, &name, &value);
        double number;
        if (span_is(name, "respond-async")) {
            result.responds_async = true;
        } else if (span_is(name, "wait") && !result.has_wait && span_number(value, &number)) {
            result.has_wait = true; // of two, the first counts
            result.wait = number;
        }
    }
    return result;
}

// Digits alone; saturates.
static bool span_index(Span span, size_t *index) {
    if (span.size == 0)
        return false;
    size_t number = 0;
    for (size_t i = 0; i < span.size; i++) {
        if (span.at[i] < '0' || span.at[i] > '9')
            return false;
        const size_t digit = (size_t)(span.at[i] - '0');
        number = number > (SIZE_MAX - digit) / 10 ? SIZE_MAX : number * 10 + digit;
    }
    *index = number;
    return true;
}

RangeKind header_range(const char *range, size_t size, size_t *first, size_t *last) {
    if (range == NULL || strncasecmp(range, "bytes=", 6) != 0 || strchr(range, ',') != NULL)
        return RANGE_WHOLE;
    const Span item = span_trimmed(range + 6, strlen(range + 6));
    const char *dash = memchr(item.at, '-', item.size);
    if (dash == NULL)
        return RANGE_WHOLE;
    const Span from = {item.at, (size_t)(dash - item.at)};
    const Span to = {dash + 1, item.size - from.size - 1};
    size_t low = 0, high = SIZE_MAX;
    if (from.size == 0) {
        if (!span_index(to, &high))
            return RANGE_WHOLE;
        if (high == 0 || size == 0)
            return RANGE_UNSATISFIABLE;
        *first = high < size ? size - high : 0;
        *last = size - 1;
        return RANGE_PART;
    }
    if (!span_index(from, &low) || (to.size > 0 && (!span_index(to, &high) || high < low)))
        return RANGE_WHOLE;
    if (low >= size)
        return RANGE_UNSATISFIABLE;
    *first = low;
    *last = high < size ? high : size - 1;
    return RANGE_PART;
}

bool header_etag_matches(const char *if_none_match, const char *etag) {
    if (if_none_match == NULL)
        return false;
    const char *end = if_none_match + strlen(if_none_match), *text = if_none_match;
    Span item;
    while (header_item_next(&text, end, ',', &item)) {
        if (span_is(item, "*"))
            return true;
        if (item.size > 2 && strncmp(item.at, "W/", 2) == 0)
            item = (Span){item.at + 2, item.size - 2};
        if (item.size == strlen(etag) && memcmp(item.at, etag, item.size) == 0)
            return true;
    }
    return false;
}

bool header_etag_next(const char **list, const char **tag, size_t *size) {
    const char *end = *list + strlen(*list);
    Span item;
    while (header_item_next(list, end, ',', &item)) {
        const bool is_strong = item.size >= 2 && item.at[0] == '"' && item.at[item.size - 1] == '"';
        if (!is_strong && !span_is(item, "*"))
            continue;
        *tag = item.at;
        *size = item.size;
        return true;
    }
    return false;
}

bool header_type_is(const char *content_type, const char *type) {
    if (content_type == NULL)
        return false;
    return span_is(span_trimmed(content_type, strcspn(content_type, ";")), type);
}
