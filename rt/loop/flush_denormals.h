#pragma once

#include <cstdint>

#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

namespace hapticd::rt {

/// Makes the calling thread, while it lives, compute with zero if a result or an operand would be a denormal
/// number (below 2.2e-308). A filter whose input went to zero decays to such numbers and stays there; each
/// operation on one takes a hundred cycles on many processors. Puts back what was before: a vendor's thread
/// is not ours. Does nothing on processors other than x86-64 and ARM 64.
class FlushDenormals {
 public:
  FlushDenormals() noexcept : before_(read()) {
    if ((before_ & kFlush) != kFlush) write(before_ | kFlush);
  }
  ~FlushDenormals() {
    if ((before_ & kFlush) != kFlush) write(before_);
  }
  FlushDenormals(const FlushDenormals&) = delete;
  FlushDenormals& operator=(const FlushDenormals&) = delete;

  /// True if it has an effect.
  static constexpr bool works() noexcept { return kFlush != 0; }

 private:
  using Register = std::uint64_t;
#if defined(__SSE2__)
  static constexpr Register kFlush = 0x8040;  // MXCSR: FTZ and DAZ
  static Register read() noexcept {
    return _mm_getcsr();
  }
  static void write(Register value) noexcept {
    _mm_setcsr(static_cast<unsigned int>(value));
  }
#elif defined(__aarch64__)
  static constexpr Register kFlush = Register{1} << 24U;  // FPCR: FZ
  static Register read() noexcept {
    Register value = 0;
    asm volatile("mrs %0, fpcr" : "=r"(value));
    return value;
  }
  static void write(Register value) noexcept {
    asm volatile("msr fpcr, %0" : : "r"(value));
  }
#else
  static constexpr Register kFlush = 0;
  static Register read() noexcept {
    return 0;
  }
  static void write(Register) noexcept {}
#endif

  Register before_;
};

}  // namespace hapticd::rt
