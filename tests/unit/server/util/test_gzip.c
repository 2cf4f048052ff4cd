#include "server/util/gzip.h"
#include "tests/support/test.h"

#include <string.h>

TEST(crc_32_has_its_check_value_and_goes_on_piece_by_piece) {
    assert_int_equal(gzip_crc32(0, "123456789", 9), 0xCBF43926);
    assert_int_equal(gzip_crc32(gzip_crc32(0, "1234", 4), "56789", 5), 0xCBF43926);
}

TEST(gzip_is_a_member_that_tells_crc_and_size_and_is_smaller) {
    char text[20000];
    for (size_t i = 0; i < sizeof text; i++)
        text[i] = "0123456789,"[i * i % 11];
    Bytes bytes = {0};
    bytes_text(&bytes, "before");
    assert_true(gzip_compress(&bytes, text, sizeof text));
    const unsigned char *member = (const unsigned char *)bytes.at + 6;
    const size_t size = bytes.count - 6;
    assert_true(size < sizeof text / 4);
    assert_int_equal(member[0], 0x1f);
    assert_int_equal(member[1], 0x8b);
    uint32_t crc, length;
    memcpy(&crc, member + size - 8, 4);
    memcpy(&length, member + size - 4, 4);
    assert_int_equal(crc, gzip_crc32(0, text, sizeof text));
    assert_int_equal(length, sizeof text);
    bytes_clear(&bytes);
}

TEST(a_buffer_with_a_limit_too_low_fails) {
    Bytes bytes = {.most = 4};
    assert_false(gzip_compress(&bytes, "0123456789", 10));
    bytes_clear(&bytes);
}
