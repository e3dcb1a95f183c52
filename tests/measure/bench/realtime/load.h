#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace hapticd::bench {

/// Something that may disturb the loop, for as long as it lives.
class Load {
 public:
  virtual ~Load() = default;
};

/// Kind of a load: what the service does for its clients may not disturb the loop; a machine that is busy
/// with something else disturbs everybody.
enum class LoadKind { kNone, kService, kMachine };

struct LoadType {
  std::string name;  ///< "8 subscribers"
  LoadKind kind = LoadKind::kNone;
  /// Starts it against the daemon at `address` for about `seconds`. Throws if it cannot be had.
  std::unique_ptr<Load> (*start)(const std::string& address, double seconds,
                                 const std::filesystem::path& folder) = nullptr;
  bool in_quick = false;  ///< one of the few a quick run has
};

/// Loads: none; 1, 8 and 64 telemetry subscribers; targets set and states asked for; scenes and models
/// swapped; an identification; a recording; the machine under stress-ng, with and without subscribers. The
/// first is the idle one.
const std::vector<LoadType>& loads();

}  // namespace hapticd::bench
