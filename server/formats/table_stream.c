#include "server/formats/table_stream.h"

#include <stdlib.h>
#include <string.h>

#include "server/util/dtoa.h"

static Status table_stream_no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory for the answer");
}

TableStream *table_stream_new(Outcome *outcome) {
    TableStream *stream = calloc(1, sizeof *stream);
    if (stream == NULL)
        outcome_unref(outcome);
    else
        stream->outcome = outcome;
    return stream;
}

void table_stream_free(void *context) {
    TableStream *stream = context;
    if (stream == NULL)
        return;
    free(stream->chosen);
    columns_clear(&stream->made);
    free(stream->impacts);
    free(stream->numbers);
    bytes_clear(&stream->members);
    bytes_clear(&stream->end);
    outcome_unref(stream->outcome);
    segments_clear(&stream->segments);
    bytes_clear(&stream->piece);
    if (stream->release != NULL)
        stream->release(stream->source);
    free(stream);
}

// --- what is written ---

Status table_stream_columns(TableStream *stream, const Columns *columns, bool has_axis,
                            Problem *problem) {
    Table *table = &stream->table;
    free(stream->chosen);
    stream->chosen = calloc(columns->count + 1, sizeof *stream->chosen);
    if (stream->chosen == NULL)
        return table_stream_no_memory(problem);
    const size_t first = has_axis ? 1 : 0;
    for (size_t i = first; i < columns->count; i++)
        stream->chosen[i - first] = &columns->at[i];
    table->columns = stream->chosen;
    table->column_count = columns->count - first;
    table->count = columns->rows;
    if (has_axis) {
        table->axis_name = columns->at[0].name;
        table->axis_unit = columns->at[0].unit;
        table->axis = columns->at[0].values;
    }
    return STATUS_OK;
}

Status table_stream_series(TableStream *stream, Problem *problem) {
    const Response *response = &stream->outcome->response;
    TRY(table_stream_columns(stream, &response->series, false, problem));
    stream->table.axis_name = "time";
    stream->table.axis_unit = "s";
    stream->table.axis_rate = response->sample_rate;
    stream->table.count = response->count;
    return STATUS_OK;
}

Status table_stream_psd(TableStream *stream, Problem *problem) {
    const Spectrum *spectrum = &stream->outcome->spectrum;
    const WelchSettings *settings = &spectrum->settings;
    Table *table = &stream->table;
    TRY(table_stream_columns(stream, &spectrum->densities, false, problem));
    table->axis_name = "frequency";
    table->axis_unit = "Hz";
    table->axis = spectrum->frequency;
    bytes_format(&stream->members,
                 "\"method\": \"welch\", \"segment\": %zu, \"overlap\": %zu, \"window\": \"%s\", "
                 "\"detrend\": \"%s\", \"segments\": %zu, ",
                 settings->segment, settings->overlap, welch_window_names[settings->window],
                 welch_detrend_names[settings->detrend], spectrum->segments);
    table->members = stream->members.at;
    return stream->members.is_failed ? table_stream_no_memory(problem) : STATUS_OK;
}

Status table_stream_records(TableStream *stream, const Field *fields, const void *records,
                            size_t count, size_t size, Problem *problem) {
    TRY(table_records(fields, records, count, size, &stream->made, problem));
    return table_stream_columns(stream, &stream->made, false, problem);
}

// Copies the impacts of the window, which are in the order of their starts.
static Status table_stream_choose_impacts(TableStream *stream, const ImpactWindow *window,
                                          size_t *chosen, size_t *matching, Problem *problem) {
    const Impacts *impacts = &stream->outcome->response.impacts;
    stream->impacts = malloc((impacts->count + 1) * sizeof *stream->impacts);
    stream->numbers = malloc((impacts->count + 1) * sizeof *stream->numbers);
    if (stream->impacts == NULL || stream->numbers == NULL)
        return table_stream_no_memory(problem);
    for (size_t i = 0; i < impacts->count; i++) {
        const Impact *impact = &impacts->at[i];
        if (!(impact->start <= window->to))
            break;
        if (impact->end < window->from) // an open contact has no end
            continue;
        ++*matching;
        if (i + 1 < window->first || *chosen == window->limit)
            continue;
        stream->numbers[*chosen] = i + 1;
        stream->impacts[(*chosen)++] = *impact;
    }
    return STATUS_OK;
}

