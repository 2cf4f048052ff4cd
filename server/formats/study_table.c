#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/formats/study_formats.h"

struct StudyColumn {
    char name[160];
    const char *unit;
    double *values;
    const char **words; // distinct ones, of which the values are indices
    size_t word_count;
};

size_t study_table_add(StudyTable *table, const char *name, const char *unit) {
    struct StudyColumn *at = realloc(table->at, (table->count + 1) * sizeof *at);
    if (at == NULL) {
        table->is_failed = true;
        return table->count;
    }
    table->at = at;
    struct StudyColumn *column = &at[table->count];
    *column = (struct StudyColumn){.unit = unit,
                                   .values = calloc(table->rows + 1, sizeof *column->values)};
    text_fit(column->name, sizeof column->name, name);
    table->is_failed = table->is_failed || column->values == NULL;
    for (size_t i = 0; column->values != NULL && i < table->rows; i++)
        column->values[i] = (double)NAN;
    return table->count++;
}

void study_table_set(StudyTable *table, size_t column, size_t row, double value) {
    if (!table->is_failed)
        table->at[column].values[row] = value;
}

void study_table_set_word(StudyTable *table, size_t column, size_t row, const char *word) {
    if (table->is_failed || word == NULL)
        return;
    struct StudyColumn *at = &table->at[column];
    size_t i = 0;
    while (i < at->word_count && strcmp(at->words[i], word) != 0)
        i++;
    if (i == at->word_count) {
        const char **words = realloc(at->words, (i + 1) * sizeof *words);
        table->is_failed = words == NULL;
        if (words == NULL)
            return;
        at->words = words;
        at->words[at->word_count++] = word;
    }
    at->values[row] = (double)i;
}

static TableColumn study_table_column(const void *context, size_t index) {
    const struct StudyColumn *column = &((const StudyTable *)context)->at[index];
    return (TableColumn){column->name, column->unit, column->words, column->word_count, false};
}

static bool study_table_read(void *context, size_t index, size_t first, size_t count,
                             double *target) {
    memcpy(target, ((const StudyTable *)context)->at[index].values + first, count * sizeof *target);
    return true;
}

TableSource study_table_source(StudyTable *table) {
    return (TableSource){.context = table, .column = study_table_column, .read = study_table_read};
}

Table study_table_view(const StudyTable *table, const TableSource *source) {
    return (Table){.count = table->is_failed ? 0 : table->rows,
                   .column_count = table->is_failed ? 0 : table->count,
                   .source = source};
}

void study_table_clear(StudyTable *table) {
    for (size_t i = 0; i < table->count; i++) {
        free(table->at[i].values);
        free(table->at[i].words);
    }
    free(table->at);
    *table = (StudyTable){.rows = 0};
}
