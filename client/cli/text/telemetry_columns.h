#pragma once

#include <google/protobuf/descriptor.h>

#include <string>
#include <vector>

#include "hapticd/v1/telemetry.pb.h"

namespace hapticd::cli {

/// Telemetry as the columns of a table, made from the contract itself: one column for each number of each
/// group, named group_quantity_unit, e.g. "contact_reaction_force_n"; a vector is three columns, e.g.
/// "truth_tip_position_x_mm". First come "tick", "time_s" (the rig's clock) and "scene_generation".
class TelemetryColumns {
 public:
  explicit TelemetryColumns(const std::vector<v1::FieldGroup>& groups);

  std::vector<std::string> names() const;
  /// Comma-separated cells without line end. A cell of an absent group is empty; enumerations are words,
  /// booleans 0 or 1, bit sets words joined by '+' (none: "ok").
  std::string row(const v1::TelemetrySample& sample) const;

 private:
  struct Column {
    std::string name;
    const google::protobuf::FieldDescriptor* group;
    const google::protobuf::FieldDescriptor* quantity;
    const google::protobuf::FieldDescriptor* component;  // of a vector; null for a scalar
  };
  std::vector<Column> columns_;
};

}  // namespace hapticd::cli
