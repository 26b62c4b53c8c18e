-- SPDX-License-Identifier: GPL-3.0-or-later
-- 009: tokens of workers: programs that run chunks of jobs elsewhere.

ALTER TABLE tokens RENAME TO tokens_before;
CREATE TABLE tokens (
    id         TEXT PRIMARY KEY,                     -- what it is called by, no secret
    hash       BLOB NOT NULL UNIQUE CHECK (length(hash) = 32),  -- SHA-256 of the token
    owner      TEXT NOT NULL
               CHECK (length(owner) BETWEEN 1 AND 32 AND owner NOT GLOB '*[^a-z0-9_-]*'),
    role       TEXT NOT NULL CHECK (role IN ('worker', 'reader', 'submitter', 'operator', 'admin')),
    name       TEXT,                                 -- what it is for, in the owner's words
    created_ms INTEGER NOT NULL,
    expires_ms INTEGER,                              -- NULL = never
    revoked_ms INTEGER                               -- NULL = not
) STRICT, WITHOUT ROWID;
INSERT INTO tokens SELECT id, hash, owner, role, name, created_ms, expires_ms, revoked_ms
FROM tokens_before;
DROP TABLE tokens_before;
