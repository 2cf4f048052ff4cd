// An entry is a body, the text of its answer and the places in it that differ from job to job: its
// id twice, its times, the time it took. All of them are of one width.
//
// A body is found by its CRC-32 and its size and then compared whole: no body gets another's
// answer, and that is several times quicker than a digest. Of two with the same key the later
// stays.
#include "server/jobs/known.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "server/base/clock.h"
#include "server/base/deflate.h"
#include "server/jobs/index.h"
#include "server/jobs/job_id.h"

// A larger body is read: comparing it would hold up whoever asks.
enum { BODY_MAX = 65536, KEY_SIZE = 17 };

typedef struct Entry {
    IndexEntry indexed; // by key
    struct Entry *newer, *older;
    atomic_size_t holds; // the table's and of those who copy it just now
    char key[KEY_SIZE];
    uint64_t mark;
    JobRow row; // as it is stored, but for id and times
    char *text;
    size_t size, bytes;
    JobSlots slots;
    size_t body_size;
    char body[];
} Entry;

struct Known {
    pthread_mutex_t lock;
    Index *index;
    Entry *newest, *oldest;
    size_t most_bytes;
    LayerTally tally;
};

Known *known_new(size_t most_bytes) {
    Known *known = calloc(1, sizeof *known);
    if (known == NULL)
        return NULL;
    known->most_bytes = most_bytes;
    known->index = index_new();
    if (known->index == NULL) {
        free(known);
        return NULL;
    }
    pthread_mutex_init(&known->lock, NULL);
    return known;
}

static void entry_drop(Entry *entry) {
    if (entry == NULL || atomic_fetch_sub(&entry->holds, 1) != 1)
        return;
    job_row_clear(&entry->row);
    free(entry->text);
    free(entry);
}

static void unlink_entry(Known *known, Entry *entry) {
    *(entry->newer != NULL ? &entry->newer->older : &known->newest) = entry->older;
    *(entry->older != NULL ? &entry->older->newer : &known->oldest) = entry->newer;
}

static void link_newest(Known *known, Entry *entry) {
    entry->newer = NULL;
    entry->older = known->newest;
    *(known->newest != NULL ? &known->newest->newer : &known->oldest) = entry;
    known->newest = entry;
}

static void evict(Known *known, Entry *entry) {
    unlink_entry(known, entry);
    index_remove(known->index, &entry->indexed);
    known->tally.bytes -= entry->bytes;
    known->tally.count--;
    entry_drop(entry);
}

void known_free(Known *known) {
    if (known == NULL)
        return;
    while (known->oldest != NULL)
        evict(known, known->oldest);
    pthread_mutex_destroy(&known->lock);
    index_free(known->index);
    free(known);
}

static bool make_key(const Submission *submission, char key[KEY_SIZE]) {
    if (submission->size > BODY_MAX)
        return false;
    uint64_t number = (uint64_t)deflate_crc32(0, submission->text, submission->size) << 32 |
                      (uint32_t)submission->size;
    key[KEY_SIZE - 1] = '\0';
    for (size_t i = KEY_SIZE - 1; i > 0; i--, number >>= 4)
        key[i - 1] = "0123456789abcdef"[number & 15];
    return true;
}

static size_t text_bytes(const char *text) {
    return text != NULL ? strlen(text) + 1 : 0;
}

static Entry *entry_new(const char *key, const Submission *submission, const JobRow *row,
                        const char *text, size_t size) {
    Entry *entry = calloc(1, sizeof *entry + submission->size);
    if (entry == NULL)
        return NULL;
    entry->body_size = submission->size;
    memcpy(entry->body, submission->text, submission->size);
    atomic_init(&entry->holds, 1);
    memcpy(entry->key, key, sizeof entry->key);
    entry->indexed.key = entry->key;
    entry->text = malloc(size);
    if (entry->text == NULL || !job_row_copy(row, &entry->row)) {
        entry_drop(entry);
        return NULL;
    }
    memcpy(entry->text, text, size);
    entry->size = size;
    entry->bytes = sizeof *entry + entry->body_size + size + text_bytes(entry->row.title) +
                   text_bytes(entry->row.warnings) + text_bytes(entry->row.scene) +
                   text_bytes(entry->row.labels) + text_bytes(entry->row.words);
    return entry;
}

