#pragma once

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace hapticd::rt {

/// Two numbers that are computed with at once, as g++ and clang know them on every processor.
using NumberPair = double __attribute__((vector_size(16)));

/// Pair of the larger ones.
inline NumberPair larger(NumberPair a, NumberPair b) noexcept {
#if defined(__SSE2__)
  return _mm_max_pd(a, b);
#else
  return a > b ? a : b;
#endif
}
/// Pair of the smaller ones.
inline NumberPair smaller(NumberPair a, NumberPair b) noexcept {
#if defined(__SSE2__)
  return _mm_min_pd(a, b);
#else
  return a < b ? a : b;
#endif
}

}  // namespace hapticd::rt
