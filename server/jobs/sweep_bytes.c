// A chunk's bytes: for each row a byte of status and then its metrics, little-endian, so that a
// table is the same on every machine.
#include <stdlib.h>
#include <string.h>

#include "server/jobs/sweep.h"

size_t sweep_rows_of(const SweepRow *row, size_t chunk) {
    return chunk >= row->points ? 0 : (row->points - chunk + row->chunks - 1) / row->chunks;
}

size_t sweep_row_size(const SweepRow *row) {
    return 1 + sizeof(double) * row->metrics;
}

static const unsigned char *row_at(const SweepRow *row, const SweepChunkRow *chunk, size_t place) {
    const size_t size = sweep_row_size(row);
    return chunk->rows.at != NULL && (place + 1) * size <= chunk->rows.size
               ? (const unsigned char *)chunk->rows.at + place * size
               : NULL;
}

// A byte that no status has stands for one that failed.
static SweepStatus status_of(const unsigned char *row) {
    return *row < SWEEP_PENDING ? (SweepStatus)*row : SWEEP_FAILED;
}

static double metric_of(const unsigned char *row, size_t metric) {
    uint64_t bits = 0;
    double value;
    for (size_t k = 0; k < sizeof bits; k++)
        bits |= (uint64_t)row[1 + 8 * metric + k] << (8 * k);
    memcpy(&value, &bits, sizeof value);
    return value;
}

double sweep_row_cell(const unsigned char *row, size_t cell) {
    return cell == 0 ? (double)status_of(row) : metric_of(row, cell - 1);
}

SweepStatus sweep_row_status(const SweepRow *row, const SweepChunkRow *chunk, size_t place) {
    const unsigned char *at = row_at(row, chunk, place);
    return at == NULL ? SWEEP_PENDING : status_of(at);
}

void sweep_row_values(const SweepRow *row, const SweepChunkRow *chunk, size_t place,
                      double *values) {
    const unsigned char *at = row_at(row, chunk, place);
    for (size_t i = 0; i < row->metrics; i++)
        values[i] = at != NULL ? metric_of(at, i) : (double)NAN;
}

void sweep_row_put(const SweepRow *row, SweepChunkRow *chunk, size_t place, SweepStatus status,
                   const double *values) {
    unsigned char *at = (unsigned char *)chunk->rows.at + place * sweep_row_size(row);
    *at++ = (unsigned char)status;
    for (size_t i = 0; i < row->metrics; i++) {
        uint64_t bits;
        // One bit pattern for all that is unknown.
        const double value = isnan(values[i]) ? (double)NAN : values[i];
        memcpy(&bits, &value, sizeof bits);
        for (size_t k = 0; k < sizeof bits; k++)
            *at++ = (unsigned char)(bits >> (8 * k));
    }
}

void sweep_row_reason(const SweepChunkRow *chunk, size_t place, char *why, size_t size) {
    why[0] = '\0';
    for (const char *line = chunk->reasons; line != NULL && *line != '\0';) {
        char *text;
        const size_t number = strtoul(line, &text, 10);
        const size_t length = strcspn(text, "\n");
        if (number == place && *text == ' ') {
            const size_t kept = length - 1 < size ? length - 1 : size - 1;
            memcpy(why, text + 1, kept);
            why[kept] = '\0';
            return;
        }
        line = text + length + (text[length] == '\n');
    }
}
