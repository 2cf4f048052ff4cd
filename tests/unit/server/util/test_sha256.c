// SHA-256 against the vectors of FIPS 180-4.
#include <string.h>

#include "server/util/sha256.h"
#include "tests/support/test.h"

TEST(digests_are_those_of_the_standard) {
    char text[65];
    sha256_end(sha256_new(), text);
    assert_string_equal(text, "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    Sha256 *digest = sha256_new();
    sha256_add(digest, "abc", 3);
    sha256_end(digest, text);
    assert_string_equal(text, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST(the_pieces_do_not_matter) {
    char text[65], block[1000];
    memset(block, 'a', sizeof block);
    Sha256 *digest = sha256_new();
    for (int i = 0; i < 1000; i++) {
        sha256_add(digest, block, 1);
        sha256_add(digest, block, sizeof block - 1);
    }
    sha256_end(digest, text);
    assert_string_equal(text, "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}
