// What the names of materials in a scene become: numbers or tables, rigs, spreads; and that it
// never becomes anything else afterwards.
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/study/sweep.h"
#include "server/jobs/documents.h"
#include "server/jobs/jobs.h"
#include "server/json/parse.h"
#include "server/materials/material.h"
#include "tests/support/test.h"

static Db *db;
static Problem problem;
static StudyRequest inquiry;
static Warnings warnings;

static int set_up(void **state) {
    (void)state;
    problem_clear(&problem);
    return db_open(NULL, &db, &problem) == STATUS_OK ? 0 : -1;
}

static void clear(void) {
    study_request_clear(&inquiry);
    warnings_clear(&warnings);
    problem_clear(&problem);
}

static int tear_down(void **state) {
    (void)state;
    clear();
    db_close(db);
    return 0;
}

// A revision of what `said` says; the first of its slug makes the material.
static void say(const char *slug, const char *said) {
    MaterialRevision revision = {.slug = (char *)slug, .comment = (char *)"measured again"};
    assert_int_equal(json_parse(said, strlen(said), material_fields, &revision.material, &problem),
                     STATUS_OK);
    assert_int_equal(material_validate(&revision.material, "", &problem), STATUS_OK);
    revision.created_unix_ms = 1;
    if (db_material_add(db, &revision, &problem) != STATUS_OK) {
        problem_clear(&problem);
        assert_int_equal(db_material_revise(db, &revision, ANY_VERSION, &problem), STATUS_OK);
    }
    fields_clear(material_fields, &revision.material);
}

static void review(const char *slug, uint64_t revision, const char *status) {
    const MaterialReview given = {.slug = (char *)slug,
                                  .revision = revision,
                                  .status = (char *)status,
                                  .reason = (char *)"the base was loose",
                                  .created_unix_ms = 1};
    assert_int_equal(db_material_review(db, &given, ANY_VERSION, &problem), STATUS_OK);
}

#define SAID(members) "{\"name\": \"Foam\", \"source\": \"our bench\", " members "}"
#define TABLE_MEMBERS                                                                              \
    "\"table\": [{\"approach_speed\": 0.1, \"restitution\": 0.7, \"contact_time\": 0.02, "         \
    "\"restitution_deviation\": 0.07}, {\"approach_speed\": 0.8, \"restitution\": 0.5, "           \
    "\"contact_time\": 0.03, \"restitution_deviation\": 0.1, \"contact_time_deviation\": 0.003}]"

static Status resolve_text(const char *text) {
    clear();
    return jobs_prepare(db, text, strlen(text), NULL, &inquiry, &warnings, &problem);
}

// The paper's scene with these members of its damper, and what else the document has.
static Status prepare(const char *damper, const char *rest) {
    char text[4096];
    snprintf(text, sizeof text,
             "{\"structure\": {\"mass\": 1.35, \"stiffness\": 865, \"damping\": 1.092}, "
             "\"dampers\": [{\"mass\": 0.1107, \"clearance\": 0.015, %s}], \"excitation\": "
             "{\"kind\": \"free\", "
             "\"displacement\": 0.015}, \"duration\": 1, \"sample_rate\": 1000%s}",
             damper, rest);
    return resolve_text(text);
}

static void resolve_well(const char *damper, const char *rest) {
    const Status status = prepare(damper, rest);
    if (status != STATUS_OK)
        fail_msg("%s %s: %s: %s", damper, rest, problem.faults[0].pointer,
                 problem.faults[0].detail);
}

static const char *detail_at(const char *pointer) {
    for (size_t i = 0; i < problem.count && i < PROBLEM_FAULTS; i++)
        if (strcmp(problem.faults[i].pointer, pointer) == 0)
            return problem.faults[i].detail;
    return "(no fault there)";
}

static void expect_fault(const char *pointer, const char *detail) {
    const char *told = detail_at(pointer);
    if (strstr(told, detail) == NULL)
        fail_msg("at %s: \"%s\" instead of \"%s\"", pointer, told, detail);
}

static const Damper *damper(void) {
    return &inquiry.simulation.scene.dampers.at[0];
}

// To be freed.
static char *canonical(void) {
    Bytes bytes = {0};
    document_scene(&bytes, &inquiry);
    return bytes_take(&bytes, NULL);
}

