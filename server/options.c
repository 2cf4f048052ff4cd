// Four sources, one setter: each hands the text of a value and the name it was given under to
// option_set, weakest source first, so that the last one stays.
#include "server/options.h"

#include <ctype.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/spelling.h"

enum { NAME_SIZE = OPTION_NAME, LINE_SIZE = 4096 };

// Where the rows' values go to; one of these per options_read.
typedef struct Decoder {
    const Field *fields;
    void *item;
    Options *options;
    Problem *problem;
} Decoder;

// "queue_most" as it is typed: "queue-most" after "--", "QUEUE_MOST" after the prefix.
static void name_spell(char target[NAME_SIZE], const char *prefix, const char *name, bool is_flag) {
    size_t at = 0;
    for (const char *c = prefix; *c != '\0' && at + 1 < NAME_SIZE; c++)
        target[at++] = *c;
    for (const char *c = name; *c != '\0' && at + 1 < NAME_SIZE; c++)
        target[at++] = is_flag ? (*c == '_' ? '-' : *c) : (char)toupper((unsigned char)*c);
    target[at] = '\0';
}

static const Field *row_find(const Field *fields, const char *name, size_t length) {
    for (const Field *row = fields; row->kind != FIELD_KIND_END; row++)
        if (strlen(row->name) == length && strncmp(row->name, name, length) == 0)
            return row;
    return NULL;
}

static void *member(const Decoder *reader, const Field *row) {
    return (char *)reader->item + row->offset;
}

static Status refuse(const Decoder *reader, const char *typed, const char *value, const Field *row,
                     const char *detail) {
    Fault fault = {0};
    text_fit(fault.pointer, sizeof fault.pointer, typed);
    text_fit(fault.value, sizeof fault.value, value);
    if (row->unit != NULL)
        text_fit(fault.unit, sizeof fault.unit, row->unit);
    const char *near =
        row->kind == FIELD_KIND_CHOICE ? spelling_nearest(row->choices, value) : NULL;
    if (near != NULL)
        text_fit(fault.did_you_mean, sizeof fault.did_you_mean, near);
    snprintf(fault.detail, sizeof fault.detail, "must be %s, is %.100s", detail, value);
    return problem_add_fault(reader->problem, STATUS_USAGE, &fault);
}

static Status refuse_choice(const Decoder *reader, const char *typed, const char *value,
                            const Field *row) {
    static const char before[] = "one of ";
    char all[160];
    const size_t used = sizeof before - 1;
    memcpy(all, before, sizeof before);
    for (size_t i = 0; row->choices[i] != NULL; i++)
        text_list(all + used, sizeof all - used, row->choices[i]);
    return refuse(reader, typed, value, row, all);
}

static Status text_set(char **target, const char *value) {
    char *copy = strdup(value);
    if (copy == NULL)
        return STATUS_NO_MEMORY;
    free(*target);
    *target = copy;
    return STATUS_OK;
}

// One more; what a weaker source gave is forgotten.
static Status texts_add(Texts *texts, const char *value, bool is_first) {
    for (size_t i = 0; is_first && i < texts->count; i++)
        free(texts->at[i]);
    if (is_first)
        texts->count = 0;
    char **at = realloc(texts->at, (texts->count + 1) * sizeof *at);
    char *copy = strdup(value);
    if (at != NULL)
        texts->at = at;
    if (at == NULL || copy == NULL) {
        free(copy);
        return STATUS_NO_MEMORY;
    }
    texts->at[texts->count++] = copy;
    return STATUS_OK;
}

// The row's range judges the new value, but its fault is told under the name that was typed.
static Status range_check(const Decoder *reader, const char *typed, const Field *row) {
    const Field rows[] = {*row, FIELD_END};
    Problem *found = calloc(1, sizeof *found);
    if (found == NULL)
        return STATUS_NO_MEMORY;
    const Status status = fields_validate(rows, reader->item, "", found);
    for (size_t i = 0; status != STATUS_OK && i < found->count && i < PROBLEM_FAULTS; i++) {
        Fault fault = found->faults[i];
        text_fit(fault.pointer, sizeof fault.pointer, typed);
        (void)problem_add_fault(reader->problem, STATUS_USAGE, &fault);
    }
    free(found);
    return status == STATUS_OK ? STATUS_OK : STATUS_USAGE;
}

