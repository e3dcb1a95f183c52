#pragma once

namespace hapticd::test {

/// A sanitizer takes several times the memory and address space: limits of the process mean nothing then.
#ifdef HAPTICD_SANITIZED
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

}  // namespace hapticd::test
