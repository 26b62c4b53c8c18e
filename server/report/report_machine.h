/* SPDX-License-Identifier: GPL-3.0-or-later
 * report_machine.h - what a measured time belongs to. */
#ifndef REPORT_MACHINE_H
#define REPORT_MACHINE_H

/* {"architecture":..,"processor":..,"cores":..,"compiler":..}, malloc'ed; NULL = out of memory. */
char *report_machine_json(void);

#endif
