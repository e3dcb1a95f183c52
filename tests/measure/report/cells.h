#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace hapticd::report {

/// Share `index` (1 … count) of the cells of every sweep: those whose number leaves index - 1 when divided by
/// count, so that cheap and dear neighbours are spread evenly.
struct Shard {
  std::size_t index = 1;
  std::size_t count = 1;

  bool is_whole() const noexcept { return count == 1; }
  bool has(std::size_t cell) const noexcept { return cell % count == index - 1; }
  std::string text() const { return std::to_string(index) + "/" + std::to_string(count); }
  /// "2/8". Throws std::invalid_argument, saying what is expected.
  static Shard from(const std::string& text);
};

/// What one cell of a sweep gives; how many numbers and what they mean is the sweep's own. What is not finite
/// comes back as NaN.
using CellValues = std::vector<double>;

/// Computes the cells of sweeps, all of them or one shard's, or collects what shards computed elsewhere.
/// Cells know nothing of each other and follow from their number alone, so that neither the computer nor the
/// order changes a byte of what is made of them. They are kept in FOLDER/cells/SWEEP.jsonl.
class Cells {
 public:
  /// All of them, or one shard's. `revision` names program and options (the commit, quick or not): shards of
  /// different revisions do not mix.
  Cells(std::filesystem::path folder, std::string revision, Shard shard = {});
  /// Collects the cells that shards computed into `from`. FOLDER gets all of them.
  Cells(std::filesystem::path folder, std::string revision, std::vector<std::filesystem::path> from);

  /// The values of all cells, in order; none if this run has but a shard of them (they are kept for the
  /// merging). `compute` is called from as many threads as the machine has processors, with the number of the
  /// cell; it must depend on nothing else. Throws what `compute` throws; std::runtime_error if shards are
  /// missing, disagree, or are of another revision.
  std::optional<std::vector<CellValues>> values(const std::string& sweep, std::size_t count,
                                                const std::function<CellValues(std::size_t)>& compute) const;

  /// What the names of sweeps end in from now on: the same sweep under other conditions.
  void set_suffix(std::string suffix) { suffix_ = std::move(suffix); }

  bool merges() const noexcept { return !from_.empty(); }
  const Shard& shard() const noexcept { return shard_; }

 private:
  std::vector<CellValues> collected(const std::string& sweep, std::size_t count) const;
  std::filesystem::path path_in(const std::filesystem::path& folder, const std::string& sweep) const;
  void write(const std::string& sweep, std::size_t count, const std::vector<std::size_t>& numbers,
             const std::vector<CellValues>& values) const;

  std::filesystem::path folder_;
  std::string revision_;
  Shard shard_;
  std::vector<std::filesystem::path> from_;
  std::string suffix_;
};

}  // namespace hapticd::report
