#include "hal/recording/block.h"

#include "hal/recording/wire.h"

namespace hapticd::recording {

namespace {

// Numbers of the fields, as proto/hapticd/v1/telemetry.proto and recording.proto have them.
constexpr std::uint32_t kColumns = 1;
constexpr std::uint32_t kRows = 2;
constexpr std::uint32_t kColumnName = 1;
constexpr std::uint32_t kColumnUnit = 2;
constexpr std::uint32_t kColumnType = 3;
constexpr std::uint64_t kFloat64 = 1;
constexpr std::uint64_t kInt64 = 2;

constexpr std::uint32_t kTime = 1;
constexpr std::uint32_t kTick = 2;
constexpr std::uint32_t kUnixTime = 3;
constexpr std::uint32_t kKind = 4;
constexpr std::uint32_t kText = 5;
constexpr std::uint32_t kBy = 6;
constexpr std::uint32_t kLostTicks = 7;

bool read_column(std::string_view message, Column& column) {
  WireReader reader(message);
  WireField field;
  while (reader.next(field)) {
    if (field.number == kColumnName) column.name = field.bytes;
    if (field.number == kColumnUnit) column.unit = field.bytes;
    if (field.number == kColumnType) column.is_integer = field.value == kInt64;
  }
  return !reader.failed();
}

}  // namespace

std::string describe(const std::vector<Column>& columns) {
  std::string out;
  for (const Column& column : columns) {
    std::string one;
    put_bytes_field(kColumnName, column.name, one);
    put_bytes_field(kColumnUnit, column.unit, one);
    put_number_field(kColumnType, column.is_integer ? kInt64 : kFloat64, one);
    put_bytes_field(kColumns, one, out);
  }
  return out;
}

std::string block_message(std::string_view columns, std::string_view rows) {
  std::string out;
  out.reserve(columns.size() + rows.size() + 16);
  out += columns;
  put_bytes_field(kRows, rows, out);
  return out;
}

bool read_block(std::string_view message, Block& block) {
  WireReader reader(message);
  WireField field;
  while (reader.next(field)) {
    if (field.number == kColumns &&
        (block.columns.size() == kMaxColumns || !read_column(field.bytes, block.columns.emplace_back()))) {
      return false;
    }
    if (field.number == kRows) block.rows = field.bytes;
  }
  return !reader.failed();
}

std::string event_message(const Event& event) {
  std::string out;
  put_number_field(kTime, static_cast<std::uint64_t>(event.time_ns), out);
  put_number_field(kTick, event.tick, out);
  put_number_field(kUnixTime, static_cast<std::uint64_t>(event.unix_ns), out);
  put_number_field(kKind, static_cast<std::uint64_t>(event.kind), out);
  put_bytes_field(kText, event.text, out);
  put_bytes_field(kBy, event.by, out);
  put_number_field(kLostTicks, event.lost_ticks, out);
  return out;
}

bool read_event(std::string_view message, Event& event) {
  WireReader reader(message);
  WireField field;
  while (reader.next(field)) {
    switch (field.number) {
      case kTime:
        event.time_ns = static_cast<std::int64_t>(field.value);
        break;
      case kTick:
        event.tick = field.value;
        break;
      case kUnixTime:
        event.unix_ns = static_cast<std::int64_t>(field.value);
        break;
      case kKind:
        event.kind = static_cast<EventKind>(
            field.value <= static_cast<std::uint64_t>(EventKind::kDaemon) ? field.value : 0);
        break;
      case kText:
        event.text = field.bytes;
        break;
      case kBy:
        event.by = field.bytes;
        break;
      case kLostTicks:
        event.lost_ticks = field.value;
        break;
      default:
        break;
    }
  }
  return !reader.failed();
}

const char* name_of(EventKind kind) noexcept {
  switch (kind) {
    case EventKind::kScene:
      return "scene";
    case EventKind::kTarget:
      return "target";
    case EventKind::kFault:
      return "fault";
    case EventKind::kCleared:
      return "cleared";
    case EventKind::kStop:
      return "stop";
    case EventKind::kLease:
      return "lease";
    case EventKind::kTurntable:
      return "turntable";
    case EventKind::kAnnotation:
      return "annotation";
    case EventKind::kLoss:
      return "loss";
    case EventKind::kCommand:
      return "command";
    case EventKind::kOverrun:
      return "overrun";
    case EventKind::kEnd:
      return "end";
    case EventKind::kRecording:
      return "recording";
    case EventKind::kIncident:
      return "incident";
    case EventKind::kIdentification:
      return "identification";
    case EventKind::kSensor:
      return "sensor";
    case EventKind::kDaemon:
      return "daemon";
    case EventKind::kUnspecified:
      break;
  }
  return "other";
}

}  // namespace hapticd::recording
