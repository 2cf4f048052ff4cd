// Settings by Field rows, from flags, environment, file and defaults in this order of precedence.
// Each command has its own struct and rows of REAL, COUNT, FLAG, TEXT, TEXTS and CHOICE.
#ifndef SERVER_OPTIONS_H
#define SERVER_OPTIONS_H

#include <stdio.h>

#include "core/base/field.h"
#include "server/util/bytes.h"

enum { OPTIONS_ROWS = 96, OPTIONS_OPERANDS = 8 };

typedef enum OptionOrigin {
    OPTION_DEFAULT,
    OPTION_FILE,
    OPTION_ENVIRONMENT,
    OPTION_FLAG,
} OptionOrigin;

typedef struct Options {
    OptionOrigin origins[OPTIONS_ROWS]; // by row
    const char *operands[OPTIONS_OPERANDS];
    size_t operand_count;
} Options;

// Reads the arguments behind the command's name into `item`, which holds its defaults. Row
// "max_body" is --max-body N. A few names also have a letter, the same in every command: "output"
// is -o. "--" ends the flags.
// With `prefix` ("IMPACTD_"; NULL: flags only) it is also IMPACTD_MAX_BODY of the environment and
// the line "max_body = N" of the file that a TEXT row "config" names. All faults are added, at the
// name that was used; a value that a stronger source overrides is not checked.
Status options_read(const Field *fields, void *item, int argc, char *const *argv,
                    const char *prefix, Options *options, Problem *problem);

// Appends the value of a row as it is given to an option.
void option_value(const Field *row, const void *item, Bytes *text);
// One line per row in the format of the file, with the origin of the value as a comment.
void options_print(const Field *fields, const void *item, const Options *options, FILE *file);

// The flag of a row: "--max-body" into `name`; returns its letter, '\0' if it has none.
enum { OPTION_NAME = 96 };
char option_spell(const Field *row, char name[OPTION_NAME]);
// The value of a row's flag in help texts: "FILE", "N"; NULL: it takes none.
const char *option_operand(const Field *row);

// A heading above the row `first`.
typedef struct OptionGroup {
    const char *first, *title;
} OptionGroup;

// The rows for --help, in lines of at most 80 columns; `groups` end with first == NULL; NULL: no
// headings.
void options_help(const Field *fields, const OptionGroup *groups, FILE *file);

#endif
