-- SPDX-License-Identifier: GPL-3.0-or-later
-- 002: reports that the daemon measured about itself.

CREATE TABLE reports (
    name       TEXT PRIMARY KEY CHECK (name <> ''),  -- "work-precision"
    created_ms INTEGER NOT NULL,                     -- milliseconds since 1970 UTC
    version    TEXT NOT NULL,                        -- program and result version that measured it
    machine    TEXT NOT NULL,                        -- JSON: what it was measured on
    json       TEXT NOT NULL,                        -- the report in its three forms
    csv        TEXT NOT NULL,
    svg        TEXT NOT NULL
) STRICT;
