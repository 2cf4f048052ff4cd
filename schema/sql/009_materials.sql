-- The lab's materials. What is said of one stands in its revisions, what was measured in its measurements, what people
-- think of a revision in its reviews, and who did what and why in the trail: rows are added, never changed, never deleted.
-- Who: the token's name; NULL: the local user, or of a revision the program; 'impactd': the program reviewed it. Standard deviations, SI units, temperatures in degC.
DROP VIEW material_states;
CREATE TEMP TABLE revisions_before AS SELECT * FROM material_revisions;
CREATE TEMP TABLE reviews_before AS SELECT * FROM material_reviews;
DROP TABLE material_reviews;
DROP TABLE material_revisions;

-- lists: tags, table over approach speed, numbers of measurements used, a JSON object. base: 0 fixed, 1 free.
-- separation: 0 zero penetration, 1 zero force. reverts: the revision that it says again.
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
    UNIQUE (material, revision),
    CHECK (restitution IS NOT NULL OR lists IS NOT NULL)
) STRICT;

-- status: the last review of a revision counts; without one it is a draft.
CREATE TABLE material_reviews (
    number           INTEGER PRIMARY KEY,
    material         INTEGER NOT NULL,
    revision         INTEGER NOT NULL,
    status           TEXT    NOT NULL CHECK (status IN ('approved', 'deprecated')),
    reason           TEXT    NOT NULL,
    reviewer         TEXT,
    created_unix_ms  INTEGER NOT NULL,
    FOREIGN KEY (material, revision) REFERENCES material_revisions (material, revision)
) STRICT;
CREATE INDEX material_reviews_of ON material_reviews (material, revision, number);

-- document: the drop test as it was sent, JSON.
CREATE TABLE material_measurements (
    number           INTEGER PRIMARY KEY,
    material         INTEGER NOT NULL REFERENCES materials (number),
    measurement      INTEGER NOT NULL CHECK (measurement >= 1),
    author           TEXT,
    comment          TEXT    NOT NULL,
    created_unix_ms  INTEGER NOT NULL,
    -- Of the document, for lists that do not read it, large as it may be: they lie before it.
    drops            INTEGER NOT NULL,
    traces           INTEGER NOT NULL,
    head             TEXT    NOT NULL,
    document         TEXT    NOT NULL,
    UNIQUE (material, measurement)
) STRICT;

-- What was done, to what (a revision or a measurement, where it is about one), by whom, why. A material's entries count
-- from 1: the last one's number is the material's version.
CREATE TABLE material_trail (
    number           INTEGER PRIMARY KEY,
    material         INTEGER NOT NULL REFERENCES materials (number),
    version          INTEGER NOT NULL CHECK (version >= 1),
    action           TEXT    NOT NULL CHECK (action IN ('create', 'revise', 'revert', 'approve', 'deprecate', 'measure', 'import')),
    revision         INTEGER,
    measurement      INTEGER,
    who              TEXT,
    why              TEXT    NOT NULL,
    created_unix_ms  INTEGER NOT NULL
) STRICT;
CREATE UNIQUE INDEX material_trail_of ON material_trail (material, version);

-- One row: what revisions, reviews, measurements and the trail take by and large. They only grow, so there is an end to it.
CREATE TABLE material_room (
    bytes  INTEGER NOT NULL CHECK (bytes >= 0)
) STRICT;
INSERT INTO material_room (bytes) VALUES (0);

-- The paper's five, with what it says of their tests; what it does not say stays unknown. They are of no user's hand: their
-- time is that of this step, the same everywhere, and it is the program that calls them approved.
CREATE TEMP TABLE paper (slug TEXT NOT NULL, kind TEXT NOT NULL);
INSERT INTO paper (slug, kind) VALUES ('sponge', 'foam'), ('soft_rubber', 'rubber'), ('hard_rubber', 'rubber'),
                                      ('hard_acrylic', 'plastic'), ('aluminium', 'metal');
INSERT INTO material_revisions (number, material, revision, name, kind, restitution, contact_time, least_speed, most_speed,
                                impactor, impactor_mass, source, comment, created_unix_ms)
SELECT b.number, b.material, b.revision, b.name, p.kind, b.restitution, b.contact_time, iif(p.slug IS NULL, NULL, 0.15),
       iif(p.slug IS NULL, NULL, 1.0), iif(p.slug IS NULL, NULL, 'steel ball, 30 mm'), iif(p.slug IS NULL, NULL, 0.11),
       b.source, iif(p.slug IS NULL, 'from before', 'as published'), 1795219200000
FROM revisions_before b JOIN materials m ON m.number = b.material LEFT JOIN paper p ON p.slug = m.slug ORDER BY b.number;
INSERT INTO material_reviews (number, material, revision, status, reason, reviewer, created_unix_ms)
SELECT b.number, b.material, b.revision, b.status, b.reason, iif(p.slug IS NULL, NULL, 'impactd'), 1795219200000
FROM reviews_before b JOIN materials m ON m.number = b.material LEFT JOIN paper p ON p.slug = m.slug ORDER BY b.number;
INSERT INTO material_trail (material, version, action, revision, who, why, created_unix_ms)
SELECT material, row_number() OVER (PARTITION BY material ORDER BY is_review, number),
       CASE action WHEN 'approved' THEN 'approve' WHEN 'deprecated' THEN 'deprecate' ELSE action END, revision, who, why,
       created_unix_ms
FROM (SELECT 0 AS is_review, number, material, revision, iif(revision = 1, 'create', 'revise') AS action, author AS who,
             comment AS why, created_unix_ms FROM material_revisions
      UNION ALL
      SELECT 1, number, material, revision, status, reviewer, reason, created_unix_ms FROM material_reviews)
ORDER BY is_review, number;
DROP TABLE paper;
DROP TABLE revisions_before;
DROP TABLE reviews_before;

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
-- INSERT OR REPLACE deletes without telling the triggers above: what is there is not written over.
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

-- What of the catalogue a result was made with: "sponge@1", "record:elcentro".
CREATE TABLE result_uses (
    name    TEXT    NOT NULL,
    result  INTEGER NOT NULL REFERENCES results (number) ON DELETE CASCADE,
    PRIMARY KEY (name, result)
) STRICT, WITHOUT ROWID;
INSERT OR IGNORE INTO result_uses (name, result)
SELECT t.value, r.number FROM results r, json_tree(r.scene) t
WHERE t.key = 'material' AND t.type = 'text' AND t.value LIKE '%@%';
CREATE INDEX result_uses_of ON result_uses (result);
