#define _GNU_SOURCE // nftw, strsep
#include "server/jobs/chunk_file.h"

#include <errno.h>
#include <fcntl.h>
#include <ftw.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/excitation/recorded_motion.h"
#include "core/study/axis.h"
#include "server/db/records.h"
#include "server/jobs/documents.h"
#include "server/jobs/jobs_private.h"
#include "server/jobs/sweep.h"
#include "server/json/encode.h"
#include "server/json/parse.h"

enum { SCENE_BYTES = 64 << 20, FILE_BYTES = 1 << 30, RECORDS = 4096 };

static const char chunk_magic[8] = {'i', 'm', 'p', 'a', 'c', 't', 'c', '1'};

typedef struct ChunkHead {
    char magic[sizeof chunk_magic];
    ChunkKey key;
    uint64_t chunk, count;
} ChunkHead;

// clang-format off
static const Field record_fields[] = {
    FIELD_TEXT(ChunkRecord, name, RECORD_NAME_SIZE - 1, PRESENCE_REQUIRED, 0, "as the scene names it"),
    FIELD_REAL(ChunkRecord, interval, "s", ABOVE(0), REQUIRED, "between samples"),
    FIELD_REALS(ChunkRecord, samples, "m/s^2", ANY, RECORD_SAMPLES, PRESENCE_REQUIRED, "of the ground"),
    FIELD_END,
};

static const Field plan_fields[] = {
    FIELD_TEXT(ChunkPlan, engine, 64, PRESENCE_REQUIRED, 0, "version of the engine"),
    FIELD_COUNT(ChunkPlan, members, NULL, WITHIN(1, 1e9), REQUIRED, "of the study"),
    FIELD_COUNT(ChunkPlan, chunks, NULL, WITHIN(1, 1e6), REQUIRED, "that they are made in"),
    FIELD_FLAG(ChunkPlan, is_strided, false, "chunk i has the members i, i + chunks ..."),
    FIELD_COUNT(ChunkPlan, limits.samples, NULL, AT_MIN(0), REQUIRED, "limit of each run, as the next"),
    FIELD_COUNT(ChunkPlan, limits.impacts, NULL, AT_MIN(0), REQUIRED, "listed"),
    FIELD_COUNT(ChunkPlan, limits.points, NULL, AT_MIN(0), REQUIRED, "of a sweep"),
    FIELD_REAL(ChunkPlan, limits.steps, NULL, AT_MIN(0), REQUIRED, "predicted"),
    FIELD_REAL(ChunkPlan, limits.bytes, "B", AT_MIN(0), REQUIRED, "of memory"),
    FIELD_REAL(ChunkPlan, limits.document_bytes, "B", AT_MIN(0), REQUIRED, "of spectra"),
    FIELD_TEXT(ChunkPlan, scene, SCENE_BYTES, PRESENCE_REQUIRED, 0, "canonical JSON"),
    FIELD_LIST(ChunkPlan, records, record_fields, RECORDS, PRESENCE_OPTIONAL, "that the scene names"),
    FIELD_END,
};
// clang-format on

void chunk_plan_clear(ChunkPlan *plan) {
    fields_clear(plan_fields, plan);
}

static Status plan_add_record(ChunkPlan *plan, const char *name, Db *db, Problem *problem) {
    NamedRecord *named;
    TRY(db_record_named(db, name, &named, problem));
    ChunkRecord *record = list_append(&plan->records, sizeof *record);
    if (record != NULL)
        *record = (ChunkRecord){.name = strdup(name), .interval = named->interval};
    const bool is_made = record != NULL && record->name != NULL &&
                         reals_allocate(&record->samples, named->samples.count);
    if (is_made)
        memcpy(record->samples.at, named->samples.at, named->samples.count * sizeof(double));
    refcount_unref(&named->shared);
    return study_result(status_made(is_made), problem);
}

Status chunk_plan_make(ChunkPlan *plan, const StudyRequest *request, Db *db,
                       const SimulationLimits *limits, Problem *problem) {
    Bytes scene = {0}, names = {0};
    *plan = (ChunkPlan){.limits = *limits};
    document_scene(&scene, request);
    references_write(&names, request, false);
    plan->engine = strdup(engine_version);
    const bool is_made = plan->engine != NULL && !names.is_failed;
    plan->scene = bytes_take(&scene, NULL);
    Status status = study_result(status_made(is_made && plan->scene != NULL), problem);
    char *rest = names.at, *line;
    while (status == STATUS_OK && (line = strsep(&rest, "\n")) != NULL && *line != '\0')
        status = plan_add_record(plan, strchr(line, ':') + 1, db, problem); // "record:elcentro"
    bytes_clear(&names);
    return status;
}

static size_t chunk_plan_each(const ChunkPlan *plan) {
    return (size_t)((plan->members + plan->chunks - 1) / plan->chunks);
}

size_t chunk_plan_count(const ChunkPlan *plan, size_t chunk) {
    const size_t each = chunk_plan_each(plan);
    if (plan->is_strided)
        return sweep_rows_of(&(SweepRow){.points = plan->members, .chunks = plan->chunks}, chunk);
    const size_t first = chunk * each, left = first < plan->members ? plan->members - first : 0;
    return left < each ? left : each;
}

