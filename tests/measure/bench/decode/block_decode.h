#pragma once

#include <filesystem>
#include <string>

namespace hapticd::bench {

/// What a client pays to get all numbers of a tick, in µs a sample: the same stream by fields and as blocks.
struct DecodeCost {
  double samples_us = 0.0;
  double blocks_us = 0.0;
};

/// Batches of one daemon in both encodings, all groups, kept in `folder` as they came.
class RecordedBatches {
 public:
  /// Runs a daemon for some seconds. `batch_size` as in SubscribeRequest. Throws std::runtime_error if
  /// nothing came.
  RecordedBatches(std::filesystem::path folder, double seconds, unsigned batch_size);

  DecodeCost decoded_in_cpp() const;
  /// Cost by numpy and protobuf for Python. Throws std::runtime_error if they are not installed.
  DecodeCost decoded_in_python() const;

 private:
  std::filesystem::path folder_;
};

}  // namespace hapticd::bench
