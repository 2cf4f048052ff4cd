// All are doubles, as the machine has them: little-endian wherever this runs. The first eight bytes
// name the layout, so that a later engine still reads it or leaves it alone.
//
//     "impact 1" | response's and spectrum's numbers | impacts | names | columns
#include "server/jobs/outcome_blob.h"

#include <stdlib.h>
#include <string.h>

static const char layout[8] = {'i', 'm', 'p', 'a', 'c', 't', ' ', '1'};

enum { HEAD = 24, IMPACT = 13 };

typedef struct Decoder {
    const char *at;
    size_t left;
    bool is_bad;
} Decoder;

static void put_numbers(Bytes *bytes, const double *values, size_t count) {
    bytes_put(bytes, values, count * sizeof *values);
}

static void put_columns(Bytes *bytes, const Columns *columns) {
    for (size_t i = 0; i < columns->count; i++) {
        bytes_put(bytes, columns->at[i].name, sizeof columns->at[i].name);
        bytes_put(bytes, columns->at[i].unit, sizeof columns->at[i].unit);
    }
    for (size_t i = 0; i < columns->count; i++)
        put_numbers(bytes, columns->at[i].values, columns->rows);
}

void outcome_blob_write(Bytes *bytes, const Outcome *outcome) {
    const Response *response = &outcome->response;
    const Spectrum *spectrum = &outcome->spectrum;
    const Energy *energy = &response->energy;
    const double head[HEAD] = {response->sample_rate,
                               (double)response->count,
                               (double)response->series.count,
                               (double)response->series.rows,
                               (double)response->impacts.count,
                               response->is_unlisted,
                               (double)response->impact_count,
                               (double)response->resting_count,
                               energy->initial,
                               energy->input,
                               energy->structural_damping,
                               energy->contact,
                               energy->kinetic,
                               energy->strain,
                               energy->residual,
                               (double)spectrum->densities.count,
                               (double)spectrum->densities.rows,
                               (double)spectrum->settings.segment,
                               (double)spectrum->settings.overlap,
                               spectrum->settings.window,
                               spectrum->settings.detrend,
                               (double)spectrum->segments};
    bytes_put(bytes, layout, sizeof layout);
    put_numbers(bytes, head, HEAD);
    for (size_t i = 0; i < response->impacts.count; i++) {
        const Impact *one = &response->impacts.at[i];
        const double row[IMPACT] = {one->kind,
                                    one->start,
                                    one->end,
                                    (double)one->damper,
                                    one->side,
                                    one->approach_speed,
                                    one->separation_speed,
                                    one->restitution,
                                    one->duration,
                                    one->peak_force,
                                    one->impulse,
                                    one->energy_lost,
                                    one->is_resumed};
        put_numbers(bytes, row, IMPACT);
    }
    put_columns(bytes, &response->series);
    put_numbers(bytes, spectrum->frequency, spectrum->densities.rows);
    put_columns(bytes, &spectrum->densities);
}

static void take(Decoder *reader, void *target, size_t size) {
    if (reader->is_bad || reader->left < size) {
        reader->is_bad = true;
        memset(target, 0, size);
        return;
    }
    memcpy(target, reader->at, size);
    reader->at += size;
    reader->left -= size;
}

// A count that cannot be within what is left is none.
static size_t as_count(Decoder *reader, double value, size_t size) {
    if (!(value >= 0 && value <= (double)(reader->left / size)))
        reader->is_bad = true;
    return reader->is_bad ? 0 : (size_t)value;
}

static void take_columns(Decoder *reader, size_t count, size_t rows, Columns *columns) {
    if (reader->is_bad || columns_allocate(columns, count, rows, reader->left, NULL) != STATUS_OK) {
        reader->is_bad = true;
        return;
    }
    for (size_t i = 0; i < count; i++) {
        Column *column = &columns->at[i];
        take(reader, column->name, sizeof column->name);
        take(reader, column->unit, sizeof column->unit);
        column->name[sizeof column->name - 1] = column->unit[sizeof column->unit - 1] = '\0';
    }
    take(reader, columns->block, count * rows * sizeof(double));
}

static void take_impacts(Decoder *reader, size_t count, Impacts *impacts) {
    impacts->at = calloc(count > 0 ? count : 1, sizeof *impacts->at);
    if (impacts->at == NULL)
        reader->is_bad = true;
    for (; impacts->count < count && !reader->is_bad; impacts->count++) {
        double row[IMPACT];
        take(reader, row, sizeof row);
        impacts->at[impacts->count] = (Impact){.kind = (int)row[0],
                                               .start = row[1],
                                               .end = row[2],
                                               .damper = (uint64_t)row[3],
                                               .side = (int)row[4],
                                               .approach_speed = row[5],
                                               .separation_speed = row[6],
                                               .restitution = row[7],
                                               .duration = row[8],
                                               .peak_force = row[9],
                                               .impulse = row[10],
                                               .energy_lost = row[11],
                                               .is_resumed = row[12] != 0};
    }
}

static void take_response(Decoder *reader, const double head[HEAD], Response *response) {
    response->sample_rate = head[0];
    response->count = (size_t)head[1];
    response->is_unlisted = head[5] != 0;
    response->impact_count = (uint64_t)head[6];
    response->resting_count = (uint64_t)head[7];
    response->energy = (Energy){.initial = head[8],
                                .input = head[9],
                                .structural_damping = head[10],
                                .contact = head[11],
                                .kinetic = head[12],
                                .strain = head[13],
                                .residual = head[14]};
    take_impacts(reader, as_count(reader, head[4], IMPACT * sizeof(double)), &response->impacts);
    take_columns(reader, as_count(reader, head[2], sizeof(Column)), as_count(reader, head[3], 1),
                 &response->series);
}

static void take_spectrum(Decoder *reader, const double head[HEAD], Spectrum *spectrum) {
    const size_t rows = as_count(reader, head[16], sizeof(double));
    spectrum->settings = (WelchSettings){.segment = (size_t)head[17],
                                         .overlap = (size_t)head[18],
                                         .window = (int)head[19],
                                         .detrend = (int)head[20]};
    spectrum->segments = (size_t)head[21];
    if (rows > 0 && (spectrum->frequency = malloc(rows * sizeof(double))) == NULL)
        reader->is_bad = true;
    if (rows > 0 && !reader->is_bad)
        take(reader, spectrum->frequency, rows * sizeof(double));
    take_columns(reader, as_count(reader, head[15], 1), rows, &spectrum->densities);
}

Outcome *outcome_blob_read(const char *at, size_t size) {
    Decoder reader = {at, size, false};
    char name[sizeof layout];
    double head[HEAD];
    take(&reader, name, sizeof name);
    take(&reader, head, sizeof head);
    Outcome *outcome = NULL;
    if (!reader.is_bad && memcmp(name, layout, sizeof layout) == 0 &&
        (outcome = outcome_new()) != NULL) {
        take_response(&reader, head, &outcome->response);
        take_spectrum(&reader, head, &outcome->spectrum);
    }
    if (outcome != NULL && (reader.is_bad || reader.left > 0)) {
        outcome_unref(outcome);
        outcome = NULL;
    }
    return outcome;
}
