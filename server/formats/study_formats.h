// The formats of the answer of each kind of study: JSON, a table and a chart.
#ifndef SERVER_FORMATS_STUDY_FORMATS_H
#define SERVER_FORMATS_STUDY_FORMATS_H

#include "core/drop_test/evaluation.h"
#include "core/study/study.h"
#include "server/formats/sweep.h"

enum { STUDY_FORMATS_MAX = 7 }; // at most, with the end

typedef struct StudyFormat {
    const char *extension; // "svg"; NULL: the end
    const char *content_type;
    bool is_binary; // Range requests make sense
    // Appends the whole document; NULL: that of the format of the answer's table.
    void (*write)(const Variant *answer, Bytes *bytes);
} StudyFormat;

// All formats of an answer of this kind, json first.
const StudyFormat *study_formats(const Kind *kind);
const StudyFormat *study_format_find(const StudyFormat *formats, const char *extension);
// Appends the whole document.
void study_format_write(const StudyFormat *format, const Variant *answer, Bytes *bytes);

// "json, svg", each behind `before`.
void study_formats_names(const StudyFormat *formats, const char *before, char *target, size_t size);

// Charts append an SVG document. What a chart does not show is named in its description.
extern const char chart_type[]; // "image/svg+xml"
// Error against CPU time, both logarithmic (a work-precision chart).
void chart_tradeoff(const Variant *answer, Bytes *bytes);
// The mean spectra with the intervals of the means, and the statistics with intervals and spread.
void chart_ensemble(const Variant *answer, Bytes *bytes);
// The spectra and the displacements of all variants.
void chart_compare(const Variant *answer, Bytes *bytes);
// The spectra of the drawn runs, and a table of the slopes.
void chart_sensitivity(const Variant *answer, Bytes *bytes);
// Each metric of a sweep: a line over one axis, or a map over two. Size and memory are limited for
// any number of points. False: the rows could not be read to their end.
bool chart_sweep(const Sweep *sweep, const SweepSource *source, Bytes *bytes);
// Every reading over approach speed; those without a speed are at the left edge.
void chart_evaluation(const Evaluation *evaluation, const char *slug, Bytes *bytes);

#endif
