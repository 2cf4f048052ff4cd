// The formats of the answer of each kind of study: JSON, a table and a chart.
#ifndef SERVER_FORMATS_STUDY_FORMATS_H
#define SERVER_FORMATS_STUDY_FORMATS_H

#include "core/study/study.h"
#include "server/util/bytes.h"

enum { STUDY_FORMATS_MAX = 7 }; // at most, with the end

typedef struct StudyFormat {
    const char *extension; // "svg"; NULL: the end
    const char *content_type;
    bool is_binary; // Range requests make sense
    // Appends the whole document.
    void (*write)(const Variant *answer, const char *extension, Bytes *bytes);
} StudyFormat;

// All formats of an answer of this kind, json first.
const StudyFormat *study_formats(const Kind *kind);
const StudyFormat *study_format_find(const StudyFormat *formats, const char *extension);

// "json, svg", each behind `before`.
void study_formats_names(const StudyFormat *formats, const char *before, char *target, size_t size);

#endif
