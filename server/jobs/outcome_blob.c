// Binary form of outcomes and series. Numbers of eight bytes in the order and form of the machine,
// which is little-endian. Structs are written by their Field rows: a REAL, COUNT or CHOICE takes
// eight bytes.
//
//     outcome   head | energy | summary | impacts | spectrum, where there is one: head |
//               frequencies | densities
//     columns   count | rows | names and units | values, column after column
//     part      status | flags | steps | why | summary | reduction | lists of numbers | spectra
//
// One function for each part writes and reads it.
#include <stdlib.h>
#include <string.h>

#include "server/jobs/jobs_private.h"

// `layout` and the two sizes distinguish blobs of a program with other rows.
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

// A blob that is written to `bytes` or, where that is NULL, read. Once it is broken it stays so,
// and reads zeros.
typedef struct Blob {
    Bytes *bytes;
    const char *at;
    size_t left;
    bool is_broken;
} Blob;

// False where `count` elements of `size` bytes are more than there is to be read.
static bool blob_allows(Blob *blob, uint64_t count, uint64_t size) {
    blob->is_broken = blob->is_broken || (count > 0 && size > blob->left / count);
    return !blob->is_broken;
}

static void blob_pass(Blob *blob, void *data, size_t size) {
    if (size == 0)
        return;
    if (blob->bytes != NULL) {
        bytes_put(blob->bytes, data, size);
    } else if (!blob_allows(blob, 1, size)) {
        memset(data, 0, size);
    } else {
        memcpy(data, blob->at, size);
        blob->at += size;
        blob->left -= size;
    }
}

static void blob_pass_row(Blob *blob, const Field *fields, void *item) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        void *member = (char *)item + field->offset;
        if (field->kind == FIELD_KIND_CHOICE) {
            int64_t choice = *(int *)member;
            blob_pass(blob, &choice, sizeof choice);
            if (blob->bytes == NULL)
                *(int *)member = (int)choice;
        } else if (blob_has(field)) {
            blob_pass(blob, member, sizeof(uint64_t));
        }
    }
}

static void blob_pass_columns(Blob *blob, Columns *columns) {
    uint64_t sizes[2] = {columns->count, columns->rows};
    const bool is_read = blob->bytes == NULL;
    blob_pass(blob, sizes, sizeof sizes);
    if (is_read && (!blob_allows(blob, sizes[0], sizeof columns->at->name) ||
                    !blob_allows(blob, sizes[1], sizes[0] * sizeof(double)) ||
                    columns_allocate(columns, sizes[0], sizes[1], 0, NULL) != STATUS_OK)) {
        blob->is_broken = true;
        return;
    }
    for (size_t i = 0; i < columns->count; i++) {
        Column *column = &columns->at[i];
        blob_pass(blob, column->name, sizeof column->name);
        blob_pass(blob, column->unit, sizeof column->unit);
        if (is_read)
            column->name[sizeof column->name - 1] = column->unit[sizeof column->unit - 1] = '\0';
    }
    for (size_t i = 0; i < columns->count; i++)
        blob_pass(blob, columns->at[i].values, columns->rows * sizeof(double));
}

static void blob_pass_impacts(Blob *blob, const BlobHead *head, Impacts *impacts) {
    if (blob->bytes == NULL) {
        if (!blob_allows(blob, head->impacts, head->impact_bytes))
            return;
        impacts->at = calloc(head->impacts + 1, sizeof *impacts->at);
        blob->is_broken = impacts->at == NULL;
        impacts->count = blob->is_broken ? 0 : head->impacts;
    }
    for (size_t i = 0; i < impacts->count; i++)
        blob_pass_row(blob, impact_fields, &impacts->at[i]);
}

static void blob_pass_spectrum(Blob *blob, Spectrum *spectrum) {
    BlobSpectrum head = {.segment = spectrum->settings.segment,
                         .overlap = spectrum->settings.overlap,
                         .window = (uint64_t)spectrum->settings.window,
                         .detrend = (uint64_t)spectrum->settings.detrend,
                         .segments = spectrum->segments,
                         .rows = spectrum->densities.rows};
    blob_pass(blob, &head, sizeof head);
    if (blob->bytes == NULL) {
        spectrum->settings = (WelchSettings){.segment = head.segment,
                                             .overlap = head.overlap,
                                             .window = (int)head.window,
                                             .detrend = (int)head.detrend};
        spectrum->segments = head.segments;
        if (head.rows == 0 || head.window > WELCH_BLACKMAN || head.detrend > WELCH_DETREND_NONE ||
            !blob_allows(blob, head.rows, sizeof(double)) ||
            (spectrum->frequency = malloc(head.rows * sizeof(double))) == NULL) {
            blob->is_broken = true;
            return;
        }
    }
    blob_pass(blob, spectrum->frequency, head.rows * sizeof(double));
    blob_pass_columns(blob, &spectrum->densities);
    blob->is_broken = blob->is_broken || spectrum->densities.rows != head.rows;
}

