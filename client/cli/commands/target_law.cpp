#include "client/cli/commands/target_law.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <vector>

#include "client/cli/session/session.h"

namespace hapticd::cli {
namespace {

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  std::size_t begin = 0;
  while (begin <= text.size()) {
    const std::size_t end = std::min(text.find(separator, begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

/// Reads exactly `count` numbers; nothing if there are more or fewer, or a part is not a number.
std::optional<std::vector<double>> numbers(const std::string& text, char separator, std::size_t count) {
  std::vector<double> values;
  for (const std::string& part : split(text, separator)) {
    double value = 0.0;
    const char* end = part.data() + part.size();
    const auto [stop, failure] = std::from_chars(part.data(), end, value);
    if (failure != std::errc{} || stop != end) return std::nullopt;
    values.push_back(value);
  }
  if (values.size() != count) return std::nullopt;
  return values;
}

}  // namespace

v1::HuntCrossleyLaw parse_hunt_crossley(const std::string& text) {
  const auto values = numbers(text, ',', 3);
  if (!values)
    throw LocalError("not a Hunt-Crossley law", "--hunt-crossley", text, "K,B,M", "e.g. 0.05,0.001,1.6");
  v1::HuntCrossleyLaw law;
  law.set_stiffness_n_per_mm_m((*values)[0]);
  law.set_damping_n_s_per_mm_m1((*values)[1]);
  law.set_exponent((*values)[2]);
  return law;
}

v1::StiffnessProfile parse_profile(const std::string& text, const std::string& option) {
  v1::StiffnessProfile profile;
  for (const std::string& part : split(text, ',')) {
    const auto values = numbers(part, ':', 2);
    if (!values)
      throw LocalError("not a stiffness profile", option, text, "MM:N_PER_MM,…", "e.g. 0:0.2,5:0.8");
    auto* knot = profile.add_knots();
    knot->set_at_mm((*values)[0]);
    knot->set_stiffness_n_per_mm((*values)[1]);
  }
  return profile;
}

v1::Vector3 parse_axis(const std::string& text) {
  v1::Vector3 axis;
  if (text == "x") {
    axis.set_x(1.0);
  } else if (text == "y") {
    axis.set_y(1.0);
  } else if (text == "z") {
    axis.set_z(1.0);
  } else {
    const auto values = numbers(text, ',', 3);
    if (!values) throw LocalError("not an axis", "--axis", text, "x, y, z or X,Y,Z", "e.g. 1,1,0");
    axis.set_x((*values)[0]);
    axis.set_y((*values)[1]);
    axis.set_z((*values)[2]);
  }
  return axis;
}

}  // namespace hapticd::cli
