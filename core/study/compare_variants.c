// A rule of separation is the linear contact's alone: the other forms make one entry each.
#include "core/study/compare_variants.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/simulation/impulse_variant.h"
#include "core/simulation/channel_names.h"
#include "core/study/study_run.h"

static const ContactLaw *own_law(const Simulation *simulation) {
    return dampers_contact_law(&simulation->scene.dampers, scene_contact(&simulation->scene));
}

static bool is_there(const CompareEntries *entries, const ContactLaw *law, int separation) {
    for (size_t i = 0; i < entries->count; i++)
        if (strcmp(entries->at[i].contact_model, law->kind.name) == 0 &&
            entries->at[i].separation == separation)
            return true;
    return false;
}

// False without memory.
static bool add(CompareEntries *entries, const ContactLaw *law, int separation) {
    if (law->form != CONTACT_LINEAR)
        separation = CHOICE_ABSENT;
    if (is_there(entries, law, separation) || entries->count == COMPARE_VARIANTS)
        return true;
    CompareEntry *at = realloc(entries->at, (entries->count + 1) * sizeof *at);
    if (at == NULL)
        return false;
    entries->at = at;
    CompareEntry *entry = &at[entries->count++];
    char name[96];
    (void)fields_default(compare_entry_fields, entry); // absent and 0: nothing to allocate
    if (separation == CHOICE_ABSENT)
        snprintf(name, sizeof name, "%s", law->kind.name);
    else
        snprintf(name, sizeof name, "%s, %s", law->kind.name, separation_names[separation]);
    entry->name = strdup(name);
    entry->contact_model = strdup(law->kind.name);
    entry->separation = separation;
    return entry->name != NULL && entry->contact_model != NULL;
}

static int separation_of(const char *name) {
    for (int i = 0; separation_names[i] != NULL; i++)
        if (strcmp(separation_names[i], name) == 0)
            return i;
    return CHOICE_ABSENT;
}

static bool add_law(CompareEntries *entries, const ContactLaw *law, const CompareStudy *study) {
    bool is_whole = true;
    for (size_t i = 0; i < study->separations.count && is_whole; i++)
        is_whole = add(entries, law, separation_of(study->separations.at[i]));
    return is_whole;
}

Status variants_make(const CompareStudy *study, const Simulation *simulation,
                     CompareEntries *entries, Problem *problem) {
    *entries = (CompareEntries){NULL, 0};
    bool is_whole =
        add(entries, own_law(simulation), scene_contact(&simulation->scene)->separation);
    for (size_t i = 0; i < study->models.count && is_whole; i++) {
        const Kind *kind = kind_find(&contact_kinds, study->models.at[i]);
        if (kind != NULL)
            is_whole = add_law(entries, (const ContactLaw *)(const void *)kind, study);
    }
    return is_whole ? STATUS_OK
                    : problem_set(problem, STATUS_NO_MEMORY, "no memory for the study's variants");
}

static Status take_contact(Simulation *target, const ContactLaw *law, int separation,
                           Problem *problem) {
    if (law == own_law(target) &&
        (law->form != CONTACT_LINEAR || scene_contact(&target->scene)->separation == separation))
        return STATUS_OK;
    if (law->form == CONTACT_IMPULSIVE)
        return impulses_take(target, problem);
    Variant *contact = variant_new(&law->kind);
    if (contact == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for a contact model");
    if (law->form == CONTACT_LINEAR)
        ((Contact *)(void *)contact)->separation = separation;
    variant_free(target->scene.contact);
    target->scene.contact = contact;
    return STATUS_OK;
}

static Status name_channel(const Scene *scene, ChannelId channel, uint64_t storey, Texts *names,
                           Problem *problem) {
    char name[CHANNEL_NAME];
    request_channel_name(scene, channel, (size_t)storey, name);
    for (size_t i = 0; i < names->count; i++)
        free(names->at[i]);
    free(names->at);
    *names = (Texts){calloc(1, sizeof *names->at), 0};
    if (names->at != NULL && (names->at[0] = strdup(name)) != NULL)
        names->count = 1;
    return names->count == 1 ? STATUS_OK
                             : problem_set(problem, STATUS_NO_MEMORY, "no memory for a channel");
}

Status variant_apply(const CompareStudy *study, const Simulation *simulation,
                     const CompareEntry *entry, const SimulationLimits *limits, Simulation *target,
                     Problem *problem) {
    const Kind *kind = kind_find(&contact_kinds, entry->contact_model);
    Output *output = &target->output;
    TRY(member_copy(simulation, target, problem));
    TRY(member_settle(target, problem));
    TRY(take_contact(target, (const ContactLaw *)(const void *)kind, entry->separation, problem));
    TRY(name_channel(&target->scene, CHANNEL_DISPLACEMENT, study->storey, &output->channels,
                     problem));
    TRY(name_channel(&target->scene, CHANNEL_MEAN_ACCELERATION, study->storey,
                     &output->psd.channels, problem));
    output->impacts = true;
    return simulation_complete(target, limits, NULL, problem);
}
