// Binary formats whose numbers are copied as they lie in memory, with the same bytes every time:
// ZIP archives, NumPy's arrays, MATLAB's level 5.
#include <stdio.h>
#include <string.h>

#include "server/formats/format.h"

// --- ZIP ---

// local header, name, content; ...; directory entries, names; end.
enum {
    ZIP_LOCAL = 0x04034b50,
    ZIP_ENTRY = 0x02014b50,
    ZIP_END = 0x06054b50,
    ZIP_VERSION = 20,
    ZIP_DATE = 0x0021, // 1980-01-01, the first of a ZIP
    ZIP_MEMBERS_MAX = 0xfffe,
};

static const uint64_t zip_bytes_max = 0xfffffffe;

// What local header and directory entry share.
static void zip_put_facts(Segments *segments, uint32_t crc, uint64_t size, const char *name) {
    segments_number(segments, ZIP_VERSION, 2);
    segments_number(segments, 0, 2); // flags
    segments_number(segments, 0, 2); // stored
    segments_number(segments, 0, 2); // midnight
    segments_number(segments, ZIP_DATE, 2);
    segments_number(segments, crc, 4);
    segments_number(segments, size, 4);
    segments_number(segments, size, 4);
    segments_number(segments, strlen(name), 2);
    segments_number(segments, 0, 2); // nothing extra
}

static Status zip_refuse(Problem *problem) {
    return problem_set(problem, STATUS_LIMIT,
                       "this would be larger than 4 GiB, which such an archive cannot be: ask for "
                       "fewer channels or a shorter time, or for .npy");
}

Status zip_put(Zip *zip, const char *name, const Segments *content, Problem *problem) {
    Segments *segments = zip->segments;
    const uint64_t start = segments->size;
    if (content->size > zip_bytes_max || start + content->size + 1024 > zip_bytes_max ||
        zip->count >= ZIP_MEMBERS_MAX)
        return zip_refuse(problem);
    const uint32_t crc = content->is_failed ? 0 : segments_crc32(content);
    segments_number(segments, ZIP_LOCAL, 4);
    zip_put_facts(segments, crc, content->size, name);
    segments_put(segments, name, strlen(name));
    segments_join(segments, content);

    segments_number(&zip->directory, ZIP_ENTRY, 4);
    segments_number(&zip->directory, ZIP_VERSION, 2);
    zip_put_facts(&zip->directory, crc, content->size, name);
    segments_number(&zip->directory, 0, 2); // no comment
    segments_number(&zip->directory, 0, 2); // on the first disk
    segments_number(&zip->directory, 0, 2); // attributes
    segments_number(&zip->directory, 0, 4);
    segments_number(&zip->directory, start, 4);
    segments_put(&zip->directory, name, strlen(name));
    zip->count++;
    return STATUS_OK;
}

Status zip_end(Zip *zip, Problem *problem) {
    Segments *segments = zip->segments;
    const uint64_t start = segments->size, size = zip->directory.size;
    segments_join(segments, &zip->directory);
    segments_number(segments, ZIP_END, 4);
    segments_number(segments, 0, 4); // on the first disk
    segments_number(segments, zip->count, 2);
    segments_number(segments, zip->count, 2);
    segments_number(segments, size, 4);
    segments_number(segments, start, 4);
    segments_number(segments, 0, 2); // no comment
    segments_clear(&zip->directory);
    zip->count = 0;
    return start + size > zip_bytes_max ? zip_refuse(problem) : STATUS_OK;
}

// --- NumPy ---

// NumPy's array file, version 1.0, in Fortran order; and its archive, a ZIP of such files of one
// dimension, stored: numbers hardly compress. Names and units of an NPY are in the result's
// document.
enum { NPY_PREAMBLE = 10, NPY_ALIGNMENT = 64 };

static void npy_put_header(Segments *segments, const char *type, size_t rows, size_t columns) {
    char header[2 * NPY_ALIGNMENT], shape[48];
    if (columns > 0)
        snprintf(shape, sizeof shape, "%zu, %zu", rows, columns);
    else
        snprintf(shape, sizeof shape, "%zu,", rows);
    const int length =
        snprintf(header, sizeof header,
                 "{'descr': '%.16s', 'fortran_order': True, 'shape': (%s), }", type, shape);
    // Blanks and a line feed fill it up, so that the numbers begin at a multiple of 64 bytes.
    const size_t used = NPY_PREAMBLE + (size_t)length + 1;
    const size_t size = (used + NPY_ALIGNMENT - 1) / NPY_ALIGNMENT * NPY_ALIGNMENT - NPY_PREAMBLE;
    segments_put(segments, "\x93NUMPY\x01\x00", 8);
    segments_number(segments, size, 2);
    segments_put(segments, header, (size_t)length);
    segments_fill(segments, ' ', size - 1 - (size_t)length);
    segments_put(segments, "\n", 1);
}

