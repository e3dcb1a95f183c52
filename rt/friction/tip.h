#pragma once

#include <cstdint>

namespace hapticd::rt {

/// What is mounted at the end of the tool.
enum class Tip : std::uint8_t {
  kRod,          ///< aluminium, 3 mm, round: friction is felt and must be known (D§4.4.1)
  kBallBearing,  ///< rolls; little friction, much the same on every object
};

}  // namespace hapticd::rt
