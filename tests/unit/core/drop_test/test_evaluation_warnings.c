// Tests that are taken in once more: told where they count, and where nothing tells them apart.
#include "core/drop_test/evaluation.h"

#include <string.h>

#include "tests/support/drops.h"
#include "tests/support/test.h"

#define READING "{\"approach_speed\": 0.3, \"rebound_speed\": 0.1, \"contact_time\": 0.02"
#define TEST_JSON(more) "{\"gravity\": 0, " more "\"drops\": [" READING "}]}"

enum { TESTS = 3 };
static Problem problem;

// Where one is told to be there once more; "": none is.
static void told_at(const char *const texts[TESTS], char pointer[32]) {
    DropTest tests[TESTS];
    Measurement taken[TESTS];
    Evaluation evaluation;
    pointer[0] = '\0';
    for (size_t i = 0; i < TESTS; i++) {
        assert_int_equal(drops_read(texts[i], &tests[i], &problem), STATUS_OK);
        taken[i] = (Measurement){i + 4, &tests[i]};
    }
    assert_int_equal(
        evaluation_run(taken, TESTS, SEPARATION_ZERO_PENETRATION, NULL, &evaluation, &problem),
        STATUS_OK);
    for (size_t i = 0; i < evaluation.warnings.count; i++)
        if (strstr(evaluation.warnings.at[i].detail, "measurement 4 once more") != NULL)
            strcpy(pointer, evaluation.warnings.at[i].pointer);
    evaluation_clear(&evaluation);
    for (size_t i = 0; i < TESTS; i++)
        fields_clear(drop_test_fields, &tests[i]);
}

TEST(a_test_that_counts_twice_is_told) {
    static const struct {
        const char *texts[TESTS], *place;
    } cases[] = {
        {{TEST_JSON(""), TEST_JSON("\"date\": \"2026-11-20\", "), TEST_JSON("")},
         "/measurements/6"},
        {{TEST_JSON(""), TEST_JSON("\"temperature\": 20, "), TEST_JSON("\"notes\": \"again\", ")},
         ""},
        {{TEST_JSON(""), "{\"gravity\": 0, \"drops\": [" READING ", \"excluded\": \"slipped\"}]}",
          TEST_JSON("\"person\": \"anna\", ")},
         ""},
        {{"{\"gravity\": 0, \"drops\": [" READING ", \"excluded\": \"slipped\"}]}", TEST_JSON(""),
          "{\"gravity\": 0, \"drops\": [" READING ", \"excluded\": \"slipped\"}]}"},
         ""},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        char pointer[32];
        told_at(cases[i].texts, pointer);
        assert_string_equal(pointer, cases[i].place);
    }
}
