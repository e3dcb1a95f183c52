#include "hal/axis_map.h"

namespace hapticd::hal {

namespace {

constexpr std::string_view kLetters = "xyz";

Error refusal(std::string what, std::string_view text, std::string_view where, std::string remedy) {
  return {.what = std::move(what),
          .where = std::string(where),
          .value = "'" + std::string(text.substr(0, 40)) + "'",
          .limit = "three signed axes such as \"+x +y +z\", each of x, y, z once, right-handed",
          .remedy = std::move(remedy),
          .code = ErrorCode::kMalformed};
}

}  // namespace

Result<AxisMap> AxisMap::parse(std::string_view text, std::string_view where) {
  AxisMap map;
  std::size_t found = 0;
  std::array<bool, 3> used{};
  for (std::size_t i = 0; i < text.size();) {
    if (text[i] == ' ') {
      ++i;
      continue;
    }
    const bool has_sign = text[i] == '+' || text[i] == '-';
    const double sign = text[i] == '-' ? -1.0 : 1.0;
    if (has_sign) ++i;
    const std::size_t letter = i < text.size() ? kLetters.find(text[i]) : std::string_view::npos;
    if (letter == std::string_view::npos || found == 3) {
      return refusal("the axes cannot be read", text, where, "write them as in \"+x +y +z\"");
    }
    if (used[letter]) return refusal("an axis appears twice", text, where, "name each axis once");
    used[letter] = true;
    map.axis_[found] = letter;
    map.sign_[found] = sign;
    ++found;
    ++i;
  }
  if (found != 3) return refusal("there are not three axes", text, where, "name all three axes");
  // An even permutation of three is a cyclic one.
  const bool cyclic = (map.axis_[0] + 1) % 3 == map.axis_[1];
  if ((cyclic ? 1.0 : -1.0) * map.sign_[0] * map.sign_[1] * map.sign_[2] < 0.0) {
    return refusal("the axes are left-handed: no mounting turns a sensor into its mirror image", text, where,
                   "reverse one sign");
  }
  return map;
}

std::string AxisMap::text() const {
  std::string text;
  for (std::size_t i = 0; i < 3; ++i) {
    if (i > 0) text += ' ';
    text += sign_[i] < 0.0 ? '-' : '+';
    text += kLetters[axis_[i]];
  }
  return text;
}

}  // namespace hapticd::hal
