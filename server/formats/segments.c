#include "server/formats/format.h"

#include <stdlib.h>
#include <string.h>

#include "server/util/gzip.h"

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__ && sizeof(double) == 8,
               "numbers are written as they are in memory, and the formats say little-endian");

enum { FIRST_SEGMENTS = 16, PIECE_BYTES = 8192 };

void segments_clear(Segments *segments) {
    free(segments->at);
    bytes_clear(&segments->text);
    *segments = (Segments){0};
}

// Appends a segment that begins at the document's end; nothing where it is empty.
static void segments_add(Segments *segments, Segment segment) {
    if (segments->is_failed || segment.size == 0)
        return;
    if (segments->count == segments->room) {
        const size_t room = segments->room > 0 ? 2 * segments->room : FIRST_SEGMENTS;
        Segment *at = realloc(segments->at, room * sizeof *at);
        if (at == NULL) {
            segments->is_failed = true;
            return;
        }
        segments->at = at;
        segments->room = room;
    }
    segment.start = segments->size;
    segments->at[segments->count++] = segment;
    segments->size += segment.size;
}

void segments_put(Segments *segments, const void *data, size_t size) {
    const size_t text = segments->text.count;
    bytes_put(&segments->text, data, size);
    segments->is_failed = segments->is_failed || segments->text.is_failed;
    if (segments->is_failed)
        return;
    Segment *last = segments->count > 0 ? &segments->at[segments->count - 1] : NULL;
    if (last != NULL && last->table == NULL) {
        last->size += size;
        segments->size += size;
        return;
    }
    segments_add(segments, (Segment){.size = size, .text = text});
}

void segments_text(Segments *segments, Bytes *text) {
    segments->is_failed = segments->is_failed || text->is_failed;
    segments_put(segments, text->at, text->count);
    bytes_clear(text);
}

void segments_number(Segments *segments, uint64_t value, size_t size) {
    segments_put(segments, &value, size);
}

void segments_fill(Segments *segments, char with, size_t count) {
    for (size_t i = 0; i < count; i++)
        segments_put(segments, &with, 1);
}

void segments_column(Segments *segments, const Table *table, size_t column, size_t width) {
    const TableColumn described = table_column(table, column);
    segments_add(segments,
                 (Segment){.size = (uint64_t)table->count * (width > 0 ? width : sizeof(double)),
                           .table = table,
                           .column = column,
                           .width = width,
                           .is_numeric = width == 0 && table_column_is_numeric(&described)});
}

void segments_join(Segments *segments, const Segments *other) {
    segments->is_failed = segments->is_failed || other->is_failed;
    for (size_t i = 0; i < other->count && !segments->is_failed; i++) {
        const Segment *from = &other->at[i];
        if (from->table == NULL)
            segments_put(segments, other->text.at + from->text, (size_t)from->size);
        else
            segments_add(segments, *from);
    }
}

// Texts of `width` bytes each, without the first `skip` bytes.
static void segment_copy_texts(const TableColumn *column, const double *values, size_t width,
                               size_t skip, char *target, size_t size) {
    memset(target, 0, size);
    for (; size > 0; values++, skip = 0) {
        size_t length;
        const char *text = table_bare(column, *values, &length);
        const size_t some = width - skip < size ? width - skip : size;
        if (length > skip)
            memcpy(target, text + skip, length - skip < some ? length - skip : some);
        target += some;
        size -= some;
    }
}

// Zeros where the source cannot be read any more.
static void segment_read(const Segments *segments, const Segment *segment, uint64_t offset,
                         char *target, size_t size) {
    if (segment->table == NULL) {
        memcpy(target, segments->text.at + segment->text + offset, size);
        return;
    }
    const TableColumn column = table_column(segment->table, segment->column);
    const size_t width = segment->width > 0 ? segment->width : sizeof(double);
    double numbers[TABLE_PIECE];
    while (size > 0) {
        const size_t row = (size_t)(offset / width), skip = (size_t)(offset % width);
        const size_t rows = (skip + size + width - 1) / width;
        const size_t count = rows < TABLE_PIECE ? rows : TABLE_PIECE, whole = count * width - skip;
        const size_t some = whole < size ? whole : size;
        if (!table_read(segment->table, segment->column, row, count, numbers)) {
            memset(target, 0, size);
            return;
        }
        for (size_t i = 0; i < count && segment->is_numeric; i++)
            numbers[i] = strtod(column.texts[(size_t)numbers[i]], NULL);
        if (segment->width > 0)
            segment_copy_texts(&column, numbers, width, skip, target, some);
        else
            memcpy(target, (const char *)numbers + skip, some);
        target += some;
        offset += some;
        size -= some;
    }
}

// The last segment that begins at or before a place.
static const Segment *segments_find(const Segments *segments, uint64_t place) {
    size_t low = 0, high = segments->count;
    while (high - low > 1) {
        const size_t middle = low + (high - low) / 2;
        if (segments->at[middle].start <= place)
            low = middle;
        else
            high = middle;
    }
    return &segments->at[low];
}

void segments_read(const Segments *segments, uint64_t start, void *target, size_t size) {
    char *to = target;
    if (size == 0)
        return;
    for (const Segment *segment = segments_find(segments, start); size > 0; segment++) {
        const uint64_t offset = start - segment->start, left = segment->size - offset;
        const size_t some = left < size ? (size_t)left : size;
        segment_read(segments, segment, offset, to, some);
        to += some;
        start += some;
        size -= some;
    }
}

void segments_write(const Segments *segments, Bytes *bytes) {
    if (segments->is_failed) {
        bytes->is_failed = true;
    } else if (bytes_reserve(bytes, (size_t)segments->size)) {
        segments_read(segments, 0, bytes->at + bytes->count, (size_t)segments->size);
        bytes->count += (size_t)segments->size;
        bytes->at[bytes->count] = '\0';
    }
}

uint32_t segments_crc32(const Segments *segments) {
    uint32_t crc = 0;
    char piece[PIECE_BYTES];
    for (uint64_t at = 0; at < segments->size; at += sizeof piece) {
        const uint64_t left = segments->size - at;
        const size_t size = left < sizeof piece ? (size_t)left : sizeof piece;
        segments_read(segments, at, piece, size);
        crc = gzip_crc32(crc, piece, size);
    }
    return crc;
}
