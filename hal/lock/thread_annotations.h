#pragma once

/// What a lock guards and which locks a function takes, checked by clang's -Wthread-safety. The names and
/// their meaning are those of https://clang.llvm.org/docs/ThreadSafetyAnalysis.html; other compilers see
/// nothing of them.
#if defined(__clang__)
#define HAPTICD_THREAD_ANNOTATION(attribute) __attribute__((attribute))
#else
#define HAPTICD_THREAD_ANNOTATION(attribute)
#endif

// Abseil, which gRPC includes, has some of them, with the same meaning.
#undef GUARDED_BY
#undef PT_GUARDED_BY
#undef ACQUIRED_BEFORE
#undef ACQUIRED_AFTER
#undef NO_THREAD_SAFETY_ANALYSIS

// Annotations of classes.
#define CAPABILITY(name) HAPTICD_THREAD_ANNOTATION(capability(name))
#define SCOPED_CAPABILITY HAPTICD_THREAD_ANNOTATION(scoped_lockable)

// Annotations of members.
#define GUARDED_BY(lock) HAPTICD_THREAD_ANNOTATION(guarded_by(lock))
#define PT_GUARDED_BY(lock) HAPTICD_THREAD_ANNOTATION(pt_guarded_by(lock))
#define ACQUIRED_BEFORE(...) HAPTICD_THREAD_ANNOTATION(acquired_before(__VA_ARGS__))
#define ACQUIRED_AFTER(...) HAPTICD_THREAD_ANNOTATION(acquired_after(__VA_ARGS__))

// Annotations of functions.
#define REQUIRES(...) HAPTICD_THREAD_ANNOTATION(requires_capability(__VA_ARGS__))
#define REQUIRES_SHARED(...) HAPTICD_THREAD_ANNOTATION(requires_shared_capability(__VA_ARGS__))
#define EXCLUDES(...) HAPTICD_THREAD_ANNOTATION(locks_excluded(__VA_ARGS__))
#define ACQUIRE(...) HAPTICD_THREAD_ANNOTATION(acquire_capability(__VA_ARGS__))
#define ACQUIRE_SHARED(...) HAPTICD_THREAD_ANNOTATION(acquire_shared_capability(__VA_ARGS__))
#define RELEASE(...) HAPTICD_THREAD_ANNOTATION(release_capability(__VA_ARGS__))
#define RELEASE_SHARED(...) HAPTICD_THREAD_ANNOTATION(release_shared_capability(__VA_ARGS__))
#define TRY_ACQUIRE(...) HAPTICD_THREAD_ANNOTATION(try_acquire_capability(__VA_ARGS__))
#define TRY_ACQUIRE_SHARED(...) HAPTICD_THREAD_ANNOTATION(try_acquire_shared_capability(__VA_ARGS__))
#define NO_THREAD_SAFETY_ANALYSIS HAPTICD_THREAD_ANNOTATION(no_thread_safety_analysis)
