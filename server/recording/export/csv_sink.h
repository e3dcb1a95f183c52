#pragma once

#include <fstream>
#include <memory>

#include "server/recording/export/table_sink.h"

namespace hapticd::server {

/// CSV as `hapticctl telemetry record` writes it: lines with '#' for what is known, one of names that end in
/// their units, one for each row. "time_ns" becomes "time_s". What is not there is "nan". Events are
/// comments.
class CsvSink final : public TableSink {
 public:
  static hal::Result<std::unique_ptr<TableSink>> create(const std::string& path,
                                                        std::vector<ExportColumn> columns);

  void add_metadata(const std::string& name, const recording::Texts& texts) override;
  void add_event(const recording::Event& event) override;
  std::optional<hal::Error> add_row(const recording::Row& row) override;
  std::optional<hal::Error> finish() override;

 private:
  CsvSink(std::string path, std::vector<ExportColumn> columns)
      : path_(std::move(path)), columns_(std::move(columns)) {}
  void comment(const std::string& text);

  std::string path_;
  std::vector<ExportColumn> columns_;
  std::ofstream stream_;
  std::string line_;
  bool has_names_ = false;
};

}  // namespace hapticd::server
