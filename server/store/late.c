// Two halves, of which one is filled while the other is written:
//
//     half:   epoch | size crc row | size crc row | ... | what earlier epochs left
//
// Emptying a half is raising its epoch, which every sum begins with: what stood there before no
// longer fits. So does a row of which not all was written, and one of a program with other columns.
#include "server/store/late.h"

#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include "server/base/clock.h"
#include "server/base/deflate.h"
#include "server/store/pack.h"

enum {
    HALF_BYTES = LATE_BYTES / 2,
    ROWS_MAX = 8192, // of a half
    BUCKETS = 4096,
    BATCH = 512, // rows of one transaction: others wait for no more than these
    DELAY_MS = 20,
    PAUSE_MS = 200, // before what failed is tried again
    LAST_TRIES = 3,
};

typedef struct Header {
    uint32_t size, sum; // of the row behind it, without the padding to eight bytes
} Header;

typedef struct Half {
    char *bytes;
    size_t used;
    uint32_t count;
    uint32_t offsets[ROWS_MAX], next[ROWS_MAX]; // of each row, and the next of its bucket + 1
    uint32_t buckets[BUCKETS];                  // + 1
} Half;

struct Late {
    void *target;
    const RowColumn *columns;
    size_t row_size;
    LateWrite *write;
    char *file; // NULL: there is no room for it, nothing is taken
    uint32_t layout;
    pthread_t thread;
    bool is_started;
    pthread_mutex_t lock;
    pthread_cond_t some, done;
    Half halves[2];
    size_t filling; // the half that is filled
    bool is_idle, is_hurried, is_stopping;
    uint64_t rounds; // halves that were written, or could not be
};

static uint64_t epoch_of(const Half *half) {
    uint64_t epoch;
    memcpy(&epoch, half->bytes, sizeof epoch);
    return epoch;
}

static uint32_t sum_of(const Late *late, const Half *half, const char *row, size_t size) {
    const uint64_t epoch = epoch_of(half);
    return deflate_crc32(deflate_crc32(late->layout, &epoch, sizeof epoch), row, size);
}

static size_t bucket_of(const char *name) {
    uint64_t hash = 14695981039346656037u; // FNV-1a
    for (const char *c = name; *c != '\0'; c++)
        hash = (hash ^ (unsigned char)*c) * 1099511628211u;
    return (size_t)(hash % BUCKETS);
}

// The first column is a name, and so the row begins with its size and its text.
static const char *name_at(const Half *half, uint32_t offset) {
    return half->bytes + offset + sizeof(Header) + sizeof(uint32_t);
}

static size_t padded(size_t size) {
    return (size + 7) & ~(size_t)7;
}

// A row stands at `used` already.
static void enter(Half *half, uint32_t size) {
    const uint32_t row = half->count++;
    const size_t bucket = bucket_of(name_at(half, (uint32_t)half->used));
    half->offsets[row] = (uint32_t)half->used;
    half->next[row] = half->buckets[bucket];
    half->buckets[bucket] = row + 1;
    half->used += sizeof(Header) + padded(size);
}

static void empty(Half *half) {
    const uint64_t epoch = epoch_of(half) + 1;
    memcpy(half->bytes, &epoch, sizeof epoch);
    half->used = sizeof epoch;
    half->count = 0;
    memset(half->buckets, 0, sizeof half->buckets);
}

// What an earlier life left.
static void recover(const Late *late, Half *half) {
    void *row = calloc(1, late->row_size);
    half->used = sizeof(uint64_t);
    while (row != NULL && half->count < ROWS_MAX && HALF_BYTES - half->used > sizeof(Header)) {
        Header header;
        memcpy(&header, half->bytes + half->used, sizeof header);
        const char *at = half->bytes + half->used + sizeof header;
        if (header.size == 0 || header.size > HALF_BYTES - half->used - sizeof header ||
            sum_of(late, half, at, header.size) != header.sum)
            break;
        memset(row, 0, late->row_size);
        if (!pack_read(late->columns, at, header.size, row))
            break;
        enter(half, header.size);
    }
    free(row);
}

