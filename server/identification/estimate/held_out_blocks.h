#pragma once

#include <cstddef>

namespace hapticd::identification {

/// Samples kept from a fit, to judge it by: every kFolds-th of kBlocks blocks of neighbouring samples. Whole
/// blocks, for neighbouring samples have the same error and would say nothing about each other.
struct HeldOutBlocks {
  static constexpr std::size_t kBlocks = 20;
  static constexpr std::size_t kFolds = 5;
  std::size_t fold = kFolds;  ///< 0 … kFolds - 1; kFolds: nothing is kept

  constexpr bool contains(std::size_t index, std::size_t count) const noexcept {
    return fold < kFolds && index * kBlocks / count % kFolds == fold;
  }
};

}  // namespace hapticd::identification
