#pragma once

#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "client/cli/text/telemetry_columns.h"
#include "client/cpp/stream_account.h"
#include "hapticd/v1/rig.pb.h"
#include "hapticd/v1/telemetry.pb.h"

namespace hapticd::cli {

/// Lines of a recording's head that say where it is from (without the comment sign).
std::vector<std::string> origin_lines(const v1::RigInfo& rig, const v1::RigState& state,
                                      std::uint32_t decimation);

/// Writes telemetry to a CSV file: comment lines (#) with its origin, a line with the names of the columns,
/// one line for each sample, and a closing comment with what is missing.
class Recording {
 public:
  /// Replaces the file; makes its folder. Throws LocalError when that cannot be done.
  Recording(const std::string& path, const std::vector<std::string>& origin,
            const std::vector<v1::FieldGroup>& groups);

  void add(const v1::TelemetrySample& sample);
  /// Writes the closing comment; throws LocalError when the file did not take everything (a full disk).
  void finish(const client::StreamAccount& account);

  std::uint64_t samples() const noexcept { return samples_; }

 private:
  std::string path_;
  TelemetryColumns columns_;
  std::ofstream file_;
  std::uint64_t samples_ = 0;
};

/// "12000 samples, complete", or what is missing.
std::string account_text(const client::StreamAccount& account);

/// Groups to write when none were chosen: all that the rig has.
std::vector<v1::FieldGroup> groups_of(const v1::RigInfo& rig);

}  // namespace hapticd::cli
