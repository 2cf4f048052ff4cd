-- What jobs are searched by. client: the token's name it came with; idempotency_key and request: what the client named
-- its request, and the SHA-256 of its body; study: the kind of the scene's study; labels: a JSON array of texts;
-- words: title and labels, case folded, a line each.
ALTER TABLE jobs ADD COLUMN client TEXT;
ALTER TABLE jobs ADD COLUMN idempotency_key TEXT;
ALTER TABLE jobs ADD COLUMN request TEXT;
ALTER TABLE jobs ADD COLUMN study TEXT;
ALTER TABLE jobs ADD COLUMN labels TEXT;
ALTER TABLE jobs ADD COLUMN words TEXT;

CREATE UNIQUE INDEX jobs_keyed ON jobs (idempotency_key, coalesce(client, '')) WHERE idempotency_key IS NOT NULL;

-- Lists are walked by time of arrival, then by number. What most jobs have none of costs most jobs nothing.
CREATE INDEX jobs_created ON jobs (created_unix_ms);
CREATE INDEX jobs_unsuccessful ON jobs (state, created_unix_ms) WHERE state > 2;
CREATE INDEX jobs_studied ON jobs (study, created_unix_ms) WHERE study IS NOT NULL;
-- Holds all that a search by words reads.
CREATE INDEX jobs_worded ON jobs (created_unix_ms, number, words) WHERE words IS NOT NULL;
-- Twelve digits of the result's digest tell results apart well enough.
CREATE INDEX jobs_of_result ON jobs (substr(result, 3, 12));
