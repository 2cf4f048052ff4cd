// Settings from flags, environment, file and defaults.
#include "server/options.h"
#include "tests/support/test.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct Settings {
    double rate;
    uint64_t queue_most;
    char *listen, *config;
    bool quiet;
    int level;
    Texts record;
} Settings;

static const char *const levels[] = {"low", "high", NULL};

// clang-format off
static const Field fields[] = {
    FIELD_REAL(Settings, rate, "Hz", WITHIN(1, 100), 10, "rate"),
    FIELD_COUNT(Settings, queue_most, NULL, WITHIN(1, 1000), 50, "jobs"),
    FIELD_TEXT(Settings, listen, 100, PRESENCE_OPTIONAL, 0, "address"),
    FIELD_TEXT(Settings, config, 200, PRESENCE_OPTIONAL, 0, "file"),
    FIELD_FLAG(Settings, quiet, false, "say less"),
    FIELD_CHOICE(Settings, level, levels, 0, "level"),
    FIELD_TEXTS(Settings, record, NULL, NULL, 3, PRESENCE_OPTIONAL, 0, "paths"),
    FIELD_END,
};
// clang-format on

static Settings settings;
static Options options;
static Problem problem;

static int start(void **state) {
    (void)state;
    problem_clear(&problem);
    return fields_default(fields, &settings) == STATUS_OK ? 0 : -1;
}

static int stop(void **state) {
    (void)state;
    fields_clear(fields, &settings);
    unsetenv("TEST_QUEUE_MOST");
    unsetenv("TEST_CONFIG");
    unsetenv("TEST_RATE");
    unsetenv("TEST_RECORD");
    return 0;
}

#define READ(prefix, ...)                                                                          \
    options_read(fields, &settings, (int)COUNT(((char *[]){__VA_ARGS__})),                         \
                 (char *[]){__VA_ARGS__}, prefix, &options, &problem)

TEST_IN(texts_grow_with_each_flag_and_a_stronger_source_replaces_them, start, stop) {
    setenv("TEST_RECORD", "of the environment", 1);
    assert_int_equal(READ("TEST_", "--record", "a", "-r", "b", "--record=c d"), STATUS_OK);
    assert_int_equal(settings.record.count, 3);
    assert_string_equal(settings.record.at[0], "a");
    assert_string_equal(settings.record.at[1], "b");
    assert_string_equal(settings.record.at[2], "c d");
    char *text = NULL;
    size_t size = 0;
    FILE *file = open_memstream(&text, &size);
    assert_non_null(file);
    options_print(fields, &settings, &options, file);
    fclose(file);
    assert_non_null(strstr(text, "record = a, b, c d  # flag"));
    free(text);
    assert_int_equal(READ("TEST_", "-r", "e", "-r", "f", "-r", "g", "-r=h"), STATUS_USAGE);
    assert_string_equal(problem.faults[0].pointer, "-r");
}

TEST_IN(flags_set_values_and_other_arguments_are_operands, start, stop) {
    assert_int_equal(READ(NULL, "one", "--rate", "2.5", "--queue-most=7", "-la:1", "--queue-most=9",
                          "--quiet", "--level", "high", "-", "--", "--rate"),
                     STATUS_OK);
    assert_true(settings.rate == 2.5);
    assert_int_equal(settings.queue_most, 9);
    assert_string_equal(settings.listen, "a:1");
    assert_true(settings.quiet);
    assert_int_equal(settings.level, 1);
    assert_int_equal(options.operand_count, 3);
    assert_string_equal(options.operands[0], "one");
    assert_string_equal(options.operands[1], "-");
    assert_string_equal(options.operands[2], "--rate");
    assert_int_equal(options.origins[0], OPTION_FLAG);
}

TEST_IN(flags_environment_file_and_defaults_have_precedence_in_this_order, start, stop) {
    char path[] = "/tmp/impactd-options-XXXXXX";
    const int file = mkstemp(path);
    assert_true(file >= 0);
    const char text[] = "# comment\n\nrate = 3 # Hz\nqueue_most=4\n  listen = x:1#2  \n";
    assert_int_equal(write(file, text, strlen(text)), (int)strlen(text));
    close(file);
    setenv("TEST_CONFIG", "/nowhere", 1);
    setenv("TEST_QUEUE_MOST", "5", 1);
    const Status status = READ("TEST_", "--config", path);
    unlink(path);
    assert_int_equal(status, STATUS_OK);
    assert_true(settings.rate == 3);
    assert_int_equal(settings.queue_most, 5);
    assert_string_equal(settings.listen, "x:1#2");
    assert_int_equal(options.origins[0], OPTION_FILE);
    assert_int_equal(options.origins[1], OPTION_ENVIRONMENT);
    assert_int_equal(options.origins[3], OPTION_FLAG);
    assert_int_equal(options.origins[4], OPTION_DEFAULT);
}

TEST_IN(a_file_that_is_not_text_is_refused, start, stop) {
    assert_int_equal(READ("TEST_", "--config", "/tmp"), STATUS_USAGE);
    assert_string_equal(problem.faults[0].pointer, "/tmp");
    problem_clear(&problem);
    assert_int_equal(READ("TEST_", "--config", "/dev/zero"), STATUS_USAGE);
    assert_string_equal(problem.faults[0].pointer, "/dev/zero:1");
    assert_int_equal(problem.count, 1);
}

