// One table per struct describes its members: name, unit, range, default and meaning. Defaults,
// validation, copies, JSON, JSON Schema, the canonical form and forms are all derived from it.
#ifndef CORE_BASE_FIELD_H
#define CORE_BASE_FIELD_H

#include <math.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"

typedef enum FieldKind {
    FIELD_KIND_END,
    FIELD_KIND_REAL,     // double; absent is NAN
    FIELD_KIND_COUNT,    // uint64_t; absent is COUNT_ABSENT
    FIELD_KIND_FLAG,     // bool
    FIELD_KIND_TEXT,     // char *, owned; absent is NULL
    FIELD_KIND_CHOICE,   // int, an index into `choices`; absent is CHOICE_ABSENT
    FIELD_KIND_REALS,    // Reals
    FIELD_KIND_ROWS,     // Rows
    FIELD_KIND_TEXTS,    // Texts
    FIELD_KIND_ITEM,     // a nested struct with its own rows
    FIELD_KIND_LIST,     // List of such structs
    FIELD_KIND_VARIANT,  // Variant *, owned: one kind of a plural table, named under its tag
    FIELD_KIND_BASE,     // a nested struct whose members appear in the same JSON object
    FIELD_KIND_REFCOUNT, // Refcount *, a reference; FIELD_HIDDEN
} FieldKind;

#define COUNT_ABSENT UINT64_MAX
#define CHOICE_ABSENT (-1)
extern const char *const field_flags[]; // of FIELD_FLAG_OR_NULL

// Containers own their elements. Typed lists (struct { Damper *at; size_t count; }) have the layout
// of List, which FIELD_LIST checks.
typedef struct Reals {
    double *at;
    size_t count;
} Reals;
typedef struct Rows {
    Reals *at;
    size_t count;
} Rows;
typedef struct Texts {
    char **at;
    size_t count;
} Texts;
typedef struct List {
    void *at;
    size_t count;
} List;

// Reference count of immutable data that several structs share, from any thread. The first member
// of such a struct; a row of FIELD_REFCOUNT carries a reference.
typedef struct Refcount {
    atomic_size_t count; // set to 1 by the creator
    void (*free)(struct Refcount *shared);
} Refcount;

// Adds a reference and returns `shared`. NULL is allowed.
static inline Refcount *refcount_ref(Refcount *shared) {
    if (shared != NULL)
        atomic_fetch_add(&shared->count, 1);
    return shared;
}

// Removes a reference; the last one frees `shared`. NULL is allowed.
static inline void refcount_unref(Refcount *shared) {
    if (shared != NULL && atomic_fetch_sub(&shared->count, 1) == 1)
        shared->free(shared);
}

typedef struct Field Field;

// Description of one entry of a plural table (a contact law, an excitation, a solver). It is the
// first member of the entry's struct.
typedef struct Kind {
    const char *name;
    const char *doc;
    const Field *fields; // rows of the value struct, whose first member is a Variant
    size_t size;         // of the value struct
} Kind;

// First member of every value struct of a plural table.
typedef struct Variant {
    const Kind *kind;
} Variant;

// A plural table. at(i) is NULL past the end.
typedef struct KindTable {
    const char *tag; // the JSON key that names the kind: "kind", "model", "solver"
    const Kind *(*at)(size_t index);
    bool is_named; // the tag is required; otherwise at(0) is the default
} KindTable;

// Bounds of a number; in REALS and ROWS, of each number.
typedef struct Range {
    double min, max;
    bool is_open_below; // `min` itself is not allowed
} Range;

// Braces, not compound literals, which are not constant expressions in ISO C.
// clang-format off
#define ABOVE(x) {(x), (double)INFINITY, true}
#define AT_MIN(x) {(x), (double)INFINITY, false}
#define WITHIN(a, b) {(a), (b), false}
#define ANY {(double)-INFINITY, (double)INFINITY, false}
// clang-format on

// What happens when the member is not given.
typedef enum Presence {
    // Set to `initial`; texts and lists are empty, items have their members' defaults.
    PRESENCE_DEFAULT,
    PRESENCE_REQUIRED, // a fault
    PRESENCE_OPTIONAL, // stays absent
} Presence;

