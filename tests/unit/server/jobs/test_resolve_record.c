// Records that scenes and sweeps name: found, pinned, guarded by their digests, and counted as
// used.
#include <stdio.h>
#include <string.h>

#include "core/study/sweep.h"
#include "server/db/db_private.h"
#include "server/db/records.h"
#include "server/jobs/documents.h"
#include "server/jobs/jobs_private.h"
#include "server/json/encode.h"
#include "tests/support/scratch.h"
#include "tests/support/test.h"

static Problem problem;
static char folder[SCRATCH_SIZE];
static Db *db;

static int db_make(void **state) {
    (void)state;
    scratch_make(folder);
    return db_open(folder, &db, &problem) == STATUS_OK ? 0 : 1;
}

static int db_end(void **state) {
    (void)state;
    db_close(db);
    scratch_remove(folder);
    return 0;
}

static void add(const char *name, double first) {
    double values[] = {first, -2, 2};
    const Reals samples = {values, 3};
    char digest[RECORD_DIGEST_SIZE];
    bool is_there;
    record_digest(0.02, &samples, digest);
    const RecordRow row = {.name = (char *)name,
                           .layout = "json",
                           .unit = "m/s^2",
                           .interval = 0.02,
                           .count = 3,
                           .digest = digest};
    assert_int_equal(db_record_add(db, &row, &samples, &is_there, &problem), STATUS_OK);
}

static Status prepare(const char *excitation, const char *study, StudyRequest *inquiry) {
    char text[2048];
    Warnings warnings = {NULL, 0};
    snprintf(text, sizeof text,
             "{\"structure\": {\"mass\": 1.35, \"stiffness\": 865}, \"duration\": 1, "
             "\"sample_rate\": 100, \"excitation\": {\"kind\": \"record\", %s}%s%s}",
             excitation, study[0] != '\0' ? ", \"study\": " : "", study);
    problem_clear(&problem);
    const Status status = jobs_prepare(db, text, strlen(text), NULL, inquiry, &warnings, &problem);
    warnings_clear(&warnings);
    return status;
}

static const ExcitationRecord *record_in(const StudyRequest *inquiry) {
    return (const ExcitationRecord *)(const void *)inquiry->simulation.scene.excitation;
}

TEST(scenes_share_the_samples_of_the_record_they_name) {
    StudyRequest one, two;
    char ids[2][72];
    assert_int_equal(prepare("\"name\": \"a\"", "", &one), STATUS_OK);
    assert_int_equal(prepare("\"name\": \"a\", \"scale\": 2", "", &two), STATUS_OK);
    assert_ptr_equal(record_in(&one)->named, record_in(&two)->named);
    study_request_clear(&two);
    // What it has been prepared as is prepared to the same.
    Bytes scene = {0}, again = {0};
    Warnings warnings = {NULL, 0};
    document_scene(&scene, &one);
    jobs_result_id(&one, ids[0], NULL);
    study_request_clear(&one);
    assert_int_equal(jobs_prepare(db, scene.at, scene.count, NULL, &two, &warnings, &problem),
                     STATUS_OK);
    document_scene(&again, &two);
    jobs_result_id(&two, ids[1], NULL);
    assert_string_equal(scene.at, again.at);
    assert_string_equal(ids[0], ids[1]);
    assert_null(strstr(scene.at, "samples"));
    bytes_clear(&scene);
    bytes_clear(&again);
    warnings_clear(&warnings);
    study_request_clear(&two);
}

TEST(a_sweep_pins_the_records_of_its_axes_once_each) {
    StudyRequest inquiry;
    Bytes uses = {0};
    assert_int_equal(
        prepare("\"name\": \"a\"",
                "{\"kind\": \"sweep\", \"axes\": [{\"pointer\": \"/excitation/name\", \"values\": "
                "[\"b\", \"a\", \"b\"]}]}",
                &inquiry),
        STATUS_OK);
    const SweepStudy *study = (const SweepStudy *)(const void *)inquiry.study;
    assert_int_equal(study->names.records.count, 2);
    assert_string_equal(study->names.records.at[0].name, "b");
    assert_string_equal(study->names.records.at[1].digest, record_in(&inquiry)->digest);
    references_write(&uses, &inquiry, false);
    assert_string_equal(uses.at, "record:a\nrecord:b\n");
    bytes_clear(&uses);
    study_request_clear(&inquiry);
}

