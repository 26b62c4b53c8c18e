-- SPDX-License-Identifier: GPL-3.0-or-later
-- 001: jobs, the keys they were submitted under, and what they leave behind.
-- Each file of this folder is run once, whole, in one transaction; it holds no BEGIN or COMMIT and
-- is never changed after a release. PRAGMA user_version is the number of the last file that ran.

CREATE TABLE jobs (
    seq          INTEGER PRIMARY KEY AUTOINCREMENT,  -- order of submission; never used twice
    id           TEXT NOT NULL UNIQUE                -- what users see
                 CHECK (length(id) BETWEEN 2 AND 23 AND id NOT GLOB '*[^a-z0-9-]*'),
    hash         BLOB NOT NULL CHECK (length(hash) = 32),  -- SHA-256 of the scene's encoding
    state        TEXT NOT NULL DEFAULT 'queued'
                 CHECK (state IN ('queued', 'running', 'done', 'failed', 'cancelled')),
    submitted_ms INTEGER NOT NULL,                   -- milliseconds since 1970 UTC
    started_ms   INTEGER,                            -- when its first chunk was claimed
    finished_ms  INTEGER,                            -- when it reached a state for good
    chunks       INTEGER NOT NULL CHECK (chunks > 0),  -- parts it is run in
    chunks_done  INTEGER NOT NULL DEFAULT 0 CHECK (chunks_done BETWEEN 0 AND chunks),
    job          TEXT NOT NULL,                      -- JSON: completed with defaults
    derived      TEXT NOT NULL,                      -- JSON: what the engine made of it
    error        TEXT,                               -- why it failed
    CHECK ((state IN ('done', 'failed', 'cancelled')) = (finished_ms IS NOT NULL)),
    CHECK (state NOT IN ('running', 'done') OR started_ms IS NOT NULL),
    CHECK ((state = 'failed') = (error IS NOT NULL))
) STRICT;

-- The same job stands only once, unless it failed or was cancelled: then it may be tried again.
CREATE UNIQUE INDEX jobs_live_hash ON jobs (hash) WHERE state IN ('queued', 'running', 'done');
-- Lists of one state, newest first (seq is the last column of every index), and recovery.
CREATE INDEX jobs_state ON jobs (state);

-- A state that ends a job is for good, whoever writes.
CREATE TRIGGER jobs_transition BEFORE UPDATE OF state ON jobs
WHEN NOT ((old.state = 'queued' AND new.state IN ('running', 'cancelled', 'failed'))
          OR (old.state = 'running' AND new.state IN ('done', 'failed', 'cancelled')))
BEGIN
    SELECT RAISE(ABORT, 'no such transition');
END;

CREATE TABLE job_counts (                            -- how many jobs are in each state
    state TEXT PRIMARY KEY CHECK (state IN ('queued', 'running', 'done', 'failed', 'cancelled')),
    jobs  INTEGER NOT NULL CHECK (jobs >= 0)
) STRICT, WITHOUT ROWID;
INSERT INTO job_counts (state, jobs)
VALUES ('queued', 0), ('running', 0), ('done', 0), ('failed', 0), ('cancelled', 0);

CREATE TRIGGER jobs_count_insert AFTER INSERT ON jobs
BEGIN
    UPDATE job_counts SET jobs = jobs + 1 WHERE state = new.state;
END;
CREATE TRIGGER jobs_count_move AFTER UPDATE OF state ON jobs
BEGIN
    UPDATE job_counts SET jobs = jobs - 1 WHERE state = old.state;
    UPDATE job_counts SET jobs = jobs + 1 WHERE state = new.state;
END;
CREATE TRIGGER jobs_count_delete AFTER DELETE ON jobs
BEGIN
    UPDATE job_counts SET jobs = jobs - 1 WHERE state = old.state;
END;

CREATE TABLE idempotency_keys (                      -- Idempotency-Key headers seen
    key TEXT PRIMARY KEY CHECK (length(key) BETWEEN 1 AND 255),
    job INTEGER NOT NULL REFERENCES jobs (seq)       -- the job it was answered with
) STRICT;

CREATE TABLE checkpoints (                           -- newest checkpoint of a chunk in motion
    job   INTEGER NOT NULL REFERENCES jobs (seq),
    chunk INTEGER NOT NULL CHECK (chunk >= 0),
    bytes BLOB NOT NULL,                             -- bcd_run_save
    PRIMARY KEY (job, chunk)
) STRICT;

CREATE TABLE chunks (                                -- finished chunks of a running job
    job   INTEGER NOT NULL REFERENCES jobs (seq),
    chunk INTEGER NOT NULL CHECK (chunk >= 0),
    bytes BLOB NOT NULL,                             -- bcd_tally_save
    PRIMARY KEY (job, chunk)
) STRICT;

CREATE TABLE results (                               -- the tables of a job that is done
    job        INTEGER NOT NULL REFERENCES jobs (seq),
    position   INTEGER NOT NULL CHECK (position >= 0),  -- order within the result
    observable TEXT NOT NULL,
    bytes      BLOB NOT NULL,                        -- bcd_table_save
    PRIMARY KEY (job, observable)
) STRICT;
