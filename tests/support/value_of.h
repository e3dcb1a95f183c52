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
template <class Outcome>
requires requires(const Outcome& outcome) {
  outcome.refusal();
}
auto value_of(Outcome outcome) {
  if (!outcome) throw std::runtime_error(outcome.refusal().error.text());
  return std::move(*outcome);
}
/// Demands success of a call that gives nothing back.
inline void demand(const std::optional<hal::Error>& error) {
  if (error) throw std::runtime_error(error->text());
}

}  // namespace hapticd::test