TEST(samples_are_let_go_of_and_had_again) {
    StudyRequest inquiry;
    RecordUses uses;
    add("gone", 5);
    assert_int_equal(
        prepare("\"name\": \"a\"",
                "{\"kind\": \"sweep\", \"axes\": [{\"pointer\": \"/excitation/name\", \"values\": "
                "[\"b\", \"gone\"]}]}",
                &inquiry),
        STATUS_OK);
    const PinnedRecords *pinned = &((const SweepStudy *)(const void *)inquiry.study)->names.records;
    const Refcount *samples = record_in(&inquiry)->named;
    request_drop_records(&inquiry);
    assert_true(record_in(&inquiry)->named == NULL && pinned->at[1].named == NULL);
    request_drop_records(&inquiry); // does nothing
    assert_int_equal(request_load_records(db, &inquiry, &problem), STATUS_OK);
    assert_ptr_equal(record_in(&inquiry)->named, samples);
    assert_non_null(pinned->at[1].named);
    request_drop_records(&inquiry);
    assert_int_equal(db_record_delete(db, "gone", &uses, &problem), STATUS_OK);
    assert_int_equal(request_load_records(db, &inquiry, &problem), STATUS_INVALID);
    assert_string_equal(problem.faults[0].pointer, "/study/records/1/name");
    add("gone", 6);
    problem_clear(&problem);
    assert_int_equal(request_load_records(db, &inquiry, &problem), STATUS_INVALID);
    assert_string_equal(problem.faults[0].pointer, "/study/records/1/digest");
    assert_int_equal(db_record_delete(db, "gone", &uses, &problem), STATUS_OK);
    study_request_clear(&inquiry);
}

static Status apply_records(Sqlite *database, const void *sql, Problem *fault) {
    TRY(sqlite_execute(database, sql, fault));
    return sqlite_check_table(database, &records_table, &(TableCheck){.stores = true}, fault);
}

TEST(a_sweep_holds_only_so_many_samples) {
    NamedRecord *large[5];
    StudyRequest inquiry;
    for (size_t i = 0; i < COUNT(large); i++) {
        Reals samples;
        char name[8], digest[RECORD_DIGEST_SIZE], sql[400], key[SHARED_KEY_SIZE];
        snprintf(name, sizeof name, "large%zu", i);
        snprintf(digest, sizeof digest, "%064zu", i);
        snprintf(sql, sizeof sql,
                 "DROP TRIGGER IF EXISTS records_keep; INSERT INTO records (name, layout, unit, "
                 "interval, count, peak, peak_time, peak_velocity, end_velocity, digest, "
                 "created_unix_ms) VALUES ('%s', 'json', 'g', 1, %d, 0, 0, 0, 0, '%s', 0)",
                 name, RECORD_SAMPLES, digest);
        assert_int_equal(db_write(db, apply_records, sql, &problem), STATUS_OK);
        assert_true(reals_allocate(&samples, RECORD_SAMPLES)); // never written
        large[i] = named_record_new(name, digest, 1, &samples);
        snprintf(key, sizeof key, "%s %s", name, digest);
        (void)shared_cache_add(db_cache(db, CACHE_RECORDS), key, 0, &large[i]->shared, 1 << 27);
    }
    assert_int_equal(prepare("\"name\": \"a\"",
                             "{\"kind\": \"sweep\", \"axes\": [{\"pointer\": "
                             "\"/excitation/name\", \"values\": [\"large0\", \"large1\", "
                             "\"large2\", \"large3\", \"large4\", \"b\"]}]}",
                             &inquiry),
                     STATUS_INVALID);
    assert_int_equal(problem.count, 1);
    assert_string_equal(problem.faults[0].pointer, "/study/axes/0/values/4");
    assert_non_null(strstr(problem.faults[0].detail, "16777216 samples"));
    study_request_clear(&inquiry);
    for (size_t i = 0; i < COUNT(large); i++)
        refcount_unref(&large[i]->shared);
}

TEST(unknown_names_are_suggested_for_a_few_and_looked_up_for_a_hundred) {
    enum { NAMES = 300 };
    static const char *const axes[][2] = {{"/excitation/name", "record-"},
                                          {"/dampers/0/buffer", "spong"}};
    for (size_t k = 0; k < COUNT(axes); k++) {
        char text[NAMES * 24 + 512];
        StudyRequest inquiry;
        Warnings warnings = {NULL, 0};
        int size =
            snprintf(text, sizeof text,
                     "{\"structure\": {\"mass\": 1.35, \"stiffness\": 865}, \"duration\": 1, "
                     "\"sample_rate\": 100, \"excitation\": {\"kind\": \"record\", "
                     "\"name\": \"a\"}, \"study\": {\"kind\": \"sweep\", \"axes\": "
                     "[{\"pointer\": \"%s\", \"values\": [",
                     axes[k][0]);
        for (int i = 0; i < NAMES; i++)
            size += snprintf(text + size, sizeof text - (size_t)size, "\"%s%d\", ", axes[k][1],
                             100 + i);
        snprintf(text + size - 2, sizeof text - (size_t)size, "]}]}}");
        problem_clear(&problem);
        assert_int_equal(jobs_prepare(db, text, strlen(text), NULL, &inquiry, &warnings, &problem),
                         STATUS_INVALID);
        // Nothing was looked up that could not be told.
        assert_int_equal(problem.count, PROBLEM_FAULTS);
        assert_non_null(strstr(problem.faults[0].detail, "there are"));
        assert_non_null(strstr(problem.faults[99].detail, "is called"));
        assert_null(strstr(problem.faults[99].detail, "there are"));
        assert_string_equal(problem.faults[99].pointer, "/study/axes/0/values/99");
        study_request_clear(&inquiry);
        warnings_clear(&warnings);
    }
}

