-- SPDX-License-Identifier: GPL-3.0-or-later
-- 005: the index for finding jobs by any of their scalars (server/store/store_find.h).
--
-- 1024 jobs with consecutive seq are a segment: number seq >> 10. A segment that can get no more
-- jobs is sealed: for each scalar that its jobs have there is one column, a blob of their values
-- (server/store/store_column.h). Jobs of unsealed segments are looked through as they are, so
-- nothing here is needed for right answers, only for quick ones.

CREATE TABLE job_keys (                              -- names of scalars
    id   INTEGER PRIMARY KEY CHECK (id BETWEEN 1 AND 2147483647),
    path TEXT NOT NULL UNIQUE CHECK (path <> '')     -- "diameter", "derived.steps", "owner", ...
) STRICT;
INSERT INTO job_keys (id, path) VALUES (1, 'submitted_at'), (2, 'started_at'), (3, 'finished_at');

CREATE TABLE job_segments (                          -- sealed segments
    segment INTEGER PRIMARY KEY CHECK (segment >= 0),
    states  TEXT NOT NULL CHECK (length(states) = 1024)  -- first letter of each job's state, '-'
) STRICT;                                                -- where there is none

CREATE TABLE job_columns (                           -- values of one scalar in a sealed segment
    id    INTEGER PRIMARY KEY,                       -- key << 32 | segment
    least ANY,                                       -- smallest and largest value; NULL where that
    most  ANY,                                       -- is a text
    bytes BLOB NOT NULL
) STRICT;

CREATE TABLE job_news (                              -- values that came later (results, times) and
    key   INTEGER NOT NULL REFERENCES job_keys (id), -- are not in their columns yet: they prevail
    job   INTEGER NOT NULL REFERENCES jobs (seq),
    value ANY NOT NULL,
    PRIMARY KEY (key, job)
) STRICT, WITHOUT ROWID;

CREATE TRIGGER jobs_find_state AFTER UPDATE OF state ON jobs
BEGIN
    UPDATE job_segments
    SET states = substr(states, 1, new.seq & 1023) || substr(new.state, 1, 1)
                 || substr(states, (new.seq & 1023) + 2)
    WHERE segment = new.seq >> 10;
END;
CREATE TRIGGER jobs_find_started AFTER UPDATE OF started_ms ON jobs
WHEN new.started_ms IS NOT NULL
BEGIN
    INSERT OR REPLACE INTO job_news (key, job, value) VALUES (2, new.seq, new.started_ms);
END;
CREATE TRIGGER jobs_find_finished AFTER UPDATE OF finished_ms ON jobs
WHEN new.finished_ms IS NOT NULL
BEGIN
    INSERT OR REPLACE INTO job_news (key, job, value) VALUES (3, new.seq, new.finished_ms);
END;
-- Should anything else of a job ever change, its segment is looked through until sealed anew.
CREATE TRIGGER jobs_find_change AFTER UPDATE OF submitted_ms, job, derived, owner, label, priority
ON jobs
BEGIN
    DELETE FROM job_segments WHERE segment = new.seq >> 10;
END;
CREATE TRIGGER jobs_find_delete BEFORE DELETE ON jobs
BEGIN
    DELETE FROM job_news WHERE job = old.seq AND key IN (SELECT id FROM job_keys);
    DELETE FROM job_segments WHERE segment = old.seq >> 10;
END;

-- The jobs of a sweep between two others.
CREATE INDEX sweep_points_of ON sweep_points (sweep, job);
