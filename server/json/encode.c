// One pass over the rows. Members are separated by ", ", elements of arrays of numbers by ",".
#include "server/json/encode.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

static void encode_put_members(Bytes *bytes, const Field *fields, const void *item,
                               EncodeStyle style, size_t *count);

static void encode_put_name(Bytes *bytes, const char *name, size_t *count) {
    if ((*count)++ > 0)
        bytes_text(bytes, ", ");
    bytes_json_string(bytes, name);
    bytes_text(bytes, ": ");
}

static void encode_put_reals(Bytes *bytes, const Reals *reals) {
    bytes_text(bytes, "[");
    bytes_reals(bytes, reals->at, reals->count);
    bytes_text(bytes, "]");
}

// Rows of numbers, or texts, which may be JSON.
static void encode_put_list(Bytes *bytes, const Field *field, const List *list) {
    const bool is_json = (field->flags & FIELD_SCALARS) != 0;
    bytes_text(bytes, "[");
    for (size_t i = 0; i < list->count; i++) {
        bytes_text(bytes, i > 0 ? ", " : "");
        if (field->kind == FIELD_KIND_ROWS)
            encode_put_reals(bytes, (const Reals *)list->at + i);
        else
            bytes_json(bytes, is_json ? "%p" : "%s", ((char *const *)list->at)[i]);
    }
    bytes_text(bytes, "]");
}

static void encode_put_variant(Bytes *bytes, const KindTable *kinds, const Variant *variant,
                               EncodeStyle style) {
    size_t count = 0;
    bytes_text(bytes, "{");
    encode_put_name(bytes, kinds->tag, &count);
    bytes_json_string(bytes, variant->kind->name);
    encode_put_members(bytes, variant->kind->fields, variant, style, &count);
    bytes_text(bytes, "}");
}

static void encode_put_value(Bytes *bytes, const Field *field, const void *member,
                             EncodeStyle style) {
    switch (field->kind) {
    case FIELD_KIND_REAL:
        bytes_real(bytes, *(const double *)member);
        break;
    case FIELD_KIND_COUNT:
        bytes_format(bytes, "%" PRIu64, *(const uint64_t *)member);
        break;
    case FIELD_KIND_FLAG:
        bytes_text(bytes, *(const bool *)member ? "true" : "false");
        break;
    case FIELD_KIND_TEXT:
        bytes_json(bytes, (field->flags & FIELD_SCALARS) != 0 ? "%p" : "%s",
                   *(char *const *)member);
        break;
    case FIELD_KIND_CHOICE:
        bytes_json(bytes, (field->flags & FIELD_SCALARS) != 0 ? "%p" : "%s",
                   field->choices[*(const int *)member]);
        break;
    case FIELD_KIND_REALS: {
        const Reals *reals = member;
        if ((field->flags & FIELD_LONE) != 0 && reals->count == 1)
            bytes_real(bytes, reals->at[0]);
        else
            encode_put_reals(bytes, reals);
        break;
    }
    case FIELD_KIND_ROWS:
    case FIELD_KIND_TEXTS:
    case FIELD_KIND_LIST: {
        List list;
        memcpy(&list, member, sizeof list);
        if (field->kind == FIELD_KIND_LIST)
            encode_list(bytes, field->fields, list.at, list.count, field->size, style);
        else
            encode_put_list(bytes, field, &list);
        break;
    }
    case FIELD_KIND_ITEM:
        encode_item(bytes, field->fields, member, style);
        break;
    case FIELD_KIND_VARIANT:
        encode_put_variant(bytes, field->kinds, *(Variant *const *)member, style);
        break;
    case FIELD_KIND_BASE:
    case FIELD_KIND_REFCOUNT:
    case FIELD_KIND_END:
        break;
    }
}

// Whether the member is empty and null says so: left out it would be read back with its defaults.
static bool encode_is_emptied(const Field *field, const void *item) {
    const bool is_numbers = field->kind == FIELD_KIND_REALS || field->kind == FIELD_KIND_ROWS;
    if (is_numbers && (field->flags & FIELD_NULL_IS_EMPTY) != 0)
        return field_is_absent(field, item);
    if (field->kind == FIELD_KIND_TEXT && (field->flags & FIELD_NULL_IS_EMPTY) != 0) {
        const char *text = *(char *const *)(const void *)((const char *)item + field->offset);
        return text != NULL && text[0] == '\0';
    }
    Field optional = *field;
    optional.presence = PRESENCE_OPTIONAL;
    return field->kind == FIELD_KIND_ITEM && (field->flags & FIELD_NULL_IS_EMPTY) != 0 &&
           field->presence == PRESENCE_DEFAULT && field_is_absent(&optional, item);
}

static bool encode_is_array(const Field *field) {
    return field->kind == FIELD_KIND_REALS || field->kind == FIELD_KIND_ROWS ||
           field->kind == FIELD_KIND_TEXTS || field->kind == FIELD_KIND_LIST;
}

