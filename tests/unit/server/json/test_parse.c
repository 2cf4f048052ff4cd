// What json_parse makes of a document: values, defaults, and every fault at its place.
#include <string.h>

#include "server/json/parse.h"
#include "tests/support/test.h"
#include "tests/support/whole.h"

static Problem problem;
static Whole whole;

static int set_up(void **state) {
    (void)state;
    problem_clear(&problem);
    memset(&whole, 0xA5, sizeof whole);
    return 0;
}

static int tear_down(void **state) {
    (void)state;
    fields_clear(whole_fields, &whole);
    return 0;
}

static Status read(const char *text) {
    return json_parse(text, strlen(text), whole_fields, &whole, &problem);
}

static const Fault *fault_at(const char *pointer) {
    for (size_t i = 0; i < problem.count && i < PROBLEM_FAULTS; i++)
        if (strcmp(problem.faults[i].pointer, pointer) == 0)
            return &problem.faults[i];
    for (size_t i = 0; i < problem.count && i < PROBLEM_FAULTS; i++)
        print_error("%s: %s\n", problem.faults[i].pointer, problem.faults[i].detail);
    fail_msg("no fault at \"%s\"", pointer);
    return NULL;
}

// Reads a document with one fault and looks at it.
static void check_fault(const char *text, const char *pointer, const char *value,
                        const char *detail) {
    problem_clear(&problem);
    assert_int_equal(read(text), STATUS_INVALID);
    const Fault *fault = fault_at(pointer);
    assert_string_equal(fault->detail, detail);
    assert_string_equal(fault->value, value);
    assert_int_equal(problem.count, 1);
    assert_int_equal(problem.status, STATUS_INVALID);
    fields_clear(whole_fields, &whole);
}

static void check_unreadable(const char *text, const char *pointer, const char *detail) {
    problem_clear(&problem);
    assert_int_equal(read(text), STATUS_UNREADABLE);
    const Fault *fault = fault_at(pointer);
    if (strncmp(fault->detail, detail, strlen(detail)) != 0)
        fail_msg("%s: %s", text, fault->detail);
    assert_int_equal(problem.count, 1);
    fields_clear(whole_fields, &whole);
}

TEST_IN(every_kind_of_row_is_read, set_up, tear_down) {
    assert_int_equal(
        read("{\"offset\": -0.5, \"mass\": 2, \"slope\": -1.5e-3, \"steps\": 1e3, \"storey\": "
             "4096.0,"
             " \"is_open\": false, \"title\": \"\\u00fc\", \"rule\": \"zero_force\","
             " \"samples\": [1, -2.5, -0.0, 1e-300], \"channels\": [\"acceleration\"],"
             " \"labels\": [\"a\", \"b\"], \"left\": {\"stiffness\": 1650}, \"right\": \"sponge\","
             " \"extra\": {\"names\": []}, \"parts\": [{}, {\"material\": \"rubber\"}],"
             " \"shape\": {\"offset\": 1, \"shape\": \"square\", \"sides\": [3, 4]},"
             " \"spare\": {\"radius\": 1}}"),
        STATUS_OK);
    assert_int_equal(problem.count, 0);
    assert_true(whole.common.offset == -0.5);
    assert_true(whole.mass == 2);
    assert_true(whole.slope == -1.5e-3);
    assert_int_equal(whole.steps, 1000);
    assert_int_equal(whole.storey, 4096);
    assert_false(whole.is_open);
    assert_string_equal(whole.title, "\xC3\xBC");
    assert_int_equal(whole.rule, 1);
    assert_int_equal(whole.samples.count, 4);
    assert_true(whole.samples.at[1] == -2.5 && whole.samples.at[3] == 1e-300);
    assert_false(signbit(whole.samples.at[2]));
    assert_int_equal(whole.channels.count, 1);
    assert_string_equal(whole.channels.at[0], "acceleration");
    assert_int_equal(whole.labels.count, 2);
    assert_true(whole.left.stiffness == 1650);
    assert_true(whole.left.damping == 0.5);
    assert_null(whole.left.material);
    assert_string_equal(whole.right.material, "sponge");
    assert_true(isnan(whole.right.stiffness));
    assert_int_equal(whole.extra.names.count, 0);
    assert_int_equal(whole.extra.rule, 1);
    assert_int_equal(whole.parts.count, 2);
    assert_true(whole.parts.at[0].damping == 0.5);
    assert_string_equal(whole.parts.at[1].material, "rubber");
    assert_ptr_equal(whole.shape->kind, &shape_square);
    const Square *square = (const Square *)(const void *)whole.shape;
    assert_true(square->common.offset == 1);
    assert_true(square->sides.count == 2 && square->sides.at[1] == 4);
    assert_ptr_equal(whole.spare->kind, &shape_round);
}

