// Latin hypercube (McKay, Beckman and Conover, Technometrics 21, 239, 1979): in each dimension
// every one of N equal strata has one of the N points, at a random place within.
//
// Sobol sequence: bit by bit in base 2, x_i = i_1 v_1 xor i_2 v_2 xor ..., with i_1 the lowest bit
// of the row and the direction numbers v_j = m_j / 2^j of a primitive polynomial of degree s with
// the inner coefficients a:
//
//   m_j = 2 a_1 m_(j-1) xor 2^2 a_2 m_(j-2) xor ... xor 2^s m_(j-s) xor m_(j-s).
//
// A digital shift, a random word for each dimension, makes means over the points unbiased and keeps
// their uniformity.
#include "core/study/sampling.h"

#include <stdlib.h>

#include "core/base/philox.h"

enum {
    WORD_BITS = 32,
    STREAM_POINTS = 0x494e5000, // streams of random numbers, one for each dimension
    STREAM_STRATA = 0x494e5100,
    STREAM_AGAIN = 0x494e5200,
    STREAM_SHIFT = 0x494e5300,
    AGAIN_BITS = 20,
};

const char *const sampling_names[] = {"random", "latin_hypercube", "sobol", NULL};

// Dimensions 2 to 32 of new-joe-kuo-6: S. Joe and F. Y. Kuo, "Constructing Sobol sequences with
// better two-dimensional projections", SIAM J. Sci. Comput. 30, 2635 (2008). In the first one all m
// are 1.
// clang-format off
static const struct {
    uint8_t degree, coefficients;
    uint8_t m[7];
} sampling_directions[SAMPLING_SOBOL_DIMENSIONS - 1] = {
    {1, 0, {1}}, {2, 1, {1, 3}}, {3, 1, {1, 3, 1}}, {3, 2, {1, 1, 1}}, {4, 1, {1, 1, 3, 3}},
    {4, 4, {1, 3, 5, 13}}, {5, 2, {1, 1, 5, 5, 17}}, {5, 4, {1, 1, 5, 5, 5}},
    {5, 7, {1, 1, 7, 11, 19}}, {5, 11, {1, 1, 5, 1, 1}}, {5, 13, {1, 1, 1, 3, 11}},
    {5, 14, {1, 3, 5, 5, 31}}, {6, 1, {1, 3, 3, 9, 7, 49}}, {6, 13, {1, 1, 1, 15, 21, 21}},
    {6, 16, {1, 3, 1, 13, 27, 49}}, {6, 19, {1, 1, 1, 15, 7, 5}}, {6, 22, {1, 3, 1, 15, 13, 25}},
    {6, 25, {1, 1, 5, 5, 19, 61}}, {7, 1, {1, 3, 7, 11, 23, 15, 103}},
    {7, 4, {1, 3, 7, 13, 13, 15, 69}}, {7, 7, {1, 1, 3, 13, 7, 35, 63}},
    {7, 8, {1, 3, 5, 9, 1, 25, 53}}, {7, 14, {1, 3, 1, 13, 9, 35, 107}},
    {7, 19, {1, 3, 1, 5, 27, 61, 31}}, {7, 21, {1, 1, 5, 11, 19, 41, 61}},
    {7, 28, {1, 3, 5, 3, 3, 13, 69}}, {7, 31, {1, 1, 7, 13, 1, 19, 1}},
    {7, 32, {1, 3, 7, 5, 13, 19, 59}}, {7, 37, {1, 1, 3, 9, 25, 29, 41}},
    {7, 41, {1, 3, 5, 13, 23, 1, 55}}, {7, 42, {1, 3, 7, 3, 13, 59, 17}},
};
// clang-format on

