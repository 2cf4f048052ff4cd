#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/formats/study_formats.h"

struct StudyColumn {
    char name[160];
    const char *unit;
    double *values; // of texts their index
    char **texts;   // of each row; NULL: the column has numbers
    bool has_texts, is_json;
};

static bool study_column_grow(struct StudyColumn *column, size_t room) {
    double *values = realloc(column->values, room * sizeof *values);
    column->values = values != NULL ? values : column->values;
    if (values == NULL || !column->has_texts)
        return values != NULL;
    char **texts = realloc(column->texts, room * sizeof *texts);
    column->texts = texts != NULL ? texts : column->texts;
    return texts != NULL;
}

void study_table_row(StudyTable *table) {
    const size_t room = table->rows < table->room ? table->room : 2 * table->rows + 16;
    for (size_t c = 0; c < table->width && room > table->room; c++)
        table->is_failed = table->is_failed || !study_column_grow(&table->columns[c], room);
    table->room = room;
    table->cell = 0;
    table->rows++;
}

// NULL without memory.
static struct StudyColumn *study_table_next(StudyTable *table, const char *name, const char *unit,
                                            bool has_texts, bool is_json) {
    if (table->cell == table->width && !table->is_failed) {
        struct StudyColumn *grown = realloc(table->columns, (table->width + 1) * sizeof *grown);
        table->is_failed = grown == NULL;
        if (grown == NULL)
            return NULL;
        table->columns = grown;
        struct StudyColumn *column = &grown[table->width++];
        *column = (struct StudyColumn){.unit = unit, .has_texts = has_texts, .is_json = is_json};
        text_fit(column->name, sizeof column->name, name);
        table->is_failed = !study_column_grow(column, table->room);
    }
    return table->is_failed ? NULL : &table->columns[table->cell++];
}

void study_table_number(StudyTable *table, const char *name, const char *unit, double value) {
    struct StudyColumn *column = study_table_next(table, name, unit, false, false);
    if (column != NULL)
        column->values[table->rows - 1] = value;
}

static void study_table_put(StudyTable *table, const char *name, const char *text, bool is_json) {
    struct StudyColumn *column = study_table_next(table, name, NULL, true, is_json);
    if (column == NULL)
        return;
    column->values[table->rows - 1] = (double)(table->rows - 1);
    column->texts[table->rows - 1] = strdup(text != NULL ? text : "");
    table->is_failed = column->texts[table->rows - 1] == NULL;
}

void study_table_text(StudyTable *table, const char *name, const char *text) {
    study_table_put(table, name, text, false);
}

void study_table_scalar(StudyTable *table, const char *name, const char *json) {
    study_table_put(table, name, json, true);
}

void study_table_members(StudyTable *table, const char *before, const Field *fields,
                         const void *item) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        const void *member = (const char *)item + field->offset;
        double value = (double)NAN;
        char name[160];
        if (field->kind == FIELD_KIND_REAL)
            value = *(const double *)member;
        else if (field->kind != FIELD_KIND_COUNT)
            continue;
        else if (*(const uint64_t *)member != COUNT_ABSENT)
            value = (double)*(const uint64_t *)member;
        snprintf(name, sizeof name, "%s%s%s", before != NULL ? before : "",
                 before != NULL ? "." : "", field->name);
        study_table_number(table, name, field->unit, value);
    }
}

static TableColumn study_table_column(const void *context, size_t index) {
    const StudyTable *table = context;
    const struct StudyColumn *column = &table->columns[index];
    return (TableColumn){column->name, column->unit, (const char *const *)column->texts,
                         column->texts != NULL ? table->rows : 0, column->is_json};
}

static bool study_table_read(void *context, size_t index, size_t first, size_t count,
                             double *target) {
    const double *values = ((const StudyTable *)context)->columns[index].values + first;
    memcpy(target, values, count * sizeof *target);
    return true;
}

TableSource study_table_source(StudyTable *table) {
    return (TableSource){.context = table, .column = study_table_column, .read = study_table_read};
}

Table study_table_view(const StudyTable *table, const TableSource *source) {
    return (Table){.count = table->is_failed ? 0 : table->rows,
                   .column_count = table->is_failed ? 0 : table->width,
                   .source = source};
}

void study_table_clear(StudyTable *table) {
    for (size_t c = 0; c < table->width; c++) {
        for (size_t i = 0; table->columns[c].texts != NULL && i < table->rows; i++)
            free(table->columns[c].texts[i]);
        free(table->columns[c].values);
        free(table->columns[c].texts);
    }
    free(table->columns);
    *table = (StudyTable){.rows = 0};
}
