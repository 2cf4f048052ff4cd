// Numbers of eight bytes in the order and form of the machine, which is little-endian. Structs are
// written by their Field rows: a REAL, COUNT or CHOICE takes eight bytes.
//
//     outcome   head | energy | summary | impacts | spectrum, where there is one: head |
//     frequencies | densities columns   count | rows | names and units | values, column after
//     column
#include "server/jobs/jobs_private.h"

#include <stdlib.h>
#include <string.h>

// `layout` and the two sizes tell apart blobs of a program with other rows.
typedef struct BlobHead {
    char layout[4];
    uint16_t energy_bytes, impact_bytes;
    double sample_rate;
    uint64_t count, impact_count;
    uint32_t impacts, resting_count;
    uint32_t is_unlisted, has_spectrum;
} BlobHead;

typedef struct BlobSpectrum {
    uint64_t segment, overlap, window, detrend, segments, rows;
} BlobSpectrum;

static const char blob_layout[4] = {'o', 'u', 't', '2'};

static bool blob_has(const Field *field) {
    return field->kind == FIELD_KIND_REAL || field->kind == FIELD_KIND_COUNT ||
           field->kind == FIELD_KIND_CHOICE;
}

static uint64_t blob_row_bytes(const Field *fields) {
    uint64_t bytes = 0;
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++)
        bytes += blob_has(field) ? sizeof(uint64_t) : 0;
    return bytes;
}

static BlobHead blob_head(const Outcome *outcome) {
    const Response *response = &outcome->response;
    BlobHead head = {.energy_bytes =
                         (uint16_t)(blob_row_bytes(energy_fields) + blob_row_bytes(summary_fields)),
                     .impact_bytes = (uint16_t)blob_row_bytes(impact_fields),
                     .sample_rate = response->sample_rate,
                     .count = response->count,
                     .impacts = (uint32_t)response->impacts.count,
                     .impact_count = response->impact_count,
                     .resting_count = (uint32_t)response->resting_count,
                     .is_unlisted = response->is_unlisted,
                     .has_spectrum = outcome->spectrum.densities.count > 0};
    memcpy(head.layout, blob_layout, sizeof head.layout);
    return head;
}

static void blob_put_row(Bytes *bytes, const Field *fields, const void *item) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        const void *member = (const char *)item + field->offset;
        if (!blob_has(field))
            continue;
        const int64_t choice = field->kind == FIELD_KIND_CHOICE ? *(const int *)member : 0;
        bytes_put(bytes, field->kind == FIELD_KIND_CHOICE ? &choice : member, sizeof choice);
    }
}

void series_blob_write(Bytes *bytes, const Columns *columns) {
    const uint64_t sizes[2] = {columns->count, columns->rows};
    bytes_put(bytes, sizes, sizeof sizes);
    for (size_t i = 0; i < columns->count; i++) {
        bytes_put(bytes, columns->at[i].name, sizeof columns->at[i].name);
        bytes_put(bytes, columns->at[i].unit, sizeof columns->at[i].unit);
    }
    for (size_t i = 0; i < columns->count; i++)
        bytes_put(bytes, columns->at[i].values, columns->rows * sizeof(double));
}

void outcome_blob_write(Bytes *bytes, const Outcome *outcome) {
    const Response *response = &outcome->response;
    const Spectrum *spectrum = &outcome->spectrum;
    const size_t rows = spectrum->densities.rows;
    const BlobHead head = blob_head(outcome);
    // At once, so that no long blob is copied as it grows.
    (void)bytes_reserve(bytes, sizeof head + head.impacts * head.impact_bytes +
                                   rows * sizeof(double) * (1 + spectrum->densities.count));
    bytes_put(bytes, &head, sizeof head);
    blob_put_row(bytes, energy_fields, &response->energy);
    blob_put_row(bytes, summary_fields, &outcome->summary);
    for (size_t i = 0; i < response->impacts.count; i++)
        blob_put_row(bytes, impact_fields, &response->impacts.at[i]);
    if (head.has_spectrum == 0)
        return;
    const BlobSpectrum settings = {.segment = spectrum->settings.segment,
                                   .overlap = spectrum->settings.overlap,
                                   .window = (uint64_t)spectrum->settings.window,
                                   .detrend = (uint64_t)spectrum->settings.detrend,
                                   .segments = spectrum->segments,
                                   .rows = rows};
    bytes_put(bytes, &settings, sizeof settings);
    bytes_put(bytes, spectrum->frequency, rows * sizeof(double));
    series_blob_write(bytes, &spectrum->densities);
}

// Once it is broken it stays so, and reads zeros.
typedef struct BlobReader {
    const char *at;
    size_t left;
    bool is_broken;
} BlobReader;

