// The material revision that an evaluation proposes.
#ifndef CORE_DROP_TEST_MATERIAL_PROPOSAL_H
#define CORE_DROP_TEST_MATERIAL_PROPOSAL_H

#include "core/drop_test/evaluation.h"
#include "core/scene/material.h"

// One e and T_c for every speed, or a table over approach speed.
typedef enum ProposalForm { PROPOSAL_CONSTANT, PROPOSAL_TABLE } ProposalForm;
extern const char *const proposal_form_names[]; // "constant", "table"; NULL-terminated

// Readings whose speeds differ by a smaller factor share one row of a table.
#define PROPOSAL_BIN 1.1

// The revision, or why there is none: then `material` is empty. Warnings go to the evaluation's.
typedef struct MaterialProposal {
    Material material;
    char *why; // NULL: there is one
} MaterialProposal;

// Name, kind and so on are those of `before`, its figures are not. STATUS_OK or STATUS_NO_MEMORY.
// Released by material_proposal_clear in any case.
Status material_proposal_run(Evaluation *evaluation, const Measurement *tests, size_t count,
                             const Material *before, ProposalForm form, MaterialProposal *proposal,
                             Problem *problem);
void material_proposal_clear(MaterialProposal *proposal);

#endif
