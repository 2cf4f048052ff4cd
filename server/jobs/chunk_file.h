// Members of a study that are made elsewhere: files in a folder that all machines share.
//
//     study        what is to be made, as JSON: the scene with its study, the ground motions that
//                  it names, its limits, its chunks
//     chunks/I     what was made of chunk I
//     log/I        what its worker said
//
// A file has another name until it is complete and on the disk. A chunk names the study that it was
// made for, by the digest of the file `study`, and ends with the digest of all that precedes: what
// is torn, damaged or another's is not read. Any number of machines may make the same chunk, as the
// bytes are the same.
#ifndef SERVER_JOBS_CHUNK_FILE_H
#define SERVER_JOBS_CHUNK_FILE_H

#include "core/study/study.h"
#include "server/db/db.h"
#include "server/util/bytes.h"
#include "server/util/sha256.h"

// A ground motion that the scene names.
typedef struct ChunkRecord {
    char *name;
    double interval; // [s]
    Reals samples;   // [m/s^2]
} ChunkRecord;

typedef struct ChunkPlan {
    char *engine; // its version
    char *scene;  // canonical JSON, with the study
    uint64_t members, chunks;
    bool is_strided; // chunk i has the members i, i + chunks ..., else those that follow each other
    bool is_made;    // its folder was made, or will be with this number of chunks
    SimulationLimits limits; // of each run
    struct {
        ChunkRecord *at;
        size_t count;
    } records;
} ChunkPlan;
// For a completed request with records of the database, but for members and chunks. Cleared by the
// caller in any case.
Status chunk_plan_make(ChunkPlan *plan, const StudyRequest *request, Db *db,
                       const SimulationLimits *limits, Problem *problem);
void chunk_plan_clear(ChunkPlan *plan);
size_t chunk_plan_count(const ChunkPlan *plan, size_t chunk); // members of it
size_t chunk_plan_member(const ChunkPlan *plan, size_t chunk, size_t place);

typedef struct ChunkKey {
    unsigned char digest[DIGEST_BYTES];
} ChunkKey;

// Exit codes of `impactd chunk`, as in sysexits.h.
enum {
    CHUNK_MADE = 0,
    CHUNK_BAD = 65,   // it can never be made
    CHUNK_FULL = 74,  // there is no space for it
    CHUNK_AGAIN = 75, // another attempt may succeed
};

// Makes the folder with the study, where it is not there yet. A study that is there keeps its
// number of chunks, which the plan takes the first time (is_made). STATUS_FULL, STATUS_IO.
Status chunk_folder_make(const char *folder, ChunkPlan *plan, ChunkKey *key, Problem *problem);
// Reads it back: the request is complete, with its records. Both are cleared by the caller in any
// case. STATUS_INVALID: the folder has no study of this engine.
Status chunk_folder_read(const char *folder, ChunkPlan *plan, ChunkKey *key, StudyRequest *request,
                         Problem *problem);
// Writes FOLDER/NAME. STATUS_FULL, STATUS_IO.
Status chunk_folder_put(const char *folder, const char *name, const void *data, size_t size,
                        Problem *problem);
// Deletes the folder and all that is in it; of a symbolic link only that.
void chunk_folder_remove(const char *folder);

// The bytes of a chunk: begin, then each part, then save.
void chunk_begin(Bytes *bytes, const ChunkKey *key, size_t chunk, size_t count);
void chunk_add(Bytes *bytes, const StudyPart *part);
void chunk_add_failure(Bytes *bytes, Status status, char *why); // a run that failed
// STATUS_FULL, STATUS_IO.
Status chunk_save(const char *folder, size_t chunk, Bytes *bytes, Problem *problem);

// A chunk that was read and verified.
typedef struct ChunkFile {
    Bytes bytes;
    size_t at; // of the next part
} ChunkFile;
// STATUS_NOT_FOUND; STATUS_INVALID: torn, damaged or another's; STATUS_IO, STATUS_NO_MEMORY.
// Cleared by bytes_clear(&file->bytes) in any case.
Status chunk_read(const char *folder, const ChunkPlan *plan, const ChunkKey *key, size_t chunk,
                  ChunkFile *file, Problem *problem);
// The next of its parts, as many as chunk_plan_count says; false: there is none.
bool chunk_next(ChunkFile *file, const char **part, size_t *size);

#endif
