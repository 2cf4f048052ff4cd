-- Series that are dearer to compute than to read, under a budget of bytes; the longest unused one goes first (`used`
-- rises with every use). Bodies stand apart, so that a use does not write them anew.
CREATE TABLE series (
    number  INTEGER PRIMARY KEY,
    result  TEXT    NOT NULL UNIQUE,
    bytes   INTEGER NOT NULL,
    used    INTEGER NOT NULL
) STRICT;
CREATE INDEX series_by_use ON series (used);
CREATE TABLE series_bodies (
    number  INTEGER PRIMARY KEY,
    body    BLOB    NOT NULL
) STRICT;
CREATE TRIGGER series_body_goes AFTER DELETE ON series
BEGIN DELETE FROM series_bodies WHERE number = OLD.number; END;
CREATE TRIGGER series_go_with_their_result AFTER DELETE ON results
BEGIN DELETE FROM series WHERE result = OLD.id; END;
