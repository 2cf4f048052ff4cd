#include "server/formats/segments.h"

#include <stdlib.h>
#include <string.h>

#include "server/util/gzip.h"

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__ && sizeof(double) == 8,
               "numbers are written as they lie in memory, and the formats say little-endian");

enum { FIRST_SEGMENTS = 16, CHUNK = 1024, LANES = 8 }; // numbers that are counted up at once

static const double offsets[LANES] = {0, 1, 2, 3, 4, 5, 6, 7};

void segments_clear(Segments *layout) {
    free(layout->at);
    bytes_clear(&layout->text);
    *layout = (Segments){0};
}

static Segment *add(Segments *layout, uint64_t size) {
    if (layout->is_failed || size == 0)
        return NULL;
    if (layout->count == layout->room) {
        const size_t room = layout->room > 0 ? 2 * layout->room : FIRST_SEGMENTS;
        Segment *at = realloc(layout->at, room * sizeof *at);
        if (at == NULL) {
            layout->is_failed = true;
            return NULL;
        }
        layout->at = at;
        layout->room = room;
    }
    Segment *segment = &layout->at[layout->count++];
    *segment = (Segment){.start = layout->size, .size = size};
    layout->size += size;
    return segment;
}

static bool is_text(const Segment *segment) {
    return segment->values == NULL && segment->rate == 0 && segment->source == NULL;
}

void segments_put(Segments *layout, const void *data, size_t size) {
    const size_t text = layout->text.count;
    bytes_put(&layout->text, data, size);
    layout->is_failed = layout->is_failed || layout->text.is_failed;
    if (layout->is_failed)
        return;
    Segment *last = layout->count > 0 ? &layout->at[layout->count - 1] : NULL;
    if (last != NULL && is_text(last)) {
        last->size += size;
        layout->size += size;
        return;
    }
    Segment *segment = add(layout, size);
    if (segment != NULL)
        segment->text = text;
}

void segments_number(Segments *layout, uint64_t value, size_t size) {
    segments_put(layout, &value, size);
}

void segments_fill(Segments *layout, char with, size_t count) {
    for (size_t i = 0; i < count; i++)
        segments_put(layout, &with, 1);
}

void segments_values(Segments *layout, const double *values, size_t count) {
    Segment *segment = add(layout, count * sizeof *values);
    if (segment != NULL)
        segment->values = values;
}

void segments_counted(Segments *layout, size_t first, size_t step, double rate, size_t count) {
    Segment *segment = add(layout, count * sizeof(double));
    if (segment == NULL)
        return;
    segment->first = (double)first;
    segment->step = (double)step;
    segment->rate = rate;
}

void segments_source(Segments *layout, const SegmentSource *source, size_t column, uint64_t size) {
    Segment *segment = add(layout, size);
    if (segment == NULL)
        return;
    segment->source = source;
    segment->column = column;
}

void segments_join(Segments *layout, const Segments *other) {
    layout->is_failed = layout->is_failed || other->is_failed;
    for (size_t i = 0; i < other->count && !layout->is_failed; i++) {
        const Segment *from = &other->at[i];
        if (is_text(from)) {
            segments_put(layout, other->text.at + from->text, (size_t)from->size);
            continue;
        }
        Segment *segment = add(layout, from->size);
        if (segment == NULL)
            return;
        segment->values = from->values;
        segment->first = from->first;
        segment->step = from->step;
        segment->rate = from->rate;
        segment->source = from->source;
        segment->column = from->column;
    }
}

// Whole numbers below 2^53, so that each sum is exact and each quotient that of the text formats.
// The loop over eight becomes vectors.
static void count_up(const Segment *segment, size_t from, size_t count, double *target) {
    const double step = segment->step, rate = segment->rate;
    double next = segment->first + (double)from * step;
    size_t i = 0;
    for (; i + LANES <= count; i += LANES, next += LANES * step)
        for (size_t k = 0; k < LANES; k++)
            target[i + k] = (next + offsets[k] * step) / rate;
    for (; i < count; i++, next += step)
        target[i] = next / rate;
}

static void read_counted(const Segment *segment, uint64_t offset, char *target, size_t size) {
    double numbers[CHUNK];
    while (size > 0) {
        const size_t number = (size_t)(offset / sizeof *numbers), skip = offset % sizeof *numbers;
        const size_t most = sizeof numbers - skip, taken = size < most ? size : most;
        count_up(segment, number, (skip + taken + sizeof *numbers - 1) / sizeof *numbers, numbers);
        memcpy(target, (const char *)numbers + skip, taken);
        target += taken;
        offset += taken;
        size -= taken;
    }
}

// The last segment that begins at or before a place.
static const Segment *find(const Segments *layout, uint64_t place) {
    size_t low = 0, high = layout->count;
    while (high - low > 1) {
        const size_t middle = low + (high - low) / 2;
        if (layout->at[middle].start <= place)
            low = middle;
        else
            high = middle;
    }
    return &layout->at[low];
}

void segments_read(const Segments *layout, uint64_t start, void *target, size_t size) {
    char *to = target;
    if (size == 0)
        return;
    for (const Segment *segment = find(layout, start); size > 0; segment++) {
        const uint64_t offset = start - segment->start, left = segment->size - offset;
        const size_t taken = left < size ? (size_t)left : size;
        if (segment->values != NULL)
            memcpy(to, (const char *)segment->values + offset, taken);
        else if (segment->rate != 0)
            read_counted(segment, offset, to, taken);
        else if (segment->source != NULL)
            segment->source->read(segment->source->context, segment->column, offset, to, taken);
        else
            memcpy(to, layout->text.at + segment->text + offset, taken);
        to += taken;
        start += taken;
        size -= taken;
    }
}

void segments_write(const Segments *layout, Bytes *bytes) {
    if (layout->is_failed) {
        bytes->is_failed = true;
    } else if (bytes_reserve(bytes, (size_t)layout->size)) {
        segments_read(layout, 0, bytes->at + bytes->count, (size_t)layout->size);
        bytes->count += (size_t)layout->size;
        bytes->at[bytes->count] = '\0';
    }
}

uint32_t segments_crc32(const Segments *layout) {
    uint32_t crc = 0;
    double numbers[CHUNK];
    for (size_t i = 0; i < layout->count; i++) {
        const Segment *segment = &layout->at[i];
        if (segment->values != NULL) {
            crc = gzip_crc32(crc, segment->values, (size_t)segment->size);
        } else if (segment->source != NULL) {
            for (uint64_t at = 0; at < segment->size;) {
                const uint64_t left = segment->size - at;
                const size_t size = left < sizeof numbers ? (size_t)left : sizeof numbers;
                segment->source->read(segment->source->context, segment->column, at, numbers, size);
                crc = gzip_crc32(crc, numbers, size);
                at += size;
            }
        } else if (segment->rate == 0) {
            crc = gzip_crc32(crc, layout->text.at + segment->text, (size_t)segment->size);
        } else {
            const size_t count = (size_t)(segment->size / sizeof *numbers);
            for (size_t k = 0; k < count; k += CHUNK) {
                const size_t made = count - k < CHUNK ? count - k : CHUNK;
                count_up(segment, k, made, numbers);
                crc = gzip_crc32(crc, numbers, made * sizeof *numbers);
            }
        }
    }
    return crc;
}
