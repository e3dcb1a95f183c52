#pragma once

#include <concepts>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace hapticd::report {

/// A condition of a case: a name ("sponge_block") or a number (400 mm/s).
class CaseValue {
 public:
  CaseValue(std::string text) : content_(std::move(text)) {}         // NOLINT(google-explicit-constructor)
  CaseValue(std::string_view text) : content_(std::string(text)) {}  // NOLINT(google-explicit-constructor)
  CaseValue(const char* text) : content_(std::string(text)) {}       // NOLINT(google-explicit-constructor)
  template <class Number>
  requires(std::integral<Number> || std::floating_point<Number>) CaseValue(Number number)
      : content_(static_cast<double>(number)) {}  // NOLINT(google-explicit-constructor)

  const std::variant<std::string, double>& content() const noexcept { return content_; }

 private:
  std::variant<std::string, double> content_;
};

/// Every condition that was varied, in the order it is to be read.
using Case = std::vector<std::pair<std::string, CaseValue>>;

/// One measured number and all that is needed to judge it.
struct Figure {
  std::string figure;  ///< e.g. "rendered_stiffness_error"
  Case conditions{};
  std::optional<double> value{};  ///< none when `failed` says why
  std::string unit = "1";         ///< "1" for relative errors, which are fractions, and for counts
  std::optional<double> goal{};
  std::optional<double> reference{};    ///< the dissertation's or a peer's
  std::string source{};                 ///< where goal and reference come from, e.g. "D§4.5.3"
  std::optional<double> run_time_ns{};  ///< what the value costs, where error is weighed against run time
  std::string failed{};                 ///< why there is no value, e.g. "1 N is not reached"
};

/// The record as one line of JSON, without the line end. Keys have a fixed order; numbers read back as the
/// very same double. A value that is missing or not finite becomes null with a reason, whether or not one was
/// given.
std::string to_json_line(const Figure& figure);

/// Writes DIR/figures.jsonl, a line at a time, so that a run that dies leaves what it had. Several programs
/// may write to one folder: the records of a figure replace those an earlier run left of the *same* figure
/// under the same common conditions, and leave the others alone.
class FigureWriter {
 public:
  /// Makes the folder. Throws std::runtime_error if it cannot be written to.
  explicit FigureWriter(const std::filesystem::path& folder);

  /// Ends the case of every figure from now on; empty = nothing. An earlier run's records are replaced by
  /// those of the same figure and the same common conditions only.
  void set_common(Case conditions);
  /// Throws std::logic_error when this figure was already written for the same case: one of the two is wrong.
  void add(const Figure& figure);
  /// Adds all records of another file of this kind, unchanged.
  void add_from(const std::filesystem::path& file);
  const std::filesystem::path& path() const noexcept { return path_; }

 private:
  void add_line(const std::string& figure, const std::string& conditions, const std::string& line);
  void forget_earlier(const std::string& figure);
  bool has_common(const std::string& line) const;
  void rewrite_earlier();

  std::filesystem::path path_;
  std::vector<std::pair<std::string, std::string>> earlier_;  ///< figure and line, of runs before this one
  std::vector<std::string> ours_;
  Case common_;
  std::set<std::string>
      figures_;  ///< written by this one, with the common conditions they were written under
  std::set<std::string> cases_;
  std::ofstream stream_;
};

}  // namespace hapticd::report
