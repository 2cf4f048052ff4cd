// Errors: a Status for programs, a Problem with texts for users. A Problem is on the caller's stack
// and is returned, not logged or stored. Also the few text functions that messages need.
#ifndef CORE_BASE_STATUS_H
#define CORE_BASE_STATUS_H

#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>

// One list defines the enum, the slugs and the titles. OK is first because it is 0; the order of
// the others is free.
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

const char *status_slug(Status status);  // stable, for programs: "invalid-scene"
const char *status_title(Status status); // for users

enum { PROBLEM_FAULTS = 100 };

// One fault at one place. Texts that do not fit are truncated at a UTF-8 character boundary.
typedef struct Fault {
    char pointer[256];     // JSON Pointer, "" for the whole document
    char detail[320];      // what is wrong and what is allowed, with the unit
    char value[128];       // the offending value as JSON text; "" if there is none
    char unit[24];         // "" if it has none
    char did_you_mean[64]; // "" if there is no suggestion
    size_t row;            // row of a table, from 1, which is its header; 0: not in a table
    char column[64];       // column of that row
} Fault;

// All zero is "no problem". Only the first `count` faults (at most PROBLEM_FAULTS) are set.
typedef struct Problem {
    Status status;     // of the first fault
    char detail[512];  // pointer and detail of the first fault
    size_t count;      // all faults, also those beyond PROBLEM_FAULTS
    const char *whose; // the document that has the faults, a static text; NULL: the scene
    Fault faults[PROBLEM_FAULTS];
} Problem;

// Empties `problem` without writing its 80 KB of faults. NULL is allowed here and below.
void problem_clear(Problem *problem);

// Sets the status and detail unless they are set already. Returns `status`.
Status problem_set(Problem *problem, Status status, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

// Adds a fault at `pointer`, unless that place has one already. Returns `status`.
Status problem_add(Problem *problem, Status status, const char *pointer, const char *format, ...)
    __attribute__((format(printf, 4, 5)));

// The same with the invalid number and its unit (NULL: none).
Status problem_add_real(Problem *problem, Status status, const char *pointer, double value,
                        const char *unit, const char *format, ...)
    __attribute__((format(printf, 6, 7)));

// The same with the arguments of a variadic caller; `value` NAN: none.
Status problem_add_arguments(Problem *problem, Status status, const char *pointer, double value,
                             const char *unit, const char *format, va_list arguments);

// The same with a Fault that the caller has filled in.
Status problem_add_fault(Problem *problem, Status status, const Fault *fault);

// Whether there is a fault at `pointer` or below, among the first PROBLEM_FAULTS.
bool problem_concerns(const Problem *problem, const char *pointer);

// Copies `text` into `target[size]`. Text that is too long is truncated at a UTF-8 character
// boundary and ends with "...".
void text_fit(char *target, size_t size, const char *text);
void text_fit_format(char *target, size_t size, const char *format, va_list arguments);

// Whether two texts are equal; NULL equals NULL only.
bool text_same(const char *a, const char *b);
// A copy of a text, or of NULL. STATUS_NO_MEMORY.
Status text_copy(const char *text, char **target);

// Appends `item` to the list in `target[size]`, after ", "; truncated as by text_fit.
void text_list(char *target, size_t size, const char *item);

// Writes `text` as a JSON string with quotes; truncated as by text_fit, inside the quotes.
void text_quote(char *target, size_t size, const char *text);

// The shortest of %.15g, %.16g and %.17g that reads back as the same double.
const char *text_real(char target[32], double value);
// The same by value, for an argument of a message: real_text(value).at.
typedef struct RealText {
    char at[32];
} RealText;
RealText real_text(double value);

// Frees *target and sets it to the formatted text, truncated to TEXT_FORMAT_MAX bytes; owned by the
// caller. Without memory: false, and *target is NULL.
enum { TEXT_FORMAT_MAX = 500 };
bool text_format(char **target, const char *format, ...) __attribute__((format(printf, 2, 3)));

#define TRY(call)                                                                                  \
    do {                                                                                           \
        const Status try_status = (call);                                                          \
        if (try_status != STATUS_OK)                                                               \
            return try_status;                                                                     \
    } while (0)

// The first of `count` statuses that is not STATUS_OK; STATUS_OK if all are.
static inline Status status_first(const Status *all, size_t count) {
    for (size_t i = 0; i < count; i++)
        TRY(all[i]);
    return STATUS_OK;
}

// Whether something could be allocated, as a status.
static inline Status status_made(bool is_made) {
    return is_made ? STATUS_OK : STATUS_NO_MEMORY;
}

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

#endif
