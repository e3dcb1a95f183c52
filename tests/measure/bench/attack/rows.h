#pragma once

#include <algorithm>
#include <cstdint>
#include <string>

#include "client/cpp/recording_upload.h"

namespace hapticd::bench {

/// Rows as telemetry has them, some 330 bytes each, in pieces.
class Rows {
 public:
  explicit Rows(std::uint64_t bytes) : left_(bytes) {}
  std::string next_piece() {
    std::string piece = count_ == 0 ? "time_s,force_N,position_mm,note\n" : "";
    while (left_ > 0 && piece.size() + kRowBytes <= client::RecordingUpload::kMaxPiece) {
      std::string row = std::to_string(count_++) + "e-3,1.25,1.5,";
      row.resize(kRowBytes - 1, 'x');
      piece += row + '\n';
      left_ -= std::min<std::uint64_t>(left_, kRowBytes);
    }
    return piece;
  }

 private:
  static constexpr std::size_t kRowBytes = 330;
  std::uint64_t left_;
  std::uint64_t count_ = 0;
};

}  // namespace hapticd::bench
