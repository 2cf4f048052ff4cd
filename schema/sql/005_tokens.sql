-- Who may ask over HTTP. Of a token only its SHA-256 is kept. Times are 0 where there is none: never used, never
-- expires, not revoked. A revoked one stays, so that its name is not given to another, until it is forgotten.
CREATE TABLE tokens (
    number           INTEGER PRIMARY KEY,
    name             TEXT    NOT NULL UNIQUE CHECK (name <> '' AND name NOT GLOB '*[^A-Za-z0-9._-]*'),
    digest           TEXT    NOT NULL UNIQUE CHECK (length(digest) = 64),
    scopes           TEXT    NOT NULL CHECK (scopes <> ''),
    created_unix_ms  INTEGER NOT NULL,
    used_unix_ms     INTEGER NOT NULL,
    expires_unix_ms  INTEGER NOT NULL,
    revoked_unix_ms  INTEGER NOT NULL
) STRICT;
