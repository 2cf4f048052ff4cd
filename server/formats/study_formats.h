// In what formats the answer of ONE kind of study can be had; answer.c lists all. Not the encoders
// of series and spectra (encoder.h). Used by api/studies.c, api/results.c and the commands.
#ifndef SERVER_FORMATS_STUDY_FORMATS_H
#define SERVER_FORMATS_STUDY_FORMATS_H

#include "core/study/study.h"
#include "server/util/bytes.h"

enum { ANSWER_FORMATS = 7 }; // at most, with the end

typedef struct AnswerFormat {
    const char *extension; // "svg"; NULL: the end
    const char *content_type;
    bool is_binary;                                     // Range requests make sense
    void (*write)(const Variant *answer, Bytes *bytes); // appends the whole document
} AnswerFormat;

// All formats of an answer of this kind, json first.
const AnswerFormat *answer_formats(const Kind *kind);
const AnswerFormat *answer_format_find(const AnswerFormat *formats, const char *extension);

// "json, svg", each behind `before`.
void answer_formats_name(const AnswerFormat *formats, const char *before, char *target,
                         size_t size);

#endif
