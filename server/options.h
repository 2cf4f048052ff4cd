// Settings by Field rows: flag over environment over file over default, and where each value came
// from. Not the settings themselves: each command has its own struct and rows of REAL, COUNT, FLAG,
// TEXT, TEXTS and CHOICE. Used by command/.
#ifndef SERVER_OPTIONS_H
#define SERVER_OPTIONS_H

#include <stdio.h>

#include "core/base/field.h"

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

// Reads argv[0 ... argc - 1], the arguments behind the command's name, into `item`, which holds its
// defaults. Row "queue_most" is --queue-most N, and -q if it is the first row with that letter;
// "--" ends the flags. With `prefix` ("IMPACTD_"; NULL: flags only) it is also PREFIX_QUEUE_MAX of
// the environment and, where a TEXT row "config" names a file, its line "queue_most = N". Adds all
// faults, under the name that was typed.
Status options_read(const Field *fields, void *item, int argc, char *const *argv,
                    const char *prefix, Options *options, Problem *problem);

// One line per row as a config file would have it, with its origin behind a "#".
void options_print(const Field *fields, const void *item, const Options *options, FILE *file);

// How a row is typed: "--queue-most" into `name`; returns its letter, '\0' where another has it.
enum { OPTION_NAME = 96 };
char option_spell(const Field *fields, const Field *row, char name[OPTION_NAME]);

// One line per row for --help.
void options_help(const Field *fields, FILE *file);

// A heading over the row `first` and those behind it.
typedef struct OptionGroup {
    const char *first, *title;
} OptionGroup;
// The same with headings, which end with first == NULL.
void options_help_grouped(const Field *fields, const OptionGroup *groups, FILE *file);

#endif
