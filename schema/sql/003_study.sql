-- The answer of a scene's study, a JSON document; NULL where none was asked for.
ALTER TABLE results ADD COLUMN study TEXT;
