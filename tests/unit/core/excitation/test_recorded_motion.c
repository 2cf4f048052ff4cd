// A record by its name: samples that are shared, that no text has, and that belong to the name.
#include "core/excitation/recorded_motion.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/canonical.h"
#include "core/base/json_pointer.h"
#include "server/json/encode.h"
#include "server/json/parse.h"
#include "tests/support/test.h"

static Problem problem;
static const char digest[] = "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef";

static NamedRecord *named_make(const char *name) {
    Reals samples;
    assert_true(reals_allocate(&samples, 3));
    samples.at[0] = 1;
    samples.at[1] = -2;
    samples.at[2] = 0.5;
    NamedRecord *named = named_record_new(name, digest, 0.02, &samples);
    assert_non_null(named);
    assert_null(samples.at);
    return named;
}

static ExcitationRecord *record_make(const char *name) {
    ExcitationRecord *record = (ExcitationRecord *)(void *)variant_new(&excitation_record.kind);
    assert_non_null(record);
    record->name = strdup(name);
    problem_clear(&problem);
    return record;
}

static void record_free(ExcitationRecord *record) {
    variant_free(&record->excitation.variant);
}

static Status check(const ExcitationRecord *record) {
    problem_clear(&problem);
    return excitation_record.check(&record->excitation, "/excitation", &problem);
}

static size_t holds(const NamedRecord *named) {
    return atomic_load(&named->shared.count);
}

TEST(a_name_stands_for_samples_that_its_copies_share) {
    NamedRecord *named = named_make("elcentro");
    ExcitationRecord *record = record_make("elcentro"), copy;
    assert_true(record_resolve(record, named));
    assert_string_equal(record->digest, digest);
    assert_int_equal(holds(named), 2);
    assert_int_equal(check(record), STATUS_OK);
    assert_int_equal(fields_copy(excitation_record.kind.fields, record, &copy), STATUS_OK);
    assert_int_equal(holds(named), 3);
    assert_ptr_equal(record_samples(&copy)->at, named->samples.at);
    record_free(record);
    fields_clear(excitation_record.kind.fields, &copy);
    assert_int_equal(holds(named), 1);
    refcount_unref(&named->shared);
}

TEST(the_base_moves_as_the_record_says) {
    NamedRecord *named = named_make("elcentro");
    ExcitationRecord *record = record_make("elcentro");
    const Span span = {.duration = 1, .sample_rate = 100};
    Base base = {0};
    assert_true(record_resolve(record, named));
    refcount_unref(&named->shared);
    record->scale = 2;
    assert_int_equal(excitation_record.make(&record->excitation, &span, NULL, &base, &problem),
                     STATUS_OK);
    assert_int_equal(base.count, 3);
    assert_true(base.interval == 0.02 && base.values[1] == -4 && base.values[2] == 1);
    assert_true(excitation_record.interval(&record->excitation) == 0.02);
    assert_true(excitation_record.lasts(&record->excitation) == 0.06);
    base_clear(&base);
    record_free(record);
}

static void gather(void *context, const void *bytes, size_t size) {
    bytes_put(context, bytes, size);
}

TEST(no_text_has_the_samples_and_no_text_gives_them) {
    NamedRecord *named = named_make("elcentro");
    ExcitationRecord *record = record_make("elcentro"), read;
    Bytes text = {0}, resolved = {0}, bare = {0};
    assert_true(record_resolve(record, named));
    encode_item(&text, excitation_record.kind.fields, record, WRITE_SCENE);
    assert_string_equal(text.at, "{\"name\": \"elcentro\", \"digest\": "
                                 "\"0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcde"
                                 "f\", \"scale\": 1}");
    // The canonical form is that of the name and the digest alone.
    canonical_write(excitation_record.kind.fields, record, gather, &resolved);
    refcount_unref(record->named);
    record->named = NULL;
    canonical_write(excitation_record.kind.fields, record, gather, &bare);
    assert_int_equal(resolved.count, bare.count);
    assert_memory_equal(resolved.at, bare.at, bare.count);
    bytes_clear(&text);
    bytes_clear(&resolved);
    bytes_clear(&bare);
    static const char given[] = "{\"name\": \"elcentro\", \"named\": 1}";
    problem_clear(&problem);
    assert_int_equal(
        json_parse(given, strlen(given), excitation_record.kind.fields, &read, &problem),
        STATUS_INVALID);
    assert_string_equal(problem.faults[0].pointer, "/named");
    assert_string_equal(problem.faults[0].detail, "unknown key");
    assert_string_equal(problem.faults[0].did_you_mean, "name");
    fields_clear(excitation_record.kind.fields, &read);
    assert_null(fields_find(excitation_record.kind.fields, "named", NULL));
    record_free(record);
    assert_int_equal(holds(named), 1);
    refcount_unref(&named->shared);
}

TEST(what_stands_beside_a_name_is_a_fault) {
    NamedRecord *named = named_make("elcentro");
    ExcitationRecord *record = record_make("elcentro");
    assert_int_equal(check(record), STATUS_INVALID); // nobody looked it up
    assert_int_equal(problem.count, 1);
    assert_string_equal(problem.faults[0].pointer, "/excitation/name");
    assert_true(record_resolve(record, named));
    assert_true(reals_allocate(&record->samples, 1));
    record->interval = 0.02;
    assert_int_equal(check(record), STATUS_INVALID);
    assert_int_equal(problem.count, 2);
    assert_true(problem_concerns(&problem, "/excitation/samples"));
    assert_true(problem_concerns(&problem, "/excitation/interval"));
    free(record->samples.at);
    record->samples = (Reals){NULL, 0};
    record->interval = (double)NAN;
    assert_int_equal(check(record), STATUS_OK);
    // Another name, or another digest, is not what was looked up.
    record->digest[0] = 'f';
    assert_int_equal(check(record), STATUS_INVALID);
    assert_string_equal(problem.faults[0].pointer, "/excitation/digest");
    record->digest[0] = digest[0];
    record->name[0] = 'E';
    assert_int_equal(check(record), STATUS_INVALID);
    assert_string_equal(problem.faults[0].pointer, "/excitation/name");
    free(record->name);
    record->name = NULL;
    assert_int_equal(check(record), STATUS_INVALID);
    assert_true(problem_concerns(&problem, "/excitation/digest"));
    record_free(record);
    refcount_unref(&named->shared);
}

TEST(a_fault_that_was_told_is_told_once) {
    ExcitationRecord *record = record_make("elcentro");
    static const char *const places[] = {"/excitation/name", "/excitation/digest"};
    for (size_t i = 0; i < COUNT(places); i++) {
        problem_clear(&problem);
        (void)problem_add(&problem, STATUS_INVALID, places[i], "is unknown");
        assert_int_equal(excitation_record.check(&record->excitation, "/excitation", &problem),
                         STATUS_INVALID);
        assert_int_equal(problem.count, 1);
    }
    record_free(record);
}

TEST(a_doubt_of_a_named_record_stands_at_its_name) {
    NamedRecord *named = named_make("elcentro");
    ExcitationRecord *record = record_make("elcentro");
    const Span span = {.duration = 1, .sample_rate = 100};
    assert_true(record_resolve(record, named));
    record->scale = 1000;
    excitation_record.doubt(&record->excitation, &span, "/excitation", &problem);
    assert_int_equal(problem.count, 1);
    assert_string_equal(problem.faults[0].pointer, "/excitation/name");
    assert_non_null(strstr(problem.faults[0].detail, "2e+03 m/s^2 (sample 1), more than 5 g"));
    record_free(record);
    refcount_unref(&named->shared);
}
