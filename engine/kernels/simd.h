/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * simd.h - KERNEL_CLONES before a kernel builds it for several instruction sets and picks one when
 * the program is loaded. All of them give the same bits: the arithmetic is IEEE in a fixed order
 * and contraction to FMA is off. Left out under sanitizers, whose start-up precedes the choice.
 */
#ifndef KERNELS_SIMD_H
#define KERNELS_SIMD_H

/* clang 14 accepts target_clones, but callers in other files do not find the resolver it makes. */
#if defined(__x86_64__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) &&                \
    !defined(__SANITIZE_THREAD__)
#define KERNEL_CLONES __attribute__((target_clones("arch=x86-64-v4", "avx2", "default")))
#else
#define KERNEL_CLONES
#endif

/* Before a loop whose turns do not touch one another's memory: a hint. clang's way of taking it is
 * an error where it cannot. */
#ifdef __clang__
#define TURNS_APART
#else
#define TURNS_APART _Pragma("GCC ivdep")
#endif

#endif
