// One table per struct: what a member is called, its unit, range, default and meaning.
// Not a serializer: codec/ (JSON, JSON Schema) and canonical.h (digest) walk these rows, nothing
// here reads text. Used by every struct that crosses a border, and by whoever carries it across.
#ifndef CORE_BASE_FIELD_H
#define CORE_BASE_FIELD_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/refcount.h"
#include "core/base/status.h"

typedef enum FieldKind {
    FIELD_KIND_END,
    FIELD_KIND_REAL,    // double; absent is NAN
    FIELD_KIND_COUNT,   // uint64_t; absent is COUNT_ABSENT
    FIELD_KIND_FLAG,    // bool
    FIELD_KIND_TEXT,    // char *, owned; absent is NULL
    FIELD_KIND_CHOICE,  // int, an index into `choices`; absent is CHOICE_ABSENT
    FIELD_KIND_REALS,   // Reals
    FIELD_KIND_ROWS,    // Rows
    FIELD_KIND_TEXTS,   // Texts
    FIELD_KIND_ITEM,    // a nested struct with rows of its own
    FIELD_KIND_LIST,    // List of such structs
    FIELD_KIND_VARIANT, // Variant *, owned: one of a plural table, by the name under its tag
    FIELD_KIND_BASE,    // a nested struct whose rows appear in the same object (a base, an inlined
                        // part)
    FIELD_KIND_SHARED,  // Shared *, a hold; FIELD_HIDDEN
} FieldKind;

#define COUNT_ABSENT UINT64_MAX
#define CHOICE_ABSENT (-1)

// Containers own what they hold. Typed twins (struct { Damper *at; size_t count; }) have the same
// layout and are checked for it by FIELD_LIST.
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

typedef struct Field Field;

// What one member of a plural table (a contact law, an excitation, a solver) says of itself to a
// walker. It is the first member of that table's struct.
typedef struct Kind {
    const char *name;
    const char *doc;
    const Field *fields; // rows of the value struct, whose first member is a Variant
    size_t size;         // of that value struct
} Kind;

// First member of every value struct that is one of a plural table.
typedef struct Variant {
    const Kind *kind;
} Variant;

// A plural table as walkers see it. at(i) is NULL past the end.
typedef struct KindTable {
    const char *tag; // the JSON key that names the kind: "kind", "model", "solver"
    const Kind *(*at)(size_t index);
    bool is_named; // the tag must be given; otherwise at(0) is taken where it is not
} KindTable;

// Bounds of a number; for REALS and ROWS of each number.
typedef struct Range {
    double least, most;
    bool is_open_below; // `least` itself is refused
} Range;

// Braces alone, no compound literals: those are no constants in ISO C.
// clang-format off
#define ABOVE(x) {(x), (double)INFINITY, true}
#define AT_MIN(x) {(x), (double)INFINITY, false}
#define WITHIN(a, b) {(a), (b), false}
#define ANY {(double)-INFINITY, (double)INFINITY, false}
// clang-format on

// How a row behaves when the member is not given.
typedef enum Presence {
    // Takes `initial`, or for text, lists and items the empty value or the item's defaults.
    PRESENCE_DEFAULT,
    PRESENCE_REQUIRED, // a fault
    PRESENCE_OPTIONAL, // stays absent
} Presence;

enum {
    // Changes nothing: left out of the canonical form (title, labels).
    FIELD_NOTE = 1,
    // ITEM: JSON null is allowed and makes every member absent (fields_clear). TEXT: JSON null is
    // allowed and stands for "", which is not absent and is written so.
    FIELD_NULL_IS_EMPTY = 2,
    // TEXTS: a JSON object of strings is allowed too and kept as "key=value".
    FIELD_PAIRS = 4,
    // REALS: a JSON number is allowed too, and stands for a list of one; that is written so.
    FIELD_LONE = 8,
    // TEXTS: a text allowed may carry a number from 1: "displacement_2".
    FIELD_NUMBERED = 16,
    // FLAG: false counts as absent, so that the canonical form without it is as it was before there
    // was such a row.
    FIELD_RARE = 32,
    // TEXTS: each is a JSON number, string, true or false, kept as JSON text.
    FIELD_SCALARS = 64,
    // Stays inside: copied and cleared with the struct, and for all else as if it were not there.
    // Not read, written, described, judged or found by its name, and no part of the canonical form.
    // Its presence is OPTIONAL.
    FIELD_HIDDEN = 128,
};