TEST_IN(what_is_not_given_has_its_default, set_up, tear_down) {
    assert_int_equal(read("{}"), STATUS_OK);
    assert_true(whole.common.offset == 0.25);
    assert_true(isnan(whole.mass));
    assert_int_equal(whole.steps, 7);
    assert_true(whole.is_open);
    assert_int_equal(whole.channels.count, 2);
    assert_string_equal(whole.extra.names.at[0], "one");
    assert_ptr_equal(whole.shape->kind, &shape_round);
    assert_null(whole.spare);
    assert_int_equal(problem.count, 0);
}

TEST_IN(null_empties_what_allows_it, set_up, tear_down) {
    assert_int_equal(read("{\"extra\": null}"), STATUS_OK);
    assert_int_equal(whole.extra.names.count, 0);
    assert_int_equal(whole.extra.rule, CHOICE_ABSENT);
}

typedef struct Steps {
    Reals values;
    double from;
} Steps;
typedef struct Stairs {
    Steps steps;
} Stairs;

TEST(a_list_of_numbers_may_stand_for_an_item) {
    static const Field steps_fields[] = {
        FIELD_REALS(Steps, values, "m", ANY, 3, PRESENCE_OPTIONAL, "heights"),
        FIELD_REAL(Steps, from, "m", ANY, OPTIONAL, "the first"), FIELD_END};
    static const Field stairs_fields[] = {
        FIELD_ITEM(Stairs, steps, steps_fields, "values", PRESENCE_REQUIRED, "steps"), FIELD_END};
    static const struct {
        const char *text, *fault;
    } cases[] = {{"{\"steps\": [1, 2]}", NULL},
                 {"{\"steps\": {\"values\": [1, 2]}}", NULL},
                 {"{\"steps\": {\"from\": 1}}", NULL},
                 {"{\"steps\": 1}", "must be an object or an array of numbers, is a number"},
                 {"{\"steps\": [1, 2, 3, 4]}", "must have at most 3 numbers, has 4"}};
    for (size_t i = 0; i < COUNT(cases); i++) {
        Stairs stairs;
        problem_clear(&problem);
        const Status status =
            json_parse(cases[i].text, strlen(cases[i].text), stairs_fields, &stairs, &problem);
        assert_int_equal(status, cases[i].fault == NULL ? STATUS_OK : STATUS_INVALID);
        assert_int_equal(stairs.steps.values.count, i < 2 ? 2 : 0);
        if (cases[i].fault != NULL)
            assert_string_equal(problem.faults[0].detail, cases[i].fault);
        fields_clear(stairs_fields, &stairs);
    }
}

TEST_IN(labels_may_be_pairs, set_up, tear_down) {
    assert_int_equal(read("{\"labels\": {\"project\": \"rig\", \"x\": \"\"}}"), STATUS_OK);
    assert_int_equal(whole.labels.count, 2);
    assert_string_equal(whole.labels.at[0], "project=rig");
    assert_string_equal(whole.labels.at[1], "x=");
    fields_clear(whole_fields, &whole);
    check_fault("{\"labels\": {\"a/b\": 1}}", "/labels/a~1b", "1", "must be a string, is a number");
    check_fault("{\"channels\": {\"a\": \"b\"}}", "/channels", "",
                "must be an array of strings, is an object");
}

