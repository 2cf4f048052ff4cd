// Settings on paper: their values as a file of them would have it, and what --help says of each.
#include <stdio.h>
#include <string.h>

#include "server/options.h"

static const char *const origin_names[] = {"default", "file", "environment", "flag"};

static void value_print(const Field *row, const void *item, FILE *file) {
    const void *at = (const char *)item + row->offset;
    char digits[32];
    if (row->kind == FIELD_KIND_REAL)
        fputs(text_real(digits, *(const double *)at), file);
    else if (row->kind == FIELD_KIND_COUNT)
        fprintf(file, "%llu", (unsigned long long)*(const uint64_t *)at);
    else if (row->kind == FIELD_KIND_FLAG)
        fputs(*(const bool *)at ? "true" : "false", file);
    else if (row->kind == FIELD_KIND_CHOICE)
        fputs(row->choices[*(const int *)at], file);
    else if (row->kind == FIELD_KIND_TEXTS)
        for (size_t i = 0; i < ((const Texts *)at)->count; i++)
            fprintf(file, "%s%s", i > 0 ? ", " : "", ((const Texts *)at)->at[i]);
    else
        fputs(*(char *const *)at, file);
}

void options_print(const Field *fields, const void *item, const Options *options, FILE *file) {
    for (const Field *row = fields; row->kind != FIELD_KIND_END; row++) {
        const bool is_set = row->kind == FIELD_KIND_FLAG || !field_is_absent(row, item);
        // "config" and "print_config" are about the file, not of it.
        fprintf(file, "%s%s = ", is_set && strstr(row->name, "config") == NULL ? "" : "# ",
                row->name);
        if (is_set)
            value_print(row, item, file);
        fprintf(file, "  # %s\n", origin_names[options->origins[row - fields]]);
    }
}

void options_help(const Field *fields, FILE *file) {
    static const OptionGroup none[] = {{NULL, NULL}};
    options_help_grouped(fields, none, file);
}

void options_help_grouped(const Field *fields, const OptionGroup *groups, FILE *file) {
    for (const Field *row = fields; row->kind != FIELD_KIND_END; row++) {
        char spelt[OPTION_NAME], left[2 * OPTION_NAME];
        for (const OptionGroup *group = groups; group->first != NULL; group++)
            if (strcmp(group->first, row->name) == 0)
                fprintf(file, "%s%s\n", row == fields ? "" : "\n", group->title);
        const bool is_first = option_spell(fields, row, spelt) != '\0';
        const char *value = row->kind == FIELD_KIND_TEXT    ? " TEXT"
                            : row->kind == FIELD_KIND_TEXTS ? " TEXT ..."
                            : row->kind == FIELD_KIND_FLAG  ? ""
                            : row->kind == FIELD_KIND_COUNT ? " N"
                                                            : " X";
        if (is_first)
            snprintf(left, sizeof left, "-%c, %s%s", row->name[0], spelt, value);
        else
            snprintf(left, sizeof left, "    %s%s", spelt, value);
        fprintf(file, "  %-28s %s%s%s%s\n", left, row->doc, row->unit != NULL ? " [" : "",
                row->unit != NULL ? row->unit : "", row->unit != NULL ? "]" : "");
    }
}
