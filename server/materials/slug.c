#include "server/materials/slug.h"

#include <string.h>

#include "core/scene/material.h"

// "/v1/materials/WORD" is something else.
static const char *const taken[] = {"import"};

static Status refuse(const char *slug, const char *pointer, Problem *problem, const char *detail) {
    Fault fault = {0};
    text_fit(fault.pointer, sizeof fault.pointer, pointer);
    text_fit(fault.detail, sizeof fault.detail, detail);
    text_quote(fault.value, sizeof fault.value, slug);
    return problem_add_fault(problem, STATUS_INVALID, &fault);
}

Status slug_check(const char *slug, const char *pointer, Problem *problem) {
    if (!material_slug_is_valid(slug))
        return refuse(slug, pointer, problem,
                      "must be 1 to 63 of a-z, 0-9, _ and -, as \"soft_rubber\"");
    for (size_t i = 0; i < COUNT(taken); i++)
        if (strcmp(slug, taken[i]) == 0)
            return refuse(slug, pointer, problem,
                          "cannot name a material: /v1/materials/import is where whole catalogues "
                          "are sent to");
    return STATUS_OK;
}
