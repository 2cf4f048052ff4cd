// Every array's place is known beforehand, its numbers are read when their bytes are asked for:
//
//     column   0 points | 1 statuses | 2 ... metrics | then the axes
#include "server/formats/sweep_npz.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/formats/npy.h"
#include "server/formats/zip.h"

static size_t first_axis(const SweepArchive *archive) {
    return SWEEP_CELL_METRIC + archive->sweep->metrics.count;
}

// Bytes of a text; 0: the column is of numbers.
static size_t width_of(const SweepArchive *archive, size_t column) {
    return column == SWEEP_CELL_STATUS     ? archive->status_width
           : column >= first_axis(archive) ? archive->axis_widths[column - first_axis(archive)]
                                           : 0;
}

// A scalar's text without its quotes, where it has any; it has none inside.
static const char *bare(const char *json, size_t *length) {
    const bool is_quoted = *json == '"';
    *length = strlen(json) - (is_quoted ? 2 : 0);
    return json + is_quoted;
}

static bool is_numeric(const Texts *values) {
    for (size_t i = 0; i < values->count; i++)
        if (strchr("-0123456789", values->at[i][0]) == NULL)
            return false;
    return true;
}

// Turns what the source has in a column's place into the column's own numbers.
static void finish(const SweepArchive *archive, size_t column, double *values, size_t count) {
    if (column < first_axis(archive))
        return;
    const size_t axis = column - first_axis(archive);
    const bool is_place = archive->is_places && !is_numeric(&archive->sweep->axes.at[axis].values);
    for (size_t i = 0; i < count; i++)
        values[i] = is_place ? (double)sweep_value_index(archive->sweep, axis, (size_t)values[i])
                             : strtod(sweep_axis_text(archive->sweep, axis, values[i]), NULL);
}

// Bytes skip ... skip + size - 1 of the text of a row, filled up with zeros.
static void put_text(const SweepArchive *archive, size_t column, double value, size_t skip,
                     char *target, size_t size) {
    size_t length;
    const char *text =
        column == SWEEP_CELL_STATUS
            ? bare(sweep_status_names[(size_t)value], &length)
            : bare(sweep_axis_text(archive->sweep, column - first_axis(archive), value), &length);
    const size_t left = length > skip ? length - skip : 0, some = left < size ? left : size;
    memcpy(target, text + skip, some);
    memset(target + some, 0, size - some);
}

void sweep_archive_read(void *context, size_t column, uint64_t offset, void *target, size_t size) {
    SweepArchive *archive = context;
    const SweepSource *source = archive->source;
    const size_t texts = width_of(archive, column), width = texts > 0 ? texts : sizeof(double);
    const size_t cell = column < first_axis(archive) ? column : SWEEP_CELL_POINT;
    char *at = target;
    double values[SWEEP_PIECE];
    while (size > 0) {
        const size_t row = (size_t)(offset / width), skip = (size_t)(offset % width);
        const size_t rows = (skip + size + width - 1) / width;
        const size_t count = rows < SWEEP_PIECE ? rows : SWEEP_PIECE;
        const size_t most = count * width - skip, taken = most < size ? most : size;
        archive->is_broken =
            archive->is_broken || !source->read(source->context, cell, row, count, values);
        if (archive->is_broken) {
            memset(at, 0, size);
            return;
        }
        if (texts == 0) {
            finish(archive, column, values, count);
            memcpy(at, (const char *)values + skip, taken);
        }
        for (size_t done = 0, i = 0, from = skip; texts > 0 && done < taken; i++, from = 0) {
            const size_t some = taken - done < width - from ? taken - done : width - from;
            put_text(archive, column, values[i], from, at + done, some);
            done += some;
        }
        at += taken;
        offset += taken;
        size -= taken;
    }
}

static Status put(SweepArchive *archive, Zip *zip, const char *name, size_t column,
                  Problem *problem) {
    const size_t rows = archive->source->rows, texts = width_of(archive, column);
    char file[ZIP_NAME_MAX + 1], type[32] = "<f8";
    Segments array = {0};
    if (texts > 0)
        snprintf(type, sizeof type, "|S%zu", texts);
    npy_put_header_of(&array, type, rows, 0);
    segments_source(&array, &archive->columns, column,
                    (uint64_t)rows * (texts > 0 ? texts : sizeof(double)));
    snprintf(file, sizeof file, "%.74s.npy", *name == '/' ? name + 1 : name);
    const Status status = zip_put(zip, file, &array, problem);
    segments_clear(&array);
    if (status == STATUS_OK && archive->is_broken)
        return problem_set(problem, STATUS_CONFLICT,
                           "the sweep's rows were deleted or made anew while they were read");
    return status;
}

static size_t longest(const Texts *values) {
    size_t most = 1, length;
    for (size_t i = 0; i < values->count; i++) {
        (void)bare(values->at[i], &length);
        most = length > most ? length : most;
    }
    return most;
}

static void measure(SweepArchive *archive) {
    const SweepAxesValues *axes = &archive->sweep->axes;
    for (size_t i = 0; i < axes->count && i < SWEEP_AXES; i++)
        archive->axis_widths[i] =
            is_numeric(&axes->at[i].values) ? 0 : longest(&axes->at[i].values);
    for (size_t i = 0; i < SWEEP_STATUSES; i++) {
        const size_t length = strlen(sweep_status_names[i]);
        archive->status_width = length > archive->status_width ? length : archive->status_width;
    }
}

Status sweep_npz_lay(SweepArchive *archive, Segments *layout, Problem *problem) {
    const Sweep *sweep = archive->sweep;
    Zip zip = {.layout = layout};
    archive->columns = (SegmentSource){sweep_archive_read, archive};
    measure(archive);
    Status status = put(archive, &zip, "index", SWEEP_CELL_POINT, problem);
    for (size_t i = 0; i < sweep->axes.count && status == STATUS_OK; i++)
        status = put(archive, &zip, sweep->axes.at[i].pointer, first_axis(archive) + i, problem);
    for (size_t i = 0; i < sweep->metrics.count && status == STATUS_OK; i++)
        status = put(archive, &zip, sweep->metrics.at[i], SWEEP_CELL_METRIC + i, problem);
    if (status == STATUS_OK)
        status = put(archive, &zip, "status", SWEEP_CELL_STATUS, problem);
    const Status ended = zip_end(&zip, status == STATUS_OK ? problem : NULL);
    return status != STATUS_OK ? status : ended;
}

void sweep_npz(const Sweep *sweep, Bytes *bytes) {
    const SweepSource source = sweep_source(sweep);
    SweepArchive archive = {.sweep = sweep, .source = &source};
    Segments layout = {0};
    if (sweep_npz_lay(&archive, &layout, NULL) != STATUS_OK)
        bytes->is_failed = true;
    else
        segments_write(&layout, bytes);
    segments_clear(&layout);
}
