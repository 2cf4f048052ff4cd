// dragonbox finds the digits and the power of ten; here they become text. Zeros are put behind the
// digits until all seventeen places are taken, so that each digit's place is known beforehand: the
// first one alone, the others four at a time out of a table and eight to a word. Words are stored
// whole, and the length leaves out the zeros at the end. No loop depends on the number of digits.
#include "server/util/dtoa.h"

#include <cstdint>
#include <cstring>

#include <dragonbox/dragonbox.h>

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "a word's lowest byte is stored first");

namespace {

constexpr int places = 17;
constexpr int least_plain = -5, most_plain = 16; // powers of ten of the first digit

struct Tens {
    std::uint64_t at[places + 1];
    constexpr Tens() : at() {
        std::uint64_t power = 1;
        for (std::uint64_t &one : at) {
            one = power;
            power *= 10;
        }
    }
};
constexpr Tens tens;

// Of a number that is not 0. Nearly all have fifteen to seventeen; else bits times log10(2) is
// right or one too many.
int digit_count(std::uint64_t value) {
    if (value >= tens.at[14])
        return 15 + (value >= tens.at[15]) + (value >= tens.at[16]);
    const int guess = (64 - __builtin_clzll(value)) * 1233 >> 12;
    return guess + (value >= tens.at[guess] ? 1 : 0);
}

// The four characters of each number below 10000, the first one in the lowest byte.
struct Fours {
    std::uint32_t at[10000];
    constexpr Fours() : at() {
        for (std::uint32_t i = 0; i < 10000; i++)
            at[i] = ('0' + i / 1000) | ('0' + i / 100 % 10) << 8 | ('0' + i / 10 % 10) << 16 |
                    ('0' + i % 10) << 24;
    }
};
constexpr Fours fours;

// Of a number below 10^8.
[[gnu::always_inline]] inline std::uint64_t eight(std::uint32_t value) {
    return fours.at[value / 10000] | static_cast<std::uint64_t>(fours.at[value % 10000]) << 32;
}

// The seventeen places.
struct Digits {
    std::uint64_t middle, last;
    int count; // up to the last one that is not 0
    char first;
};

[[gnu::always_inline]] inline Digits digits_make(std::uint64_t filled) {
    constexpr std::uint64_t zeros = 0x3030303030303030;
    const std::uint64_t high = filled / 100000000;
    Digits digits;
    digits.first = static_cast<char>('0' + high / 100000000);
    digits.middle = eight(static_cast<std::uint32_t>(high % 100000000));
    digits.last = eight(static_cast<std::uint32_t>(filled % 100000000));
    const bool is_long = digits.last != zeros;
    const std::uint64_t end = (is_long ? digits.last : digits.middle) ^ zeros;
    digits.count = (is_long ? places : places - 8) - (end != 0 ? __builtin_clzll(end) >> 3 : 8);
    return digits;
}

void store(char *at, std::uint64_t word) {
    std::memcpy(at, &word, sizeof word);
}

char *write_exponent(char *at, int exponent) {
    *at++ = 'e';
    *at++ = exponent < 0 ? '-' : '+';
    int size = exponent < 0 ? -exponent : exponent;
    if (size >= 100)
        *at++ = static_cast<char>('0' + size / 100);
    if (size >= 10)
        *at++ = static_cast<char>('0' + size / 10 % 10);
    *at++ = static_cast<char>('0' + size % 10);
    return at;
}

// What stands behind digit number `shift`, from 1 to 15; then nothing of any meaning.
void db_behind(char *at, const Digits &digits, int shift) {
    const int bits = 8 * shift;
    if (shift < 8) {
        store(at, digits.middle >> bits | digits.last << (64 - bits));
        store(at + 8, digits.last >> bits);
    } else {
        store(at, digits.last >> (bits - 64));
    }
}

// `exponent` is the first digit's power of ten.
[[gnu::always_inline]] inline char *write_decimal(char *at, const Digits &digits, int exponent) {
    if (exponent < 0 && exponent >= least_plain) {
        std::memcpy(at, "0.00000", 8);
        at += 1 - exponent;
        *at = digits.first;
        store(at + 1, digits.middle);
        store(at + 9, digits.last);
        return at + digits.count;
    }
    *at = digits.first;
    if (exponent > 0 && exponent <= most_plain) {
        store(at + 1, digits.middle);
        store(at + 9, digits.last);
        const int whole = exponent + 1;
        if (digits.count <= whole)
            return at + whole;
        at[whole] = '.';
        db_behind(at + whole + 1, digits, exponent);
        return at + digits.count + 1;
    }
    at[1] = '.';
    store(at + 2, digits.middle);
    store(at + 10, digits.last);
    at += digits.count > 1 ? digits.count + 1 : 1;
    return exponent == 0 ? at : write_exponent(at, exponent);
}

// Of a finite number.
[[gnu::always_inline]] inline char *write(char *at, double value) {
    std::uint64_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    *at = '-';
    at += bits >> 63;
    if (bits << 1 == 0) {
        // The sign of -0 needs a fraction: readers take "-0" for the integer 0.
        std::memcpy(at, "0.0", 3);
        return at + (bits != 0 ? 3 : 1);
    }
    const auto decimal = jkj::dragonbox::to_decimal(value, jkj::dragonbox::policy::sign::ignore,
                                                    jkj::dragonbox::policy::trailing_zero::ignore);
    const int count = digit_count(decimal.significand);
    const Digits digits = digits_make(decimal.significand * tens.at[places - count]);
    return write_decimal(at, digits, decimal.exponent + count - 1);
}

} // namespace

std::size_t dtoa_write(char *target, double value) {
    return static_cast<std::size_t>(write(target, value) - target);
}

std::size_t dtoa_list(char *target, const double *values, std::size_t count) {
    char *at = target;
    for (std::size_t i = 0; i < count; i++) {
        std::uint64_t bits;
        std::memcpy(&bits, &values[i], sizeof bits);
        if ((~bits & 0x7ff0000000000000) != 0) {
            at = write(at, values[i]);
        } else {
            std::memcpy(at, "null", 4);
            at += 4;
        }
        *at++ = ',';
    }
    return static_cast<std::size_t>(at - target) - (count > 0);
}
