// A material has e and T_c once, for every approach speed, or as a table. Unknown values are
// absent.
#include "core/scene/material.h"
#include "core/base/json_pointer.h"

#include <math.h>
#include <string.h>

#include "core/contact/contact.h"
#include "core/contact/identification.h"

const char *const material_base_names[] = {
    [MATERIAL_BASE_FIXED] = "fixed", [MATERIAL_BASE_FREE] = "free", NULL};

enum { TAG_MAX = 60 };

// clang-format off
static const Field row_fields[] = {
    FIELD_REAL(MaterialRow, approach_speed, "m/s", AT_MIN(0), REQUIRED, "at which these were measured, rising from row to row"),
    FIELD_REAL(MaterialRow, restitution, NULL, WITHIN(0, 1), REQUIRED, "coefficient of restitution e"),
    FIELD_REAL(MaterialRow, contact_time, "s", ABOVE(0), OPTIONAL, "contact time T_c of an isolated impact"),
    FIELD_REAL(MaterialRow, restitution_deviation, NULL, AT_MIN(0), OPTIONAL, "standard deviation of restitution"),
    FIELD_REAL(MaterialRow, contact_time_deviation, "s", AT_MIN(0), OPTIONAL, "standard deviation of contact_time"),
    FIELD_END
};

#define TAGS FIELD_TEXTS(Material, tags, NULL, NULL, 32, PRESENCE_OPTIONAL, 0, "words to find it by, of at most 60 bytes")
#define TABLE FIELD_LIST(Material, table, row_fields, MATERIAL_ROWS, PRESENCE_OPTIONAL, "restitution and contact_time over approach speed, in place of the two; linear between the rows, constant beyond them")
#define MEASUREMENTS FIELD_REALS(Material, measurements, NULL, AT_MIN(1), 1000, PRESENCE_OPTIONAL, "numbers of this material's measurements that restitution and contact_time were taken from")

const Field material_fields[] = {
    FIELD_TEXT(Material, name, 200, PRESENCE_REQUIRED, 0, "its name for people"),
    FIELD_TEXT(Material, kind, 60, PRESENCE_OPTIONAL, 0, "what it is: foam, rubber, metal ..."),
    FIELD_REAL(Material, thickness, "m", ABOVE(0), OPTIONAL, "of the layer at the stop"),
    FIELD_TEXT(Material, hardness, 60, PRESENCE_OPTIONAL, 0, "with its scale, as \"Shore A 40\""),
    FIELD_TEXT(Material, supplier, 200, PRESENCE_OPTIONAL, 0, "who sells it, under what number"),
    FIELD_TEXT(Material, notes, 4000, PRESENCE_OPTIONAL, 0, "further remarks"),
    TAGS,
    FIELD_REAL(Material, restitution, NULL, WITHIN(0, 1), OPTIONAL, "coefficient of restitution e, for every approach speed"),
    FIELD_REAL(Material, restitution_deviation, NULL, AT_MIN(0), OPTIONAL, "standard deviation of restitution"),
    FIELD_REAL(Material, contact_time, "s", ABOVE(0), OPTIONAL, "contact time T_c of an isolated impact, for every approach speed"),
    FIELD_REAL(Material, contact_time_deviation, "s", AT_MIN(0), OPTIONAL, "standard deviation of contact_time"),
    TABLE,
    FIELD_CHOICE(Material, separation, separation_names, OPTIONAL, "rule for the end of a contact, where contact_time was fitted to a force trace"),
    FIELD_REAL(Material, least_speed, "m/s", AT_MIN(0), OPTIONAL, "least approach speed that was measured"),
    FIELD_REAL(Material, most_speed, "m/s", AT_MIN(0), OPTIONAL, "largest approach speed that was measured"),
    FIELD_REAL(Material, least_temperature, "degC", AT_MIN(-273.15), OPTIONAL, "lowest temperature at which it was measured"),
    FIELD_REAL(Material, most_temperature, "degC", AT_MIN(-273.15), OPTIONAL, "highest temperature at which it was measured"),
    FIELD_TEXT(Material, impactor, 200, PRESENCE_OPTIONAL, 0, "what struck it in the test"),
    FIELD_REAL(Material, impactor_mass, "kg", ABOVE(0), OPTIONAL, "mass of the impactor"),
    FIELD_CHOICE(Material, base, material_base_names, OPTIONAL, "what it lay on in the test"),
    FIELD_REAL(Material, base_mass, "kg", ABOVE(0), OPTIONAL, "mass of a free base"),
    FIELD_TEXT(Material, source, 1000, PRESENCE_REQUIRED, 0, "where the numbers come from: DOI, report, test"),
    MEASUREMENTS,
    FIELD_END
};

