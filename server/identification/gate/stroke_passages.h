#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

namespace hapticd::identification {

/// Instant of a stroke, in the plane of its line and up.
struct StrokePoint {
  double time_s = 0.0;
  double along_mm = 0.0;
  double height_mm = 0.0;
  double reaction_along_n = 0.0;  ///< of the object on the tool
  double reaction_up_n = 0.0;
};

/// Mean of `count` instants that followed each other.
struct StrokeRow {
  StrokePoint mean;
  double count = 0.0;
};

/// Rows of a length that does not grow: once full, neighbours are merged, and so are those that come after.
class StrokeRows {
 public:
  static constexpr std::size_t kMax = 384;

  void add(const StrokeRow& row);
  void add(const StrokeRows& rows);
  void clear();
  const std::vector<StrokeRow>& rows() const { return rows_; }

 private:
  std::vector<StrokeRow> rows_;
  double stride_ = 1.0;
};

/// Passage from one turn of the motion to the next.
struct StrokePassage {
  enum class Start : std::uint8_t {
    kUnknown,    ///< unknown how far friction had built up
    kFollows,    ///< on the passage before it in the list
    kSaturated,  ///< on a long one that is not kept any more
  };
  Start start = Start::kUnknown;
  int heading = 0;        ///< +1, -1; 0: it never moved
  double begin_mm = 0.0;  ///< where the motion turned
  double path_mm = 0.0;   ///< along the line, to the next turn or so far
  StrokeRows rows;
};

/// Sorts the instants of strokes back and forth into passages. Memory is bounded: of more than kMax passages,
/// the oldest of the most frequent sort (by force, speed and length) is dropped. A few comparisons per
/// instant.
///
/// Passages of a stroke. A turn counts once the tip has come back by more than the noise of its position: 1.5
/// times the resolution if that is known, else eight times the deviation that the second differences show. If
/// it is unknown a median of three takes single outliers off the position, a sample late.
class StrokePassages {
 public:
  static constexpr std::size_t kMax = 160;
  /// Way beyond which sliding friction has built up, whatever it was before (D§4.4.1).
  static constexpr double kSlidingPathMm = 3.0;

  /// Makes passages. `resolution_mm`: of the position; 0 = unknown.
  explicit StrokePassages(double resolution_mm);

  void add(const StrokePoint& point);
  /// Interrupts: the tip lifted off, or what happened meanwhile is unknown.
  void interrupt();

  /// Number of complete passages so far, also those given up.
  std::uint64_t completed() const { return completed_; }
  std::uint64_t given_up() const { return given_up_; }
  double noise_width_mm() const;
  /// Passages that are kept, the one under way included.
  std::vector<StrokePassage> all() const;

 private:
  void learn_noise(double along_mm);
  void take(const StrokePoint& point);
  void close();
  void make_room();

  double resolution_mm_;
  std::deque<StrokePassage> passages_;
  StrokePassage current_;
  StrokeRows pending_;  ///< since the tip was farthest
  bool started_ = false;
  double farthest_mm_ = 0.0;
  std::uint64_t completed_ = 0;
  std::uint64_t given_up_ = 0;
  StrokePoint raw_[2];  ///< the last two as they came, the newer one first
  int raw_count_ = 0;
  double last_mm_[2] = {0.0, 0.0};
  int remembered_ = 0;
  double roughness_mm_ = 0.0;  ///< mean of |second difference| while moving
  double roughness_count_ = 0.0;
};

}  // namespace hapticd::identification
