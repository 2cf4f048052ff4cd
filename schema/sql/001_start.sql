-- Materials, results and jobs. Times are milliseconds since 1970 UTC, quantities SI, documents JSON text.
-- Every table has an integer key of its own (rising, so the order of arrival) and its public name beside it, unique.

-- A material is a name; its numbers stand in revisions, which never change; what people thought of a revision
-- stands in reviews, the last one counts. A revision without a review is a draft.
CREATE TABLE materials (
    number  INTEGER PRIMARY KEY,
    slug    TEXT    NOT NULL UNIQUE CHECK (slug <> '' AND slug NOT GLOB '*[^a-z0-9_-]*')
) STRICT;

CREATE TABLE material_revisions (
    number           INTEGER PRIMARY KEY,
    material         INTEGER NOT NULL REFERENCES materials (number),
    revision         INTEGER NOT NULL CHECK (revision >= 1),
    name             TEXT    NOT NULL,
    restitution      REAL    NOT NULL CHECK (restitution BETWEEN 0 AND 1),
    contact_time     REAL    CHECK (contact_time > 0),
    source           TEXT    NOT NULL,
    created_unix_ms  INTEGER NOT NULL,
    UNIQUE (material, revision)
) STRICT;

CREATE TABLE material_reviews (
    number           INTEGER PRIMARY KEY,
    material         INTEGER NOT NULL,
    revision         INTEGER NOT NULL,
    status           TEXT    NOT NULL CHECK (status IN ('approved', 'deprecated')),
    reason           TEXT    NOT NULL,
    created_unix_ms  INTEGER NOT NULL,
    FOREIGN KEY (material, revision) REFERENCES material_revisions (material, revision)
) STRICT;
CREATE INDEX material_reviews_of ON material_reviews (material, revision, number);

CREATE TRIGGER material_revisions_keep BEFORE UPDATE ON material_revisions
BEGIN SELECT RAISE (ABORT, 'a revision of a material never changes; add a new one'); END;
CREATE TRIGGER material_revisions_stay BEFORE DELETE ON material_revisions
BEGIN SELECT RAISE (ABORT, 'a revision of a material is never deleted'); END;
CREATE TRIGGER material_reviews_keep BEFORE UPDATE ON material_reviews
BEGIN SELECT RAISE (ABORT, 'a review of a material never changes; add a new one'); END;
CREATE TRIGGER material_reviews_stay BEFORE DELETE ON material_reviews
BEGIN SELECT RAISE (ABORT, 'a review of a material is never deleted'); END;

CREATE VIEW material_states AS
SELECT slug, r.revision, name, restitution, contact_time, source,
       coalesce((SELECT status FROM material_reviews v
                 WHERE v.material = r.material AND v.revision = r.revision
                 ORDER BY v.number DESC LIMIT 1), 'draft') AS status
FROM material_revisions r JOIN materials m ON m.number = r.material;

-- Everything of a result but its series. What may be long stands last: reading the others does not touch it.
-- outcome: spectra, impacts, energies and summary in binary (server/jobs/outcome_blob.c).
CREATE TABLE results (
    number           INTEGER PRIMARY KEY,
    id               TEXT    NOT NULL UNIQUE,
    engine           TEXT    NOT NULL,
    sample_rate      REAL    NOT NULL,
    count            INTEGER NOT NULL,
    created_unix_ms  INTEGER NOT NULL,
    summary          TEXT    NOT NULL,
    plan             TEXT    NOT NULL,
    warnings         TEXT    NOT NULL,
    impact_count     INTEGER NOT NULL,
    scene            TEXT    NOT NULL,
    outcome          BLOB    NOT NULL
) STRICT;

-- state: 0 accepted, 1 running, 2 successful, 3 failed, 4 dismissed. A job names its result from the start.
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
    scene             TEXT    NOT NULL
) STRICT;
CREATE INDEX jobs_unfinished ON jobs (number) WHERE state < 2;

-- The five buffers of Li and Darby 2009, as measured (Table I).
INSERT INTO materials (slug) VALUES ('sponge'), ('soft_rubber'), ('hard_rubber'), ('hard_acrylic'), ('aluminium');
WITH table_one (slug, name, restitution, contact_time) AS (VALUES
    ('sponge',       'Sponge',       0.61, 0.025),
    ('soft_rubber',  'Soft rubber',  0.44, 0.019),
    ('hard_rubber',  'Hard rubber',  0.53, 0.004),
    ('hard_acrylic', 'Hard acrylic', 0.49, 0.003),
    ('aluminium',    'Aluminium',    0.46, 0.0003))
INSERT INTO material_revisions (material, revision, name, restitution, contact_time, source, created_unix_ms)
SELECT m.number, 1, t.name, t.restitution, t.contact_time, 'doi:10.1002/stc.238, Table I', unixepoch() * 1000
FROM table_one t JOIN materials m USING (slug) ORDER BY m.number;
INSERT INTO material_reviews (material, revision, status, reason, created_unix_ms)
SELECT material, revision, 'approved', 'published', created_unix_ms FROM material_revisions ORDER BY number;