static Status option_set(const Decoder *reader, const Field *row, const char *typed,
                         const char *value, OptionOrigin origin) {
    char *end = NULL;
    errno = 0;
    switch (row->kind) {
    case FIELD_KIND_REAL: {
        const double number = strtod(value, &end);
        if (end == value || *end != '\0' || !isfinite(number))
            return refuse(reader, typed, value, row, "a number");
        *(double *)member(reader, row) = number;
        break;
    }
    case FIELD_KIND_COUNT: {
        const unsigned long long number = strtoull(value, &end, 10);
        if (!isdigit((unsigned char)value[0]) || *end != '\0' || errno != 0 ||
            number == COUNT_ABSENT)
            return refuse(reader, typed, value, row, "a whole number of at least 0");
        *(uint64_t *)member(reader, row) = number;
        break;
    }
    case FIELD_KIND_FLAG: {
        const bool is_on = strcmp(value, "true") == 0 || strcmp(value, "1") == 0;
        if (!is_on && strcmp(value, "false") != 0 && strcmp(value, "0") != 0)
            return refuse(reader, typed, value, row, "true or false");
        *(bool *)member(reader, row) = is_on;
        break;
    }
    case FIELD_KIND_CHOICE: {
        int index = 0;
        while (row->choices[index] != NULL && strcmp(row->choices[index], value) != 0)
            index++;
        if (row->choices[index] == NULL)
            return refuse_choice(reader, typed, value, row);
        *(int *)member(reader, row) = index;
        break;
    }
    case FIELD_KIND_TEXTS:
        TRY(texts_add(member(reader, row), value,
                      reader->options->origins[row - reader->fields] != origin));
        break;
    default:
        TRY(text_set((char **)member(reader, row), value));
        break;
    }
    reader->options->origins[row - reader->fields] = origin;
    return range_check(reader, typed, row);
}

static Status unknown_put(const Decoder *reader, const char *typed, const char *name,
                          bool is_flag) {
    Fault fault = {0};
    text_fit(fault.pointer, sizeof fault.pointer, typed);
    text_fit(fault.detail, sizeof fault.detail, is_flag ? "is no option" : "is no setting");
    const char *near = spelling_nearest_field(reader->fields, name);
    char spelt[NAME_SIZE];
    if (near != NULL) {
        name_spell(spelt, is_flag ? "--" : "", near, true);
        text_fit(fault.did_you_mean, sizeof fault.did_you_mean, is_flag ? spelt : near);
    }
    return problem_add_fault(reader->problem, STATUS_USAGE, &fault);
}

static char *trimmed(char *text) {
    while (isspace((unsigned char)*text))
        text++;
    size_t length = strlen(text);
    while (length > 0 && isspace((unsigned char)text[length - 1]))
        text[--length] = '\0';
    return text;
}

// "name = value" lines; "#" begins a comment at a line's start or after a space.
static Status file_read(const Decoder *reader, const char *path) {
    FILE *file = fopen(path, "r");
    if (file == NULL)
        return problem_add(reader->problem, STATUS_USAGE, path, "cannot be read: %s",
                           strerror(errno));
    char line[LINE_SIZE], typed[NAME_SIZE];
    errno = 0;
    for (size_t number = 1; fgets(line, sizeof line, file) != NULL; number++) {
        snprintf(typed, sizeof typed, "%.64s:%zu", path, number);
        if (strchr(line, '\n') == NULL && !feof(file)) {
            (void)problem_add(reader->problem, STATUS_USAGE, typed,
                              "must be a line of text of at most %d bytes", LINE_SIZE - 2);
            break;
        }
        for (char *c = line; *c != '\0'; c++)
            if (*c == '#' && (c == line || isspace((unsigned char)c[-1]))) {
                *c = '\0';
                break;
            }
        char *name = trimmed(line);
        if (*name == '\0')
            continue;
        char *equals = strchr(name, '=');
        if (equals == NULL) {
            (void)problem_add(reader->problem, STATUS_USAGE, typed, "must read: name = value");
            continue;
        }
        *equals = '\0';
        name = trimmed(name);
        const Field *row = row_find(reader->fields, name, strlen(name));
        if (row == NULL)
            (void)unknown_put(reader, typed, name, false);
        else if (strcmp(name, "config") == 0)
            (void)problem_add(reader->problem, STATUS_USAGE, typed,
                              "config names a file of settings and cannot stand in one; give it as "
                              "a flag or in the environment");
        else
            (void)option_set(reader, row, typed, trimmed(equals + 1), OPTION_FILE);
    }
    if (ferror(file))
        (void)problem_add(reader->problem, STATUS_USAGE, path, "cannot be read: %s",
                          strerror(errno));
    fclose(file);
    return STATUS_OK;
}

static void environment_read(const Decoder *reader, const char *prefix) {
    char typed[NAME_SIZE];
    for (const Field *row = reader->fields; row->kind != FIELD_KIND_END; row++) {
        name_spell(typed, prefix, row->name, false);
        const char *value = getenv(typed);
        if (value != NULL)
            (void)option_set(reader, row, typed, value, OPTION_ENVIRONMENT);
    }
}

