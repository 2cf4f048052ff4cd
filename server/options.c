// The sources are read from the strongest to the weakest, which names the next: --config names the
// file. Each gives the text of a value and the name that was used to option_set, which ignores it
// if a stronger source has set the row.
#include "server/options.h"

#include <ctype.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/spelling.h"

enum { NAME_SIZE = OPTION_NAME, LINE_SIZE = 4096, HELP_WIDTH = 80, HELP_INDENT = 28 };

// Names with the same letter and the same kind of value in every command. All others are long only,
// and their value is named after their kind.
static const struct {
    const char *name;
    char letter;         // '\0': none
    const char *operand; // NULL: by its kind
} option_words[] = {
    {"output", 'o', "FILE"},      {"json", 'j', NULL},           {"server", 's', "URL"},
    {"data", 'd', "DIR"},         {"listen", 'l', "HOST:PORT"},  {"wait", 'w', NULL},
    {"dry_run", 'n', NULL},       {"record", 'r', "FILE"},       {"config", 'c', "FILE"},
    {"set", '\0', "PATH=VALUE"},  {"vary", '\0', "PATH=VALUES"}, {"label", '\0', "KEY=VALUE"},
    {"token_file", '\0', "FILE"}, {"ca_file", '\0', "FILE"},     {"tls_cert", '\0', "FILE"},
    {"tls_key", '\0', "FILE"},    {"trace", '\0', "FILE"},       {"base_url", '\0', "URL"},
};

// The destination of one options_read.
typedef struct OptionReader {
    const Field *fields;
    void *item;
    Options *options;
    Problem *problem;
} OptionReader;

// The name "max_body" as "--max-body" or, with another prefix, "IMPACTD_MAX_BODY".
static void name_spell(char target[NAME_SIZE], const char *prefix, const char *name) {
    const bool is_flag = strcmp(prefix, "--") == 0;
    size_t at = 0;
    for (; *prefix != '\0' && at + 1 < NAME_SIZE; prefix++)
        target[at++] = *prefix;
    for (const char *c = name; *c != '\0' && at + 1 < NAME_SIZE; c++)
        target[at++] = is_flag ? (*c == '_' ? '-' : *c) : (char)toupper((unsigned char)*c);
    target[at] = '\0';
}

static const Field *row_find(const Field *fields, const char *name) {
    for (const Field *row = fields; row->kind != FIELD_KIND_END; row++)
        if (strcmp(row->name, name) == 0)
            return row;
    return NULL;
}

static void option_fault(const OptionReader *reader, const char *typed, const char *value,
                         const Field *row, const char *wanted) {
    Fault fault = {0};
    text_fit(fault.pointer, sizeof fault.pointer, typed);
    text_fit(fault.value, sizeof fault.value, value);
    text_fit(fault.unit, sizeof fault.unit, row->unit != NULL ? row->unit : "");
    const char *near =
        row->kind == FIELD_KIND_CHOICE ? spelling_nearest(row->choices, value) : NULL;
    text_fit(fault.did_you_mean, sizeof fault.did_you_mean, near != NULL ? near : "");
    snprintf(fault.detail, sizeof fault.detail, "must be %s, is %.100s", wanted, value);
    (void)problem_add_fault(reader->problem, STATUS_USAGE, &fault);
}

static void option_no_memory(const OptionReader *reader) {
    (void)problem_add(reader->problem, STATUS_NO_MEMORY, "", "no memory for the options");
}

// Checks the new value against its row; a fault is at the name that was used.
static void option_check(const OptionReader *reader, const char *typed, const Field *row) {
    const Field rows[] = {*row, FIELD_END};
    Problem *problem = reader->problem;
    const size_t before = problem->count;
    const Status status = problem->status;
    if (fields_validate(rows, reader->item, "", problem) == STATUS_OK)
        return;
    for (size_t i = before; i < problem->count && i < PROBLEM_FAULTS; i++)
        text_fit(problem->faults[i].pointer, sizeof problem->faults[i].pointer, typed);
    problem->status = status != STATUS_OK ? status : STATUS_USAGE;
}

