/* SPDX-License-Identifier: GPL-3.0-or-later
 * openapi.h - the API's description (OpenAPI 3.1), from the route table, the engine's tables and
 * schema/components.json. */
#ifndef OPENAPI_H
#define OPENAPI_H

/* In lines for people; malloc'ed, NULL = out of memory. */
char *openapi_print(void);

#endif
