/* SPDX-License-Identifier: GPL-3.0-or-later
 * token.h - bcdd token create|list|revoke: tokens of a directory that no daemon is using. */
#ifndef TOKEN_H
#define TOKEN_H

/* argv[1] is "token". The program's exit code: 0, 1 (it failed), 2 (it was called wrongly). */
int token_main(int argc, char *const *argv);

extern const char token_usage[];

#endif
