// One storey and at most one damper: bare names. Otherwise each storey's and each damper's channel
// carries its number from 1. So one quantity has one name, and equal scenes one canonical form.
#include "core/simulation/channel_names.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const ChannelId usual[] = {CHANNEL_DISPLACEMENT, CHANNEL_VELOCITY, CHANNEL_ACCELERATION,
                                  CHANNEL_DAMPER_DISPLACEMENT, CHANNEL_CONTACT_FORCE};

// How many of each a scene has.
typedef struct Owners {
    size_t storeys, dampers;
    bool are_numbered;
} Owners;

static size_t owners_count(const Owners *owners, const Channel *channel) {
    return channel->owner == CHANNEL_OF_STOREY   ? owners->storeys
           : channel->owner == CHANNEL_OF_DAMPER ? owners->dampers
                                                 : 1;
}

// The channel's one name; `number` is from 1.
static void put_name(char target[CHANNEL_NAME], const Owners *owners, const Channel *channel,
                     size_t number) {
    if (owners->are_numbered && channel->owner != CHANNEL_OF_BASE)
        snprintf(target, CHANNEL_NAME, "%s_%zu", channel->name, number);
    else
        snprintf(target, CHANNEL_NAME, "%s", channel->name);
}

static Status add_name(Texts *names, const Owners *owners, const Channel *channel, size_t number) {
    char name[CHANNEL_NAME];
    put_name(name, owners, channel, number);
    char *text = strdup(name);
    if (text == NULL)
        return STATUS_NO_MEMORY;
    names->at[names->count++] = text;
    return STATUS_OK;
}

size_t request_usual_count(const Scene *scene) {
    const Owners owners = {structure_storeys(scene_structure(scene)), scene->dampers.count, false};
    size_t count = 0;
    for (size_t i = 0; i < COUNT(usual); i++)
        count += owners_count(&owners, &channels[usual[i]]);
    return count;
}

static Status add_usual(Texts *names, const Owners *owners, bool is_spectrum) {
    if (is_spectrum)
        return add_name(names, owners, &channels[CHANNEL_MEAN_ACCELERATION], owners->storeys);
    for (size_t i = 0; i < COUNT(usual); i++) {
        const Channel *channel = &channels[usual[i]];
        for (size_t number = 1; number <= owners_count(owners, channel); number++)
            TRY(add_name(names, owners, channel, number));
    }
    return STATUS_OK;
}

static Owners owners_of(const Scene *scene) {
    const size_t storeys = structure_storeys(scene_structure(scene));
    return (Owners){storeys, scene->dampers.count, storeys > 1 || scene->dampers.count > 1};
}

void request_channel_name(const Scene *scene, ChannelId channel, size_t number,
                          char target[CHANNEL_NAME]) {
    const Owners owners = owners_of(scene);
    put_name(target, &owners, &channels[channel], number);
}

static void clear(Texts *names) {
    for (size_t i = 0; i < names->count; i++)
        free(names->at[i]);
    free(names->at);
    *names = (Texts){NULL, 0};
}

// The names that one entry of the list became.
typedef struct Expanded {
    size_t at, count;
} Expanded;

// Where the list as it was asked for has what is now name `i`.
static size_t asked_at(const Expanded *expanded, size_t i) {
    if (i < expanded->at)
        return i;
    return i < expanded->at + expanded->count ? expanded->at : i - expanded->count + 1;
}