// Reads a value into a member that owns nothing. False, with what is wanted.
static bool option_parse(const Field *row, const char *value, void *member, char wanted[200]) {
    char names[160] = "", *end = NULL;
    int index = 0;
    errno = 0;
    if (row->kind == FIELD_KIND_REAL) {
        const double number = strtod(value, &end);
        snprintf(wanted, 200, "a number");
        *(double *)member = number;
        return end != value && *end == '\0' && isfinite(number);
    }
    if (row->kind == FIELD_KIND_COUNT) {
        const unsigned long long number = strtoull(value, &end, 10);
        snprintf(wanted, 200, "a whole number of at least 0");
        *(uint64_t *)member = number;
        return isdigit((unsigned char)value[0]) && *end == '\0' && errno == 0 &&
               number != COUNT_ABSENT;
    }
    if (row->kind == FIELD_KIND_FLAG) {
        const bool is_on = strcmp(value, "true") == 0 || strcmp(value, "1") == 0;
        snprintf(wanted, 200, "true or false");
        *(bool *)member = is_on;
        return is_on || strcmp(value, "false") == 0 || strcmp(value, "0") == 0;
    }
    while (row->choices[index] != NULL && strcmp(row->choices[index], value) != 0)
        text_list(names, sizeof names, row->choices[index++]);
    snprintf(wanted, 200, "one of %s", names);
    *(int *)member = index;
    return row->choices[index] != NULL;
}

static void option_set(const OptionReader *reader, const Field *row, const char *typed,
                       const char *value, OptionOrigin origin) {
    void *member = (char *)reader->item + row->offset;
    OptionOrigin *set = &reader->options->origins[row - reader->fields];
    char wanted[200], *copy = NULL;
    if (*set > origin)
        return;
    const bool is_first = *set != origin;
    *set = origin;
    if (row->kind == FIELD_KIND_TEXTS) {
        if (is_first)
            texts_clear(member);
        if (texts_append(member, value) != STATUS_OK)
            option_no_memory(reader);
    } else if (row->kind == FIELD_KIND_TEXT) {
        // A file that would not be written; of other options the last one holds.
        if (!is_first && origin == OPTION_FLAG && strcmp(row->name, "output") == 0)
            (void)problem_add(reader->problem, STATUS_USAGE, typed,
                              "can be given once: this command writes one file");
        if ((copy = strdup(value)) == NULL) {
            option_no_memory(reader);
            return;
        }
        free(*(char **)member);
        *(char **)member = copy;
    } else if (!option_parse(row, value, member, wanted)) {
        option_fault(reader, typed, value, row, wanted);
        return;
    }
    option_check(reader, typed, row);
}

static void option_unknown(const OptionReader *reader, const char *typed, const char *name,
                           bool is_flag) {
    Fault fault = {0};
    char spelt[NAME_SIZE] = "";
    const char *near = spelling_nearest_field(reader->fields, name);
    text_fit(fault.pointer, sizeof fault.pointer, typed);
    text_fit(fault.detail, sizeof fault.detail, is_flag ? "is not an option" : "is not a setting");
    if (near != NULL && is_flag)
        name_spell(spelt, "--", near);
    text_fit(fault.did_you_mean, sizeof fault.did_you_mean,
             spelt[0] != '\0' ? spelt
             : near != NULL   ? near
                              : "");
    (void)problem_add_fault(reader->problem, STATUS_USAGE, &fault);
}

// The place of a name in the table of words, or of a letter if `name` is NULL; COUNT(option_words)
// if it is not there.
static size_t option_word(const char *name, char letter) {
    size_t i = 0;
    while (i < COUNT(option_words) && (name != NULL ? strcmp(option_words[i].name, name) != 0
                                                    : option_words[i].letter != letter))
        i++;
    return i;
}

// The row of a flag, and in *value what follows its "=".
static const Field *flag_row(const OptionReader *reader, const char *flag, char name[NAME_SIZE],
                             const char **value) {
    const char *equals = strchr(flag, '=');
    if (flag[1] != '-') {
        const size_t word = option_word(NULL, flag[1]);
        *value = flag[2] == '\0' ? NULL : flag[2] == '=' ? flag + 3 : flag + 2;
        snprintf(name, NAME_SIZE, "%c", flag[1]);
        return word < COUNT(option_words) ? row_find(reader->fields, option_words[word].name)
                                          : NULL;
    }
    *value = equals == NULL ? NULL : equals + 1;
    snprintf(name, NAME_SIZE, "%.*s", (int)strcspn(flag + 2, "="), flag + 2);
    for (char *c = name; *c != '\0'; c++)
        *c = *c == '-' ? '_' : *c;
    return row_find(reader->fields, name);
}

