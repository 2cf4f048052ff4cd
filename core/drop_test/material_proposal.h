// The revision that an evaluation would have a material say: shown first, then confirmed by whoever
// sends it as a revision. Not the evaluation (evaluation.h), and nothing is stored here. Used by
// whoever proposes it.
#ifndef CORE_DROP_TEST_MATERIAL_PROPOSAL_H
#define CORE_DROP_TEST_MATERIAL_PROPOSAL_H

#include "core/drop_test/evaluation.h"
#include "core/scene/material.h"

// One e and T_c for every speed, or a table over approach speed.
typedef enum ProposalForm { PROPOSAL_CONSTANT, PROPOSAL_TABLE } ProposalForm;
extern const char *const proposal_form_names[]; // "constant", "table"; NULL-terminated

// Readings whose speeds differ by less are one row of a table.
#define PROPOSAL_BIN 1.1

// What is proposed, or why nothing can be: then `material` is empty. A word of warning goes to the
// evaluation's.
typedef struct MaterialProposal {
    Material material;
    char *why; // NULL: it can be
} MaterialProposal;

// `before` says what the material is: name, kind and so on are taken from it, figures are not.
// STATUS_OK or STATUS_NO_MEMORY. Cleared by material_proposal_clear in any case.
Status material_proposal_run(Evaluation *evaluation, const Measurement *tests, size_t count,
                             const Material *before, ProposalForm form, MaterialProposal *proposal,
                             Problem *problem);
void material_proposal_clear(MaterialProposal *proposal);

#endif
