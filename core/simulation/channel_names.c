// With one storey and at most one damper channels have bare names. Otherwise the channel of each
// storey and damper carries its number from 1. So one quantity has one name, and equal scenes have
// one canonical form.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/json_pointer.h"
#include "core/base/spelling.h"
#include "core/simulation/internal.h"

static const ChannelId usual[] = {CHANNEL_DISPLACEMENT, CHANNEL_VELOCITY, CHANNEL_ACCELERATION,
                                  CHANNEL_DAMPER_DISPLACEMENT, CHANNEL_CONTACT_FORCE};

typedef struct ChannelCounts {
    size_t storeys, dampers;
    bool are_numbered;
    const StructureKind *structure;
} ChannelCounts;

static ChannelCounts channel_counts(const Scene *scene) {
    const size_t storeys = structure_storeys(scene_structure(scene));
    return (ChannelCounts){storeys, scene->dampers.count, storeys > 1 || scene->dampers.count > 1,
                           structure_kind(scene_structure(scene))};
}

// Number of channels of that kind.
static size_t channel_counts_of(const ChannelCounts *counts, const Channel *channel) {
    if (channel == &channels[CHANNEL_STOREY_DRIFT] && !counts->structure->has_drifts)
        return 0;
    return channel->owner == CHANNEL_OF_STOREY   ? counts->storeys
           : channel->owner == CHANNEL_OF_DAMPER ? counts->dampers
                                                 : 1;
}

static bool channel_counts_is_numbered(const ChannelCounts *counts, const Channel *channel) {
    return counts->are_numbered && channel->owner != CHANNEL_OF_BASE;
}

// `number` is from 1.
static void channel_counts_name(const ChannelCounts *counts, const Channel *channel, size_t number,
                                char target[CHANNEL_NAME]) {
    if (channel_counts_is_numbered(counts, channel))
        snprintf(target, CHANNEL_NAME, "%s_%zu", channel->name, number);
    else
        snprintf(target, CHANNEL_NAME, "%s", channel->name);
}

void channel_names_write(const Scene *scene, ChannelId channel, size_t number,
                         char target[CHANNEL_NAME]) {
    const ChannelCounts counts = channel_counts(scene);
    channel_counts_name(&counts, &channels[channel], number, target);
}

size_t channel_names_usual_count(const Scene *scene) {
    const ChannelCounts counts = channel_counts(scene);
    size_t count = 0;
    for (size_t i = 0; i < COUNT(usual); i++)
        count += channel_counts_of(&counts, &channels[usual[i]]);
    return count;
}

Status channel_names_add(const Scene *scene, ChannelId channel, size_t number, Texts *names) {
    char name[CHANNEL_NAME];
    channel_names_write(scene, channel, number, name);
    for (size_t i = 0; i < names->count; i++)
        if (strcmp(names->at[i], name) == 0)
            return STATUS_OK;
    return texts_append(names, name);
}

static Status channel_names_append_usual(Texts *names, const ChannelCounts *counts,
                                         bool is_spectrum) {
    static const ChannelId of_spectrum[] = {CHANNEL_MEAN_ACCELERATION};
    const ChannelId *ids = is_spectrum ? of_spectrum : usual;
    for (size_t i = 0; i < (is_spectrum ? COUNT(of_spectrum) : COUNT(usual)); i++) {
        const Channel *channel = &channels[ids[i]];
        const size_t last = channel_counts_of(counts, channel);
        for (size_t number = is_spectrum ? last : 1; number <= last; number++) {
            char name[CHANNEL_NAME];
            channel_counts_name(counts, channel, number, name);
            TRY(texts_append(names, name));
        }
    }
    return STATUS_OK;
}

// The names that one entry of the list was replaced by.
typedef struct ExpandedNames {
    size_t at, count;
} ExpandedNames;

// Index in the requested list of what is now name `i`.
static size_t expanded_names_index(const ExpandedNames *expanded, size_t i) {
    if (i < expanded->at)
        return i;
    return i < expanded->at + expanded->count ? expanded->at : i - expanded->count + 1;
}

// Replaces the first CHANNEL_USUAL; a second one stays and is refused.
static Status channel_names_expand(Texts *names, const ChannelCounts *counts, bool is_spectrum,
                                   ExpandedNames *expanded, Problem *problem) {
    size_t place = 0;
    while (place < names->count && strcmp(names->at[place], CHANNEL_USUAL) != 0)
        place++;
    if (place == names->count)
        return STATUS_OK;
    Texts all = {NULL, 0};
    Status status = STATUS_OK;
    for (size_t i = 0; i < names->count && status == STATUS_OK; i++)
        status = i == place ? channel_names_append_usual(&all, counts, is_spectrum)
                            : texts_append(&all, names->at[i]);
    if (status != STATUS_OK) {
        texts_clear(&all);
        return problem_set(problem, status, "no memory for the channels");
    }
    *expanded = (ExpandedNames){place, all.count - names->count + 1};
    texts_clear(names);
    *names = all;
    return STATUS_OK;
}

