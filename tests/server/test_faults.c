/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_faults.c - the store when power, disk or memory fail at the k-th call; every k of power
 * cuts, some of the others (test_faults_long.c: all). */
enum { EVERY_CUT_AT_START = 37, EVERY_FULL = 3, EVERY_EIO = 11, EVERY_ALLOCATION = 211 };

#include "fault_tests.h"
