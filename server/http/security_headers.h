// Headers that every answer carries, whatever it is: what browsers must not do with it. No
// Access-Control-* among them: pages of other sites get nothing. Used by sending.c.
#ifndef SERVER_HTTP_SECURITY_HEADERS_H
#define SERVER_HTTP_SECURITY_HEADERS_H

typedef struct SecurityHeader {
    const char *name, *value;
} SecurityHeader;

extern const SecurityHeader shield_headers[]; // ends with name == NULL
extern const SecurityHeader shield_tls;       // under TLS as well

// Content-Security-Policy of what is no page; of a drawing, which has its colours in itself; of the
// dashboard: its own files and answers, no inline script or style, and no text becomes markup.
extern const char shield_policy[], shield_drawing_policy[], shield_page_policy[];

#endif
