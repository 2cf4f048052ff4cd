// Three steps: a scan that bounds what the parser may be given, jansson's parse, and a walk over
// the tree by the rows. What the parser holds is at most some 25 times the text.
#include "server/json/parse.h"

#include <jansson.h>
#include <stdio.h>
#include <string.h>

#include "server/json/decode.h"
#include "server/json/scan.h"

// What is read: a part of a text, by itself a document, which stands at `pointer` of the whole.
typedef struct Part {
    const char *text;
    size_t size, first, count;
    const char *pointer;
    Status status; // of what is no JSON
} Part;

static Status unreadable(Problem *problem, const Part *part, size_t position,
                         const char *sentence) {
    ScanPlace whole, place;
    char pointer[sizeof((Fault){0}.pointer)];
    scan_place(part->text, part->size, part->first + position, &whole);
    scan_place(part->text + part->first, part->count, position, &place);
    char both[2 * sizeof pointer];
    snprintf(both, sizeof both, "%s%s", part->pointer, place.pointer);
    text_fit(pointer, sizeof pointer, both);
    return problem_add(problem, part->status, pointer, "line %zu, column %zu: %s", whole.line,
                       whole.column, sentence);
}

static Status refuse_parse(Problem *problem, const Part *part, const json_error_t *error) {
    // The parser's position is behind the token it stumbled over; ours is the token's last byte. A
    // byte that is no UTF-8 it does not get to pass.
    size_t position = error->position > 0 ? (size_t)error->position : 0;
    if (position > 0 && json_error_code(error) != json_error_invalid_utf8)
        position--;
    const char *sentence = error->text;
    char token[sizeof error->text + 80];
    switch (json_error_code(error)) {
    case json_error_out_of_memory:
        return problem_set(problem, STATUS_NO_MEMORY, "no memory to read the document");
    case json_error_duplicate_key:
        sentence = "the key stands twice in its object";
        break;
    case json_error_numeric_overflow:
        sentence = "the number is too large: reals go to 1.797e308, whole numbers to "
                   "9223372036854775807";
        break;
    case json_error_premature_end_of_input:
        sentence = "the document ends before it is complete";
        break;
    case json_error_end_of_input_expected:
        sentence = "the document is complete before this; nothing may follow";
        break;
    case json_error_invalid_utf8:
        sentence = "the text is not UTF-8 here";
        break;
    case json_error_null_character:
        sentence = "\\u0000 is not allowed";
        break;
    case json_error_null_byte_in_key:
        sentence = "\\u0000 is not allowed in a key";
        break;
    case json_error_invalid_syntax:
        snprintf(token, sizeof token,
                 "%s; a number is like 0.5 or 2e-3 (not NaN, .5 or 01), a text stands in quotes",
                 error->text);
        if (strncmp(error->text, "invalid token", 13) == 0)
            sentence = token;
        break;
    default:
        break;
    }
    return unreadable(problem, part, position, sentence);
}

static Status no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory to read the document");
}

static Status parse(const Part *part, json_t **root, Problem *problem) {
    const char *text = part->text + part->first, *sentence;
    size_t position;
    json_error_t error;
    *root = NULL;
    if (!scan_allows(text, part->count, &position, &sentence))
        return unreadable(problem, part, position, sentence);
    *root = json_loadb(text, part->count, JSON_REJECT_DUPLICATES | JSON_DECODE_ANY, &error);
    return *root != NULL ? STATUS_OK : refuse_parse(problem, part, &error);
}

static Status told(const Decoder *reader) {
    if (reader->is_out_of_memory)
        return no_memory(reader->problem);
    return reader->is_faulty ? STATUS_INVALID : STATUS_OK;
}

static Status read_part(const Part *part, const Field *fields, void *item, Problem *problem) {
    Decoder reader = {.problem = problem};
    json_t *root;
    TRY(parse(part, &root, problem));
    if (json_is_object(root))
        decode_object(&reader, root, fields, item, part->pointer);
    else
        decode_error_type(&reader, part->pointer, root, NULL, "an object");
    json_decref(root);
    return told(&reader);
}

Status json_parse(const char *text, size_t size, const Field *fields, void *item,
                  Problem *problem) {
    if (fields_default(fields, item) != STATUS_OK)
        return no_memory(problem);
    if (size == 0)
        text = ""; // may be NULL
    const size_t mark = scan_mark(text, size);
    return read_part(&(Part){text + mark, size - mark, 0, size - mark, "", STATUS_UNREADABLE},
                     fields, item, problem);
}

Status json_parse_part(const char *text, size_t size, size_t first, size_t count,
                       const char *pointer, const Field *fields, void *item, Problem *problem) {
    if (fields_default(fields, item) != STATUS_OK)
        return no_memory(problem);
    return read_part(&(Part){text, size, first, count, pointer, STATUS_UNREADABLE}, fields, item,
                     problem);
}

Status json_parse_value(const char *text, size_t size, const Field *field, void *item,
                        const char *pointer, Problem *problem) {
    Decoder reader = {.problem = problem};
    json_t *root;
    TRY(parse(&(Part){text, size, 0, size, pointer, STATUS_INVALID}, &root, problem));
    decode_value(&reader, root, field, item, pointer);
    json_decref(root);
    return told(&reader);
}
