#pragma once

namespace hapticd::test {

/// AddressSanitizer takes much memory and address space: limits of the process mean nothing then.
#if defined(__SANITIZE_ADDRESS__)  // by GCC
inline constexpr bool kUnderAddressSanitizer = true;
#elif defined(__clang__)
inline constexpr bool kUnderAddressSanitizer = __has_feature(address_sanitizer);
#else
inline constexpr bool kUnderAddressSanitizer = false;
#endif

}  // namespace hapticd::test