static void sampling_words(uint64_t seed, uint64_t stream, uint64_t index, uint32_t out[4]) {
    const uint32_t counter[4] = {(uint32_t)index, (uint32_t)(index >> 32), (uint32_t)stream,
                                 (uint32_t)(stream >> 32)};
    const uint32_t key[2] = {(uint32_t)seed, (uint32_t)(seed >> 32)};
    philox_words(counter, key, out);
}

// Midpoints of 2^52 equal parts, which a double holds exactly.
static double sampling_uniform(uint64_t seed, uint64_t stream, uint64_t index) {
    uint32_t words[4];
    sampling_words(seed, stream, index, words);
    return ((double)(((uint64_t)words[1] << 32 | words[0]) >> 12) + 0.5) * 0x1p-52;
}

// The word of a point, of which bit 31 is worth 1/2.
static uint32_t sampling_sobol_word(uint64_t row, size_t dimension) {
    uint32_t m[WORD_BITS], word = 0;
    size_t degree = 0;
    for (size_t j = 0; j < WORD_BITS && row >> j != 0; j++) {
        if (dimension == 0) {
            m[j] = 1;
        } else if (j < (degree = sampling_directions[dimension - 1].degree)) {
            m[j] = sampling_directions[dimension - 1].m[j];
        } else {
            const unsigned coefficients = sampling_directions[dimension - 1].coefficients;
            m[j] = m[j - degree] ^ m[j - degree] << degree;
            for (size_t k = 1; k < degree; k++)
                if (coefficients >> (degree - 1 - k) & 1)
                    m[j] ^= m[j - k] << k;
        }
        if (row >> j & 1)
            word ^= m[j] << (WORD_BITS - 1 - j);
    }
    return word;
}

// Fisher and Yates. A word of 32 bits favours no stratum by more than rows / 2^32.
static void sampling_shuffle(uint64_t seed, uint64_t stream, size_t count, uint32_t *strata) {
    uint32_t words[4];
    for (size_t i = 0; i < count; i++) {
        if (i % 4 == 0)
            sampling_words(seed, stream, i / 4, words);
        const size_t k = (size_t)((uint64_t)words[i % 4] * (i + 1) >> 32);
        strata[i] = strata[k];
        strata[k] = (uint32_t)i;
    }
}

Status sampling_make(int method, uint64_t seed, size_t rows, size_t dimensions,
                     Sampling *sampling) {
    *sampling = (Sampling){.method = method, .seed = seed, .rows = rows, .dimensions = dimensions};
    if (method != SAMPLING_LATIN_HYPERCUBE)
        return STATUS_OK;
    sampling->strata = calloc(rows * dimensions + 1, sizeof *sampling->strata);
    TRY(status_made(sampling->strata != NULL));
    for (size_t i = 0; i < dimensions; i++)
        sampling_shuffle(seed, STREAM_STRATA + i, rows, sampling->strata + i * rows);
    return STATUS_OK;
}

void sampling_clear(Sampling *sampling) {
    free(sampling->strata);
    *sampling = (Sampling){0};
}

double sampling_coordinate(const Sampling *sampling, size_t row, size_t dimension) {
    if (sampling->method == SAMPLING_SOBOL) {
        uint32_t shift[4];
        sampling_words(sampling->seed, STREAM_SHIFT + dimension, 0, shift);
        return ((double)(sampling_sobol_word(row, dimension) ^ shift[0]) + 0.5) * 0x1p-32;
    }
    const double within = sampling_uniform(sampling->seed, STREAM_POINTS + dimension, row);
    if (sampling->method != SAMPLING_LATIN_HYPERCUBE)
        return within;
    const double place = ((double)sampling->strata[dimension * sampling->rows + row] + within) /
                         (double)sampling->rows;
    return place == 0.5 ? 0.5 - 0x1p-53 : place;
}

double sampling_draw_again(const Sampling *sampling, size_t row, size_t dimension, uint64_t again) {
    return sampling_uniform(sampling->seed, STREAM_AGAIN + dimension,
                            (uint64_t)row << AGAIN_BITS | again);
}
