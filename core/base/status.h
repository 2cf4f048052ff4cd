// What can go wrong, and where: one Status for a program to act on, one Problem for a person to
// read. Not a log and not an exception: a Problem lives on the caller's stack and is returned,
// never stored. Used by everything.
#ifndef CORE_BASE_STATUS_H
#define CORE_BASE_STATUS_H

#include <stdbool.h>
#include <stddef.h>

// One list yields the enum, the names and the titles. Order is free; OK is first because it is 0.
#define STATUS_LIST(X)                                                                             \
    X(OK, "ok", "Done")                                                                            \
    X(UNREADABLE, "unreadable", "The document cannot be read")                                     \
    X(INVALID, "invalid-scene", "The scene has faults")                                            \
    X(USAGE, "bad-request", "The request is not as it should be")                                  \
    X(TOO_LARGE, "too-large", "Too large")                                                         \
    X(UNSUPPORTED_TYPE, "unsupported-type", "Unsupported content type")                            \
    X(NOT_ACCEPTABLE, "not-acceptable", "No such representation")                                  \
    X(UNAUTHORIZED, "unauthorized", "Not authenticated")                                           \
    X(FORBIDDEN, "forbidden", "Not allowed")                                                       \
    X(NOT_FOUND, "not-found", "Not found")                                                         \
    X(METHOD, "method-not-allowed", "Method not allowed")                                          \
    X(CONFLICT, "conflict", "Conflict")                                                            \
    X(UNCONDITIONAL, "precondition-required", "A condition is required")                           \
    X(STALE, "precondition-failed", "It has changed since it was read")                            \
    X(GONE, "gone", "Gone")                                                                        \
    X(TIMEOUT, "timeout", "Timed out")                                                             \
    X(UNREACHABLE, "unreachable", "The server cannot be reached")                                  \
    X(BUSY, "busy", "Too busy")                                                                    \
    X(QUOTA, "quota", "Over the quota")                                                            \
    X(REUSED, "key-reused", "The key was used for another request")                                \
    X(FULL, "no-room", "No room left on the disk")                                                 \
    X(CANCELLED, "cancelled", "Cancelled")                                                         \
    X(LIMIT, "limit", "A limit was reached")                                                       \
    X(UNSTABLE, "unstable", "The numbers could not be trusted")                                    \
    X(NO_MEMORY, "no-memory", "Out of memory")                                                     \
    X(IO, "input-output", "Reading or writing failed")                                             \
    X(INTERNAL, "internal", "Internal error")

typedef enum Status {
#define STATUS_ENUM(name, slug, title) STATUS_##name,
    STATUS_LIST(STATUS_ENUM)
#undef STATUS_ENUM
        STATUS_COUNT
} Status;

const char *status_slug(Status status);  // stable, for machines: "invalid-scene"
const char *status_title(Status status); // for people

enum { PROBLEM_FAULTS = 100 };

// One fault at one place. Texts that do not fit are cut at a character's edge.
typedef struct Fault {
    char pointer[256];     // JSON Pointer, "" for the whole document
    char detail[320];      // what is wrong and what would be right, with the unit
    char value[128];       // the offending value as JSON text; "" if there is none
    char unit[24];         // "" if it has none
    char did_you_mean[64]; // "" if nothing is near
    size_t row;            // of a table, from 1, its header the first; 0: it is in none
    char column[64];       // of that row
} Fault;

// All zero is "no problem". Only the first `count` faults (at most PROBLEM_FAULTS) are set.
typedef struct Problem {
    Status status;     // the first one's
    char detail[512];  // the first one's sentence, after its place
    size_t count;      // faults met, also those beyond PROBLEM_FAULTS
    const char *whose; // has the faults, a static text; NULL: the scene
    Fault faults[PROBLEM_FAULTS];
} Problem;

// Makes `problem` empty without touching its 80 KB of faults. NULL is allowed here and below.
void problem_clear(Problem *problem);

// Says what went wrong as a whole; the first one stays. Returns `status`.
Status problem_set(Problem *problem, Status status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

// Adds a fault at `pointer`; one fault per place, a second one there is dropped. Returns `status`.
Status problem_add(Problem *problem, Status status, const char *pointer, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

// The same with the number that is wrong and its unit (NULL: none).
Status problem_add_real(Problem *problem, Status status, const char *pointer, double value,
                        const char *unit, const char *format, ...)
    __attribute__((format(printf, 6, 7)));

// The same with value, unit and suggestion filled in by the caller.
Status problem_put(Problem *problem, Status status, const Fault *fault);

// Whether a fault lies at `pointer` or below it. Faults beyond PROBLEM_FAULTS are not seen.
bool problem_concerns(const Problem *problem, const char *pointer);

// Copies `text` into `target[size]`, cut at a UTF-8 character's edge and marked by "..." if it is
// too long.
void text_fit(char *target, size_t size, const char *text);
// Both may be NULL, which is a text of its own.
bool text_same(const char *a, const char *b);

// Puts `item` behind the others of a list in `target[size]`, with ", " between, cut likewise.
void text_list(char *target, size_t size, const char *item);

// `text` as a JSON string with its quotes, cut likewise inside them.
void text_quote(char *target, size_t size, const char *text);

// The shortest of %.15g, %.16g, %.17g that reads back to the same double, for messages.
const char *text_real(char target[32], double value);

#define TRY(call)                                                                                  \
    do {                                                                                           \
        const Status try_status = (call);                                                          \
        if (try_status != STATUS_OK)                                                               \
            return try_status;                                                                     \
    } while (0)

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

#endif
