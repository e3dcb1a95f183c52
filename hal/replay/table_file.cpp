#include "hal/replay/table_file.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <string_view>
#include <system_error>
#include <utility>

#include "hal/recording/recording_file.h"
#include "hal/shown_text.h"

namespace hapticd::replay {
namespace {

class CsvTable final : public TableFile {
 public:
  explicit CsvTable(CsvFile file) : file_(std::move(file)) {}
  const std::vector<std::string>& columns() const noexcept override { return file_.columns(); }
  std::string place(std::size_t line) const override { return file_.place(line); }
  std::optional<hal::Error> read_rows(std::span<const std::size_t> columns,
                                      const RowVisitor& visit) override {
    return file_.read_rows(columns, visit);
  }

 private:
  CsvFile file_;
};

class McapTable final : public TableFile {
 public:
  McapTable(std::string path, recording::RecordingFile file)
      : path_(std::move(path)), file_(std::move(file)) {
    for (const recording::Column& column : file_.columns()) names_.push_back(column.name);
  }
  const std::vector<std::string>& columns() const noexcept override { return names_; }
  std::string place(std::size_t row) const override {
    return "recording '" + path_ + "'" + (row > 0 ? ", row " + std::to_string(row) : "");
  }
  std::optional<hal::Error> read_rows(std::span<const std::size_t> columns, const RowVisitor& visit) override;

 private:
  std::string path_;
  recording::RecordingFile file_;
  std::vector<std::string> names_;
};

std::optional<hal::Error> McapTable::read_rows(std::span<const std::size_t> columns,
                                               const RowVisitor& visit) {
  std::optional<hal::Error> error;
  std::vector<double> numbers(columns.size());
  std::size_t row_number = 0;
  std::int64_t last_time_ns = std::numeric_limits<std::int64_t>::min();
  recording::RecordingVisitor visitor;
  visitor.row = [&](const recording::Row& row) {
    if (++row_number > CsvFile::kMaxRows) {
      error = hal::Error::of(hal::ErrorCode::kTooLong, "the recording is too long", place(row_number), "",
                             "up to " + std::to_string(CsvFile::kMaxRows) + " rows", "split it");
      return false;
    }
    // A loop that was held up may make two ticks at one time of the rig: the second says nothing new.
    const std::int64_t time_ns = row.integer(recording::kTimeColumn);
    if (time_ns <= last_time_ns) return true;
    last_time_ns = time_ns;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      numbers[i] = row.number(columns[i]);
      if (std::isfinite(numbers[i])) continue;
      error = hal::Error::of(
          hal::ErrorCode::kNotFinite, "the cell is not a finite number",
          place(row_number) + ", column '" + names_[columns[i]] + "'", std::to_string(numbers[i]),
          "a group that is there in every tick",
          "the scene that was loaded does not fill it: record another one, or choose another column");
      return false;
    }
    error = visit(row_number, numbers);
    return !error.has_value();
  };
  const auto end = file_.read(visitor);
  if (error) return error;
  if (!end) return end.error();
  return std::nullopt;
}

}  // namespace

hal::Result<std::unique_ptr<TableFile>> TableFile::open(const std::string& path, const CsvFormat& format) {
  if (recording::McapReader::is_mcap(path)) {
    auto file = recording::RecordingFile::open(path);
    if (!file) return file.error();
    return std::unique_ptr<TableFile>(std::make_unique<McapTable>(path, std::move(*file)));
  }
  if (is_hdf5(path)) return hdf5_is_not_read("recording '" + path + "'");
  auto file = CsvFile::open(path, format);
  if (!file) return file.error();
  return std::unique_ptr<TableFile>(std::make_unique<CsvTable>(std::move(*file)));
}

bool is_hdf5(const std::string& path) {
  constexpr std::string_view kMagic{"\x89HDF\r\n\x1a\n", 8};
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored)) return false;  // a pipe would block for ever
  std::array<char, kMagic.size()> begin{};
  std::ifstream(path, std::ios::binary).read(begin.data(), begin.size());
  return std::string_view(begin.data(), begin.size()) == kMagic;
}

hal::Error hdf5_is_not_read(std::string place) {
  return hal::Error::of(hal::ErrorCode::kMalformed, "this is an HDF5 file", std::move(place), "",
                        "MCAP or CSV",
                        "give the .mcap (hapticctl record get), or the CSV (hapticctl record export)");
}

hal::Error time_does_not_increase(double now_s, double last_s, std::string place) {
  constexpr int kDigits = 13;  // of seconds since 1970, milliseconds are to be seen
  const std::string now = hal::number_text(now_s, kDigits);
  const std::string last = hal::number_text(last_s, kDigits);
  const bool repeats = now == last;
  return hal::Error{.what = repeats ? "two rows have the same time" : "time does not increase",
                    .where = std::move(place),
                    .value = now + " s after " + last + " s",
                    .limit = "each row later than the one before",
                    .remedy = repeats ? "export the time with more decimals, or keep one row of each time"
                                      : "sort the rows by time, or split the file where the time starts again",
                    .code = hal::ErrorCode::kMalformed};
}

std::optional<std::size_t> rows_of_mcap(const std::string& path) {
  const auto file = recording::RecordingFile::open(path);
  if (!file) return std::nullopt;
  std::size_t rows = 0;
  recording::RecordingVisitor count;
  count.row = [&rows](const recording::Row&) {
    ++rows;
    return true;
  };
  if (const auto end = file->read(count); !end) return std::nullopt;
  return rows;
}

}  // namespace hapticd::replay