static void blob_pass_outcome(Blob *blob, Outcome *outcome) {
    Response *response = &outcome->response;
    const BlobHead own = blob_head(outcome);
    BlobHead head = own;
    blob_pass(blob, &head, sizeof head);
    if (blob->bytes == NULL) {
        blob->is_broken =
            blob->is_broken || memcmp(head.layout, own.layout, sizeof own.layout) != 0 ||
            head.energy_bytes != own.energy_bytes || head.impact_bytes != own.impact_bytes;
        response->sample_rate = head.sample_rate;
        response->count = head.count;
        response->is_unlisted = head.is_unlisted != 0;
        response->impact_count = head.impact_count;
        response->resting_count = head.resting_count;
    }
    blob_pass_row(blob, energy_fields, &response->energy);
    blob_pass_row(blob, summary_fields, &outcome->summary);
    blob_pass_impacts(blob, &head, &response->impacts);
    if (head.has_spectrum != 0)
        blob_pass_spectrum(blob, &outcome->spectrum);
}

// What is written is not changed.
void outcome_blob_write(Bytes *bytes, const Outcome *outcome) {
    const Columns *densities = &outcome->spectrum.densities;
    const BlobHead head = blob_head(outcome);
    // At once, so that no long blob is copied as it grows.
    (void)bytes_reserve(bytes, sizeof head + head.impacts * head.impact_bytes +
                                   densities->rows * sizeof(double) * (1 + densities->count));
    blob_pass_outcome(&(Blob){.bytes = bytes}, (Outcome *)outcome);
}

void series_blob_write(Bytes *bytes, const Columns *series) {
    blob_pass_columns(&(Blob){.bytes = bytes}, (Columns *)series);
}

Outcome *outcome_blob_read(const void *blob, size_t size) {
    Blob reader = {.at = blob, .left = size};
    Outcome *outcome = outcome_new();
    if (outcome == NULL)
        return NULL;
    blob_pass_outcome(&reader, outcome);
    if (!reader.is_broken && reader.left == 0)
        return outcome;
    outcome_unref(outcome);
    return NULL;
}

bool series_blob_read(const void *blob, size_t size, Columns *series) {
    Blob reader = {.at = blob, .left = size};
    *series = (Columns){.count = 0};
    blob_pass_columns(&reader, series);
    if (!reader.is_broken && reader.left == 0)
        return true;
    columns_clear(series);
    return false;
}

// NULL and an empty text are the same here.
static void blob_pass_text(Blob *blob, char **text) {
    uint64_t size = *text != NULL ? strlen(*text) : 0;
    blob_pass(blob, &size, sizeof size);
    if (blob->bytes == NULL && size > 0) {
        blob->is_broken = !blob_allows(blob, 1, size) || (*text = calloc(1, size + 1)) == NULL;
        if (blob->is_broken)
            return;
    }
    blob_pass(blob, *text, size);
}

static void blob_pass_reals(Blob *blob, Reals *reals) {
    uint64_t count = reals->count;
    blob_pass(blob, &count, sizeof count);
    if (blob->bytes == NULL && count > 0 &&
        (!blob_allows(blob, count, sizeof *reals->at) || !reals_allocate(reals, count))) {
        blob->is_broken = true;
        return;
    }
    blob_pass(blob, reals->at, count * sizeof *reals->at);
}

static void blob_pass_part(Blob *blob, StudyPart *part) {
    enum { IS_REFUSED = 1, HAS_SPECTRUM = 2, HAS_HISTORY = 4 };
    RunRecord *run = &part->run;
    const bool is_read = blob->bytes == NULL;
    uint64_t head[3] = {run->number, (uint64_t)run->status,
                        (part->is_refused ? IS_REFUSED : 0) |
                            (part->spectrum.densities.count > 0 ? HAS_SPECTRUM : 0) |
                            (part->history.densities.count > 0 ? HAS_HISTORY : 0)};
    blob_pass(blob, head, sizeof head);
    blob->is_broken = blob->is_broken || head[1] >= STATUS_COUNT;
    if (is_read && !blob->is_broken) {
        run->number = head[0];
        run->status = (Status)head[1];
        part->is_refused = (head[2] & IS_REFUSED) != 0;
    }
    blob_pass(blob, &run->steps, sizeof run->steps);
    blob_pass_text(blob, &run->why);
    blob_pass_row(blob, summary_fields, &run->summary);
    blob_pass_row(blob, reduction_fields, &run->reduction);
    Reals *const lists[] = {&run->restitution, &run->contact_time, &run->inputs,
                            &part->drawn_again};
    for (size_t i = 0; i < COUNT(lists); i++)
        blob_pass_reals(blob, lists[i]);
    if ((head[2] & HAS_SPECTRUM) != 0)
        blob_pass_spectrum(blob, &part->spectrum);
    if ((head[2] & HAS_HISTORY) != 0)
        blob_pass_spectrum(blob, &part->history);
    // The sentence tells a run that failed.
    blob->is_broken = blob->is_broken || (run->why == NULL) != (run->status == STATUS_OK);
}

void part_blob_write(Bytes *bytes, const StudyPart *part) {
    blob_pass_part(&(Blob){.bytes = bytes}, (StudyPart *)part);
}

StudyPart *part_blob_read(const StudyWork *work, const void *blob, size_t size) {
    Blob reader = {.at = blob, .left = size};
    StudyPart *part = calloc(1, work->kind->part_size);
    if (part == NULL)
        return NULL;
    blob_pass_part(&reader, part);
    if (!reader.is_broken && reader.left == 0)
        return part;
    study_part_free(work, part);
    return NULL;
}
