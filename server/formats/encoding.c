#include "server/formats/encoding.h"

#include <stdlib.h>
#include <string.h>

#include "server/util/dtoa.h"

struct Encoding {
    const TableFormat *encoder; // of a text; NULL: all stands in the layout
    Table table;
    Segments layout;
    uint64_t at, end; // of the layout
    TextPlace place;
    bool is_last; // the piece is
    Bytes piece;  // of a text
    size_t taken; // of that piece
};

// Room that holds any piece: taken at the start, so that no later one can fail.
static size_t piece_room(const Table *table) {
    const size_t names = sizeof(Column) + 16;
    return (ENCODER_PIECE_NUMBERS + table->column_count + 2) * (SHORTEST_SIZE + 1) + names;
}

static Status tell(const Segments *layout, Problem *problem) {
    return layout->is_failed
               ? problem_set(problem, STATUS_NO_MEMORY, "no memory for the answer's layout")
               : STATUS_OK;
}

Status encoding_write(const TableFormat *encoder, const Table *table, Bytes *bytes,
                      Problem *problem) {
    if (encoder->next != NULL) {
        TextPlace place = {0, 0};
        while (encoder->next(table, &place, bytes) && !bytes->is_failed)
            continue;
        return STATUS_OK;
    }
    Segments layout = {0};
    Status status = encoder->lay(table, &layout, problem);
    if (status == STATUS_OK)
        status = tell(&layout, problem);
    if (status == STATUS_OK)
        segments_write(&layout, bytes);
    segments_clear(&layout);
    return status;
}

Status encoding_open_layout(Segments *layout, Encoding **encoding, Problem *problem) {
    Status status = tell(layout, problem);
    *encoding = status == STATUS_OK ? calloc(1, sizeof **encoding) : NULL;
    if (*encoding == NULL) {
        segments_clear(layout);
        return status != STATUS_OK
                   ? status
                   : problem_set(problem, STATUS_NO_MEMORY, "no memory for the answer");
    }
    (*encoding)->layout = *layout;
    (*encoding)->end = layout->size;
    *layout = (Segments){0};
    return STATUS_OK;
}

Status encoding_open(const TableFormat *encoder, const Table *table, Encoding **encoding,
                     Problem *problem) {
    *encoding = NULL;
    if (encoder->next == NULL) {
        Segments layout = {0};
        const Status status = encoder->lay(table, &layout, problem);
        if (status == STATUS_OK)
            return encoding_open_layout(&layout, encoding, problem);
        segments_clear(&layout);
        return status;
    }
    Encoding *made = calloc(1, sizeof *made);
    if (made != NULL) {
        made->encoder = encoder;
        made->table = *table;
        (void)bytes_reserve(&made->piece, piece_room(table));
        made->is_last = !encoder->next(table, &made->place, &made->piece);
        if (!made->piece.is_failed) {
            *encoding = made;
            return STATUS_OK;
        }
    }
    encoding_close(made);
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the answer");
}

void encoding_close(Encoding *encoding) {
    if (encoding == NULL)
        return;
    segments_clear(&encoding->layout);
    bytes_clear(&encoding->piece);
    free(encoding);
}

uint64_t encoding_size(const Encoding *encoding) {
    return encoding->encoder != NULL ? UINT64_MAX : encoding->layout.size;
}

void encoding_cut(Encoding *encoding, uint64_t first, uint64_t size) {
    encoding->at = first;
    encoding->end = first + size;
}

static size_t next_of_text(Encoding *encoding, char *target, size_t size) {
    Bytes *piece = &encoding->piece;
    size_t made = 0;
    while (made < size) {
        if (encoding->taken == piece->count) {
            if (encoding->is_last)
                break;
            piece->count = encoding->taken = 0;
            encoding->is_last = !encoding->encoder->next(&encoding->table, &encoding->place, piece);
        }
        const size_t left = piece->count - encoding->taken;
        const size_t count = left < size - made ? left : size - made;
        memcpy(target + made, piece->at + encoding->taken, count);
        encoding->taken += count;
        made += count;
    }
    return made;
}

size_t encoding_next(Encoding *encoding, char *target, size_t size) {
    if (encoding->encoder != NULL)
        return next_of_text(encoding, target, size);
    const uint64_t left = encoding->end - encoding->at;
    const size_t count = left < size ? (size_t)left : size;
    segments_read(&encoding->layout, encoding->at, target, count);
    encoding->at += count;
    return count;
}