static void expect_member(const char *wanted) {
    char *text = canonical();
    if (strstr(text, wanted) == NULL)
        fail_msg("no %s in %s", wanted, text);
    free(text);
}

// The canonical form read again is itself, under the same id.
static void expect_stable(void) {
    char id[72], again[72];
    char *text = canonical();
    jobs_result_id(&inquiry, id, NULL);
    if (resolve_text(text) != STATUS_OK)
        fail_msg("%s: %s: %s", text, problem.faults[0].pointer, problem.faults[0].detail);
    char *second = canonical();
    jobs_result_id(&inquiry, again, NULL);
    assert_string_equal(text, second);
    assert_string_equal(id, again);
    free(text);
    free(second);
}

TEST_IN(a_table_stands_where_its_material_was_named, set_up, tear_down) {
    say("foam", SAID(TABLE_MEMBERS));
    resolve_well("\"buffer\": \"foam\"", "");
    expect_member("{\"material\": \"foam@1\", \"table\": [{\"approach_speed\": 0.1, "
                  "\"restitution\": 0.7, \"contact_time\": 0.02}, {\"approach_speed\": 0.8, "
                  "\"restitution\": 0.5, \"contact_time\": 0.03}]}");
    expect_stable();
    // What the model does not use is left out, and comes back for another.
    resolve_well("\"buffer\": \"foam@1\"", ", \"contact\": {\"model\": \"impulse\"}");
    expect_member("\"table\": [{\"approach_speed\": 0.1, \"restitution\": 0.7}, "
                  "{\"approach_speed\": 0.8, \"restitution\": 0.5}]");
    expect_stable();
    assert_true(isnan(damper()->buffer.table.at[0].contact_time));
}

TEST_IN(what_stands_beside_a_name_is_what_the_revision_says, set_up, tear_down) {
    static const char row[] =
        "{\"approach_speed\": %g, \"restitution\": %g, \"contact_time\": 0.03}";
    static const struct {
        const char *beside, *pointer, *detail;
    } cases[] = {
        {"\"material\": \"foam@1\", \"restitution\": 0.7", "/dampers/0/buffer/restitution",
         "is 0.7, but foam@1 has none"},
        {"\"material\": \"foam@1\", \"contact_time\": 0.02", "/dampers/0/buffer/contact_time",
         "is 0.02, but foam@1 has none"},
        {"\"material\": \"sponge@1\", \"restitution\": 0.62", "/dampers/0/buffer/restitution",
         "is 0.62, but sponge@1 has 0.61"},
    };
    say("foam", SAID(TABLE_MEMBERS));
    for (size_t i = 0; i < COUNT(cases); i++) {
        char buffer[256];
        snprintf(buffer, sizeof buffer, "\"buffer\": {%s}", cases[i].beside);
        assert_int_equal(prepare(buffer, ""), STATUS_INVALID);
        expect_fault(cases[i].pointer, cases[i].detail);
    }
    char rows[2][128], buffer[512];
    snprintf(rows[0], sizeof rows[0], row, 0.1, 0.7);
    snprintf(rows[1], sizeof rows[1], row, 0.8, 0.55);
    snprintf(buffer, sizeof buffer, "\"buffer\": {\"material\": \"foam\", \"table\": [%s, %s]}",
             rows[0], rows[1]);
    assert_int_equal(prepare(buffer, ""), STATUS_INVALID);
    expect_fault("/dampers/0/buffer/table/0/contact_time", "is 0.03, but foam@1 has 0.02");
    expect_fault("/dampers/0/buffer/table/1/restitution", "is 0.55, but foam@1 has 0.5");
    snprintf(buffer, sizeof buffer, "\"buffer\": {\"material\": \"foam\", \"table\": [%s]}",
             rows[0]);
    assert_int_equal(prepare(buffer, ""), STATUS_INVALID);
    expect_fault("/dampers/0/buffer/table", "is not that of foam@1");
    snprintf(buffer, sizeof buffer, "\"buffer\": {\"material\": \"sponge\", \"table\": [%s, %s]}",
             rows[0], rows[1]);
    assert_int_equal(prepare(buffer, ""), STATUS_INVALID);
    expect_fault("/dampers/0/buffer/table", "must be left out: sponge@1 has no table");
}

