// What a study varies: members of its scene, each over a list of values or a range, and the
// materials and ground motions that such values name. sweep, optimize, calibrate, response and
// ensemble share it.
#ifndef CORE_STUDY_AXIS_H
#define CORE_STUDY_AXIS_H

#include "core/base/json_pointer.h"
#include "core/excitation/recorded_motion.h"
#include "core/study/study.h"

enum {
    STUDY_AXES = 64,
    STUDY_AXIS_VALUES = 1 << 20,
    STUDY_AXIS_POINTERS = 64, // tied members
};

typedef enum StudySpacing { STUDY_LINEAR, STUDY_LOGARITHMIC } StudySpacing;

// A member of the completed scene, or several that all get the same value; with values, or with a
// range, which is a grid of `count` values or, without `count`, every number within.
typedef struct StudyAxis {
    char *pointer;  // NULL: `pointers`
    Texts pointers; // tied members
    Texts values;   // scalars as JSON text
    double from, to;
    uint64_t count;
    int spacing; // StudySpacing; CHOICE_ABSENT beside values
} StudyAxis;

typedef struct StudyAxes {
    StudyAxis *at;
    size_t count;
} StudyAxes;

// All members; without count and spacing, of a continuous range or values; and of a range alone.
extern const Field study_axis_fields[], study_variable_fields[], study_range_fields[];

typedef struct Buffers {
    Buffer *at;
    size_t count;
} Buffers;

// A record that a study names, in its version at submission.
typedef struct PinnedRecord {
    char *name, *digest;
    Refcount *named; // a NamedRecord; NULL: not found yet
} PinnedRecord;
extern const Field pinned_record_fields[]; // "name" is the shorthand

typedef struct PinnedRecords {
    PinnedRecord *at;
    size_t count;
} PinnedRecords;

// What the values of axes name. A study's own struct has it as FIELD_BASE.
typedef struct StudyNames {
    Buffers materials;     // the numbers of every material that the scene or an axis names
    PinnedRecords records; // the ground motions that an axis names
} StudyNames;
extern const Field study_names_fields[];

// One value for an axis: JSON text, else the number; NAN leaves the scene's own.
typedef struct StudyValue {
    const char *json;
    double number;
} StudyValue;

// The members of an axis, as answers name them.
typedef struct StudyMember {
    char *pointer;  // the first of its pointers
    Texts pointers; // if it has several
} StudyMember;
extern const Field study_member_fields[];

// STATUS_NO_MEMORY.
Status study_axis_member(const StudyAxis *axis, StudyMember *member);

size_t study_axis_pointer_count(const StudyAxis *axis);
const char *study_axis_pointer(const StudyAxis *axis, size_t index); // from 0
// The place of one of the pointers of the axis at `place`.
JsonPointer study_axis_place(const StudyAxis *axis, const char *place, size_t index);
bool study_axis_is_range(const StudyAxis *axis);
// Number of values; COUNT_ABSENT of a continuous range.
size_t study_axis_length(const StudyAxis *axis);
StudyValue study_axis_value(const StudyAxis *axis, size_t index);

// Checks of one axis beyond its rows, at `place`; a range must have a count where `is_grid`, and
// from < to where not.
Status study_axis_check(const StudyAxis *axis, bool is_grid, const char *place, Problem *problem);
// That it varies the physics alone, not how it is computed.
Status study_axis_check_physics(const StudyAxis *axis, const char *place, Problem *problem);
// study_axis_check of every axis, study_axis_check_physics unless it is a grid, and that no two
// axes vary the same member; below `place` ("/study/axes").
Status study_axes_check(const StudyAxes *axes, bool is_grid, const char *place, Problem *problem);

// The row of the first member that an axis varies; NULL, and a fault below `place`, that of the
// axis, if any of its pointers is faulty. Sets `scene` to the first value that is possible, so that
// a later axis finds members that this one makes.
const Field *study_axis_find(const StudyAxis *axis, Simulation *scene, bool *is_tag,
                             const char *place, Problem *problem);
// Whether a member, of this row, takes every number of its range.
bool study_field_is_real(const Field *field, bool is_tag);
// study_axis_find of all axes, in a copy of the completed simulation; `rows` and `are_tags`, one of
// each axis, may be NULL. STATUS_INVALID if a row is NULL.
Status study_axes_find(const StudyAxes *axes, const Simulation *simulation, const char *place,
                       const Field **rows, bool *are_tags, Problem *problem);

// That value `index` of one axis alone, or end 0 or 1 of its range, gives a valid scene; the axes
// are at `place`. `scratch` is for the scene's faults.
Status study_axes_check_value(const StudyAxes *axes, size_t axis, size_t index,
                              const Simulation *simulation, const StudyNames *names,
                              const SimulationLimits *limits, const char *place, Problem *scratch,
                              Problem *problem);

// The completed scene with a value for each axis, set in their order. `is_bare`: without output.
// `names` may be NULL. Cleared by simulation_clear in any case. Faults have the pointers of the
// scene.
Status study_scene_make(const Simulation *base, const StudyAxes *axes, const StudyValue *values,
                        const StudyNames *names, bool is_bare, const SimulationLimits *limits,
                        Simulation *target, Problem *problem);

// Makes a pinned and resolved record the ground motion of a scene, which has to be completed again:
// an excitation of another kind is replaced; the scale and the initial state of a record stay.
// STATUS_NO_MEMORY.
Status study_scene_use_record(Simulation *scene, const PinnedRecord *pinned);

// For a study of a suite of records, before its scene is completed: the first one is the ground
// motion of the scene's own run, too, unless the scene names one. Refuses any other excitation,
// which the records would replace, at its place in the scene.
Status study_suite_prepare(const PinnedRecords *suite, Simulation *simulation, Problem *problem);
// Validates that no record is listed twice, below `place`.
Status study_suite_check(const PinnedRecords *suite, const char *place, Problem *problem);

// Where a study names materials and records; the server resolves them at submission.
typedef struct StudyReferences {
    StudyAxes *axes; // NULL: none, as of the others
    const char *axes_place;
    StudyNames *names;    // of the axes
    PinnedRecords *suite; // records that the study lists
    const char *suite_place;
} StudyReferences;

#endif
