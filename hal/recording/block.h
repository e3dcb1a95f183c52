#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

namespace hapticd::recording {

/// A column of a recording's table.
struct Column {
  std::string name;  ///< group_quantity_unit
  std::string unit;  ///< "1" if it has none
  bool is_integer = false;
};

/// Bytes of a cell: a double, or a signed integer.
inline constexpr std::size_t kCellBytes = 8;
/// Maximum number of columns of a table: a block that names more is damaged. hapticd writes some 200.
inline constexpr std::size_t kMaxColumns = 4096;

/// One row: a cell for each column.
class Row {
 public:
  Row(const char* cells, const std::vector<Column>& columns) : cells_(cells), columns_(columns) {}
  double number(std::size_t column) const {
    return columns_[column].is_integer ? static_cast<double>(integer(column)) : take<double>(column);
  }
  /// Next value of a column of integers.
  std::int64_t integer(std::size_t column) const { return take<std::int64_t>(column); }

 private:
  template <class T>
  T take(std::size_t column) const {
    T value;
    std::memcpy(&value, cells_ + column * kCellBytes, kCellBytes);
    return value;
  }
  const char* cells_;
  const std::vector<Column>& columns_;
};

/// Rows as bytes of a v1::TelemetryBlock message. `columns` as describe() made them, or empty if an earlier
/// block of the chunk has them.
std::string block_message(std::string_view columns, std::string_view rows);
/// Describes the columns, as the beginning of a block.
std::string describe(const std::vector<Column>& columns);

/// A block as it was read; valid as long as the message.
struct Block {
  std::vector<Column> columns;  ///< empty if the block does not name them
  std::string_view rows;
};
/// False if the bytes are not such a message.
bool read_block(std::string_view message, Block& block);

/// What happened while a recording ran: a v1::RecordingEvent message.
enum class EventKind : std::uint8_t {
  kUnspecified,
  kScene,           ///< loaded or unloaded
  kTarget,          ///< set by a client
  kFault,           ///< the guard latched, or gave way to a fault that ends by itself
  kCleared,         ///< the guard renders again
  kStop,            ///< a client's stop
  kLease,           ///< control of the rig changed hands
  kTurntable,       ///< a motion, or a command to the table
  kAnnotation,      ///< a client's note
  kLoss,            ///< ticks that are missing from here on
  kCommand,         ///< any other command of a client
  kOverrun,         ///< a period was overrun
  kEnd,             ///< the recording ended, and why
  kRecording,       ///< a client started, stopped or deleted one
  kIncident,        ///< the flight recorder kept the seconds around a fault
  kIdentification,  ///< one, or a calibration, began or ended
  kSensor,          ///< a bias, or the device's reset pose
  kDaemon,          ///< it started, or the clock of its machine was set
};
struct Event {
  std::int64_t time_ns = 0;  ///< of the rig's clock
  std::uint64_t tick = 0;
  std::int64_t unix_ns = 0;  ///< since 1970, UTC
  EventKind kind = EventKind::kUnspecified;
  std::string text;
  std::string by;                ///< identity of the client; empty: none
  std::uint64_t lost_ticks = 0;  ///< kLoss
};
std::string event_message(const Event& event);
bool read_event(std::string_view message, Event& event);
/// "scene", "target" …
const char* name_of(EventKind kind) noexcept;

}  // namespace hapticd::recording
