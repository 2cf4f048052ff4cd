// Three steps: a scan that bounds what the parser is given, jansson's parser, and decode.c over the
// tree by the rows. The tree takes at most some 25 times the memory of the text.
//
// The scan keeps a stack of frames, one per open bracket: the index in an array, the place of the
// last key in an object. It is no parser: it accepts any bytes, skips strings, and is right up to
// the first byte that is not JSON, which is enough for a pointer to that byte.
#include "server/json/parse.h"

#include <jansson.h>
#include <stdio.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "server/json/decode.h"
#include "server/json/memory.h"

enum { POINTER_SIZE = sizeof((Fault){0}.pointer), KEY_SIZE = 2 * POINTER_SIZE };

typedef struct Frame {
    bool is_array;
    size_t index;        // of the element or member
    size_t key, key_end; // the text between the quotes; 0: no key yet
} Frame;

typedef struct Scan {
    const char *text;
    size_t at;
    size_t depth, containers;
    bool is_key_next;
    Frame frames[JSON_DEPTH_MAX];
} Scan;

static bool scan_is_too_deep(const Scan *scan) {
    return scan->depth > JSON_DEPTH_MAX;
}

static Frame *scan_frame(Scan *scan) {
    return scan->depth > 0 && !scan_is_too_deep(scan) ? &scan->frames[scan->depth - 1] : NULL;
}

static void scan_string(Scan *scan, size_t stop) {
    Frame *frame = scan_frame(scan);
    const size_t start = ++scan->at;
    while (scan->at < stop && scan->text[scan->at] != '"')
        scan->at += scan->text[scan->at] == '\\' ? 2 : 1;
    if (scan->at > stop)
        scan->at = stop;
    if (scan->is_key_next && frame != NULL) {
        frame->key = start;
        frame->key_end = scan->at;
        scan->is_key_next = false;
    }
    if (scan->at < stop)
        scan->at++;
}

// Advances by one token, never beyond `stop`.
static void scan_step(Scan *scan, size_t stop) {
    const char c = scan->text[scan->at];
    Frame *frame = scan_frame(scan);
    if (c == '"') {
        scan_string(scan, stop);
        return;
    }
    if (c == '{' || c == '[') {
        if (scan->depth < JSON_DEPTH_MAX)
            scan->frames[scan->depth] = (Frame){.is_array = c == '['};
        scan->depth++;
        scan->containers++;
        scan->is_key_next = c == '{';
    } else if (c == '}' || c == ']') {
        scan->depth -= scan->depth > 0 ? 1 : 0;
        scan->is_key_next = false;
    } else if (c == ',' && frame != NULL) {
        frame->index++;
        frame->key = frame->key_end = 0;
        scan->is_key_next = !frame->is_array;
    }
    scan->at++;
}

// NULL if the text may be parsed, else why not; the place is then in *position.
static const char *scan_check(const char *text, size_t size, size_t *position) {
    const char *nul = memchr(text, '\0', size);
    if (nul != NULL) {
        *position = (size_t)(nul - text);
        return "there is a NUL byte; the text must be UTF-8";
    }
    Scan scan = {.text = text};
    while (scan.at < size) {
        scan_step(&scan, size);
        *position = scan.at - 1;
        const Frame *frame = scan_frame(&scan);
        if (scan_is_too_deep(&scan))
            return "objects and arrays are nested more than 32 deep";
        if (frame != NULL && !frame->is_array && frame->index >= JSON_MEMBERS_MAX)
            return "there are more than 4096 members in one object";
        if (scan.containers > JSON_CONTAINERS_MAX)
            return "there are more than 131072 objects and arrays";
    }
    return NULL;
}
_Static_assert(JSON_DEPTH_MAX == 32 && JSON_CONTAINERS_MAX == 131072 && JSON_MEMBERS_MAX == 4096,
               "the sentences name these numbers");

