-- A sweep's rows are numbers by position: scene i stands in chunk i mod chunks, at place i / chunks. What is to be done is
-- written before any of it runs; a chunk is one row, written when all of it is there. A result's sweep goes with it.
CREATE TABLE sweeps (
    number           INTEGER PRIMARY KEY,
    result           TEXT    NOT NULL UNIQUE,
    scene            TEXT    NOT NULL,
    points           INTEGER NOT NULL CHECK (points > 0),
    metrics          INTEGER NOT NULL CHECK (metrics > 0),
    chunks           INTEGER NOT NULL CHECK (chunks BETWEEN 1 AND points),
    retries          INTEGER NOT NULL,
    created_unix_ms  INTEGER NOT NULL
) STRICT;

-- rows: a byte of status for each, then its metrics, eight bytes each, little-endian. reasons: "place sentence" lines of
-- those that failed. is_open: what failed is to be tried again.
CREATE TABLE sweep_chunks (
    number   INTEGER PRIMARY KEY,
    sweep    INTEGER NOT NULL REFERENCES sweeps (number) ON DELETE CASCADE,
    chunk    INTEGER NOT NULL,
    failed   INTEGER NOT NULL,
    is_open  INTEGER NOT NULL,
    reasons  TEXT,
    rows     BLOB    NOT NULL,
    UNIQUE (sweep, chunk)
) STRICT;

CREATE TRIGGER sweeps_go AFTER DELETE ON results
BEGIN DELETE FROM sweeps WHERE result = OLD.id; END;