TEST_IN(a_name_alone_is_the_approved_head_and_never_a_deprecated_one, set_up, tear_down) {
    say("foam", SAID("\"restitution\": 0.5"));
    resolve_well("\"buffer\": \"foam\"", "");
    assert_string_equal(damper()->buffer.material, "foam@1");
    assert_int_equal(warnings.count, 1);
    assert_string_equal(warnings.at[0].detail, "foam@1 is a draft that has not been approved");
    review("foam", 1, "approved");
    say("foam", SAID("\"restitution\": 0.6"));
    resolve_well("\"buffer\": \"foam\"", "");
    assert_string_equal(damper()->buffer.material, "foam@1");
    assert_int_equal(warnings.count, 0);
    resolve_well("\"buffer\": \"foam@2\"", "");
    assert_true(damper()->buffer.restitution == 0.6);
    assert_int_equal(warnings.count, 1);
    review("foam", 1, "deprecated");
    resolve_well("\"buffer\": \"foam@1\"", "");
    assert_string_equal(warnings.at[0].detail, "foam@1 is deprecated: the base was loose");
    assert_string_equal(warnings.at[0].pointer, "/dampers/0/buffer");
    resolve_well("\"buffer\": \"foam\"", "");
    assert_string_equal(damper()->buffer.material, "foam@2");
    review("foam", 2, "deprecated");
    assert_int_equal(prepare("\"buffer\": \"foam\"", ""), STATUS_INVALID);
    expect_fault("/dampers/0/buffer", "every revision of the material foam is deprecated");
    assert_string_equal(problem.faults[0].did_you_mean, "foam@2");
    assert_int_equal(prepare("\"buffer\": \"foam@3\"", ""), STATUS_INVALID);
    expect_fault("/dampers/0/buffer", "has no such revision; its newest revision is foam@2");
    assert_int_equal(prepare("\"buffer\": \"sponge@9\"", ""), STATUS_INVALID);
    expect_fault("/dampers/0/buffer", "has no such revision; its head is sponge@1");
    static const char *const wrong[] = {"@1", "foam@1234567890", "foam@0", "foam@1x"};
    for (size_t i = 0; i < COUNT(wrong); i++) {
        char buffer[80];
        snprintf(buffer, sizeof buffer, "\"buffer\": \"%s\"", wrong[i]);
        assert_int_equal(prepare(buffer, ""), STATUS_INVALID);
        expect_fault("/dampers/0/buffer", "no material is called");
    }
}

TEST_IN(a_material_that_came_with_a_study_is_looked_up, set_up, tear_down) {
    static const char study[] = ", \"study\": {\"kind\": \"sweep\", \"axes\": [{\"pointer\": "
                                "\"/dampers/0/buffer\", \"values\": [\"sponge\"]}], "
                                "\"materials\": [{\"material\": \"%s\"}]}";
    char text[300];
    snprintf(text, sizeof text, study, "sponge@1");
    resolve_well("\"buffer\": \"sponge\"", text);
    snprintf(text, sizeof text, study, "sponge@9");
    assert_int_equal(prepare("\"buffer\": \"sponge\"", text), STATUS_INVALID);
    expect_fault("/study/materials/0", "has no such revision");
}