static bool read_row(const Late *late, const Half *half, uint32_t number, void *row) {
    Header header;
    memcpy(&header, half->bytes + half->offsets[number], sizeof header);
    return pack_read(late->columns, half->bytes + half->offsets[number] + sizeof header,
                     header.size, row);
}

// Nobody changes this half meanwhile.
static Status write_half(const Late *late, const Half *half, Problem *problem) {
    char *rows = malloc(BATCH * late->row_size);
    const void *at[BATCH];
    Status status = rows == NULL ? STATUS_NO_MEMORY : STATUS_OK;
    for (uint32_t i = 0; i < half->count && status == STATUS_OK;) {
        size_t count = 0;
        for (; i < half->count && count < BATCH; i++) {
            char *row = rows + count * late->row_size;
            memset(row, 0, late->row_size);
            if (read_row(late, half, i, row))
                at[count++] = row;
        }
        status = late->write(late->target, at, count, problem);
    }
    free(rows);
    return status;
}

// With the lock held: for at most so long.
static void wait_ms(Late *late, int64_t ms) {
    const int64_t end = clock_monotonic_ns() + ms * 1000000;
    const struct timespec until = {(time_t)(end / 1000000000), (long)(end % 1000000000)};
    while (!late->is_hurried && !late->is_stopping &&
           pthread_cond_timedwait(&late->some, &late->lock, &until) != ETIMEDOUT)
        ;
}

static void *work(void *context) {
    Late *late = context;
    int tries = 0;
    pthread_mutex_lock(&late->lock);
    for (;;) {
        while (late->halves[late->filling].count == 0 && !late->is_stopping) {
            late->is_idle = true;
            late->is_hurried = false;
            pthread_cond_wait(&late->some, &late->lock);
        }
        late->is_idle = false;
        if (late->halves[late->filling].count == 0)
            break;
        wait_ms(late, DELAY_MS);
        Half *half = &late->halves[late->filling];
        late->filling = 1 - late->filling;
        Status status;
        do {
            pthread_mutex_unlock(&late->lock);
            status = write_half(late, half, NULL);
            pthread_mutex_lock(&late->lock);
            if (status != STATUS_OK) {
                late->rounds++;
                pthread_cond_broadcast(&late->done);
                late->is_hurried = false;
                tries += late->is_stopping;
                wait_ms(late, PAUSE_MS);
            }
        } while (status != STATUS_OK && tries < LAST_TRIES);
        if (status != STATUS_OK)
            break; // the next start finds them
        empty(half);
        late->rounds++;
        pthread_cond_broadcast(&late->done);
    }
    pthread_mutex_unlock(&late->lock);
    return NULL;
}

