#include "server/recording/flight/ring_folder.h"

#include <fmt/format.h>

#include <filesystem>
#include <optional>

#include "server/process/log.h"

namespace hapticd::server {

namespace {

namespace fs = std::filesystem;

std::string ring_path(const std::string& folder, int number) {
  return fmt::format("{}/flight-{}.ring", folder, number);
}

}  // namespace

hal::Result<std::unique_ptr<FlightRing>> take_ring(const std::string& folder,
                                                   const std::vector<recording::Column>& columns,
                                                   std::uint64_t capacity_rows, double rate_hz,
                                                   std::vector<std::string>& left) {
  std::error_code ignored;
  fs::create_directories(folder, ignored);
  std::optional<int> free;
  for (int number = 0; number < kMaxRings; ++number) {
    const std::string path = ring_path(folder, number);
    const std::string aside = path + ".left";
    if (fs::exists(aside, ignored)) left.push_back(aside);
    if (fs::exists(path, ignored)) {
      // The ring of a daemon that still runs, or of one that ended in no orderly way.
      const auto found = FlightRing::open_left(path);
      if (found && fs::exists(aside, ignored)) {
        // The ring of an earlier run is not kept yet. Both rings stay where they are.
        left.push_back(path);
        continue;
      }
      if (found) {
        fs::rename(path, aside, ignored);
        left.push_back(aside);
      } else if (found.error().code == hal::ErrorCode::kDamaged) {
        // Its lock is free, and there is nothing in it to keep.
        log_warning("flight recorder: " + found.error().text() + "; it is removed");
        fs::remove(path, ignored);
      } else {
        // In use; or of another user, who may run another daemon.
        if (found.error().code != hal::ErrorCode::kInUse)
          log_warning("flight recorder: " + found.error().text() + "; it is left alone");
        continue;
      }
    }
    if (!free) free = number;
  }
  if (free) return FlightRing::create(ring_path(folder, *free), columns, capacity_rows, rate_hz);
  return hal::Error::of(hal::ErrorCode::kInUse, "all rings of flight recorders are in use",
                        ring_path(folder, 0), "", fmt::format("{} daemons with one folder", kMaxRings),
                        "give each rig a folder of its own: [recording] folder");
}

}  // namespace hapticd::server