TEST(faults_of_a_scene_with_a_study_beyond_a_hundred_are_counted) {
    enum { DAMPERS = 30, FAULTS_EACH = 4 };
    static const char *const endings[] = {
        "", ", \"study\": {\"kind\": \"sweep\", \"axes\": [{\"pointer\": \"/structure/mass\", "
            "\"values\": [1, 2]}]}"};
    for (size_t k = 0; k < COUNT(endings); k++) {
        char text[DAMPERS * 100 + 512];
        StudyRequest inquiry;
        Warnings warnings = {NULL, 0};
        int size = snprintf(text, sizeof text,
                            "{\"structure\": {\"mass\": 1.35, \"stiffness\": 865}, \"duration\": "
                            "1, \"sample_rate\": 100, \"excitation\": {\"kind\": \"free\", "
                            "\"displacement\": 0.1}%s, \"dampers\": [",
                            endings[k]);
        for (int i = 0; i < DAMPERS; i++)
            size += snprintf(text + size, sizeof text - (size_t)size,
                             "{\"mass\": -1, \"clearance\": -1, \"buffer\": {\"restitution\": "
                             "2, \"contact_time\": -1}}, ");
        snprintf(text + size - 2, sizeof text - (size_t)size, "]}");
        problem_clear(&problem);
        assert_int_equal(jobs_prepare(db, text, strlen(text), NULL, &inquiry, &warnings, &problem),
                         STATUS_INVALID);
        assert_int_equal(problem.count, DAMPERS * FAULTS_EACH);
        assert_non_null(strstr(problem.faults[99].pointer, "/dampers/24/"));
        study_request_clear(&inquiry);
        warnings_clear(&warnings);
    }
}

TEST(faults_stand_where_the_name_or_the_digest_does) {
    static const char axis[] =
        "{\"kind\": \"sweep\", \"axes\": [{\"pointer\": \"/excitation/name\", \"values\": %s}]%s}";
    static const struct {
        const char *excitation, *values, *pinned, *pointer, *did_you_mean;
    } cases[] = {
        {"\"name\": \"aa\"", NULL, "", "/excitation/name", ""},
        {"\"name\": \"record-11\"", NULL, "", "/excitation/name", "record-1"},
        {"\"name\": \"a\", \"digest\": \"0\"", NULL, "", "/excitation/digest", ""},
        {"\"name\": \"a\"", "[\"a\", \"record-2\"]", "", "/study/axes/0/values/1", "record-1"},
        {"\"name\": \"a\"", "[\"a\"]", ", \"records\": [{\"name\": \"a\", \"digest\": \"0\"}]",
         "/study/records/0/digest", ""},
        {"\"name\": \"a\"", "[\"a\"]", ", \"records\": [{\"name\": \"x\"}]", "/study/records/0",
         ""},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        char study[512] = "";
        StudyRequest inquiry;
        if (cases[i].values != NULL)
            snprintf(study, sizeof study, axis, cases[i].values, cases[i].pinned);
        assert_int_equal(prepare(cases[i].excitation, study, &inquiry), STATUS_INVALID);
        const Fault *fault = NULL;
        for (size_t k = 0; k < problem.count; k++)
            if (strcmp(problem.faults[k].pointer, cases[i].pointer) == 0)
                fault = &problem.faults[k];
        if (fault == NULL)
            fail_msg("%s: %s %s", cases[i].pointer, problem.faults[0].pointer,
                     problem.faults[0].detail);
        else
            assert_string_equal(fault->did_you_mean, cases[i].did_you_mean);
        study_request_clear(&inquiry);
    }
}

TEST(without_a_daemon_there_are_no_records) {
    Db *own, *kept = db;
    StudyRequest inquiry;
    assert_int_equal(db_open(NULL, &own, &problem), STATUS_OK);
    db = own;
    const Status status = prepare("\"name\": \"a\"", "", &inquiry);
    db = kept;
    assert_int_equal(status, STATUS_INVALID);
    assert_int_equal(problem.count, 1);
    assert_string_equal(problem.faults[0].pointer, "/excitation/name");
    assert_non_null(strstr(problem.faults[0].detail, "impactd import"));
    study_request_clear(&inquiry);
    db_close(own);
}

static int fill(void **state) {
    if (db_make(state) != 0)
        return 1;
    add("a", 1);
    add("b", 2);
    add("record-1", 3);
    return 0;
}

TEST_GROUP(fill, db_end)