static void flags_read(const OptionReader *reader, int argc, char *const *argv) {
    Options *options = reader->options;
    bool is_ended = false;
    for (int i = 0; i < argc; i++) {
        const char *word = argv[i], *value;
        char name[NAME_SIZE], typed[NAME_SIZE];
        if (!is_ended && strcmp(word, "--") == 0) {
            is_ended = true;
            continue;
        }
        if (is_ended || word[0] != '-' || word[1] == '\0') {
            if (options->operand_count < OPTIONS_OPERANDS)
                options->operands[options->operand_count] = word;
            options->operand_count++;
            continue;
        }
        const Field *row = flag_row(reader, word, name, &value);
        snprintf(typed, sizeof typed, "%.*s", (int)strcspn(word, "="), word);
        if (row == NULL) {
            option_unknown(reader, typed, name, true);
            continue;
        }
        if (value == NULL && row->kind == FIELD_KIND_FLAG)
            value = "true";
        else if (value == NULL && i + 1 < argc)
            value = argv[++i];
        if (value == NULL)
            (void)problem_add(reader->problem, STATUS_USAGE, typed, "needs a value");
        else
            option_set(reader, row, typed, value, OPTION_FLAG);
    }
}

static void environment_read(const OptionReader *reader, const char *prefix) {
    char typed[NAME_SIZE];
    for (const Field *row = reader->fields; row->kind != FIELD_KIND_END; row++) {
        name_spell(typed, prefix, row->name);
        const char *value = getenv(typed);
        if (value != NULL)
            option_set(reader, row, typed, value, OPTION_ENVIRONMENT);
    }
}

static char *text_trim(char *text) {
    while (isspace((unsigned char)*text))
        text++;
    size_t length = strlen(text);
    while (length > 0 && isspace((unsigned char)text[length - 1]))
        text[--length] = '\0';
    return text;
}

// A line "name = value"; "#" begins a comment at the start of the line or after a space.
static void line_read(const OptionReader *reader, const char *typed, char *line) {
    for (char *c = line; *c != '\0'; c++)
        if (*c == '#' && (c == line || isspace((unsigned char)c[-1]))) {
            *c = '\0';
            break;
        }
    char *name = text_trim(line), *equals = strchr(name, '=');
    if (*name == '\0')
        return;
    if (equals == NULL) {
        (void)problem_add(reader->problem, STATUS_USAGE, typed, "must read: name = value");
        return;
    }
    *equals = '\0';
    name = text_trim(name);
    const Field *row = row_find(reader->fields, name);
    if (row == NULL)
        option_unknown(reader, typed, name, false);
    else if (strcmp(name, "config") == 0)
        (void)problem_add(reader->problem, STATUS_USAGE, typed,
                          "config cannot be set in a file of settings; set it by a flag or in the "
                          "environment");
    else
        option_set(reader, row, typed, text_trim(equals + 1), OPTION_FILE);
}

static void file_read(const OptionReader *reader, const char *path) {
    FILE *file = fopen(path, "r");
    char line[LINE_SIZE], typed[NAME_SIZE];
    bool is_text = true;
    errno = file != NULL ? 0 : errno;
    for (size_t number = 1; file != NULL && is_text && fgets(line, sizeof line, file) != NULL;
         number++) {
        snprintf(typed, sizeof typed, "%.64s:%zu", path, number);
        is_text = strchr(line, '\n') != NULL || feof(file);
        if (is_text)
            line_read(reader, typed, line);
        else
            (void)problem_add(reader->problem, STATUS_USAGE, typed,
                              "must be a line of text of at most %d bytes", LINE_SIZE - 2);
    }
    if (file == NULL || ferror(file))
        (void)problem_add(reader->problem, STATUS_USAGE, path, "cannot be read: %s",
                          strerror(errno));
    if (file != NULL)
        fclose(file);
}

Status options_read(const Field *fields, void *item, int argc, char *const *argv,
                    const char *prefix, Options *options, Problem *problem) {
    const OptionReader reader = {fields, item, options, problem};
    const size_t before = problem->count;
    size_t rows = 0;
    *options = (Options){0};
    while (fields[rows].kind != FIELD_KIND_END)
        rows++;
    if (rows > OPTIONS_ROWS)
        return problem_set(problem, STATUS_INTERNAL, "%zu settings, more than %d", rows,
                           OPTIONS_ROWS);
    flags_read(&reader, argc, argv);
    if (prefix != NULL) {
        environment_read(&reader, prefix);
        const Field *config = row_find(fields, "config");
        const char *path = NULL;
        if (config != NULL)
            path = *(char *const *)(const void *)((const char *)item + config->offset);
        if (path != NULL)
            file_read(&reader, path);
    }
    return problem->count > before ? problem->status : STATUS_OK;
}

