#pragma once

#include <string>
#include <vector>

namespace hapticd::report {

/// A table that reads well both as text in a terminal and as Markdown: columns are padded, numbers are
/// aligned to the right.
class MarkdownTable {
 public:
  explicit MarkdownTable(std::vector<std::string> headers);

  /// One cell a column; throws std::invalid_argument otherwise.
  void add_row(std::vector<std::string> cells);
  /// The table, each line ended.
  std::string text() const;

  /// Headers as they are printed: a vertical bar is escaped, a line break a space.
  const std::vector<std::string>& headers() const noexcept { return headers_; }
  const std::vector<std::vector<std::string>>& rows() const noexcept { return rows_; }

 private:
  std::vector<std::string> headers_;
  std::vector<std::vector<std::string>> rows_;
};

/// "–" for a number that there is not, or that is not finite.
inline constexpr const char* kNoNumber = "–";
/// The number with so many decimals: fixed(0.1234, 2) = "0.12".
std::string fixed(double value, int decimals);
/// The number with so many significant digits, without an exponent where it can be avoided.
std::string significant(double value, int digits = 3);

}  // namespace hapticd::report
