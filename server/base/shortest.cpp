// dragonbox finds the digits and the power of ten; here they become text. All seventeen places are
// written at once, zeros in front, and the ones that count are copied from there: no loop depends
// on the number of digits.
#include "server/base/shortest.h"

#include <cstdint>
#include <cstring>

#include <dragonbox/dragonbox.h>

namespace {

constexpr int places = 17;
constexpr int least_plain = -5, most_plain = 16; // powers of ten of the first digit

struct Pairs {
    char text[200];
    constexpr Pairs() : text() {
        for (int i = 0; i < 100; i++) {
            text[2 * i] = static_cast<char>('0' + i / 10);
            text[2 * i + 1] = static_cast<char>('0' + i % 10);
        }
    }
};
constexpr Pairs pairs;

void write_pair(char *target, std::uint32_t value) {
    std::memcpy(target, pairs.text + 2 * value, 2);
}

void write_eight(char *target, std::uint32_t value) {
    const std::uint32_t high = value / 10000, low = value % 10000;
    write_pair(target, high / 100);
    write_pair(target + 2, high % 100);
    write_pair(target + 4, low / 100);
    write_pair(target + 6, low % 100);
}

int digit_count(std::uint64_t value) {
    static constexpr std::uint64_t tens[] = {0,
                                             10,
                                             100,
                                             1000,
                                             10000,
                                             100000,
                                             1000000,
                                             10000000,
                                             100000000,
                                             1000000000,
                                             10000000000,
                                             100000000000,
                                             1000000000000,
                                             10000000000000,
                                             100000000000000,
                                             1000000000000000,
                                             10000000000000000,
                                             100000000000000000};
    // Bits times log10(2) is right or one too many.
    const int guess = (64 - __builtin_clzll(value | 1)) * 1233 >> 12;
    return guess + (value >= tens[guess] ? 1 : 0);
}

char *write_exponent(char *at, int exponent) {
    *at++ = 'e';
    *at++ = exponent < 0 ? '-' : '+';
    const auto size = static_cast<std::uint32_t>(exponent < 0 ? -exponent : exponent);
    if (size >= 100) {
        *at++ = static_cast<char>('0' + size / 100);
        write_pair(at, size % 100);
        return at + 2;
    }
    if (size >= 10) {
        write_pair(at, size);
        return at + 2;
    }
    *at++ = static_cast<char>('0' + size);
    return at;
}

// `digits` has `places` bytes readable behind any of its first `count`.
char *write_decimal(char *at, const char *digits, int count, int exponent) {
    if (exponent < least_plain || exponent > most_plain) {
        *at = digits[0];
        at[1] = '.';
        std::memcpy(at + 2, digits + 1, places);
        return write_exponent(count > 1 ? at + 1 + count : at + 1, exponent);
    }
    if (exponent < 0) {
        std::memcpy(at, "0.00000", 7);
        at += 1 - exponent;
        std::memcpy(at, digits, places);
        return at + count;
    }
    const int whole = exponent + 1;
    std::memcpy(at, digits, places);
    if (count > whole) {
        at[whole] = '.';
        std::memcpy(at + whole + 1, digits + whole, static_cast<std::size_t>(count - whole));
        return at + count + 1;
    }
    std::memset(at + count, '0', static_cast<std::size_t>(whole - count));
    return at + whole;
}

} // namespace

std::size_t shortest_write(char *target, double value) {
    std::uint64_t bits;
    std::memcpy(&bits, &value, sizeof bits);
    char *at = target;
    if (bits >> 63 != 0)
        *at++ = '-';
    if (bits << 1 == 0) {
        // The sign of -0 needs a fraction: readers take "-0" for the integer 0.
        std::memcpy(at, "0.0", 3);
        return at == target ? 1 : 4;
    }
    const auto decimal = jkj::dragonbox::to_decimal(value, jkj::dragonbox::policy::sign::ignore);
    const std::uint64_t significand = decimal.significand;
    char digits[2 * places] = {};
    const auto high = static_cast<std::uint32_t>(significand / 100000000);
    const auto low = static_cast<std::uint32_t>(significand % 100000000);
    digits[0] = static_cast<char>('0' + high / 100000000);
    write_eight(digits + 1, high % 100000000);
    write_eight(digits + 9, low);
    const int count = digit_count(significand);
    at = write_decimal(at, digits + places - count, count, decimal.exponent + count - 1);
    return static_cast<std::size_t>(at - target);
}
