/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * schema_json.h - the JSON Schema (2020-12) of a job, made from the engine's parameter rows and
 * catalogue: a new parameter or part needs no change here. It says all that one field alone can be
 * refused for, formulas excepted; what takes several fields together stands in descriptions.
 */
#ifndef SCHEMA_JSON_H
#define SCHEMA_JSON_H

#include "text.h"

/* The whole document, in lines for people (malloc'ed, NULL = out of memory). */
char *schema_json_job(void);

/* {"type":"object",...}: what the document says of a job, as a part of another one. */
void schema_json_add_job(struct text *text);

#endif