TEST_IN(wrong_types_are_told_at_every_row, set_up, tear_down) {
    check_fault("{\"offset\": \"1 s\"}", "/offset", "\"1 s\"", "must be a number [m], is a string");
    check_fault("{\"offset\": \"1 mm\"}", "/offset", "\"1 mm\"",
                "must be a number [m], is a string: write 0.001");
    check_fault("{\"mass\": null}", "/mass", "null", "must be a number [kg], is null");
    check_fault("{\"mass\": [1]}", "/mass", "", "must be a number [kg], is an array");
    check_fault("{\"slope\": true}", "/slope", "true", "must be a number, is true");
    check_fault("{\"steps\": {}}", "/steps", "", "must be a whole number [steps], is an object");
    check_fault("{\"is_open\": 1}", "/is_open", "1", "must be true or false, is a number");
    check_fault("{\"title\": 1.5}", "/title", "1.5", "must be a string, is a number");
    check_fault("{\"rule\": false}", "/rule", "false", "must be a string, is false");
    check_fault("{\"samples\": 3}", "/samples", "3",
                "must be an array of numbers [m/s^2], is a number");
    check_fault("{\"samples\": [1, 2, \"x\"]}", "/samples/2", "\"x\"",
                "must be a number [m/s^2], is a string");
    check_fault("{\"channels\": \"velocity\"}", "/channels", "\"velocity\"",
                "must be an array of strings, is a string");
    check_fault("{\"channels\": [\"velocity\", 5]}", "/channels/1", "5",
                "must be a string, is a number");
    check_fault("{\"left\": 5}", "/left", "5", "must be an object or a string, is a number");
    check_fault("{\"left\": null}", "/left", "null", "must be an object or a string, is null");
    check_fault("{\"extra\": \"x\"}", "/extra", "\"x\"", "must be an object or null, is a string");
    check_fault("{\"parts\": {}}", "/parts", "", "must be an array of objects, is an object");
    check_fault("{\"parts\": [{}, \"sponge\"]}", "/parts/1", "\"sponge\"",
                "must be an object, is a string");
    check_fault("{\"shape\": \"round\"}", "/shape", "\"round\"", "must be an object, is a string");
    check_fault("{\"shape\": {\"shape\": 1}}", "/shape/shape", "1",
                "must be a string, is a number");
    check_fault("{\"parts\": [{}, {\"damping\": \"\"}]}", "/parts/1/damping", "\"\"",
                "must be a number [N s/m], is a string");
}

TEST_IN(unknown_names_come_with_the_nearest, set_up, tear_down) {
    check_fault("{\"rule\": \"zero_forse\"}", "/rule", "\"zero_forse\"",
                "must be one of zero_penetration, zero_force, is \"zero_forse\"");
    check_fault("{\"shape\": {\"shape\": \"sqare\", \"sides\": [1], \"nonsense\": 1}}",
                "/shape/shape", "\"sqare\"", "must be one of round, square, is \"sqare\"");
    check_fault("{\"shape\": {\"shape\": \"xyz\", \"whatever\": 1}}", "/shape/shape", "\"xyz\"",
                "must be one of round, square, is \"xyz\"");
    check_fault("{\"mas\": 1}", "/mas", "1", "unknown key");
    check_fault("{\"shape\": {\"sides\": [1]}}", "/shape/sides", "",
                "unknown key of shape round; it belongs to shape square");
    static const struct {
        const char *text, *pointer, *meant;
    } cases[] = {
        {"{\"rule\": \"zero_forse\"}", "/rule", "zero_force"},
        {"{\"shape\": {\"shape\": \"sqare\"}}", "/shape/shape", "square"},
        {"{\"shape\": {\"shape\": \"xyz\"}}", "/shape/shape", ""},
        {"{\"mas\": 1}", "/mas", "mass"},
        {"{\"ofset\": 1}", "/ofset", "offset"},
        {"{\"parts\": [{\"stifness\": 1}]}", "/parts/0/stifness", "stiffness"},
        {"{\"shape\": {\"shap\": \"square\"}}", "/shape/shap", "shape"},
        {"{\"shape\": {\"radus\": 1}}", "/shape/radus", "radius"},
        {"{\"shape\": {\"shape\": \"square\", \"radus\": 1}}", "/shape/radus", ""},
        {"{\"shape\": {\"shape\": \"square\", \"radius\": 1}}", "/shape/radius", ""},
        {"{\"~/\\\"\": 1}", "/~0~1\"", ""},
        {"{\"\": 1}", "/", ""},
    };
    for (size_t i = 0; i < COUNT(cases); i++) {
        problem_clear(&problem);
        assert_int_equal(read(cases[i].text), STATUS_INVALID);
        assert_string_equal(fault_at(cases[i].pointer)->did_you_mean, cases[i].meant);
        assert_int_equal(problem.count, 1);
        fields_clear(whole_fields, &whole);
    }
}

