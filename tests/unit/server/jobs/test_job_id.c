// Names of jobs are all different, rise, and tell nothing of the next one.
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "server/jobs/job_id.h"
#include "tests/support/test.h"

enum { THREADS = 4, IDS = 5000, SECRET = 16 }; // where the random digits begin

static char ids[THREADS * IDS][40];

static void *make(void *context) {
    char(*mine)[40] = context;
    for (size_t i = 0; i < IDS; i++)
        if (!job_id_make(mine[i]))
            return NULL;
    return context;
}

static int compare_whole(const void *a, const void *b) {
    return strcmp(a, b);
}

static int compare_secrets(const void *a, const void *b) {
    return strcmp((const char *)a + SECRET, (const char *)b + SECRET);
}

TEST(names_rise_and_no_two_share_their_secret) {
    pthread_t threads[THREADS];
    for (size_t i = 0; i < THREADS; i++)
        assert_int_equal(pthread_create(&threads[i], NULL, make, ids[i * IDS]), 0);
    for (size_t i = 0; i < THREADS; i++) {
        void *done;
        pthread_join(threads[i], &done);
        assert_non_null(done);
    }
    for (size_t i = 0; i < (size_t)THREADS * IDS; i++) {
        assert_int_equal(strlen(ids[i]), JOB_ID_LENGTH);
        assert_memory_equal(ids[i], "j-", 2);
        assert_int_equal(strspn(ids[i] + 2, "0123456789abcdef"), JOB_ID_LENGTH - 2);
        if (i % IDS > 0)
            assert_true(strncmp(ids[i - 1], ids[i], SECRET) < 0);
    }
    qsort(ids, (size_t)THREADS * IDS, sizeof ids[0], compare_whole);
    for (size_t i = 1; i < (size_t)THREADS * IDS; i++)
        assert_true(strncmp(ids[i - 1], ids[i], SECRET) < 0);
    qsort(ids, (size_t)THREADS * IDS, sizeof ids[0], compare_secrets);
    for (size_t i = 1; i < (size_t)THREADS * IDS; i++)
        assert_string_not_equal(ids[i - 1] + SECRET, ids[i] + SECRET);
}
