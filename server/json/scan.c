// The path to a byte is a stack of frames, one per open bracket: in an array the index, in an
// object where the text of the last key stands. Strings are skipped, so that brackets within them
// do not count. Keys are decoded only when a pointer is wanted.
#include "server/json/scan.h"

#include <jansson.h>
#include <stdio.h>
#include <string.h>

#include "core/base/field.h"
#include "core/base/json_pointer.h"
#include "server/json/parse.h"

enum { KEY_SIZE = 512 }; // more of a key fits into no pointer

typedef struct Frame {
    bool is_array;
    bool has_key;
    size_t index;
    size_t key, key_end; // the text between the quotes
} Frame;

typedef struct Scan {
    const char *text;
    size_t at;
    size_t depth, containers;
    bool is_key_next;
    Frame frames[JSON_DEPTH_MAX];
} Scan;

static bool is_too_deep(const Scan *scan) {
    return scan->depth > JSON_DEPTH_MAX;
}

static bool has_too_many_members(const Scan *scan) {
    const Frame *frame = scan->depth > 0 ? &scan->frames[scan->depth - 1] : NULL;
    return frame != NULL && !frame->is_array && frame->index >= SCAN_MEMBERS;
}

static void open_container(Scan *scan, bool is_array) {
    if (scan->depth < JSON_DEPTH_MAX)
        scan->frames[scan->depth] = (Frame){.is_array = is_array};
    scan->depth++;
    scan->containers++;
    scan->is_key_next = !is_array;
}

static void skip_string(Scan *scan, size_t stop) {
    const size_t start = ++scan->at;
    while (scan->at < stop && scan->text[scan->at] != '"')
        scan->at += scan->text[scan->at] == '\\' ? 2 : 1;
    if (scan->at > stop)
        scan->at = stop;
    if (scan->is_key_next && scan->depth > 0) {
        Frame *frame = &scan->frames[scan->depth - 1];
        frame->has_key = true;
        frame->key = start;
        frame->key_end = scan->at;
        scan->is_key_next = false;
    }
    if (scan->at < stop)
        scan->at++;
}

// Goes on by one token, never beyond `stop`.
static void step(Scan *scan, size_t stop) {
    switch (scan->text[scan->at]) {
    case '"':
        skip_string(scan, stop);
        return;
    case '{':
    case '[':
        open_container(scan, scan->text[scan->at] == '[');
        break;
    case '}':
    case ']':
        scan->depth -= scan->depth > 0 ? 1 : 0;
        scan->is_key_next = false;
        break;
    case ',': {
        if (scan->depth == 0)
            break;
        Frame *frame = &scan->frames[scan->depth - 1];
        frame->index++;
        frame->has_key = false;
        scan->is_key_next = !frame->is_array;
        break;
    }
    default:
        break;
    }
    scan->at++;
}

// RFC 8259, section 8.1: it may be ignored. Some editors and shells write one.
size_t scan_mark(const char *text, size_t size) {
    static const char mark[] = "\xEF\xBB\xBF";
    const size_t mark_size = sizeof mark - 1;
    return size >= mark_size && memcmp(text, mark, mark_size) == 0 ? mark_size : 0;
}

bool scan_allows(const char *text, size_t size, size_t *position, const char **sentence) {
    const char *nul = memchr(text, '\0', size);
    if (nul != NULL) {
        *position = (size_t)(nul - text);
        *sentence = "there is a NUL byte; the text must be UTF-8";
        return false;
    }
    Scan scan = {.text = text};
    while (scan.at < size) {
        step(&scan, size);
        if (is_too_deep(&scan)) {
            *position = scan.at - 1;
            *sentence = "objects and arrays are nested more than 32 deep";
            return false;
        }
        if (has_too_many_members(&scan)) {
            *position = scan.at - 1;
            *sentence = "there are more than 4096 members in one object";
            return false;
        }
        if (scan.containers > SCAN_CONTAINERS) {
            *position = scan.at - 1;
            *sentence = "there are more than 131072 objects and arrays";
            return false;
        }
    }
    return true;
}
_Static_assert(JSON_DEPTH_MAX == 32 && SCAN_CONTAINERS == 131072 && SCAN_MEMBERS == 4096,
               "the sentences name these numbers");

// The key as people know it: escapes decoded by the parser itself, or left where they are none.
static void key_name(const Scan *scan, const Frame *frame, char name[KEY_SIZE]) {
    size_t length = frame->key_end - frame->key;
    if (length > KEY_SIZE - 1)
        length = KEY_SIZE - 1;
    memcpy(name, scan->text + frame->key, length);
    name[length] = '\0';
    if (memchr(name, '\\', length) == NULL)
        return;
    char document[KEY_SIZE + 4];
    snprintf(document, sizeof document, "[\"%s\"]", name);
    json_t *parsed = json_loads(document, 0, NULL);
    const char *decoded = json_string_value(json_array_get(parsed, 0));
    if (decoded != NULL)
        text_fit(name, KEY_SIZE, decoded);
    json_decref(parsed);
}

bool scan_list(const char *text, size_t size, const char *name, ScanList *list) {
    Scan scan = {.text = text};
    char key[KEY_SIZE];
    bool is_inside = false;
    *list = (ScanList){.text = text, .end = size};
    while (scan.at < size && !is_too_deep(&scan) && text[scan.at] != '\0') {
        const size_t at = scan.at, depth = scan.depth;
        const Frame outer = scan.frames[0];
        step(&scan, size);
        if (is_inside && scan.depth < 2) {
            list->end = at;
            return true;
        }
        if (is_inside || depth != 1 || scan.depth != 2 || text[at] != '[' || outer.is_array ||
            !outer.has_key)
            continue;
        key_name(&scan, &outer, key);
        is_inside = strcmp(key, name) == 0;
        list->begin = list->at = at + 1;
    }
    return is_inside && scan.at >= size;
}

static bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

bool scan_element(ScanList *list) {
    Scan scan = {.text = list->text, .at = list->at};
    size_t first = list->at;
    if (list->at > list->end)
        return false;
    while (scan.at < list->end && (scan.depth > 0 || list->text[scan.at] != ','))
        step(&scan, list->end);
    size_t last = scan.at;
    const bool is_all = list->at == list->begin && last == list->end;
    list->at = last + 1; // behind the comma
    while (first < last && is_blank(list->text[first]))
        first++;
    while (last > first && is_blank(list->text[last - 1]))
        last--;
    list->first = first;
    list->count = last - first;
    return list->count > 0 || !is_all; // an array of nothing has none
}

void scan_place(const char *text, size_t size, size_t position, ScanPlace *place) {
    Scan scan = {.text = text};
    const size_t stop = position < size ? position : size;
    while (scan.at < stop && !is_too_deep(&scan))
        step(&scan, stop);

    place->line = place->column = 1;
    for (size_t i = 0; i < stop; i++) {
        if (text[i] == '\n') {
            place->line++;
            place->column = 1;
        } else if (((unsigned char)text[i] & 0xC0) != 0x80) {
            place->column++;
        }
    }

    place->pointer[0] = '\0';
    for (size_t i = 0; i < scan.depth && i < JSON_DEPTH_MAX; i++) {
        const Frame *frame = &scan.frames[i];
        char base[sizeof place->pointer];
        memcpy(base, place->pointer, sizeof base);
        char name[KEY_SIZE];
        if (frame->is_array)
            json_pointer_index(place->pointer, sizeof place->pointer, base, frame->index);
        else if (frame->has_key) {
            key_name(&scan, frame, name);
            json_pointer_join(place->pointer, sizeof place->pointer, base, name);
        }
    }
}
