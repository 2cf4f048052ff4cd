#include "server/jobs/chunk_file.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
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
#include "server/json/encode.h"
#include "server/json/parse.h"

enum { SCENE_BYTES = 64 << 20, FILE_BYTES = 1 << 30 };

static const char chunk_magic[8] = {'i', 'm', 'p', 'a', 'c', 't', 'c', '1'};

typedef struct ChunkHead {
    char magic[sizeof chunk_magic];
    ChunkKey key;
    uint64_t chunk, count;
} ChunkHead;

// clang-format off
static const Field plan_fields[] = {
    FIELD_TEXT(ChunkPlan, engine, 64, PRESENCE_REQUIRED, 0, "version of the engine"),
    FIELD_TEXT(ChunkPlan, result, 72, PRESENCE_REQUIRED, 0, "id of the result"),
    FIELD_COUNT(ChunkPlan, members, NULL, WITHIN(1, 1e9), REQUIRED, "of the study"),
    FIELD_COUNT(ChunkPlan, chunks, NULL, WITHIN(1, 1e6), REQUIRED, "that they are made in"),
    FIELD_FLAG(ChunkPlan, is_strided, false, "chunk i has the members i, i + chunks ..."),
    FIELD_COUNT(ChunkPlan, samples, NULL, AT_MIN(0), REQUIRED, "limit of each run, as the next"),
    FIELD_COUNT(ChunkPlan, impacts, NULL, AT_MIN(0), REQUIRED, "listed"),
    FIELD_COUNT(ChunkPlan, points, NULL, AT_MIN(0), REQUIRED, "of a sweep"),
    FIELD_REAL(ChunkPlan, steps, NULL, AT_MIN(0), REQUIRED, "predicted"),
    FIELD_REAL(ChunkPlan, bytes, "B", AT_MIN(0), REQUIRED, "of memory"),
    FIELD_REAL(ChunkPlan, document_bytes, "B", AT_MIN(0), REQUIRED, "of spectra"),
    FIELD_TEXT(ChunkPlan, scene, SCENE_BYTES, PRESENCE_REQUIRED, 0, "canonical JSON"),
    FIELD_END,
};
// clang-format on

void chunk_plan_clear(ChunkPlan *plan) {
    fields_clear(plan_fields, plan);
}

Status chunk_plan_make(ChunkPlan *plan, const StudyRequest *request, const char *result,
                       const SimulationLimits *limits, Problem *problem) {
    Bytes scene = {0};
    *plan = (ChunkPlan){.samples = limits->samples,
                        .impacts = limits->impacts,
                        .points = limits->points,
                        .steps = limits->steps,
                        .bytes = limits->bytes,
                        .document_bytes = limits->document_bytes};
    document_scene(&scene, request);
    plan->scene = bytes_take(&scene, NULL);
    const Status all[] = {status_made(plan->scene != NULL),
                          text_copy(engine_version, &plan->engine),
                          text_copy(result, &plan->result)};
    return study_result(status_first(all, COUNT(all)), problem);
}

SimulationLimits chunk_plan_limits(const ChunkPlan *plan) {
    return (SimulationLimits){.samples = (size_t)plan->samples,
                              .impacts = (size_t)plan->impacts,
                              .points = (size_t)plan->points,
                              .steps = plan->steps,
                              .bytes = plan->bytes,
                              .document_bytes = plan->document_bytes};
}

static size_t chunk_plan_each(const ChunkPlan *plan) {
    return (size_t)((plan->members + plan->chunks - 1) / plan->chunks);
}

size_t chunk_plan_count(const ChunkPlan *plan, size_t chunk) {
    const size_t each = chunk_plan_each(plan);
    if (plan->is_strided)
        return chunk >= plan->members
                   ? 0
                   : (size_t)((plan->members - chunk + plan->chunks - 1) / plan->chunks);
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
                       "%.300s cannot be %s: %s", path, what, strerror(error));
}

static Status file_folder(const char *path, Problem *problem) {
    return mkdir(path, 0700) == 0 || errno == EEXIST ? STATUS_OK
                                                     : file_fault(problem, path, "made");
}

static bool file_write_all(int file, const char *bytes, size_t count) {
    while (count > 0) {
        const ssize_t written = write(file, bytes, count);
        if (written < 0 && errno != EINTR)
            return false;
        bytes += written > 0 ? written : 0;
        count -= written > 0 ? (size_t)written : 0;
    }
    return true;
}