void known_put(Known *known, const Submission *submission, uint64_t mark, const JobRow *row,
               const char *text, size_t size, const JobSlots *slots) {
    char key[KEY_SIZE];
    if (!make_key(submission, key))
        return;
    Entry *entry = entry_new(key, submission, row, text, size);
    if (entry == NULL)
        return;
    entry->mark = mark;
    entry->slots = *slots;
    pthread_mutex_lock(&known->lock);
    Entry *other = index_find(known->index, key);
    if (other != NULL)
        evict(known, other);
    if (entry->bytes <= known->most_bytes) {
        index_add(known->index, &entry->indexed);
        link_newest(known, entry);
        known->tally.bytes += entry->bytes;
        known->tally.count++;
        entry = NULL;
    }
    while (known->tally.bytes > known->most_bytes) {
        evict(known, known->oldest);
        known->tally.evictions++;
    }
    pthread_mutex_unlock(&known->lock);
    entry_drop(entry);
}

static Entry *find(Known *known, const char *key, const Submission *submission, uint64_t mark) {
    pthread_mutex_lock(&known->lock);
    Entry *entry = index_find(known->index, key);
    if (entry != NULL && entry->mark != mark) {
        evict(known, entry);
        entry = NULL;
    }
    if (entry != NULL && (entry->body_size != submission->size ||
                          memcmp(entry->body, submission->text, submission->size) != 0))
        entry = NULL;
    if (entry != NULL) {
        unlink_entry(known, entry);
        link_newest(known, entry);
        atomic_fetch_add(&entry->holds, 1);
        known->tally.hits++;
    } else {
        known->tally.misses++;
    }
    pthread_mutex_unlock(&known->lock);
    return entry;
}

bool known_answer(Known *known, Store *store, const Submission *submission, uint64_t mark,
                  KnownAnswer *answer) {
    const int64_t began_ns = clock_monotonic_ns();
    char key[KEY_SIZE];
    if (!make_key(submission, key))
        return false;
    Entry *entry = find(known, key, submission, mark);
    char *text = entry != NULL ? malloc(entry->size + 1) : NULL;
    bool is_answered = false;
    if (text != NULL) {
        const JobSlots *slots = &entry->slots;
        JobRow row = entry->row;
        row.client = (char *)submission->client; // borrowed
        char time[32], took[JOB_SLOT_TOTAL];
        memcpy(text, entry->text, entry->size);
        text[entry->size] = '\0';
        row.created_unix_ms = row.started_unix_ms = row.finished_unix_ms = clock_unix_ms();
        clock_rfc3339(row.created_unix_ms, time);
        // In whole microseconds, so that it is as wide as the place for it.
        int64_t took_us = (clock_monotonic_ns() - began_ns) / 1000;
        took_us = took_us < 999999 ? took_us : 999999;
        memcpy(took, "0.000000", JOB_SLOT_TOTAL);
        for (int64_t i = JOB_SLOT_TOTAL - 1, left = took_us; left > 0; i--, left /= 10)
            took[i] = (char)('0' + left % 10);
        row.total = (double)took_us / 1e6; // to the bit what its text reads back to
        if (job_id_make(row.id)) {
            memcpy(text + slots->id, row.id, JOB_ID_LENGTH);
            memcpy(text + slots->self, row.id, JOB_ID_LENGTH);
            memcpy(text + slots->created, time, JOB_SLOT_TIME);
            memcpy(text + slots->started, time, JOB_SLOT_TIME);
            memcpy(text + slots->finished, time, JOB_SLOT_TIME);
            memcpy(text + slots->total, took, JOB_SLOT_TOTAL);
            is_answered = store_job_late(store, &row);
        }
        if (is_answered) {
            *answer = (KnownAnswer){.body = text, .size = entry->size};
            text_fit(answer->job, sizeof answer->job, row.id);
        }
    }
    if (!is_answered)
        free(text);
    entry_drop(entry);
    return is_answered;
}

void known_forget(Known *known, const char *result) {
    pthread_mutex_lock(&known->lock);
    for (Entry *entry = known->oldest; entry != NULL;) {
        Entry *newer = entry->newer;
        if (strcmp(entry->row.result, result) == 0)
            evict(known, entry);
        entry = newer;
    }
    pthread_mutex_unlock(&known->lock);
}

void known_tally(Known *known, LayerTally *tally) {
    pthread_mutex_lock(&known->lock);
    *tally = known->tally;
    pthread_mutex_unlock(&known->lock);
    tally->most_bytes = known->most_bytes;
}
