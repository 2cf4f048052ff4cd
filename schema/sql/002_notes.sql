-- Warnings that only the run itself could give, a JSON array; NULL where it gave none. `warnings` are the scene's.
ALTER TABLE results ADD COLUMN notes TEXT;