TEST_IN(a_file_names_no_other_file, start, stop) {
    char path[] = "/tmp/impactd-options-XXXXXX";
    const int file = mkstemp(path);
    assert_true(file >= 0);
    const char text[] = "rate = 3\nconfig = /etc/other\n";
    assert_int_equal(write(file, text, strlen(text)), (int)strlen(text));
    close(file);
    const Status status = READ("TEST_", "--config", path);
    unlink(path);
    assert_int_equal(status, STATUS_USAGE);
    assert_int_equal(problem.count, 1);
    assert_non_null(strstr(problem.faults[0].pointer, ":2"));
    assert_string_equal(settings.config, path);
}

TEST_IN(the_environment_is_not_read_without_a_prefix, start, stop) {
    setenv("TEST_QUEUE_MOST", "none", 1);
    assert_int_equal(READ(NULL, "--rate", "2"), STATUS_OK);
    assert_int_equal(settings.queue_most, 50);
}

TEST_IN(every_fault_is_at_the_name_that_was_used, start, stop) {
    setenv("TEST_RATE", "1000", 1);
    assert_int_equal(
        READ("TEST_", "--queue-most", "-3", "--qiet", "--level=hihg", "--quiet=2", "--listen"),
        STATUS_USAGE);
    static const char *const places[] = {"--queue-most", "--qiet",   "--level",
                                         "--quiet",      "--listen", "TEST_RATE"};
    assert_int_equal(problem.count, COUNT(places));
    for (size_t i = 0; i < COUNT(places); i++)
        assert_string_equal(problem.faults[i].pointer, places[i]);
    assert_string_equal(problem.faults[1].did_you_mean, "--quiet");
    assert_string_equal(problem.faults[2].did_you_mean, "high");
    assert_string_equal(problem.faults[2].detail, "must be one of low, high, is hihg");
    assert_non_null(strstr(problem.faults[5].detail, "100"));
    assert_int_equal(problem.status, STATUS_USAGE);
}

TEST_IN(texts_that_are_not_numbers_are_refused, start, stop) {
    static char *const wrong[][2] = {
        {"--rate", "ten"},       {"--rate", "nan"},
        {"--rate", "5x"},        {"--rate", ""},
        {"--queue-most", "1.5"}, {"--queue-most", "+3"},
        {"--queue-most", "0"},   {"--queue-most", "99999999999999999999"},
        {"--rate", "1e999"},     {"--queue-most", " 3"}};
    for (size_t i = 0; i < COUNT(wrong); i++) {
        problem_clear(&problem);
        assert_int_equal(options_read(fields, &settings, 2, wrong[i], NULL, &options, &problem),
                         STATUS_USAGE);
        assert_int_equal(problem.count, 1);
        assert_string_equal(problem.faults[0].pointer, wrong[i][0]);
    }
}

TEST_IN(printed_settings_can_be_read_as_a_file, start, stop) {
    assert_int_equal(READ(NULL, "--rate", "2.5", "-l", "a:1", "--quiet", "--level", "high"),
                     STATUS_OK);
    char path[] = "/tmp/impactd-options-XXXXXX";
    const int number = mkstemp(path);
    assert_true(number >= 0);
    FILE *file = fdopen(number, "w");
    options_print(fields, &settings, &options, file);
    fclose(file);
    fields_clear(fields, &settings);
    assert_int_equal(fields_default(fields, &settings), STATUS_OK);
    const Status status = READ("TEST_", "--config", path);
    unlink(path);
    assert_int_equal(status, STATUS_OK);
    assert_true(settings.rate == 2.5 && settings.quiet && settings.level == 1);
    assert_string_equal(settings.listen, "a:1");
}

TEST_IN(a_letter_stands_for_one_name_alone, start, stop) {
    char name[OPTION_NAME];
    assert_int_equal(option_spell(&fields[2], name), 'l');
    assert_string_equal(name, "--listen");
    assert_int_equal(option_spell(&fields[1], name), '\0');
    assert_int_equal(READ(NULL, "-o", "-q"), STATUS_USAGE); // no row here; the first of a row
    assert_int_equal(problem.count, 2);
    assert_string_equal(problem.faults[0].pointer, "-o");
}

TEST(help_wraps_at_80_columns) {
    static const char left[] = "  -l, --listen HOST:PORT    ",
                      right[] = "                            ";
    const Field rows[] = {
        {.name = "listen",
         .kind = FIELD_KIND_TEXT,
         .doc = "first words of a text that is much longer than the line that it would need"},
        {.name = "a_name_that_is_long", .kind = FIELD_KIND_REAL, .unit = "s", .doc = "below"},
        FIELD_END};
    char text[500] = "", wanted[500];
    FILE *file = tmpfile();
    assert_non_null(file);
    options_help(rows, NULL, file);
    rewind(file);
    (void)!fread(text, 1, sizeof text - 1, file);
    fclose(file);
    snprintf(wanted, sizeof wanted,
             "%sfirst words of a text that is much longer than the\n%sline that it would need\n"
             "      --a-name-that-is-long X\n%sbelow [s]\n",
             left, right, right);
    assert_string_equal(text, wanted);
}

TEST(help_has_its_headings_above_their_rows) {
    static const OptionGroup groups[] = {{"rate", "Speed"}, {"quiet", "Manner"}, {NULL, NULL}};
    char text[2000] = "";
    FILE *file = tmpfile();
    assert_non_null(file);
    options_help(fields, groups, file);
    rewind(file);
    const size_t size = fread(text, 1, sizeof text - 1, file);
    fclose(file);
    assert_true(size > 0);
    assert_memory_equal(text, "Speed\n      --rate X              rate [Hz]\n", 42);
    assert_non_null(strstr(text, "\n  -r, --record FILE         paths\n"));
    const char *manner = strstr(text, "\nManner\n");
    assert_non_null(manner);
    assert_true(strstr(text, "--config") < manner && strstr(text, "--quiet") > manner);
}
