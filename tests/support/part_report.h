#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "hal/part_report.h"

namespace hapticd::test {

/// The figure of that name, if it is reported.
inline std::optional<double> find_figure(const hal::PartReport& report, const std::string& name) {
  for (const hal::PartFigure& figure : report.figures) {
    if (figure.name == name) return figure.value;
  }
  return std::nullopt;
}
/// Figure that must be there.
inline double figure_of(const hal::PartReport& report, const std::string& name) {
  const std::optional<double> figure = find_figure(report, name);
  EXPECT_TRUE(figure) << "no figure " << name;
  return figure.value_or(-1.0);
}
/// Whether one of its findings has these words.
inline bool shows(const hal::PartReport& report, const std::string& words) {
  for (const std::string& finding : report.findings) {
    if (finding.find(words) != std::string::npos) return true;
  }
  return false;
}

}  // namespace hapticd::test
