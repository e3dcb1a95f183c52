#pragma once

namespace hapticd::phantom {

/// Something that must be cut before the process is gone, also when it ends by std::exit() and no destructor
/// runs.
class CutAtExit {
 public:
  virtual void cut_at_exit() noexcept = 0;

 protected:
  ~CutAtExit() = default;
};

/// Registered ones are cut by std::exit(); a few at a time. False when there is no room.
bool register_cut(CutAtExit& what) noexcept;
void forget_cut(CutAtExit& what) noexcept;

}  // namespace hapticd::phantom