static Status npy_layout(const Table *table, Segments *segments, Problem *problem) {
    const size_t width = table_width(table);
    (void)problem;
    npy_put_header(segments, "<f8", table->count, width);
    for (size_t c = 0; c < width; c++)
        segments_column(segments, table, c, 0);
    return STATUS_OK;
}

// Bytes of the longest text, at least 1; 0: a column of numbers.
static size_t npz_width(const TableColumn *column) {
    size_t width = 1, length;
    if (column->texts == NULL || table_column_is_numeric(column))
        return 0;
    for (size_t i = 0; i < column->text_count; i++) {
        (void)table_bare(column, (double)i, &length);
        width = length > width ? length : width;
    }
    return width;
}

static Status npz_put(Zip *zip, const Table *table, size_t c, Problem *problem) {
    Segments array = {0};
    char file[ZIP_NAME_MAX + 1], type[32] = "<f8";
    const TableColumn column = table_column(table, c);
    const size_t width = npz_width(&column);
    if (width > 0)
        snprintf(type, sizeof type, "|S%zu", width);
    npy_put_header(&array, type, table->count, 0);
    segments_column(&array, table, c, width);
    snprintf(file, sizeof file, "%.74s.npy", column.name + (*column.name == '/'));
    const Status status = zip_put(zip, file, &array, problem);
    segments_clear(&array);
    return status;
}

static Status npz_layout(const Table *table, Segments *segments, Problem *problem) {
    Zip zip = {.segments = segments};
    Status status = STATUS_OK;
    for (size_t c = 0; c < table_width(table) && status == STATUS_OK; c++)
        status = npz_put(&zip, table, c, problem);
    const Status ended = zip_end(&zip, status == STATUS_OK ? problem : NULL);
    return status != STATUS_OK ? status : ended;
}

const TableFormat format_npy = {
    .extension = "npy",
    .content_type = "application/x-npy",
    .is_binary = true,
    .layout = npy_layout,
};

const TableFormat format_npz = {
    .extension = "npz",
    .content_type = "application/x-npz",
    .is_binary = true,
    .layout = npz_layout,
};

// --- MATLAB ---

// A header of 128 bytes, then for each variable an element
//
//     miMATRIX size | miUINT32 8: class, 0 | miINT32 8: rows, 1 | miINT8 n: name, blanks | miDOUBLE
//     n: numbers
//
// whose parts each fill a multiple of 8 bytes. Not compressed.
enum {
    MI_INT8 = 1,
    MI_INT32 = 5,
    MI_UINT32 = 6,
    MI_DOUBLE = 9,
    MI_MATRIX = 14,
    MX_DOUBLE = 6,
    MAT_TEXT = 116, // bytes of the description
    MAT_VERSION = 0x0100,
};

// Bytes of one variable: readers take sizes as signed numbers of 32 bits.
static const uint64_t mat_variable_max = 0x7fffffff;

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
    if (size > mat_variable_max)
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

static Status mat_layout(const Table *table, Segments *segments, Problem *problem) {
    char text[MAT_TEXT + 1];
    // No time of day: the same result is the same bytes.
    snprintf(text, sizeof text, "%-*s", MAT_TEXT, "MATLAB 5.0 MAT-file, written by impactd");
    segments_put(segments, text, MAT_TEXT);
    segments_fill(segments, '\0', 8);
    segments_number(segments, MAT_VERSION, 2);
    segments_put(segments, "IM", 2); // little-endian
    for (size_t c = 0; c < table_width(table); c++) {
        const char *name = table_column(table, c).name;
        TRY(mat_open_variable(segments, name + (*name == '/'), table->count, problem));
        segments_column(segments, table, c, 0);
    }
    return STATUS_OK;
}

const TableFormat format_mat = {
    .extension = "mat",
    .content_type = "application/x-matlab-data",
    .is_binary = true,
    .layout = mat_layout,
};
