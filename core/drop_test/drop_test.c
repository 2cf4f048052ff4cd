// A body that falls from rest arrives with sqrt(2 g h). A free base takes part of the momentum:
// with u the impactor's rebound speed over its approach speed v, masses m on M and base speed w
// after the contact, momentum m v = M w - m u v gives the separation speed
//
//   u v + w = v (m + (m + M) u) / M,
//
// which is e v. On a fixed base it is u v.
#include "core/drop_test/drop_test.h"

#include "core/base/json_pointer.h"
#include "core/base/rfc3339.h"
#include "core/drop_test/force_trace.h"
#include "core/scene/material.h"

enum { TEXT_MAX = 1000, NOTE_MAX = 10000 };

// Relative difference between a speed and that of its height: air and friction slow a fall.
static const double height_tolerance = 0.2;

// clang-format off
static const Field drop_fields[] = {
    FIELD_REAL(Drop, drop_height, "m", ABOVE(0), OPTIONAL, "height from which the impactor fell, above the buffer at rest"),
    FIELD_REAL(Drop, rebound_height, "m", AT_MIN(0), OPTIONAL, "height to which it rebounded"),
    FIELD_REAL(Drop, approach_speed, "m/s", ABOVE(0), OPTIONAL, "speed relative to the base, just before contact"),
    FIELD_REAL(Drop, rebound_speed, "m/s", AT_MIN(0), OPTIONAL, "speed relative to the base, just after contact"),
    FIELD_REAL(Drop, contact_time, "s", ABOVE(0), OPTIONAL, "duration of the contact"),
    FIELD_TEXT(Drop, excluded, TEXT_MAX, PRESENCE_OPTIONAL, 0, "reason why it does not count; it is kept and shown"),
    FIELD_TEXT(Drop, note, TEXT_MAX, PRESENCE_OPTIONAL, 0, "remarks on this drop"),
    FIELD_END
};

static const Field trace_fields[] = {
    FIELD_REAL(Trace, interval, "s", WITHIN(1e-9, 1), REQUIRED, "time from one sample to the next"),
    FIELD_REALS(Trace, force, "N", ANY, TRACE_SAMPLES_MAX, PRESENCE_REQUIRED, "samples of the transducer; either sign, any baseline"),
    FIELD_LONE_REALS(Trace, approach_speed, "m/s", ABOVE(0), TRACE_CONTACTS_MAX, PRESENCE_OPTIONAL, "speeds of its contacts in order, as far as known"),
    FIELD_TEXT(Trace, excluded, TEXT_MAX, PRESENCE_OPTIONAL, 0, "reason why it does not count; it is kept and shown"),
    FIELD_TEXT(Trace, note, TEXT_MAX, PRESENCE_OPTIONAL, 0, "remarks on this trace"),
    FIELD_END
};

const Field drop_test_fields[] = {
    FIELD_TEXT(DropTest, impactor, TEXT_MAX, PRESENCE_OPTIONAL, 0, "body that fell, such as \"steel ball, 30 mm\""),
    FIELD_REAL(DropTest, impactor_mass, "kg", ABOVE(0), OPTIONAL, "its mass"),
    FIELD_CHOICE(DropTest, base, material_base_names, OPTIONAL, "support of the buffer"),
    FIELD_REAL(DropTest, base_mass, "kg", ABOVE(0), OPTIONAL, "mass of a free base"),
    FIELD_TEXT(DropTest, geometry, TEXT_MAX, PRESENCE_OPTIONAL, 0, "geometry of the buffer and of the set-up"),
    FIELD_REAL(DropTest, gravity, "m/s^2", WITHIN(0, 1000), OPTIONAL, "gravity that presses the impactor into the buffer during contact, corrected in e and T_c; 0: none; if absent it is not corrected; heights are converted to speeds with 9.80665 in any case"),
    FIELD_REAL(DropTest, temperature, "degC", WITHIN(-273.15, 5000), OPTIONAL, "of the buffer"),
    FIELD_TEXT(DropTest, instrument, TEXT_MAX, PRESENCE_OPTIONAL, 0, "instrument of the readings"),
    FIELD_TEXT(DropTest, date, 40, PRESENCE_OPTIONAL, 0, "date of the test: 2026-11-21, or with a time of day 2026-11-21T09:30:00Z"),
    FIELD_TEXT(DropTest, person, TEXT_MAX, PRESENCE_OPTIONAL, 0, "person or laboratory that made the test"),
    FIELD_TEXT(DropTest, source, TEXT_MAX, PRESENCE_OPTIONAL, 0, "DOI, report or notebook"),
    FIELD_TEXT(DropTest, notes, NOTE_MAX, PRESENCE_OPTIONAL, 0, "further remarks"),
    FIELD_REAL(DropTest, height_uncertainty, "m", AT_MIN(0), OPTIONAL, "standard uncertainty of one height"),
    FIELD_REAL(DropTest, speed_uncertainty, "m/s", AT_MIN(0), OPTIONAL, "standard uncertainty of one speed"),
    FIELD_REAL(DropTest, time_uncertainty, "s", AT_MIN(0), OPTIONAL, "standard uncertainty of one contact time"),
    FIELD_LIST(DropTest, drops, drop_fields, DROPS_MAX, PRESENCE_OPTIONAL, "readings of single impacts"),
    FIELD_LIST(DropTest, traces, trace_fields, TRACES_MAX, PRESENCE_OPTIONAL, "records of a force transducer; at most 1,048,576 samples in all"),
    FIELD_END
};
// clang-format on

