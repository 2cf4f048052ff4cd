#include "tests/support/mutate.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MUTATIONS_MAX = 6 };

size_t mutate_draw(Mutator *mutator, size_t count) {
    uint64_t z = mutator->state += 0x9E3779B97F4A7C15u;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return count == 0 ? 0 : (size_t)((z ^ (z >> 31)) % count);
}

static size_t mutate_put(char *text, size_t size, size_t at, const char *piece, size_t length) {
    if (size + length > MUTATE_TEXT_MAX)
        return size;
    memmove(text + at + length, text + at, size - at);
    memcpy(text + at, piece, length);
    return size + length;
}

static size_t mutate_once(Mutator *mutator, char *text, size_t size) {
    char copy[64];
    const size_t at = mutate_draw(mutator, size + 1);
    size_t length = mutate_draw(mutator, sizeof copy);
    length = length < size - at ? length : size - at;
    switch (mutate_draw(mutator, 6)) {
    case 0: // another byte
        if (at < size)
            text[at] = (char)mutate_draw(mutator, 256);
        return size;
    case 1: // something left out
        memmove(text + at, text + at + length, size - at - length);
        return size - length;
    case 2: // something once more, elsewhere
        memcpy(copy, text + at, length);
        return mutate_put(text, size, mutate_draw(mutator, size + 1), copy, length);
    case 3: // an end
        return mutate_draw(mutator, 8) == 0 ? at : size;
    default: { // something known
        const char *piece = mutator->pieces[mutate_draw(mutator, mutator->piece_count)];
        return mutate_put(text, size, at, piece, strlen(piece));
    }
    }
}

char *mutate_text(Mutator *mutator, size_t *size) {
    char text[MUTATE_TEXT_MAX];
    const char *seed = mutator->seeds[mutate_draw(mutator, mutator->seed_count)];
    size_t length = strlen(seed);
    memcpy(text, seed, length);
    for (size_t left = mutate_draw(mutator, MUTATIONS_MAX + 1); left > 0; left--)
        length = mutate_once(mutator, text, length);
    char *own = malloc(length > 0 ? length : 1);
    if (own != NULL)
        memcpy(own, text, length);
    *size = length;
    return own;
}

int mutate_refuse(const char *wrong, const char *text, size_t size) {
    fprintf(stderr, "%s; the text:\n", wrong);
    (void)fwrite(text, 1, size, stderr);
    return 1;
}
