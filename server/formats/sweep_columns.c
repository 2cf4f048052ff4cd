#include "server/formats/sweep_columns.h"

#include <stdlib.h>
#include <string.h>

// The archive's number of a column of the CSV: the point, the axes, the metrics, the status.
static size_t column_of(const Sweep *sweep, size_t place) {
    const size_t axes = sweep->axes.count, metrics = sweep->metrics.count;
    return place == 0                ? (size_t)SWEEP_CELL_POINT
           : place <= axes           ? SWEEP_CELL_METRIC + metrics + place - 1
           : place <= axes + metrics ? SWEEP_CELL_METRIC + place - 1 - axes
                                     : (size_t)SWEEP_CELL_STATUS;
}

static void read_place(void *context, size_t place, uint64_t offset, void *target, size_t size) {
    SweepArchive *archive = context;
    sweep_archive_read(archive, column_of(archive->sweep, place), offset, target, size);
}

static const char *name_of(const Sweep *sweep, size_t place) {
    const size_t axes = sweep->axes.count, metrics = sweep->metrics.count;
    if (place == 0)
        return "index";
    if (place > axes)
        return place <= axes + metrics ? sweep->metrics.at[place - 1 - axes] : "status";
    const char *pointer = sweep->axes.at[place - 1].pointer;
    return *pointer == '/' ? pointer + 1 : pointer;
}

Status sweep_columns_lay(SweepArchive *archive, const TableFormat *encoder, Segments *layout,
                         Problem *problem) {
    const Sweep *sweep = archive->sweep;
    const size_t count = 2 + sweep->axes.count + sweep->metrics.count;
    Column *columns = calloc(count, sizeof *columns);
    const Column **chosen = calloc(count, sizeof *chosen);
    Status status = columns != NULL && chosen != NULL
                        ? STATUS_OK
                        : problem_set(problem, STATUS_NO_MEMORY, "no memory for the table");
    if (status == STATUS_OK) {
        archive->is_places = true;
        archive->columns = (SegmentSource){read_place, archive};
        for (size_t i = 0; i < count; i++) {
            text_fit(columns[i].name, sizeof columns[i].name, name_of(sweep, i));
            chosen[i] = &columns[i];
        }
        const Table table = {.count = archive->source->rows,
                             .columns = chosen,
                             .column_count = count,
                             .source = &archive->columns};
        status = encoder->lay(&table, layout, problem);
    }
    free(columns);
    free(chosen);
    return status;
}

void sweep_columns(const Sweep *sweep, const TableFormat *encoder, Bytes *bytes) {
    const SweepSource source = sweep_source(sweep);
    SweepArchive archive = {.sweep = sweep, .source = &source};
    Segments layout = {0};
    if (sweep_columns_lay(&archive, encoder, &layout, NULL) != STATUS_OK)
        bytes->is_failed = true;
    else
        segments_write(&layout, bytes);
    segments_clear(&layout);
}
