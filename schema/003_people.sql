-- SPDX-License-Identifier: GPL-3.0-or-later
-- 003: people: whose a job is, how they call it and how much it hurries; what each may use and has
-- used; tokens; who did what. Times are milliseconds since 1970 UTC.

ALTER TABLE jobs ADD COLUMN owner TEXT NOT NULL DEFAULT 'local'
    CHECK (length(owner) BETWEEN 1 AND 32 AND owner NOT GLOB '*[^a-z0-9_-]*');
ALTER TABLE jobs ADD COLUMN priority INTEGER NOT NULL DEFAULT 0
    CHECK (priority BETWEEN -100 AND 100);           -- within the owner's jobs
ALTER TABLE jobs ADD COLUMN label TEXT;              -- NULL = none
ALTER TABLE jobs ADD COLUMN superseded INTEGER NOT NULL DEFAULT 0
    CHECK (superseded IN (0, 1));                    -- run anew by force: the newer one stands
ALTER TABLE jobs ADD COLUMN core_seconds REAL NOT NULL DEFAULT 0
    CHECK (core_seconds >= 0);                       -- expected when it was accepted
ALTER TABLE jobs ADD COLUMN bytes INTEGER NOT NULL DEFAULT 0
    CHECK (bytes >= 0);                              -- on disk: expected, then those of its results

-- The job of an owner that comes next; and, from the index alone, what waits before a new one.
CREATE INDEX jobs_waiting ON jobs (owner, priority DESC, seq, core_seconds) WHERE state = 'queued';

-- The same job stands only once, unless it failed, was cancelled, or is run anew by force.
DROP INDEX jobs_live_hash;
CREATE UNIQUE INDEX jobs_live_hash ON jobs (hash)
    WHERE state IN ('queued', 'running', 'done') AND superseded = 0;

-- Keys belong to whoever sent them: two owners may call their own requests alike.
ALTER TABLE idempotency_keys RENAME TO keys_of_all;
CREATE TABLE idempotency_keys (                      -- Idempotency-Key headers seen
    owner TEXT NOT NULL,
    key   TEXT NOT NULL CHECK (length(key) BETWEEN 1 AND 255),
    job   INTEGER NOT NULL REFERENCES jobs (seq),    -- the job it was answered with
    PRIMARY KEY (owner, key)
) STRICT, WITHOUT ROWID;
INSERT INTO idempotency_keys (owner, key, job) SELECT 'local', key, job FROM keys_of_all;
DROP TABLE keys_of_all;

CREATE TABLE job_tags (
    job INTEGER NOT NULL REFERENCES jobs (seq),
    tag TEXT NOT NULL CHECK (length(tag) BETWEEN 1 AND 64 AND tag NOT GLOB '*[^A-Za-z0-9._-]*'),
    PRIMARY KEY (job, tag)
) STRICT, WITHOUT ROWID;
CREATE INDEX job_tags_tag ON job_tags (tag, job);

CREATE TABLE owners (                                -- who has jobs or quotas
    owner             TEXT PRIMARY KEY
                      CHECK (length(owner) BETWEEN 1 AND 32 AND owner NOT GLOB '*[^a-z0-9_-]*'),
    queued            INTEGER NOT NULL DEFAULT 0,    -- jobs of state queued
    waiting_seconds   REAL NOT NULL DEFAULT 0,       -- core_seconds of what is queued or runs
    bytes             INTEGER NOT NULL DEFAULT 0,    -- of all jobs
    usage_seconds     REAL NOT NULL DEFAULT 0,       -- core seconds used, halved every half-life,
    usage_ms          INTEGER NOT NULL DEFAULT 0,    -- as they were then
    day               INTEGER NOT NULL DEFAULT 0,    -- days since 1970 UTC,
    day_seconds       REAL NOT NULL DEFAULT 0,       -- and core seconds used on that one
    quota_queued      INTEGER CHECK (quota_queued >= 0),       -- NULL = the server's default
    quota_day_seconds REAL CHECK (quota_day_seconds >= 0),
    quota_bytes       INTEGER CHECK (quota_bytes >= 0)
) STRICT, WITHOUT ROWID;

UPDATE jobs SET bytes = (SELECT coalesce(sum(length(results.bytes)), 0) FROM results
                         WHERE results.job = jobs.seq)
WHERE state = 'done';
INSERT INTO owners (owner, queued, bytes)
SELECT owner, sum(state = 'queued'), sum(bytes) FROM jobs GROUP BY owner;

CREATE TRIGGER jobs_owner_insert AFTER INSERT ON jobs
BEGIN
    INSERT OR IGNORE INTO owners (owner) VALUES (new.owner);
    UPDATE owners SET queued = queued + (new.state = 'queued'),
                      waiting_seconds = waiting_seconds + new.core_seconds,
                      bytes = bytes + new.bytes
    WHERE owner = new.owner;
END;
CREATE TRIGGER jobs_owner_move AFTER UPDATE OF state ON jobs
BEGIN
    UPDATE owners SET queued = queued - (old.state = 'queued'),
                      waiting_seconds = max(0, waiting_seconds - CASE
                          WHEN new.state IN ('done', 'failed', 'cancelled') THEN new.core_seconds
                          ELSE 0 END)
    WHERE owner = new.owner;
END;
CREATE TRIGGER jobs_owner_bytes AFTER UPDATE OF bytes ON jobs
BEGIN
    UPDATE owners SET bytes = bytes - old.bytes + new.bytes WHERE owner = new.owner;
END;
CREATE TRIGGER jobs_owner_delete AFTER DELETE ON jobs
BEGIN
    UPDATE owners SET queued = queued - (old.state = 'queued'), bytes = bytes - old.bytes
    WHERE owner = old.owner;
END;

CREATE TABLE tokens (
    id         TEXT PRIMARY KEY,                     -- what it is called by, no secret
    hash       BLOB NOT NULL UNIQUE CHECK (length(hash) = 32),  -- SHA-256 of the token
    owner      TEXT NOT NULL
               CHECK (length(owner) BETWEEN 1 AND 32 AND owner NOT GLOB '*[^a-z0-9_-]*'),
    role       TEXT NOT NULL CHECK (role IN ('reader', 'submitter', 'operator', 'admin')),
    name       TEXT,                                 -- what it is for, in the owner's words
    created_ms INTEGER NOT NULL,
    expires_ms INTEGER,                              -- NULL = never
    revoked_ms INTEGER                               -- NULL = not
) STRICT, WITHOUT ROWID;

CREATE TABLE audit (                                 -- who did what; the oldest lines go
    seq     INTEGER PRIMARY KEY AUTOINCREMENT,
    time_ms INTEGER NOT NULL,
    owner   TEXT NOT NULL,                           -- who did it
    token   TEXT,                                    -- by which token; NULL = none was needed
    action  TEXT NOT NULL,                           -- "job.submit"
    object  TEXT NOT NULL,                           -- the id of what it was done to
    detail  TEXT NOT NULL
) STRICT;

CREATE TABLE calibration (                           -- real time over nominal time of chunks run
    method     TEXT PRIMARY KEY,                     -- "" = of the machine as such
    factor     REAL NOT NULL CHECK (factor > 0),
    seconds    REAL NOT NULL,                        -- core seconds it was measured on
    updated_ms INTEGER NOT NULL
) STRICT, WITHOUT ROWID;