enum {
    // Does not affect results (title, labels): omitted from the canonical form.
    FIELD_NOTE = 1,
    // ITEM: JSON null is allowed and makes every member absent (fields_clear). TEXT: JSON null is
    // allowed and means "", which is not absent and is written as null. TEXTS: JSON null is allowed
    // and means an empty list. REALS, ROWS: an empty
    // list is written as null, as is a number that is unknown (NAN), and both are read back.
    FIELD_NULL_IS_EMPTY = 2,
    // TEXTS: a JSON object of strings is also allowed and stored as "key=value".
    FIELD_PAIRS = 4,
    // REALS: a JSON number is also allowed as a list of one, and a list of one is written so.
    FIELD_LONE = 8,
    // TEXTS: an allowed text may end with a number from 1: "displacement_2". Not validated by the
    // row: which texts and numbers are possible depends on other members.
    FIELD_NUMBERED = 16,
    // TEXT, TEXTS: it, or each, is a JSON number, string, true or false, stored as JSON text.
    // CHOICE: the choices are false and true.
    FIELD_SCALARS = 32,
    // Internal: copied and cleared with the struct, but not read, written, described, validated or
    // found by name, and not part of the canonical form. Its presence is OPTIONAL.
    FIELD_HIDDEN = 64,
};

struct Field {
    const char *name;
    FieldKind kind;
    size_t offset;
    const char *unit; // NULL: none
    Range range;      // of the value: REAL, COUNT, REALS, ROWS
    Presence presence;
    double initial;             // REAL, COUNT, FLAG, CHOICE under PRESENCE_DEFAULT
    const char *const *choices; // CHOICE: NULL-terminated; TEXTS: the allowed texts, or NULL
    const char *const
        *initial_texts;  // TEXTS under PRESENCE_DEFAULT: NULL-terminated, or NULL for none
    const Field *fields; // ITEM, LIST, BASE
    size_t size;         // ITEM, BASE: of the struct; REALS, ROWS, TEXTS, LIST: of an element
    // TEXT: bytes; REALS, TEXTS, LIST: elements; ROWS: rows, and numbers in each; 0: no limit
    size_t max;
    const KindTable *kinds; // VARIANT
    const char *shorthand; // ITEM, LIST: a JSON string or array instead of an object sets this TEXT
                           // or CHOICE, or REALS row
    int flags;
    const char *doc;
};

// The column "default" is REQUIRED, OPTIONAL or a number. FIELD_PRESENCE distinguishes the three.
#define REQUIRED (-HUGE_VAL)
#define OPTIONAL (HUGE_VAL)
#define FIELD_PRESENCE(x)                                                                          \
    ((x) == REQUIRED ? PRESENCE_REQUIRED : (x) == OPTIONAL ? PRESENCE_OPTIONAL : PRESENCE_DEFAULT)

// A member of the wrong type does not compile: the array in FIELD_AT then has a negative size.
#define FIELD_AT(Type, member, Wanted)                                                             \
    (offsetof(Type, member) + 0 * sizeof(char[_Generic(&((Type *)0)->member, Wanted * : 1, default \
                                                       : -1)]))
// A typed list: a pointer `at`, then a size_t `count`, and no other member.
#define FIELD_LIST_AT(Type, member)                                                                \
    (offsetof(Type, member) +                                                                      \
     0 * sizeof(char[_Generic(&((Type *)0)->member.count, size_t * : 1, default                    \
                              : -1)]) +                                                            \
     0 * sizeof(char[sizeof(((Type *)0)->member) == sizeof(List) &&                                \
                             sizeof(((Type *)0)->member.at) == sizeof(void *) &&                   \
                             offsetof(Type, member.at) == offsetof(Type, member) &&                \
                             offsetof(Type, member.count) ==                                       \
                                 offsetof(Type, member) + offsetof(List, count)                    \
                         ? 1                                                                       \
                         : -1]))

// Arguments: the struct, the member, which is also the JSON name, and those that the kind needs.
// clang-format off
#define FIELD_REAL(Type, member, unit_, range_, default_, doc_) \
    {.name = #member, .kind = FIELD_KIND_REAL, .offset = FIELD_AT(Type, member, double), .unit = unit_, \
     .range = range_, .presence = FIELD_PRESENCE(default_), .initial = (default_), .doc = doc_}
#define FIELD_HIDDEN_REAL(Type, member) \
    {.name = #member, .kind = FIELD_KIND_REAL, .offset = FIELD_AT(Type, member, double), .range = ANY, \
     .presence = PRESENCE_OPTIONAL, .flags = FIELD_HIDDEN}
