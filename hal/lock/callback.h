#pragma once

#include <functional>
#include <type_traits>
#include <utility>

#include "hal/lock/held_locks.h"

namespace hapticd {

/// A function that a class was given by another part of the program and calls later. It may take any time and
/// any lock, so it is never called under a Mutex; builds that look for errors end where it is. Members of
/// this kind are Callbacks and not std::functions (deploy/check_locks.py).
template <class Signature>
class Callback;

template <class Result, class... Arguments>
class Callback<Result(Arguments...)> {
 public:
  Callback() = default;
  template <class Function>
  requires(!std::is_same_v<std::remove_cvref_t<Function>, Callback>) Callback(Function function)
      : function_(std::move(function)) {}  // as std::function: not explicit

  explicit operator bool() const noexcept { return static_cast<bool>(function_); }
  Result operator()(Arguments... arguments) const {
    require_no_lock("a call-back");
    return function_(std::forward<Arguments>(arguments)...);
  }

 private:
  std::function<Result(Arguments...)> function_;
};

}  // namespace hapticd
