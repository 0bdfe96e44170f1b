/*
  sbfour.h - two and four numbers at a time, where the compiler has vector types: unaligned, and allowed to examine any array.
*/
#pragma once
#include "sbkernel.h"

#if defined(__GNUC__)
  #define SB_HAS_FOUR 1
typedef double Two __attribute__((vector_size(16), aligned(8), may_alias));
typedef double Four __attribute__((vector_size(32), aligned(8), may_alias));
typedef int64_t Mask __attribute__((vector_size(32), aligned(8), may_alias));
  #if defined(__clang__)
    #define SHUFFLE(a, b, i, j, k, l) __builtin_shufflevector(a, b, i, j, k, l)
  #else
    #define SHUFFLE(a, b, i, j, k, l) __builtin_shuffle(a, b, (Mask){i, j, k, l})
  #endif
#endif