#define FIELD_COUNT(Type, member, unit_, range_, default_, doc_) \
    {.name = #member, .kind = FIELD_KIND_COUNT, .offset = FIELD_AT(Type, member, uint64_t), .unit = unit_, \
     .range = range_, .presence = FIELD_PRESENCE(default_), .initial = (default_), .doc = doc_}
#define FIELD_FLAG(Type, member, default_, doc_) \
    {.name = #member, .kind = FIELD_KIND_FLAG, .offset = FIELD_AT(Type, member, bool), \
     .presence = FIELD_PRESENCE(default_), .initial = (default_), .doc = doc_}
#define FIELD_TEXT(Type, member, max_, presence_, flags_, doc_) \
    {.name = #member, .kind = FIELD_KIND_TEXT, .offset = FIELD_AT(Type, member, char *), .max = max_, \
     .presence = presence_, .flags = flags_, .doc = doc_}
#define FIELD_CHOICE(Type, member, choices_, default_, doc_) \
    {.name = #member, .kind = FIELD_KIND_CHOICE, .offset = FIELD_AT(Type, member, int), \
     .choices = choices_, .presence = FIELD_PRESENCE(default_), .initial = (default_), .doc = doc_}
// False, true or, where it is unknown, CHOICE_ABSENT: an int, so that it has a third value.
#define FIELD_FLAG_OR_NULL(Type, member, doc_) \
    {.name = #member, .kind = FIELD_KIND_CHOICE, .offset = FIELD_AT(Type, member, int), .choices = field_flags, \
     .presence = PRESENCE_OPTIONAL, .initial = OPTIONAL, .flags = FIELD_SCALARS, .doc = doc_}
#define FIELD_REALS(Type, member, unit_, range_, max_, presence_, doc_) \
    {.name = #member, .kind = FIELD_KIND_REALS, .offset = FIELD_AT(Type, member, Reals), .unit = unit_, \
     .size = sizeof(double), .range = range_, .max = max_, .presence = presence_, .doc = doc_}
#define FIELD_REALS_OR_NULL(Type, member, unit_, doc_) \
    {.name = #member, .kind = FIELD_KIND_REALS, .offset = FIELD_AT(Type, member, Reals), .unit = unit_, \
     .size = sizeof(double), .range = ANY, .presence = PRESENCE_OPTIONAL, .flags = FIELD_NULL_IS_EMPTY, .doc = doc_}
#define FIELD_ROWS_OR_NULL(Type, member, unit_, doc_) \
    {.name = #member, .kind = FIELD_KIND_ROWS, .offset = FIELD_AT(Type, member, Rows), .unit = unit_, \
     .size = sizeof(Reals), .range = ANY, .presence = PRESENCE_OPTIONAL, .flags = FIELD_NULL_IS_EMPTY, .doc = doc_}
#define FIELD_LONE_REALS(Type, member, unit_, range_, max_, presence_, doc_) \
    {.name = #member, .kind = FIELD_KIND_REALS, .offset = FIELD_AT(Type, member, Reals), .unit = unit_, \
     .size = sizeof(double), .range = range_, .max = max_, .presence = presence_, .flags = FIELD_LONE, .doc = doc_}
#define FIELD_ROWS(Type, member, unit_, range_, max_, presence_, doc_) \
    {.name = #member, .kind = FIELD_KIND_ROWS, .offset = FIELD_AT(Type, member, Rows), .unit = unit_, \
     .size = sizeof(Reals), .range = range_, .max = max_, .presence = presence_, .doc = doc_}
#define FIELD_TEXTS(Type, member, choices_, initial_, max_, presence_, flags_, doc_) \
    {.name = #member, .kind = FIELD_KIND_TEXTS, .offset = FIELD_AT(Type, member, Texts), \
     .size = sizeof(char *), .choices = choices_, .initial_texts = initial_, .max = max_, .presence = presence_, \
     .flags = flags_, .doc = doc_}
#define FIELD_ITEM(Type, member, rows_, shorthand_, presence_, doc_) \
    {.name = #member, .kind = FIELD_KIND_ITEM, .offset = offsetof(Type, member), .fields = rows_, \
     .size = sizeof(((Type *)0)->member), .shorthand = shorthand_, .presence = presence_, .doc = doc_}
#define FIELD_ITEM_OR_NULL(Type, member, rows_, presence_, doc_) \
    {.name = #member, .kind = FIELD_KIND_ITEM, .offset = offsetof(Type, member), .fields = rows_, \
     .size = sizeof(((Type *)0)->member), .presence = presence_, .flags = FIELD_NULL_IS_EMPTY, .doc = doc_}
