// Every example gives the same bytes at every vector width that the processor has.
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/canonical.h"
#include "server/jobs/jobs.h"
#include "tests/support/test.h"
#include "tests/support/vectors.h"

enum { EXAMPLES_MAX = 200, EVERY = IMPACTD_SANITIZED ? 4 : 1 }; // of the examples

// FNV-1a
static void digest_add(void *context, const void *bytes, size_t size) {
    uint64_t *digest = context;
    for (size_t i = 0; i < size; i++)
        *digest = (*digest ^ ((const unsigned char *)bytes)[i]) * 0x100000001b3;
}

static void digest_columns(uint64_t *digest, const Columns *columns) {
    for (size_t i = 0; i < columns->count; i++)
        digest_add(digest, columns->at[i].values, columns->rows * sizeof(double));
}

// Of all numbers of the outcome of an example.
static uint64_t outcome_digest(const char *path) {
    static char text[1 << 20];
    Problem problem;
    Db *db;
    StudyRequest request = {0};
    Warnings warnings = {NULL, 0};
    Outcome *outcome;
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    const size_t size = fread(text, 1, sizeof text - 1, file);
    fclose(file);
    text[size] = 0;
    problem_clear(&problem);
    assert_int_equal(db_open(NULL, &db, &problem), STATUS_OK);
    assert_int_equal(jobs_prepare(db, text, size, NULL, &request, &warnings, &problem), STATUS_OK);
    assert_int_equal(simulation_run(&request.simulation, NULL, NULL, NULL, &outcome, &problem),
                     STATUS_OK);
    uint64_t digest = 0xcbf29ce484222325;
    const Response *response = &outcome->response;
    digest_columns(&digest, &response->series);
    digest_columns(&digest, &outcome->spectrum.densities);
    canonical_write(summary_fields, &outcome->summary, digest_add, &digest);
    canonical_write(energy_fields, &response->energy, digest_add, &digest);
    for (size_t i = 0; i < response->impacts.count; i++)
        canonical_write(impact_fields, &response->impacts.at[i], digest_add, &digest);
    outcome_unref(outcome);
    study_request_clear(&request);
    warnings_clear(&warnings);
    db_close(db);
    return digest;
}

static size_t digest_examples(uint64_t digests[EXAMPLES_MAX], char names[EXAMPLES_MAX][64]) {
    DIR *folder = opendir(IMPACTD_SOURCE_DIR "/schema/examples");
    assert_non_null(folder);
    size_t count = 0, seen = 0;
    for (struct dirent *entry; (entry = readdir(folder)) != NULL && count < EXAMPLES_MAX;) {
        char path[512];
        if (strstr(entry->d_name, ".json") == NULL || seen++ % EVERY != 0)
            continue;
        snprintf(path, sizeof path, "%s/schema/examples/%s", IMPACTD_SOURCE_DIR, entry->d_name);
        snprintf(names[count], sizeof names[count], "%.60s", entry->d_name);
        digests[count++] = outcome_digest(path);
    }
    closedir(folder);
    return count;
}

TEST(examples_have_the_same_bytes_at_every_vector_width) {
    static uint64_t digests[VECTORS_COUNT][EXAMPLES_MAX];
    static char names[VECTORS_COUNT][EXAMPLES_MAX][64];
    Vectors first = VECTORS_COUNT;
    for (Vectors vectors = 0; vectors < VECTORS_COUNT; vectors++) {
        if (!vectors_set(vectors))
            continue;
        if (first == VECTORS_COUNT)
            first = vectors;
        const size_t count = digest_examples(digests[vectors], names[vectors]);
        assert_true(count > 20 / EVERY);
        for (size_t i = 0; i < count; i++) {
            assert_string_equal(names[vectors][i], names[first][i]);
            if (digests[vectors][i] != digests[first][i])
                fail_msg("%s: other bytes with %s than with %s", names[first][i],
                         vectors_names[vectors], vectors_names[first]);
        }
    }
}