// The key with its escapes decoded, as far as they are valid.
static void scan_key(const Scan *scan, const Frame *frame, char name[KEY_SIZE]) {
    snprintf(name, KEY_SIZE, "%.*s", (int)(frame->key_end - frame->key), scan->text + frame->key);
    if (strchr(name, '\\') == NULL)
        return;
    char document[KEY_SIZE + 4];
    snprintf(document, sizeof document, "[\"%s\"]", name);
    json_t *parsed = json_loads(document, 0, NULL);
    const char *decoded = json_string_value(json_array_get(parsed, 0));
    if (decoded != NULL)
        text_fit(name, KEY_SIZE, decoded);
    json_decref(parsed);
}

// The pointer of text[position], below `base`.
static void scan_pointer(const char *text, size_t position, const char *base,
                         char pointer[POINTER_SIZE]) {
    Scan scan = {.text = text};
    while (scan.at < position && !scan_is_too_deep(&scan))
        scan_step(&scan, position);
    text_fit(pointer, POINTER_SIZE, base);
    for (size_t i = 0; i < scan.depth && i < JSON_DEPTH_MAX; i++) {
        const Frame *frame = &scan.frames[i];
        char parent[POINTER_SIZE], name[KEY_SIZE];
        memcpy(parent, pointer, sizeof parent);
        if (frame->is_array) {
            json_pointer_index(pointer, POINTER_SIZE, parent, frame->index);
        } else if (frame->key > 0) {
            scan_key(&scan, frame, name);
            json_pointer_join(pointer, POINTER_SIZE, parent, name);
        }
    }
}

bool scan_list(const char *text, size_t size, const char *name, ScanList *list) {
    Scan scan = {.text = text};
    char key[KEY_SIZE];
    bool is_inside = false;
    *list = (ScanList){.text = text, .end = size};
    while (scan.at < size && !scan_is_too_deep(&scan) && text[scan.at] != '\0') {
        const size_t at = scan.at, depth = scan.depth;
        const Frame outer = scan.frames[0];
        scan_step(&scan, size);
        if (is_inside && scan.depth < 2) {
            list->end = at;
            return true;
        }
        if (is_inside || depth != 1 || scan.depth != 2 || text[at] != '[' || outer.is_array ||
            outer.key == 0)
            continue;
        scan_key(&scan, &outer, key);
        is_inside = strcmp(key, name) == 0;
        list->begin = list->at = at + 1;
    }
    return is_inside && scan.at >= size;
}

static bool scan_is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

bool scan_element(ScanList *list) {
    Scan scan = {.text = list->text, .at = list->at};
    size_t first = list->at;
    if (list->at > list->end)
        return false;
    while (scan.at < list->end && (scan.depth > 0 || list->text[scan.at] != ','))
        scan_step(&scan, list->end);
    size_t last = scan.at;
    const bool is_all = list->at == list->begin && last == list->end;
    list->at = last + 1; // behind the comma
    while (first < last && scan_is_blank(list->text[first]))
        first++;
    while (last > first && scan_is_blank(list->text[last - 1]))
        last--;
    list->first = first;
    list->count = last - first;
    return list->count > 0 || !is_all; // an empty array has no element
}

// A document within a text: text[first ... first + count - 1], which is at `pointer` of the whole.
typedef struct Part {
    const char *text;
    size_t first, count;
    const char *pointer;
    Status status; // of a part that is not JSON
} Part;

static Status part_error(const Part *part, size_t position, const char *sentence,
                         Problem *problem) {
    char pointer[POINTER_SIZE];
    size_t line = 1, column = 1; // of characters, not bytes
    for (size_t i = 0; i < part->first + position; i++) {
        if (part->text[i] == '\n') {
            line++;
            column = 1;
        } else if (((unsigned char)part->text[i] & 0xC0) != 0x80) {
            column++;
        }
    }
    scan_pointer(part->text + part->first, position, part->pointer, pointer);
    return problem_add(problem, part->status, pointer, "line %zu, column %zu: %s", line, column,
                       sentence);
}

