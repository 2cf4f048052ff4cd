// Chunks of studies in a shared folder come back as they were made, and what is torn, damaged or
// another's does not come back.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "server/jobs/chunk_file.h"
#include "server/jobs/jobs_private.h"
#include "tests/support/scratch.h"
#include "tests/support/test.h"

static const char scene[] =
    "{\"structure\": {\"kind\": \"sdof\", \"mass\": 1.35, \"stiffness\": 865}, \"dampers\": "
    "[{\"mass\": 0.1, \"clearance\": 0.01, \"buffer\": {\"restitution\": 0.6, \"contact_time\": "
    "0.02}}], \"excitation\": {\"kind\": \"random\", \"band\": [0, 15], \"rms\": 1, \"seed\": 3}, "
    "\"duration\": 2, "
    "\"sample_rate\": 100, \"output\": {\"channels\": [\"displacement\"], \"psd\": {\"channels\": "
    "[\"displacement\"], \"segment\": 64}}, \"study\": {\"kind\": \"ensemble\", \"runs\": 7, "
    "\"inputs\": [{\"pointer\": \"/dampers/0/mass\", \"distribution\": \"uniform\", \"from\": "
    "0.09, \"to\": 0.11}]}}";

static Problem problem;

// A study in a folder, begun.
typedef struct Shared {
    char folder[SCRATCH_SIZE];
    ChunkPlan plan;
    ChunkKey key;
    StudyRequest request;
    Variant *answer;
    StudyWork *work;
    SimulationLimits limits;
} Shared;

static void shared_open(Shared *shared, uint64_t chunks) {
    Warnings warnings = {NULL, 0};
    Db *db;
    *shared = (Shared){.limits = {.samples = 1 << 20,
                                  .impacts = 1 << 20,
                                  .steps = 1e9,
                                  .bytes = 1e9,
                                  .document_bytes = 1e9}};
    problem_clear(&problem);
    scratch_make(shared->folder);
    assert_int_equal(db_open(NULL, &db, &problem), STATUS_OK);
    assert_int_equal(jobs_prepare(db, scene, strlen(scene), &shared->limits, &shared->request,
                                  &warnings, &problem),
                     STATUS_OK);
    assert_int_equal(
        chunk_plan_make(&shared->plan, &shared->request, db, &shared->limits, &problem), STATUS_OK);
    shared->plan.members = 7;
    shared->plan.chunks = chunks;
    assert_int_equal(chunk_folder_make(shared->folder, &shared->plan, &shared->key, &problem),
                     STATUS_OK);
    const StudyTools tools = {.limits = &shared->limits};
    assert_int_equal(study_begin(shared->request.study, &shared->request.simulation, &tools,
                                 &shared->answer, &shared->work, &problem),
                     STATUS_OK);
    warnings_clear(&warnings);
    db_close(db);
}

static void shared_close(Shared *shared) {
    study_free(shared->work);
    variant_free(shared->answer);
    study_request_clear(&shared->request);
    chunk_plan_clear(&shared->plan);
    chunk_folder_remove(shared->folder);
    assert_int_not_equal(access(shared->folder, F_OK), 0);
}

static void part_write(const Shared *shared, size_t member, Bytes *bytes,
                       void (*write)(Bytes *bytes, const StudyPart *part)) {
    const StudyTools tools = {.limits = &shared->limits};
    StudyPart *part;
    assert_int_equal(study_part_make(shared->work, member, &tools, &part, &problem), STATUS_OK);
    write(bytes, part);
    study_part_free(shared->work, part);
}

static void chunk_make(const Shared *shared, size_t chunk) {
    Bytes bytes = {0};
    const size_t count = chunk_plan_count(&shared->plan, chunk);
    chunk_begin(&bytes, &shared->key, chunk, count);
    for (size_t i = 0; i < count; i++)
        part_write(shared, chunk_plan_member(&shared->plan, chunk, i), &bytes, chunk_add);
    assert_int_equal(chunk_save(shared->folder, chunk, &bytes, &problem), STATUS_OK);
    bytes_clear(&bytes);
}

static Status chunk_found(const Shared *shared, const ChunkKey *key, size_t chunk) {
    ChunkFile file;
    problem_clear(&problem);
    const Status status = chunk_read(shared->folder, &shared->plan, key, chunk, &file, &problem);
    bytes_clear(&file.bytes);
    return status;
}

TEST(members_are_in_one_chunk_each) {
    for (uint64_t members = 1; members < 40; members++)
        for (uint64_t wanted = 1; wanted <= members; wanted++)
            for (int strided = 0; strided < 2; strided++) {
                const uint64_t each = (members + wanted - 1) / wanted;
                const ChunkPlan plan = {.members = members,
                                        .chunks = strided ? wanted : (members + each - 1) / each,
                                        .is_strided = strided};
                unsigned char seen[40] = {0};
                size_t all = 0;
                for (size_t chunk = 0; chunk < plan.chunks; chunk++) {
                    assert_true(chunk_plan_count(&plan, chunk) > 0);
                    for (size_t i = 0; i < chunk_plan_count(&plan, chunk); i++, all++)
                        assert_int_equal(seen[chunk_plan_member(&plan, chunk, i)]++, 0);
                }
                assert_int_equal(all, members);
            }
}

