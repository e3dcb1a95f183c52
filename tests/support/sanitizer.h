#pragma once

namespace hapticd::test {

/// A sanitizer takes several times the memory and address space: limits of the process mean nothing then.
#ifdef HAPTICD_SANITIZED
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

/// ThreadSanitizer keeps several words for each that a process touches: how its memory grows means nothing
/// then.
#ifndef __has_feature
#define __has_feature(name) 0
#endif
#if defined(__SANITIZE_THREAD__) || __has_feature(thread_sanitizer)
inline constexpr bool kThreadSanitized = true;
#else
inline constexpr bool kThreadSanitized = false;
#endif

}  // namespace hapticd::test
