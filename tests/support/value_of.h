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
/// Returns the value of a find; throws std::runtime_error if there is none.
template <class T>
T value_of(std::optional<T> found) {
  if (!found) throw std::runtime_error("nothing was found");
  return std::move(*found);
}
/// Complaint of what has to be refused. If it was not, throws std::runtime_error.
template <class T>
hal::Error error_of(const hal::Result<T>& result) {
  if (result) throw std::runtime_error("it was not refused");
  return result.error();
}
template <class Complaint>
Complaint error_of(const std::optional<Complaint>& complaint) {
  if (!complaint) throw std::runtime_error("it was not refused");
  return *complaint;
}
template <class Outcome>
auto refusal_of(const Outcome& outcome) {
  if (outcome) throw std::runtime_error("it was not refused");
  return outcome.refusal();
}
/// Returns the exception of a call; throws std::runtime_error if it throws none.
template <class Exception, class Call>
Exception thrown_by(const Call& call) {
  try {
    call();
  } catch (const Exception& exception) {
    return exception;
  }
  throw std::runtime_error("it was accepted");
}
/// Demands success of a call that gives nothing back.
inline void demand(const std::optional<hal::Error>& error) {
  if (error) throw std::runtime_error(error->text());
}

}  // namespace hapticd::test