size_t chunk_plan_member(const ChunkPlan *plan, size_t chunk, size_t place) {
    return plan->is_strided ? chunk + place * plan->chunks : chunk * chunk_plan_each(plan) + place;
}

// --- files ---

static Status file_fault(Problem *problem, const char *path, const char *what) {
    const int error = errno;
    return problem_set(problem, error == ENOSPC || error == EDQUOT ? STATUS_FULL : STATUS_IO,
                       "%s: %.300s cannot be %s", strerror(error), path, what);
}

Status chunk_folder_put(const char *folder, const char *name, const void *data, size_t size,
                        Problem *problem) {
    char path[PATH_MAX], fresh[PATH_MAX], host[64] = "";
    (void)gethostname(host, sizeof host - 1);
    snprintf(path, sizeof path, "%.3000s/%.80s", folder, name);
    snprintf(fresh, sizeof fresh, "%.3800s.%s.%ld.part", path, host, (long)getpid());
    FILE *file = fopen(fresh, "we");
    if (file == NULL)
        return file_fault(problem, fresh, "made");
    const bool is_written =
        fwrite(data, 1, size, file) == size && fflush(file) == 0 && fsync(fileno(file)) == 0;
    const int error = errno;
    const bool is_closed = fclose(file) == 0;
    errno = is_written ? errno : error;
    if (is_written && is_closed && rename(fresh, path) == 0) {
        *strrchr(path, '/') = '\0';
        return data_dir_sync(path, problem);
    }
    const Status status = file_fault(problem, path, "written");
    (void)unlink(fresh);
    return status;
}