const Field material_list_fields[] = {TAGS, TABLE, MEASUREMENTS, FIELD_END};
// clang-format on

static bool material_has(double value) {
    return !isnan(value);
}

bool material_slug_is_valid(const char *slug) {
    const size_t size = strlen(slug);
    return size > 0 && size <= MATERIAL_SLUG_MAX &&
           strspn(slug, "abcdefghijklmnopqrstuvwxyz0123456789_-") == size;
}

static Status material_check_text(const char *text, const char *pointer, const char *name,
                                  Problem *problem) {
    if (text == NULL || text[strspn(text, " \t\r\n")] != '\0')
        return STATUS_OK;
    return json_pointer_fault(problem, pointer, name, "must not be empty");
}

static Status material_check_order(double least, double most, const char *unit, const char *pointer,
                                   const char *name, Problem *problem) {
    if (!(most < least))
        return STATUS_OK;
    return json_pointer_fault_real(problem, pointer, name, most, unit,
                                   "must be at least %s %s, the range's other end, is %s",
                                   real_text(least).at, unit, real_text(most).at);
}

static Status material_check_table(const Material *material, const char *pointer,
                                   Problem *problem) {
    const MaterialRows *rows = &material->table;
    Status status = STATUS_OK;
    const JsonPointer table = json_pointer_of(pointer, "table");
    if (rows->count == 1)
        status = problem_add(problem, STATUS_INVALID, table.at,
                             "must have at least two rows, has 1: restitution and contact_time "
                             "alone hold for every approach speed");
    const JsonPointer first = json_pointer_at(table.at, 0);
    const bool is_first_unread = json_pointer_concerns(problem, first.at, "contact_time");
    for (size_t i = 0; i < rows->count; i++) {
        const MaterialRow *row = &rows->at[i];
        const JsonPointer at = json_pointer_at(table.at, i);
        if (material_has(row->contact_time) != material_has(rows->at[0].contact_time) &&
            !is_first_unread)
            status = json_pointer_fault(problem, at.at, "contact_time",
                                        "must be given in every row of the table or in none");
        if (material_has(row->contact_time_deviation) && !material_has(row->contact_time) &&
            !json_pointer_concerns(problem, at.at, "contact_time"))
            status = json_pointer_fault(problem, at.at, "contact_time_deviation",
                                        "needs a contact_time that it belongs to");
        if (i == 0 || !(row->approach_speed <= rows->at[i - 1].approach_speed))
            continue; // also where one is unknown
        status = json_pointer_fault_real(problem, at.at, "approach_speed", row->approach_speed,
                                         "m/s", "must be above the row before, %s m/s, is %s",
                                         real_text(rows->at[i - 1].approach_speed).at,
                                         real_text(row->approach_speed).at);
    }
    return status;
}

// e and T_c once or as a table; a deviation belongs to its value.
static Status material_check_ways(const Material *material, const char *pointer, Problem *problem) {
    const bool has_table = material->table.count > 0;
    const bool has_numbers = material_has(material->restitution) ||
                             material_has(material->contact_time) ||
                             material_has(material->restitution_deviation) ||
                             material_has(material->contact_time_deviation);
    const JsonPointer table = json_pointer_of(pointer, "table");
    if (has_table && has_numbers)
        return problem_add(problem, STATUS_INVALID, table.at,
                           "replaces restitution, contact_time and their deviations: "
                           "leave one of the two out");
    if (has_table || problem_concerns(problem, table.at))
        return STATUS_OK;
    Status status = STATUS_OK;
    if (!material_has(material->restitution))
        status = json_pointer_fault(
            problem, pointer, "restitution",
            "is required, or a table over approach speed: coefficient of restitution e");
    if (material_has(material->contact_time_deviation) && !material_has(material->contact_time) &&
        !json_pointer_concerns(problem, pointer, "contact_time"))
        status = json_pointer_fault(problem, pointer, "contact_time_deviation",
                                    "needs a contact_time that it belongs to");
    return status;
}