static Status part_no_memory(Problem *problem) {
    return problem_set(problem, STATUS_NO_MEMORY, "no memory to read the document");
}

static Status part_syntax_error(const Part *part, const json_error_t *error, Problem *problem) {
    // jansson's position is behind the faulty token, ours is its last byte. Only a byte that is not
    // UTF-8 is not passed.
    size_t position = error->position > 0 ? (size_t)error->position : 0;
    if (position > 0 && json_error_code(error) != json_error_invalid_utf8)
        position--;
    if (position > part->count)
        position = part->count;
    const char *sentence = error->text;
    char token[sizeof error->text + 80];
    switch (json_error_code(error)) {
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
    return part_error(part, position, sentence, problem);
}

static Status part_parse(const Part *part, json_t **root, Problem *problem) {
    const char *text = part->text + part->first;
    size_t position = 0;
    json_error_t error;
    *root = NULL;
    const char *sentence = scan_check(text, part->count, &position);
    if (sentence != NULL)
        return part_error(part, position, sentence, problem);
    bool is_out_of_memory;
    *root = json_memory_load(text, part->count, JSON_REJECT_DUPLICATES | JSON_DECODE_ANY, &error,
                             &is_out_of_memory);
    if (is_out_of_memory)
        return part_no_memory(problem);
    return *root != NULL ? STATUS_OK : part_syntax_error(part, &error, problem);
}

static Status part_decode(const Part *part, const Field *fields, void *item, Problem *problem) {
    Decoder decoder = {.problem = problem};
    json_t *root;
    if (fields_default(fields, item) != STATUS_OK)
        return part_no_memory(problem);
    TRY(part_parse(part, &root, problem));
    decode_root(&decoder, root, fields, item, part->pointer);
    json_decref(root);
    return decoder.is_out_of_memory ? part_no_memory(problem)
           : decoder.is_faulty      ? STATUS_INVALID
                                    : STATUS_OK;
}

size_t scan_mark(const char *text, size_t size) {
    static const char mark[] = "\xEF\xBB\xBF";
    const size_t count = sizeof mark - 1;
    return size >= count && memcmp(text, mark, count) == 0 ? count : 0;
}

Status json_parse(const char *text, size_t size, const Field *fields, void *item,
                  Problem *problem) {
    if (size == 0)
        text = ""; // may be NULL
    const size_t mark = scan_mark(text, size);
    const Part part = {text + mark, 0, size - mark, "", STATUS_UNREADABLE};
    return part_decode(&part, fields, item, problem);
}

Status json_parse_part(const char *text, size_t size, size_t first, size_t count,
                       const char *pointer, const Field *fields, void *item, Problem *problem) {
    (void)size;
    const Part part = {text, first, count, pointer, STATUS_UNREADABLE};
    return part_decode(&part, fields, item, problem);
}

Status json_parse_value(const char *text, size_t size, const Field *field, void *item,
                        const char *pointer, Problem *problem) {
    Decoder decoder = {.problem = problem};
    json_t *root;
    TRY(part_parse(&(Part){text, 0, size, pointer, STATUS_INVALID}, &root, problem));
    decode_value(&decoder, root, field, item, pointer);
    json_decref(root);
    return decoder.is_out_of_memory ? part_no_memory(problem)
           : decoder.is_faulty      ? STATUS_INVALID
                                    : STATUS_OK;
}

json_t *json_parse_tree(const char *text, size_t size) {
    json_t *root;
    if (size == 0)
        return NULL;
    const size_t mark = scan_mark(text, size);
    const Part part = {text + mark, 0, size - mark, "", STATUS_UNREADABLE};
    if (part_parse(&part, &root, NULL) == STATUS_OK && json_is_object(root))
        return root;
    json_decref(root);
    return NULL;
}
