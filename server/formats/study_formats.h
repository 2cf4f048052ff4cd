// The formats of the answer of each kind of study: JSON, a table and a chart.
#ifndef SERVER_FORMATS_STUDY_FORMATS_H
#define SERVER_FORMATS_STUDY_FORMATS_H

#include "core/drop_test/evaluation.h"
#include "core/study/study.h"
#include "core/study/sweep.h"
#include "server/formats/chart.h"
#include "server/formats/format.h"
#include "server/jobs/documents.h"

// All formats of an answer of this kind, json first; NULL-terminated.
const TableFormat *const *study_formats(const Kind *kind);
// NULL if there is none of this extension.
const TableFormat *study_format_find(const Kind *kind, const char *extension);
// Appends the whole document.
void study_format_write(const TableFormat *format, const StudyDocument *document, Bytes *bytes);

// Describes the chart of an answer whose formats include svg, into a new `chart`.
void study_chart(const Variant *answer, Chart *chart);

// "json, svg", each behind `before`.
void study_formats_names(const TableFormat *const *formats, const char *before, char *target,
                         size_t size);

// --- tables of answers ---

// Rows of numbers and texts, written cell by cell. The cells of the first row make the columns; all
// rows have the same ones. All zero is empty; once it failed (memory) it stays so.
typedef struct StudyTable {
    struct StudyColumn *columns;
    size_t width, rows, room;
    size_t cell; // of the last row: the next one
    bool is_failed;
} StudyTable;

void study_table_row(StudyTable *table); // begins the next row
// The name is copied; an unknown number is NAN.
void study_table_number(StudyTable *table, const char *name, const char *unit, double value);
// Copied, too; an unknown one is NULL.
void study_table_text(StudyTable *table, const char *name, const char *text);
// A JSON scalar; where all of a column are numbers, it is one of numbers in binary formats.
void study_table_scalar(StudyTable *table, const char *name, const char *json);
// A number for each REAL and COUNT row of `fields`, its name behind `before` and a dot, where
// given.
void study_table_members(StudyTable *table, const char *before, const Field *fields,
                         const void *item);
TableSource study_table_source(StudyTable *table);                          // borrows it
Table study_table_view(const StudyTable *table, const TableSource *source); // borrows both
void study_table_clear(StudyTable *table);

// --- tables of sweeps ---

enum {
    SWEEP_CELL_POINT,  // its number, rising
    SWEEP_CELL_STATUS, // SweepStatus
    SWEEP_CELL_METRIC, // the first of them
};

// The table of a sweep: a row for each point that is made, with its number, the value of each axis,
// the metrics and a status. Its rows are those of an answer, or read from a database piece by
// piece.
typedef struct SweepDocument {
    const Sweep *sweep; // borrowed; of its own table only the failures are used
    const char *result; // under which it is served, for links; NULL: it is not
    size_t rows;        // that are there
    // Cell `cell` of rows first ... first + count - 1. False: they cannot be read any more.
    bool (*read)(void *context, size_t cell, size_t first, size_t count, double *target);
    void *context;
    bool is_broken;      // a read has failed: what was written since is not the table
    TableSource columns; // by sweep_document_table
} SweepDocument;

SweepDocument sweep_document(const Sweep *sweep); // of the answer's own rows

// As a table for the formats except SVG; it borrows the document, which is neither moved nor
// changed as long. NPZ has texts; NPY and MAT have numbers alone, of a text its index among the
// axis's values, of a status SweepStatus.
Table sweep_document_table(SweepDocument *document);

// --- charts: new descriptions, which name what they do not show ---

// Series over time, or spectra over frequency.
void chart_table(const Table *table, Chart *chart);
// Error against CPU time, both logarithmic (a work-precision chart).
void chart_tradeoff(const Variant *answer, Chart *chart);
// The mean spectra with the intervals of the means, and the statistics with intervals and spread.
void chart_ensemble(const Variant *answer, Chart *chart);
// The spectra and the displacements of all variants.
void chart_compare(const Variant *answer, Chart *chart);
// A row for each point; see core/study/response_curve.h.
void response_table(const Variant *answer, StudyTable *table);
// Amplitudes over the axis with and without dampers, unstable ones dashed, and the sections.
void chart_response(const Variant *answer, Chart *chart);
// The spectra of the drawn runs, and a table of the slopes.
void chart_sensitivity(const Variant *answer, Chart *chart);
// The probability of exceeding each limit over the intensity, and the fractiles of the metrics.
void chart_fragility(const Variant *answer, Chart *chart);
// Measured and fitted motions and their difference; and a row for each parameter.
void chart_calibration(const Variant *answer, Chart *chart);
void calibration_table(const Variant *answer, StudyTable *table);
// The candidates with the best so far, or of two objectives with the front.
void chart_optimum(const Variant *answer, Chart *chart);
void optimum_table(const Variant *answer, StudyTable *table);
// Each metric of a sweep: a line over one axis, or a map over two. Size and memory are limited for
// any number of points. False: the rows could not be read to their end.
bool chart_sweep(const SweepDocument *document, Chart *chart);
// Every reading over approach speed; those without a speed are at the left edge.
void chart_evaluation(const Evaluation *evaluation, const char *slug, Bytes *bytes);
// The response spectrum of a ground motion: the first column is the period, the last the
// pseudo-acceleration.
void chart_response_spectrum(const char *record, double damping_ratio, const Columns *columns,
                             Bytes *bytes);

#endif