struct Field {
    const char *name;
    FieldKind kind;
    size_t offset;
    const char *unit; // NULL: none
    Range range;      // REAL, COUNT, REALS, ROWS: the value; TEXT, TEXTS, LIST: nothing
    Presence presence;
    double initial;             // REAL, COUNT, FLAG, CHOICE under PRESENCE_DEFAULT
    const char *const *choices; // CHOICE: NULL-terminated; TEXTS: NULL, or the texts allowed
    const char *const
        *initial_texts;  // TEXTS under PRESENCE_DEFAULT: NULL-terminated, or NULL for none
    const Field *fields; // ITEM, LIST, BASE
    size_t size;         // ITEM, LIST, BASE: of one
    // TEXT: bytes; REALS, TEXTS, LIST: elements; ROWS: rows, and numbers in each; 0: no bound
    size_t most;
    const KindTable *kinds; // VARIANT
    const char
        *shorthand; // ITEM: a JSON string in place of the object sets this TEXT row; NULL: none
    int flags;
    const char *doc;
};

// REQUIRED, OPTIONAL or a number, in the column "default". The two words are NaNs only in the
// reader's eye: they are told apart by name through FIELD_PRESENCE below.
#define REQUIRED (-HUGE_VAL)
#define OPTIONAL (HUGE_VAL)
#define FIELD_PRESENCE(x)                                                                          \
    ((x) == REQUIRED ? PRESENCE_REQUIRED : (x) == OPTIONAL ? PRESENCE_OPTIONAL : PRESENCE_DEFAULT)

// A member of the wrong type does not compile: the array in FIELD_AT has a negative size then.
#define FIELD_AT(Type, member, Wanted)                                                             \
    (offsetof(Type, member) + 0 * sizeof(char[_Generic(&((Type *)0)->member, Wanted * : 1, default \
                                                       : -1)]))
// A typed twin of List: a pointer called `at`, then a size_t called `count`, and nothing else.
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

// Each macro takes the struct, the member, which is also the JSON name, and what the kind needs.
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
#define FIELD_RARE_FLAG(Type, member, doc_) \
    {.name = #member, .kind = FIELD_KIND_FLAG, .offset = FIELD_AT(Type, member, bool), \
     .presence = PRESENCE_DEFAULT, .flags = FIELD_RARE, .doc = doc_}
#define FIELD_TEXT(Type, member, most_, presence_, flags_, doc_) \
    {.name = #member, .kind = FIELD_KIND_TEXT, .offset = FIELD_AT(Type, member, char *), .most = most_, \
     .presence = presence_, .flags = flags_, .doc = doc_}
#define FIELD_CHOICE(Type, member, choices_, default_, doc_) \
    {.name = #member, .kind = FIELD_KIND_CHOICE, .offset = FIELD_AT(Type, member, int), \
     .choices = choices_, .presence = FIELD_PRESENCE(default_), .initial = (default_), .doc = doc_}
#define FIELD_REALS(Type, member, unit_, range_, most_, presence_, doc_) \
    {.name = #member, .kind = FIELD_KIND_REALS, .offset = FIELD_AT(Type, member, Reals), .unit = unit_, \
     .range = range_, .most = most_, .presence = presence_, .doc = doc_}
#define FIELD_LONE_REALS(Type, member, unit_, range_, most_, presence_, doc_) \
    {.name = #member, .kind = FIELD_KIND_REALS, .offset = FIELD_AT(Type, member, Reals), .unit = unit_, \
     .range = range_, .most = most_, .presence = presence_, .flags = FIELD_LONE, .doc = doc_}
#define FIELD_ROWS(Type, member, unit_, range_, most_, presence_, doc_) \
    {.name = #member, .kind = FIELD_KIND_ROWS, .offset = FIELD_AT(Type, member, Rows), .unit = unit_, \
     .range = range_, .most = most_, .presence = presence_, .doc = doc_}
#define FIELD_TEXTS(Type, member, choices_, initial_, most_, presence_, flags_, doc_) \
    {.name = #member, .kind = FIELD_KIND_TEXTS, .offset = FIELD_AT(Type, member, Texts), \
     .choices = choices_, .initial_texts = initial_, .most = most_, .presence = presence_, \
     .flags = flags_, .doc = doc_}
#define FIELD_ITEM(Type, member, rows_, shorthand_, presence_, doc_) \
    {.name = #member, .kind = FIELD_KIND_ITEM, .offset = offsetof(Type, member), .fields = rows_, \
     .size = sizeof(((Type *)0)->member), .shorthand = shorthand_, .presence = presence_, .doc = doc_}
