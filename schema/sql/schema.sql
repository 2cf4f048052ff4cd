-- The database as of version 1. Times are milliseconds since 1970 UTC, quantities SI, documents JSON text. Every table has
-- an integer key of its own, which rises with the order of arrival, and its public name beside it, unique.
-- checks: the CRC-32 of each column that server/db marks as checked, four bytes each in the order of its table there, then of
-- those that it marks as bound, which the first rows lack. A row without checks is damaged; those inserted here get theirs
-- within the same transaction.

-- Materials. Revisions, measurements, reviews and the audit trail are added, never changed and never deleted. author,
-- reviewer, who: the token's name; NULL: the local user, or of a revision the program; 'impactd': the program reviewed it.
CREATE TABLE materials (
    number  INTEGER PRIMARY KEY,
    slug    TEXT    NOT NULL UNIQUE CHECK (slug <> '' AND slug NOT GLOB '*[^a-z0-9_-]*')
) STRICT;

-- lists: tags, table over approach speed, numbers of measurements used, a JSON object. base: 0 fixed, 1 free. Temperatures
-- in degC. separation: 0 zero penetration, 1 zero force. reverts: the revision that is repeated.
CREATE TABLE material_revisions (
    number                  INTEGER PRIMARY KEY,
    material                INTEGER NOT NULL REFERENCES materials (number),
    revision                INTEGER NOT NULL CHECK (revision >= 1),
    name                    TEXT    NOT NULL CHECK (name <> ''),
    kind                    TEXT,
    thickness               REAL    CHECK (thickness > 0),
    hardness                TEXT,
    supplier                TEXT,
    notes                   TEXT,
    restitution             REAL    CHECK (restitution BETWEEN 0 AND 1),
    restitution_deviation   REAL    CHECK (restitution_deviation >= 0),
    contact_time            REAL    CHECK (contact_time > 0),
    contact_time_deviation  REAL    CHECK (contact_time_deviation >= 0),
    separation              INTEGER CHECK (separation IN (0, 1)),
    least_speed             REAL    CHECK (least_speed >= 0),
    most_speed              REAL    CHECK (most_speed >= 0),
    least_temperature       REAL,
    most_temperature        REAL,
    impactor                TEXT,
    impactor_mass           REAL    CHECK (impactor_mass > 0),
    base                    INTEGER CHECK (base IN (0, 1)),
    base_mass               REAL    CHECK (base_mass > 0),
    source                  TEXT    NOT NULL CHECK (source <> ''),
    lists                   TEXT,
    reverts                 INTEGER,
    author                  TEXT,
    comment                 TEXT    NOT NULL,
    created_unix_ms         INTEGER NOT NULL,
    checks                  BLOB,
    UNIQUE (material, revision),
    CHECK (restitution IS NOT NULL OR lists IS NOT NULL)
) STRICT;

-- The last review of a revision is its status; without one it is a draft.
CREATE TABLE material_reviews (
    number           INTEGER PRIMARY KEY,
    material         INTEGER NOT NULL,
    revision         INTEGER NOT NULL,
    status           TEXT    NOT NULL CHECK (status IN ('approved', 'deprecated')),
    reason           TEXT    NOT NULL,
    reviewer         TEXT,
    created_unix_ms  INTEGER NOT NULL,
    checks           BLOB,
    FOREIGN KEY (material, revision) REFERENCES material_revisions (material, revision)
) STRICT;
CREATE INDEX material_reviews_of ON material_reviews (material, revision, number);

-- document: the drop test as it was sent, JSON. drops, traces, head: derived from it for lists, which do not read it.
CREATE TABLE material_measurements (
    number           INTEGER PRIMARY KEY,
    material         INTEGER NOT NULL REFERENCES materials (number),
    measurement      INTEGER NOT NULL CHECK (measurement >= 1),
    author           TEXT,
    comment          TEXT    NOT NULL,
    created_unix_ms  INTEGER NOT NULL,
    drops            INTEGER NOT NULL,
    traces           INTEGER NOT NULL,
    head             TEXT    NOT NULL,
    checks           BLOB,
    document         TEXT    NOT NULL,
    UNIQUE (material, measurement)
) STRICT;