// As they were before any material had more than one revision.
TEST_IN(canonical_forms_of_named_revisions_never_change, set_up, tear_down) {
    static const struct {
        const char *damper, *rest, *form;
    } cases[] = {
        {"\"buffer\": \"sponge\"", "",
         "\"buffer\": {\"material\": \"sponge@1\", \"restitution\": 0.61, \"contact_time\": "
         "0.025}, "
         "\"identified_for\": \"scene\"}], \"contact\": {\"model\": \"auto\""},
        {"\"buffer\": \"sponge\"", ", \"contact\": {\"model\": \"impulse\"}",
         "\"buffer\": {\"material\": \"sponge@1\", \"restitution\": 0.61}, "
         "\"identified_for\": \"scene\"}], \"contact\": {\"model\": \"impulse\""},
        {"\"left_buffer\": \"aluminium@1\", \"right_buffer\": \"hard_acrylic\", "
         "\"identified_for\": \"rig\", \"rig\": {\"impactor_mass\": 0.11}",
         "",
         "\"left_buffer\": {\"material\": \"aluminium@1\", \"restitution\": 0.46, "
         "\"contact_time\": 0.0003}, \"right_buffer\": {\"material\": \"hard_acrylic@1\", "
         "\"restitution\": 0.49, \"contact_time\": 0.003}, \"identified_for\": \"rig\", \"rig\": "
         "{\"impactor_mass\": 0.11}}]"},
        {"\"buffer\": \"soft_rubber\"", ", \"contact\": {\"model\": \"flores\"}",
         "\"buffer\": {\"material\": \"soft_rubber@1\", \"restitution\": 0.44, \"contact_time\": "
         "0.019, \"exponent\": 1.5}"},
        {"\"buffer\": \"sponge\"", ", \"study\": {\"kind\": \"sensitivity\"}",
         "\"study\": {\"kind\": \"sensitivity\", \"parameters\": [\"restitution\", "
         "\"contact_time\", \"mass\", \"clearance\"], \"step\": 0.01, \"restitution_deviation\": "
         "0, \"contact_time_deviation\": 0, \"runs\": 0, \"seed\": 1}"},
    };
    char *forms[COUNT(cases)], ids[COUNT(cases)][72];
    for (size_t i = 0; i < COUNT(cases); i++) {
        resolve_well(cases[i].damper, cases[i].rest);
        expect_member(cases[i].form);
        forms[i] = canonical();
        jobs_result_id(&inquiry, ids[i], NULL);
    }
    for (int i = 0; i < 100; i++) {
        say("sponge", SAID("\"restitution\": 0.3, \"restitution_deviation\": 0.1, "
                           "\"contact_time\": 0.1, \"impactor_mass\": 1, \"base\": \"fixed\""));
        if (i % 10 == 0)
            review("sponge", (uint64_t)i + 2, "approved");
    }
    review("sponge", 1, "deprecated");
    for (size_t i = 0; i < COUNT(cases); i++) {
        char id[72];
        assert_int_equal(resolve_text(forms[i]), STATUS_OK);
        char *again = canonical();
        jobs_result_id(&inquiry, id, NULL);
        assert_string_equal(again, forms[i]);
        assert_string_equal(id, ids[i]);
        free(again);
        free(forms[i]);
    }
    resolve_well("\"buffer\": \"sponge\"", "");
    assert_string_equal(damper()->buffer.material, "sponge@92");
}

TEST_IN(points_of_a_sweep_have_the_tables_and_rigs_of_their_materials, set_up, tear_down) {
    say("foam", SAID(TABLE_MEMBERS ", \"impactor_mass\": 0.3, \"base\": \"fixed\""));
    say("rubber", SAID("\"restitution\": 0.5, \"contact_time\": 0.01, \"impactor_mass\": 0.4, "
                       "\"base\": \"fixed\""));
    resolve_well("\"buffer\": \"rubber\", \"identified_for\": \"rig\"",
                 ", \"study\": {\"kind\": \"sweep\", \"axes\": [{\"pointer\": "
                 "\"/dampers/0/buffer\", \"values\": [\"rubber\", \"foam\"]}]}");
    const SweepStudy *sweep = (const SweepStudy *)(const void *)inquiry.study;
    SweepGrid *plan;
    assert_int_equal(sweep_grid_new(sweep, &inquiry.simulation, NULL, &plan, &problem), STATUS_OK);
    Simulation points[2];
    for (size_t i = 0; i < 2; i++)
        assert_int_equal(sweep_grid_scene(plan, i, true, NULL, &points[i], &problem), STATUS_OK);
    assert_true(points[0].scene.dampers.at[0].buffer.contact_time == 0.01);
    assert_true(points[0].scene.dampers.at[0].rig.impactor_mass == 0.4);
    assert_int_equal(points[1].scene.dampers.at[0].buffer.table.count, 2);
    assert_true(points[1].scene.dampers.at[0].buffer.table.at[1].contact_time == 0.03);
    assert_true(points[1].scene.dampers.at[0].rig.impactor_mass == 0.3);
    for (size_t i = 0; i < 2; i++)
        simulation_clear(&points[i]);
    sweep_grid_free(plan);
    Bytes uses = {0};
    references_write(&uses, &inquiry, true);
    assert_string_equal(uses.at, "rubber@1\nfoam@1\n");
    bytes_clear(&uses);
    expect_stable();
}
