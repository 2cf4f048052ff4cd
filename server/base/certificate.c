#include "server/base/certificate.h"

#include <string.h>

#include <gnutls/gnutls.h>
#include <gnutls/x509.h>

#include "server/base/clock.h"

static Status check_time(gnutls_certificate_credentials_t credentials, const char *path,
                         Problem *problem) {
    gnutls_x509_crt_t *chain = NULL;
    unsigned count = 0;
    const int code = gnutls_certificate_get_x509_crt(credentials, 0, &chain, &count);
    if (code < 0 || count == 0)
        return problem_set(problem, STATUS_USAGE, "%s holds no certificate", path);
    const int64_t ends = (int64_t)gnutls_x509_crt_get_expiration_time(chain[0]);
    for (unsigned i = 0; i < count; i++)
        gnutls_x509_crt_deinit(chain[i]);
    gnutls_free(chain);
    if (ends >= clock_unix_ms() / 1000)
        return STATUS_OK;
    char text[32];
    clock_rfc3339(ends * 1000, text);
    return problem_set(problem, STATUS_USAGE, "the certificate in %s expired at %s; renew it", path,
                       text);
}

Status certificate_check(const char *cert, const char *cert_path, const char *key,
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
        status = check_time(credentials, cert_path, problem);
    gnutls_certificate_free_credentials(credentials);
    return status;
}
