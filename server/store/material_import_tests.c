// Measurements: those that are there say the same, the others continue.
#include "server/store/material_import_walk.h"

static Status compare_measurement(const Walk *walk, Database *database,
                                  const ImportMeasurement *ours, Group *group, Problem *problem) {
    static const char sql[] =
        "SELECT t.* FROM materials m JOIN material_measurements t ON t.material = m.number "
        "WHERE m.slug = :slug AND t.measurement = :number";
    const ImportMark *mark = &ours->mark;
    MaterialMeasurement there = {0};
    TRY(import_load(database, sql, group->slug, ours->made.measurement,
                    material_measurement_columns, &there, problem));
    const size_t faults = walk->faults->count;
    const ImportOrigin is = {ours->made.author, ours->made.comment, ours->made.created_unix_ms},
                       was = {there.author, there.comment, there.created_unix_ms};
    import_compare_origin(walk, mark, "measurement", &is, &was);
    if (ours->made.document != NULL && !import_is_same(ours->made.document, there.document))
        (void)import_fault(walk, mark->place, "test",
                           "is not the measurement %llu that is there, and those never change",
                           (unsigned long long)ours->made.measurement);
    material_measurement_clear(&there);
    group->measurements_done.same += walk->faults->count == faults;
    return STATUS_OK;
}

static Status add_measurement(Walk *walk, Database *database, const ImportMeasurement *ours,
                              Group *group, Problem *problem) {
    const ImportMark *mark = &ours->mark;
    import_judge_author(walk, mark, ours->made.author);
    group->measurements_done.added++;
    if (!walk->writes || walk->faults->count > 0)
        return STATUS_OK;
    MaterialMeasurement made = ours->made;
    made.measurement = group->last_measurement;
    made.author = (char *)import_author(walk, mark, made.author);
    made.comment = mark->has_comment ? made.comment : (char *)"imported";
    made.created_unix_ms = mark->has_created ? made.created_unix_ms : walk->import->now_unix_ms;
    return material_measurement_add(database, &made, problem);
}

Status import_measurements(Walk *walk, Database *database, Group *group, Problem *problem) {
    const char *name = walk->import->measurement_name;
    uint64_t before = 0;
    group->last_measurement = group->key.measurements;
    for (size_t i = 0; i < group->measurement_count; i++)
        group->measurements_drift =
            group->measurements_drift || group->measurements[i].mark.is_adrift;
    for (size_t i = 0; i < group->measurement_count; i++) {
        const ImportMeasurement *ours = &group->measurements[i];
        const uint64_t number = ours->made.measurement;
        if (ours->mark.is_adrift)
            continue;
        if (number == 0)
            group->last_measurement++;
        else if (import_judge_number(walk, &ours->mark, name, number, before,
                                     group->measurements_drift,
                                     &group->last_measurement) != STATUS_OK)
            continue;
        before = number;
        if (number > 0 && number <= group->key.measurements)
            TRY(compare_measurement(walk, database, ours, group, problem));
        else
            TRY(add_measurement(walk, database, ours, group, problem));
    }
    return STATUS_OK;
}
