#pragma once

namespace hapticd::test {

/// AddressSanitizer takes much memory and address space: limits of the process mean nothing then.
#if defined(__SANITIZE_ADDRESS__)
inline constexpr bool kUnderAddressSanitizer = true;
#else
inline constexpr bool kUnderAddressSanitizer = false;
#endif

}  // namespace hapticd::test
