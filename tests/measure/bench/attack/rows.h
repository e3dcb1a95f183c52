#pragma once

#include <algorithm>
#include <cstdint>
#include <string>

#include "client/cpp/recording_upload.h"

namespace hapticd::bench {

/// A recording in pieces: time, force and position of a press.
class Rows {
 public:
  /// kLong: some 330 bytes each, as telemetry has them, of which most is not looked at. kShort: some 20
  /// bytes, which are the most work to read.
  enum class Length : std::uint8_t { kShort, kLong };
  explicit Rows(std::uint64_t bytes, Length length) : left_(bytes), is_long_(length == Length::kLong) {}

  std::string next_piece() {
    std::string piece =
        count_ == 0 ? (is_long_ ? "time_s,force_N,position_mm,note\n" : "time_s,force_N,position_mm\n") : "";
    while (left_ > 0 && piece.size() + kMaxRowBytes <= client::RecordingUpload::kMaxPiece) {
      std::string row = std::to_string(count_++) + "e-3,1.25,1.5";
      if (is_long_) {
        row += ',';
        row.resize(kMaxRowBytes - 1, 'x');
      }
      row += '\n';
      left_ -= std::min<std::uint64_t>(left_, row.size());
      piece += row;
    }
    return piece;
  }

 private:
  static constexpr std::size_t kMaxRowBytes = 330;
  std::uint64_t left_;
  bool is_long_;
  std::uint64_t count_ = 0;
};

}  // namespace hapticd::bench