-- What was done, to which revision or measurement, by whom and why. A material's entries count from 1: the last one's
-- number is the material's version.
CREATE TABLE material_trail (
    number           INTEGER PRIMARY KEY,
    material         INTEGER NOT NULL REFERENCES materials (number),
    version          INTEGER NOT NULL CHECK (version >= 1),
    action           TEXT    NOT NULL CHECK (action IN ('create', 'revise', 'revert', 'approve', 'deprecate', 'measure', 'import')),
    revision         INTEGER,
    measurement      INTEGER,
    who              TEXT,
    why              TEXT    NOT NULL,
    created_unix_ms  INTEGER NOT NULL,
    checks           BLOB
) STRICT;
CREATE UNIQUE INDEX material_trail_of ON material_trail (material, version);

-- One row: the size of all these, about. They only grow, so it has a limit.
CREATE TABLE material_room (
    bytes  INTEGER NOT NULL CHECK (bytes >= 0)
) STRICT;
INSERT INTO material_room (bytes) VALUES (0);

-- The five buffers of Li and Darby 2009, as measured (Table I). The program wrote and approved them, at the same time in
-- every database.
CREATE TEMP TABLE paper (number, slug, name, kind, restitution, contact_time);
INSERT INTO paper VALUES
    (1, 'sponge',       'Sponge',       'foam',    0.61, 0.025),
    (2, 'soft_rubber',  'Soft rubber',  'rubber',  0.44, 0.019),
    (3, 'hard_rubber',  'Hard rubber',  'rubber',  0.53, 0.004),
    (4, 'hard_acrylic', 'Hard acrylic', 'plastic', 0.49, 0.003),
    (5, 'aluminium',    'Aluminium',    'metal',   0.46, 0.0003);
INSERT INTO materials (number, slug) SELECT number, slug FROM paper;
INSERT INTO material_revisions (number, material, revision, name, kind, restitution, contact_time, least_speed, most_speed,
                                impactor, impactor_mass, source, comment, created_unix_ms)
SELECT number, number, 1, name, kind, restitution, contact_time, 0.15, 1.0, 'steel ball, 30 mm', 0.11,
       'doi:10.1002/stc.238, Table I', 'as published', 1795219200000 FROM paper;
INSERT INTO material_reviews (number, material, revision, status, reason, reviewer, created_unix_ms)
SELECT number, number, 1, 'approved', 'published', 'impactd', 1795219200000 FROM paper;
INSERT INTO material_trail (material, version, action, revision, who, why, created_unix_ms)
SELECT number, 1, 'create', 1, NULL, 'as published', 1795219200000 FROM paper;
INSERT INTO material_trail (material, version, action, revision, who, why, created_unix_ms)
SELECT number, 2, 'approve', 1, 'impactd', 'published', 1795219200000 FROM paper;
DROP TABLE paper;

CREATE TRIGGER materials_keep BEFORE UPDATE ON materials
BEGIN SELECT RAISE (ABORT, 'a material keeps its name'); END;
CREATE TRIGGER materials_stay BEFORE DELETE ON materials
BEGIN SELECT RAISE (ABORT, 'a material is never deleted; deprecate its revisions'); END;
CREATE TRIGGER material_revisions_keep BEFORE UPDATE ON material_revisions
BEGIN SELECT RAISE (ABORT, 'a revision of a material never changes; add a new one'); END;
CREATE TRIGGER material_revisions_stay BEFORE DELETE ON material_revisions
BEGIN SELECT RAISE (ABORT, 'a revision of a material is never deleted'); END;
CREATE TRIGGER material_reviews_keep BEFORE UPDATE ON material_reviews
BEGIN SELECT RAISE (ABORT, 'a review of a material never changes; add a new one'); END;
CREATE TRIGGER material_reviews_stay BEFORE DELETE ON material_reviews
BEGIN SELECT RAISE (ABORT, 'a review of a material is never deleted'); END;
CREATE TRIGGER material_measurements_keep BEFORE UPDATE ON material_measurements
BEGIN SELECT RAISE (ABORT, 'a measurement never changes; add a new one'); END;
CREATE TRIGGER material_measurements_stay BEFORE DELETE ON material_measurements
BEGIN SELECT RAISE (ABORT, 'a measurement is never deleted'); END;
CREATE TRIGGER material_trail_keep BEFORE UPDATE ON material_trail
BEGIN SELECT RAISE (ABORT, 'what was done stays written'); END;
CREATE TRIGGER material_trail_stay BEFORE DELETE ON material_trail
BEGIN SELECT RAISE (ABORT, 'what was done stays written'); END;
-- INSERT OR REPLACE deletes without the triggers above, so inserting over a row is refused too.
CREATE TRIGGER materials_once BEFORE INSERT ON materials
WHEN EXISTS (SELECT 1 FROM materials WHERE slug = NEW.slug OR number = NEW.number)
BEGIN SELECT RAISE (ABORT, 'there is such a material'); END;
CREATE TRIGGER material_revisions_once BEFORE INSERT ON material_revisions
WHEN EXISTS (SELECT 1 FROM material_revisions
             WHERE (material = NEW.material AND revision = NEW.revision) OR number = NEW.number)
