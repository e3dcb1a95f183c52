#pragma once

#include <memory>

#include "server/recording/export/table_sink.h"

namespace hapticd::server {

/// HDF5: /telemetry has one dataset for each column (chunks of 4096, shuffled, deflated) with the attributes
/// `unit` and `description`, and `time_s` as the scale of all; /events has one dataset for each part of an
/// event; what is known of the recording are attributes of the root, its longer texts datasets of /metadata.
/// Texts are UTF-8 of variable length; numbers are numbers.
class Hdf5Sink final : public TableSink {
 public:
  static hal::Result<std::unique_ptr<TableSink>> create(const std::string& path,
                                                        std::vector<ExportColumn> columns);
  ~Hdf5Sink() override;

  void add_metadata(const std::string& name, const recording::Texts& texts) override;
  void add_event(const recording::Event& event) override;
  std::optional<hal::Error> add_row(const recording::Row& row) override;
  std::optional<hal::Error> finish() override;

 private:
  struct State;
  explicit Hdf5Sink(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace hapticd::server
