#pragma once

#include <cstddef>
#include <vector>

namespace hapticd::identification {

/// One tick of a palpation: the tip presses and lets go without sliding.
struct PalpationSample {
  double displacement_mm = 0.0;  ///< of the tip below where it touched first; ≤ 0 before
  double rate_mm_per_s = 0.0;
  double normal_force_n = 0.0;
  bool in_contact = false;
  double time_s = 0.0;
};

/// Series of bounded length, however much is added: when it is full, every second item is dropped and only
/// every second one taken from then on. What remains is spread evenly over all that was added.
template <class Item>
class ThinnedSeries {
 public:
  explicit ThinnedSeries(std::size_t capacity, std::size_t stride = 1)
      : capacity_(capacity), stride_(stride) {
    items_.reserve(capacity);
  }
  void add(const Item& item) {
    if (added_++ % stride_ != 0) return;
    if (items_.size() == capacity_) {
      for (std::size_t i = 0; 2 * i < items_.size(); ++i) items_[i] = items_[2 * i];
      items_.resize((items_.size() + 1) / 2);
      stride_ *= 2;
      if ((added_ - 1) % stride_ != 0) return;
    }
    items_.push_back(item);
  }
  /// True if the next add() will be kept: an item that is costly to make need not be made otherwise.
  bool wants_next() const noexcept { return added_ % stride_ == 0; }
  void skip() noexcept { ++added_; }
  const std::vector<Item>& items() const noexcept { return items_; }
  std::size_t stride() const noexcept { return stride_; }
  std::size_t added() const noexcept { return added_; }

 private:
  std::size_t capacity_;
  std::size_t stride_;
  std::size_t added_ = 0;
  std::vector<Item> items_;
};

}  // namespace hapticd::identification
