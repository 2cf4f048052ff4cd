// Three steps: a scan that bounds what the parser may be given, jansson's parse, and a walk over
// the tree by the rows. What the parser holds is at most some 25 times the text.
#include "server/codec/read.h"

#include <jansson.h>
#include <stdio.h>
#include <string.h>

#include "server/codec/scan.h"
#include "server/codec/walk.h"

static Status unreadable(Problem *problem, const char *text, size_t size, size_t position,
                         const char *sentence) {
    ScanPlace place;
    scan_place(text, size, position, &place);
    return problem_add(problem, STATUS_UNREADABLE, place.pointer, "line %zu, column %zu: %s",
                       place.line, place.column, sentence);
}

static Status refuse_parse(Problem *problem, const char *text, size_t size,
                           const json_error_t *error) {
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
    return unreadable(problem, text, size, position, sentence);
}

Status read_json(const char *text, size_t size, const Field *fields, void *item, Problem *problem) {
    if (fields_default(fields, item) != STATUS_OK)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory to read the document");
    if (size == 0)
        text = ""; // may be NULL
    const size_t mark = scan_mark(text, size);
    text += mark;
    size -= mark;
    size_t position;
    const char *sentence;
    if (!scan_allows(text, size, &position, &sentence))
        return unreadable(problem, text, size, position, sentence);
    json_error_t error;
    json_t *root = json_loadb(text, size, JSON_REJECT_DUPLICATES | JSON_DECODE_ANY, &error);
    if (root == NULL)
        return refuse_parse(problem, text, size, &error);
    Reader reader = {.problem = problem};
    if (json_is_object(root))
        walk_object(&reader, root, fields, item, "");
    else
        refuse_type(&reader, "", root, NULL, "an object");
    json_decref(root);
    if (reader.is_out_of_memory)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory to read the document");
    return reader.is_faulty ? STATUS_INVALID : STATUS_OK;
}