// CHANNEL_USUAL where it first stands; a second one is left to be refused as such.
static Status expand(Texts *names, const Owners *owners, bool is_spectrum, Expanded *expanded,
                     Problem *problem) {
    size_t place = 0;
    while (place < names->count && strcmp(names->at[place], CHANNEL_USUAL) != 0)
        place++;
    if (place == names->count)
        return STATUS_OK;
    const size_t most = names->count + COUNT(usual) * (owners->storeys + owners->dampers);
    Texts all = {calloc(most, sizeof *all.at), 0};
    if (all.at == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the channels");
    Status status = STATUS_OK;
    for (size_t i = 0; i < names->count && status == STATUS_OK; i++) {
        if (i == place)
            status = add_usual(&all, owners, is_spectrum);
        else if ((all.at[all.count] = strdup(names->at[i])) != NULL)
            all.count++;
        else
            status = STATUS_NO_MEMORY;
    }
    if (status == STATUS_OK)
        *expanded = (Expanded){place, all.count - names->count + 1};
    clear(status == STATUS_OK ? names : &all);
    if (status != STATUS_OK)
        return problem_set(problem, status, "no memory for the channels");
    *names = all;
    return STATUS_OK;
}

static Status refuse(const char *name, const char *meant, const char *detail, const char *pointer,
                     Problem *problem) {
    Fault fault = {0};
    text_fit(fault.pointer, sizeof fault.pointer, pointer);
    text_quote(fault.value, sizeof fault.value, name);
    text_fit(fault.did_you_mean, sizeof fault.did_you_mean, meant);
    text_fit(fault.detail, sizeof fault.detail, detail);
    return problem_put(problem, STATUS_INVALID, &fault);
}

static bool is_right(const char *name, const Owners *owners) {
    size_t number;
    const Channel *channel = channel_find(name, &number);
    if (channel == NULL)
        return false;
    const bool is_numbered = owners->are_numbered && channel->owner != CHANNEL_OF_BASE;
    return owners_count(owners, channel) > 0 &&
           (is_numbered ? number >= 1 && number <= owners_count(owners, channel) : number == 0);
}

// Says what is wrong with a name that is not right.
static Status refuse_name(const char *name, const Owners *owners, const char *pointer,
                          Problem *problem) {
    size_t number;
    const Channel *channel = channel_find(name, &number);
    if (strcmp(name, CHANNEL_USUAL) == 0)
        return problem_add(problem, STATUS_INVALID, pointer, "is asked for twice");
    if (channel == NULL)
        return problem_concerns(problem, pointer)
                   ? STATUS_OK // told by the rows
                   : texts_refuse(channel_requests, name, pointer, problem);
    if (channel->owner == CHANNEL_OF_DAMPER && owners->dampers == 0)
        return problem_add(problem, STATUS_INVALID, pointer,
                           "%s needs a damper, the scene has none", name);
    const bool is_numbered = owners->are_numbered && channel->owner != CHANNEL_OF_BASE;
    const size_t most = owners_count(owners, channel);
    char meant[CHANNEL_NAME], last[CHANNEL_NAME], names[160], detail[sizeof((Fault){0}.detail)];
    put_name(meant, owners, channel,
             number > most || channel->owner == CHANNEL_OF_STOREY ? most : 1);
    put_name(last, owners, channel, most);
    if (most == 1)
        snprintf(names, sizeof names, "be %s", last);
    else
        snprintf(names, sizeof names, "carry the number of a %s, from %s_1 to %s",
                 channel->owner == CHANNEL_OF_STOREY ? "storey" : "damper", channel->name, last);
    if (is_numbered)
        snprintf(detail, sizeof detail, "must %s: the scene has %zu storey%s and %zu damper%s",
                 names, owners->storeys, owners->storeys == 1 ? "" : "s", owners->dampers,
                 owners->dampers == 1 ? "" : "s");
    else
        snprintf(detail, sizeof detail, "must be %s, without a number: there is but one", meant);
    return refuse(name, meant, detail, pointer, problem);
}

Status request_channels(const Scene *scene, Texts *names, bool is_spectrum, const char *pointer,
                        Problem *problem) {
    const Owners owners = {scene_storeys(scene, problem), scene->dampers.count,
                           scene_storeys(scene, problem) > 1 || scene->dampers.count > 1};
    const bool are_known = owners.storeys > 0 && !problem_concerns(problem, "/dampers");
    Expanded expanded = {0, 1};
    if (are_known)
        TRY(expand(names, &owners, is_spectrum, &expanded, problem));
    Status status = STATUS_OK;
    for (size_t i = 0; i < names->count; i++) {
        size_t first = 0;
        while (first < i && strcmp(names->at[i], names->at[first]) != 0)
            first++;
        const bool is_wrong = are_known && !is_right(names->at[i], &owners);
        if (!is_wrong && first == i)
            continue;
        status = STATUS_INVALID;
        char place[sizeof((Fault){0}.pointer)];
        pointer_index(place, sizeof place, pointer, asked_at(&expanded, i));
        if (is_wrong)
            (void)refuse_name(names->at[i], &owners, place, problem);
        if (first < i)
            problem_add(problem, STATUS_INVALID, place, "%.64s is asked for twice, first at %s/%zu",
                        names->at[i], pointer, asked_at(&expanded, first));
    }
    return status;
}