#define FIELD_ITEM_OR_NULL(Type, member, rows_, presence_, doc_) \
    {.name = #member, .kind = FIELD_KIND_ITEM, .offset = offsetof(Type, member), .fields = rows_, \
     .size = sizeof(((Type *)0)->member), .presence = presence_, .flags = FIELD_NULL_IS_EMPTY, .doc = doc_}
#define FIELD_LIST(Type, member, rows_, most_, presence_, doc_) \
    {.name = #member, .kind = FIELD_KIND_LIST, .offset = FIELD_LIST_AT(Type, member), .fields = rows_, \
     .size = sizeof(*((Type *)0)->member.at), .most = most_, .presence = presence_, .doc = doc_}
#define FIELD_VARIANT(Type, member, kinds_, presence_, doc_) \
    {.name = #member, .kind = FIELD_KIND_VARIANT, .offset = FIELD_AT(Type, member, Variant *), \
     .kinds = kinds_, .presence = presence_, .doc = doc_}
#define FIELD_BASE(Type, member, rows_) \
    {.name = #member, .kind = FIELD_KIND_BASE, .offset = offsetof(Type, member), .fields = rows_, \
     .size = sizeof(((Type *)0)->member)}
#define FIELD_SHARED(Type, member) \
    {.name = #member, .kind = FIELD_KIND_SHARED, .offset = FIELD_AT(Type, member, Shared *), \
     .presence = PRESENCE_OPTIONAL, .flags = FIELD_HIDDEN}
#define FIELD_END {.kind = FIELD_KIND_END}
// clang-format on

// Sets every member to its default; REQUIRED ones become absent. `item` may be uninitialised.
// A VARIANT under PRESENCE_DEFAULT becomes at(0) with its defaults. STATUS_NO_MEMORY leaves `item`
// clearable.
Status fields_default(const Field *fields, void *item);

// Judges every member against its row, below `pointer`: REAL and COUNT ranges, finite numbers,
// REQUIRED ones present, lengths, texts allowed. A CHOICE under PRESENCE_DEFAULT may be absent:
// whoever completes the struct erases what is not used. Adds all faults. Returns STATUS_OK or
// STATUS_INVALID.
Status fields_check(const Field *fields, const void *item, const char *pointer, Problem *problem);

// Frees what the members own and makes every member absent (FLAG: false). All-zero items are fine.
void fields_clear(const Field *fields, void *item);

// Deep copy; `target` may be uninitialised and is left clear on failure.
Status fields_copy(const Field *fields, const void *source, void *target);

// Whether the member under `field` of `item` is absent: NAN, COUNT_ABSENT, NULL, no elements ...
// Never absent are FLAG (but FIELD_RARE), BASE and, under PRESENCE_DEFAULT, an ITEM and what has
// elements (an empty list was asked for then). Any other ITEM is absent if all its members are,
// whatever their presence (its flags do not count). What is FIELD_HIDDEN always is.
bool field_is_absent(const Field *field, const void *item);

// So many zeros, of its own; false without memory, and then it has none.
bool reals_make(Reals *reals, size_t count);

// Makes a new default value of `kind`; NULL without memory. Freed by variant_free.
Variant *variant_new(const Kind *kind);
void variant_free(Variant *variant);
const Kind *kind_find(const KindTable *table, const char *name);

// The row called `name`, also inside BASE rows, whose offsets are added to *offset (which may be
// NULL; the row's own is not), so that its member is row->offset bytes behind (char *)item +
// *offset.
const Field *fields_find(const Field *fields, const char *name, size_t *offset);

// The nearest of the rows' names (BASE rows included), or of a NULL-terminated list; NULL if none
// is near enough to be meant (a third of the letters may differ). For did_you_mean.
const char *fields_nearest(const Field *fields, const char *name);
const char *texts_nearest(const char *const *texts, const char *name);

// Adds the fault "must be one of ..." for `text` at `pointer`, with the nearest of `texts`. Returns
// STATUS_INVALID.
Status texts_refuse(const char *const *texts, const char *text, const char *pointer,
                    Problem *problem);

// The number from 1 that a name like "displacement_2" carries, 0 if it carries none; *length is the
// name's without it.
size_t name_number(const char *name, size_t *length);

// "pointer/name" with ~ and / escaped, cut at size.
void pointer_join(char *target, size_t size, const char *pointer, const char *name);
void pointer_index(char *target, size_t size, const char *pointer, size_t index);

#endif