static Status material_check_base(const Material *material, const char *pointer, Problem *problem) {
    const JsonPointer base = json_pointer_of(pointer, "base");
    if (problem_concerns(problem, base.at))
        return STATUS_OK;
    if (material_has(material->base_mass) && material->base != MATERIAL_BASE_FREE)
        return json_pointer_fault(
            problem, pointer, "base_mass",
            "is the mass of a free base: write \"base\": \"free\", or leave it out");
    return STATUS_OK;
}

static Status material_check_measurements(const Material *material, const char *pointer,
                                          Problem *problem) {
    Status status = STATUS_OK;
    for (size_t i = 0; i < material->measurements.count; i++) {
        const double number = material->measurements.at[i];
        bool is_again = false;
        for (size_t k = 0; k < i; k++)
            is_again = is_again || material->measurements.at[k] == number;
        if (!is_again && number == floor(number))
            continue;
        const JsonPointer list = json_pointer_of(pointer, "measurements");
        const JsonPointer place = json_pointer_at(list.at, i);
        status = problem_add_real(problem, STATUS_INVALID, place.at, number, NULL,
                                  is_again ? "is listed twice, %s"
                                           : "must be the number of a measurement, is %s",
                                  real_text(number).at);
    }
    return status;
}

static Status material_check_tags(const Material *material, const char *pointer, Problem *problem) {
    Status status = STATUS_OK;
    for (size_t i = 0; i < material->tags.count; i++) {
        const char *tag = material->tags.at[i];
        const size_t size = strlen(tag);
        if (size <= TAG_MAX && tag[strspn(tag, " \t\r\n")] != '\0')
            continue;
        const JsonPointer list = json_pointer_of(pointer, "tags");
        const JsonPointer place = json_pointer_at(list.at, i);
        status = problem_add(problem, STATUS_INVALID, place.at, "must have 1 to %d bytes, %s",
                             TAG_MAX, size > TAG_MAX ? "is longer" : "is empty");
    }
    return status;
}

Status material_validate(const Material *material, const char *pointer, Problem *problem) {
    const Status faults[] = {
        fields_validate(material_fields, material, pointer, problem),
        material_check_text(material->name, pointer, "name", problem),
        material_check_text(material->kind, pointer, "kind", problem),
        material_check_text(material->source, pointer, "source", problem),
        material_check_tags(material, pointer, problem),
        material_check_ways(material, pointer, problem),
        material_check_table(material, pointer, problem),
        material_check_order(material->least_speed, material->most_speed, "m/s", pointer,
                             "most_speed", problem),
        material_check_order(material->least_temperature, material->most_temperature, "degC",
                             pointer, "most_temperature", problem),
        material_check_base(material, pointer, problem),
        material_check_measurements(material, pointer, problem),
    };
    return status_first(faults, COUNT(faults));
}

void material_speed_range(const Material *material, double *least, double *most) {
    const MaterialRows *rows = &material->table;
    *least = material->least_speed;
    *most = material->most_speed;
    if (!material_has(*least) && rows->count > 0)
        *least = rows->at[0].approach_speed;
    if (!material_has(*most) && rows->count > 0)
        *most = rows->at[rows->count - 1].approach_speed;
}

double material_test_mass(const Material *material) {
    if (material->base == MATERIAL_BASE_FIXED)
        return material->impactor_mass;
    if (material->base == MATERIAL_BASE_FREE && material_has(material->impactor_mass) &&
        material_has(material->base_mass))
        return contact_effective_mass(material->impactor_mass, material->base_mass);
    return (double)NAN;
}