// Offers the channels that the scene has, or all if it is not known.
static Status channel_names_reject(const char *name, const ChannelCounts *counts,
                                   const char *pointer, Problem *problem) {
    const char *offered[1 + CHANNEL_COUNT + 1];
    size_t count = 0, length;
    for (size_t i = 0; channel_requests[i] != NULL; i++)
        if (i == 0 || counts->structure == NULL || channel_counts_of(counts, &channels[i - 1]) > 0)
            offered[count++] = channel_requests[i];
    offered[count] = NULL;
    (void)field_name_number(name, &length);
    return spelling_reject_numbered(offered, name, length, pointer, problem);
}

static Status channel_names_check(const char *name, const ChannelCounts *counts,
                                  const char *pointer, Problem *problem) {
    size_t number;
    const Channel *channel = channel_find(name, &number);
    const bool is_usual = strcmp(name, CHANNEL_USUAL) == 0;
    if (channel == NULL && !is_usual)
        return channel_names_reject(name, counts, pointer, problem);
    if (counts->structure == NULL)
        return STATUS_OK;
    if (is_usual)
        return problem_add(problem, STATUS_INVALID, pointer, "is asked for twice");
    const size_t most = channel_counts_of(counts, channel);
    if (most == 0 && channel->owner == CHANNEL_OF_STOREY)
        return problem_add(problem, STATUS_INVALID, pointer,
                           "%s needs a structure of the kind frame, this one is of the kind %s",
                           name, counts->structure->kind.name);
    if (most == 0)
        return problem_add(problem, STATUS_INVALID, pointer,
                           "%s needs a damper, the scene has none", name);
    const bool is_numbered = channel_counts_is_numbered(counts, channel);
    if (is_numbered ? number >= 1 && number <= most : number == 0)
        return STATUS_OK;
    char meant[CHANNEL_NAME], last[CHANNEL_NAME], names[160], detail[sizeof((Fault){0}.detail)];
    channel_counts_name(counts, channel,
                        number > most || channel->owner == CHANNEL_OF_STOREY ? most : 1, meant);
    channel_counts_name(counts, channel, most, last);
    if (most == 1)
        snprintf(names, sizeof names, "be %s", last);
    else
        snprintf(names, sizeof names, "carry the number of a %s, from %s_1 to %s",
                 channel->owner == CHANNEL_OF_STOREY ? "storey" : "damper", channel->name, last);
    if (is_numbered)
        snprintf(detail, sizeof detail, "must %s: the scene has %zu storey%s and %zu damper%s",
                 names, counts->storeys, counts->storeys == 1 ? "" : "s", counts->dampers,
                 counts->dampers == 1 ? "" : "s");
    else
        snprintf(detail, sizeof detail, "must be %s, without a number: there is only one", meant);
    Fault fault = {0};
    text_fit(fault.pointer, sizeof fault.pointer, pointer);
    text_quote(fault.value, sizeof fault.value, name);
    text_fit(fault.did_you_mean, sizeof fault.did_you_mean, meant);
    text_fit(fault.detail, sizeof fault.detail, detail);
    return problem_add_fault(problem, STATUS_INVALID, &fault);
}

Status channel_names_complete(const Scene *scene, Texts *names, bool is_spectrum,
                              const char *pointer, Problem *problem) {
    const bool are_known =
        scene_storeys(scene, problem) > 0 && !problem_concerns(problem, "/dampers");
    const ChannelCounts counts = are_known ? channel_counts(scene) : (ChannelCounts){0};
    ExpandedNames expanded = {0, 1};
    if (are_known)
        TRY(channel_names_expand(names, &counts, is_spectrum, &expanded, problem));
    Status status = STATUS_OK;
    for (size_t i = 0; i < names->count; i++) {
        const JsonPointer place = json_pointer_at(pointer, expanded_names_index(&expanded, i));
        if (channel_names_check(names->at[i], &counts, place.at, problem) != STATUS_OK)
            status = STATUS_INVALID;
        size_t first = 0;
        while (first < i && strcmp(names->at[i], names->at[first]) != 0)
            first++;
        if (first < i)
            status = problem_add(problem, STATUS_INVALID, place.at,
                                 "%.64s is asked for twice, first at %s/%zu", names->at[i], pointer,
                                 expanded_names_index(&expanded, first));
    }
    return status;
}