Status table_stream_impacts(TableStream *stream, const TableFormat *format,
                            const ImpactWindow *window, Problem *problem) {
    const Response *response = &stream->outcome->response;
    const Impact *impacts = response->impacts.at;
    size_t count = response->impacts.count;
    if (window != NULL) {
        size_t matching = 0;
        count = 0;
        TRY(table_stream_choose_impacts(stream, window, &count, &matching, problem));
        impacts = stream->impacts;
        bytes_format(&stream->end, ", \"matching\": %zu", matching);
    }
    if (format != &format_json && format != &format_csv)
        return table_stream_records(stream, impact_fields, impacts, count, sizeof *impacts,
                                    problem);
    bytes_format(&stream->members, "\"count\": %llu, \"resting\": %llu, \"impacts\": ",
                 (unsigned long long)response->impact_count,
                 (unsigned long long)response->resting_count);
    stream->table = (Table){.count = count,
                            .fields = impact_fields,
                            .records = impacts,
                            .record_size = sizeof *impacts,
                            .numbers = stream->numbers,
                            .members = stream->members.at,
                            .end = stream->end.at};
    return stream->members.is_failed || stream->end.is_failed ? table_stream_no_memory(problem)
                                                              : STATUS_OK;
}

Status table_stream_downsample(TableStream *stream, size_t points, Problem *problem) {
    Table *table = &stream->table;
    const size_t samples = table->count, bucket = (samples + points - 1) / points;
    Columns buckets;
    TRY(downsample(table->columns, table->column_count, table->first, samples, bucket, &buckets,
                   problem));
    columns_clear(&stream->made);
    stream->made = buckets;
    TRY(table_stream_columns(stream, &stream->made, false, problem));
    // Without channels too there is a time for each.
    table->count = (samples + bucket - 1) / bucket;
    table->bucket = bucket;
    table->samples = samples;
    return STATUS_OK;
}

// --- how it is read ---

// The first piece is made here, so that most faults are found before anything is sent.
Status table_stream_check(const TableStream *stream, Problem *problem) {
    return stream->is_broken != NULL && *stream->is_broken
               ? problem_set(problem, STATUS_BUSY,
                             "the table's rows were deleted or computed again while they were "
                             "read; ask again")
               : STATUS_OK;
}

Status table_stream_open(TableStream *stream, const TableFormat *format, Problem *problem) {
    stream->format = format;
    if (format->next != NULL)
        stream->is_last = !format->next(&stream->table, &stream->place, &stream->piece);
    else if (format->layout != NULL)
        TRY(format->layout(&stream->table, &stream->segments, problem));
    stream->until = stream->segments.size;
    TRY(table_stream_check(stream, problem));
    return stream->piece.is_failed || stream->segments.is_failed ? table_stream_no_memory(problem)
                                                                 : STATUS_OK;
}

bool table_stream_is_below(const TableStream *stream, size_t bytes) {
    enum { NAME = 32 }; // of a member of a record, about
    const Table *table = &stream->table;
    size_t values = table->column_count + 1;
    for (const Field *field = table->fields; field != NULL && field->kind != FIELD_KIND_END;
         field++)
        values += 1 + NAME / (SHORTEST_SIZE + 1);
    return table->count <= bytes / (SHORTEST_SIZE + 1) / values;
}

uint64_t table_stream_size(const TableStream *stream) {
    return stream->format->next != NULL ? UINT64_MAX : stream->segments.size;
}

void table_stream_write(TableStream *stream, Bytes *bytes) {
    if (stream->format->next == NULL) {
        segments_write(&stream->segments, bytes);
        return;
    }
    bytes_put(bytes, stream->piece.at, stream->piece.count);
    while (!stream->is_last && !bytes->is_failed)
        stream->is_last = !stream->format->next(&stream->table, &stream->place, bytes);
}

void table_stream_cut(TableStream *stream, uint64_t first, uint64_t size) {
    stream->at = first;
    stream->until = first + size;
}

static ptrdiff_t table_stream_next_of_text(TableStream *stream, char *target, size_t size) {
    Bytes *piece = &stream->piece;
    size_t sent = 0;
    while (sent < size) {
        if (stream->taken == piece->count) {
            if (stream->is_last)
                break;
            piece->count = stream->taken = 0;
            stream->is_last = !stream->format->next(&stream->table, &stream->place, piece);
            if (piece->is_failed || table_stream_check(stream, NULL) != STATUS_OK)
                return -1;
        }
        sent += bytes_hand(piece, &stream->taken, target + sent, size - sent);
    }
    return (ptrdiff_t)sent;
}

ptrdiff_t table_stream_next(TableStream *stream, char *target, size_t size) {
    if (stream->format->next != NULL)
        return table_stream_next_of_text(stream, target, size);
    const uint64_t left = stream->until - stream->at;
    const size_t count = left < size ? (size_t)left : size;
    segments_read(&stream->segments, stream->at, target, count);
    stream->at += count;
    return table_stream_check(stream, NULL) == STATUS_OK ? (ptrdiff_t)count : -1;
}
