// Materials, read only: the view material_states says of each revision what the last review made of
// it.
#include <stdlib.h>
#include <string.h>

#include "server/store/access.h"
#include "server/store/material_memory.h"
#include "server/store/store.h"

// clang-format off
const Field material_fields[] = {
    FIELD_TEXT(MaterialRevision, slug, 64, PRESENCE_REQUIRED, 0, "its name in scenes"),
    FIELD_TEXT(MaterialRevision, name, 200, PRESENCE_REQUIRED, 0, "its name for people"),
    FIELD_COUNT(MaterialRevision, revision, NULL, AT_LEAST(1), REQUIRED, "revisions are counted from 1 and never change"),
    FIELD_TEXT(MaterialRevision, status, 16, PRESENCE_REQUIRED, 0, "draft, approved or deprecated"),
    FIELD_REAL(MaterialRevision, restitution, NULL, WITHIN(0, 1), REQUIRED, "coefficient of restitution e"),
    FIELD_REAL(MaterialRevision, contact_time, "s", ABOVE(0), OPTIONAL, "contact time T_c of an isolated impact"),
    FIELD_TEXT(MaterialRevision, source, 1000, PRESENCE_REQUIRED, 0, "where the numbers come from"),
    FIELD_END
};

static const RowColumn material_columns[] = {
    ROW_COLUMN(MaterialRevision, slug, COLUMN_TEXT),
    ROW_COLUMN(MaterialRevision, name, COLUMN_TEXT),
    ROW_COLUMN(MaterialRevision, revision, COLUMN_COUNT),
    ROW_COLUMN(MaterialRevision, status, COLUMN_TEXT),
    ROW_COLUMN(MaterialRevision, restitution, COLUMN_REAL),
    ROW_COLUMN(MaterialRevision, contact_time, COLUMN_REAL),
    ROW_COLUMN(MaterialRevision, source, COLUMN_TEXT),
    ROW_END
};
// clang-format on

typedef struct Key {
    char *slug;
    uint64_t revision;
} Key;
static const RowColumn key_columns[] = {ROW_COLUMN(Key, slug, COLUMN_TEXT),
                                        ROW_COLUMN(Key, revision, COLUMN_COUNT), ROW_END};

// The head: an approved revision before any other, the newest first; a deprecated one is nobody's
// head.
static const char head_sql[] =
    "SELECT * FROM material_states WHERE slug = :slug AND status <> 'deprecated' "
    "ORDER BY status = 'approved' DESC, revision DESC LIMIT 1";
static const char revision_sql[] =
    "SELECT * FROM material_states WHERE slug = :slug AND revision = :revision";
static const char heads_sql[] = "SELECT * FROM (SELECT *, row_number() OVER (PARTITION BY slug "
                                "ORDER BY status = 'approved' DESC, "
                                "status = 'draft' DESC, revision DESC) AS place FROM "
                                "material_states) WHERE place = 1 ORDER BY slug";

Status store_material(Store *store, const char *slug, uint64_t revision, MaterialRevision *material,
                      Problem *problem) {
    // SQLite counts with a sign; no revision is that high.
    const Key key = {(char *)slug, revision > INT64_MAX ? INT64_MAX : revision};
    MaterialMemory *memory = store_material_memory(store);
    const uint64_t generation = store_generation(store);
    bool is_found;
    memset(material, 0, sizeof *material);
    if (material_memory_find(memory, generation, slug, revision, material))
        return STATUS_OK;
    TRY(store_first(store, revision == 0 ? head_sql : revision_sql, key_columns, &key,
                    material_columns, material, &is_found, problem));
    if (is_found) {
        material_memory_put(memory, generation, revision, material);
        return STATUS_OK;
    }
    if (revision == 0)
        return problem_set(problem, STATUS_NOT_FOUND, "there is no material \"%.64s\"", slug);
    return problem_set(problem, STATUS_NOT_FOUND,
                       "there is no material \"%.64s\" with a revision %llu", slug,
                       (unsigned long long)revision);
}

Status store_materials(Store *store, MaterialRevisions *materials, Problem *problem) {
    void *at;
    const Status status = store_all(store, heads_sql, NULL, NULL, material_columns,
                                    sizeof *materials->at, &at, &materials->count, problem);
    materials->at = at;
    if (status != STATUS_OK)
        material_revisions_clear(materials);
    return status;
}

void material_revisions_clear(MaterialRevisions *materials) {
    for (size_t i = 0; i < materials->count; i++)
        row_clear(material_columns, &materials->at[i], sizeof materials->at[i]);
    free(materials->at);
    *materials = (MaterialRevisions){0};
}