BEGIN SELECT RAISE (ABORT, 'a revision of a material never changes; add a new one'); END;
CREATE TRIGGER material_reviews_once BEFORE INSERT ON material_reviews
WHEN EXISTS (SELECT 1 FROM material_reviews WHERE number = NEW.number)
BEGIN SELECT RAISE (ABORT, 'a review of a material never changes; add a new one'); END;
CREATE TRIGGER material_measurements_once BEFORE INSERT ON material_measurements
WHEN EXISTS (SELECT 1 FROM material_measurements
             WHERE (material = NEW.material AND measurement = NEW.measurement) OR number = NEW.number)
BEGIN SELECT RAISE (ABORT, 'a measurement never changes; add a new one'); END;
CREATE TRIGGER material_trail_once BEFORE INSERT ON material_trail
WHEN EXISTS (SELECT 1 FROM material_trail
             WHERE (material = NEW.material AND version = NEW.version) OR number = NEW.number)
BEGIN SELECT RAISE (ABORT, 'what was done stays written'); END;

CREATE VIEW material_states AS
SELECT m.slug, r.*, coalesce(v.status, 'draft') AS status, v.reason, v.reviewer,
       coalesce(v.created_unix_ms, 0) AS reviewed_unix_ms,
       (SELECT max(revision) FROM material_revisions l WHERE l.material = r.material) AS latest,
       (SELECT max(version) FROM material_trail t WHERE t.material = r.material) AS version
FROM material_revisions r JOIN materials m ON m.number = r.material
LEFT JOIN material_reviews v ON v.number = (SELECT max(number) FROM material_reviews w
                                            WHERE w.material = r.material AND w.revision = r.revision);

-- Measured ground motions. A record never changes: other processing is another record, under another name. peak: the
-- largest magnitude; velocities: of the base from rest. unit: the file's. digest: SHA-256 of the interval and the samples,
-- eight bytes each, little-endian. author: as above.
CREATE TABLE records (
    number           INTEGER PRIMARY KEY,
    name             TEXT    NOT NULL UNIQUE
                     CHECK (name GLOB '[A-Za-z0-9]*' AND name NOT GLOB '*[^A-Za-z0-9._-]*' AND length(name) <= 64),
    source           TEXT,
    processing       TEXT,
    earthquake       TEXT,
    station          TEXT,
    notes            TEXT,
    layout           TEXT    NOT NULL,
    header           TEXT,
    unit             TEXT    NOT NULL,
    stated_unit      TEXT,
    interval         REAL    NOT NULL CHECK (interval > 0),
    count            INTEGER NOT NULL CHECK (count >= 1),
    peak             REAL    NOT NULL CHECK (peak >= 0),
    peak_time        REAL    NOT NULL,
    peak_velocity    REAL    NOT NULL,
    end_velocity     REAL    NOT NULL,
    digest           TEXT    NOT NULL CHECK (length(digest) = 64),
    author           TEXT,
    created_unix_ms  INTEGER NOT NULL,
    checks           BLOB
) STRICT;
CREATE INDEX records_by_digest ON records (digest);

-- The samples in m/s^2, in a table of their own, so that a search of the records does not read them.
CREATE TABLE record_samples (
    number   INTEGER PRIMARY KEY,
    checks   BLOB,
    samples  BLOB    NOT NULL
) STRICT;

-- Everything of a result but its series. Columns that may be long are last: reading the others does not read them. notes:
-- warnings of the run itself, a JSON array; `warnings` are the scene's. study: the answer of the scene's study. work: the
-- counters of the run. outcome: spectra, impacts, energies and summary in binary (server/jobs/outcome_blob.c).
CREATE TABLE results (
    number           INTEGER PRIMARY KEY,
    id               TEXT    NOT NULL UNIQUE,
    engine           TEXT    NOT NULL,
    sample_rate      REAL    NOT NULL,
    count            INTEGER NOT NULL,
    created_unix_ms  INTEGER NOT NULL,
    checks           BLOB,
    summary          TEXT    NOT NULL,
    plan             TEXT    NOT NULL,
    warnings         TEXT    NOT NULL,
    work             TEXT,
    notes            TEXT,
    impact_count     INTEGER NOT NULL,
    scene            TEXT    NOT NULL,
    outcome          BLOB    NOT NULL,
    study            TEXT
) STRICT;

