#include "client/cli/text/telemetry_columns.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <string_view>

#include "client/cli/text/names.h"

namespace hapticd::cli {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

/// Returns the position at which the unit begins, its '_' included: "_n_mm" in "torque_n_mm", "_mm_per_s" in
/// "speed_mm_per_s".
std::size_t unit_place(const std::string& quantity) {
  constexpr std::string_view kTorque = "_n_mm";
  if (quantity.ends_with(kTorque)) return quantity.size() - kTorque.size();
  const auto per = quantity.find("_per_");
  return quantity.rfind('_', per == std::string::npos ? per : per - 1);
}

/// "tip_position_mm" and "x" → "tip_position_x_mm"; what has no unit, "normal" and "x" → "normal_x".
std::string component_name(const std::string& quantity, const std::string& component) {
  const auto unit = unit_place(quantity);
  if (unit == std::string::npos) return quantity + "_" + component;
  return quantity.substr(0, unit) + "_" + component + quantity.substr(unit);
}

std::string cell(const Message& message, const FieldDescriptor& field) {
  const auto& access = *message.GetReflection();
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return fmt::format("{:.7g}", access.GetDouble(message, &field));
    case FieldDescriptor::CPPTYPE_BOOL:
      return access.GetBool(message, &field) ? "1" : "0";
    case FieldDescriptor::CPPTYPE_ENUM:
      return enum_word(*field.enum_type(), access.GetEnumValue(message, &field));
    case FieldDescriptor::CPPTYPE_INT32:
      return fmt::format("{}", access.GetInt32(message, &field));
    case FieldDescriptor::CPPTYPE_INT64:
      return fmt::format("{}", access.GetInt64(message, &field));
    case FieldDescriptor::CPPTYPE_UINT64:
      return fmt::format("{}", access.GetUInt64(message, &field));
    case FieldDescriptor::CPPTYPE_UINT32: {
      const std::uint32_t value = access.GetUInt32(message, &field);
      if (!field.name().ends_with("_bits")) return fmt::format("{}", value);
      return value == 0 ? "ok" : fmt::format("{}", fmt::join(bit_words(field.name(), value), "+"));
    }
    default:
      return "";
  }
}

std::string seconds(std::int64_t time_ns) {
  const bool negative = time_ns < 0;
  const std::int64_t magnitude = negative ? -time_ns : time_ns;
  return fmt::format("{}{}.{:09}", negative ? "-" : "", magnitude / 1'000'000'000, magnitude % 1'000'000'000);
}

}  // namespace

TelemetryColumns::TelemetryColumns(const std::vector<v1::FieldGroup>& groups) {
  const auto& sample = *v1::TelemetrySample::descriptor();
  for (const v1::FieldGroup wanted : groups) {
    const FieldDescriptor* group = sample.FindFieldByName(word(wanted));
    if (group == nullptr || group->message_type() == nullptr) continue;
    for (int i = 0; i < group->message_type()->field_count(); ++i) {
      const FieldDescriptor* quantity = group->message_type()->field(i);
      // "contact_count", not "contact_contact_count".
      const std::string own = group->name() + "_";
      const std::string prefix = quantity->name().starts_with(own) ? "" : own;
      if (quantity->message_type() == nullptr) {
        columns_.push_back({prefix + quantity->name(), group, quantity, nullptr});
        continue;
      }
      for (int j = 0; j < quantity->message_type()->field_count(); ++j) {
        const FieldDescriptor* component = quantity->message_type()->field(j);
        columns_.push_back(
            {prefix + component_name(quantity->name(), component->name()), group, quantity, component});
      }
    }
  }
}

std::vector<std::string> TelemetryColumns::names() const {
  std::vector<std::string> result{"tick", "time_s", "scene_generation"};
  for (const Column& column : columns_) result.push_back(column.name);
  return result;
}

std::string TelemetryColumns::row(const v1::TelemetrySample& sample) const {
  std::string line =
      fmt::format("{},{},{}", sample.tick(), seconds(sample.time_ns()), sample.scene_generation());
  const auto& access = *sample.GetReflection();
  for (const Column& column : columns_) {
    line += ',';
    if (!access.HasField(sample, column.group)) continue;
    const Message& group = access.GetMessage(sample, column.group);
    if (column.component == nullptr) {
      line += cell(group, *column.quantity);
    } else {
      line += cell(group.GetReflection()->GetMessage(group, column.quantity), *column.component);
    }
  }
  return line;
}

}  // namespace hapticd::cli
