// Fortran order, so that each column is copied as it lies in memory.
#include "server/encode/npy.h"

#include <stdint.h>
#include <stdio.h>
#include <string.h>

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__ && sizeof(double) == 8,
               "columns are written as they lie in memory, and the header says '<f8'");

enum { CHUNK = 4096, PREAMBLE = 10, ALIGNMENT = 64 };

static void put_header(const Table *table, Bytes *bytes) {
    char header[2 * ALIGNMENT];
    const int length = snprintf(header, sizeof header,
                                "{'descr': '<f8', 'fortran_order': True, 'shape': (%zu, %zu), }",
                                table->count, 1 + table->column_count);
    // Blanks and a line's end fill it up, so that the numbers begin at a multiple of 64 bytes.
    const size_t used = PREAMBLE + (size_t)length + 1;
    const size_t size = (used + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT - PREAMBLE;
    bytes_put(bytes, "\x93NUMPY\x01\x00", 8);
    bytes_put(bytes, (const uint8_t[]){(uint8_t)(size & 255), (uint8_t)(size >> 8)}, 2);
    bytes_put(bytes, header, (size_t)length);
    for (size_t i = (size_t)length; i + 1 < size; i++)
        bytes_put(bytes, " ", 1);
    bytes_put(bytes, "\n", 1);
}

static void put_times(const Table *table, Bytes *bytes) {
    double times[CHUNK];
    for (size_t i = 0; i < table->count; i += CHUNK) {
        const size_t count = table->count - i < CHUNK ? table->count - i : CHUNK;
        for (size_t j = 0; j < count; j++)
            times[j] = (double)(table->first + i + j) / table->axis_rate;
        bytes_put(bytes, times, count * sizeof *times);
    }
}

static void npy_write(const Table *table, Bytes *bytes) {
    put_header(table, bytes);
    // All at once: growing step by step would copy most of it again.
    if (!bytes_reserve(bytes, table->count * (1 + table->column_count) * sizeof(double)))
        return;
    if (table->axis != NULL)
        bytes_put(bytes, table->axis + table->first, table->count * sizeof(double));
    else
        put_times(table, bytes);
    for (size_t c = 0; c < table->column_count; c++)
        bytes_put(bytes, table->columns[c]->values + table->first, table->count * sizeof(double));
}

const Encoder encoder_npy = {
    .extension = "npy",
    .content_type = "application/x-npy",
    .is_binary = true,
    .write = npy_write,
};
