/* SPDX-License-Identifier: GPL-3.0-or-later
 * schema_results.h - JSON Schemas of results, from the tables that the engine's observables make.
 */
#ifndef SCHEMA_RESULTS_H
#define SCHEMA_RESULTS_H

#include "text.h"

/* Components of an OpenAPI document: "msdResult":{..} and so on for each observable, "Result": one
 * of them, "Results": those that a job asked for, by name. */
void schema_results_add(struct text *text);

#endif