TEST(a_part_comes_back_and_its_fold_is_the_same) {
    Shared shared;
    shared_open(&shared, 2);
    Bytes bytes = {0}, again = {0};
    part_write(&shared, 3, &bytes, part_blob_write);
    StudyPart *part = part_blob_read(shared.work, bytes.at, bytes.count);
    assert_non_null(part);
    assert_true(part->run.status == STATUS_OK && part->run.summary.rms_displacement > 0);
    assert_true(part->spectrum.densities.count == 1 && part->history.densities.count == 1);
    part_blob_write(&again, part);
    assert_int_equal(bytes.count, again.count);
    assert_memory_equal(bytes.at, again.at, bytes.count);
    study_part_free(shared.work, part);
    // Cut anywhere it is refused.
    for (size_t size = 0; size < bytes.count; size += 1 + size / 16)
        assert_null(part_blob_read(shared.work, bytes.at, size));
    memset(bytes.at + sizeof(uint64_t), 0xff, sizeof(uint64_t)); // its status
    assert_null(part_blob_read(shared.work, bytes.at, bytes.count));
    bytes_clear(&bytes);
    bytes_clear(&again);
    shared_close(&shared);
}

TEST(another_machine_reads_the_study_and_its_chunk_is_taken) {
    Shared shared;
    ChunkPlan plan;
    ChunkKey key;
    StudyRequest request;
    shared_open(&shared, 2);
    assert_int_equal(chunk_folder_read(shared.folder, &plan, &key, &request, &problem), STATUS_OK);
    assert_memory_equal(&key, &shared.key, sizeof key);
    assert_int_equal(plan.chunks, 2);
    assert_non_null(request.study);
    study_request_clear(&request);
    chunk_plan_clear(&plan);
    assert_int_equal(chunk_found(&shared, &key, 0), STATUS_NOT_FOUND);
    chunk_make(&shared, 0);
    chunk_make(&shared, 1);
    assert_int_equal(chunk_found(&shared, &key, 0), STATUS_OK);
    assert_int_equal(chunk_found(&shared, &key, 1), STATUS_OK);
    shared_close(&shared);
}

TEST(what_is_torn_damaged_or_anothers_is_refused) {
    Shared shared;
    char path[128], other[128];
    struct stat facts;
    shared_open(&shared, 2);
    chunk_make(&shared, 0);
    snprintf(path, sizeof path, "%s/chunks/0", shared.folder);
    snprintf(other, sizeof other, "%s/chunks/1", shared.folder);
    ChunkKey foreign = shared.key;
    foreign.digest[0] ^= 1;
    assert_int_equal(chunk_found(&shared, &foreign, 0), STATUS_INVALID);
    assert_int_equal(rename(path, other), 0);
    assert_int_equal(chunk_found(&shared, &shared.key, 1), STATUS_INVALID);
    assert_int_equal(rename(other, path), 0);
    assert_int_equal(stat(path, &facts), 0);
    for (off_t at = 0; at < facts.st_size; at += facts.st_size / 23) {
        FILE *file = fopen(path, "r+e");
        assert_non_null(file);
        assert_int_equal(fseek(file, (long)at, SEEK_SET), 0);
        const int old = fgetc(file);
        assert_int_equal(fseek(file, (long)at, SEEK_SET), 0);
        fputc(old ^ 4, file);
        fclose(file);
        assert_int_equal(chunk_found(&shared, &shared.key, 0), STATUS_INVALID);
        file = fopen(path, "r+e");
        assert_int_equal(fseek(file, (long)at, SEEK_SET), 0);
        fputc(old, file);
        fclose(file);
    }
    assert_int_equal(chunk_found(&shared, &shared.key, 0), STATUS_OK);
    assert_int_equal(truncate(path, facts.st_size - 1), 0);
    assert_int_equal(chunk_found(&shared, &shared.key, 0), STATUS_INVALID);
    assert_int_equal(truncate(path, 3), 0);
    assert_int_equal(chunk_found(&shared, &shared.key, 0), STATUS_INVALID);
    shared_close(&shared);
}

TEST(a_study_that_is_there_keeps_its_chunks_and_another_engine_is_refused) {
    Shared shared;
    ChunkPlan plan;
    ChunkKey key;
    StudyRequest request;
    shared_open(&shared, 2);
    shared.plan.chunks = 5;
    shared.plan.is_made = false; // as after a restart
    assert_int_equal(chunk_folder_make(shared.folder, &shared.plan, &key, &problem), STATUS_OK);
    assert_int_equal(shared.plan.chunks, 2);
    assert_memory_equal(&key, &shared.key, sizeof key);
    // Memory was allocated for them, so that another number is not taken any more.
    shared.plan.chunks = 5;
    assert_int_equal(chunk_folder_make(shared.folder, &shared.plan, &key, &problem), STATUS_OK);
    assert_int_equal(shared.plan.chunks, 5);
    assert_memory_not_equal(&key, &shared.key, sizeof key);
    free(shared.plan.engine);
    shared.plan.engine = strdup("impactd-0");
    assert_int_equal(chunk_folder_make(shared.folder, &shared.plan, &key, &problem), STATUS_OK);
    assert_int_equal(chunk_folder_read(shared.folder, &plan, &key, &request, &problem),
                     STATUS_INVALID);
    assert_non_null(strstr(problem.detail, "impactd-0"));
    study_request_clear(&request);
    chunk_plan_clear(&plan);
    shared_close(&shared);
}