static void file_sync_folder(const char *folder) {
    const int file = open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (file < 0)
        return;
    (void)fsync(file);
    (void)close(file);
}

// FOLDER/PART/NAME, whole and on the disk, or not at all.
static Status file_put(const char *folder, const char *part, const char *name, const Bytes *bytes,
                       Problem *problem) {
    char path[PATH_MAX], fresh[PATH_MAX], host[64] = "";
    (void)gethostname(host, sizeof host - 1);
    snprintf(path, sizeof path, "%.3000s%s%.80s", folder, part, name);
    snprintf(fresh, sizeof fresh, "%.3800s.%s.%ld.part", path, host, (long)getpid());
    const int file = open(fresh, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    if (file < 0)
        return file_fault(problem, fresh, "made");
    const bool is_written = file_write_all(file, bytes->at, bytes->count) && fsync(file) == 0;
    const int error = errno;
    const bool is_closed = close(file) == 0;
    errno = is_written ? errno : error;
    if (is_written && is_closed && rename(fresh, path) == 0) {
        snprintf(fresh, sizeof fresh, "%.3000s%s", folder, part);
        file_sync_folder(fresh);
        return STATUS_OK;
    }
    const Status status = file_fault(problem, path, "written");
    (void)unlink(fresh);
    return status;
}

static Status file_get(const char *path, Bytes *bytes, Problem *problem) {
    char block[1 << 16];
    ssize_t count;
    struct stat facts;
    *bytes = (Bytes){.most = FILE_BYTES};
    const int file = open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0)
        return errno == ENOENT ? problem_set(problem, STATUS_NOT_FOUND, "there is no %.300s", path)
                               : file_fault(problem, path, "opened");
    if (fstat(file, &facts) == 0 && S_ISREG(facts.st_mode) && facts.st_size < FILE_BYTES)
        (void)bytes_reserve(bytes, (size_t)facts.st_size);
    while ((count = read(file, block, sizeof block)) > 0 || (count < 0 && errno == EINTR))
        if (count > 0)
            bytes_put(bytes, block, (size_t)count);
    const Status status = count == 0 ? STATUS_OK : file_fault(problem, path, "read");
    (void)close(file);
    if (status == STATUS_OK && bytes->is_failed)
        return bytes->is_over
                   ? problem_set(problem, STATUS_INVALID, "%.300s is too large", path)
                   : problem_set(problem, STATUS_NO_MEMORY, "no memory for %.300s", path);
    return status;
}

static void folder_remove(const char *folder, int depth) {
    char path[PATH_MAX];
    DIR *list = opendir(folder);
    const struct dirent *entry;
    while (list != NULL && (entry = readdir(list)) != NULL) {
        if (strcmp(entry->d_name, ".") == 0 || strcmp(entry->d_name, "..") == 0)
            continue;
        snprintf(path, sizeof path, "%.3000s/%s", folder, entry->d_name);
        if (unlink(path) != 0 && depth > 0)
            folder_remove(path, depth - 1);
    }
    if (list != NULL)
        (void)closedir(list);
    (void)rmdir(folder);
}

void chunk_folder_remove(const char *folder) {
    folder_remove(folder, 1);
}

// --- the study ---

// "record:NAME" lines as references_write writes them: the next name.
static bool records_next(const char **lines, char name[RECORD_NAME_SIZE]) {
    static const char prefix[] = "record:";
    const size_t length = strcspn(*lines, "\n");
    if (length < sizeof prefix || length - sizeof prefix + 1 >= RECORD_NAME_SIZE)
        return false;
    memcpy(name, *lines + sizeof prefix - 1, length - sizeof prefix + 1);
    name[length - sizeof prefix + 1] = '\0';
    *lines += length + 1;
    return true;
}

static Status record_put(const char *folder, Db *db, const char *name, Problem *problem) {
    NamedRecord *named;
    Bytes bytes = {.most = FILE_BYTES};
    TRY(db_record_named(db, name, &named, problem));
    bytes_put(&bytes, &named->interval, sizeof named->interval);
    bytes_put(&bytes, named->samples.at, named->samples.count * sizeof *named->samples.at);
    refcount_unref(&named->shared);
    const Status status = bytes.is_failed
                              ? problem_set(problem, STATUS_NO_MEMORY, "no memory for a record")
                              : file_put(folder, "/records/", name, &bytes, problem);
    bytes_clear(&bytes);
    return status;
}