-- What of the materials and records a result was made with: "sponge@1", "record:elcentro".
CREATE TABLE result_uses (
    name    TEXT    NOT NULL,
    result  INTEGER NOT NULL REFERENCES results (number) ON DELETE CASCADE,
    PRIMARY KEY (name, result)
) STRICT, WITHOUT ROWID;
CREATE INDEX result_uses_of ON result_uses (result);

-- Series that cost more to compute than to read, up to a limit of bytes; the least recently used one is deleted first (`used`
-- rises with every use). Bodies are in a table of their own, so that a use does not write them again.
CREATE TABLE series (
    number  INTEGER PRIMARY KEY,
    result  TEXT    NOT NULL UNIQUE,
    bytes   INTEGER NOT NULL,
    used    INTEGER NOT NULL
) STRICT;
CREATE INDEX series_by_use ON series (used);
CREATE TABLE series_bodies (
    number  INTEGER PRIMARY KEY,
    checks  BLOB,
    body    BLOB    NOT NULL
) STRICT;

-- A sweep, written before any of it runs. Scene i is in chunk i mod chunks, at place i / chunks.
CREATE TABLE sweeps (
    number           INTEGER PRIMARY KEY,
    result           TEXT    NOT NULL UNIQUE,
    scene            TEXT    NOT NULL,
    points           INTEGER NOT NULL CHECK (points > 0),
    metrics          INTEGER NOT NULL CHECK (metrics > 0),
    chunks           INTEGER NOT NULL CHECK (chunks BETWEEN 1 AND points),
    retries          INTEGER NOT NULL,
    created_unix_ms  INTEGER NOT NULL,
    checks           BLOB
) STRICT;

-- A chunk is one row, written when it is complete. rows: a byte of status for each scene, then its metrics, eight bytes each,
-- little-endian. reasons: "place sentence" lines of those that failed. is_open: those that failed are to be tried again.
CREATE TABLE sweep_chunks (
    number   INTEGER PRIMARY KEY,
    sweep    INTEGER NOT NULL REFERENCES sweeps (number) ON DELETE CASCADE,
    chunk    INTEGER NOT NULL,
    failed   INTEGER NOT NULL,
    is_open  INTEGER NOT NULL,
    checks   BLOB,
    reasons  TEXT,
    rows     BLOB    NOT NULL,
    UNIQUE (sweep, chunk)
) STRICT;

-- state: 0 accepted, 1 running, 2 successful, 3 failed, 4 dismissed. A job names its result from the start. client: the
-- token's name it came with; study: the kind of the scene's study; labels: a JSON array of texts; words: title and labels,
-- case folded, a line each, for searches; idempotency_key and request: the client's name of its request, and the SHA-256 of
-- its body. scene: '' of successful jobs, whose scene is their result's.
CREATE TABLE jobs (
    number            INTEGER PRIMARY KEY,
    id                TEXT    NOT NULL UNIQUE,
    state             INTEGER NOT NULL CHECK (state BETWEEN 0 AND 4),
    result            TEXT    NOT NULL,
    is_cached         INTEGER NOT NULL,
    created_unix_ms   INTEGER NOT NULL,
    started_unix_ms   INTEGER NOT NULL,
    finished_unix_ms  INTEGER NOT NULL,
    queued            REAL    NOT NULL,
    run               REAL    NOT NULL,
    total             REAL    NOT NULL,
    title             TEXT,
    problem           TEXT,
    warnings          TEXT    NOT NULL,
    labels            TEXT,
    study             TEXT,
    client            TEXT,
    idempotency_key   TEXT,
    request           TEXT,
    words             TEXT,
    checks            BLOB,
    scene             TEXT    NOT NULL
) STRICT;
CREATE INDEX jobs_unfinished ON jobs (number) WHERE state < 2;
CREATE UNIQUE INDEX jobs_keyed ON jobs (idempotency_key, coalesce(client, '')) WHERE idempotency_key IS NOT NULL;
-- Lists are in the order of arrival, then of numbers. Partial indices cost nothing for the jobs that are not in them.
CREATE INDEX jobs_created ON jobs (created_unix_ms);
CREATE INDEX jobs_unsuccessful ON jobs (state, created_unix_ms) WHERE state > 2;
CREATE INDEX jobs_studied ON jobs (study, created_unix_ms) WHERE study IS NOT NULL;
-- Contains all that a search by words reads.
CREATE INDEX jobs_worded ON jobs (created_unix_ms, number, words) WHERE words IS NOT NULL;
-- Twelve digits of the result's digest distinguish results well enough.
CREATE INDEX jobs_of_result ON jobs (substr(result, 3, 12));