static double drop_fall_speed(double height) {
    return sqrt(2 * STANDARD_GRAVITY * height);
}

double drop_test_effective_mass(const DropTest *test) {
    return material_test_mass(&(Material){
        .impactor_mass = test->impactor_mass, .base = test->base, .base_mass = test->base_mass});
}

double drop_approach_speed(const Drop *drop) {
    return !isnan(drop->approach_speed) ? drop->approach_speed : drop_fall_speed(drop->drop_height);
}

double drop_rebound_speed(const DropTest *test, const Drop *drop) {
    if (!isnan(drop->rebound_speed))
        return drop->rebound_speed;
    const double rise = drop_fall_speed(drop->rebound_height);
    if (test->base != MATERIAL_BASE_FREE)
        return rise;
    const double m = test->impactor_mass, M = test->base_mass;
    return (m * drop_approach_speed(drop) + (m + M) * rise) / M;
}

// Refuses a speed that its height contradicts.
static Status drop_check_speed(double height, double speed, const char *name, const char *pointer,
                               Problem *problem) {
    const double falls = drop_fall_speed(height);
    if (!(fabs(speed - falls) > height_tolerance * fmax(speed, falls)))
        return STATUS_OK;
    return json_pointer_fault_real(
        problem, pointer, name, speed, "m/s",
        "must be within %.0f %% of the %.4g m/s that a height of %.4g m gives, is %.4g m/s",
        100 * height_tolerance, falls, height, speed);
}

static Status drop_check_rebound(const DropTest *test, const Drop *drop, const char *pointer,
                                 Problem *problem) {
    const bool has_rise = !isnan(drop->rebound_height), has_speed = !isnan(drop->rebound_speed);
    if (has_rise && !isnan(drop->drop_height) && drop->rebound_height > drop->drop_height)
        return json_pointer_fault_real(
            problem, pointer, "rebound_height", drop->rebound_height, "m",
            "must be at most the drop_height of %.6g m, is %.6g m: a rebound cannot exceed the "
            "drop; a drop that does not count needs \"excluded\" with the reason",
            drop->drop_height, drop->rebound_height);
    if (has_rise && !has_speed && test->base == MATERIAL_BASE_FREE &&
        isnan(drop_test_effective_mass(test)))
        return json_pointer_fault(
            problem, pointer, "rebound_height",
            "needs impactor_mass and base_mass on a free base, which moves after the "
            "contact; or give rebound_speed relative to the base instead");
    const double before = drop_approach_speed(drop), after = drop_rebound_speed(test, drop);
    if (!(after > before * (1 + 1e-9)))
        return STATUS_OK;
    return json_pointer_fault_real(
        problem, pointer, has_speed ? "rebound_speed" : "rebound_height",
        has_speed ? after : drop->rebound_height, has_speed ? "m/s" : "m",
        "must be at most the speed of approach, %.6g m/s, gives %.6g m/s: a rebound "
        "cannot exceed the approach",
        before, after);
}

