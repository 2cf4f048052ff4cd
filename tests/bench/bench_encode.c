// What it costs to write a series: 60 s at 1 kHz, five channels and the time. NPY, NPZ and MAT
// beside memcpy of the same bytes, JSON beside jansson's dump of the same document. All in one run,
// median of the repeats, each format into memory that is there already. And the extremes of a
// million samples.
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/formats/format.h"
#include "server/util/clock.h"

enum { ROWS = 60001, CHANNELS = 5, REPEATS = 41, SAMPLES = 1000000 };
enum { MEMCPY, JANSSON, NPY, NPZ, MAT, JSON, CSV, WAYS };

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
    const int64_t start = clock_thread_cpu_ns();
    memcpy(target, source, (1 + CHANNELS) * ROWS * sizeof *source);
    __asm__ volatile("" ::"r"(target) : "memory");
    return 1e-3 * (double)(clock_thread_cpu_ns() - start);
}

static double time_encoder(const TableFormat *encoder, const Table *table, Bytes *bytes) {
    bytes->count = 0;
    const int64_t start = clock_thread_cpu_ns();
    const Status status = format_write(encoder, table, bytes, NULL);
    const double time = 1e-3 * (double)(clock_thread_cpu_ns() - start);
    return status == STATUS_OK && !bytes->is_failed ? time : (double)NAN;
}

static int drop_bytes(const char *buffer, size_t size, void *data) {
    memcpy(data, buffer, size < 8 ? size : 8);
    return 0;
}

static double time_jansson(const json_t *document) {
    char sink[8];
    const int64_t start = clock_thread_cpu_ns();
    (void)json_dump_callback(document, drop_bytes, sink, JSON_COMPACT);
    return 1e-3 * (double)(clock_thread_cpu_ns() - start);
}

static double time_buckets(const Column *column, size_t bucket) {
    double times[REPEATS];
    for (size_t r = 0; r < REPEATS; r++) {
        Columns buckets;
        const int64_t start = clock_thread_cpu_ns();
        if (downsample(&column, 1, 0, SAMPLES, bucket, &buckets, NULL) != STATUS_OK)
            return (double)NAN;
        times[r] = 1e-3 * (double)(clock_thread_cpu_ns() - start);
        columns_clear(&buckets);
    }
    return median(times, REPEATS);
}

int main(void) {
    static const char *const names[WAYS] = {"memcpy", "jansson", "npy", "npz",
                                            "mat",    "json",    "csv"};
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
    // In turn, so that what else the machine does falls on all of them.
    static double times[WAYS][REPEATS], ratios[WAYS][REPEATS];
    Bytes bytes[WAYS] = {{.most = 0}};
    json_t *document = NULL;
    for (size_t r = 0; r < REPEATS; r++) {
        times[MEMCPY][r] = time_memcpy(values, target);
        for (size_t i = NPY; i < WAYS; i++)
            times[i][r] = time_encoder(format_find(names[i]), &series.table, &bytes[i]);
        if (document == NULL)
            document = json_loadb(bytes[JSON].at, bytes[JSON].count, 0, NULL);
        times[JANSSON][r] = document != NULL ? time_jansson(document) : (double)NAN;
        for (size_t i = 0; i < WAYS; i++)
            ratios[i][r] =
                i == JSON ? times[JANSSON][r] / times[i][r] : times[i][r] / times[MEMCPY][r];
    }
    printf("format,bytes,microseconds,ratio,to\n");
    for (size_t i = 0; i < WAYS; i++)
        printf("%s,%zu,%.1f,%.2f,%s\n", names[i], bytes[i].count, median(times[i], REPEATS),
               median(ratios[i], REPEATS), i == JSON ? "jansson to it" : "memcpy");
    json_decref(document);
    for (size_t i = 0; i < WAYS; i++)
        bytes_clear(&bytes[i]);
    const Column column = {"x", "m", many};
    for (size_t bucket = 1; bucket <= 1000; bucket *= 10)
        printf("# extremes of %d samples in buckets of %zu: %.0f us\n", SAMPLES, bucket,
               time_buckets(&column, bucket));
    free(values);
    free(target);
    free(many);
    return 0;
}
