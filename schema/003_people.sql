-- SPDX-License-Identifier: GPL-3.0-or-later
-- 003: whose a job is, how people call it, and how much it hurries.

ALTER TABLE jobs ADD COLUMN owner TEXT NOT NULL DEFAULT 'local'
    CHECK (length(owner) BETWEEN 1 AND 32 AND owner NOT GLOB '*[^a-z0-9_-]*');
ALTER TABLE jobs ADD COLUMN priority INTEGER NOT NULL DEFAULT 0
    CHECK (priority BETWEEN -100 AND 100);           -- within the owner's jobs
ALTER TABLE jobs ADD COLUMN label TEXT;              -- NULL = none
ALTER TABLE jobs ADD COLUMN superseded INTEGER NOT NULL DEFAULT 0
    CHECK (superseded IN (0, 1));                    -- run anew by force: the newer one stands

-- The job of an owner that comes next.
CREATE INDEX jobs_waiting ON jobs (owner, priority DESC, seq) WHERE state = 'queued';

-- The same job stands only once, unless it failed, was cancelled, or is run anew by force.
DROP INDEX jobs_live_hash;
CREATE UNIQUE INDEX jobs_live_hash ON jobs (hash)
    WHERE state IN ('queued', 'running', 'done') AND superseded = 0;

CREATE TABLE job_tags (
    job INTEGER NOT NULL REFERENCES jobs (seq),
    tag TEXT NOT NULL CHECK (length(tag) BETWEEN 1 AND 64 AND tag NOT GLOB '*[^A-Za-z0-9._-]*'),
    PRIMARY KEY (job, tag)
) STRICT, WITHOUT ROWID;
CREATE INDEX job_tags_tag ON job_tags (tag, job);
