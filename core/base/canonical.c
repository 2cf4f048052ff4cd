// Each present row is its name and a NUL, then its value; an object ends with an empty name. Texts,
// lists and arrays begin with their length, so no value can be mistaken for another's beginning.
#include "core/base/canonical.h"

#include <string.h>

typedef struct Writer {
    void (*take)(void *context, const void *bytes, size_t size);
    void *context;
    size_t length;
    unsigned char bytes[4096]; // small pieces gathered
} Writer;

static void flush(Writer *writer) {
    if (writer->length > 0)
        writer->take(writer->context, writer->bytes, writer->length);
    writer->length = 0;
}

static void put(Writer *writer, const void *bytes, size_t size) {
    if (size > sizeof writer->bytes - writer->length)
        flush(writer);
    if (size > sizeof writer->bytes) {
        writer->take(writer->context, bytes, size);
        return;
    }
    memcpy(writer->bytes + writer->length, bytes, size);
    writer->length += size;
}

static void put_count(Writer *writer, uint64_t value) {
    unsigned char bytes[8];
    for (int i = 0; i < 8; i++)
        bytes[i] = (unsigned char)(value >> (8 * i));
    put(writer, bytes, sizeof bytes);
}

static void put_real(Writer *writer, double value) {
    uint64_t bits;
    value += 0.0; // -0 becomes 0
    memcpy(&bits, &value, sizeof bits);
    put_count(writer, bits);
}

static void put_text(Writer *writer, const char *text) {
    const size_t length = strlen(text);
    put_count(writer, length);
    put(writer, text, length);
}

static void put_name(Writer *writer, const char *name) {
    put(writer, name, strlen(name) + 1);
}

static void put_reals(Writer *writer, const Reals *reals) {
    put_count(writer, reals->count);
    for (size_t i = 0; i < reals->count; i++)
        put_real(writer, reals->at[i]);
}

static void put_rows(Writer *writer, const Field *fields, const void *item);

static void put_value(Writer *writer, const Field *field, const void *member) {
    switch (field->kind) {
    case FIELD_KIND_REAL:
        put_real(writer, *(const double *)member);
        break;
    case FIELD_KIND_COUNT:
        put_count(writer, *(const uint64_t *)member);
        break;
    case FIELD_KIND_FLAG:
        put_count(writer, *(const bool *)member ? 1 : 0);
        break;
    case FIELD_KIND_TEXT:
        put_text(writer, *(char *const *)member);
        break;
    case FIELD_KIND_CHOICE:
        put_text(writer, field->choices[*(const int *)member]);
        break;
    case FIELD_KIND_REALS:
        put_reals(writer, member);
        break;
    case FIELD_KIND_ROWS: {
        const Rows *rows = member;
        put_count(writer, rows->count);
        for (size_t i = 0; i < rows->count; i++)
            put_reals(writer, &rows->at[i]);
        break;
    }
    case FIELD_KIND_TEXTS: {
        const Texts *texts = member;
        put_count(writer, texts->count);
        for (size_t i = 0; i < texts->count; i++)
            put_text(writer, texts->at[i]);
        break;
    }
    case FIELD_KIND_ITEM:
        put_rows(writer, field->fields, member);
        put_name(writer, "");
        break;
    case FIELD_KIND_LIST: {
        List list;
        memcpy(&list, member, sizeof list);
        put_count(writer, list.count);
        for (size_t i = 0; i < list.count; i++) {
            put_rows(writer, field->fields, (const char *)list.at + i * field->size);
            put_name(writer, "");
        }
        break;
    }
    case FIELD_KIND_VARIANT: {
        const Variant *variant = *(Variant *const *)member;
        put_text(writer, variant->kind->name);
        put_rows(writer, variant->kind->fields, variant);
        put_name(writer, "");
        break;
    }
    case FIELD_KIND_BASE:
    case FIELD_KIND_SHARED:
    case FIELD_KIND_END:
        break;
    }
}

static void put_rows(Writer *writer, const Field *fields, const void *item) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        const void *member = (const char *)item + field->offset;
        if (field->kind == FIELD_KIND_BASE) {
            put_rows(writer, field->fields, member);
        } else if ((field->flags & FIELD_NOTE) == 0 && !field_is_absent(field, item)) {
            put_name(writer, field->name);
            put_value(writer, field, member);
        }
    }
}

void canonical_write(const Field *fields, const void *item,
                     void (*take)(void *context, const void *bytes, size_t size), void *context) {
    Writer writer = {.take = take, .context = context};
    put_rows(&writer, fields, item);
    flush(&writer);
}
