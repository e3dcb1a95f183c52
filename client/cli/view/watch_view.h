#pragma once

#include <deque>
#include <string>
#include <vector>

#include "client/cli/terminal/terminal.h"
#include "client/cpp/stream_account.h"
#include "hapticd/v1/telemetry.pb.h"

namespace hapticd::cli {

/// What a person watching the loop sees: the last seconds of telemetry as force over displacement and over
/// time. Quantities whose group is absent are not shown.
class WatchView {
 public:
  explicit WatchView(double window_s) : window_s_(window_s) {}

  void add(const v1::TelemetrySample& sample);
  bool empty() const { return samples_.empty(); }

  /// A frame for the terminal as it is now.
  std::vector<std::string> frame(const client::StreamAccount& account, const Terminal& terminal) const;
  /// The newest sample as one plain line.
  std::string line() const;

 private:
  std::string when() const;                 ///< time, and the most important fact
  std::vector<std::string> values() const;  ///< all quantities with their units

  double window_s_;
  std::deque<v1::TelemetrySample> samples_;
};

}  // namespace hapticd::cli