static void encode_put_members(Bytes *bytes, const Field *fields, const void *item,
                               EncodeStyle style, size_t *count) {
    for (const Field *field = fields; field->kind != FIELD_KIND_END; field++) {
        const void *member = (const char *)item + field->offset;
        if (field->kind == FIELD_KIND_BASE) {
            encode_put_members(bytes, field->fields, member, style, count);
            continue;
        }
        const bool is_absent = field_is_absent(field, item);
        if (is_absent && (style == WRITE_SCENE || (field->flags & FIELD_HIDDEN) != 0))
            continue;
        encode_put_name(bytes, field->name, count);
        if ((is_absent && !encode_is_array(field)) || encode_is_emptied(field, item))
            bytes_text(bytes, "null");
        else
            encode_put_value(bytes, field, member, style);
    }
}

size_t encode_members(Bytes *bytes, const Field *fields, const void *item, EncodeStyle style) {
    size_t count = 0;
    encode_put_members(bytes, fields, item, style, &count);
    return count;
}

void encode_item(Bytes *bytes, const Field *fields, const void *item, EncodeStyle style) {
    bytes_text(bytes, "{");
    encode_members(bytes, fields, item, style);
    bytes_text(bytes, "}");
}

void encode_list(Bytes *bytes, const Field *fields, const void *at, size_t count, size_t size,
                 EncodeStyle style) {
    bytes_text(bytes, "[");
    for (size_t i = 0; i < count; i++) {
        if (i > 0)
            bytes_text(bytes, ", ");
        encode_item(bytes, fields, (const char *)at + i * size, style);
    }
    bytes_text(bytes, "]");
}

static void encode_put_fault(Bytes *bytes, const Fault *fault) {
    bytes_json(bytes, "{\"pointer\": %s, \"value\": %p, \"detail\": %s", fault->pointer,
               fault->value[0] != '\0' ? fault->value : NULL, fault->detail);
    if (fault->unit[0] != '\0')
        bytes_json(bytes, ", \"unit\": %s", fault->unit);
    if (fault->did_you_mean[0] != '\0')
        bytes_json(bytes, ", \"did_you_mean\": %s", fault->did_you_mean);
    if (fault->row > 0)
        bytes_json(bytes, ", \"row\": %zu, \"column\": %s", fault->row, fault->column);
    bytes_text(bytes, "}");
}

int encode_problem_code(Status status) {
    // clang-format off
    static const int codes[STATUS_COUNT] = {
        [STATUS_OK] = 200,             [STATUS_UNREADABLE] = 400,     [STATUS_INVALID] = 422,
        [STATUS_USAGE] = 400,          [STATUS_TOO_LARGE] = 413,      [STATUS_UNSUPPORTED_TYPE] = 415,
        [STATUS_NOT_ACCEPTABLE] = 406, [STATUS_UNAUTHORIZED] = 401,   [STATUS_FORBIDDEN] = 403,
        [STATUS_NOT_FOUND] = 404,      [STATUS_METHOD] = 405,         [STATUS_CONFLICT] = 409,
        [STATUS_UNCONDITIONAL] = 428,  [STATUS_STALE] = 412,          [STATUS_GONE] = 410,
        [STATUS_TIMEOUT] = 504,        [STATUS_BUSY] = 503,
        [STATUS_CANCELLED] = 409,      [STATUS_LIMIT] = 422,          [STATUS_UNSTABLE] = 422,
        [STATUS_QUOTA] = 429,          [STATUS_REUSED] = 422,         [STATUS_FULL] = 507,
        [STATUS_NO_MEMORY] = 503,      [STATUS_IO] = 500,             [STATUS_INTERNAL] = 500,
        [STATUS_UNREACHABLE] = 502,
    };
    // clang-format on
    return (size_t)status < COUNT(codes) && codes[status] != 0 ? codes[status] : 500;
}

void encode_problem(Bytes *bytes, const Problem *problem, int status_code, const char *instance) {
    // The type of faults is the scene's alone; those of other documents are a bad request's.
    const bool is_other = problem->status == STATUS_INVALID && problem->whose != NULL;
    bytes_format(bytes, "{\"type\": \"/problems/%s\", \"title\": ",
                 status_slug(is_other ? STATUS_USAGE : problem->status));
    if (problem->status == STATUS_INVALID && problem->count > 0)
        bytes_format(bytes, "\"The %s has %zu fault%s\"",
                     problem->whose != NULL ? problem->whose : "scene", problem->count,
                     problem->count == 1 ? "" : "s");
    else
        bytes_json_string(bytes, status_title(problem->status));
    const char *detail = problem->detail;
    if (detail[0] == '\0')
        detail = problem->count > 0 ? problem->faults[0].detail : status_title(problem->status);
    bytes_json(bytes, ", \"status\": %d, \"detail\": %s", status_code, detail);
    if (instance != NULL && *instance != '\0')
        bytes_json(bytes, ", \"instance\": %s", instance);
    for (size_t i = 0; i < problem->count && i < PROBLEM_FAULTS; i++) {
        bytes_text(bytes, i > 0 ? ", " : ", \"errors\": [");
        encode_put_fault(bytes, &problem->faults[i]);
    }
    bytes_text(bytes, problem->count > 0 ? "]" : "");
    if (problem->count > PROBLEM_FAULTS)
        bytes_format(bytes, ", \"more\": %zu", problem->count - PROBLEM_FAULTS);
    bytes_text(bytes, "}");
}
