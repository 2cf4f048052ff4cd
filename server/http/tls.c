// One certificate is in use at a time. Those before it are kept to the end: a handshake may still
// use one, and they are a few kilobytes each.
#include "server/http/server.h"

#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include <gnutls/abstract.h>
#include <gnutls/gnutls.h>
#include <gnutls/x509.h>

#include "server/util/clock.h"

// libtasn1 and GMP end the process where an allocation of their own fails; 31 certificates and a
// key take 330 kB.
enum { CHAIN_MAX = 32, TLS_BYTES = 1 << 20 };

typedef struct Certificate {
    struct Certificate *before;
    gnutls_pcert_st chain[CHAIN_MAX];
    unsigned count;
    gnutls_privkey_t key;
} Certificate;

static _Atomic(Certificate *) in_use;

static Status tls_check_time(gnutls_certificate_credentials_t credentials, const char *path,
                             Problem *problem) {
    gnutls_x509_crt_t *chain = NULL;
    unsigned count = 0;
    const int code = gnutls_certificate_get_x509_crt(credentials, 0, &chain, &count);
    if (code < 0)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the certificate");
    const int64_t ends = (int64_t)gnutls_x509_crt_get_expiration_time(chain[0]);
    for (unsigned i = 0; i < count; i++)
        gnutls_x509_crt_deinit(chain[i]);
    gnutls_free(chain);
    if (ends >= clock_unix_ms() / 1000)
        return STATUS_OK;
    return problem_set(problem, STATUS_USAGE, "the certificate in %s expired at %s; renew it", path,
                       clock_rfc3339(ends * 1000).at);
}

static Status tls_check(const char *cert, const char *cert_path, const char *key,
                        const char *key_path, Problem *problem) {
    gnutls_certificate_credentials_t credentials;
    const gnutls_datum_t cert_text = {(unsigned char *)cert, (unsigned)strlen(cert)};
    const gnutls_datum_t key_text = {(unsigned char *)key, (unsigned)strlen(key)};
    if (gnutls_certificate_allocate_credentials(&credentials) < 0)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the certificate");
    const int code = gnutls_certificate_set_x509_key_mem(credentials, &cert_text, &key_text,
                                                         GNUTLS_X509_FMT_PEM);
    Status status = STATUS_OK;
    if (code == GNUTLS_E_CERTIFICATE_KEY_MISMATCH)
        status =
            problem_set(problem, STATUS_USAGE, "the key in %s is not that of the certificate in %s",
                        key_path, cert_path);
    else if (code < 0)
        status =
            problem_set(problem, STATUS_USAGE,
                        "%s and %s must be a certificate and its key, without a password, in PEM "
                        "form: %s",
                        cert_path, key_path, gnutls_strerror(code));
    if (status == STATUS_OK)
        status = tls_check_time(credentials, cert_path, problem);
    gnutls_certificate_free_credentials(credentials);
    return status;
}

static void certificate_free(Certificate *certificate) {
    for (unsigned i = 0; i < certificate->count; i++)
        gnutls_pcert_deinit(&certificate->chain[i]);
    if (certificate->key != NULL)
        gnutls_privkey_deinit(certificate->key);
    free(certificate);
}

static Status tls_load(const char *cert, const char *cert_path, const char *key,
                       const char *key_path, Problem *problem) {
    const gnutls_datum_t cert_text = {(unsigned char *)cert, (unsigned)strlen(cert)};
    const gnutls_datum_t key_text = {(unsigned char *)key, (unsigned)strlen(key)};
    void *reserve = malloc(TLS_BYTES);
    free(reserve);
    if (reserve == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the certificate");
    TRY(tls_check(cert, cert_path, key, key_path, problem));
    Certificate *made = calloc(1, sizeof *made);
    if (made == NULL)
        return problem_set(problem, STATUS_NO_MEMORY, "no memory for the certificate");
    unsigned count = CHAIN_MAX;
    int code =
        gnutls_pcert_list_import_x509_raw(made->chain, &count, &cert_text, GNUTLS_X509_FMT_PEM,
                                          GNUTLS_X509_CRT_LIST_IMPORT_FAIL_IF_EXCEED);
    if (code >= 0) {
        made->count = count;
        code = gnutls_privkey_init(&made->key);
    }
    if (code >= 0)
        code = gnutls_privkey_import_x509_raw(made->key, &key_text, GNUTLS_X509_FMT_PEM, NULL, 0);
    if (code < 0) {
        certificate_free(made);
        if (code == GNUTLS_E_SHORT_MEMORY_BUFFER)
            return problem_set(problem, STATUS_USAGE, "%s has %u certificates; must be at most %d",
                               cert_path, count, CHAIN_MAX);
        return problem_set(problem, STATUS_USAGE, "%s and %s cannot be used: %s", cert_path,
                           key_path, gnutls_strerror(code));
    }
    made->before = atomic_load(&in_use);
    atomic_store(&in_use, made);
    return STATUS_OK;
}

// GnuTLS may also call a lack of memory a fault of the file, so a file is refused after two
// attempts: where memory is still short the second one says so.
Status tls_use(const char *cert, const char *cert_path, const char *key, const char *key_path,
               Problem *problem) {
    const Status status = tls_load(cert, cert_path, key, key_path, NULL);
    return status == STATUS_OK ? status : tls_load(cert, cert_path, key, key_path, problem);
}

static int tls_retrieve(gnutls_session_t session, const gnutls_datum_t *authorities, int count,
                        const gnutls_pk_algorithm_t *algorithms, int algorithm_count,
                        gnutls_pcert_st **chain, unsigned *chain_count, gnutls_privkey_t *key) {
    (void)session, (void)authorities, (void)count, (void)algorithms, (void)algorithm_count;
    Certificate *certificate = atomic_load(&in_use);
    if (certificate == NULL)
        return -1;
    *chain = certificate->chain;
    *chain_count = certificate->count;
    *key = certificate->key;
    return 0;
}

CertificateSource *tls_source(void) {
    return atomic_load(&in_use) != NULL ? (CertificateSource *)tls_retrieve : NULL;
}

bool tls_has_pending(void *session) {
    return gnutls_record_check_pending(session) > 0;
}

void tls_forget(void) {
    Certificate *certificate = atomic_exchange(&in_use, NULL), *before;
    for (; certificate != NULL; certificate = before) {
        before = certificate->before;
        certificate_free(certificate);
    }
}
