// A GnuTLS handle under our name. The hash is made when the digest is and freed when it ends.
#include "server/base/digest.h"

#include <stdlib.h>

#include <gnutls/crypto.h>
#include <gnutls/gnutls.h>

enum { SHA256_BYTES = 32 };

struct Digest {
    gnutls_hash_hd_t hash;
};

Digest *digest_new(void) {
    Digest *digest = malloc(sizeof *digest);
    if (digest == NULL)
        return NULL;
    if (gnutls_hash_init(&digest->hash, GNUTLS_DIG_SHA256) < 0) {
        free(digest);
        return NULL;
    }
    return digest;
}

void digest_take(void *digest, const void *bytes, size_t size) {
    // SHA-256 in software fails on no input.
    (void)gnutls_hash(((Digest *)digest)->hash, bytes, size);
}

static void write_hexadecimal(const unsigned char sum[SHA256_BYTES], char target[DIGEST_SIZE]) {
    static const char digits[] = "0123456789abcdef";
    for (size_t i = 0; i < SHA256_BYTES; i++) {
        target[2 * i] = digits[sum[i] >> 4];
        target[2 * i + 1] = digits[sum[i] & 15];
    }
    target[2 * SHA256_BYTES] = '\0';
}

void digest_end(Digest *digest, char target[DIGEST_SIZE]) {
    unsigned char sum[SHA256_BYTES];
    gnutls_hash_deinit(digest->hash, sum);
    free(digest);
    write_hexadecimal(sum, target);
}

bool digest_of(const void *bytes, size_t size, char target[DIGEST_SIZE]) {
    unsigned char sum[SHA256_BYTES];
    if (gnutls_hash_fast(GNUTLS_DIG_SHA256, bytes, size, sum) < 0)
        return false;
    write_hexadecimal(sum, target);
    return true;
}
