#include "tests/measure/report/cells.h"

#include <algorithm>
#include <atomic>
#include <charconv>
#include <cmath>
#include <exception>
#include <fstream>
#include <limits>
#include <mutex>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <thread>

#include "tests/measure/report/progress.h"

namespace hapticd::report {
namespace {

using Json = nlohmann::ordered_json;

std::optional<std::size_t> whole_number(std::string_view text) {
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return number;
}

/// Calls `compute` for all numbers, from one thread a processor; the first exception ends it.
std::vector<CellValues> computed(const std::string& sweep, const std::vector<std::size_t>& numbers,
                                 const std::function<CellValues(std::size_t)>& compute) {
  std::vector<CellValues> values(numbers.size());
  std::atomic<std::size_t> next{0};
  std::exception_ptr failure;
  std::mutex failing;
  Progress progress(sweep, std::max<std::size_t>(1, numbers.size()));
  const auto work = [&] {
    for (std::size_t i = next++; i < numbers.size(); i = next++) {
      try {
        values[i] = compute(numbers[i]);
        // Rounds as a file would give it back, so that a reader of one makes the same of it.
        for (double& value : values[i]) {
          if (!std::isfinite(value)) value = std::numeric_limits<double>::quiet_NaN();
        }
      } catch (...) {
        const std::lock_guard lock(failing);
        if (!failure) failure = std::current_exception();
        next = numbers.size();
        return;
      }
      progress.step();
    }
  };
  {
    std::vector<std::jthread> threads;
    for (unsigned i = 1; i < std::max(1U, std::thread::hardware_concurrency()); ++i)
      threads.emplace_back(work);
    work();
  }
  if (failure) std::rethrow_exception(failure);
  return values;
}

}  // namespace

Shard Shard::from(const std::string& text) {
  const std::size_t slash = text.find('/');
  if (slash != std::string::npos) {
    const auto index = whole_number(std::string_view(text).substr(0, slash));
    const auto count = whole_number(std::string_view(text).substr(slash + 1));
    if (index && count && *index >= 1 && *index <= *count) return {*index, *count};
  }
  throw std::invalid_argument("a shard is i/n with 1 ≤ i ≤ n, for instance 2/8, not '" + text + "'");
}

Cells::Cells(std::filesystem::path folder, std::string revision, Shard shard)
    : folder_(std::move(folder)), revision_(std::move(revision)), shard_(shard) {}

Cells::Cells(std::filesystem::path folder, std::string revision, std::vector<std::filesystem::path> from)
    : folder_(std::move(folder)), revision_(std::move(revision)), from_(std::move(from)) {}

std::filesystem::path Cells::path_in(const std::filesystem::path& folder, const std::string& sweep) const {
  return folder / "cells" / (sweep + ".jsonl");
}

std::optional<std::vector<CellValues>> Cells::values(
    const std::string& its_name, std::size_t count,
    const std::function<CellValues(std::size_t)>& compute) const {
  const std::string sweep = its_name + suffix_;
  std::vector<std::size_t> numbers;
  for (std::size_t cell = 0; cell < count; ++cell) {
    if (shard_.has(cell)) numbers.push_back(cell);
  }
  std::vector<CellValues> values = merges() ? collected(sweep, count) : computed(sweep, numbers, compute);
  write(sweep, count, numbers, values);
  if (!shard_.is_whole()) return std::nullopt;
  return values;
}

std::vector<CellValues> Cells::collected(const std::string& sweep, std::size_t count) const {
  std::vector<CellValues> values(count);
  std::vector<bool> known(count, false);
  for (const auto& folder : from_) {
    const auto path = path_in(folder, sweep);
    const auto refuse = [&path](const std::string& why) {
      throw std::runtime_error("cannot merge '" + path.string() + "': " + why);
    };
    std::ifstream file(path);
    std::string line;
    if (!std::getline(file, line)) refuse("there is no such sweep; has that shard been run to its end?");
    const Json head = Json::parse(line, nullptr, false);
    if (!head.is_object() || head.value("sweep", "") != sweep) refuse("its first line is not of this sweep");
    if (head.value("revision", "") != revision_)
      refuse("it is of revision '" + head.value("revision", "") + "', this is '" + revision_ + "'");
    if (head.value("cells", std::size_t{0}) != count)
      refuse("it is of a sweep of " + std::to_string(head.value("cells", std::size_t{0})) + " cells, not " +
             std::to_string(count));
    while (std::getline(file, line)) {
      const Json cell = Json::parse(line, nullptr, false);
      if (!cell.is_object() || !cell.contains("cell") || !cell.contains("values"))
        refuse("a line is cut short");
      const auto number = cell["cell"].get<std::size_t>();
      if (number >= count) refuse("cell " + std::to_string(number) + " is beyond the last");
      CellValues of_cell;
      for (const Json& value : cell["values"])
        of_cell.push_back(value.is_null() ? std::numeric_limits<double>::quiet_NaN() : value.get<double>());
      values[number] = std::move(of_cell);
      known[number] = true;
    }
  }
  const auto missing = static_cast<std::size_t>(std::count(known.begin(), known.end(), false));
  if (missing > 0) {
    throw std::runtime_error("sweep '" + sweep + "': " + std::to_string(missing) + " of " +
                             std::to_string(count) +
                             " cells are in no shard; give the folders of all shards");
  }
  return values;
}

void Cells::write(const std::string& sweep, std::size_t count, const std::vector<std::size_t>& numbers,
                  const std::vector<CellValues>& values) const {
  const auto path = path_in(folder_, sweep);
  std::filesystem::create_directories(path.parent_path());
  // Complete or not at all: a shard that is still running is not taken for one that has ended.
  const auto unfinished = path.string() + ".part";
  {
    std::ofstream file(unfinished, std::ios::trunc);
    file << Json{{"sweep", sweep}, {"cells", count}, {"revision", revision_}}.dump() << '\n';
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      file << Json{{"cell", numbers[i]}, {"values", values[i]}}.dump() << '\n';
    }
    file.flush();
    if (!file) throw std::runtime_error("cannot write '" + unfinished + "'");
  }
  std::filesystem::rename(unfinished, path);
}

}  // namespace hapticd::report