// Of a drop that counts and whose members are valid one by one.
static Status drop_check(const DropTest *test, const Drop *drop, const char *pointer,
                         Problem *problem) {
    const bool has_before = !isnan(drop->drop_height) || !isnan(drop->approach_speed);
    const bool has_after = !isnan(drop->rebound_height) || !isnan(drop->rebound_speed);
    if (!has_after && isnan(drop->contact_time))
        return problem_add(
            problem, STATUS_INVALID, pointer,
            "must have a rebound (rebound_height or rebound_speed), a contact_time, or both");
    if (has_after && !has_before)
        return json_pointer_fault(problem, pointer,
                                  !isnan(drop->rebound_height) ? "drop_height" : "approach_speed",
                                  "is required with a rebound");
    const Status before = drop_check_speed(drop->drop_height, drop->approach_speed,
                                           "approach_speed", pointer, problem);
    // On a free base height and speed are of different bodies.
    if (test->base != MATERIAL_BASE_FREE)
        TRY(drop_check_speed(drop->rebound_height, drop->rebound_speed, "rebound_speed", pointer,
                             problem));
    TRY(before);
    return has_after ? drop_check_rebound(test, drop, pointer, problem) : STATUS_OK;
}

static Status drop_test_check_drops(const DropTest *test, const char *pointer, Problem *problem) {
    Status status = STATUS_OK;
    const JsonPointer drops = json_pointer_of(pointer, "drops");
    for (size_t i = 0; i < test->drops.count; i++) {
        const JsonPointer place = json_pointer_at(drops.at, i);
        const Drop *drop = &test->drops.at[i];
        if (drop->excluded == NULL && !problem_concerns(problem, place.at) &&
            drop_check(test, drop, place.at, problem) != STATUS_OK)
            status = STATUS_INVALID;
    }
    return status;
}

size_t drop_test_sample_count(const DropTest *test) {
    size_t samples = 0;
    for (size_t i = 0; i < test->traces.count; i++)
        samples += test->traces.at[i].force.count;
    return samples;
}

static Status drop_test_check_traces(const DropTest *test, const char *pointer, Problem *problem) {
    Status status = STATUS_OK;
    const JsonPointer traces = json_pointer_of(pointer, "traces");
    for (size_t i = 0; i < test->traces.count; i++) {
        const Trace *of = &test->traces.at[i];
        const JsonPointer trace = json_pointer_at(traces.at, i);
        if (of->excluded == NULL && !problem_concerns(problem, trace.at) &&
            trace_validate(of->interval, &of->force, json_pointer_of(trace.at, "force").at,
                           problem) != STATUS_OK)
            status = STATUS_INVALID;
    }
    const size_t samples = drop_test_sample_count(test);
    if (samples <= TRACE_SAMPLES_MAX)
        return status;
    return problem_add(problem, STATUS_INVALID, traces.at,
                       "must have at most %d samples in all, have %zu: cut the traces to the "
                       "contacts, or send them as several measurements",
                       TRACE_SAMPLES_MAX, samples);
}

static Status drop_test_check_date(const DropTest *test, const char *pointer, Problem *problem) {
    int64_t unix_ms;
    if (test->date == NULL || json_pointer_concerns(problem, pointer, "date") ||
        rfc3339_read(test->date, &unix_ms))
        return STATUS_OK;
    Fault fault = {
        .detail = "must be a date as 2026-11-21, or with a time of day as 2026-11-21T09:30:00Z"};
    json_pointer_join(fault.pointer, sizeof fault.pointer, pointer, "date");
    text_quote(fault.value, sizeof fault.value, test->date);
    return problem_add_fault(problem, STATUS_INVALID, &fault);
}

static Status drop_test_check_base(const DropTest *test, const char *pointer, Problem *problem) {
    if (isnan(test->base_mass) || test->base == MATERIAL_BASE_FREE)
        return STATUS_OK;
    return json_pointer_fault_real(
        problem, pointer, "base_mass", test->base_mass, "kg",
        test->base == MATERIAL_BASE_FIXED
            ? "must be absent with \"base\": \"fixed\", which does not move"
            : "needs \"base\": \"free\": it is the mass of a base that moves");
}

Status drop_test_validate(const DropTest *test, const char *pointer, Problem *problem) {
    const Status fields = fields_validate(drop_test_fields, test, pointer, problem);
    // A list that could not be read is empty too.
    const bool is_empty = test->drops.count == 0 && test->traces.count == 0 &&
                          !json_pointer_concerns(problem, pointer, "drops") &&
                          !json_pointer_concerns(problem, pointer, "traces");
    const Status faults[] = {
        fields,
        is_empty ? json_pointer_fault(problem, pointer, "drops",
                                      "is required unless there are traces: at least one drop")
                 : STATUS_OK,
        drop_test_check_date(test, pointer, problem),
        drop_test_check_base(test, pointer, problem),
        drop_test_check_traces(test, pointer, problem),
        drop_test_check_drops(test, pointer, problem),
    };
    return status_first(faults, COUNT(faults));
}
