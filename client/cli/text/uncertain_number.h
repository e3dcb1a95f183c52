#pragma once

#include <string>
#include <string_view>

namespace hapticd::cli {

/// A number and its standard error as people write them: the error with two significant digits, the number
/// with as many decimals.
struct UncertainText {
  std::string value;
  std::string error;  ///< empty if the number is exact or not there
};

/// 0.07912, 0.00118 → {"0.0791", "0.0012"}. Very large and very small ones share a power of ten: {"7.91e-07",
/// "0.12e-07"}. An infinite error (the data do not determine it) is "inf" or "∞", NaN or a
/// negative error "?"; a number that is NaN is "-".
UncertainText uncertain_parts(double value, double standard_error, bool unicode);

/// Number and error of an identified parameter. What the search for gains did not reach is a bound, not an
/// estimate without an end: "≥ 2", or "-" for the period of an oscillation that did not come.
UncertainText parameter_parts(std::string_view name, double value, double standard_error, bool unicode);
/// Number and error in one text: "0.0791 ± 0.0012", "+-" without Unicode.
std::string parameter_text(std::string_view name, double value, double standard_error, bool unicode);

}  // namespace hapticd::cli
