// A header of 128 bytes, then for each variable an element
//
//     miMATRIX size | miUINT32 8: class, 0 | miINT32 8: rows, 1 | miINT8 n: name, blanks | miDOUBLE
//     n: numbers
//
// whose parts each fill a multiple of 8 bytes. Not compressed.

#include <stdio.h>
#include <string.h>

#include "server/formats/format.h"

enum {
    MI_INT8 = 1,
    MI_INT32 = 5,
    MI_UINT32 = 6,
    MI_DOUBLE = 9,
    MI_MATRIX = 14,
    MX_DOUBLE = 6,
    TEXT = 116, // bytes of the description
    VERSION = 0x0100,
};

// Bytes of one variable: readers take sizes as signed numbers of 32 bits.
static const uint64_t variable_max = 0x7fffffff;

static bool mat_is_letter(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

void mat_name(const char *name, char target[MAT_NAME_SIZE]) {
    size_t length = 0;
    if (!mat_is_letter(*name))
        target[length++] = 'x';
    for (; *name != '\0' && length + 1 < MAT_NAME_SIZE; name++)
        target[length++] =
            (char)(mat_is_letter(*name) || (*name >= '0' && *name <= '9') ? *name : '_');
    target[length] = '\0';
}

// Everything before a variable's numbers. STATUS_LIMIT where they are too many.
static Status mat_open_variable(Segments *segments, const char *name, size_t rows,
                                Problem *problem) {
    char variable[MAT_NAME_SIZE];
    mat_name(name, variable);
    const size_t length = strlen(variable), padding = (8 - length % 8) % 8;
    const uint64_t size = 16 + 16 + 8 + length + padding + 8 + 8 * (uint64_t)rows;
    if (size > variable_max)
        return problem_set(problem, STATUS_LIMIT,
                           "%s has %zu values, more than a variable of such a file can hold: ask "
                           "for a shorter time, or for .npy",
                           name, rows);
    segments_number(segments, MI_MATRIX, 4);
    segments_number(segments, size, 4);
    segments_number(segments, MI_UINT32, 4);
    segments_number(segments, 8, 4);
    segments_number(segments, MX_DOUBLE, 8);
    segments_number(segments, MI_INT32, 4);
    segments_number(segments, 8, 4);
    segments_number(segments, rows, 4);
    segments_number(segments, 1, 4);
    segments_number(segments, MI_INT8, 4);
    segments_number(segments, length, 4);
    segments_put(segments, variable, length);
    segments_fill(segments, '\0', padding);
    segments_number(segments, MI_DOUBLE, 4);
    segments_number(segments, 8 * (uint64_t)rows, 4);
    return STATUS_OK;
}

static Status mat_lay(const Table *table, Segments *segments, Problem *problem) {
    char text[TEXT + 1];
    // No time of day: the same result is the same bytes.
    snprintf(text, sizeof text, "%-*s", TEXT, "MATLAB 5.0 MAT-file, written by impactd");
    segments_put(segments, text, TEXT);
    segments_fill(segments, '\0', 8);
    segments_number(segments, VERSION, 2);
    segments_put(segments, "IM", 2); // little-endian
    if (table->axis_name != NULL) {
        TRY(mat_open_variable(segments, table->axis_name, table->count, problem));
        table_lay_axis(table, segments);
    }
    for (size_t c = 0; c < table->column_count; c++) {
        TRY(mat_open_variable(segments, table->columns[c]->name, table->count, problem));
        table_lay_column(table, c, segments);
    }
    return STATUS_OK;
}

const TableFormat format_mat = {
    .extension = "mat",
    .content_type = "application/x-matlab-data",
    .is_binary = true,
    .lay = mat_lay,
};
