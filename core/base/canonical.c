// A present row is written as its name, a NUL and its value; an object ends with an empty name.
// Texts, lists and arrays begin with their length, so the form is unambiguous.
#include "core/base/canonical.h"

#include <string.h>

typedef struct CanonicalWriter {
    void (*append)(void *context, const void *bytes, size_t size);
    void *context;
    size_t length;
    unsigned char bytes[4096]; // buffer for small pieces
} CanonicalWriter;

static void canonical_flush(CanonicalWriter *writer) {
    if (writer->length > 0)
        writer->append(writer->context, writer->bytes, writer->length);
    writer->length = 0;
}

static void canonical_put(CanonicalWriter *writer, const void *bytes, size_t size) {
    if (size > sizeof writer->bytes - writer->length)
        canonical_flush(writer);
    if (size > sizeof writer->bytes) {
        writer->append(writer->context, bytes, size);
        return;
    }
    memcpy(writer->bytes + writer->length, bytes, size);
    writer->length += size;
}

static void canonical_put_count(CanonicalWriter *writer, uint64_t value) {
    unsigned char bytes[8];
    for (int i = 0; i < 8; i++)
        bytes[i] = (unsigned char)(value >> (8 * i));
    canonical_put(writer, bytes, sizeof bytes);
}

static void canonical_put_real(CanonicalWriter *writer, double value) {
    uint64_t bits;
    value += 0.0; // -0 becomes 0
    memcpy(&bits, &value, sizeof bits);
    canonical_put_count(writer, bits);
}

static void canonical_put_text(CanonicalWriter *writer, const char *text) {
    const size_t length = strlen(text);
    canonical_put_count(writer, length);
    canonical_put(writer, text, length);
}

static void canonical_put_name(CanonicalWriter *writer, const char *name) {
    canonical_put(writer, name, strlen(name) + 1);
}

static void canonical_put_reals(CanonicalWriter *writer, const Reals *reals) {
    canonical_put_count(writer, reals->count);
    for (size_t i = 0; i < reals->count; i++)
        canonical_put_real(writer, reals->at[i]);
}

static void canonical_put_rows(CanonicalWriter *writer, const Field *fields, const void *item);

static void canonical_put_value(CanonicalWriter *writer, const Field *field, const void *member) {
    switch (field->kind) {
    case FIELD_KIND_REAL:
        canonical_put_real(writer, *(const double *)member);
        break;
    case FIELD_KIND_COUNT:
        canonical_put_count(writer, *(const uint64_t *)member);
        break;
    case FIELD_KIND_FLAG:
        canonical_put_count(writer, *(const bool *)member ? 1 : 0);
        break;
    case FIELD_KIND_TEXT:
        canonical_put_text(writer, *(char *const *)member);
        break;
    case FIELD_KIND_CHOICE:
        canonical_put_text(writer, field->choices[*(const int *)member]);
        break;
    case FIELD_KIND_REALS:
        canonical_put_reals(writer, member);
        break;
    case FIELD_KIND_ROWS: {
        const Rows *rows = member;
        canonical_put_count(writer, rows->count);
        for (size_t i = 0; i < rows->count; i++)
            canonical_put_reals(writer, &rows->at[i]);
        break;
    }
    case FIELD_KIND_TEXTS: {
        const Texts *texts = member;
        canonical_put_count(writer, texts->count);
        for (size_t i = 0; i < texts->count; i++)
            canonical_put_text(writer, texts->at[i]);
        break;
    }
    case FIELD_KIND_ITEM:
        canonical_put_rows(writer, field->fields, member);
        canonical_put_name(writer, "");
        break;
    case FIELD_KIND_LIST: {
        List list;
        memcpy(&list, member, sizeof list);
        canonical_put_count(writer, list.count);
        for (size_t i = 0; i < list.count; i++) {
            canonical_put_rows(writer, field->fields, (const char *)list.at + i * field->size);
            canonical_put_name(writer, "");
        }
        break;
    }
    case FIELD_KIND_VARIANT: {
        const Variant *variant = *(Variant *const *)member;
        canonical_put_text(writer, variant->kind->name);
        canonical_put_rows(writer, variant->kind->fields, variant);
        canonical_put_name(writer, "");
        break;
    }
    case FIELD_KIND_BASE:
    case FIELD_KIND_REFCOUNT:
    case FIELD_KIND_END:
        break;
    }
}

static void canonical_put_rows(CanonicalWriter *writer, const Field *fields, const void *item) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        const void *member = (const char *)item + field->offset;
        if (field->kind == FIELD_KIND_BASE) {
            canonical_put_rows(writer, field->fields, member);
        } else if ((field->flags & FIELD_NOTE) == 0 && !field_is_absent(field, item)) {
            canonical_put_name(writer, field->name);
            canonical_put_value(writer, field, member);
        }
    }
}

void canonical_write(const Field *fields, const void *item,
                     void (*append)(void *context, const void *bytes, size_t size), void *context) {
    CanonicalWriter writer = {.append = append, .context = context};
    canonical_put_rows(&writer, fields, item);
    canonical_flush(&writer);
}
