#pragma once

#include <memory>

namespace hapticd::phantom {

/// An output that must be cut before the process ends, also when it ends by std::exit() and no destructor
/// runs.
class CutAtExit {
 public:
  virtual void cut_at_exit() noexcept = 0;

 protected:
  ~CutAtExit() = default;
};

/// std::exit() cuts all that are registered and still there. False when the few slots are full.
bool register_cut(const std::shared_ptr<CutAtExit>& what) noexcept;
void forget_cut(const std::shared_ptr<CutAtExit>& what) noexcept;

}  // namespace hapticd::phantom