// False where `count` elements of `size` bytes are more than there is.
static bool blob_allows(BlobReader *reader, uint64_t count, uint64_t size) {
    reader->is_broken = reader->is_broken || (count > 0 && size > reader->left / count);
    return !reader->is_broken;
}

static void blob_take(BlobReader *reader, void *target, size_t size) {
    if (!blob_allows(reader, 1, size)) {
        memset(target, 0, size);
    } else if (size > 0) {
        memcpy(target, reader->at, size);
        reader->at += size;
        reader->left -= size;
    }
}

static void blob_take_row(BlobReader *reader, const Field *fields, void *item) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        int64_t choice;
        char *member = (char *)item + field->offset;
        if (field->kind == FIELD_KIND_CHOICE) {
            blob_take(reader, &choice, sizeof choice);
            *(int *)(void *)member = (int)choice;
        } else if (blob_has(field)) {
            blob_take(reader, member, sizeof(uint64_t));
        }
    }
}

static void blob_take_columns(BlobReader *reader, Columns *columns) {
    uint64_t sizes[2];
    blob_take(reader, sizes, sizeof sizes);
    if (!blob_allows(reader, sizes[0], sizeof columns->at->name) ||
        !blob_allows(reader, sizes[1], sizes[0] * sizeof(double)) ||
        columns_allocate(columns, sizes[0], sizes[1], 0, NULL) != STATUS_OK) {
        reader->is_broken = true;
        return;
    }
    for (size_t i = 0; i < columns->count; i++) {
        Column *column = &columns->at[i];
        blob_take(reader, column->name, sizeof column->name);
        blob_take(reader, column->unit, sizeof column->unit);
        column->name[sizeof column->name - 1] = column->unit[sizeof column->unit - 1] = '\0';
    }
    blob_take(reader, columns->block, columns->count * columns->rows * sizeof(double));
}

static void blob_take_impacts(BlobReader *reader, const BlobHead *head, Impacts *impacts) {
    if (!blob_allows(reader, head->impacts, head->impact_bytes))
        return;
    impacts->at = calloc(head->impacts + 1, sizeof *impacts->at);
    reader->is_broken = impacts->at == NULL;
    for (; impacts->count < head->impacts && !reader->is_broken; impacts->count++)
        blob_take_row(reader, impact_fields, &impacts->at[impacts->count]);
}

static void blob_take_spectrum(BlobReader *reader, Spectrum *spectrum) {
    BlobSpectrum head;
    blob_take(reader, &head, sizeof head);
    spectrum->settings = (WelchSettings){.segment = head.segment,
                                         .overlap = head.overlap,
                                         .window = (int)head.window,
                                         .detrend = (int)head.detrend};
    spectrum->segments = head.segments;
    if (head.rows > 0 && blob_allows(reader, head.rows, sizeof(double))) {
        spectrum->frequency = malloc(head.rows * sizeof(double));
        reader->is_broken = spectrum->frequency == NULL;
    }
    if (head.rows > 0 && !reader->is_broken)
        blob_take(reader, spectrum->frequency, head.rows * sizeof(double));
    blob_take_columns(reader, &spectrum->densities);
    reader->is_broken = reader->is_broken || spectrum->densities.rows != head.rows ||
                        head.window > WELCH_BLACKMAN || head.detrend > WELCH_DETREND_NONE;
}

Outcome *outcome_blob_read(const void *blob, size_t size) {
    BlobReader reader = {blob, size, false};
    BlobHead head;
    Outcome *outcome = outcome_new();
    if (outcome == NULL)
        return NULL;
    const BlobHead own = blob_head(outcome);
    Response *response = &outcome->response;
    blob_take(&reader, &head, sizeof head);
    reader.is_broken =
        reader.is_broken || memcmp(head.layout, own.layout, sizeof own.layout) != 0 ||
        head.energy_bytes != own.energy_bytes || head.impact_bytes != own.impact_bytes;
    response->sample_rate = head.sample_rate;
    response->count = head.count;
    response->is_unlisted = head.is_unlisted != 0;
    response->impact_count = head.impact_count;
    response->resting_count = head.resting_count;
    blob_take_row(&reader, energy_fields, &response->energy);
    blob_take_row(&reader, summary_fields, &outcome->summary);
    blob_take_impacts(&reader, &head, &response->impacts);
    if (head.has_spectrum != 0)
        blob_take_spectrum(&reader, &outcome->spectrum);
    if (!reader.is_broken && reader.left == 0)
        return outcome;
    outcome_unref(outcome);
    return NULL;
}

bool series_blob_read(const void *blob, size_t size, Columns *series) {
    BlobReader reader = {blob, size, false};
    *series = (Columns){.count = 0};
    blob_take_columns(&reader, series);
    if (!reader.is_broken && reader.left == 0)
        return true;
    columns_clear(series);
    return false;
}
