/* SPDX-License-Identifier: GPL-3.0-or-later
 * test_faults_long.c - the store when power, disk or memory fail at the k-th call, for every k. */
enum { EVERY_CUT_AT_START = 1, EVERY_FULL = 1, EVERY_EIO = 1, EVERY_ALLOCATION = 1 };

#include "fault_tests.h"
