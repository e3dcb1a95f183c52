#pragma once

#include <optional>
#include <stdexcept>
#include <utility>

#include "hal/error.h"

namespace hapticd::test {

/// Value that was asked for. If it was refused, throws std::runtime_error with the full complaint.
template <class T>
T value_of(hal::Result<T> result) {
  if (!result) throw std::runtime_error(result.error().text());
  return std::move(*result);
}
/// Demands success of a call that gives nothing back.
inline void demand(const std::optional<hal::Error>& error) {
  if (error) throw std::runtime_error(error->text());
}

}  // namespace hapticd::test