static Status record_get(const char *folder, Db *db, const char *name, Problem *problem) {
    char path[PATH_MAX], copy[RECORD_NAME_SIZE], layout[] = "json";
    Bytes bytes;
    Reals samples = {NULL, 0};
    RecordRow row = {.name = copy, .layout = layout};
    bool is_there;
    snprintf(path, sizeof path, "%.3000s/records/%s", folder, name);
    text_fit(copy, sizeof copy, name);
    Status status = file_get(path, &bytes, problem);
    const size_t count = bytes.count / sizeof(double);
    if (status == STATUS_OK && (count < 3 || bytes.count % sizeof(double) != 0))
        status = problem_set(problem, STATUS_INVALID, "%.300s is no record", path);
    if (status == STATUS_OK && !reals_allocate(&samples, count - 1))
        status = problem_set(problem, STATUS_NO_MEMORY, "no memory for a record");
    if (status == STATUS_OK) {
        memcpy(&row.interval, bytes.at, sizeof row.interval);
        memcpy(samples.at, bytes.at + sizeof row.interval, samples.count * sizeof *samples.at);
        status = record_row_measure(&row, &samples, 0);
    }
    if (status == STATUS_OK)
        status = db_record_add(db, &row, &samples, &is_there, problem);
    row.name = row.layout = NULL;
    record_row_clear(&row);
    free(samples.at);
    bytes_clear(&bytes);
    return status;
}

// Each record of the request, put into the folder or, where `is_read`, into the database.
static Status records_each(const char *folder, Db *db, const StudyRequest *request, bool is_read,
                           Problem *problem) {
    Bytes lines = {0};
    char name[RECORD_NAME_SIZE];
    references_write(&lines, request, false);
    Status status =
        lines.is_failed ? problem_set(problem, STATUS_NO_MEMORY, "no memory for names") : STATUS_OK;
    for (const char *at = lines.at; status == STATUS_OK && at != NULL && records_next(&at, name);)
        status =
            is_read ? record_get(folder, db, name, problem) : record_put(folder, db, name, problem);
    bytes_clear(&lines);
    return status;
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

static bool plan_is_of(const ChunkPlan *plan, const ChunkPlan *other) {
    return strcmp(plan->engine, other->engine) == 0 && strcmp(plan->scene, other->scene) == 0 &&
           plan->members == other->members && plan->is_strided == other->is_strided &&
           (!plan->is_strided || plan->chunks == other->chunks) && plan->steps == other->steps &&
           plan->samples == other->samples && plan->impacts == other->impacts &&
           plan->bytes == other->bytes;
}

Status chunk_folder_make(const char *folder, ChunkPlan *plan, const StudyRequest *request, Db *db,
                         ChunkKey *key, Problem *problem) {
    static const char *const parts[] = {"", "/records", "/chunks", "/log"};
    char path[PATH_MAX];
    Bytes text = {0};
    ChunkPlan stored;
    for (size_t i = 0; i < COUNT(parts); i++) {
        snprintf(path, sizeof path, "%.3000s%s", folder, parts[i]);
        TRY(file_folder(path, problem));
    }
    const bool is_there =
        plan_read(folder, &stored, key, NULL) == STATUS_OK && plan_is_of(plan, &stored);
    if (is_there)
        plan->chunks = stored.chunks;
    chunk_plan_clear(&stored);
    if (is_there)
        return STATUS_OK;
    encode_item(&text, plan_fields, plan, WRITE_SCENE);
    if (text.is_failed)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a study's chunks");
    sha256_sum(text.at, text.count, key->digest);
    // The study comes last: where it is there, so are its records.
    Status status = records_each(folder, db, request, false, problem);
    if (status == STATUS_OK)
        status = file_put(folder, "/", "study", &text, problem);
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
    Status status = records_each(folder, db, request, true, problem);
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

void chunk_add(Bytes *bytes, const void *part, size_t size) {
    const uint64_t length = size;
    bytes_put(bytes, &length, sizeof length);
    bytes_put(bytes, part, size);
}

Status chunk_save(const char *folder, size_t chunk, Bytes *bytes, Problem *problem) {
    unsigned char digest[DIGEST_BYTES];
    char name[24];
    snprintf(name, sizeof name, "%zu", chunk);
    sha256_sum(bytes->at, bytes->count, digest);
    bytes_put(bytes, digest, sizeof digest);
    return bytes->is_failed ? problem_set(problem, STATUS_NO_MEMORY, "no memory for a chunk")
                            : file_put(folder, "/chunks/", name, bytes, problem);
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
    if (file->at != end || count == 0 || count != head.count ||
        count != chunk_plan_count(plan, chunk))
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
