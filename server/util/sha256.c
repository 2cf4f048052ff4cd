#include "server/util/sha256.h"

#include <gnutls/crypto.h>
#include <gnutls/gnutls.h>

// A Sha256 is GnuTLS's own handle, which is a pointer.
Sha256 *sha256_new(void) {
    gnutls_hash_hd_t hash;
    return gnutls_hash_init(&hash, GNUTLS_DIG_SHA256) < 0 ? NULL : (Sha256 *)hash;
}

void sha256_add(void *digest, const void *bytes, size_t size) {
    // SHA-256 in software fails on no input.
    (void)gnutls_hash(digest, bytes, size);
}

void sha256_hex(const unsigned char sum[DIGEST_BYTES], char target[65]) {
    static const char hexadecimal[] = "0123456789abcdef";
    for (size_t i = 0; i < DIGEST_BYTES; i++) {
        target[2 * i] = hexadecimal[sum[i] >> 4];
        target[2 * i + 1] = hexadecimal[sum[i] & 15];
    }
    target[2 * (size_t)DIGEST_BYTES] = '\0';
}

void sha256_end(Sha256 *digest, char target[65]) {
    unsigned char sum[DIGEST_BYTES];
    gnutls_hash_deinit((gnutls_hash_hd_t)(void *)digest, sum);
    sha256_hex(sum, target);
}

void sha256_sum(const void *bytes, size_t size, unsigned char target[DIGEST_BYTES]) {
    (void)gnutls_hash_fast(GNUTLS_DIG_SHA256, bytes, size, target);
}
