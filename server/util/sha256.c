// A GnuTLS handle under our name. The hash is made when the digest is and freed when it ends.
#include "server/util/sha256.h"

#include <stdlib.h>

#include <gnutls/crypto.h>
#include <gnutls/gnutls.h>

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

void digest_spell(const unsigned char sum[DIGEST_BYTES], char target[65]) {
    static const char hexadecimal[] = "0123456789abcdef";
    for (size_t i = 0; i < DIGEST_BYTES; i++) {
        target[2 * i] = hexadecimal[sum[i] >> 4];
        target[2 * i + 1] = hexadecimal[sum[i] & 15];
    }
    target[2 * (size_t)DIGEST_BYTES] = '\0';
}

void digest_end(Digest *digest, char target[65]) {
    unsigned char sum[DIGEST_BYTES];
    gnutls_hash_deinit(digest->hash, sum);
    free(digest);
    digest_spell(sum, target);
}

void digest_sum(const void *bytes, size_t size, unsigned char target[DIGEST_BYTES]) {
    (void)gnutls_hash_fast(GNUTLS_DIG_SHA256, bytes, size, target);
}
