// Rows in the order in which the database takes them, and what can be told of them beside each
// other alone.
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "server/materials/exchange.h"
#include "server/materials/exchange_same.h"
#include "server/util/clock.h"

// By slug, by number, what has none last, then as in the file.
static int order(const char *slug_a, uint64_t number_a, const RowInfo *a, const char *slug_b,
                 uint64_t number_b, const RowInfo *b) {
    const int by_slug = strcmp(slug_a, slug_b);
    if (by_slug != 0)
        return by_slug;
    if (number_a != number_b) // 0 - 1 is the largest
        return number_a - 1 < number_b - 1 ? -1 : 1;
    return a->order < b->order ? -1 : a->order > b->order;
}

static int order_revisions(const void *a, const void *b) {
    const ImportRevision *one = a, *other = b;
    return order(one->said.slug, one->said.revision, &one->mark, other->said.slug,
                 other->said.revision, &other->mark);
}

static int order_measurements(const void *a, const void *b) {
    const ImportMeasurement *one = a, *other = b;
    return order(one->made.slug, one->made.measurement, &one->mark, other->made.slug,
                 other->made.measurement, &other->mark);
}

// Of a material's revisions either all have numbers or there is one only.
static void check_revisions(const MaterialImport *import, Problem *problem) {
    for (size_t i = 1; i < import->revision_count; i++) {
        const ImportRevision *before = &import->revisions[i - 1], *here = &import->revisions[i];
        if (strcmp(before->said.slug, here->said.slug) != 0 || here->said.revision > 0 ||
            here->mark.is_adrift || before->mark.is_adrift)
            continue;
        char place[sizeof((Fault){0}.pointer)];
        json_pointer_join(place, sizeof place, here->mark.place,
                          strcmp(import->revision_name, "number") == 0 ? "slug"
                                                                       : import->revision_name);
        (void)problem_add(problem, STATUS_INVALID, place,
                          "\"%.64s\" has a revision in the file already, at %.64s: give each its "
                          "number if there are to be several",
                          here->said.slug, before->mark.place);
    }
}

static int order_tests(const void *a, const void *b) {
    const ImportMeasurement *one = *(const ImportMeasurement *const *)a,
                            *other = *(const ImportMeasurement *const *)b;
    const int by_slug = strcmp(one->made.slug, other->made.slug);
    if (by_slug != 0)
        return by_slug;
    const int by_test = strcmp(one->made.document, other->made.document);
    if (by_test != 0)
        return by_test;
    const bool is_numbered = one->made.measurement > 0;
    if (is_numbered != (other->made.measurement > 0))
        return is_numbered ? -1 : 1;
    return one->mark.order < other->mark.order ? -1 : one->mark.order > other->mark.order;
}

// The same test once more without a number is one that was copied twice.
static Status check_tests(const MaterialImport *import, Problem *problem) {
    const ImportMeasurement **tests = calloc(import->measurement_count + 1, sizeof *tests);
    size_t count = 0;
    if (tests == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the measurements");
    for (size_t i = 0; i < import->measurement_count; i++)
        if (import->measurements[i].made.document != NULL)
            tests[count++] = &import->measurements[i];
    qsort(tests, count, sizeof(const ImportMeasurement *), order_tests);
    for (size_t i = 1; i < count; i++) {
        const MaterialMeasurement *before = &tests[i - 1]->made, *here = &tests[i]->made;
        if (here->measurement > 0 || strcmp(before->slug, here->slug) != 0 ||
            strcmp(before->document, here->document) != 0)
            continue;
        char place[sizeof((Fault){0}.pointer)];
        json_pointer_join(place, sizeof place, tests[i]->mark.place, "test");
        (void)problem_add(problem, STATUS_INVALID, place,
                          "is in the file already, at %.64s: give each its number if it was done "
                          "twice",
                          tests[i - 1]->mark.place);
    }
    free(tests);
    return STATUS_OK;
}

Status exchange_import(Exchange *exchange, Db *db, const char *who, bool may_all, bool is_dry,
                       ImportTally *metrics, Problem *problem) {
    MaterialImport *import = &exchange->import;
    if (import->revision_count > 0)
        qsort(import->revisions, import->revision_count, sizeof *import->revisions,
              order_revisions);
    if (import->measurement_count > 0)
        qsort(import->measurements, import->measurement_count, sizeof *import->measurements,
              order_measurements);
    check_revisions(import, problem);
    TRY(check_tests(import, problem));
    import->who = who;
    import->may_all = may_all;
    import->now_unix_ms = clock_unix_ms();
    import->says_same = exchange_says_same;
    return db_material_import(db, import, is_dry, metrics, problem);
}