static Status file_get(const char *path, Bytes *bytes, Problem *problem) {
    char block[1 << 16];
    ssize_t count;
    *bytes = (Bytes){.most = FILE_BYTES};
    const int file = open(path, O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    if (file < 0)
        return errno == ENOENT ? problem_set(problem, STATUS_NOT_FOUND, "there is no %.300s", path)
                               : file_fault(problem, path, "opened");
    while ((count = read(file, block, sizeof block)) > 0)
        bytes_put(bytes, block, (size_t)count);
    const Status status = count == 0 ? STATUS_OK : file_fault(problem, path, "read");
    (void)close(file);
    if (status != STATUS_OK || !bytes->is_failed)
        return status;
    return bytes->is_over ? problem_set(problem, STATUS_INVALID, "%.300s is too large", path)
                          : problem_set(problem, STATUS_NO_MEMORY, "no memory for %.300s", path);
}

static int path_remove(const char *path, const struct stat *facts, int kind, struct FTW *place) {
    (void)facts, (void)kind, (void)place;
    (void)remove(path);
    return 0;
}

void chunk_folder_remove(const char *folder) {
    (void)nftw(folder, path_remove, 8, FTW_DEPTH | FTW_PHYS);
}

// --- the study ---

static Status record_load(const ChunkRecord *record, Db *db, Problem *problem) {
    char layout[] = "json";
    RecordRow row = {.name = record->name, .layout = layout, .interval = record->interval};
    bool is_there;
    Status status = record_row_measure(&row, &record->samples, 0);
    if (status == STATUS_OK)
        status = db_record_add(db, &row, &record->samples, &is_there, problem);
    row.name = row.layout = NULL;
    record_row_clear(&row);
    return study_result(status, problem);
}

// The file `study`. The plan is cleared by the caller in any case.
static Status plan_read(const char *folder, ChunkPlan *plan, ChunkKey *key, Problem *problem) {
    char path[PATH_MAX];
    Bytes text;
    *plan = (ChunkPlan){.engine = NULL};
    snprintf(path, sizeof path, "%.3000s/study", folder);
    Status status = file_get(path, &text, problem);
    if (status == STATUS_OK) {
        sha256_sum(text.at, text.count, key->digest);
        status = json_parse(text.at, text.count, plan_fields, plan, problem);
    }
    bytes_clear(&text);
    return status == STATUS_OK ? fields_validate(plan_fields, plan, "", problem) : status;
}

Status chunk_folder_make(const char *folder, ChunkPlan *plan, ChunkKey *key, Problem *problem) {
    static const char *const parts[] = {"", "/chunks", "/log"};
    char path[PATH_MAX];
    Bytes text = {0};
    ChunkPlan stored;
    ChunkKey there = {{0}};
    for (size_t i = 0; i < COUNT(parts); i++) {
        snprintf(path, sizeof path, "%.3000s%s", folder, parts[i]);
        if (mkdir(path, 0700) != 0 && errno != EEXIST)
            return file_fault(problem, path, "made");
    }
    if (plan_read(folder, &stored, &there, NULL) == STATUS_OK && !plan->is_made &&
        stored.members == plan->members && stored.chunks <= plan->members)
        plan->chunks = stored.chunks;
    chunk_plan_clear(&stored);
    plan->is_made = true;
    encode_item(&text, plan_fields, plan, WRITE_SCENE);
    sha256_sum(text.at, text.count, key->digest);
    Status status = study_result(status_made(!text.is_failed), problem);
    if (status == STATUS_OK && memcmp(key, &there, sizeof there) != 0)
        status = chunk_folder_put(folder, "study", text.at, text.count, problem);
    bytes_clear(&text);
    return status;
}

Status chunk_folder_read(const char *folder, ChunkPlan *plan, ChunkKey *key, StudyRequest *request,
                         Problem *problem) {
    Db *db = NULL;
    *request = (StudyRequest){.study = NULL};
    TRY(plan_read(folder, plan, key, problem));
    if (strcmp(plan->engine, engine_version) != 0)
        return problem_set(problem, STATUS_INVALID,
                           "this program has the engine %s, the study is for %s: install the same "
                           "impactd on all machines",
                           engine_version, plan->engine);
    TRY(json_parse(plan->scene, strlen(plan->scene), study_request_fields, request, problem));
    TRY(db_open(NULL, &db, problem));
    Status status = STATUS_OK;
    for (size_t i = 0; status == STATUS_OK && i < plan->records.count; i++)
        status = record_load(&plan->records.at[i], db, problem);
    if (status == STATUS_OK)
        status = request_load_records(db, request, problem);
    db_close(db);
    return status;
}

// --- chunks ---

void chunk_begin(Bytes *bytes, const ChunkKey *key, size_t chunk, size_t count) {
    ChunkHead head = {.key = *key, .chunk = chunk, .count = count};
    memcpy(head.magic, chunk_magic, sizeof head.magic);
    bytes_put(bytes, &head, sizeof head);
}

void chunk_add(Bytes *bytes, const StudyPart *part) {
    const size_t at = bytes->count;
    uint64_t length = 0;
    bytes_put(bytes, &length, sizeof length);
    part_blob_write(bytes, part);
    length = bytes->count - at - sizeof length;
    if (!bytes->is_failed)
        memcpy(bytes->at + at, &length, sizeof length);
}

void chunk_add_failure(Bytes *bytes, Status status, char *why) {
    StudyPart part = {.run = {.status = status, .why = why, .steps = (double)NAN}};
    (void)fields_default(summary_fields, &part.run.summary);
    (void)fields_default(reduction_fields, &part.run.reduction);
    chunk_add(bytes, &part);
}

Status chunk_save(const char *folder, size_t chunk, Bytes *bytes, Problem *problem) {
    unsigned char digest[DIGEST_BYTES];
    char name[32];
    snprintf(name, sizeof name, "chunks/%zu", chunk);
    sha256_sum(bytes->at, bytes->count, digest);
    bytes_put(bytes, digest, sizeof digest);
    return bytes->is_failed ? study_result(STATUS_NO_MEMORY, problem)
                            : chunk_folder_put(folder, name, bytes->at, bytes->count, problem);
}

// Why it is not this chunk of this study; NULL: it is.
static const char *chunk_fault(const ChunkPlan *plan, const ChunkKey *key, size_t chunk,
                               ChunkFile *file) {
    const Bytes *bytes = &file->bytes;
    unsigned char digest[DIGEST_BYTES];
    ChunkHead head;
    const char *part;
    size_t size, count = 0;
    if (bytes->count < sizeof head + sizeof digest)
        return "is torn";
    const size_t end = bytes->count - sizeof digest;
    sha256_sum(bytes->at, end, digest);
    if (memcmp(digest, bytes->at + end, sizeof digest) != 0)
        return "is torn or damaged";
    memcpy(&head, bytes->at, sizeof head);
    if (memcmp(head.magic, chunk_magic, sizeof head.magic) != 0 ||
        memcmp(&head.key, key, sizeof head.key) != 0 || head.chunk != chunk)
        return "belongs to another study or chunk";
    file->bytes.count = end;
    for (file->at = sizeof head; chunk_next(file, &part, &size);)
        count++;
    if (file->at != end || count != head.count || count != chunk_plan_count(plan, chunk))
        return "has other members";
    file->at = sizeof head;
    return NULL;
}

Status chunk_read(const char *folder, const ChunkPlan *plan, const ChunkKey *key, size_t chunk,
                  ChunkFile *file, Problem *problem) {
    char path[PATH_MAX];
    snprintf(path, sizeof path, "%.3000s/chunks/%zu", folder, chunk);
    file->at = 0;
    TRY(file_get(path, &file->bytes, problem));
    const char *fault = chunk_fault(plan, key, chunk, file);
    return fault == NULL ? STATUS_OK
                         : problem_set(problem, STATUS_INVALID, "%.300s %s", path, fault);
}

bool chunk_next(ChunkFile *file, const char **part, size_t *size) {
    uint64_t length;
    const size_t left = file->bytes.count - file->at;
    if (left < sizeof length)
        return false;
    memcpy(&length, file->bytes.at + file->at, sizeof length);
    if (length > left - sizeof length)
        return false;
    *part = file->bytes.at + file->at + sizeof length;
    *size = (size_t)length;
    file->at += sizeof length + *size;
    return true;
}
