-- What the run did, counted, a JSON document; NULL in results of before this was kept.
ALTER TABLE results ADD COLUMN work TEXT;