char option_spell(const Field *row, char name[OPTION_NAME]) {
    const size_t word = option_word(row->name, '\0');
    name_spell(name, "--", row->name);
    return word < COUNT(option_words) ? option_words[word].letter : '\0';
}

const char *option_operand(const Field *row) {
    const size_t word = option_word(row->name, '\0');
    if (row->kind == FIELD_KIND_FLAG)
        return NULL;
    if (word < COUNT(option_words) && option_words[word].operand != NULL)
        return option_words[word].operand;
    return row->kind == FIELD_KIND_REAL     ? "X"
           : row->kind == FIELD_KIND_COUNT  ? "N"
           : row->kind == FIELD_KIND_CHOICE ? "NAME"
                                            : "TEXT";
}

void option_value(const Field *row, const void *item, Bytes *text) {
    const void *at = (const char *)item + row->offset;
    if (row->kind == FIELD_KIND_REAL)
        bytes_text(text, real_text(*(const double *)at).at);
    else if (row->kind == FIELD_KIND_COUNT)
        bytes_format(text, "%llu", (unsigned long long)*(const uint64_t *)at);
    else if (row->kind == FIELD_KIND_FLAG)
        bytes_text(text, json_flag(*(const bool *)at));
    else if (row->kind == FIELD_KIND_CHOICE)
        bytes_text(text, row->choices[*(const int *)at]);
    else if (row->kind == FIELD_KIND_TEXTS)
        for (size_t i = 0; i < ((const Texts *)at)->count; i++)
            bytes_format(text, "%s%s", i > 0 ? ", " : "", ((const Texts *)at)->at[i]);
    else
        bytes_text(text, *(char *const *)at);
}

void options_print(const Field *fields, const void *item, const Options *options, FILE *file) {
    static const char *const origins[] = {"default", "file", "environment", "flag"};
    for (const Field *row = fields; row->kind != FIELD_KIND_END; row++) {
        const bool is_set = row->kind == FIELD_KIND_FLAG || !field_is_absent(row, item);
        Bytes value = {0};
        if (is_set)
            option_value(row, item, &value);
        // "config" and "print_config" are not settings of a file.
        fprintf(file, "%s%s = %s  # %s\n",
                is_set && strstr(row->name, "config") == NULL ? "" : "# ", row->name,
                value.at != NULL ? value.at : "", origins[options->origins[row - fields]]);
        bytes_clear(&value);
    }
}

// Prints a text in lines that begin at HELP_INDENT; the cursor is at column `at`.
static void help_wrap(const char *text, size_t at, FILE *file) {
    for (const char *word = text; *word != '\0'; word += strspn(word, " ")) {
        const size_t size = strcspn(word, " ");
        const bool is_first = word == text;
        if (is_first ? at + 2 > HELP_INDENT : at + 1 + size > HELP_WIDTH) {
            fputc('\n', file);
            at = 0;
        }
        const size_t gap = at < HELP_INDENT ? HELP_INDENT - at : 1;
        fprintf(file, "%*s%.*s", (int)gap, "", (int)size, word);
        at += gap + size;
        word += size;
    }
    fputc('\n', file);
}

void options_help(const Field *fields, const OptionGroup *groups, FILE *file) {
    for (const Field *row = fields; row->kind != FIELD_KIND_END; row++) {
        char spelt[OPTION_NAME], letter[8] = "    ";
        const char *operand = option_operand(row), *unit = row->unit;
        Bytes doc = {0};
        for (const OptionGroup *group = groups; group != NULL && group->first != NULL; group++)
            if (strcmp(group->first, row->name) == 0)
                fprintf(file, "%s%s\n", row == fields ? "" : "\n", group->title);
        const char found = option_spell(row, spelt);
        if (found != '\0')
            snprintf(letter, sizeof letter, "-%c, ", found);
        const int at = fprintf(file, "  %s%s%s%s", letter, spelt, operand != NULL ? " " : "",
                               operand != NULL ? operand : "");
        bytes_format(&doc, "%s%s%s%s", row->doc, unit != NULL ? " [" : "", unit != NULL ? unit : "",
                     unit != NULL ? "]" : "");
        help_wrap(doc.at != NULL ? doc.at : row->doc, at > 0 ? (size_t)at : 0, file);
        bytes_clear(&doc);
    }
}