// The row that a flag names, and in *value what stands behind its "=". -o is the first row with
// that letter.
static const Field *flag_row(const Decoder *reader, const char *flag, char name[NAME_SIZE],
                             const char **value) {
    *value = NULL;
    if (flag[1] != '-') {
        const Field *row = reader->fields;
        while (row->kind != FIELD_KIND_END && row->name[0] != flag[1])
            row++;
        if (flag[2] != '\0')
            *value = flag[2] == '=' ? flag + 3 : flag + 2;
        snprintf(name, NAME_SIZE, "%c", flag[1]);
        return row->kind == FIELD_KIND_END ? NULL : row;
    }
    const char *equals = strchr(flag, '=');
    size_t length = equals == NULL ? strlen(flag + 2) : (size_t)(equals - flag - 2);
    if (length >= NAME_SIZE)
        length = NAME_SIZE - 1;
    for (size_t i = 0; i < length; i++)
        name[i] = flag[2 + i] == '-' ? '_' : flag[2 + i];
    name[length] = '\0';
    *value = equals == NULL ? NULL : equals + 1;
    return row_find(reader->fields, name, length);
}

static void flags_read(const Decoder *reader, int argc, char *const *argv) {
    Options *options = reader->options;
    bool is_ended = false;
    for (int i = 0; i < argc; i++) {
        const char *word = argv[i], *value;
        char name[NAME_SIZE], typed[NAME_SIZE];
        if (is_ended || word[0] != '-' || word[1] == '\0') {
            if (options->operand_count < OPTIONS_OPERANDS)
                options->operands[options->operand_count] = word;
            options->operand_count++;
            continue;
        }
        if (strcmp(word, "--") == 0) {
            is_ended = true;
            continue;
        }
        const Field *row = flag_row(reader, word, name, &value);
        snprintf(typed, sizeof typed, "%.*s", (int)strcspn(word, "="), word);
        if (row == NULL) {
            (void)unknown_put(reader, typed, name, true);
            continue;
        }
        if (value == NULL && row->kind == FIELD_KIND_FLAG)
            value = "true";
        else if (value == NULL && i + 1 < argc)
            value = argv[++i];
        if (value == NULL)
            (void)problem_add(reader->problem, STATUS_USAGE, typed, "needs a value");
        else
            (void)option_set(reader, row, typed, value, OPTION_FLAG);
    }
}

// The file is the weakest source but is named by a stronger one, so its name is looked up first.
static const char *config_path(const Decoder *reader, int argc, char *const *argv,
                               const char *prefix) {
    const Field *row = row_find(reader->fields, "config", strlen("config"));
    if (row == NULL)
        return NULL;
    char typed[NAME_SIZE];
    name_spell(typed, prefix, row->name, false);
    const char *path = getenv(typed);
    for (int i = 0; i < argc && strcmp(argv[i], "--") != 0; i++) {
        char name[NAME_SIZE];
        const char *value;
        if (argv[i][0] != '-' || argv[i][1] == '\0')
            continue;
        const Field *found = flag_row(reader, argv[i], name, &value);
        if (found != NULL && found->kind != FIELD_KIND_FLAG && value == NULL && i + 1 < argc)
            value = argv[++i];
        if (found == row && value != NULL)
            path = value;
    }
    return path;
}

Status options_read(const Field *fields, void *item, int argc, char *const *argv,
                    const char *prefix, Options *options, Problem *problem) {
    *options = (Options){0};
    size_t rows = 0;
    while (fields[rows].kind != FIELD_KIND_END)
        rows++;
    if (rows > OPTIONS_ROWS)
        return problem_set(problem, STATUS_INTERNAL, "%zu settings, more than %d", rows,
                           OPTIONS_ROWS);
    // Faults are counted in a Problem of its own where the caller has none.
    Problem *own = problem == NULL ? calloc(1, sizeof *own) : NULL;
    const Decoder reader = {fields, item, options, problem != NULL ? problem : own};
    if (reader.problem == NULL)
        return STATUS_NO_MEMORY;
    const size_t before = reader.problem->count;
    if (prefix != NULL) {
        const char *path = config_path(&reader, argc, argv, prefix);
        if (path != NULL)
            (void)file_read(&reader, path);
        environment_read(&reader, prefix);
    }
    flags_read(&reader, argc, argv);
    const bool has_faults = reader.problem->count > before;
    free(own);
    return has_faults ? STATUS_USAGE : STATUS_OK;
}

char option_spell(const Field *fields, const Field *row, char name[OPTION_NAME]) {
    name_spell(name, "--", row->name, true);
    bool is_first = row->name[0] != 'h'; // -h is help
    for (const Field *other = fields; other < row; other++)
        is_first = is_first && other->name[0] != row->name[0];
    return is_first ? row->name[0] : '\0';
}