#define FIELD_LIST(Type, member, rows_, max_, presence_, doc_) \
    {.name = #member, .kind = FIELD_KIND_LIST, .offset = FIELD_LIST_AT(Type, member), .fields = rows_, \
     .size = sizeof(*((Type *)0)->member.at), .max = max_, .presence = presence_, .doc = doc_}
#define FIELD_LIST_OR_NAMES(Type, member, rows_, shorthand_, max_, presence_, doc_) \
    {.name = #member, .kind = FIELD_KIND_LIST, .offset = FIELD_LIST_AT(Type, member), .fields = rows_, \
     .size = sizeof(*((Type *)0)->member.at), .max = max_, .shorthand = shorthand_, .presence = presence_, .doc = doc_}
#define FIELD_VARIANT(Type, member, kinds_, presence_, doc_) \
    {.name = #member, .kind = FIELD_KIND_VARIANT, .offset = FIELD_AT(Type, member, Variant *), \
     .kinds = kinds_, .presence = presence_, .doc = doc_}
#define FIELD_BASE(Type, member, rows_) \
    {.name = #member, .kind = FIELD_KIND_BASE, .offset = offsetof(Type, member), .fields = rows_, \
     .size = sizeof(((Type *)0)->member)}
#define FIELD_REFCOUNT(Type, member) \
    {.name = #member, .kind = FIELD_KIND_REFCOUNT, .offset = FIELD_AT(Type, member, Refcount *), \
     .presence = PRESENCE_OPTIONAL, .flags = FIELD_HIDDEN}
#define FIELD_END {.kind = FIELD_KIND_END}
// clang-format on

// Sets every member to its default; REQUIRED members become absent. `item` may be uninitialised. A
// VARIANT under PRESENCE_DEFAULT becomes at(0) with its defaults. After STATUS_NO_MEMORY `item` can
// still be cleared.
Status fields_default(const Field *fields, void *item);

// Checks every member against its row and adds all faults, with pointers below `pointer`: ranges,
// finite numbers, REQUIRED members, lengths, allowed texts. A CHOICE under PRESENCE_DEFAULT may be
// absent if the struct does not use it. Returns STATUS_OK or STATUS_INVALID.
Status fields_validate(const Field *fields, const void *item, const char *pointer,
                       Problem *problem);

// Frees what the members own and makes every member absent (FLAG: false). All-zero items are
// allowed.
void fields_clear(const Field *fields, void *item);

// Deep copy. `target` may be uninitialised; it is cleared on failure.
Status fields_copy(const Field *fields, const void *source, void *target);

// Whether the member of `item` is absent: NAN, COUNT_ABSENT, NULL or no elements. BASE, FLAG
// and, under PRESENCE_DEFAULT, ITEM and lists are never absent. Any other ITEM
// is absent if all its members except flags are. FIELD_HIDDEN is always absent.
bool field_is_absent(const Field *field, const void *item);

// Whether two numbers are equal; NAN, which is absent, equals NAN.
static inline bool real_same(double a, double b) {
    return a == b || (isnan(a) && isnan(b));
}

// Allocates `count` zeros, owned by `reals`. Without memory: false, and `reals` is empty.
bool reals_allocate(Reals *reals, size_t count);

// Whether there is none but zeros.
bool reals_are_zero(const Reals *reals);

// Sorts numbers in ascending order.
void reals_sort(double *values, size_t count);
// Appends an element of zeros to a typed list. Returns it, or NULL without memory.
void *list_append(void *list, size_t element_size);
// The same for a long list that only this function has filled: there is room for as many elements
// as the next power of two.
void *list_grow(void *list, size_t element_size);
// Appends a copy of the text. STATUS_OK or STATUS_NO_MEMORY, which leaves the list unchanged.
Status texts_append(Texts *texts, const char *text);
void texts_clear(Texts *texts);

// Creates a value of `kind` with its defaults; freed by variant_free. NULL without memory.
Variant *variant_new(const Kind *kind);
void variant_free(Variant *variant);
const Kind *kind_find(const KindTable *table, const char *name); // NULL if there is none

// The row called `name`, also in BASE rows; NULL if there is none. The member is at
// (char *)item + *offset + row->offset: the offsets of the BASE rows are added to *offset (may be
// NULL).
const Field *fields_find(const Field *fields, const char *name, size_t *offset);

// The number at the end of a name like "displacement_2", from 1, or 0; *length is the length of the
// name without it.
size_t field_name_number(const char *name, size_t *length);

#endif