// The blocks are taken at once: a page that finds no room when it is written to ends the process.
static char *map_file(const char *path) {
    const size_t size = 2 * (size_t)HALF_BYTES;
    const int file = open(path, O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (file < 0)
        return NULL;
    void *at = MAP_FAILED;
    if (posix_fallocate(file, 0, (off_t)size) == 0)
        at = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    close(file);
    return at == MAP_FAILED ? NULL : at;
}

static Status replay(Late *late, Problem *problem) {
    for (size_t i = 0; i < 2; i++) {
        Half *half = &late->halves[i];
        half->bytes = late->file + i * HALF_BYTES;
        recover(late, half);
        if (half->count > 0)
            TRY(write_half(late, half, problem));
    }
    return STATUS_OK;
}

Status late_open(const char *path, void *target, const RowColumn *columns, size_t row_size,
                 LateWrite *write, Late **opened, Problem *problem) {
    Late *late = calloc(1, sizeof *late);
    *opened = NULL;
    if (late == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the jobs' late rows");
    *late = (Late){.target = target, .columns = columns, .row_size = row_size, .write = write};
    late->layout = pack_layout(columns);
    pthread_condattr_t monotonic;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_mutex_init(&late->lock, NULL);
    pthread_cond_init(&late->some, &monotonic);
    pthread_cond_init(&late->done, &monotonic);
    pthread_condattr_destroy(&monotonic);
    *opened = late;
    late->file = map_file(path);
    if (late->file == NULL)
        return STATUS_OK;
    TRY(replay(late, problem));
    for (size_t i = 0; i < 2; i++)
        empty(&late->halves[i]);
    late->is_started = pthread_create(&late->thread, NULL, work, late) == 0;
    return late->is_started ? STATUS_OK
                            : problem_set(problem, STATUS_INTERNAL,
                                          "the late writer's thread cannot be started");
}

void late_close(Late *late) {
    if (late == NULL)
        return;
    pthread_mutex_lock(&late->lock);
    late->is_stopping = true;
    pthread_cond_signal(&late->some);
    pthread_mutex_unlock(&late->lock);
    if (late->is_started)
        pthread_join(late->thread, NULL);
    if (late->file != NULL)
        munmap(late->file, 2 * (size_t)HALF_BYTES);
    pthread_cond_destroy(&late->some);
    pthread_cond_destroy(&late->done);
    pthread_mutex_destroy(&late->lock);
    free(late);
}

bool late_add(Late *late, const void *row) {
    if (!late->is_started)
        return false;
    pthread_mutex_lock(&late->lock);
    Half *half = &late->halves[late->filling];
    bool is_taken = half->count < ROWS_MAX && HALF_BYTES - half->used > sizeof(Header) + 8;
    size_t size = 0;
    if (is_taken) {
        char *at = half->bytes + half->used + sizeof(Header);
        size = pack_row(late->columns, row, at, HALF_BYTES - half->used - sizeof(Header) - 8);
        is_taken = size > 0;
        if (is_taken) {
            const Header header = {(uint32_t)size, sum_of(late, half, at, size)};
            memcpy(half->bytes + half->used, &header, sizeof header);
            enter(half, (uint32_t)size);
        }
    }
    if (late->is_idle && is_taken) {
        late->is_idle = false; // woken once is enough
        pthread_cond_signal(&late->some);
    }
    pthread_mutex_unlock(&late->lock);
    return is_taken;
}

bool late_find(Late *late, const char *name, void *row) {
    bool is_found = false;
    pthread_mutex_lock(&late->lock);
    for (size_t i = 0; i < 2 && !is_found; i++) {
        const Half *half = &late->halves[i];
        uint32_t number = half->buckets[bucket_of(name)];
        while (number > 0 && strcmp(name_at(half, half->offsets[number - 1]), name) != 0)
            number = half->next[number - 1];
        is_found =
            number > 0 && read_row(late, half, number - 1, row) && pack_own(late->columns, row);
    }
    pthread_mutex_unlock(&late->lock);
    return is_found;
}

void late_flush(Late *late) {
    pthread_mutex_lock(&late->lock);
    const uint64_t last = late->rounds + 2; // the half that is being written, and the other
    while (late->is_started && late->rounds < last &&
           late->halves[0].count + late->halves[1].count > 0) {
        late->is_hurried = true;
        pthread_cond_signal(&late->some);
        pthread_cond_wait(&late->done, &late->lock);
    }
    pthread_mutex_unlock(&late->lock);
}

// Rows are added at the end and a half is emptied by its epoch alone, once its rows are in the
// database. So what was read of a half while it was emptied and filled anew is its old rows as far
// as they go, or its new ones.
Status late_replay(char *bytes, size_t size, void *target, const RowColumn *columns,
                   size_t row_size, LateWrite *write, Problem *problem) {
    if (size < LATE_BYTES)
        return STATUS_OK;
    Late *late = calloc(1, sizeof *late);
    if (late == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the jobs' late rows");
    *late = (Late){.target = target, .columns = columns, .row_size = row_size, .write = write};
    late->layout = pack_layout(columns);
    late->file = bytes;
    const Status status = replay(late, problem);
    free(late);
    return status;
}
