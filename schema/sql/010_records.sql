-- Measured ground motions. A record never changes: other processing is another record, under another name. Quantities are
-- SI (peak: the largest magnitude, velocities those of the base from rest), `unit` is the file's. digest: SHA-256 of the
-- interval and the samples, eight bytes each, little-endian. author: the token's name it came with.
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
    created_unix_ms  INTEGER NOT NULL
) STRICT;
CREATE INDEX records_by_digest ON records (digest);

-- The samples in m/s^2, apart, so that looking through the records does not read them.
CREATE TABLE record_samples (
    number   INTEGER PRIMARY KEY,
    samples  BLOB    NOT NULL
) STRICT;

-- What of the records an unfinished job was accepted with: "record:elcentro".
CREATE TABLE job_uses (
    job   INTEGER NOT NULL REFERENCES jobs (number) ON DELETE CASCADE,
    name  TEXT    NOT NULL,
    PRIMARY KEY (job, name)
) STRICT, WITHOUT ROWID;
CREATE INDEX job_uses_of ON job_uses (name);
CREATE TRIGGER jobs_end AFTER UPDATE OF state ON jobs WHEN OLD.state < 2 AND NEW.state >= 2
BEGIN DELETE FROM job_uses WHERE job = OLD.number; END;

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