TEST_IN(members_of_a_misspelt_kind_are_not_said_to_be_missing, set_up, tear_down) {
    assert_int_equal(read("{\"mass\": 1, \"shape\": {\"shape\": \"runnd\", \"radius\": 1}}"),
                     STATUS_INVALID);
    assert_int_equal(fields_validate(whole_fields, &whole, "", &problem), STATUS_OK);
    assert_int_equal(problem.count, 1);
}

TEST_IN(what_is_not_json_has_line_column_and_pointer, set_up, tear_down) {
    check_unreadable("", "", "line 1, column 1: ");
    check_unreadable(" ", "", "line 1, column");
    check_unreadable("[] 1", "", "line 1, column 4: the document is complete");
    check_unreadable("nul", "", "line 1, column 3: invalid token near 'nul'");
    check_unreadable("{\"mass\": 1", "/mass",
                     "line 1, column 10: the document ends before it is complete");
    check_unreadable("{\"left\": {\n  \"stiffness\": NaN}}", "/left/stiffness",
                     "line 2, column 18: invalid token near 'NaN'; a number is like 0.5");
    check_unreadable("{\"mass\": 1e400}", "/mass", "line 1, column 14: the number is too large");
    check_unreadable("{\"parts\": [{}, {\"damping\": 123456789012345678901}]}", "/parts/1/damping",
                     "line 1, column 48: the number is too large");
    check_unreadable("{\"mass\": 1, \"mass\": 2}", "/mass",
                     "line 1, column 18: the key occurs twice in its object");
    check_unreadable("{\"parts\": [{}, {}, {\"a\": 1, \"\\u0061\": 2}]}", "/parts/2/a",
                     "line 1, column 36: the key occurs twice");
    check_unreadable("{\"title\": \"\xC3\xBC\xFF\"}", "/title",
                     "line 1, column 13: the text is not UTF-8");
    check_unreadable("{\"title\": \"a\\u0000\"}", "/title", "line 1, column");
    check_unreadable("{\"title\": 1} x", "", "line 1, column 14: the document is complete");
    check_unreadable("{\"samples\": [1, 2, 0x3]}", "/samples/2", "line 1, column");
    check_unreadable("{\"mass\": 1,}", "", "line 1, column 12: string or '}' expected");
    const char nul[] = "{\"mass\":\0 1}";
    assert_int_equal(json_parse(nul, sizeof nul - 1, whole_fields, &whole, &problem),
                     STATUS_UNREADABLE);
}

TEST_IN(a_byte_order_mark_at_the_beginning_is_passed_over, set_up, tear_down) {
    check_fault("\xEF\xBB\xBF{\"mass\": \"x\"}", "/mass", "\"x\"",
                "must be a number [kg], is a string");
    check_unreadable("\xEF\xBB\xBF{\n  \"mass\": 1,}", "",
                     "line 2, column 13: string or '}' expected");
    check_unreadable("\xEF\xBB\xBF{\"mass\": 1,}", "", "line 1, column 12: string or '}' expected");
    check_unreadable("\xEF\xBB\xBF", "", "line 1, column 1: ");
    check_unreadable("\xEF\xBB\xBF\xEF\xBB\xBF{}", "", "line 1, column ");
    check_unreadable(" \xEF\xBB\xBF{}", "", "line 1, column ");
}

TEST_IN(the_problem_may_be_null, set_up, tear_down) {
    const char *text = "{\"mass\": \"x\", \"y\": 1}";
    assert_int_equal(json_parse(text, strlen(text), whole_fields, &whole, NULL), STATUS_INVALID);
    fields_clear(whole_fields, &whole);
    assert_int_equal(json_parse("{", 1, whole_fields, &whole, NULL), STATUS_UNREADABLE);
}