-- What of the records an unfinished job was accepted with: "record:elcentro".
CREATE TABLE job_uses (
    job   INTEGER NOT NULL REFERENCES jobs (number) ON DELETE CASCADE,
    name  TEXT    NOT NULL,
    PRIMARY KEY (job, name)
) STRICT, WITHOUT ROWID;
CREATE INDEX job_uses_of ON job_uses (name);
CREATE TRIGGER job_uses_exist BEFORE INSERT ON job_uses
WHEN NOT EXISTS (SELECT 1 FROM records WHERE name = substr(NEW.name, length('record:') + 1))
BEGIN SELECT RAISE (ABORT, 'an unfinished job names records that exist'); END;
CREATE TRIGGER jobs_end AFTER UPDATE OF state ON jobs WHEN OLD.state < 2 AND NEW.state >= 2
BEGIN DELETE FROM job_uses WHERE job = OLD.number; END;

-- The series and the sweep of a result are deleted with it.
CREATE TRIGGER results_go AFTER DELETE ON results
BEGIN DELETE FROM series WHERE result = OLD.id; DELETE FROM sweeps WHERE result = OLD.id; END;
CREATE TRIGGER series_go AFTER DELETE ON series
BEGIN DELETE FROM series_bodies WHERE number = OLD.number; END;

CREATE TRIGGER records_keep BEFORE UPDATE ON records
BEGIN SELECT RAISE (ABORT, 'a record never changes; add another'); END;
CREATE TRIGGER records_once BEFORE INSERT ON records
WHEN EXISTS (SELECT 1 FROM records WHERE name = NEW.name OR number = NEW.number)
BEGIN SELECT RAISE (ABORT, 'a record never changes; add another'); END;
CREATE TRIGGER records_stay BEFORE DELETE ON records
WHEN EXISTS (SELECT 1 FROM result_uses WHERE name = 'record:' || OLD.name)
  OR EXISTS (SELECT 1 FROM job_uses WHERE name = 'record:' || OLD.name)
BEGIN SELECT RAISE (ABORT, 'a record that results were or will be made with is not deleted'); END;
CREATE TRIGGER records_go AFTER DELETE ON records
BEGIN DELETE FROM record_samples WHERE number = OLD.number; END;
CREATE TRIGGER record_samples_keep BEFORE UPDATE ON record_samples
BEGIN SELECT RAISE (ABORT, 'the samples of a record never change'); END;
CREATE TRIGGER record_samples_once BEFORE INSERT ON record_samples
WHEN EXISTS (SELECT 1 FROM record_samples WHERE number = NEW.number)
BEGIN SELECT RAISE (ABORT, 'the samples of a record never change'); END;
CREATE TRIGGER record_samples_stay BEFORE DELETE ON record_samples
WHEN EXISTS (SELECT 1 FROM records WHERE number = OLD.number)
BEGIN SELECT RAISE (ABORT, 'the samples of a record go with it alone'); END;

-- Access tokens. Of a token only its SHA-256 is stored. Times are 0 where there is none: never used, never expires, not
-- revoked. A revoked one stays, so that its name is not given to another, until it is forgotten.
CREATE TABLE tokens (
    number           INTEGER PRIMARY KEY,
    name             TEXT    NOT NULL UNIQUE CHECK (name <> '' AND name NOT GLOB '*[^A-Za-z0-9._-]*'),
    digest           TEXT    NOT NULL UNIQUE CHECK (length(digest) = 64),
    scopes           TEXT    NOT NULL CHECK (scopes <> ''),
    created_unix_ms  INTEGER NOT NULL,
    used_unix_ms     INTEGER NOT NULL,
    expires_unix_ms  INTEGER NOT NULL,
    revoked_unix_ms  INTEGER NOT NULL,
    checks           BLOB
) STRICT;
