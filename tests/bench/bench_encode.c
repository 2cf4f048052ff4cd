// What it costs to write a series: 60 s at 1 kHz, five channels and the time. NPY, NPZ and MAT
// beside memcpy of the same bytes, JSON beside jansson's dump of the same document. All in one run,
// median of the repeats, each format into memory that is there already. And the extremes of a
// million samples.
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/base/clock.h"
#include "server/encode/buckets.h"
#include "server/encode/encoding.h"

enum { ROWS = 60001, CHANNELS = 5, REPEATS = 41, SAMPLES = 1000000 };

typedef struct Series {
    Column at[CHANNELS];
    const Column *chosen[CHANNELS];
    Table table;
} Series;

static int by_size(const void *a, const void *b) {
    const double first = *(const double *)a, second = *(const double *)b;
    return (first > second) - (first < second);
}

static double median(double *times, size_t count) {
    qsort(times, count, sizeof *times, by_size);
    return times[count / 2];
}

// Numbers with all their digits, as a run has them.
static void make(Series *series, double *values) {
    static const char *const names[CHANNELS] = {"displacement", "velocity", "acceleration",
                                                "damper_displacement", "contact_force"};
    for (size_t c = 0; c < CHANNELS; c++) {
        Column *column = &series->at[c];
        snprintf(column->name, sizeof column->name, "%s", names[c]);
        snprintf(column->unit, sizeof column->unit, "m");
        column->values = values + c * ROWS;
        for (size_t i = 0; i < ROWS; i++)
            column->values[i] =
                sin(0.025 * (double)i + (double)c) * exp(-1e-5 * (double)i) / (1 + (double)c);
        series->chosen[c] = column;
    }
    series->table = (Table){.axis_name = "time",
                            .axis_unit = "s",
                            .axis_rate = 1000,
                            .count = ROWS,
                            .columns = series->chosen,
                            .column_count = CHANNELS};
}

static double time_memcpy(const double *source, double *target) {
    double times[REPEATS];
    for (size_t r = 0; r < REPEATS; r++) {
        const int64_t start = clock_monotonic_ns();
        memcpy(target, source, (1 + CHANNELS) * ROWS * sizeof *source);
        __asm__ volatile("" ::"r"(target) : "memory");
        times[r] = 1e-3 * (double)(clock_monotonic_ns() - start);
    }
    return median(times, REPEATS);
}

static double time_encoder(const char *extension, const Table *table, Bytes *bytes) {
    const Encoder *encoder = encoder_find(extension);
    double times[REPEATS];
    for (size_t r = 0; r < REPEATS; r++) {
        bytes->count = 0;
        const int64_t start = clock_monotonic_ns();
        if (encoding_write(encoder, table, bytes, NULL) != STATUS_OK || bytes->is_failed)
            return (double)NAN;
        times[r] = 1e-3 * (double)(clock_monotonic_ns() - start);
    }
    return median(times, REPEATS);
}

static int count_bytes(const char *buffer, size_t size, void *data) {
    memcpy(data, buffer, size < 8 ? size : 8);
    return 0;
}

static double time_jansson(const Bytes *text) {
    enum { FEW = 7 };
    double times[FEW];
    char sink[8];
    json_t *document = json_loadb(text->at, text->count, 0, NULL);
    if (document == NULL)
        return (double)NAN;
    for (size_t r = 0; r < FEW; r++) {
        const int64_t start = clock_monotonic_ns();
        (void)json_dump_callback(document, count_bytes, sink, JSON_COMPACT);
        times[r] = 1e-3 * (double)(clock_monotonic_ns() - start);
    }
    json_decref(document);
    return median(times, FEW);
}

static double time_buckets(const Column *column, size_t bucket) {
    double times[REPEATS];
    for (size_t r = 0; r < REPEATS; r++) {
        Columns buckets;
        const int64_t start = clock_monotonic_ns();
        if (buckets_make(&column, 1, 0, SAMPLES, bucket, &buckets, NULL) != STATUS_OK)
            return (double)NAN;
        times[r] = 1e-3 * (double)(clock_monotonic_ns() - start);
        columns_clear(&buckets);
    }
    return median(times, REPEATS);
}

int main(void) {
    static const char *const names[] = {"npy", "npz", "mat", "json", "csv"};
    double *values = malloc((1 + CHANNELS) * ROWS * sizeof *values);
    double *target = calloc((1 + CHANNELS) * ROWS, sizeof *target);
    double *many = malloc(SAMPLES * sizeof *many);
    if (values == NULL || target == NULL || many == NULL)
        return 1;
    Series series;
    make(&series, values);
    for (size_t i = 0; i < ROWS; i++)
        values[CHANNELS * ROWS + i] = 0;
    for (size_t i = 0; i < SAMPLES; i++)
        many[i] = sin(0.01 * (double)i);
    const double copied = time_memcpy(values, target);
    printf("format,bytes,microseconds,to_memcpy\nmemcpy,%zu,%.1f,1\n",
           (size_t)(1 + CHANNELS) * ROWS * sizeof *values, copied);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        Bytes bytes = {.most = 0};
        const double time = time_encoder(names[i], &series.table, &bytes);
        printf("%s,%zu,%.1f,%.2f\n", names[i], bytes.count, time, time / copied);
        if (strcmp(names[i], "json") == 0) {
            const double other = time_jansson(&bytes);
            printf("jansson,,%.1f,%.2f\n", other, other / copied);
            printf("# jansson to json: %.1f\n", other / time);
        }
        bytes_clear(&bytes);
    }
    const Column column = {"x", "m", many};
    for (size_t bucket = 1; bucket <= 1000; bucket *= 10)
        printf("# extremes of %d samples in buckets of %zu: %.0f us\n", SAMPLES, bucket,
               time_buckets(&column, bucket));
    free(values);
    free(target);
    free(many);
    return 0;
}
