// Records that scenes and sweeps name: found, pinned, guarded by their digests, and counted as
// used.
#include "server/jobs/prepare_record.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "core/study/sweep.h"
#include "server/codec/write.h"
#include "server/jobs/documents.h"
#include "server/jobs/intake.h"
#include "server/store/record_rows.h"
#include "tests/support/scratch.h"

static Problem problem;
static char folder[SCRATCH_SIZE];
static Store *store;

static int store_make(void **state) {
    (void)state;
    scratch_make(folder);
    return store_open(folder, &store, &problem) == STATUS_OK ? 0 : 1;
}

static int store_end(void **state) {
    (void)state;
    store_close(store);
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
    assert_int_equal(store_record_add(store, &row, &samples, &is_there, &problem), STATUS_OK);
}

static Status prepare(const char *excitation, const char *study, Inquiry *inquiry) {
    char text[2048];
    Warnings warnings = {NULL, 0};
    snprintf(text, sizeof text,
             "{\"structure\": {\"mass\": 1.35, \"stiffness\": 865}, \"duration\": 1, "
             "\"sample_rate\": 100, \"excitation\": {\"kind\": \"record\", %s}%s%s}",
             excitation, study[0] != '\0' ? ", \"study\": " : "", study);
    problem_clear(&problem);
    const Status status =
        intake_prepare(store, text, strlen(text), NULL, inquiry, &warnings, &problem);
    warnings_clear(&warnings);
    return status;
}

static const ExcitationRecord *record_in(const Inquiry *inquiry) {
    return (const ExcitationRecord *)(const void *)inquiry->simulation.scene.excitation;
}

static void scenes_share_the_samples_of_the_record_they_name(void **state) {
    (void)state;
    Inquiry one, two;
    char ids[2][72];
    assert_int_equal(prepare("\"name\": \"a\"", "", &one), STATUS_OK);
    assert_int_equal(prepare("\"name\": \"a\", \"scale\": 2", "", &two), STATUS_OK);
    assert_ptr_equal(record_in(&one)->named, record_in(&two)->named);
    inquiry_clear(&two);
    // What it has been prepared as is prepared to the same.
    Bytes scene = {0}, again = {0};
    Warnings warnings = {NULL, 0};
    document_scene(&scene, &one);
    intake_result_id(&one, ids[0]);
    inquiry_clear(&one);
    assert_int_equal(intake_prepare(store, scene.at, scene.count, NULL, &two, &warnings, &problem),
                     STATUS_OK);
    document_scene(&again, &two);
    intake_result_id(&two, ids[1]);
    assert_string_equal(scene.at, again.at);
    assert_string_equal(ids[0], ids[1]);
    assert_null(strstr(scene.at, "samples"));
    bytes_clear(&scene);
    bytes_clear(&again);
    warnings_clear(&warnings);
    inquiry_clear(&two);
}

static void a_sweep_pins_the_records_of_its_axes_once_each(void **state) {
    (void)state;
    Inquiry inquiry;
    Bytes uses = {0};
    assert_int_equal(
        prepare("\"name\": \"a\"",
                "{\"kind\": \"sweep\", \"axes\": [{\"pointer\": \"/excitation/name\", \"values\": "
                "[\"b\", \"a\", \"b\"]}]}",
                &inquiry),
        STATUS_OK);
    const SweepStudy *study = (const SweepStudy *)(const void *)inquiry.study;
    assert_int_equal(study->records.count, 2);
    assert_string_equal(study->records.at[0].name, "b");
    assert_string_equal(study->records.at[1].digest, record_in(&inquiry)->digest);
    prepare_record_uses(&inquiry, &uses);
    assert_string_equal(uses.at, "record:a\nrecord:b\nrecord:a\n");
    bytes_clear(&uses);
    inquiry_clear(&inquiry);
}

static void faults_stand_where_the_name_or_the_digest_does(void **state) {
    (void)state;
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
        {"\"name\": \"a\"", "[\"a\"]", ", \"records\": [{\"name\": \"x\"}]",
         "/study/records/0/name", ""},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        char study[512] = "";
        Inquiry inquiry;
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
        inquiry_clear(&inquiry);
    }
}

static void without_a_daemon_there_are_no_records(void **state) {
    (void)state;
    Store *own, *kept = store;
    Inquiry inquiry;
    assert_int_equal(store_open(NULL, &own, &problem), STATUS_OK);
    store = own;
    const Status status = prepare("\"name\": \"a\"", "", &inquiry);
    store = kept;
    assert_int_equal(status, STATUS_INVALID);
    assert_int_equal(problem.count, 1);
    assert_string_equal(problem.faults[0].pointer, "/excitation/name");
    assert_non_null(strstr(problem.faults[0].detail, "impactd import"));
    inquiry_clear(&inquiry);
    store_close(own);
}

static int fill(void **state) {
    if (store_make(state) != 0)
        return 1;
    add("a", 1);
    add("b", 2);
    add("record-1", 3);
    return 0;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(scenes_share_the_samples_of_the_record_they_name),
        cmocka_unit_test(a_sweep_pins_the_records_of_its_axes_once_each),
        cmocka_unit_test(faults_stand_where_the_name_or_the_digest_does),
        cmocka_unit_test(without_a_daemon_there_are_no_records),
    };
    return cmocka_run_group_tests(tests, fill, store_end);
}
